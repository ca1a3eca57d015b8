//! The stage: the class `Stage` with its constructor, parts, files and precompensation.

use std::path::PathBuf;

use hysteresis_control::linear::{self, LinearDynamics};
use hysteresis_control::stage::{
    self, Identified, PrecompensateOptions, Precompensated, RecordSource, StageParts, Units,
};
use hysteresis_core::{self as core, DuhemForward, MAX_KNOTS, Model, PiecewiseLinearMap};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use pythonize::pythonize;

use super::error_bounds::ErrorBounds;
use super::loop_shift::LoopShift;
use super::relaxing_plays::RelaxingPlays;
use super::slow_gain::SlowGain;
use super::temperature::{TemperatureTerm, added};
use crate::argument::{Argument, Asked, Class};
use crate::convert::arrays::{PASS, check_room, vector};
use crate::convert::errors::{raise, unexpected, value, warn, warn_held_back, wrong_type};
use crate::convert::files;
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::linear::creep::Creep;
use crate::linear::dynamics::dynamics_object;
use crate::model::duhem::Duhem;
use crate::model::models::ModifiedPrandtlIshlinskii;
use crate::trajectories::positions::samples;

/// A whole stage: limits, dead time, amplifier, hysteresis, loop shift, relaxing plays, slow gain, creep,
/// modes and sensor noise in one object.
///
/// limits -> dead time -> amplifier -> input map -> hysteresis + Duhem -> output map ->
/// loop shift + relaxing plays -> slow gain -> creep -> modes -> sensor
///
/// Made by `identify(...).stage`, by `load(path)`, or from its parts. Immutable. Everything that runs is made from it,
/// so parameters, limits and times are stated once. Times are in seconds, frequencies in Hz.
///
/// Parameters
/// ----------
/// hysteresis : ModifiedPrandtlIshlinskii or PrandtlIshlinskii
/// duhem : Duhem, optional
///     An operator beside the hysteresis, of the same input, whose output z is added: for loops that do not close, or
///     that plays do not describe. z is 0 at the input offset of the hysteresis. Position over drive is the unit of f.
/// limits : (float, float), optional
///     The drive never leaves (low, high), in the unit of the drive.
/// slew : float, optional
///     How fast the drive may change, per second.
/// dead_time : float
///     What the sensor shows later than hysteresis and modes explain, in seconds, for a drive that is put out at t_k
///     and held, and a position that is read at t_k.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of a first-order amplifier in front of the hysteresis.
/// dynamics : FirstOrder, SecondOrder, Modes, StateSpace, a sequence of them in series, or an object of control or
/// scipy
///     The modes and lags behind the hysteresis; their static gain may differ from 1.
/// creep : Creep, optional
/// loop_shift : LoopShift, optional
///     What motion of the drive adds behind the output map, in front of the creep.
/// relaxing_plays : RelaxingPlays, optional
///     Plays that relax, beside the loop shift: loops whose width depends on the rate.
/// slow_gain : SlowGain, optional
///     How the size of all loops changes while the drive cycles, behind loop shift and relaxing plays, in front of the
///     creep.
/// temperature : TemperatureTerm, optional
///     What a temperature adds behind all of it. What runs is at its reference.
/// input_map, output_map : (array, array), optional
///     The points (x, y) of a strictly monotone piecewise-linear map in front of the hysteresis, and of one behind it.
/// noise : float, optional
///     Rms noise of the sensor, in the unit of the position.
/// units : (str, str)
///     Names of the units of drive and position.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(
/// ...     mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dead_time=1e-4,
/// ...     dynamics=mh.plant.SecondOrder(800.0, 0.02), creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8))
/// >>> target = mh.signals.sine(2.5, 10.0, seconds=0.3, rate=10e3)
/// >>> drive = stage.precompensate(target, dt=1e-4, lead_in=0.02)
/// >>> error = stage.forward(dt=1e-4).run(drive)[200:] - target
/// >>> bool(abs(error[1000:]).max() < 1e-3)  # um
/// True
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct Stage(pub(crate) stage::Stage);

