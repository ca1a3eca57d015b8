//! Gains of the feedback.

use hysteresis_control::filters::FeedbackFilter;
use hysteresis_control::stage::PEAK_SENSITIVITY;
use hysteresis_control::tuning;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use serde::{Deserialize, Serialize};

use super::filters::as_objects;
use crate::convert::arguments::numbers;
use crate::convert::errors::{raise, wrong_type};
use crate::convert::objects::shared;
use crate::convert::pickling::result_methods;
use crate::plant::plant::Plant;
use crate::stage::parts::StageKeywords;

/// Filters and gains of the feedback, and how robust the loop is with them: made by `tune`.
///
/// Gains belong to their filters: without them a lightly damped stage may become unstable.
#[pyclass(module = "mpi_hyst.control", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Tuning {
    kp: f64,
    ki: f64,
    filters: Vec<FeedbackFilter>,
    structure: tuning::Structure,
    at_min_slope: Margins,
    at_max_slope: Margins,
    peak_sensitivity: f64,
    rejection_bandwidth: f64,
    noise_bandwidth: f64,
    tried: Vec<(tuning::Structure, f64)>,
}

impl From<tuning::Tuning> for Tuning {
    fn from(made: tuning::Tuning) -> Self {
        let tuning::Tuning { kp, ki, filters, structure, at_min_slope, at_max_slope, tried, .. } = made;
        let tuning::Tuning { peak_sensitivity, rejection_bandwidth, noise_bandwidth, .. } = made;
        let (at_min_slope, at_max_slope) = (at_min_slope.into(), at_max_slope.into());
        Self {
            kp,
            ki,
            filters,
            structure,
            at_min_slope,
            at_max_slope,
            peak_sensitivity,
            rejection_bandwidth,
            noise_bandwidth,
            tried,
        }
    }
}

result_methods!(Tuning {
    /// Proportional gain (V/um); negative for active damping.
    #[getter]
    fn kp(&self) -> f64 {
        self.kp
    }

    /// Integral gain (V/um/s).
    #[getter]
    fn ki(&self) -> f64 {
        self.ki
    }

    /// The filters before both gains: Notch, LowPass.
    #[getter]
    fn filters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        as_objects(py, &self.filters)
    }

    /// "proportional-integral" without filters; "low-pass", which keeps the loop away from a resonance; "active damping", a low-pass
    /// behind which a negative kp damps; "notch", one for every lightly damped mode.
    #[getter]
    fn structure(&self) -> &'static str {
        self.structure.name()
    }

    /// The margins where the hysteresis has its smallest slope, with the modes as they are known.
    #[getter]
    fn at_min_slope(&self) -> Margins {
        self.at_min_slope.clone()
    }

    /// The margins where it has its greatest slope.
    #[getter]
    fn at_max_slope(&self) -> Margins {
        self.at_max_slope.clone()
    }

    /// The peak of the sensitivity over all slopes between and all modes that may be.
    #[getter]
    fn peak_sensitivity(&self) -> f64 {
        self.peak_sensitivity
    }

    /// Up to which frequency in Hz disturbances are reduced to 1/sqrt(2) at least, for all slopes and modes that may be.
    #[getter]
    fn rejection_bandwidth(&self) -> f64 {
        self.rejection_bandwidth
    }

    /// The bandwidth in Hz of white noise of the sensor that the position follows, where the hysteresis has its greatest slope.
    #[getter]
    fn noise_bandwidth(&self) -> f64 {
        self.noise_bandwidth
    }

    /// What was tried, and roughly the ki of the best of its kind: why the structure was chosen. Empty without lightly damped modes.
    #[getter]
    fn tried(&self) -> Vec<(&'static str, f64)> {
        self.tried.iter().map(|(structure, ki)| (structure.name(), *ki)).collect()
    }

    fn __repr__(&self) -> String {
        let Self { kp, ki, at_min_slope, at_max_slope, peak_sensitivity, .. } = self;
        let (low, high) = (at_min_slope.crossover, at_max_slope.crossover);
        let (low, high) = (low.min(high), low.max(high));
        let loops = format!("crossover {low:.3} to {high:.3} Hz, peak sensitivity {peak_sensitivity:.3}");
        let structure = if self.filters.is_empty() { String::new() } else { format!("{}, ", self.structure.name()) };
        format!("<Tuning: {structure}kp {kp:.6}, ki {ki:.6}, {loops}>")
    }
});

/// How robust a loop is at one slope of the hysteresis.
#[pyclass(module = "mpi_hyst.control", frozen, get_all, skip_from_py_object)]
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Margins {
    /// The slope (um/V).
    slope: f64,
    /// The factor by which the gain may grow until the loop oscillates; infinite if it never does.
    gain_margin: f64,
    /// How many degrees the phase may lag more, the least over all frequencies with abs(L) = 1.
    phase_margin: f64,
    /// The highest frequency in Hz with abs(L) = 1.
    crossover: f64,
    /// The peak of the sensitivity abs(1 / (1 + L)).
    peak_sensitivity: f64,
    /// Where that peak is, in Hz.
    peak_frequency: f64,
}

