//! The drive for a reference.

use hysteresis_control::stage::{PrecompensateOptions, Precompensated, Stage};
use pyo3::prelude::*;

use crate::control::inverse_dynamics::samples;
use crate::convert::arguments::{Given, pair};
use crate::convert::arrays::vector;
use crate::convert::arrays::{self, PASS, check_room};
use crate::convert::errors::{raise, warn};

/// The keywords of `precompensate`, as they came.
#[derive(FromPyObject)]
pub(crate) struct Keywords<'py> {
    pub(crate) limits: Option<Bound<'py, PyAny>>,
    pub(crate) start: Option<Bound<'py, PyAny>>,
    pub(crate) history: Option<Bound<'py, PyAny>>,
    pub(crate) lead_in: Option<Bound<'py, PyAny>>,
}

/// Limits that were given; warns of those beyond what was identified.
pub(crate) fn checked_limits(stage: &Stage, given: Option<&Bound<'_, PyAny>>) -> PyResult<Option<(f64, f64)>> {
    let Some(given) = given else { return Ok(None) };
    let limits = pair("limits", given)?;
    if let Some((low, high)) = stage.extrapolates(limits) {
        let unit = &stage.parts().units.drive;
        warn(
            given.py(),
            &format!(
                "limits: {limits:?} is beyond the identified drives, {low} to {high} {unit}: the stage extrapolates there"
            ),
        )?;
    }
    Ok(Some(limits))
}

/// The drives for a reference, samples or a trajectory; warns of drives that were held back.
pub(crate) fn precompensate(
    stage: &Stage,
    reference: &Bound<'_, PyAny>,
    dt: f64,
    keywords: &Keywords<'_>,
) -> PyResult<Precompensated> {
    let history = keywords.history.as_ref().map(|drives| vector("history", drives)).transpose()?;
    let history = history.as_ref().map_or(Ok(&[][..]), |drives| drives.as_slice())?;
    let history = arrays::copy("history", history)?;
    let options = PrecompensateOptions {
        limits: checked_limits(stage, keywords.limits.as_ref())?,
        start: keywords.start.as_ref().number("start")?,
        history: &history,
        lead_in: keywords.lead_in.as_ref().number("lead_in")?,
    };
    let reference_samples = samples("reference", reference, dt)?;
    check_room("reference", reference_samples.len(), PASS)?;
    let py = reference.py();
    let found = py.detach(|| stage.precompensate(&reference_samples, dt, &options)).map_err(raise)?;
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
        if count > 0 {
            warn(py, &format!("reference: {count} of {} drives were held back by {what}", found.drive.len()))?;
        }
    }
    Ok(found)
}