impl Class for Stage {
    const CALLED: &'static str = "a mh.Stage";
}

#[methods]
impl Stage {
    #[new]
    #[gather(parts: StageParts, as KEYWORDS)]
    fn new(
        hysteresis: Model,
        #[py(*, field, "Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(field = None)] slew: Option<f64>,
        #[py(field = 0.0)] dead_time: f64,
        #[py(field(amplifier) = None)] amplifier_bandwidth: Option<linear::FirstOrder>,
        #[py(field, "Dynamics | Any | None" = None)] dynamics: LinearDynamics,
        #[py(field, "Creep | None" = None)] creep: Option<linear::Creep>,
        #[py(field, "LoopShift | None" = None)] loop_shift: Option<stage::LoopShift>,
        #[py(field, "RelaxingPlays | None" = None)] relaxing_plays: Option<stage::RelaxingPlays>,
        #[py(field, "SlowGain | None" = None)] slow_gain: Option<stage::SlowGain>,
        #[py(field, "Duhem | None" = None)] duhem: Option<Box<core::Duhem<MAX_KNOTS>>>,
        #[py(field, "TemperatureTerm | None" = None)] temperature: Option<stage::TemperatureTerm>,
        #[py(field, "MapPoints | None" = None)] input_map: Option<PiecewiseLinearMap>,
        #[py(field, "MapPoints | None" = None)] output_map: Option<PiecewiseLinearMap>,
        #[py(field = None)] noise: Option<f64>,
        #[py(field, "tuple[str, str]" = ("V", "um"))] units: Units,
    ) -> PyResult<Self> {
        stage::Stage::new(StageParts { hysteresis: hysteresis.into(), ..parts }).map(Self).map_err(raise)
    }

    /// The hysteresis.
    #[getter]
    fn hysteresis(&self) -> ModifiedPrandtlIshlinskii {
        self.0.parts().hysteresis.clone().into()
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.0.parts().limits
    }

    /// How fast the drive may change, per second, or None.
    #[getter]
    fn slew(&self) -> Option<f64> {
        self.0.parts().slew
    }

    /// What the sensor shows later than hysteresis and modes explain, in seconds.
    #[getter]
    fn dead_time(&self) -> f64 {
        self.0.parts().dead_time
    }

    /// Cut-off frequency of the amplifier in Hz, or None.
    #[getter]
    fn amplifier_bandwidth(&self) -> Option<f64> {
        self.0.parts().amplifier.map(|amplifier| amplifier.frequency())
    }

    /// The modes and lags behind the hysteresis: FirstOrder, SecondOrder, Modes, StateSpace, a tuple of them in series,
    /// or None.
    #[getter]
    #[py(-> "Any")]
    fn dynamics(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        dynamics_object(py, &self.0.parts().dynamics)
    }

    /// The creep, or None.
    #[getter]
    fn creep(&self) -> Option<Creep> {
        self.0.parts().creep.clone().map(Creep)
    }

    /// The loop shift, or None.
    #[getter]
    fn loop_shift(&self) -> Option<LoopShift> {
        self.0.parts().loop_shift.map(LoopShift)
    }

    /// The plays that relax, or None.
    #[getter]
    fn relaxing_plays(&self) -> Option<RelaxingPlays> {
        self.0.parts().relaxing_plays.clone().map(RelaxingPlays)
    }

    /// The slow gain, or None.
    #[getter]
    fn slow_gain(&self) -> Option<SlowGain> {
        self.0.parts().slow_gain.map(SlowGain)
    }

    /// The Duhem operator beside the hysteresis, at rest, or None.
    #[getter]
    fn duhem(&self) -> Option<Duhem> {
        self.0.parts().duhem.as_deref().map(|duhem| Duhem(DuhemForward::new(*duhem)))
    }

    /// What a temperature adds, or None.
    #[getter]
    fn temperature(&self) -> Option<TemperatureTerm> {
        self.0.parts().temperature.map(TemperatureTerm)
    }

