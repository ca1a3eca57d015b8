//! The controller of an array of actuators: rows of references and measurements in, rows of drives out.

use hysteresis_core::{self as core, ArrayOptions, ArraySample, MAX_MAGNITUDE, Mode, QuasiStaticInverse};
use hysteresis_python_macros::methods;
use numpy::ndarray::{Array2, Dimension, Ix1, Ix2, IxDyn};
use numpy::{IntoPyArray, PyArray, PyArray1, PyArray2, PyReadonlyArray, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pythonize::pythonize;

use crate::argument::Object;
use crate::control::shared_by_controllers::mode_name;
use crate::convert::arrays::{array, each, one_or_more};
use crate::convert::errors::{self, raise};
use crate::convert::objects::{Reduced, exclusive, keywords, saved, shared};
use crate::stream::actuators::{ActuatorArray, Limits};
use crate::stream::blocks::{BLOCK, Block, apply};
use crate::stream::of_kind::{OfKind, map_kind, of_kind};
use crate::stream::stream_arrays::{MadeOf, columns};

/// Feed-forward through the exact inverses of M actuators and an integral behind a reconstruction matrix, within limits
/// at every sample: made by `array.controller(...)`.
///
/// a(k) = a(k-1) + dt (ki e(k) - leak a(k-1)), e = R (sensor reference - measurement), target(k) = reference(k) + a(k)
/// + bumpless(k), drive of actuator i = H_i^-1[target_i]. Reference, integral a and bumpless term are displacements.
/// With a `reconstruction` matrix R of shape (M, S) the sensor reference is zero unless it is given, so the feedback
/// brings the sensors to zero. Without one sensor i measures actuator i, and the sensor reference is the reference. ki
/// and leak are per second: behind the exact inverse the loop is linear, so one gain suits all actuators.
///
/// The drives are always finite, within their limits, and no farther than slew dt from the last ones. The inverses
/// remember the drives that go out. Where limits hold an actuator back, its integral takes of its change what the
/// actuator can follow. The modelled positions of neighbours are never farther apart than `max_difference`; where they
/// are already, at the start, the difference never grows.
///
/// A motion starts from the present drives: at the first sample, after a reset, a hold or a stop, and after a sample
/// that was rejected. `bumpless` takes the difference and goes to zero in a straight line.
///
/// A reference that is not finite (or beyond 1e100) holds all drives. A measurement that is not finite lets the
/// integral rest: that of its actuator without a matrix, all of them with one. Feed-forward goes on.
///
/// In an array of stages H_i^-1 inverts Duhem operator, maps, loop shift, relaxing plays, slow gain and creep too, not
/// the dynamics. These go on also while the drives stay. The controller counters what creeps in every motion and stop;
/// only where drives stay, or limits or slew hold one back, may neighbours creep apart.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> mirror = mh.ActuatorArray([mh.paper.table_1_recovered()] * 3)
/// >>> influence = np.array([[1.0, 0.3, 0.0], [0.3, 1.0, 0.3], [0.0, 0.3, 1.0], [0.2, 0.0, 0.2]])  # 4 sensors
/// >>> controller = mirror.controller(1e-3, (-500.0, 500.0), ki=200.0, reconstruction=np.linalg.pinv(influence))
/// >>> plant, wavefront = mirror.forward(), np.zeros(4)
/// >>> for k in range(200):
/// ...     drives = controller.step(np.zeros(3), wavefront)
/// ...     wavefront = influence @ (plant.step(drives) - [0.5, -0.2, 0.1])  # what is to be flattened
/// >>> bool(abs(wavefront).max() < 1e-6)
/// True
/// >>> np.round(controller.position, 6)
/// array([ 0.5, -0.2,  0.1])
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct ArrayController {
    controller: OfKind<core::ArrayController, core::ArrayController<QuasiStaticInverse>>,
    made: MadeOf,
}

/// What comes with a sample, or with a block of samples, beside the references.
struct Beside<'py, D: Dimension> {
    measurement: Option<PyReadonlyArray<'py, f64, D>>,
    sensor_reference: Option<PyReadonlyArray<'py, f64, D>>,
}

