//! The class `Stage`.

use hysteresis_control::stage::{self, Identified, RecordSource};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use pythonize::pythonize;

use super::loop_shift::LoopShift;
use super::object::Stage;
use super::parts::{StageKeywords, points};
use super::precompensate::{Keywords, checked_limits, precompensate};
use super::streams::{StageForward, StageInverse};
use crate::control::linear::creep::Creep;
use crate::control::linear::part::dynamics_object;
use crate::convert::arguments::{self};
use crate::convert::errors::{raise, unexpected};
use crate::convert::files;
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::model::object::ModifiedPrandtlIshlinskii;
use crate::stream::bracket::Bracket;

#[methods]
impl Stage {
    #[new]
    fn new(
        #[py("Model")] hysteresis: &Bound<'_, PyAny>,
        #[py(*, "Sequence[float] | None" = None)] limits: Option<&Bound<'_, PyAny>>,
        #[py("float | None" = None)] slew: Option<&Bound<'_, PyAny>>,
        #[py("float" = 0.0)] dead_time: Option<&Bound<'_, PyAny>>,
        #[py("float | None" = None)] amplifier_bandwidth: Option<&Bound<'_, PyAny>>,
        #[py("Dynamics | Any | None" = None)] dynamics: Option<&Bound<'_, PyAny>>,
        #[py("Creep | None" = None)] creep: Option<&Bound<'_, PyAny>>,
        #[py("LoopShift | None" = None)] loop_shift: Option<&Bound<'_, PyAny>>,
        #[py("MapPoints | None" = None)] input_map: Option<&Bound<'_, PyAny>>,
        #[py("MapPoints | None" = None)] output_map: Option<&Bound<'_, PyAny>>,
        #[py("float | None" = None)] noise: Option<&Bound<'_, PyAny>>,
        #[py("tuple[str, str]" = ("V", "um"))] units: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let keywords = StageKeywords {
            limits,
            slew,
            dead_time,
            amplifier_bandwidth,
            dynamics,
            creep,
            loop_shift,
            input_map,
            output_map,
            noise,
            units,
        };
        keywords.stage("hysteresis", hysteresis).map(Self)
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

    /// The modes and lags behind the hysteresis: FirstOrder, SecondOrder, Modes, StateSpace, a tuple of them in series, or None.
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

    /// What identification knows of the stage, as a dictionary: ranges, sampling intervals, errors, covariance, warnings,
    /// names and SHA-256 of the records. None for a stage that was made from its parts.
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

    /// Whether `drive_range` is what was identified, as the limits reach beyond it or there are none. What a converter rounds does not
    /// count.
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
    /// Every position in it has a drive within `drive_range`, after any history within it: these are the ends of the slow
    /// loop over that range. So what remains at its low end after a full stroke is outside, though a stage that was never
    /// driven begins there. Creep counts where it is worst, at rest at the other end, but takes no more than a quarter of
    /// the loop from either end. What modes overshoot and what a loop shift adds in motion do not count: a fast reference
    /// reaches less. What the records held is in `identified`.
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

    /// The whole chain, sample by sample, at rest.
    fn forward(&self, dt: f64) -> PyResult<StageForward> {
        Ok(StageForward { stream: self.0.forward(dt).map_err(raise)?, stage: self.0.clone(), dt })
    }

    /// The exact inverse of maps, hysteresis, loop shift and creep, sample by sample, at rest; `limits` must lie within the
    /// stage's, by default `drive_range`.
    fn inverse(
        &self,
        dt: f64,
        #[py("Sequence[float] | None" = None)] limits: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<StageInverse> {
        let limits = checked_limits(&self.0, limits)?;
        Ok(StageInverse { stream: self.0.inverse(dt, limits).map_err(raise)?, stage: self.0.clone(), dt })
    }

    /// The inverse for a copy: whoever made the first one has been warned.
    fn _inverse(&self, dt: f64, limits: Option<(f64, f64)>) -> PyResult<StageInverse> {
        Ok(StageInverse { stream: self.0.inverse(dt, limits).map_err(raise)?, stage: self.0.clone(), dt })
    }

    /// The bracket for a copy.
    fn _bracket(slf: &Bound<'_, Self>, limits: Option<(f64, f64)>) -> PyResult<Bracket> {
        Ok(Bracket::made(slf.as_any(), slf.get().0.bracket(limits).map_err(raise)?))
    }