    /// The points (x, y) of the map in front of the hysteresis, or None.
    #[getter]
    fn input_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.0.parts().input_map.as_ref().map(points)
    }

    /// The points (x, y) of the map behind the hysteresis, or None.
    #[getter]
    fn output_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.0.parts().output_map.as_ref().map(points)
    }

    /// Rms noise of the sensor, in the unit of the position, or None.
    #[getter]
    fn noise(&self) -> Option<f64> {
        self.0.parts().noise
    }

    /// The units of drive and position.
    #[getter]
    fn units(&self) -> (String, String) {
        let names = self.0.parts().units.clone();
        (names.drive, names.position)
    }

    /// What identification knows of the stage, as a dictionary: ranges, sampling intervals, errors, covariance,
    /// warnings, names and SHA-256 of the records. None for a stage that was made from its parts.
    #[getter]
    #[py(-> "dict[str, Any] | None")]
    fn identified<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.0.parts().identified.as_ref().map(|identified| dictionary(py, identified)).transpose()
    }

    /// Between which drives what runs stays by default: the limits within the range that was identified.
    #[getter]
    fn drive_range(&self) -> Option<(f64, f64)> {
        self.0.drive_range()
    }

    /// Whether `drive_range` is what was identified, as the limits reach beyond it or there are none. What a converter
    /// rounds does not count.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> drive = mh.signals.decaying_triangle(100.0, 1.0, cycles=5, rate=1000)  # V
    /// >>> position = mh.paper.table_1().forward().run(drive)  # um
    /// >>> found = mh.identify(drive, position, operators=10)
    /// >>> wide = found.stage.replace(limits=(-500.0, 500.0))
    /// >>> wide.drive_range, wide.is_narrowed
    /// ((-100.0, 100.0), True)
    /// >>> wide.replace(limits=(-80.0, 80.0)).is_narrowed
    /// False
    #[getter]
    fn is_narrowed(&self) -> bool {
        self.0.is_narrowed()
    }

    /// The positions that the stage reaches whatever happened before, or None without a range of drives.
    ///
    /// Every position in it has a drive within `drive_range`, after any history within it: these are the ends of the
    /// slow loop over that range. So what remains at its low end after a full stroke is outside, though a stage that
    /// was never driven begins there. Creep counts where it is worst, at rest at the other end, but takes no more than
    /// a quarter of the loop from either end. What modes overshoot and what a loop shift adds in motion do not count: a
    /// fast reference reaches less. What the records held is in `identified`.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> stage = mh.Stage(mh.PrandtlIshlinskii([0.5, 0.5], [0.0, 10.0]), limits=(0.0, 100.0))
    /// >>> stage.position_range  # at first 0, but 5 after any stroke of 20 or more
    /// (5.0, 95.0)
    #[getter]
    fn position_range(&self) -> Option<(f64, f64)> {
        self.0.position_range()
    }

    /// The lowest and the highest slope of the position over the drive.
    #[getter]
    fn slope_range(&self) -> (f64, f64) {
        self.0.slope_range()
    }

    /// The drives that move the stage along a reference: the position that is read at t_k is reference[k].
    ///
    /// The reference is led through the inverse of amplifier, modes and dead time, then sample by sample through the
    /// exact inverse of creep, slow gain, relaxing plays, loop shift, maps and hysteresis. The stage begins at rest at
    /// the drive `start`, or where `history` has left it.
    ///
    /// Parameters
    /// ----------
    /// reference : array of n floats, or one of `trajectories`
    /// dt : float
    ///     Sampling interval in seconds.
    /// limits : (float, float), optional
    ///     Within those of the stage; by default `drive_range`.
    /// start : float, optional
    ///     The drive at which the stage has rested, virgin but for the way there; by default 0, or the limit nearest to
    ///     it.
    /// history : array of floats, optional
    ///     The drives since that rest, oldest first, one per sampling interval: what hysteresis, loop shift, relaxing
    ///     plays, slow gain and creep remember. After a full stroke these are its two ends and the drive of now, as in
    ///     `history=[0.0, 150.0, 0.0]`.
    /// lead_in : float, optional
    ///     Seconds of a smooth way from there to the beginning of the reference, in front of the result. Without it the
    ///     reference must begin where the stage is.
    /// temperature : array of n floats, optional
    ///     The temperature along the reference, for a stage that has a `temperature`. Without one it is taken to stay
    ///     at its reference, and a warning says so.
    /// return_error : bool
    ///     Also by how much the reference will be missed, before anything is driven: bounds of the position itself that
    ///     cover what the model does not know. A stage that was not identified knows none.
    /// interval : float
    ///     The probability with which these bounds hold.
    ///
    /// Returns
    /// -------
    /// array of n floats, or more by the samples of the lead-in; with `return_error` a pair of it and
    /// `results.ErrorBounds`
    ///
    /// Raises
    /// ------
    /// StartError
    ///     If the reference begins where the stage is not, and there is no lead-in.
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Warns
    /// -----
    /// HeldBackWarning
    ///     If limits or slew rate held drives back.
    #[gather(keywords: Keywords)]
    #[overload(
        "(self, reference: ArrayLike | Trajectory, dt: float, *, limits: Sequence[float] | None=None, start: float | None=None, history: ArrayLike | None=None, lead_in: float | None=None, temperature: ArrayLike | None=None, return_error: Literal[False]=False, interval: float=0.95) -> Vector"
    )]
    #[overload(
        "(self, reference: ArrayLike | Trajectory, dt: float, *, limits: Sequence[float] | None=None, start: float | None=None, history: ArrayLike | None=None, lead_in: float | None=None, temperature: ArrayLike | None=None, return_error: Literal[True], interval: float=0.95) -> tuple[Vector, ErrorBounds]"
    )]
    fn precompensate<'py>(
        &self,
        py: Python<'py>,
        #[py("ArrayLike | Trajectory")] reference: &Bound<'py, PyAny>,
        dt: f64,
        #[py(*, field, "Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(field = None)] start: Option<f64>,
        #[py(field = None)] history: Option<Vec<f64>>,
        #[py(field = None)] lead_in: Option<f64>,
        #[py(field = None)] temperature: Option<Vec<f64>>,
        #[py(= false)] return_error: bool,
        #[py(= 0.95)] interval: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (found, bounds) = precompensate(&self.0, reference, dt, &keywords, return_error.then_some(interval))?;
        let drive = PyArray1::from_vec(py, found.drive);
        match bounds {
            None => Ok(drive.into_any()),
            Some(bounds) => Ok((drive, ErrorBounds::new(bounds, interval)).into_pyobject(py)?.into_any()),
        }
    }

    /// Writes the stage to a JSON file; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        files::write_json(py, path, self.0.to_json())
    }

    /// A copy with other arguments of the constructor; of what was identified it keeps what still holds.
    ///
    /// The lag of amplifier, dynamics and dead time together was identified: parts that change it raise a ValueError,
    /// as the dead time holds the lag of all that was not fitted. Another hysteresis or map drops all that was
    /// identified, another loop shift or other linear parts its errors and warnings.
    #[py(-> "Stage")]
    fn replace<'py>(
        slf: &Bound<'py, Self>,
        #[py(**, "Any")] changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let keywords = PyDict::new(slf.py());
        for name in Self::KEYWORDS {
            keywords.set_item(name, slf.getattr(name)?)?;
        }
        if let Some(changes) = changes {
            keywords.update(changes.as_mapping())?;
        }
        let hysteresis = match keywords.get_item("hysteresis")? {
            Some(other) => {
                keywords.del_item("hysteresis")?;
                other
            }
            None => slf.getattr("hysteresis")?,
        };
        let stage = slf.get_type().call((hysteresis,), Some(&keywords))?;
        let parts = stage.cast::<Self>()?.get().0.parts().clone();
        let made = slf.get().0.with_parts(parts).map_err(raise)?;
        Ok(Bound::new(slf.py(), Self(made))?.into_any())
    }

    /// A copy that says from which records it was identified: a list of (name, SHA-256 or None).
    fn with_records(&self, #[py("Sequence[tuple[str, str | None]]")] records: &Bound<'_, PyAny>) -> PyResult<Self> {
        let expected = "a list of (name, SHA-256 or None)";
        let records: Vec<(String, Option<String>)> =
            records.extract().map_err(|_| unexpected("records", expected, records))?;
        let records = records.into_iter().map(|(name, sha256)| RecordSource { name, sha256 }).collect();
        Ok(Self(self.0.clone().with_records(records)))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        self.0.model().fingerprint()
    }

    fn __repr__(&self) -> String {
        let parts = self.0.parts();
        let stage::Units { drive, position } = &parts.units;
        let range =
            self.0.drive_range().map_or(String::new(), |(low, high)| format!(", drive {low} to {high} {drive}"));
        let amplifier = if parts.amplifier.is_some() { ", amplifier" } else { "" };
        let behind = [
            (parts.duhem.is_some(), ", Duhem operator"),
            (parts.loop_shift.is_some(), ", loop shift"),
            (parts.relaxing_plays.is_some(), ", relaxing plays"),
            (parts.slow_gain.is_some(), ", slow gain"),
            (parts.creep.is_some(), ", creep"),
            (parts.temperature.is_some(), ", temperature"),
        ];
        let behind: String = behind.iter().filter(|(has, _)| *has).map(|(_, part)| *part).collect();
        let dynamics = match parts.dynamics.order() {
            0 => "no dynamics".to_string(),
            order => format!("order {order} dynamics"),
        };
        let (operators, dead_time) = (self.0.model().operators(), 1e3 * parts.dead_time);
        format!(
            "<Stage: {operators} operators, {drive} to {position}{range}{amplifier}, {dynamics}, dead time {dead_time:.4} \
             ms{behind}>"
        )
    }

    #[classmethod]
    fn _restored(_: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        stage::Stage::from_json(text).map(Self).map_err(raise)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
        reduce(make, (self.0.to_json(),), keywords!(py), None)
    }
}

