//! The controller of an array of actuators: rows of references and measurements in, rows of drives out.

use hysteresis_core::{self as core, ArrayOptions, ArraySample};
use hysteresis_python_macros::methods;
use numpy::ndarray::{Array2, Dimension, Ix1, Ix2};
use numpy::{IntoPyArray, PyArray, PyArray1, PyArray2, PyReadonlyArray, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;

use super::controller_options::mode_name;
use crate::convert::arrays::array;
use crate::convert::errors::{self, raise};
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::{Reduced, keywords};
use crate::stream::blocks::{BLOCK, Block, apply};
use crate::stream::stream_arrays::{MadeOf, columns};

/// Feed-forward through the exact inverses of M actuators and an integral behind a reconstruction matrix, within limits at every
/// sample: made by `array.controller(...)`.
///
/// a(k) = a(k-1) + dt (ki e(k) - leak a(k-1)), e = R (sensor reference - measurement), target(k) = reference(k) + a(k) +
/// bumpless(k), drive of actuator i = H_i^-1[target_i]. Reference, integral a and bumpless term are displacements. With a
/// `reconstruction` matrix R of shape (M, S) the sensor reference is zero unless it is given, so the feedback brings the sensors
/// to zero. Without one sensor i measures actuator i, and the sensor reference is the reference. ki and leak are per second:
/// behind the exact inverse the loop is linear, so one gain suits all actuators.
///
/// The drives are always finite, within their limits, and no farther than slew dt from the last ones. The inverses remember the
/// drives that go out. Where limits hold an actuator back, its integral takes of its change what the actuator can follow. The
/// modelled positions of neighbours are never farther apart than `max_difference`; where they are already, at the start, the
/// difference never grows.
///
/// A motion starts from the present drives: at the first sample, after a reset, a hold or a stop, and after a sample that was
/// rejected. `bumpless` takes the difference and goes to zero in a straight line.
///
/// A reference that is not finite (or beyond 1e100) holds all drives. A measurement that is not finite lets the integral rest:
/// that of its actuator without a matrix, all of them with one. Feed-forward goes on.
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
    pub(super) controller: core::ArrayController,
    pub(super) made: MadeOf,
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
    /// `reference`: the positions that are wanted, shape (M,). `measurement`: what the sensors show, shape (S,); None for
    /// feed-forward alone, the integral staying as it is. `sensor_reference`: what the sensors are to show, shape (S,); by default
    /// zero, or the reference if there is no reconstruction matrix.
    fn step<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] reference: &Bound<'py, PyAny>,
        #[py("ArrayLike | None" = None)] measurement: Option<&Bound<'py, PyAny>>,
        #[py(*, "ArrayLike | None" = None)] sensor_reference: Option<&Bound<'py, PyAny>>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (reference, beside) = Self::one(slf, reference, measurement, sensor_reference)?;
        sample(reference, out, |reference, drives| {
            exclusive(slf)?.controller.step(&beside.with(reference)?, drives).map_err(raise)
        })
    }

    /// The drives that `step` would give, without taking the sample.
    fn peek<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] reference: &Bound<'py, PyAny>,
        #[py("ArrayLike | None" = None)] measurement: Option<&Bound<'py, PyAny>>,
        #[py(*, "ArrayLike | None" = None)] sensor_reference: Option<&Bound<'py, PyAny>>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (reference, beside) = Self::one(slf, reference, measurement, sensor_reference)?;
        sample(reference, out, |reference, drives| {
            exclusive(slf)?.controller.peek(&beside.with(reference)?, drives).map_err(raise)
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
                this.controller.run(&block, drives).map_err(raise)?;
            }
            Ok(())
        })
    }

    /// The present drives: what the amplifiers have.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.controller.drives())
    }

    /// Where the models are at the present drives.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.controller.positions())
    }

    /// The integral of every actuator, a displacement.
    #[getter]
    fn integral<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.controller.integral())
    }

    /// The limits (low, high) of the drives, an array of shape (M, 2).
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows: Vec<[f64; 2]> = self.controller.limits().iter().map(|limits| (*limits).into()).collect();
        Array2::from(rows).into_pyarray(py)
    }

    /// The number of sensors S.
    #[getter]
    fn sensors(&self) -> usize {
        self.controller.sensors()
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.controller.options().dt
    }

    /// The integral gain per second.
    #[getter]
    fn ki(&self) -> f64 {
        self.controller.options().ki
    }

    /// How fast the integral goes to zero by itself, per second.
    #[getter]
    fn leak(&self) -> f64 {
        self.controller.options().leak
    }

    /// "run"; "hold": the drives stay; "stop", which `stop` begins.
    #[getter]
    #[py(-> "Literal['run', 'hold', 'stop']")]
    fn mode(&self) -> &'static str {
        mode_name(self.controller.mode())
    }

    /// How many samples had a reference that is not finite, or beyond 1e100: all drives were held.
    #[getter]
    fn rejected_count(&self) -> u64 {
        self.controller.counters().rejected_count
    }

    /// How many samples had a measurement that is not finite, or beyond 1e100.
    #[getter]
    fn missing_count(&self) -> u64 {
        self.controller.counters().missing_count
    }

    /// How many drives a target out of reach brought to a limit: of all actuators together.
    #[getter]
    fn saturated_count(&self) -> u64 {
        self.controller.counters().saturated_count
    }

    /// How many drives the slew held back: of all actuators together.
    #[getter]
    fn slewing_count(&self) -> u64 {
        self.controller.counters().slewing_count
    }

    /// In how many samples the limits of differences moved at least one target.
    #[getter]
    fn pair_limited_count(&self) -> u64 {
        self.controller.counters().pair_limited_count
    }

    fn __len__(&self) -> usize {
        self.controller.len()
    }

    fn __repr__(&self) -> String {
        let (actuators, sensors) = (self.controller.len(), self.controller.sensors());
        let ArrayOptions { ki, leak, .. } = self.controller.options();
        format!(
            "<ArrayController of {actuators} actuators, {sensors} sensors, ki {ki}, leak {leak}, mode {}>",
            self.mode()
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let options = this.controller.options();
        let keywords = keywords!(
            py,
            dt = options.dt,
            ki = options.ki,
            leak = options.leak,
            slew = some(&options.slew),
            max_difference = some(&options.max_difference),
            bumpless_time = options.bumpless_time,
            start_drive = &options.start_drive,
        );
        if !options.neighbours.is_empty() {
            keywords.set_item("neighbours", &options.neighbours)?;
        }
        if let Some(matrix) = &options.reconstruction {
            let shape = (this.controller.len(), this.controller.sensors());
            let matrix = Array2::from_shape_vec(shape, matrix.clone()).expect("whole rows");
            keywords.set_item("reconstruction", matrix.into_pyarray(py))?;
        }
        this.made.reduce_with(py, "controller", keywords, Self::state(slf)?)
    }

    fn __setstate__(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        Self::set_state(slf, state)
    }
}

impl ArrayController {
    pub(super) fn new(controller: core::ArrayController, made: MadeOf) -> Self {
        Self { controller, made }
    }

    fn widths(slf: &Bound<'_, Self>) -> PyResult<(usize, usize)> {
        let this = shared(slf)?;
        Ok((this.controller.len(), this.controller.sensors()))
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
