//! A lag of first order that a map hides: beside a curve that is not in the model yet, a lag explains little more than a dead time.

use crate::error::Error;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::maps::{Chosen, MapProblem, Place};
use crate::fit::monitor::SearchMonitor;
use crate::joint_search::{LinearEvidence, is_inside};
use crate::options::{DynamicsModel, Options, Order};
use crate::search::Found;

/// A dead time of fewer samples is no lag that the records tell from it.
const LEAST_SAMPLES: f64 = 1.0;

/// A lag with the maps beside it, and what the records tell of it.
pub(crate) struct LagBesideMaps {
    pub(crate) place: Place,
    pub(crate) linear: LinearEvidence,
}

/// A lag in the place of the dead time, with maps of its own, if that predicts better by a clear margin than the best without it.
pub(crate) fn lag_beside_maps(
    maps: &MapProblem<'_>,
    found: &Found,
    without: &Place,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<LagBesideMaps>, Error> {
    let is_open = maps.asked.dynamics == DynamicsModel::Auto && found.told_alone.is_none();
    let stands_for_lag = found.fit.space.order().is_none() && found.fit.dead_time_samples() > LEAST_SAMPLES;
    if !is_open || !stands_for_lag || !maps.are_tried(&found.fit) {
        return Ok(None);
    }
    // The part of the work before is done: progress does not go back.
    monitor.hold();
    let Some((lag, dead_time_error)) = lag(&maps.fitted, &found.fit, monitor)? else { return Ok(None) };
    let Chosen { place, .. } = maps.choose(&lag, monitor)?;
    let linear = LinearEvidence { dead_time_error, ..LinearEvidence::default() };
    Ok(maps.is_beaten_by(without, &place)?.then_some(LagBesideMaps { place, linear }))
}

/// The best lag without maps and the standard error of the dead time beside it.
fn lag(
    problem: &JointProblem<'_>,
    found: &JointFit,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<(JointFit, Option<f64>)>, Error> {
    let options = Options { dynamics: DynamicsModel::Order(Order::First), ..problem.options.clone() };
    let problem = JointProblem { options: &options, ..*problem };
    let lag = problem.search(&found.fit, &found.space, monitor);
    match lag.and_then(|lag| problem.settle_dead_time(lag, monitor)) {
        Err(Error::Interrupted) => Err(Error::Interrupted),
        // A fit is at hand: this was another one to compare it with.
        Err(_) => Ok(None),
        Ok((lag, error)) => Ok(is_inside(&lag).then_some((lag, error))),
    }
}
