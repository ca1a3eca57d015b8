//! How uncertain the outputs of an array are when its history is unknown, and the sequence that makes them certain.

use hysteresis_control::stage;
use hysteresis_core::{self as core, ActuatorError, Bound as Domain, BracketState, Process, QuasiStatic};
use hysteresis_python_macros::methods;
use hysteresis_simulate::excitation::{ActuatorDrive, Shape, demagnetizing_array};
use numpy::ndarray::{Array2, Ix1, Ix2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyList;
use pythonize::pythonize;

use super::actuators::{ActuatorArray, Limits};
use super::of_kind::OfKind;
use super::stream_arrays::{MadeOf, columns, in_state, states};
use crate::convert::arrays::{each, zeros};
use crate::convert::errors::{self, raise, wrong_type};
use crate::convert::objects::{Reduced, exclusive, saved, shared};
use crate::signal::excitation::Cycles;
use crate::stage::stage::Stage;

/// How uncertain the outputs of many actuators are when their history is unknown: made by `array.bracket(limits)`.
///
/// For each actuator what `Bracket` is for one, bit for bit. All weights must be 0 or more. Maps of stages are part of
/// it, their loop shift, relaxing plays, slow gain, creep and dynamics are not.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 2)
/// >>> bracket = mirror.bracket(limits=(-10.0, 10.0))
/// >>> low, high = bracket.step([3.0, 10.0])
/// >>> low, high
/// (array([ 3.5, 14. ]), array([ 5.5, 14. ]))
/// >>> bracket.width  # the second one has made a full stroke
/// array([2., 0.])
#[pyclass(module = "mpi_hyst")]
pub(crate) struct BracketArray {
    brackets: core::BracketArray,
    made: MadeOf,
}

type LowAndHigh<'py, D> = (Bound<'py, numpy::PyArray<f64, D>>, Bound<'py, numpy::PyArray<f64, D>>);

type DrivesAndLeft<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

impl BracketArray {
    fn each<'py>(&self, py: Python<'py>, of: impl Fn(&core::Bracket) -> f64) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.brackets.brackets().iter().map(of))
    }
}

#[methods]
impl BracketArray {
    /// Takes one drive for each actuator, an array of shape (M,); the lowest and the highest outputs that there can be.
    #[py(-> "tuple[Vector, Vector]")]
    fn step<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] drive: &Bound<'py, PyAny>,
    ) -> PyResult<LowAndHigh<'py, Ix1>> {
        let actuators = slf.len()?;
        let drives = columns::<Ix1>("drive", drive, actuators, format_args!("an array of shape ({actuators},)"))?;
        let (low, high) = (zeros(slf.py(), Ix1(actuators))?, zeros(slf.py(), Ix1(actuators))?);
        let (mut lowest, mut highest) = (low.readwrite(), high.readwrite());
        let mut this = exclusive(slf)?;
        this.brackets.step(drives.as_slice()?, lowest.as_slice_mut()?, highest.as_slice_mut()?).map_err(raise)?;
        Ok((low, high))
    }

    /// Takes rows of drives, an array of shape (samples, M), bit for bit like `step` in a loop.
    #[py(-> "tuple[Matrix, Matrix]")]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] drives: &Bound<'py, PyAny>,
    ) -> PyResult<LowAndHigh<'py, Ix2>> {
        let drives = rows(drives, slf.len()?)?;
        let (low, high) = (zeros(slf.py(), drives.dims())?, zeros(slf.py(), drives.dims())?);
        let (mut lowest, mut highest) = (low.readwrite(), high.readwrite());
        let mut this = exclusive(slf)?;
        this.brackets.run(drives.as_slice()?, lowest.as_slice_mut()?, highest.as_slice_mut()?).map_err(raise)?;
        Ok((low, high))
    }

    /// Takes over what was driven before, an array of shape (samples, M), oldest drives first.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let drives = rows(drives, slf.len()?)?;
        exclusive(slf)?.brackets.follow(drives.as_slice()?).map_err(raise)
    }

    /// The lowest and the highest outputs that there can be now.
    #[getter]
    #[py(-> "tuple[Vector, Vector]")]
    fn outputs<'py>(&self, py: Python<'py>) -> LowAndHigh<'py, Ix1> {
        (self.each(py, |bracket| bracket.outputs().0), self.each(py, |bracket| bracket.outputs().1))
    }

    /// The highest minus the lowest output of each actuator.
    #[getter]
    fn width<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, core::Bracket::width)
    }

    /// The limits (low, high) between which the unknown histories lie, an array of shape (M, 2).
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows: Vec<[f64; 2]> = self.brackets.brackets().iter().map(|bracket| bracket.limits().into()).collect();
        Array2::from(rows).into_pyarray(py)
    }

    /// Nothing is known of any history.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.brackets.reset();
        Ok(())
    }

    /// Everything that is remembered, as a list of M dictionaries to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "list[dict[str, Any]]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyList>> {
        let states: Vec<_> = shared(slf)?.brackets.brackets().iter().map(core::Bracket::state).collect();
        let states = states.iter().map(|state| Ok(pythonize(slf.py(), state)?));
        PyList::new(slf.py(), states.collect::<PyResult<Vec<_>>>()?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("list[dict[str, Any]]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let given = states(state, slf.len()?)?.into_iter().enumerate();
        let plain = given.map(|(m, state)| saved(&state).map_err(|error| in_state(state.py(), m, error)));
        let plain = plain.collect::<PyResult<Vec<BracketState>>>()?;
        let wrong = |ActuatorError { actuator, error }| in_state(slf.py(), actuator, raise(error));
        exclusive(slf)?.brackets.set_states(&plain).map_err(wrong)
    }

    fn __len__(&self) -> usize {
        self.brackets.brackets().len()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let this = shared(slf)?;
        this.made.reduce(slf.py(), "bracket", Self::state(slf)?.into_any())
    }

    fn __repr__(&self) -> String {
        format!("<BracketArray of {} actuators>", self.__len__())
    }
}

