//! From a grid of starts to the least squares.

use std::ops::ControlFlow;

use faer::Mat;

use super::options::Order;
use super::response::{LinearParameter, LinearPoint, ResponseFit, ResponseProblem};
use crate::error::Error;
use crate::fit::bounded;
use crate::numeric::as_f64;
use crate::options::Setting;

/// The ratio of neighbouring frequencies of the grid.
const GRID_RATIO: f64 = 1.1;

/// The damping ratios of the grid.
const GRID_DAMPINGS: [f64; 4] = [0.02, 0.1, 0.4, 1.2];

/// The damping ratios that are searched.
const DAMPINGS: (f64, f64) = (1e-4, 10.0);

/// The longest delay that is searched, as a share of the record.
const MAX_DELAY_SHARE: f64 = 0.1;

/// The scan looks at about this many samples of a response, however long the record.
const SCAN_SAMPLES: usize = 20_000;

/// How many minima of the scan are improved, and by how many steps before the best of them goes on.
const STARTS: usize = 5;
const FIRST_STEPS: usize = 10;
const STEPS: usize = 100;

/// A step that promises less than this share of the sum of squares is not worth it.
const MIN_GAIN: f64 = 1e-13;

/// Steps below this, in scales, change nothing.
const MIN_STEP: f64 = 1e-14;

/// Where the search may go.
pub(super) struct SearchDomain {
    log_frequency: (f64, f64),
    log_damping: (f64, f64),
    pub(super) max_delay: f64,
    /// The delay that is known, if it is.
    delay: Setting<f64>,
}

impl SearchDomain {
    /// Frequencies from a tenth of a cycle per record to half the sampling rate.
    pub(super) fn new(samples: usize, dt: f64, delay: Setting<f64>) -> Self {
        Self {
            log_frequency: ((0.1 / (as_f64(samples) * dt)).ln(), (0.5 / dt).ln()),
            log_damping: (DAMPINGS.0.ln(), DAMPINGS.1.ln()),
            max_delay: (MAX_DELAY_SHARE * as_f64(samples)).floor(),
            delay,
        }
    }

    fn bounds(&self, parameter: LinearParameter) -> (f64, f64) {
        match parameter {
            LinearParameter::LogFrequency => self.log_frequency,
            LinearParameter::LogDamping => self.log_damping,
            LinearParameter::Delay => (0.0, self.max_delay),
        }
    }

    /// Whether the search was stopped by a bound.
    pub(super) fn at_bound(&self, point: &LinearPoint, parameter: LinearParameter) -> bool {
        let ((lower, upper), value) = (self.bounds(parameter), point.get(parameter));
        value <= lower || value >= upper
    }

    fn frequencies(&self) -> impl Iterator<Item = f64> {
        let (lower, upper) = self.log_frequency;
        std::iter::successors(Some(upper), |log| Some(log - GRID_RATIO.ln()))
            .skip(1)
            .take_while(move |log| *log > lower)
            .map(f64::exp)
    }

    /// The delay that is known, or delays worth a look: ever further apart.
    fn delays(&self) -> Vec<f64> {
        match self.delay {
            Setting::Fixed(delay) => vec![delay],
            Setting::Fit => {
                let powers = std::iter::successors(Some(2.0), |power| Some(2.0 * power));
                let further = powers.flat_map(|power| [power, 1.5 * power]).take_while(|d| *d < self.max_delay);
                [0.0, 1.0].into_iter().chain(further).collect()
            }
        }
    }
}

/// The size of a bold step.
fn scale(parameter: LinearParameter) -> f64 {
    match parameter {
        LinearParameter::LogFrequency => 0.3,
        LinearParameter::LogDamping | LinearParameter::Delay => 1.0,
    }
}

/// Counts passes over the record, and stops where the caller says so.
pub(super) struct PassCounter<'a> {
    proceed: &'a mut dyn FnMut() -> ControlFlow<()>,
    pub(super) evaluations: usize,
}

impl<'a> PassCounter<'a> {
    pub(super) fn new(proceed: &'a mut dyn FnMut() -> ControlFlow<()>) -> Self {
        Self { proceed, evaluations: 0 }
    }

    fn evaluated(&mut self) -> Result<(), Error> {
        self.evaluations += 1;
        match (self.proceed)() {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted),
        }
    }
}