impl<'py, D: Dimension> Beside<'py, D> {
    fn new(
        measurement: Option<&Bound<'py, PyAny>>,
        sensor_reference: Option<&Bound<'py, PyAny>>,
        shape: &[usize],
    ) -> PyResult<Self> {
        let one = |name, given: Option<&Bound<'py, PyAny>>| {
            let Some(given) = given else { return Ok(None) };
            let expected =
                if let [sensors] = shape { format!("({sensors},)") } else { format!("({}, {})", shape[0], shape[1]) };
            let samples = array::<D>(name, given, format_args!("an array of shape {expected}"))?;
            if samples.shape() == shape {
                return Ok(Some(samples));
            }
            let got = samples.getattr(intern!(given.py(), "shape"))?;
            Err(errors::value(name, format_args!("expected an array of shape {expected}, got shape {got}")))
        };
        Ok(Self {
            measurement: one("measurement", measurement)?,
            sensor_reference: one("sensor_reference", sensor_reference)?,
        })
    }

    /// The sample, or block, with these references.
    fn with<'a>(&'a self, reference: &'a [f64]) -> PyResult<ArraySample<'a>> {
        let slice =
            |given: &'a Option<PyReadonlyArray<'py, f64, D>>| given.as_ref().map(|one| one.as_slice()).transpose();
        let (measurement, sensor_reference) = (slice(&self.measurement)?, slice(&self.sensor_reference)?);
        Ok(ArraySample { reference, measurement, sensor_reference })
    }
}

/// One sample through `work` into `out` or a new array.
fn sample<'py, D: Dimension>(
    reference: PyReadonlyArray<'py, f64, D>,
    out: Option<&Bound<'py, PyAny>>,
    mut work: impl FnMut(&[f64], &mut [f64]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    apply(reference, out, |block| match block {
        Block::Apart(reference, drives) => work(reference, drives),
        Block::InPlace(both) => {
            let reference = both.to_vec();
            work(&reference, both)
        }
    })
}