fn rows<'py>(drives: &Bound<'py, PyAny>, actuators: usize) -> PyResult<numpy::PyReadonlyArray2<'py, f64>> {
    columns("drives", drives, actuators, format_args!("an array of shape (samples, {actuators})"))
}

/// The limits of all actuators, which must be given, unless stages have some.
fn limits_of(array: &ActuatorArray, limits: Option<&Bound<'_, PyAny>>) -> PyResult<(Limits, Vec<(f64, f64)>)> {
    let given = Limits::from_python(limits, array.count())?;
    let each = (0..array.count()).map(|actuator| {
        let own = match array.actuators() {
            OfKind::Models(_) => return given.of(actuator).ok_or_else(|| missing(array)),
            OfKind::Stages(stages) => stages[actuator].get().0.limits(given.of(actuator)),
        };
        own.and_then(|limits| limits.ok_or(stage::Error::NoLimits))
            .map_err(|error| raise(ActuatorError { actuator, error }))
    });
    let each = each.collect::<PyResult<_>>()?;
    Ok((given, each))
}

/// Models have no limits of their own.
fn missing(array: &ActuatorArray) -> PyErr {
    let expected = format!("two numbers (low, high) or an array of shape ({}, 2)", array.count());
    wrong_type("limits", format_args!("expected {expected}, got None"))
}

/// What is bracketed of every actuator: hysteresis and maps.
fn without_time(array: &ActuatorArray) -> PyResult<Vec<QuasiStatic>> {
    match array.actuators() {
        OfKind::Models(models) => Ok(models.iter().map(QuasiStatic::new).collect()),
        OfKind::Stages(stages) => {
            let rigid = |stage: &Py<Stage>| {
                let sampled = stage.get().0.quasi_static(1.0).map_err(raise)?;
                Ok(sampled.at_once())
            };
            stages.iter().map(rigid).collect()
        }
    }
}

/// How far the output behind these drives can be from that of the model at rest, which goes straight to the last of
/// them.
fn left_by(stage: &QuasiStatic, limits: (f64, f64), drives: impl Iterator<Item = f64>) -> f64 {
    let Ok(mut bracket) = core::Bracket::of_stage(stage, limits) else { return f64::NAN };
    let mut outputs = bracket.outputs();
    let mut last = 0.0;
    for drive in drives {
        outputs = bracket.step(drive);
        last = drive;
    }
    let rest = stage.forward().step(last);
    (outputs.1 - rest).abs().max((outputs.0 - rest).abs())
}

/// The plan would name them low and high.
fn check_limits((low, high): (f64, f64)) -> Result<(), core::Error> {
    core::check_all_finite("limits", &[low, high])?;
    let expected = Domain::Above { what: "the low limit", limit: low };
    let wrong = core::Error::Domain { parameter: "limits", index: Some(1), expected, got: high };
    if low < high { Ok(()) } else { Err(wrong) }
}

#[methods]
impl ActuatorArray {
    /// How uncertain the outputs are when the history of the drives, between `limits`, is unknown.
    ///
    /// `limits` of the drives: (low, high) for all, or an array of shape (M, 2), a row for each actuator. Stages have
    /// theirs by default.
    ///
    /// Raises ValueError that names the first actuator whose model has a negative weight, or whose stage has a Duhem
    /// operator: what drifts from loop to loop is not bracketed.
    fn bracket(
        slf: &Bound<'_, Self>,
        #[py("ArrayLike | None" = None)] limits: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<BracketArray> {
        let (given, each) = limits_of(slf.get(), limits)?;
        let wrong = |ActuatorError { actuator, error }| given.error(actuator, error);
        let brackets = core::BracketArray::of_stages(&without_time(slf.get())?, |m| each[m]).map_err(wrong)?;
        Ok(BracketArray { brackets, made: MadeOf::new(slf.as_any(), limits) })
    }