    /// How uncertain the position is when the history between the limits is unknown, without loop shift, creep and
    /// dynamics.
    fn bracket(
        slf: &Bound<'_, Self>,
        #[py("Sequence[float] | None" = None)] limits: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Bracket> {
        let this = &slf.get().0;
        let limits = checked_limits(this, limits)?;
        if this.limits(limits).map_err(raise)?.is_none() {
            return Err(raise(stage::Error::NoLimits));
        }
        Ok(Bracket::made(slf.as_any(), this.bracket(limits).map_err(raise)?))
    }

    /// The drives that move the stage along a reference: the position that is read at t_k is reference[k].
    ///
    /// The reference is led through the inverse of amplifier, modes and dead time, then sample by sample through the exact
    /// inverse of creep, loop shift, maps and hysteresis. The stage begins at rest at the drive `start`, or where
    /// `history` has left it.
    ///
    /// Parameters
    /// ----------
    /// reference : array of n floats, or one of `trajectories`
    /// dt : float
    ///     Sampling interval in seconds.
    /// limits : (float, float), optional
    ///     Within those of the stage; by default `drive_range`.
    /// start : float, optional
    ///     The drive at which the stage has rested, virgin but for the way there; by default 0, or the limit nearest to it.
    /// history : array of floats, optional
    ///     The drives since that rest, oldest first, one per sampling interval: what hysteresis, loop shift and creep
    ///     remember. After a full stroke these are its two ends and the drive of now, as in `history=[0.0, 150.0, 0.0]`.
    /// lead_in : float, optional
    ///     Seconds of a smooth way from there to the beginning of the reference, in front of the result. Without it the
    ///     reference must begin where the stage is.
    ///
    /// Returns
    /// -------
    /// array of n floats, or more by the samples of the lead-in
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     If limits or slew rate held drives back.
    fn precompensate<'py>(
        &self,
        py: Python<'py>,
        #[py("ArrayLike | Trajectory")] reference: &Bound<'py, PyAny>,
        dt: f64,
        #[py(*, "Sequence[float] | None" = None)] limits: Option<Bound<'py, PyAny>>,
        #[py("float | None" = None)] start: Option<Bound<'py, PyAny>>,
        #[py("ArrayLike | None" = None)] history: Option<Bound<'py, PyAny>>,
        #[py("float | None" = None)] lead_in: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = precompensate(&self.0, reference, dt, &Keywords { limits, start, history, lead_in })?;
        Ok(PyArray1::from_vec(py, found.drive))
    }

    /// Writes the stage to a JSON file; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, #[py("str | PathLike[str]")] path: &Bound<'_, PyAny>) -> PyResult<()> {
        let path = arguments::path("path", path)?;
        let mut text = self.0.to_json();
        text.push('\n');
        files::write_file(py, path, &text)
    }

    /// A copy with other arguments of the constructor; of what was identified it keeps what still holds.
    ///
    /// The lag of amplifier, dynamics and dead time together was identified: parts that change it raise a ValueError, as the
    /// dead time holds the lag of all that was not fitted. Another hysteresis or map drops all that was identified,
    /// another loop shift or other linear parts its errors and warnings.
    #[py(-> "Stage")]
    fn replace<'py>(
        slf: &Bound<'py, Self>,
        #[py(**, "Any")] changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let keywords = PyDict::new(slf.py());
        for name in KEYWORDS {
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
        let shift = if parts.loop_shift.is_some() { ", loop shift" } else { "" };
        let creep = if parts.creep.is_some() { ", creep" } else { "" };
        let dynamics = match parts.dynamics.order() {
            0 => "no dynamics".to_string(),
            order => format!("order {order} dynamics"),
        };
        let (operators, dead_time) = (self.0.model().operators(), 1e3 * parts.dead_time);
        format!(
            "<Stage: {operators} operators, {drive} to {position}{range}, {dynamics}, dead time {dead_time:.4} \
             ms{shift}{creep}>"
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

/// What identification knows, as a dictionary. A file has words for numbers that are not finite; Python has the numbers.
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

/// The keywords of the constructor.
const KEYWORDS: [&str; 11] = [
    "limits",
    "slew",
    "dead_time",
    "amplifier_bandwidth",
    "dynamics",
    "creep",
    "loop_shift",
    "input_map",
    "output_map",
    "noise",
    "units",
];