#[methods]
impl ArrayController {
    /// Takes a sample and gives the drives, an array of shape (M,), in `out` or a new array.
    ///
    /// `reference`: the positions that are wanted, shape (M,). `measurement`: what the sensors show, shape (S,); None
    /// for feed-forward alone, the integral staying as it is. `sensor_reference`: what the sensors are to show, shape
    /// (S,); by default zero, or the reference if there is no reconstruction matrix.
    fn step<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] reference: &Bound<'py, PyAny>,
        #[py("ArrayLike | None" = None)] measurement: Option<&Bound<'py, PyAny>>,
        #[py(*, "ArrayLike | None" = None)] sensor_reference: Option<&Bound<'py, PyAny>>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (reference, beside) = Self::one(slf, reference, measurement, sensor_reference)?;
        sample(reference, out, |reference, drives| {
            let sample = beside.with(reference)?;
            of_kind!(&mut exclusive(slf)?.controller, of => of.step(&sample, drives)).map_err(raise)
        })
    }

    /// The drives that `step` would give, without taking the sample.
    #[like(step)]
    fn peek<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (reference, beside) = Self::one(slf, reference, measurement, sensor_reference)?;
        sample(reference, out, |reference, drives| {
            let sample = beside.with(reference)?;
            of_kind!(&mut exclusive(slf)?.controller, of => of.peek(&sample, drives)).map_err(raise)
        })
    }

    /// Takes rows of samples, bit for bit like `step` in a loop: `reference` of shape (samples, M), `measurement` and
    /// `sensor_reference` of shape (samples, S). The drives, of shape (samples, M), come in `out` or a new array.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] reference: &Bound<'py, PyAny>,
        #[py("ArrayLike | None" = None)] measurement: Option<&Bound<'py, PyAny>>,
        #[py(*, "ArrayLike | None" = None)] sensor_reference: Option<&Bound<'py, PyAny>>,
        #[py("Matrix | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (py, (actuators, sensors)) = (slf.py(), Self::widths(slf)?);
        let expected = format!("an array of shape (samples, {actuators})");
        let reference: PyReadonlyArray2<'_, f64> =
            columns("reference", reference, actuators, format_args!("{expected}"))?;
        let beside = Beside::<Ix2>::new(measurement, sensor_reference, &[reference.shape()[0], sensors])?;
        // Between two looks at pending signals: enough rows to be worth it.
        let rows = (BLOCK / actuators.max(sensors)).max(1);
        sample(reference, out, |reference, drives| {
            let ArraySample { reference, measurement, sensor_reference } = beside.with(reference)?;
            let mut this = exclusive(slf)?;
            let blocks = reference.chunks(rows * actuators).zip(drives.chunks_mut(rows * actuators));
            for (k, (reference, drives)) in blocks.enumerate() {
                py.check_signals()?;
                let (from, to) = (k * rows * sensors, (k + 1) * rows * sensors);
                let (measurement, sensor_reference) = (part(measurement, from, to), part(sensor_reference, from, to));
                let block = ArraySample { reference, measurement, sensor_reference };
                of_kind!(&mut this.controller, of => of.run(&block, drives)).map_err(raise)?;
            }
            Ok(())
        })
    }

    /// The present drives: what the amplifiers have.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, of_kind!(&self.controller, of => of.drives()))
    }

    /// Where the models are at the present drives; stages, where they were at the last sample.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        of_kind!(&self.controller, of => PyArray1::from_iter(py, of.positions()))
    }

    /// The integral of every actuator, a displacement.
    #[getter]
    fn integral<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, of_kind!(&self.controller, of => of.integral()))
    }

    /// The limits (low, high) of the drives, an array of shape (M, 2).
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows: Vec<[f64; 2]> =
            of_kind!(&self.controller, of => of.limits()).iter().map(|limits| (*limits).into()).collect();
        Array2::from(rows).into_pyarray(py)
    }

    /// The number of sensors S.
    #[getter]
    fn sensors(&self) -> usize {
        of_kind!(&self.controller, of => of.sensors())
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        of_kind!(&self.controller, of => of.options()).dt
    }

    /// The integral gain per second.
    #[getter]
    fn ki(&self) -> f64 {
        of_kind!(&self.controller, of => of.options()).ki
    }

    /// How fast the integral goes to zero by itself, per second.
    #[getter]
    fn leak(&self) -> f64 {
        of_kind!(&self.controller, of => of.options()).leak
    }

    /// "run"; "hold": the drives stay; "stop", which `stop` begins.
    #[getter]
    #[py(-> "Literal['run', 'hold', 'stop']")]
    fn mode(&self) -> &'static str {
        mode_name(of_kind!(&self.controller, of => of.mode()))
    }

    /// How many samples had a reference that is not finite, or beyond 1e100: all drives were held.
    #[getter]
    fn rejected_count(&self) -> u64 {
        of_kind!(&self.controller, of => of.counters()).rejected_count
    }

    /// How many samples had a measurement that is not finite, or beyond 1e100.
    #[getter]
    fn missing_count(&self) -> u64 {
        of_kind!(&self.controller, of => of.counters()).missing_count
    }

    /// How many drives a target out of reach brought to a limit: of all actuators together.
    #[getter]
    fn saturated_count(&self) -> u64 {
        of_kind!(&self.controller, of => of.counters()).saturated_count
    }

    /// How many drives the slew held back: of all actuators together.
    #[getter]
    fn slewing_count(&self) -> u64 {
        of_kind!(&self.controller, of => of.counters()).slewing_count
    }

    /// In how many samples the limits of differences moved at least one target.
    #[getter]
    fn pair_limited_count(&self) -> u64 {
        of_kind!(&self.controller, of => of.counters()).pair_limited_count
    }

    fn __len__(&self) -> usize {
        of_kind!(&self.controller, of => of.len())
    }

    fn __repr__(&self) -> String {
        let (actuators, sensors) =
            (of_kind!(&self.controller, of => of.len()), of_kind!(&self.controller, of => of.sensors()));
        let ArrayOptions { ki, leak, .. } = of_kind!(&self.controller, of => of.options());
        format!(
            "<ArrayController of {actuators} actuators, {sensors} sensors, ki {ki}, leak {leak}, mode {}>",
            self.mode()
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let options = of_kind!(&this.controller, of => of.options());
        let keywords = keywords!(
            py,
            dt = options.dt,
            slew = some(&options.slew),
            max_difference = some(&options.max_difference),
            start_drive = &options.start_drive,
        );
        ActuatorArray::put_options(options, &keywords)?;
        if !options.neighbours.is_empty() {
            keywords.set_item("neighbours", &options.neighbours)?;
        }
        if let Some(matrix) = &options.reconstruction {
            let shape = (of_kind!(&this.controller, of => of.len()), of_kind!(&this.controller, of => of.sensors()));
            let matrix = Array2::from_shape_vec(shape, matrix.clone()).expect("whole rows");
            keywords.set_item("reconstruction", matrix.into_pyarray(py))?;
        }
        this.made.reduce_with(py, "controller", keywords, Self::state(slf)?)
    }
}

