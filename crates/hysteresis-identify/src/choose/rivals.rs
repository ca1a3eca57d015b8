//! What may stand for something else where loops are all alike.
//!
//! Maps follow such loops as an operator of another family would, and what they leave may promise nothing of it. Where
//! their speed is one, too, a dead time of any length, or a mode that rings for ever, follows what plays lack. So each of
//! these has a rival: everything searched once more without it.

use crate::choose::duhem::is_sought;
use crate::choose::found::{Found, Search};
use crate::choose::linear_part::{SECOND_ORDER, to_compare};
use crate::choose::must_gain::{MUST_GAIN, MUST_GAIN_OF_LIKE_LOOPS, is_better};
use crate::choose::told::Variety;
use crate::choose::trial::{DEAD_TIME, DUHEM, TermTrial, TrialOutcome, overrule};
use crate::error::Error;
use crate::fit::point::DAMPINGS;
use crate::fit::progress::{SearchMonitor, SearchStage};
use crate::judge::loops::tells_speeds;
use crate::options::{Options, Setting};
use crate::records::record::Record;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::maps::MapModel;

/// Up to so many samples a dead time is that of a converter.
const USUAL_DEAD_TIME: f64 = 1.0;

/// A mode that is damped by less than so many times the least damping of the search rings for ever: steps end at that
/// bound but for rounding.
const UNDAMPED: f64 = 1.001;

/// What may follow loops of one speed without being there.
struct Doubt {
    /// How results call it.
    term: &'static str,
    is_raised: fn(&Options, &Found) -> bool,
    without: fn(&Options) -> Options,
    /// By which factor of the mean square error of prediction it must be better than the model without it.
    must_gain: f64,
}

const DOUBTS: [Doubt; 2] = [
    Doubt {
        term: SECOND_ORDER,
        is_raised: |asked, found| asked.dynamics == DynamicsModel::Auto && rings_for_ever(found),
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
    if Variety::of(records).amplitudes || found.leads(&asked) {
        return Ok(found);
    }
    let doubts = if tells_speeds(records) { &[][..] } else { &DOUBTS };
    for doubt in doubts {
        if found.partial || !(doubt.is_raised)(&asked, &found) {
            continue;
        }
        let without = (doubt.without)(&asked);
        let rival = monitor.unless_stopped(|monitor| rival(records, &without, search, monitor))?;
        let Some(rival) = rival else { return Ok(found.stopped()) };
        if let Some(rival) = rival.filter(|rival| is_simpler(rival, &found)) {
            (found, asked) = with_or_without(records, doubt, (found, asked), (rival, without))?;
        }
    }
    if !may_stand_for_duhem(records, &asked, &found) {
        return Ok(found);
    }
    let rival = monitor.unless_stopped(|monitor| rival(records, &asked.without_open_maps(), search, monitor))?;
    match rival {
        None => Ok(found.stopped()),
        Some(None) => Ok(found),
        Some(Some(rival)) => without_maps(records, found, rival),
    }
}

/// What is found with other options; nothing where these cannot be fitted.
fn rival(
    records: &[Record<'_>],
    without: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Found>, Error> {
    monitor.hold();
    monitor.enter(SearchStage::Scan);
    let rival = to_compare(search(records, without, monitor))?;
    // What was stopped on its way is compared with nothing.
    if rival.as_ref().is_some_and(|rival| rival.partial) { Err(Error::Interrupted) } else { Ok(rival) }
}

/// The model and its options without what is in doubt, unless that is worse by more than it costs.
fn with_or_without(
    records: &[Record<'_>],
    doubt: &Doubt,
    (found, asked): (Found, Options),
    (rival, without): (Found, Options),
) -> Result<(Found, Options), Error> {
    let (here, there) = (found.validated(records)?, rival.validated(records)?);
    let trial = |outcome| {
        let trial = TermTrial::by_stretches(doubt.term, doubt.must_gain, outcome);
        trial.with_gain(there.typical_error() / here.typical_error())
    };
    if is_better(&here, &there, doubt.must_gain) {
        let place = found.trials.len();
        return Ok((found.with_trial(place, trial(TrialOutcome::Better)), asked));
    }
    let (place, before) = (rival.trials.len(), found.overruled(|_| true));
    Ok((rival.with_trial(place, trial(TrialOutcome::Needless)).after(before), without))
}

/// Whether a rival has nothing in the place of what is in doubt.
fn is_simpler(rival: &Found, found: &Found) -> bool {
    terms(rival).iter().zip(terms(found)).all(|(there, here)| *there <= here)
}

/// How much there is of what may be in the place of another term.
fn terms(found: &Found) -> [usize; 5] {
    let space = &found.fit.space;
    [
        usize::from(space.order().is_some()) + space.modes(),
        usize::from(space.has_amplifier()),
        space.maps(),
        space.creep_amplitudes(),
        usize::from(found.has_duhem()),
    ]
}

fn rings_for_ever(found: &Found) -> bool {
    let modes = found.fit.space.linear_part(&found.fit.fit.point).modes();
    found.fit.space.modes() > 0 && modes.iter().any(|mode| mode.damping < UNDAMPED * DAMPINGS.0)
}

/// Whether maps that were chosen may stand for an operator that they left nothing for.
fn may_stand_for_duhem(records: &[Record<'_>], asked: &Options, found: &Found) -> bool {
    let given = [asked.input_map, asked.output_map].into_iter().filter(|map| *map == MapModel::Smooth).count();
    let has_chosen_map = found.fit.space.maps() > given;
    has_chosen_map && !found.has_duhem() && !found.partial && is_sought(records, asked, found)
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