/// What identification knows, as a dictionary. A file has words for numbers that are not finite; Python has the
/// numbers.
fn dictionary<'py>(py: Python<'py>, identified: &Identified) -> PyResult<Bound<'py, PyAny>> {
    let known = pythonize(py, identified)?;
    known.set_item("rmse", identified.rmse)?;
    known.set_item("max_error", identified.max_error)?;
    known.set_item("covariance", &identified.covariance)?;
    for (shown, warning) in known.get_item("warnings")?.try_iter()?.zip(&identified.warnings) {
        let shown = shown?;
        shown.set_item("value", warning.value)?;
        shown.set_item("limit", warning.limit)?;
    }
    Ok(known)
}

/// A strictly monotone map from its points: a pair of arrays (x, y).
impl Argument<'_> for PiecewiseLinearMap {
    fn from_argument(name: &'static str, points: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok((x, y)) = points.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() else {
            return Err(unexpected(name, "a pair of arrays (x, y): the points of a piecewise-linear map", points));
        };
        let (x, y) = (vector(name, &x)?, vector(name, &y)?);
        Self::new(x.as_slice()?, y.as_slice()?).map_err(|error| value(name, error))
    }
}

/// The points of a map, as it is given.
pub(crate) fn points(map: &PiecewiseLinearMap) -> (Vec<f64>, Vec<f64>) {
    map.points().unzip()
}