impl ArrayController {
    fn widths(slf: &Bound<'_, Self>) -> PyResult<(usize, usize)> {
        let this = shared(slf)?;
        Ok((of_kind!(&this.controller, of => of.len()), of_kind!(&this.controller, of => of.sensors())))
    }

    /// One sample, converted and checked.
    fn one<'py>(
        slf: &Bound<'py, Self>,
        reference: &Bound<'py, PyAny>,
        measurement: Option<&Bound<'py, PyAny>>,
        sensor_reference: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(PyReadonlyArray<'py, f64, Ix1>, Beside<'py, Ix1>)> {
        let (actuators, sensors) = Self::widths(slf)?;
        let expected = format!("an array of shape ({actuators},)");
        let reference = columns("reference", reference, actuators, format_args!("{expected}"))?;
        Ok((reference, Beside::new(measurement, sensor_reference, &[sensors])?))
    }
}

/// Some of what need not be given, as far as it goes.
fn part(given: Option<&[f64]>, from: usize, to: usize) -> Option<&[f64]> {
    given.map(|all| &all[from.min(all.len())..to.min(all.len())])
}

/// Numbers, or None if there are none.
fn some(numbers: &[f64]) -> Option<&[f64]> {
    (!numbers.is_empty()).then_some(numbers)
}

/// The slew of every stage; one that has none may move by any step. None if all may.
fn own_slew(array: &ActuatorArray) -> Vec<f64> {
    let OfKind::Stages(stages) = array.actuators() else { return Vec::new() };
    let each: Vec<_> = stages.iter().map(|stage| stage.get().0.parts().slew).collect();
    if each.iter().all(Option::is_none) {
        return Vec::new();
    }
    each.into_iter().map(|slew| slew.unwrap_or(MAX_MAGNITUDE)).collect()
}

/// Pairs of actuators, P rows of two whole numbers.
fn pairs(neighbours: &Bound<'_, PyAny>) -> PyResult<Vec<(usize, usize)>> {
    let expected = "an array of shape (pairs, 2) of whole numbers of at least zero";
    let rows = array::<IxDyn>("neighbours", neighbours, format_args!("{expected}"))?;
    if !matches!(rows.shape(), [_, 2]) {
        let shape = rows.getattr(intern!(neighbours.py(), "shape"))?;
        return Err(errors::value("neighbours", format_args!("expected {expected}, got shape {shape}")));
    }
    let whole = |number: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number that is checked")]
        if number >= 0.0 && number.fract() == 0.0 && number <= 1e15 {
            Ok(number as usize)
        } else {
            Err(errors::value("neighbours", format_args!("expected {expected}, got {number:?}")))
        }
    };
    rows.as_slice()?.chunks_exact(2).map(|pair| Ok((whole(pair[0])?, whole(pair[1])?))).collect()
}

