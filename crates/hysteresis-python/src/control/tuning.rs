//! Gains of the feedback.

use hysteresis_control::stage::PEAK_SENSITIVITY;
use hysteresis_control::tuning;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::convert::arguments::numbers;
use crate::convert::errors::{raise, wrong_type};
use crate::convert::objects::shared;
use crate::convert::pickling::result_methods;
use crate::plant::plant::Plant;
use crate::stage::parts::StageKeywords;

/// Gains of the proportional-integral feedback, and how robust the loop is with them: made by `tune`.
#[pyclass(module = "mpi_hyst.control", frozen, get_all)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Tuning {
    /// Proportional gain (V/um).
    kp: f64,
    /// Integral gain (V/um/s).
    ki: f64,
    /// The margins where the hysteresis has its smallest slope.
    at_min_slope: Margins,
    /// The margins where it has its greatest slope.
    at_max_slope: Margins,
    /// The peak of the sensitivity over all slopes between.
    peak_sensitivity: f64,
}

impl From<tuning::Tuning> for Tuning {
    fn from(made: tuning::Tuning) -> Self {
        let tuning::Tuning { kp, ki, at_min_slope, at_max_slope, peak_sensitivity } = made;
        Self { kp, ki, at_min_slope: at_min_slope.into(), at_max_slope: at_max_slope.into(), peak_sensitivity }
    }
}

result_methods!(Tuning {
    fn __repr__(&self) -> String {
        let Self { kp, ki, at_min_slope, at_max_slope, peak_sensitivity } = self;
        let (low, high) = (at_min_slope.crossover, at_max_slope.crossover);
        let (low, high) = (low.min(high), low.max(high));
        let loops = format!("crossover {low:.3} to {high:.3} Hz, peak sensitivity {peak_sensitivity:.3}");
        format!("<Tuning: kp {kp:.6}, ki {ki:.6}, {loops}>")
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

/// Gains of the proportional-integral feedback for a hysteresis with dynamics behind it.
///
/// The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope P(z): the positional law kp e + ki sum(e), the slope of the hysteresis,
/// which lies between those of `model.slope_range`, and P the exact pulse transfer function of amplifier, dynamics and
/// dead time for an input that is held from one measurement to the next. Of all gains with
///
/// abs(1 / (1 + L)) <= peak_sensitivity at all frequencies and slopes, and the loop stable,
///
/// those with the greatest ki are taken: a constant disturbance is removed with the integrated error 1 / ki (Åström,
/// Panagopoulos and Hägglund, Automatica 34(5), 1998). Parts slower than 1e5 samples a radian and damping ratios below
/// 1e-7 are refused: their response does not show at the frequencies that are looked at.
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