/// The best fit, with the whole delay below which its derivatives are taken.
pub(super) fn search(
    problem: &ResponseProblem<'_>,
    domain: &SearchDomain,
    monitor: &mut PassCounter<'_>,
) -> Result<(ResponseFit, f64), Error> {
    let mut best: Option<(ResponseFit, f64)> = None;
    for start in scan(problem, domain, monitor)? {
        let found = improve(problem, domain, start, FIRST_STEPS, monitor)?;
        if best.as_ref().is_none_or(|(best, _)| found.0.squares < best.squares) {
            best = Some(found);
        }
    }
    let (best, _) = best.expect("the scan returns at least one start");
    improve(problem, domain, best.point, STEPS, monitor)
}

/// The best of the points of the grid that fit better than those of the next frequencies, at least one.
fn scan(
    problem: &ResponseProblem<'_>,
    domain: &SearchDomain,
    monitor: &mut PassCounter<'_>,
) -> Result<Vec<LinearPoint>, Error> {
    let dampings = match problem.order {
        Order::First => &GRID_DAMPINGS[..1],
        Order::Second => &GRID_DAMPINGS[..],
    };
    let rows = Rows::new(problem);
    let mut along: Vec<(f64, LinearPoint)> = Vec::new();
    for frequency in domain.frequencies() {
        let mut best = (f64::INFINITY, LinearPoint::new(frequency, dampings[0], 0.0));
        for damping in dampings {
            let point = LinearPoint::new(frequency, *damping, 0.0);
            let response = problem.response(&point)?;
            monitor.evaluated()?;
            for delay in domain.delays() {
                let squares = rows.squares(&response, delay);
                if squares < best.0 {
                    best = (squares, point.with(LinearParameter::Delay, delay));
                }
            }
        }
        along.push(best);
    }
    let squares =
        |place: Option<usize>| place.and_then(|i| along.get(i)).map_or(f64::INFINITY, |(squares, _)| *squares);
    let is_minimum = |i: &usize| {
        let here = squares(Some(*i));
        here <= squares(i.checked_sub(1)) && here <= squares(Some(i + 1))
    };
    let mut minima: Vec<_> = (0..along.len()).filter(is_minimum).map(|i| along[i]).collect();
    minima.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    minima.truncate(STARTS);
    Ok(minima.into_iter().map(|(_, point)| point).collect())
}

/// Some of the fitted rows, for comparing starts.
struct Rows<'a> {
    problem: &'a ResponseProblem<'a>,
    places: Vec<usize>,
    mean: f64,
}

impl<'a> Rows<'a> {
    fn new(problem: &'a ResponseProblem<'a>) -> Self {
        let rows = problem.input.len() - problem.skip;
        let places: Vec<_> = (problem.skip..problem.input.len()).step_by(rows.div_ceil(SCAN_SAMPLES)).collect();
        let mean = places.iter().map(|k| problem.output[*k]).sum::<f64>() / as_f64(places.len());
        Self { problem, places, mean }
    }

    /// The sum of squares that the best offset and a gain that is not negative leave, creep aside.
    fn squares(&self, response: &[f64], delay: f64) -> f64 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 <= delay < length")]
        let whole = delay as usize;
        let at = |k: usize| if k >= whole { response[k - whole] } else { 0.0 };
        let mean = self.places.iter().map(|k| at(*k)).sum::<f64>() / as_f64(self.places.len());
        let (mut ss, mut sy, mut yy) = (0.0, 0.0, 0.0);
        for k in &self.places {
            let (s, y) = (at(*k) - mean, self.problem.output[*k] - self.mean);
            ss += s * s;
            sy += s * y;
            yy += y * y;
        }
        if sy > 0.0 { yy - sy / ss * sy } else { yy }
    }
}

/// At most that many bounded Gauss-Newton steps, within one whole delay after the other: there the slope jumps.
fn improve(
    problem: &ResponseProblem<'_>,
    domain: &SearchDomain,
    start: LinearPoint,
    mut steps: usize,
    monitor: &mut PassCounter<'_>,
) -> Result<(ResponseFit, f64), Error> {
    let mut here = problem.fit(&start)?;
    monitor.evaluated()?;
    let highest_cell = (domain.max_delay - 1.0).max(0.0);
    let mut cell = start.get(LinearParameter::Delay).floor().min(highest_cell);
    improve_in_cell(problem, domain, &mut here, cell, &mut steps, monitor)?;
    while let Some(next) = next_cell(problem, &here, cell, highest_cell) {
        let before = here.squares;
        improve_in_cell(problem, domain, &mut here, next, &mut steps, monitor)?;
        if here.squares >= before {
            break;
        }
        cell = next;
    }
    Ok((here, cell))
}