#[methods]
impl ActuatorArray {
    /// A controller of all actuators, with the exact inverses at rest.
    ///
    /// Parameters
    /// ----------
    /// dt : float
    ///     The sampling interval in seconds.
    /// limits : (low, high) or array of shape (M, 2)
    ///     Of the drives, in volts. Stages have theirs by default.
    /// ki : float
    ///     The integral gain per second. With direct sensors and one sample of delay the loop is stable below ki dt =
    ///     1, and calm at 0.3.
    /// reconstruction : array of shape (M, S), optional
    ///     What makes errors of the actuators of those of S sensors, such as the pseudo-inverse of the measured
    ///     response matrix. Without it sensor i measures actuator i.
    /// leak : float
    ///     How fast the integral goes to zero by itself, per second: at most 1 / dt.
    /// slew : float or array of shape (M,), optional
    ///     How fast the drives may move, in V/s. Stages have theirs by default.
    /// neighbours : array of shape (P, 2), optional
    ///     Pairs of actuators, by their numbers, whose positions must not be too far apart.
    /// max_difference : float or array of shape (P,), optional
    ///     How far the modelled positions of each pair may be apart. Given with `neighbours`.
    /// bumpless_time : float
    ///     How long, in seconds, the difference at a start takes to go to zero. From a start on the integral rests for
    ///     that time.
    /// start_drive : float or array of shape (M,), optional
    ///     The drives that the amplifiers have at the start: by default zero or the limit nearest to it.
    ///
    /// Returns
    /// -------
    /// ArrayController
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    /// NotInvertibleError
    ///     That names the first actuator whose model may not be invertible.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
    /// >>> controller = mirror.controller(
    /// ...     1e-3, (-10.0, 10.0), slew=2e4, neighbours=[(0, 1), (1, 2)], max_difference=2.0, bumpless_time=0.0
    /// ... )
    /// >>> _ = controller.step([0.0, 0.0, 0.0])  # a motion starts from the drives that are there
    /// >>> _ = controller.step([3.0, 3.0, 9.0])  # the last step is too high
    /// >>> controller.position.round(6)
    /// array([3., 5., 7.])
    #[gather(options: ArrayOptions = ArrayOptions::new(dt), put_options)]
    fn controller(
        slf: &Bound<'_, Self>,
        dt: f64,
        #[py("ArrayLike | None" = None)] limits: Option<&Bound<'_, PyAny>>,
        #[py(*, field = 0.0)] ki: f64,
        #[py("ArrayLike | None" = None)] reconstruction: Option<&Bound<'_, PyAny>>,
        #[py(field = 0.0)] leak: f64,
        #[py("ArrayLike | None" = None)] slew: Option<&Bound<'_, PyAny>>,
        #[py("ArrayLike | None" = None)] neighbours: Option<&Bound<'_, PyAny>>,
        #[py("ArrayLike | None" = None)] max_difference: Option<&Bound<'_, PyAny>>,
        #[py(field = 0.005)] bumpless_time: f64,
        #[py("ArrayLike | None" = None)] start_drive: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ArrayController> {
        let (this, actuators) = (slf.get(), slf.get().count());
        let given = Limits::from_python(limits, actuators)?;
        let matrix = |given: &Bound<'_, PyAny>| {
            let expected = format!("an array of shape ({actuators}, sensors)");
            let rows = array::<Ix2>("reconstruction", given, format_args!("{expected}"))?;
            if rows.shape()[0] == actuators && rows.shape()[1] > 0 {
                return Ok(rows.as_slice()?.to_vec());
            }
            let shape = rows.getattr(intern!(given.py(), "shape"))?;
            Err(errors::value("reconstruction", format_args!("expected {expected}, got shape {shape}")))
        };
        let neighbours = neighbours.map_or(Ok(Vec::new()), pairs)?;
        let differences = |given| {
            one_or_more("max_difference", given, format_args!("a number or an array of shape ({},)", neighbours.len()))
        };
        let max_difference = max_difference.map_or(Ok(Vec::new()), differences)?;
        let options = ArrayOptions {
            reconstruction: reconstruction.map(matrix).transpose()?,
            slew: slew.map_or(Ok(own_slew(this)), |slew| {
                one_or_more("slew", slew, format_args!("a number or an array of shape ({actuators},)"))
            })?,
            neighbours,
            max_difference,
            start_drive: start_drive.map(|drive| each("start_drive", drive, actuators)).transpose()?,
            ..options
        };
        let inverse = this.inverses(slf.py(), &given, None, this.interval(dt))?;
        let controller = map_kind!(inverse, of => core::ArrayController::new(of, &options).map_err(raise)?);
        Ok(ArrayController { controller, made: MadeOf::new(slf.as_any(), limits) })
    }
}

