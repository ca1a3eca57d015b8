//! The nonlinear half of the problem: a scan of starts on thinned rows, then Gauss-Newton on all of them.

use std::cmp::Ordering;

use crate::error::Error;
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, SearchStage, Span};
use crate::fit::projection::{Linearised, ProjectedFit, Projection};
use crate::records::signal::as_f64;

/// Successive halving: how many fits enter each round, and how many passes over the records each may take in it.
type Rounds = [(usize, usize)];

/// For a search from nothing.
const ROUNDS: [(usize, usize); 3] = [(25, 5), (12, 8), (5, 18)];

/// How many passes over the records the steps of a descent may take, how many after a descent on fewer rows, and how
/// many over all samples of a long record: what is left then are steps along directions that the data hardly tell.
const LONG: usize = 60;
const MEDIUM: usize = 15;
const SHORT: usize = 3;

/// The part of a search from nothing that finds where to go on with all samples.
const FIRST: Span = Span { from: 0.0, to: 0.6 };

/// A longer dead time must lower the sum of squares by this share: whole periods of the drive fit alike.
pub(crate) const DEAD_TIME_MUST_GAIN: f64 = 0.01;

/// The trust region of the first step, in scales of the axes.
pub(crate) const FIRST_RADIUS: f64 = 0.25;

/// Below this share of the sum of squares of the data the residual is rounding.
pub(crate) const ROUNDING_SQUARES: f64 = 1e-28;

/// Steps below this, in scales, change nothing.
const MIN_STEP: f64 = 1e-13;

/// When to stop improving.
#[derive(Clone, Copy)]
pub(crate) struct Patience {
    /// The promised decrease, as a share of the objective, that is not worth a step.
    pub(crate) gain: f64,
    /// How many passes over the samples the steps may take.
    pub(crate) passes: usize,
}

impl Patience {
    /// Whether a step of this size, in scales, is worth a pass.
    pub(crate) fn is_worth(&self, promised: f64, objective: f64, size: f64) -> bool {
        promised > self.gain * objective && size >= MIN_STEP
    }
}

/// The radius of a box-shaped trust region after a step of this size, in scales, that promised more or less than it
/// did.
pub(crate) fn trusted(radius: f64, size: f64, decrease: f64, promised: f64) -> f64 {
    if decrease > 0.75 * promised {
        radius.max(2.0 * size)
    } else if decrease.is_nan() || decrease < 0.25 * promised {
        0.25 * size
    } else {
        radius
    }
}

