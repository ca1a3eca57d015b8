//! The whole search: the hysteresis alone, everything together, what of it stays, and the last descent with that.

use crate::choose::duhem::with_duhem;
use crate::choose::found::{Found, Lead, LinearEvidence, Structure};
use crate::choose::linear_part::{FoundJoint, search_joint};
use crate::choose::quiet_record::{Told, told_by_quietest};
use crate::choose::rivals::search_with_rivals;
use crate::choose::structure::{with_operators_chosen, with_structure};
use crate::choose::trial::{COUPLED_PLAYS, TermTrial};
use crate::error::Error;
use crate::fit::descent::search;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, SearchStage, Span};
use crate::fit::projection::levels;
use crate::fit::space::Space;
use crate::options::{Options, Setting};
use crate::records::record::Record;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::weights::WeightBasis;

/// The best of everything that was asked for; `asked` leaves nothing open that the records cannot tell.
pub(crate) fn search_all(
    records: &[Record<'_>],
    asked: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let found = with_operators_chosen(records, asked, search_fit, monitor)?;
    let found = with_own_gains(records, found, monitor)?;
    let is_joint = asked.with_open_terms(&asked.intervals(records)?).is_joint();
    if is_joint || (asked.thresholds.are_counted_by_validation() && !found.partial) {
        monitor.finish();
    }
    Ok(found)
}

/// The same with a number of operators that is known, and with dynamics that may still stand in for what the hysteresis
/// lacks. Where all that were found lead, which nothing can run, everything is searched once more: with a dead time
/// alone, or without one beside dynamics that were asked for.
fn search_fit(records: &[Record<'_>], asked: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    let found = search_with_rivals(records, asked, search_plays, monitor)?;
    if !found.fit.leads() || found.partial {
        return without_lead(records, found, monitor);
    }
    let (without, lead) = match asked.dynamics {
        DynamicsModel::Auto => (Options { dynamics: DynamicsModel::None, ..asked.clone() }, None),
        _ => (Options { dead_time: Setting::Fixed(0.0), ..asked.clone() }, Lead::of(&found.fit)),
    };
    let trials = found.overruled(|_| true);
    let found = anew(found, trials, monitor, |monitor| search_with_rivals(records, &without, search_plays, monitor))?;
    Ok(found.with_lead(lead))
}

/// The same with a dead time of 0 or more, whatever is searched after it.
fn without_lead(records: &[Record<'_>], found: Found, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    if found.fit.dead_time_samples() >= 0.0 {
        let space = found.fit.space.without_lead();
        return Ok(Found { fit: JointFit { space, ..found.fit }, ..found });
    }
    let (problem, lead) = (found.problem(records), Lead::of(&found.fit));
    let there = || problem.at_dead_time(&found.fit, 0.0);
    let (fit, partial) = if found.partial {
        (there()?, true)
    } else {
        monitor.or_where_it_began(|monitor| problem.with_dead_time(&found.fit, 0.0, monitor), there)?
    };
    Ok(Found { fit, partial, ..found }.with_lead(lead))
}

/// The same with dynamics that may lead. Where coupled plays are better than the plays that were asked for first, or
/// these need dynamics that lead, everything is searched once more with coupled plays.
fn search_plays(records: &[Record<'_>], asked: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    let plays = search_terms(records, asked, monitor)?;
    let needs_coupling = plays.needs_coupling || asked.chooses_coupling() && plays.leads(asked);
    if needs_coupling && !plays.partial {
        let trials = plays.overruled(|term| term != COUPLED_PLAYS);
        return anew(plays, trials, monitor, |monitor| search_plays(records, &asked.with_coupled_plays(), monitor));
    }
    with_duhem(records, asked, plays, monitor)
}

/// What a search that begins anew finds, with the trials that came before it; what was found before it where it was
/// stopped with something worse, unless nothing can run that.
pub(crate) fn anew(
    before: Found,
    trials: Vec<TermTrial>,
    monitor: &mut SearchMonitor<'_>,
    search: impl FnOnce(&mut SearchMonitor<'_>) -> Result<Found, Error>,
) -> Result<Found, Error> {
    monitor.hold();
    monitor.enter(SearchStage::Scan);
    let found = search(monitor)?;
    let is_worse = found.partial && before.fit.fit.objective < found.fit.fit.objective;
    let keeps_before = is_worse && !before.fit.leads();
    Ok(if keeps_before { before.stopped() } else { found.after(trials) })
}

/// The same with the plays, and the Duhem operator if there is a first one, that are asked for.
fn search_terms(records: &[Record<'_>], asked: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    let all = asked.with_open_terms(&asked.intervals(records)?);
    let (is_joint, chooses) = (all.is_joint(), asked.leaves_structure_open());
    monitor.begin(Span {
        from: 0.0,
        to: if is_joint {
            0.3
        } else if chooses {
            0.8
        } else {
            1.0
        },
    });
    let mut found = search_hysteresis(records, &if is_joint { all.hysteresis_alone() } else { all.clone() }, monitor)?;
    let plain = found.fit.fit.point;
    if is_joint && !(found.partial && all.order().is_none()) {
        found = with_linear_part(records, all, found, asked.dynamics == DynamicsModel::Auto, monitor)?;
        found = with_dynamics_told_alone(records, asked, found, monitor)?;
    }
    if chooses && !found.partial {
        monitor.begin(Span { from: if is_joint { 0.84 } else { 0.8 }, to: if is_joint { 0.97 } else { 1.0 } });
        found = with_structure(records, asked, found, plain, monitor)?;
    }
    Ok(found)
}

/// The same with the least slope that a model may have, where its own is less.
pub(crate) fn with_least_slope(records: &[Record<'_>], found: Found) -> Result<Found, Error> {
    let Some(basis) = found.basis.with_least_slope(&found.fit.fit.weights) else { return Ok(found) };
    let found = Found { basis, ..found };
    let fit = found.problem(records).at(&found.fit.space, &found.fit.fit.point)?;
    Ok(Found { fit, ..found })
}

/// The same model fitted to records that differ by a few samples, from where it was.
pub(crate) fn search_again(
    records: &[Record<'_>],
    mut found: Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let (space, point) = (found.fit.space.clone(), found.fit.fit.point);
    let problem = found.problem(records);
    let search = |monitor: &mut SearchMonitor<'_>| match found.told_alone {
        Some(_) => problem.keeping_dynamics(&found.fit, monitor),
        None => problem.search_from(space.clone(), &point, monitor),
    };
    (found.fit, found.partial) = monitor.or_where_it_began(search, || problem.at(&space, &point))?;
    with_own_gains(records, found, monitor)
}

/// The same with the dynamics that one record tells by itself, known from now on, if all records say that they are
/// better.
fn with_dynamics_told_alone(
    records: &[Record<'_>],
    asked: &Options,
    found: Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    if found.partial {
        return Ok(found);
    }
    monitor.begin(Span { from: 0.8, to: 0.82 });
    let problem = found.problem(records);
    let told = monitor.unless_stopped(|monitor| told_by_quietest(&problem, &found.fit, asked, search_fit, monitor))?;
    let Some(told) = told else { return Ok(found.stopped()) };
    let Some(Told { space, point, linear, alone }) = told else { return Ok(found) };
    let options =
        Options { dynamics: space.order().map_or(DynamicsModel::None, DynamicsModel::Order), ..found.options.clone() };
    let space = space.knowing_dynamics(&point);
    // The hysteresis may have stood in for the dynamics, too.
    monitor.begin(Span { from: 0.82, to: 0.84 });
    let search = |monitor: &mut SearchMonitor<'_>| problem.search_around(space.clone(), &point, monitor);
    let (fit, partial) = monitor.or_where_it_began(search, || problem.at(&space, &point))?;
    Ok(Found { fit, options, linear: Some(linear), told_alone: Some(alone), partial, ..found })
}

/// The same with dynamics that do not stand in for what the hysteresis lacks.
fn with_own_gains(records: &[Record<'_>], found: Found, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    if let Some(told) = &found.told_alone {
        let fit = &found.fit;
        let fit = found.problem(records).at(&fit.space.with_dynamics_of(&told.space), &fit.fit.point)?;
        return Ok(Found { fit, ..found });
    }
    if found.partial || found.linear.is_none() {
        return Ok(found);
    }
    monitor.begin(Span { from: 0.97, to: 1.0 });
    let fit = monitor.unless_stopped(|monitor| found.problem(records).with_own_gains(&found.fit, monitor))?;
    let Some(fit) = fit else { return Ok(found.stopped()) };
    Ok(Found { fit, ..found })
}

/// Hysteresis, loop shift and a dead time.
pub(crate) fn search_hysteresis(
    records: &[Record<'_>],
    options: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    search_beside(records, options, |space| space, monitor)
}

/// The square and the cube of the drive beside the operators, and a dead time.
pub(crate) fn search_polynomial(
    records: &[Record<'_>],
    asked: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    with_operators_chosen(records, asked, search_powers, monitor)
}

/// The same with a number of operators that is known.
fn search_powers(records: &[Record<'_>], asked: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Found, Error> {
    let chooses = asked.leaves_structure_open();
    monitor.begin(Span { from: 0.0, to: if chooses { 0.8 } else { 1.0 } });
    let found = search_beside(records, asked, |space| space.with_powers(), monitor)?;
    if !chooses || found.partial {
        return Ok(found);
    }
    monitor.begin(Span { from: 0.8, to: 1.0 });
    let plain = found.fit.fit.point;
    with_structure(records, asked, found, plain, monitor)
}

/// Hysteresis, a dead time, and what `beside` puts beside the operators.
fn search_beside(
    records: &[Record<'_>],
    options: &Options,
    beside: fn(Space) -> Space,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let space = beside(Space::new(records, options)?);
    let basis = options.weight_basis(space.sides());
    let smoothness = options.given_smoothness();
    let space = begun_at_virgin_plays(records, options, space, &basis)?;
    let levels = levels(records, &space, &basis, smoothness, false)?;
    let searched = match monitor.kept() {
        Some(_) => Err(Error::Interrupted),
        None => search(&levels, None, monitor),
    };
    let (fit, partial) = match (searched, monitor.kept()) {
        (Err(Error::Interrupted), Some(best)) => (levels[levels.len() - 1].at(&best), true),
        (found, _) => (found?, false),
    };
    drop(levels);
    let (structure, fit) = (Structure::default(), JointFit::new(space, fit));
    Ok(Found {
        fit,
        options: options.clone(),
        smoothness,
        basis,
        operators_tried: Vec::new(),
        structure,
        linear: None,
        told_alone: None,
        needs_coupling: false,
        trials: Vec::new(),
        untold_map: None,
        partial,
    })
}

/// By which factor plays that are virgin elsewhere must lower the objective of those that are where the first record
/// begins.
const MUST_GAIN_ELSEWHERE: f64 = 2.0;

/// The same with plays that are virgin at rest, at an end of the range or in its middle, where that is left open and
/// far better than where the first record begins.
fn begun_at_virgin_plays(
    records: &[Record<'_>],
    options: &Options,
    space: Space,
    basis: &WeightBasis,
) -> Result<Space, Error> {
    if !options.chooses_coupling() || options.input_offset != Setting::Fit {
        return Ok(space);
    }
    let levels = levels(records, &space, basis, options.given_smoothness(), true)?;
    let objective = |point: &Point| levels[0].fit(point, None).objective;
    let (low, high) = space.input_bounds();
    let places = [0.0, 0.5 * (low + high), low, high].into_iter().filter(|place| (low..=high).contains(place));
    let elsewhere = places.map(|place| (place, objective(&space.origin().with(Parameter::InputOffset, place))));
    let best = elsewhere.min_by(|(_, p), (_, q)| p.total_cmp(q));
    let here = objective(space.origin());
    let better = best.filter(|(_, there)| MUST_GAIN_ELSEWHERE * there < here);
    Ok(better.map_or_else(|| space.clone(), |(place, _)| space.with_known(Parameter::InputOffset, place)))
}

/// The same with dynamics, creep and the dead time that belongs to them behind the hysteresis; `is_open` is whether
/// dynamics may be left out.
fn with_linear_part(
    records: &[Record<'_>],
    mut options: Options,
    found: Found,
    is_open: bool,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let basis = options.weight_basis(Space::new(records, &options)?.sides());
    let problem = JointProblem { records, options: &options, basis: &basis, smoothness: found.smoothness };
    if found.partial {
        let fit = problem.at_hysteresis(&found.fit)?;
        return Ok(Found { fit, options, basis, linear: Some(LinearEvidence::default()), ..found });
    }
    let FoundJoint { fit, linear, trials, partial } = search_joint(problem, found.fit, is_open, monitor)?;
    options.dynamics = fit.space.order().map_or(DynamicsModel::None, DynamicsModel::Order);
    Ok(Found { fit, options, basis, linear: Some(linear), trials, partial, ..found })
}