#[methods]
impl ArrayController {
    /// Changes the gains, per second, without a jump. The leak stays unless it is given.
    fn set_gains(slf: &Bound<'_, Self>, ki: f64, #[py(= None)] leak: Option<f64>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let leak = leak.unwrap_or(of_kind!(&this.controller, of => of.options()).leak);
        of_kind!(&mut this.controller, of => of.set_gains(ki, leak)).map_err(raise)
    }

    /// One actuator goes on with the weights and the output offset of another model of the same thresholds and input
    /// offset, without a jump. In an array of stages the model is the hysteresis of the stage.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; the
    /// controller is as before then.
    fn set_model(slf: &Bound<'_, Self>, actuator: usize, #[py("Model")] model: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let Self { controller, made } = &mut *this;
        made.set_model(actuator, model, |compiled| of_kind!(controller, of => of.set_model(actuator, compiled)))
    }

    /// Whether the drives are held. An attribute: set it to True to hold, to False to go on, also after a stop.
    #[getter]
    fn hold(&self) -> bool {
        of_kind!(&self.controller, of => of.mode()) == Mode::Hold
    }

    #[setter]
    fn set_hold(slf: &Bound<'_, Self>, hold: bool) -> PyResult<()> {
        if hold {
            of_kind!(&mut exclusive(slf)?.controller, of => of.hold());
        } else {
            of_kind!(&mut exclusive(slf)?.controller, of => of.release());
        }
        Ok(())
    }

    /// Ramps the drives to `rest_drive` (V), one for all or one for each, at `rate` (V/s), or at the slew if that is
    /// slower, and holds them there.
    ///
    /// From the next sample on every `step` puts out the next drives of the ramp, for any reference and measurement.
    /// `hold = False` starts a motion from the drives that are reached then.
    fn stop(slf: &Bound<'_, Self>, rate: f64, #[py("ArrayLike" = 0.0)] rest_drive: Object) -> PyResult<()> {
        let rest = each("rest_drive", rest_drive.0.bind(slf.py()), of_kind!(&shared(slf)?.controller, of => of.len()))?;
        of_kind!(&mut exclusive(slf)?.controller, of => of.stop(rate, &rest)).map_err(raise)
    }

    /// Back to the start, in mode "run", with the memory of a move from rest to the present drives and all counters at
    /// zero. The drives stay as they are, or are `drive`, one for all or one for each, if the amplifiers have others
    /// now.
    fn reset(slf: &Bound<'_, Self>, #[py("ArrayLike | None" = None)] drive: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let actuators = of_kind!(&shared(slf)?.controller, of => of.len());
        let drive = drive.map(|drive| each("drive", drive, actuators)).transpose()?;
        let mut this = exclusive(slf)?;
        if let Some(drives) = drive {
            return of_kind!(&mut this.controller, of => of.reset_at(&drives)).map_err(raise);
        }
        of_kind!(&mut this.controller, of => of.reset());
        Ok(())
    }

    /// Takes over what was driven before, an array of shape (samples, M), oldest drives first; the next motion starts
    /// from the last row.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let actuators = of_kind!(&shared(slf)?.controller, of => of.len());
        let expected = format!("an array of shape (samples, {actuators})");
        let drives = columns::<Ix2>("drives", drives, actuators, format_args!("{expected}"))?;
        let drives = drives.as_slice()?;
        of_kind!(&mut exclusive(slf)?.controller, of => of.follow(drives)).map_err(raise)
    }

    /// Everything that the controller remembers, as a dictionary to keep; set it to continue from there bit for bit.
    /// The amplifiers must be at its drives. A controller with other gains or dt refuses it; models and limits are not
    /// part of it.
    #[getter]
    #[py(-> "dict[str, Any]")]
    pub(super) fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        // What Python makes of it may let other threads in.
        let state = map_kind!(&shared(slf)?.controller, of => of.state());
        Ok(of_kind!(&state, state => pythonize(slf.py(), state))?)
    }

    #[setter]
    pub(super) fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut restored = map_kind!(&shared(slf)?.controller, of => of.clone());
        match &mut restored {
            OfKind::Models(of) => of.set_state(&saved(state)?),
            OfKind::Stages(of) => of.set_state(&saved(state)?),
        }
        .map_err(raise)?;
        exclusive(slf)?.controller = restored;
        Ok(())
    }
}