/// The names of two units.
impl Argument<'_> for Units {
    fn from_argument(name: &'static str, units: &Bound<'_, PyAny>) -> PyResult<Self> {
        let expected = "two names: of the drive and of the position, such as (\"V\", \"um\")";
        let names = units.extract().map_err(|_| unexpected(name, expected, units));
        names.map(|(drive, position)| Self { drive, position })
    }
}

/// The stage that the argument `name` is, or the one of these parts around the hysteresis that it is. A dead time that
/// was given counts as a part, be it 0.
pub(crate) fn stage_or_around(
    name: &'static str,
    value: &Bound<'_, PyAny>,
    parts: StageParts,
    dead_time: Asked<f64>,
) -> PyResult<stage::Stage> {
    match value.cast::<Stage>() {
        Err(_) => {
            let hysteresis = Model::from_argument(name, value)?.into();
            stage::Stage::new(StageParts { hysteresis, dead_time: dead_time.value, ..parts }).map_err(raise)
        }
        Ok(stage) if is_nothing(&parts, dead_time) => Ok(stage.get().0.clone()),
        Ok(_) => Err(wrong_type(name, "expected a model beside the parts of a stage, got a Stage, which has its own")),
    }
}

/// Whether no part was given.
pub(crate) fn is_nothing(parts: &StageParts, dead_time: Asked<f64>) -> bool {
    *parts == StageParts::default() && !dead_time.is_given
}

