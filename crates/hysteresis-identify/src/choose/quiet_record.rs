//! The dynamics that the quietest of several records tells by itself.
//!
//! Least squares count every sample alike. What the model lacks of the hysteresis may leave of slow strokes a hundred
//! times what a small fast record says of the dynamics: they settle where they suit the strokes, or are left out. By
//! itself, with a small hysteresis of its own, the fast record tells them as well as its noise allows.

use crate::choose::found::{Found, LinearEvidence, Search, ToldAlone};
use crate::choose::linear_part::needed_evidence;
use crate::error::Error;
use crate::fit::colour::Colour;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::point::Point;
use crate::fit::progress::SearchMonitor;
use crate::fit::space::Space;
use crate::options::{Options, Setting};
use crate::records::record::Record;
use crate::records::signal::{as_f64, rms};
use crate::terms::creep::CreepModel;
use crate::terms::duhem::DuhemModel;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::Thresholds;
use crate::terms::relaxing_plays::RelaxingPlaysModel;
use crate::terms::slow_gain::SlowGainModel;
use crate::terms::weights::WeightLaw;
use crate::uncertainty::root::{ColouredFit, Root};
use crate::uncertainty::standard_errors::StandardErrors;

/// How many operators the hysteresis of the one record has: its dynamics are wanted, and a few make a small loop.
const OPERATORS: usize = 8;

/// Which share of what is left of the noisiest record its own fit leaves of the one record at most: least squares count
/// records that are about as noisy as they deserve.
const MOST_LEFT: f64 = 0.5;

/// What one record told of the dynamics.
pub(crate) struct Told {
    /// Where it was searched.
    pub(crate) space: Space,
    pub(crate) point: Point,
    pub(crate) linear: LinearEvidence,
    pub(crate) alone: ToldAlone,
}

/// The dynamics that the quietest record tells by itself, in the space and at the point of a fit of all records, if
/// these say that they are better than those of the fit: it by its own hysteresis, each of the others beside a gain and
/// by its noise. `search` is that of all records: it does for the one, too.
pub(crate) fn told_by_quietest(
    problem: &JointProblem<'_>,
    found: &JointFit,
    asked: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Told>, Error> {
    if asked.dynamics == DynamicsModel::None || !problem.may_stand_in(found) {
        return Ok(None);
    }
    let found = &problem.with_dynamics_beside_gains(found);
    let left: Vec<Vec<f64>> = problem.residuals_beside_gains(found).collect();
    let place = quietest(found, &left);
    let record = problem.records[place];
    if !Colour::new(&left[place], record.output_range()).is_coloured() {
        return Ok(None);
    }
    let one = [record.sampled_every(found.space.intervals().of_record(place))?];
    let Some(alone) = fit_of_one(&one, asked, search, monitor)? else { return Ok(None) };
    let noise = (alone.fit.fit.squares / as_f64(alone.fit.rows(&one))).sqrt();
    if noise > MOST_LEFT * left.iter().map(|left| rms(left)).fold(0.0, f64::max) {
        return Ok(None);
    }
    let with = with_dynamics_of(found, &alone.fit);
    let others: f64 = (problem.evidence_beside_gains(found, &with).into_iter().enumerate())
        .filter_map(|(other, evidence)| (other != place).then_some(evidence))
        .sum();
    let own = alone.problem(&one);
    let instead = with_dynamics_of(&alone.fit, found);
    let evidence = others + own.evidence(&own.at(&instead.space, &instead.fit.point)?, &alone.fit);
    if evidence < needed_evidence(problem.records, &with) {
        return Ok(None);
    }
    let told = ToldAlone { errors: standard_errors(&one, &alone), space: with.space.clone() };
    let linear = alone.linear.unwrap_or_default();
    Ok(Some(Told { space: with.space, point: with.fit.point, linear, alone: told }))
}

/// The fit of one record by itself, if it tells dynamics.
fn fit_of_one(
    one: &[Record<'_>],
    asked: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<Found>, Error> {
    let found = match monitor.nested(|monitor| search(one, &of_one_record(asked), monitor)) {
        Err(Error::Interrupted) => return Err(Error::Interrupted),
        // What a record is too short for, it does not tell.
        Err(_) => return Ok(None),
        Ok(found) if found.partial => return Err(Error::Interrupted),
        Ok(found) => found,
    };
    let is_told = found.linear.as_ref().is_some_and(|linear| linear.too_little.is_none());
    Ok((is_told && found.fit.space.order().is_some()).then_some(found))
}

/// The standard errors of the fit of one record.
fn standard_errors(one: &[Record<'_>], Found { fit: found, basis, .. }: &Found) -> StandardErrors {
    let JointFit { space, fit, linearised } = found;
    let chain = found.chain(space.intervals().smallest());
    let white = Root::of(fit, linearised, space, found.rows(one));
    let root = ColouredFit { records: one, space, basis, fit, chain: &chain }.root(white, linearised.penalty());
    StandardErrors::of(fit, &root, basis, space)
}

/// The fastest record, and of those the one of which least is left.
fn quietest(found: &JointFit, left: &[Vec<f64>]) -> usize {
    let intervals = found.space.intervals();
    let by_interval = |a: usize, b: usize| intervals.of_record(a).total_cmp(&intervals.of_record(b));
    let by_rest = |a: usize, b: usize| rms(&left[a]).total_cmp(&rms(&left[b]));
    (0..left.len()).min_by(|a, b| by_interval(*a, *b).then(by_rest(*a, *b))).unwrap_or(0)
}

/// What is asked of one record: the dynamics that are asked for, behind a hysteresis that costs little.
fn of_one_record(asked: &Options) -> Options {
    Options {
        thresholds: Thresholds::Uniform(OPERATORS),
        weights: WeightLaw::Free,
        smoothness: Setting::Fixed(0.0),
        creep: if asked.creep == CreepModel::Auto { CreepModel::SlowAndFast } else { asked.creep.clone() },
        loop_shift: LoopShiftModel::None,
        relaxing_plays: RelaxingPlaysModel::None,
        slow_gain: SlowGainModel::None,
        duhem: DuhemModel::None,
        input_map: MapModel::None,
        output_map: MapModel::None,
        ..asked.clone()
    }
}

/// A fit with the dynamics of another one, everything else as it is.
fn with_dynamics_of(found: &JointFit, other: &JointFit) -> JointFit {
    let mut with = JointFit { space: found.space.with_dynamics_of(&other.space), ..found.clone() };
    with.fit.point = with.fit.point.with_dynamics_of(&other.fit.point);
    with
}
