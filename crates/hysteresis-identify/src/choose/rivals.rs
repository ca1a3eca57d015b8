//! What may stand for something else where loops are all alike.
//!
//! Maps follow such loops as an operator of another family would, and what they leave may promise nothing of it. A dead
//! time of any length, or a mode that rings for ever, follows what plays lack, as long as the speed is one. So each of
//! these has a rival: everything searched once more without it.

use crate::choose::duhem::leaves_something;
use crate::choose::found::{Found, Search};
use crate::choose::linear_part::SECOND_ORDER;
use crate::choose::term_search::{MUST_GAIN, MUST_GAIN_OF_LIKE_LOOPS, is_better};
use crate::choose::told::Variety;
use crate::choose::trial::{DEAD_TIME, DUHEM, TermTrial, TrialOutcome, overrule};
use crate::error::Error;
use crate::fit::point::Parameter;
use crate::fit::progress::SearchMonitor;
use crate::options::{Options, Setting};
use crate::records::record::Record;
use crate::terms::duhem::DuhemModel;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::ModelKind;

/// Up to so many samples a dead time is that of a converter.
const USUAL_DEAD_TIME: f64 = 1.0;

/// What may follow loops of one speed without being there.
struct Doubt {
    /// How results call it.
    term: &'static str,
    is_raised: fn(&Options, &Found) -> bool,
    without: fn(&Options) -> Options,
    /// By which factor of the mean square error of prediction it must be better than the model without it.
    must_gain: f64,
}

/// A mode at the bounds of its search goes on as nothing does that is damped.
const DOUBTS: [Doubt; 2] = [
    Doubt {
        term: SECOND_ORDER,
        is_raised: |asked, found| {
            let first = found.fit.space.axis(Parameter::LogDamping);
            let is_damped = first.is_none_or(|axis| axis.is_inside(&found.fit.fit.point));
            asked.dynamics == DynamicsModel::Auto && !(is_damped && found.fit.has_distinct_modes())
        },
        without: |asked| Options { dynamics: DynamicsModel::None, ..asked.clone() },
        must_gain: MUST_GAIN_OF_LIKE_LOOPS,
    },
    Doubt {
        term: DEAD_TIME,
        is_raised: |asked, found| asked.dead_time == Setting::Fit && found.fit.dead_time_samples() > USUAL_DEAD_TIME,
        without: |asked| Options { dead_time: Setting::Fixed(0.0), ..asked.clone() },
        must_gain: MUST_GAIN,
    },
];

/// What is asked for, or a rival of it that is as good.
pub(crate) fn search_with_rivals(
    records: &[Record<'_>],
    asked: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let (mut found, mut asked) = (search(records, asked, monitor)?, asked.clone());
    if Variety::of(records).amplitudes {
        return Ok(found);
    }
    for doubt in DOUBTS {
        if found.partial || !(doubt.is_raised)(&asked, &found) {
            continue;
        }
        let without = (doubt.without)(&asked);
        let Some(rival) = rival(records, &without, search, monitor)? else { return Ok(found.stopped()) };
        let is_told;
        (found, is_told) = with_or_without(records, &doubt, found, rival)?;
        asked = if is_told { asked } else { without };
    }
    if !may_stand_for_duhem(records, &asked, &found) {
        return Ok(found);
    }
    let Some(rival) = rival(records, &asked.without_open_maps(), search, monitor)? else { return Ok(found.stopped()) };
    without_maps(records, found, rival)
}

/// What is found with other options; none where the search is stopped, and the best so far is kept.
fn rival(
    records: &[Record<'_>],
    without: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Found>, Error> {
    monitor.hold();
    match search(records, without, monitor) {
        Ok(Found { partial: true, .. }) | Err(Error::Interrupted) if monitor.keeps_best() => Ok(None),
        rival => rival.map(Some),
    }
}

/// The model without what is in doubt, unless that is worse by more than it costs or has other terms in its place; and
/// whether it is.
fn with_or_without(records: &[Record<'_>], doubt: &Doubt, found: Found, rival: Found) -> Result<(Found, bool), Error> {
    let (with, without) = (found.validated(records)?, rival.validated(records)?);
    let is_simpler = terms(&rival).iter().zip(terms(&found)).all(|(there, here)| *there <= here);
    let is_told = !is_simpler || is_better(&with, &without, doubt.must_gain);
    let outcome = if is_told { TrialOutcome::Better } else { TrialOutcome::Needless };
    let trial = TermTrial::by_stretches(doubt.term, doubt.must_gain, outcome)
        .with_gain(without.typical_error() / with.typical_error());
    let (chosen, before) = if is_told { (found, Vec::new()) } else { (rival, found.overruled(|_| true)) };
    let place = chosen.trials.len();
    Ok((chosen.with_trial(place, trial).after(before), is_told))
}

/// How many of what may be beside plays a model has.
fn terms(found: &Found) -> [usize; 4] {
    let space = &found.fit.space;
    [
        usize::from(space.order().is_some()),
        usize::from(space.has_amplifier()),
        space.maps(),
        usize::from(found.has_duhem()),
    ]
}

/// Whether maps that were chosen may stand for an operator that they left nothing for.
fn may_stand_for_duhem(records: &[Record<'_>], asked: &Options, found: &Found) -> bool {
    let is_open = asked.duhem == DuhemModel::Auto && asked.model == ModelKind::Modified && !found.has_duhem();
    let given = [asked.input_map, asked.output_map].into_iter().filter(|map| *map == MapModel::Smooth).count();
    is_open && found.fit.space.maps() > given && !found.partial && leaves_something(records, found)
}

/// The model without maps, if it has an operator and predicts better.
fn without_maps(records: &[Record<'_>], found: Found, rival: Found) -> Result<Found, Error> {
    if rival.has_duhem() && is_better(&rival.validated(records)?, &found.validated(records)?, 1.0) {
        return Ok(rival.after(found.overruled(|_| true)));
    }
    let mut trials: Vec<_> = rival.trials.into_iter().filter(|trial| trial.term == DUHEM).collect();
    overrule(&mut trials, TrialOutcome::Beaten, |_| true);
    Ok(Found { trials: [found.trials, trials].concat(), ..found })
}