impl From<tuning::Margins> for Margins {
    fn from(made: tuning::Margins) -> Self {
        let tuning::Margins { slope, gain_margin, phase_margin, crossover, peak_sensitivity, peak_frequency } = made;
        Self { slope, gain_margin, phase_margin, crossover, peak_sensitivity, peak_frequency }
    }
}

result_methods!(Margins {
    fn __repr__(&self) -> String {
        let Self { slope, gain_margin, phase_margin, crossover, peak_sensitivity, .. } = self;
        let margins = format!("gain margin {gain_margin:.3}, phase margin {phase_margin:.1} degrees");
        format!(
            "<Margins at slope {slope:.6}: {margins}, crossover {crossover:.3} Hz, peak sensitivity {peak_sensitivity:.3}>"
        )
    }
});

/// Filters and gains of the proportional-integral feedback for a hysteresis with dynamics behind it.
///
/// The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z): the positional law kp e + ki sum(e) behind filters F, the slope of the hysteresis,
/// which lies between those of `model.slope_range`, and P the exact pulse transfer function of amplifier, dynamics and
/// dead time for an input that is held from one measurement to the next. Of all gains with
///
/// abs(1 / (1 + L)) <= peak_sensitivity at all frequencies and slopes, and the loop stable,
///
/// those with the greatest ki are taken: a constant disturbance is removed with the integrated error 1 / ki (Åström,
/// Panagopoulos and Hägglund, Automatica 34(5), 1998). Parts slower than 1e5 samples a radian and damping ratios below
/// 1e-7 are refused: their response does not show at the frequencies that are looked at.
///
/// Without modes of a damping ratio below 0.5 there are no filters. With some, no filter, low-passes and notches are tried, each with the
/// gains that suit it, and the bound holds for frequencies 5 % either way and for half to twice the damping. Of those whose ki is
/// within 5 % of the greatest the simplest is taken. Give a controller the filters with their gains.
///
/// Parameters
/// ----------
/// stage : Stage, Plant, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     A model with the keywords `dynamics`, `amplifier_bandwidth` and `dead_time` makes a stage; a plant has one.
/// dt : float
///     Sampling interval in seconds; a plant has its own.
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     What the sensor shows later than the dynamics explain, in seconds, at most 1000 samples.
/// peak_sensitivity : float
///     1.05 to 5: 1.2 is cautious, 2 is bold. The gain may grow by M / (M - 1), the phase lag by 2 arcsin(1 / (2 M)).
///
/// Returns
/// -------
/// Tuning
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> tuning = mh.control.tune(mh.paper.table_1_recovered(), dt=1e-4, dynamics=mh.plant.SecondOrder(400.0, 0.95))
/// >>> round(tuning.kp), round(tuning.ki, -3), round(tuning.peak_sensitivity, 3)
/// (185, 358000.0, 1.7)
/// >>> mh.control.tune(mh.paper.plant("A1")).kp == tuning.kp
/// True
/// >>> tuning.at_max_slope
/// <Margins at slope 0.007919: gain margin 6.521, phase margin 47.1 degrees, crossover 408.658 Hz, peak sensitivity 1.700>
/// >>> flexure = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
/// >>> tuning = flexure.tune(1e-4)
/// >>> tuning.structure, tuning.rejection_bandwidth > 80.0  # Hz; gains alone allow a few
/// ('notch', True)
#[pyfunction]
#[pyo3(signature = (stage, *, dt=None, peak_sensitivity=None, dynamics=None, amplifier_bandwidth=None, dead_time=None),
    text_signature = "(stage, *, dt=None, peak_sensitivity=1.7, dynamics=None, amplifier_bandwidth=None, dead_time=0.0)")]
pub(crate) fn tune(
    py: Python<'_>,
    stage: &Bound<'_, PyAny>,
    dt: Option<&Bound<'_, PyAny>>,
    peak_sensitivity: Option<&Bound<'_, PyAny>>,
    dynamics: Option<&Bound<'_, PyAny>>,
    amplifier_bandwidth: Option<&Bound<'_, PyAny>>,
    dead_time: Option<&Bound<'_, PyAny>>,
) -> PyResult<Tuning> {
    numbers!(dt, peak_sensitivity = PEAK_SENSITIVITY);
    let parts = StageKeywords { dynamics, amplifier_bandwidth, dead_time, ..StageKeywords::default() };
    let (stage, dt) = match (stage.cast::<Plant>(), dt) {
        (Ok(plant), None) if parts.is_empty() => (shared(plant)?.plant.stage().clone(), shared(plant)?.plant.dt()),
        (Ok(_), _) => {
            return Err(wrong_type(
                "stage",
                "expected a stage or model beside other keywords, got a Plant, which has its own",
            ));
        }
        (Err(_), Some(dt)) => (parts.stage_or_around("stage", stage)?, dt),
        (Err(_), None) => return Err(wrong_type("dt", "expected the sampling interval in seconds, got None")),
    };
    py.detach(|| stage.tune(dt, peak_sensitivity)).map(Tuning::from).map_err(raise)
}
