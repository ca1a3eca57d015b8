//! `tune`, and what it is asked for.

use hysteresis_control::stage::{PEAK_SENSITIVITY, Stage};
use hysteresis_control::tuning::Structure;
use hysteresis_python_macros::function;
use pyo3::prelude::*;

use super::tuning::Tuning;
use crate::convert::arguments::{numbers, unknown, word};
use crate::convert::errors::{raise, wrong_type};
use crate::convert::objects::shared;
use crate::plant::plant::Plant;
use crate::stage::parts::StageKeywords;

/// The keywords of a tuning, as they came.
pub(crate) struct Demands<'a, 'py> {
    pub(crate) peak_sensitivity: Option<&'a Bound<'py, PyAny>>,
    pub(crate) frequency_uncertainty: Option<&'a Bound<'py, PyAny>>,
    pub(crate) damping_uncertainty: Option<&'a Bound<'py, PyAny>>,
    pub(crate) structure: Option<&'a Bound<'py, PyAny>>,
}

impl Demands<'_, '_> {
    pub(crate) fn tune(&self, py: Python<'_>, stage: Stage, dt: f64) -> PyResult<Tuning> {
        let Self { peak_sensitivity, frequency_uncertainty, damping_uncertainty, structure } = *self;
        numbers!(peak_sensitivity = PEAK_SENSITIVITY, frequency_uncertainty, damping_uncertainty);
        let mut options = stage.tuning_options(dt, peak_sensitivity).map_err(raise)?;
        let uncertainty = &mut options.uncertainty;
        uncertainty.frequency = frequency_uncertainty.unwrap_or(uncertainty.frequency);
        uncertainty.damping = damping_uncertainty.unwrap_or(uncertainty.damping);
        options.structure = structure.map(structure_named).transpose()?;
        py.detach(|| Tuning::of(stage, options)).map_err(raise)
    }
}

fn structure_named(structure: &Bound<'_, PyAny>) -> PyResult<Structure> {
    let [names @ .., last] = Structure::ALL.map(|structure| format!("{:?}", structure.name()));
    let expected = format!("{} or {last}", names.join(", "));
    let got = word("structure", &expected, structure)?;
    let found = Structure::ALL.into_iter().find(|structure| structure.name() == got);
    found.map_or_else(|| unknown("structure", &expected, &got), Ok)
}

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
/// gains that suit it, and the bound holds for frequencies 5 % either way and for half to twice the damping, unless other
/// uncertainties are given. Of those whose ki is within 5 % of the greatest the simplest is taken, unless a structure is given. Give a
/// controller the filters with their gains.
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
/// frequency_uncertainty : float, optional
///     How far the frequencies of lightly damped modes may be from what is known: a share either way, 0 to 0.5, the same for all modes.
///     By default 0.05, or three standard errors of the identification where they are more. (If one mode rises while its neighbour
///     falls, the peak may be higher than is said.)
/// damping_uncertainty : float, optional
///     By which factor their damping may be less or more, 1 to 100, the same for all. By default 2, or what three standard errors make
///     of it.
/// structure : "proportional-integral", "low-pass", "active damping" or "notch", optional
///     The only one that is admitted; all but the first need a lightly damped mode.
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
/// >>> plain = flexure.tune(1e-4, structure="proportional-integral")
/// >>> plain.filters, plain.rejection_bandwidth < 10.0
/// ((), True)
/// >>> flexure.tune(1e-4, frequency_uncertainty=0.01).ki > tuning.ki  # the mode is better known
/// True
#[function]
pub(crate) fn tune(
    py: Python<'_>,
    #[py("Model | Stage | Plant")] stage: &Bound<'_, PyAny>,
    #[py(*, = None)] dt: Option<f64>,
    #[py("float" = 1.7)] peak_sensitivity: Option<&Bound<'_, PyAny>>,
    #[py("Dynamics | None" = None)] dynamics: Option<&Bound<'_, PyAny>>,
    #[py("float | None" = None)] amplifier_bandwidth: Option<&Bound<'_, PyAny>>,
    #[py("float" = 0.0)] dead_time: Option<&Bound<'_, PyAny>>,
    #[py("float | None" = None)] frequency_uncertainty: Option<&Bound<'_, PyAny>>,
    #[py("float | None" = None)] damping_uncertainty: Option<&Bound<'_, PyAny>>,
    #[py("Structure | None" = None)] structure: Option<&Bound<'_, PyAny>>,
) -> PyResult<Tuning> {
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
    let demands = Demands { peak_sensitivity, frequency_uncertainty, damping_uncertainty, structure };
    demands.tune(py, stage, dt)
}
