//! Whether a Duhem operator stands beside the plays.
//!
//! Plays are fitted first. What they leave is compared with what operators of a few shapes would add, in one pass over
//! selected rows, at the linear part that was found. Where none of them promises enough, that is all. Else the best
//! shape stands beside the plays: behind the linear part that they had, and behind an amplifier of the same lag with a
//! mode, as plays that fail may hide both. Then its knots become more, and cross-validation judges both results.

use core::f64::consts::TAU;

use crate::choose::cross_validation::CrossValidation;
use crate::choose::found::{Found, LinearEvidence, Place};
use crate::choose::must_gain::{MUST_GAIN, MUST_GAIN_OF_LIKE_LOOPS, is_better};
use crate::choose::structure::with_structure;
use crate::choose::told::Variety;
use crate::choose::trial::{DUHEM, TermTrial, TrialOutcome};
use crate::error::Error;
use crate::fit::descent::best_attempt;
use crate::fit::joint::{Attempts, JointFit, JointProblem};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::rough;
use crate::fit::response::OperatorsAt;
use crate::fit::space::{Space, at_duhem};
use crate::fit::tangent::Slope;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::{are_backwards, findings_of_fit};
use crate::options::Options;
use crate::records::record::{Record, largest_range};
use crate::records::signal::{as_f64, bounds, bounds_of, sensor_noise};
use crate::terms::duhem::{DuhemModel, DuhemTable, shapes};
use crate::terms::dynamics::{AmplifierModel, DynamicsModel, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::operators::ModelKind;
use crate::terms::weights::WeightBasis;

/// What plays leave below this share of the range, rms, no other family is asked to explain, nor white noise.
const LEAST_LEFT: f64 = 3e-4;

/// By which factor a shape must lower the objective of the plays before everything is searched with it.
const MUST_PROMISE: f64 = 1.1;

/// How far the searched parameters may move for that promise, in their scales.
const REACH: f64 = 0.3;

/// Where modes behind an amplifier are looked for: so many, each so many times as fast as the one before, of this
/// damping.
const MOST_MODES: usize = 12;
const MODE_RATIO: f64 = 1.35;
const MODE_DAMPING: f64 = 0.08;

/// In how many samples the lag of an amplifier is told from that of a mode.
const LEAST_LAG: f64 = 2.0;

/// An operator that puts out less than this share of the range is rounding.
const LEAST_SEEN: f64 = 1e-9;

/// Plays whose weights sum to a smaller share of the steepest slope of an operator do nothing beside it.
const SMALL_PLAYS: f64 = 0.1;

/// By which share of the flattest slope of the plays an operator falls at most.
const STEEPEST_FALL: f64 = 0.95;

/// A record whose drive has a smaller share of the largest range has no loops that a transient could spoil.
const SMALL_RECORD: f64 = 0.1;

/// Without noise: the share of what plays leave that the right operator leaves at most, as its knots are few.
const TOLD: f64 = 0.05;

/// The share of what plays leave beside the noise that an operator takes at most, where it is not known which one.
const MOST_TAKEN: f64 = 0.9;

/// From so many samples on the variance of the noise is known to a twentieth.
const SAMPLES_OF_NOISE: usize = 1000;

/// Of operators that rise and operators that fall, those that fit worse by this factor of the mean square error than
/// others of use are left there.
const WORSE_DIRECTION: f64 = 4.0;

/// How many passes over selected rows each of these may take.
const PASSES: usize = 6;

/// How often knots are put where z comes to.
const MOST_KNOTTINGS: usize = 3;

/// A side of the range of z that is smaller than this share of it has no knot of its own.
const SMALLEST_SIDE: f64 = 0.1;

/// The same with an operator beside the plays, where that is asked for or predicts better.
pub(crate) fn with_duhem(
    records: &[Record<'_>],
    asked: &Options,
    plays: Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let is_forced = asked.duhem == DuhemModel::Fit;
    if plays.partial || !(is_forced || is_sought(records, asked, &plays)) {
        return Ok(plays);
    }
    let needed = if is_forced { None } else { needed(records, &plays) };
    let place = plays.trials.len();
    if !is_forced && needed.is_none() {
        return Ok(plays.with_trial(place, TermTrial::not_tried(DUHEM, TrialOutcome::NotTold)));
    }
    let needed = needed.map(|needed| plays.validated(records).map(|without| (needed, without))).transpose()?;
    if needed.as_ref().is_some_and(|(needed, without)| !may_gain(records, &plays, without.rmse, needed.must_gain)) {
        return Ok(plays.with_trial(place, TermTrial::not_tried(DUHEM, TrialOutcome::LittleLeft)));
    }
    monitor.hold();
    let best = monitor.unless_stopped(|monitor| best_of_directions(records, asked, &plays, monitor))?;
    let Some(best) = best else { return Ok(plays.stopped()) };
    let (found, predicts) = match best {
        Ok(best) => best,
        Err(outcome) => {
            let must_gain = needed.map_or(1.0, |(needed, _)| needed.must_gain);
            return Ok(plays.with_trial(place, TermTrial::by_stretches(DUHEM, must_gain, outcome)));
        }
    };
    let Some((Needed { must_gain, must_leave_noise }, without)) = needed else {
        let is_chosen = found.fit.fit.squares < plays.fit.fit.squares;
        if is_chosen {
            return Ok(found);
        }
        let plays = Found { partial: found.partial, ..plays };
        return Ok(plays.with_trial(place, TermTrial::by_stretches(DUHEM, 1.0, TrialOutcome::NotBetter)));
    };
    let outcome = if must_leave_noise && !is_told(records, &plays, &found) {
        TrialOutcome::NotTold
    } else if is_better(&predicts, &without, must_gain) {
        TrialOutcome::Better
    } else {
        TrialOutcome::NotBetter
    };
    let partial = found.partial;
    let chosen = if outcome == TrialOutcome::Better { found } else { Found { partial, ..plays } };
    let trial = TermTrial::by_stretches(DUHEM, must_gain, outcome);
    Ok(chosen.with_trial(place, trial.with_gain(without.typical_error() / predicts.typical_error())))
}

/// Whether an operator may gain what it must beside the noise of the sensor, where plays predict with this error.
fn may_gain(records: &[Record<'_>], plays: &Found, error: f64, must_gain: f64) -> bool {
    plays.fit.rows(records) < SAMPLES_OF_NOISE || {
        let residuals: Vec<_> = plays.problem(records).residuals(&plays.fit).collect();
        is_gain_enough(error, sensor_noise(&residuals), must_gain)
    }
}

/// Whether nearly all that is not noise would be gain enough.
fn is_gain_enough(error: f64, noise: f64, must_gain: f64) -> bool {
    let misfit = (error.powi(2) - noise.powi(2)).max(0.0);
    error.powi(2) >= must_gain * (error.powi(2) - MOST_TAKEN * misfit)
}

/// Whether an operator is more than one of many that follow loops of one size: the right one leaves their noise.
fn is_told(records: &[Record<'_>], plays: &Found, found: &Found) -> bool {
    let residuals: Vec<_> = found.problem(records).residuals(&found.fit).collect();
    let noise = sensor_noise(&residuals) / largest_range(records);
    let misfit = |found: &Found| (left(records, found).powi(2) - noise * noise).max(0.0).sqrt();
    misfit(found) <= noise.max(TOLD * misfit(plays))
}

/// With an operator that rises or one that falls, whichever predicts better, and how that predicts; else why there is
/// none.
fn best_of_directions(
    records: &[Record<'_>],
    asked: &Options,
    plays: &Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Result<(Found, CrossValidation), TrialOutcome>, Error> {
    let begun = begun(records, asked, plays, monitor)?;
    let mut directions = best_shapes(records, &begun)?;
    directions.retain(|direction| asked.duhem == DuhemModel::Fit || direction.promise >= MUST_PROMISE);
    let promises = !directions.is_empty();
    let span = Span { from: 0.0, to: 0.0 };
    let starts = directions.into_iter().map(|direction| direction.starts).collect();
    let mut descended = monitor.side_by_side(span.shared_by(starts), |starts, _, monitor| {
        descended(records, asked, &begun, &starts, monitor)
    })?;
    let squares = |found: &Found| found.fit.fit.squares;
    let is_of_use = |found: &Found| !found.leads(asked) && rises(found) && runs_away(records, found).is_none();
    let of_use = descended.iter().flatten().filter(|found| is_of_use(found));
    let least = of_use.map(squares).fold(f64::INFINITY, f64::min);
    descended.retain(|found| found.as_ref().is_none_or(|found| squares(found) <= WORSE_DIRECTION * least));
    let searched = monitor.side_by_side(span.shared_by(descended), |descended, _, monitor| {
        descended.map_or_else(|| Ok(begun.clone()), |found| structured(records, asked, found, monitor))
    })?;
    let mut best: Option<(Found, CrossValidation)> = None;
    for found in searched {
        // What was stopped on its way is compared with nothing.
        if found.partial {
            return Err(Error::Interrupted);
        }
        if !is_of_use(&found) {
            continue;
        }
        let predicts = found.validated(records)?;
        if best.as_ref().is_none_or(|(_, best)| is_better(&predicts, best, 1.0)) {
            best = Some((found, predicts));
        }
    }
    Ok(best.ok_or(if promises { TrialOutcome::StandsForOther } else { TrialOutcome::NotPromising }))
}

/// Whether the position rises with the drive everywhere, so that there is an inverse: an operator may fall, but by less
/// than the plays rise right after a reversal. Beside plays that stand still then it would stand for thresholds that
/// they lack: there it must do nearly all by itself.
fn rises(found: &Found) -> bool {
    let (rise, fall) = rise_and_fall(&found.fit, &found.basis);
    let plays: f64 = found.fit.space.weights_of_operators(&found.fit.fit.weights).iter().sum();
    let steepest = found.fit.space.duhem(&found.fit.fit.point).map_or(0.0, |table| table.steepest_rise());
    fall < STEEPEST_FALL * rise || fall == 0.0 && plays < SMALL_PLAYS * steepest
}

/// The flattest slope of the plays, that of their identity, and by how much an operator beside them falls at most.
fn rise_and_fall(fit: &JointFit, basis: &WeightBasis) -> (f64, f64) {
    let fall = fit.space.duhem(&fit.fit.point).map_or(0.0, |table| table.steepest_fall());
    let rise = if basis.is_identity(0) { fit.fit.weights[0] } else { 0.0 };
    (rise, fall.max(0.0))
}

/// What there is to say of an operator that falls more than the plays rise.
pub(crate) fn without_inverse(fit: &JointFit, basis: &WeightBasis) -> Option<Finding> {
    let (rise, fall) = rise_and_fall(fit, basis);
    no_inverse(rise, fall)
}

/// The same for how flat the plays are at least, and by how much the operator falls at most.
pub(crate) fn no_inverse(rise: f64, fall: f64) -> Option<Finding> {
    if fall <= 0.0 || fall < (1.0 - LEAST_SEEN) * rise {
        return None;
    }
    let message = format!(
        "the Duhem operator falls by up to {fall:.3e} per unit of the drive, and the plays rise by {rise:.3e} after a reversal: the \
         position may fall where the drive rises, and the stage has no inverse"
    );
    Some(Finding::new(FindingCode::NoInverse, rise - fall, 0.0, message))
}

/// What there is to say of an operator that comes to no loop of its own over the range of the records.
pub(crate) fn runs_away(records: &[Record<'_>], found: &Found) -> Option<Finding> {
    /// One that comes nearer to its loop by a tenth in every round moves by less in the tenth round.
    const LIMIT: f64 = 0.05;
    let table = found.fit.space.duhem(&found.fit.fit.point)?;
    let value = table.drift(bounds_of(inputs(records, found).map(|of_record| bounds(&of_record))));
    if value <= LIMIT {
        return None;
    }
    let message = format!(
        "the Duhem operator comes to no loop of its own: driven over the range and back, it still moves by {value:.2} of its \
         stroke in the tenth round. It follows these records, and runs away on others"
    );
    Some(Finding::new(FindingCode::OperatorRunsAway, value, LIMIT, message))
}

/// What an operator must do to be chosen.
struct Needed {
    /// By which factor of the mean square error of prediction it is better.
    must_gain: f64,
    /// Whether it must leave no more than the noise, as other operators would follow such loops as well.
    must_leave_noise: bool,
}

/// What is asked of an operator beside the plays; nothing suffices where time explains what plays leave, as loops that
/// need not close would follow any drift. Loops that are traversed backwards neither plays nor time explain.
fn needed(records: &[Record<'_>], plays: &Found) -> Option<Needed> {
    let findings = findings_of_fit(records, &plays.fit.chain(plays.interval(records)), &plays.options.thresholds);
    let has = |code: FindingCode| findings.iter().any(|finding| finding.code == code);
    let range = |record: &Record<'_>| record.input_bounds().1 - record.input_bounds().0;
    let largest = records.iter().map(range).fold(0.0, f64::max);
    let is_large = |record: usize| range(&records[record]) > SMALL_RECORD * largest;
    let has_transient = findings
        .iter()
        .any(|finding| finding.code == FindingCode::StartUpTransient && finding.record.is_none_or(is_large));
    // Loops that only decay do not tell an operator from what time does; on others a drift may stand for it. A first
    // way that plays fail at is a transient, unless an operator leaves noise of loops that are all alike.
    let Variety { amplitudes, apart_from_time, .. } = Variety::of(records);
    let drifts = has(FindingCode::Drift) || has(FindingCode::Leakage);
    if has_transient && amplitudes || drifts && !(apart_from_time || are_backwards(records)) {
        return None;
    }
    let must_gain = if apart_from_time && !drifts { MUST_GAIN } else { MUST_GAIN_OF_LIKE_LOOPS };
    Some(Needed { must_gain, must_leave_noise: !amplitudes })
}

/// The plays with the linear part at which an operator is looked for: a lag may hide an amplifier in front and a mode.
fn begun(
    records: &[Record<'_>],
    asked: &Options,
    plays: &Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let is_resonance =
        plays.fit.space.order() == Some(Order::Second) && plays.fit.fit.point.get(Parameter::LogDamping) < 0.0;
    let other =
        if is_resonance { None } else { with_lag_in_front(&plays.problem(records), asked, &plays.fit, monitor)? };
    let Some(fit) = other else { return Ok(plays.clone()) };
    let options = Options { dynamics: DynamicsModel::Order(Order::Second), ..plays.options.clone() };
    Ok(Found { fit, options, ..plays.clone() })
}

/// The fit with an operator that begins at the best of some starts; none without a start.
fn descended(
    records: &[Record<'_>],
    asked: &Options,
    plays: &Found,
    starts: &[DuhemTable],
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Found>, Error> {
    let Some(begun) = best_start(records, asked, plays, starts, monitor)? else { return Ok(None) };
    let fit = begun.problem(records).search_from(begun.fit.space.clone(), &begun.fit.fit.point, monitor)?;
    let found = Found { fit, ..begun };
    let (fit, dynamics) = match with_lag_in_front(&found.problem(records), asked, &found.fit, monitor)? {
        Some(other) => (other, DynamicsModel::Order(Order::Second)),
        None => (found.fit, found.options.dynamics),
    };
    let has_linear = plays.linear.is_some() || fit.space.order().is_some();
    let linear = has_linear.then(LinearEvidence::default);
    let options = Options { dynamics, ..found.options };
    Ok(Some(Found { fit, options, basis: found.basis, linear, told_alone: None, untold_map: None, ..plays.clone() }))
}

/// The same with more knots, and everything else as it suits the operator.
fn structured(
    records: &[Record<'_>],
    asked: &Options,
    found: Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let found = with_more_knots(records, found, monitor)?;
    if found.partial || !asked.leaves_structure_open() {
        return Ok(found);
    }
    let point = found.fit.fit.point;
    with_structure(records, asked, found, point, monitor)
}

/// Of fits with operators that begin at some starts the best after a few passes over selected rows: without the maps
/// and the loop shift that are left open and may have stood in for the operator.
fn best_start(
    records: &[Record<'_>],
    asked: &Options,
    plays: &Found,
    starts: &[DuhemTable],
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Found>, Error> {
    let mut best: Option<Found> = None;
    for start in starts {
        let found = begun_at(records, asked, plays, start, monitor)?;
        let least = best.as_ref().map_or(f64::INFINITY, |best| best.fit.fit.objective);
        if found.fit.fit.objective < least {
            best = Some(found);
        }
    }
    Ok(best)
}

/// One of them.
fn begun_at(
    records: &[Record<'_>],
    asked: &Options,
    plays: &Found,
    start: &DuhemTable,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let all = asked.with_open_terms(&asked.intervals(records)?);
    let Options { input_map, output_map, .. } = asked.without_open_maps();
    let options = Options {
        duhem: DuhemModel::Near(start.clone()),
        dynamics: plays.options.dynamics,
        slow_gain: plays.options.slow_gain,
        loop_shift: if asked.loop_shift == LoopShiftModel::Auto { LoopShiftModel::None } else { all.loop_shift },
        input_map,
        output_map,
        ..all
    };
    let basis = options.weight_basis(Space::new(records, &options)?.sides());
    let problem = JointProblem { records, options: &options, basis: &basis, smoothness: plays.smoothness };
    let Place { space, point } = near_plays(&problem, plays, start)?;
    let fit = {
        let projection = rough(records, &space, &basis, plays.smoothness)?;
        best_attempt(&projection, &[point], PASSES, Span { from: 0.0, to: 0.0 }, monitor)?
    };
    let fit = problem.at(&space, &fit.point)?;
    Ok(Found { fit, options: options.clone(), basis: basis.clone(), ..plays.clone() })
}

/// The space with the operator and the linear part of the plays, and the point there.
fn near_plays(problem: &JointProblem<'_>, plays: &Found, start: &DuhemTable) -> Result<Place, Error> {
    let (old, point) = (&plays.fit.space, plays.fit.fit.point);
    let space = Space::new(problem.records, problem.options)?.with_dynamics_of(old);
    Ok(Place { point: at_duhem(&point, start), space })
}

/// A fit with the lag in front of the hysteresis and a mode behind, if it is better.
fn with_lag_in_front(
    problem: &JointProblem<'_>,
    asked: &Options,
    found: &JointFit,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<JointFit>, Error> {
    let Some(Place { space, point }) = lag_in_front(problem, asked, found)? else { return Ok(None) };
    let starts = mode_starts(&space, &point);
    let other = problem.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor)?;
    Ok((MUST_GAIN * other.fit.objective < found.fit.objective).then_some(other))
}

/// Where a lag of the whole stands in front of the hysteresis, as that of an amplifier: a space with it and one mode
/// behind, and a point there; none where that is known or cannot be told.
fn lag_in_front(problem: &JointProblem<'_>, asked: &Options, found: &JointFit) -> Result<Option<Place>, Error> {
    let is_open = asked.amplifier == AmplifierModel::Auto
        && matches!(asked.dynamics, DynamicsModel::Auto | DynamicsModel::Order(Order::Second));
    let lag = found.space.linear_part(&found.fit.point).lag();
    let intervals = found.space.intervals();
    let has_mode_behind = found.space.searches(Parameter::LogBandwidth) && found.space.order().is_some();
    let is_known = has_mode_behind || !intervals.are_seconds();
    if !is_open || is_known || lag < LEAST_LAG * intervals.smallest() {
        return Ok(None);
    }
    let options = Options { dynamics: DynamicsModel::Order(Order::Second), ..problem.options.clone() };
    let space = Space::new(problem.records, &options)?.with_maps_of(&found.space).with_amplifier().without_lead();
    let bandwidth = space.nearest(Parameter::LogBandwidth, -(TAU * lag).ln());
    let point = found.fit.point.with(Parameter::LogBandwidth, bandwidth);
    let point = point.with(Parameter::DeadTime, space.nearest(Parameter::DeadTime, 0.0));
    Ok(Some(Place { space, point }))
}

/// The same point with a lightly damped mode of every frequency that may be, from that of the lag up.
fn mode_starts(space: &Space, point: &Point) -> Vec<Point> {
    let Some(axis) = space.axis(Parameter::LogFrequency) else { return vec![*point] };
    let damped = point.with(Parameter::LogDamping, space.nearest(Parameter::LogDamping, MODE_DAMPING.ln()));
    let lowest = point.get(Parameter::LogBandwidth).max(axis.lower);
    let frequencies = std::iter::successors(Some(lowest), |log| Some(log + MODE_RATIO.ln()));
    let within = frequencies.take_while(|log| *log < axis.upper).take(MOST_MODES);
    within.map(|log| damped.with(Parameter::LogFrequency, log)).collect()
}

/// Whether an operator is left open, and plays leave anything that another family may explain.
pub(crate) fn is_sought(records: &[Record<'_>], asked: &Options, plays: &Found) -> bool {
    let is_open = asked.duhem == DuhemModel::Auto && asked.model == ModelKind::Modified;
    is_open && left(records, plays) > LEAST_LEFT && plays.problem(records).colour(&plays.fit).is_coloured()
}

/// What a fit leaves, rms, as a share of the range.
fn left(records: &[Record<'_>], found: &Found) -> f64 {
    (found.fit.fit.squares / as_f64(found.fit.rows(records))).sqrt() / largest_range(records)
}

/// Operators that rise with the drive, or those that fall.
struct Direction {
    /// By which factor the best shape lowers the objective beside the plays.
    promise: f64,
    /// That shape, and the one that is best where plays do nothing: they may do what the operator should.
    starts: Vec<DuhemTable>,
}

/// The best shapes of both directions, the better one first; none of one that does not lower the objective.
fn best_shapes(records: &[Record<'_>], plays: &Found) -> Result<Vec<Direction>, Error> {
    let (space, basis) = (&plays.fit.space, &plays.basis);
    let projection = rough(records, space, basis, plays.smoothness)?;
    let fit = projection.fit(&plays.fit.fit.point, None);
    let (low, high) = space.input_bounds();
    let half_range = 0.5 * (high - low);
    let positions = largest_range(records);
    let shapes: Vec<_> = shapes()
        .map(|(rest, back)| DuhemTable::bouc_wen(rest * half_range, back))
        .filter(|shape| shape.operator::<3>().is_ok())
        .collect();
    let here = space.operators(&fit.point);
    let beside = |shape: &DuhemTable| Slope::Operators(OperatorsAt { duhem: Some(shape.clone()), ..here.clone() }, 1.0);
    let linearised = projection.linearise_beside(&fit, shapes.iter().map(beside));
    let axes = space.step_bounds(&fit.point, REACH);
    // The searched parameters move, too, with a shape or without.
    let with = |weights: &[(f64, f64)], chosen: usize, amplitudes: (f64, f64)| {
        let of = |place| if place == chosen { amplitudes } else { (0.0, 0.0) };
        let bounds: Vec<_> = axes.iter().copied().chain((0..shapes.len()).map(of)).collect();
        let step = linearised.step_within(weights, &bounds, basis);
        (step.objective, step.along[axes.len()..].iter().sum::<f64>())
    };
    let best = |weights: &[(f64, f64)], amplitudes| {
        let each = shapes.iter().enumerate().map(|(place, shape)| (shape, with(weights, place, amplitudes)));
        let (shape, (objective, amplitude)) = each.min_by(|(_, p), (_, q)| p.0.total_cmp(&q.0))?;
        let is_seen = amplitude.abs() * half_range > LEAST_SEEN * positions;
        is_seen.then(|| (shape.scaled(amplitude), objective))
    };
    let (all, identity) = (basis.bounds(), basis.bounds_of_the_identity());
    let (without, _) = with(&all, 0, (0.0, 0.0));
    let direction = |amplitudes| {
        let (shape, objective) = best(&all, amplitudes)?;
        let in_place_of_plays = best(&identity, amplitudes).map(|(shape, _)| shape);
        let starts = in_place_of_plays.filter(|other| *other != shape).into_iter().chain([shape]).collect();
        Some(Direction { promise: without / objective, starts })
    };
    let both = [direction((0.0, f64::INFINITY)), direction((f64::NEG_INFINITY, 0.0))];
    let mut both: Vec<_> = both.into_iter().flatten().collect();
    both.sort_by(|p, q| q.promise.total_cmp(&p.promise));
    Ok(both)
}

/// The same with knots where z comes to, and in between, as long as that predicts better: with other knots z comes
/// further.
fn with_more_knots(records: &[Record<'_>], mut found: Found, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    for _ in 0..MOST_KNOTTINGS {
        let finer = with_knots_where_z_comes(records, &found, monitor)?;
        let Some(finer) = finer else { break };
        found = finer;
    }
    Ok(found)
}

/// The same with knots where z comes to, and in between; none if that predicts worse.
fn with_knots_where_z_comes(
    records: &[Record<'_>],
    found: &Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Found>, Error> {
    let Some(table) = found.fit.space.duhem(&found.fit.fit.point).filter(|_| !found.partial) else {
        return Ok(None);
    };
    let Ok(table) = table.on(knots(range(records, found, &table))) else { return Ok(None) };
    monitor.hold();
    let space = found.fit.space.with_duhem(&table);
    let point = at_duhem(&found.fit.fit.point, &table);
    let fit = monitor.unless_stopped(|monitor| found.problem(records).search_from(space, &point, monitor))?;
    let Some(fit) = fit else { return Ok(Some(found.clone().stopped())) };
    let options = Options { duhem: DuhemModel::Near(table), ..found.options.clone() };
    let finer = Found { fit, options, ..found.clone() };
    let is_chosen = is_better(&finer.validated(records)?, &found.validated(records)?, 1.0);
    Ok(is_chosen.then_some(finer))
}

/// The least and the largest z along all records.
fn range(records: &[Record<'_>], found: &Found, table: &DuhemTable) -> (f64, f64) {
    bounds_of(inputs(records, found).map(|of_record| table.range(of_record.into_iter())))
}

/// What the operators of a fit are shown of every record.
fn inputs<'a>(records: &'a [Record<'_>], found: &'a Found) -> impl Iterator<Item = Vec<f64>> + 'a {
    let at = found.fit.space.operators(&found.fit.fit.point);
    let intervals = found.fit.space.intervals();
    records.iter().enumerate().map(move |(place, record)| {
        let mut path = at.path.lane(intervals.of_record(place));
        record.input().iter().map(|u| path.next(*u) - at.input_offset).collect()
    })
}

/// Five knots over a range of z: 0, where f of Bouc-Wen bends, the ends, and the middle of both sides; even ones where
/// z keeps to one side.
fn knots((low, high): (f64, f64)) -> Vec<f64> {
    let least = SMALLEST_SIDE * (high - low);
    if -low < least || high < least {
        return (0..5).map(|i| low + 0.25 * f64::from(i) * (high - low)).collect();
    }
    vec![low, 0.5 * low, 0.0, 0.5 * high, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_noise_leaves_of_an_error_may_be_too_little() {
        let enough = |noise, must_gain| is_gain_enough(1.0, noise, must_gain);
        assert_eq!(
            [0.0, 0.5, 0.9, 0.95, 1.0, 1.1].map(|noise| enough(noise, 1.2)),
            [true, true, true, false, false, false]
        );
        assert_eq!([0.0, 0.4, 0.5].map(|noise| enough(noise, 4.0)), [true, true, false]);
    }
}