/// The keywords of `precompensate`.
#[derive(Default)]
pub(crate) struct Keywords {
    pub(crate) limits: Option<(f64, f64)>,
    pub(crate) start: Option<f64>,
    pub(crate) history: Option<Vec<f64>>,
    pub(crate) lead_in: Option<f64>,
    pub(crate) temperature: Option<Vec<f64>>,
}

/// Limits that were given; warns of those beyond what was identified.
pub(crate) fn checked_limits(
    py: Python<'_>,
    stage: &stage::Stage,
    limits: Option<(f64, f64)>,
) -> PyResult<Option<(f64, f64)>> {
    if let Some(limits) = limits
        && let Some((low, high)) = stage.extrapolates(limits)
    {
        let unit = &stage.parts().units.drive;
        warn(
            py,
            &format!(
                "limits: {limits:?} is beyond the identified drives, {low} to {high} {unit}: the stage extrapolates there"
            ),
        )?;
    }
    Ok(limits)
}

/// The drives for a reference, samples or a trajectory; warns of drives that were held back. With the probability
/// `level` asked for, bounds of the errors that hold with it.
pub(crate) fn precompensate(
    stage: &stage::Stage,
    reference: &Bound<'_, PyAny>,
    dt: f64,
    keywords: &Keywords,
    level: Option<f64>,
) -> PyResult<(Precompensated, Option<stage::ErrorBounds>)> {
    let py = reference.py();
    let options = PrecompensateOptions {
        limits: checked_limits(py, stage, keywords.limits)?,
        start: keywords.start,
        history: keywords.history.as_deref().unwrap_or_default(),
        lead_in: keywords.lead_in,
    };
    let mut reference_samples = samples("reference", reference, dt)?;
    check_room("reference", reference_samples.len(), PASS)?;
    let term = stage.parts().temperature.as_ref();
    if let Some(temperature) = &keywords.temperature {
        let added = added(term, temperature, reference_samples.len(), dt)?;
        reference_samples.iter_mut().zip(added).for_each(|(target, added)| *target -= added);
    } else if let Some(term) = term {
        let reference = term.reference();
        warn(
            py,
            &format!("temperature: none was given for a stage that follows one: it is taken to stay at {reference}"),
        )?;
    }
    let design = || {
        // A stage that knows no band is told before the work.
        level.map(|_| stage.error_band()).transpose()?;
        let found = stage.precompensate(&reference_samples, dt, &options)?;
        let bounds = level.map(|level| stage.error_bounds(&found, &reference_samples, dt, &options, level));
        Ok::<_, stage::Error>((found, bounds.transpose()?))
    };
    let (found, errors) = py.detach(design).map_err(raise)?;
    if found.begins_with_a_jump() {
        let (step, unit) = (found.first_step, &stage.parts().units.drive);
        warn(
            py,
            &format!(
                "reference: begins in motion, so the drive begins with a step of {step:.4} {unit}: give `lead_in`"
            ),
        )?;
    }
    let limits = stage.limits(options.limits).map_err(raise)?.map_or(String::new(), |limits| format!(" {limits:?}"));
    let of_records = options.limits.is_none() && stage.is_narrowed();
    let bounds = if of_records {
        format!("the drives that were identified,{limits}: `limits` may be given to go beyond")
    } else {
        format!("the limits{limits}")
    };
    for (count, what) in [(found.saturated_count, bounds), (found.slewing_count, "the slew rate".into())] {
        warn_held_back(py, count, found.drive.len(), what)?;
    }
    Ok((found, errors))
}