    /// One decaying alternation for all actuators, and what it leaves of their memory.
    ///
    /// Every drive goes from its start to its center, alternates about the center with a common share of its own
    /// amplitude, and goes back. All turn at the same samples; the slowest actuator sets the pace.
    /// `mh.signals.demagnetize` says what the sequence leaves of the memory of one actuator.
    ///
    /// Parameters
    /// ----------
    /// limits : (low, high) or array of shape (M, 2)
    ///     Of the drives (V): never left. What was driven before lies between them.
    /// slew : float or array of shape (M,)
    ///     Largest speed of the drives (V/s).
    /// rate : float
    ///     Samples per second, in Hz: at least one sample must fit between the nearest reversals on one side.
    /// cycles : int
    ///     Cycles that the alternation takes to decay.
    /// shape : "triangle" or "sine"
    ///     Straight moves from reversal to reversal, or half cosines of the same largest speed.
    /// center : float or array of shape (M,), optional
    ///     What the alternation decays to: the middle of the limits unless given.
    /// start : float or array of shape (M,), optional
    ///     Where the drives start and end: zero, or the limit nearest to it, unless given.
    ///
    /// Returns
    /// -------
    /// drives : array of shape (samples, M)
    /// left : array of shape (M,)
    ///     How far, at most, the output at the end is from that of the model at rest, which goes straight to its start:
    ///     whatever was driven before between the limits, in the unit of the models' output. It is small if `center` is
    ///     the input offset of the model, in the middle of its limits. NaN for a model with a negative weight or a
    ///     Duhem operator: nothing is guaranteed then. (How far the outputs of two histories can be apart is the width
    ///     of `array.bracket(limits)` behind its `follow(drives)`.)
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> model = mh.paper.table_1_recovered()
    /// >>> mirror = mh.ActuatorArray([model] * 3)
    /// >>> limits = [(-500.0, 500.0), (-300.0, 300.0), (-150.0, 150.0)]
    /// >>> drives, left = mirror.demagnetize(limits, slew=2000.0, rate=1000.0)
    /// >>> bool((left < 0.02 * mirror.bracket(limits).width).all())
    /// True
    fn demagnetize<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] limits: &Bound<'py, PyAny>,
        #[py(*, "ArrayLike")] slew: &Bound<'py, PyAny>,
        #[py(= 10000.0)] rate: f64,
        #[py(= 20)] cycles: Cycles,
        #[py(= "triangle")] shape: Shape,
        #[py("ArrayLike | None" = None)] center: Option<&Bound<'py, PyAny>>,
        #[py("ArrayLike | None" = None)] start: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<DrivesAndLeft<'py>> {
        let (py, actuators) = (slf.py(), slf.get().count());
        let (given, limits) = limits_of(slf.get(), Some(limits))?;
        let rigid = without_time(slf.get())?;
        let slew = each("slew", slew, actuators)?;
        let center = center.map(|center| each("center", center, actuators)).transpose()?;
        let start = start.map(|start| each("start", start, actuators)).transpose()?;
        let drive = |(m, (low, high)): (usize, &(f64, f64))| ActuatorDrive {
            low: *low,
            high: *high,
            slew: slew[m],
            center: center.as_ref().map_or(0.5 * low + 0.5 * high, |center| center[m]),
            // Not clamp, which panics if low is above high: the plan says what is wrong with them.
            start: start.as_ref().map_or(0.0_f64.max(*low).min(*high), |start| start[m]),
        };
        let plan: Vec<_> = limits.iter().enumerate().map(drive).collect();
        for (m, pair) in limits.iter().enumerate() {
            check_limits(*pair).map_err(|error| given.error(m, error))?;
        }
        let made = py.detach(|| demagnetizing_array(&plan, rate, cycles.0, shape)).map_err(raise)?;
        let left = py.detach(|| {
            let of = |(m, stage)| left_by(stage, limits[m], made.iter().skip(m).step_by(actuators).copied());
            rigid.iter().enumerate().map(of).collect::<Vec<f64>>()
        });
        let shape = (made.len() / actuators, actuators);
        let drives = Array2::from_shape_vec(shape, made).map_err(|error| errors::value("rate", error))?;
        Ok((drives.into_pyarray(py), PyArray1::from_vec(py, left)))
    }
}