/// The best fit on all rows with its derivatives; `levels` are the same problem on ever more rows: the first finds
/// where to start unless that is known, each further one is cheap because it starts next to where it ends, and the last
/// has all of them.
pub(crate) fn search(
    levels: &[Projection<'_>],
    known: Option<&ProjectedFit>,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(ProjectedFit, Linearised), Error> {
    let (thinned, all) = (&levels[0], &levels[levels.len() - 1]);
    // On n samples an estimate is known to a share of 1/n of the sum of squares: a hundredth of that is not worth a
    // step.
    let patience = |rows: usize, passes| Patience { gain: (1e-2 / as_f64(rows)).max(1e-9), passes };
    let mut best = None;
    if !all.space().axes().is_empty() {
        let mut found =
            if let Some(known) = known { known.clone() } else { best_of_starts(thinned, &ROUNDS, FIRST, monitor)? };
        let (between, middle) = (Span { from: 0.6, to: 0.7 }, &levels[1..levels.len() - 1]);
        for (i, more) in middle.iter().enumerate() {
            let span = between.part(i, middle.len());
            let patience = patience(more.rows(), if i == 0 { LONG } else { MEDIUM });
            found = improve(more, &found.point, Some(&found), patience, span, monitor)?.0;
        }
        best = Some(found);
    }
    monitor.enter(SearchStage::Finish);
    let start = best.as_ref().or(known).map_or(*all.space().origin(), |fit| fit.point);
    improve(
        all,
        &start,
        best.as_ref(),
        patience(all.rows(), if levels.len() > 2 { SHORT } else { LONG }),
        Span { from: 0.7, to: 1.0 },
        monitor,
    )
}

/// The best that the usual starts lead to on a selection of the rows.
pub(crate) fn best_of_starts(
    thinned: &Projection<'_>,
    rounds: &Rounds,
    span: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<ProjectedFit, Error> {
    let scanned = scan(thinned, &thinned.space().starts(), Span { to: span.at(1, 3), ..span }, monitor)?;
    refine(thinned, rounds, scanned, Span { from: span.at(1, 3), ..span }, monitor)
}

/// The fits at all starts, best first, all at the dead time that suits the best of them.
fn scan(
    thinned: &Projection<'_>,
    starts: &[Point],
    span: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Vec<ProjectedFit>, Error> {
    let mut fits_at = |points: &[Point], third: usize| fits_at(thinned, points, span.part(third, 3), monitor);
    let mut fits = fits_at(starts, 0)?;
    fits.sort_by(by_objective);
    let first = fits[0].point;
    let delayed = |start: &Point, dead_time| start.with(Parameter::DeadTime, dead_time);
    let later: Vec<_> = thinned.space().dead_times().into_iter().map(|dead_time| delayed(&first, dead_time)).collect();
    let mut best = fits[0].clone();
    for fit in fits_at(&later, 1)? {
        if fit.objective < (1.0 - DEAD_TIME_MUST_GAIN) * best.objective {
            best = fit;
        }
    }
    let dead_time = best.point.get(Parameter::DeadTime);
    if dead_time != first.get(Parameter::DeadTime) {
        let starts: Vec<_> = starts.iter().map(|start| delayed(start, dead_time)).collect();
        fits = fits_at(&starts, 2)?;
        fits.sort_by(by_objective);
    }
    Ok(fits)
}

/// The fits at points, as a part of the work.
fn fits_at(
    projection: &Projection<'_>,
    points: &[Point],
    span: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Vec<ProjectedFit>, Error> {
    monitor.side_by_side(span.shared_by(points.iter().collect()), |point, span, monitor| {
        let fit = projection.fit(point, None);
        monitor.evaluated(projection, &fit, span.to).map(|()| fit)
    })
}

/// The points that fit best as they are, so many of them at most, each once.
pub(crate) fn best_points(
    projection: &Projection<'_>,
    points: &[Point],
    most: usize,
    span: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Vec<Point>, Error> {
    let mut fits = fits_at(projection, points, span, monitor)?;
    fits.sort_by(by_objective);
    fits.dedup_by(|next, before| next.point == before.point);
    Ok(fits.iter().take(most).map(|fit| fit.point).collect())
}

/// Where the best of these fits leads: in every round the better ones go on.
fn refine(
    thinned: &Projection<'_>,
    rounds: &Rounds,
    mut fits: Vec<ProjectedFit>,
    whole: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<ProjectedFit, Error> {
    monitor.enter(SearchStage::Refine);
    let (mut done, total) = (0, rounds.iter().map(|(entering, _)| entering).sum());
    for (entering, passes) in rounds.iter().copied() {
        fits.truncate(entering);
        let round = Span { from: whole.at(done, total), to: whole.at(done + fits.len(), total) };
        done += fits.len();
        fits = monitor.side_by_side(round.shared_by(fits), |fit, span, monitor| {
            let patience = Patience { gain: 1e-5, passes };
            Ok(improve(thinned, &fit.point, Some(&fit), patience, span, monitor)?.0)
        })?;
        fits.sort_by(by_objective);
    }
    Ok(fits.swap_remove(0))
}

fn by_objective(p: &ProjectedFit, q: &ProjectedFit) -> Ordering {
    p.objective.total_cmp(&q.objective)
}

/// The best of where a few steps lead from each start, of which there is one at least.
pub(crate) fn best_attempt(
    projection: &Projection<'_>,
    starts: &[Point],
    passes: usize,
    span: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<ProjectedFit, Error> {
    let mut fits = monitor.side_by_side(span.shared_by(starts.iter().collect()), |start, span, monitor| {
        Ok(improve(projection, start, None, Patience { gain: 1e-4, passes }, span, monitor)?.0)
    })?;
    fits.sort_by(by_objective);
    Ok(fits.swap_remove(0))
}

/// Descends from a point by Gauss-Newton steps in a box-shaped trust region.
///
/// The linear half is solved anew at every point (variable projection). A step comes from the residual linearised
/// along the axes *and* the weights, min |y - offsets - Z w - D s| over admissible w and s in the box, which is the
/// step of Kaufman (1975) with the bounds of both halves kept exactly. The model is piecewise linear in the ratios, so
/// the steps converge fast once the pieces no longer change. A pass over the records gives the fit at a point and the
/// next derivatives at once, at the weights that the step foresaw.
fn improve(
    projection: &Projection<'_>,
    start: &Point,
    like: Option<&ProjectedFit>,
    mut patience: Patience,
    span: Span,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(ProjectedFit, Linearised), Error> {
    let first = if like.is_none() { Some(projection.fit(start, None)) } else { None };
    if let Some(first) = &first {
        monitor.evaluated(projection, first, span.from)?;
    }
    let like = first.as_ref().or(like);
    let weights = like.map_or(&[][..], |fit| &fit.weights);
    let (mut here, mut linearised) = projection.linearise(start, weights, like);
    monitor.evaluated(projection, &here, span.from)?;
    let mut radius = FIRST_RADIUS;
    let passes = patience.passes;
    while !projection.space().axes().is_empty() && here.objective > ROUNDING_SQUARES * here.base_squares {
        let fraction = span.at(passes - patience.passes, passes);
        let found = step_down(projection, &here, &linearised, &mut radius, &mut patience, fraction, monitor)?;
        let Some(there) = found else { break };
        (here, linearised) = there;
    }
    monitor.evaluated(projection, &here, span.to)?;
    Ok((here, linearised))
}

/// The first fit below `here` that shrinking the trust region finds, or none if none is worth a step.
fn step_down(
    projection: &Projection<'_>,
    here: &ProjectedFit,
    linearised: &Linearised,
    radius: &mut f64,
    patience: &mut Patience,
    fraction: f64,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<(ProjectedFit, Linearised)>, Error> {
    let space = projection.space();
    while patience.passes > 0 {
        patience.passes -= 1;
        let step = linearised.step(&space.step_bounds(&here.point, *radius), projection.basis());
        let (size, promised) = (space.size_of(&step.along), here.objective - step.objective);
        if !patience.is_worth(promised, here.objective, size) {
            return Ok(None);
        }
        let point = space.moved(&here.point, &step.along);
        let (there, next) = projection.linearise(&point, &step.weights, Some(here));
        monitor.evaluated(projection, &there, fraction)?;
        let decrease = here.objective - there.objective;
        *radius = trusted(*radius, size, decrease, promised);
        if decrease > 0.0 {
            return Ok(Some((there, next)));
        }
    }
    Ok(None)
}
