//! A lag of first order that a map hides: while the curve is not in the model a lag explains little more than a dead time does.

use crate::error::Error;
use crate::fit::joint::JointFit;
use crate::fit::maps::{Chosen, MapProblem, Place};
use crate::fit::monitor::{SearchMonitor, Span};
use crate::fit::point::Parameter;
use crate::joint_search::{LinearEvidence, are_inside, search_lag, to_compare};
use crate::options::DynamicsModel;
use crate::search::Found;

/// A dead time of fewer samples stands for no lag that the records tell from it.
const LEAST_SAMPLES: f64 = 1.0;

/// What the search for maps has done of its part when it ends.
const AFTER_MAPS: f64 = 0.3;

/// The maps that are chosen; with a lag in the place of the dead time, and what the records tell of it, if that with maps of its own
/// predicts better by a clear margin.
pub(crate) fn maps_and_lag(
    maps: &MapProblem<'_>,
    found: &Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Chosen, Option<LinearEvidence>), Error> {
    let chosen = maps.choose(&found.fit, monitor)?;
    let Place { space, point } = &chosen.place;
    if !may_hide_lag(maps, found, &chosen) || !maps.leaves_something(&maps.fitted.at(space, point)?) {
        return Ok((chosen, None));
    }
    // The part of the work before is done: progress does not go back.
    monitor.hold();
    let better = to_compare(better_lag(maps, found, &chosen.place, monitor))?.flatten();
    Ok(better.map_or((chosen, None), |(beside, told)| (beside, Some(told))))
}

/// A lag with maps of its own, if that predicts better than what was chosen.
fn better_lag(
    maps: &MapProblem<'_>,
    found: &Found,
    chosen: &Place,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<(Chosen, LinearEvidence)>, Error> {
    let (lag, dead_time_error) = monitor.nested(|monitor| {
        monitor.begin(Span { from: AFTER_MAPS, to: AFTER_MAPS });
        search_lag(&maps.fitted, &found.fit, monitor)
    })?;
    monitor.begin_structure();
    let beside = maps.choose(&lag, monitor)?;
    let Place { space, point } = &beside.place;
    let is_better = are_inside(space, point) && maps.is_beaten_by(chosen, &beside.place)?;
    Ok(is_better.then_some((beside, LinearEvidence { dead_time_error, ..LinearEvidence::default() })))
}

/// Whether dynamics were left open and are not told, there may be a map, and a dead time may stand for a lag: without the map, or with
/// it, as before the hysteresis and creep may stand for the lag instead.
fn may_hide_lag(maps: &MapProblem<'_>, found: &Found, chosen: &Chosen) -> bool {
    let JointFit { space, fit, .. } = &found.fit;
    let is_open = maps.asked.dynamics == DynamicsModel::Auto && found.linear.is_some() && found.told_alone.is_none();
    let [before, beside] = [&fit.point, &chosen.place.point].map(|point| point.get(Parameter::DeadTime));
    let may_be_lag = space.order().is_none() && before.max(beside) > LEAST_SAMPLES * space.intervals().smallest();
    is_open && may_be_lag && chosen.were_searched
}