/// The whole delay beyond the edge at which the search within this one ended, if it did.
fn next_cell(problem: &ResponseProblem<'_>, here: &ResponseFit, cell: f64, highest: f64) -> Option<f64> {
    let delay = here.point.get(LinearParameter::Delay);
    if !problem.axes.contains(&LinearParameter::Delay) {
        None
    } else if delay <= cell && cell > 0.0 {
        Some(cell - 1.0)
    } else if delay >= cell + 1.0 && cell < highest {
        Some(cell + 1.0)
    } else {
        None
    }
}

fn improve_in_cell(
    problem: &ResponseProblem<'_>,
    domain: &SearchDomain,
    here: &mut ResponseFit,
    cell: f64,
    steps: &mut usize,
    monitor: &mut PassCounter<'_>,
) -> Result<(), Error> {
    let mut radius = 1.0;
    while *steps > 0 && here.squares > problem.rounding_squares() {
        *steps -= 1;
        let linearised = LinearisedResponse::new(&problem.linearise(here, cell)?, problem.coefficients());
        monitor.evaluated()?;
        if !step_down(problem, domain, here, &linearised, cell, &mut radius, monitor)? {
            break;
        }
    }
    Ok(())
}

/// What is left of the linearised problem once the coefficients have done their best.
struct LinearisedResponse {
    a: Mat<f64>,
    b: Vec<f64>,
    /// The sum of squares that no step can lower.
    rest: f64,
}

impl LinearisedResponse {
    fn new(triangle: &Mat<f64>, coefficients: usize) -> Self {
        let last = triangle.ncols() - 1;
        Self {
            a: triangle.get(coefficients..last, coefficients..last).to_owned(),
            b: (coefficients..last).map(|i| triangle[(i, last)]).collect(),
            rest: triangle[(last, last)] * triangle[(last, last)],
        }
    }
}

/// Moves to the first fit below `here` that shrinking the trust region finds; false if none is worth a step.
fn step_down(
    problem: &ResponseProblem<'_>,
    domain: &SearchDomain,
    here: &mut ResponseFit,
    linearised: &LinearisedResponse,
    cell: f64,
    radius: &mut f64,
    monitor: &mut PassCounter<'_>,
) -> Result<bool, Error> {
    let axes = &problem.axes;
    let bounds_of =
        |axis: LinearParameter| if axis == LinearParameter::Delay { (cell, cell + 1.0) } else { domain.bounds(axis) };
    loop {
        let reach = |axis: &LinearParameter| {
            let ((lower, upper), value, reach) = (bounds_of(*axis), here.point.get(*axis), *radius * scale(*axis));
            ((lower - value).max(-reach).min(0.0), (upper - value).min(reach).max(0.0))
        };
        let bounds: Vec<_> = axes.iter().map(reach).collect();
        let free: Vec<_> = (0..axes.len()).collect();
        let solution = bounded::solve(linearised.a.as_ref(), &linearised.b, &bounds, &free);
        let promised = here.squares - (linearised.rest + solution.squares);
        let size = axes.iter().zip(&solution.x).map(|(axis, x)| x.abs() / scale(*axis)).fold(0.0, f64::max);
        if promised.is_nan() || promised <= MIN_GAIN * here.squares || size < MIN_STEP {
            return Ok(false);
        }
        let moved = axes.iter().zip(&solution.x).fold(here.point, |point, (axis, x)| {
            let (lower, upper) = bounds_of(*axis);
            point.with(*axis, (point.get(*axis) + x).clamp(lower, upper))
        });
        let there = problem.fit(&moved)?;
        monitor.evaluated()?;
        let decrease = here.squares - there.squares;
        if decrease > 0.75 * promised {
            *radius = radius.max(2.0 * size);
        } else if decrease.is_nan() || decrease < 0.25 * promised {
            *radius = 0.25 * size;
        }
        if decrease > 0.0 {
            *here = there;
            return Ok(true);
        }
    }
}
