//! The inverse of a strictly increasing polyline.

use super::direction::Direction;
use super::line::Piece;

/// A point of the polyline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) input: f64,
    pub(crate) output: f64,
}

impl Point {
    /// The same point over the mirrored input.
    #[inline]
    pub(crate) fn mirrored(self) -> Self {
        Self { input: -self.input, ..self }
    }
}

/// Where a move towards a given output came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// The input there.
    pub(crate) input: f64,
    /// The output there: what was asked for, or what the limit allows.
    pub(crate) output: f64,
    pub(crate) saturated: bool,
}

/// What moves along a polyline.
pub(crate) trait Path {
    /// What it takes to come back to a position.
    type Checkpoint: Copy;
    fn checkpoint(&self) -> Self::Checkpoint;
    fn go_back(&mut self, to: Self::Checkpoint);
    /// Moves to an input ahead; the piece there.
    fn look(&mut self, direction: Direction, input: f64) -> Piece;
}

/// Moves `path` from `near`, in `direction`, until the output is `target`, or to `limit` if it is not there yet.
/// `far` lies beyond the target, if it is known.
///
/// The first look is at `guess`, every other where the last piece, prolonged, has the target: Newton's method. It ends
/// as soon as that lies within the piece, so the answer is exact on that line. Every fourth step makes sure that there
/// are few: it halves what is left, or, as long as nothing beyond the target is known, goes much further.
#[inline(always)]
pub(crate) fn solve(
    path: &mut impl Path,
    direction: Direction,
    mut near: Point,
    mut far: Option<Point>,
    guess: f64,
    target: f64,
    limit: f64,
) -> Reach {
    let mut checkpoint = path.checkpoint();
    // Where the last piece that falls short ends, and the first one that is too far begins.
    let (mut near_end, mut far_begin) = (near.input, far.map_or(limit, |far| far.input));
    // Only there: where products underflow, every guess is `near`.
    let mut guess = if target == near.output { near.input } else { bracketed(direction, guess, near, far, limit) };
    let mut step = 0_u8;
    loop {
        step = step.wrapping_add(1);
        let piece = path.look(direction, guess);
        let newton = piece.line.inverted().at(target);
        let begin = direction.further(piece.begin, near.input);
        let on_piece = direction.has_passed(begin, newton) & !direction.has_passed(piece.end, newton);
        if (on_piece || newton == guess) && !direction.leads_away(newton, limit) {
            return Reach { input: newton, output: target, saturated: false };
        }
        let here = Point { input: guess, output: piece.line.at(guess) };
        let short = direction.has_passed(here.output, target);
        let points_ahead = direction.leads_away(newton, guess);
        let collapsed = far.is_some_and(|far| guess == far.input || guess == near.input);
        if short != points_ahead || collapsed {
            // The target is here, but for rounding.
            return Reach { input: guess, output: target, saturated: false };
        }
        if short {
            if guess == limit {
                return Reach { input: limit, output: here.output, saturated: target != here.output };
            }
            (near, checkpoint, near_end) = (here, path.checkpoint(), piece.end);
        } else {
            (far, far_begin) = (Some(here), begin);
        }
        if far.is_some() && far_begin == near_end {
            // The pieces meet, and rounding leaves the target to neither.
            return Reach { input: far_begin, output: target, saturated: false };
        }
        if !short {
            path.go_back(checkpoint);
        }
        let next = match far {
            _ if !step.is_multiple_of(4) => newton,
            Some(_) => f64::NAN,
            None => newton + FURTHER * (newton - guess),
        };
        guess = bracketed(direction, next, near, far, limit);
    }
}

/// How many times as far as Newton's method a step goes that is to find what lies beyond the target.
const FURTHER: f64 = 16.0;

/// Where the target may be, for a first look: where a hyperbola that leaves `near` with `slope` and goes through `far` has the output `target`: as good as a
/// parabola for slopes that change little, and a single division. Without `far`, a straight line.
#[inline(always)]
pub(crate) fn first_guess(near: Point, slope: f64, far: Option<Point>, target: f64) -> f64 {
    let rise = target - near.output;
    let Some(far) = far else { return near.input + rise / slope };
    let (width, height) = (far.input - near.input, far.output - near.output);
    near.input + rise * height * width / (slope * width * (height - rise) + height * rise)
}

/// The guess if it lies between what is known, else the middle; or the limit if nothing beyond the target is known.
#[inline(always)]
fn bracketed(direction: Direction, guess: f64, near: Point, far: Option<Point>, limit: f64) -> f64 {
    let end = far.map_or(limit, |far| far.input);
    let within = direction.leads_away(guess, near.input) && !direction.has_passed(end, guess);
    match far {
        _ if within => guess,
        Some(far) => near.input + 0.5 * (far.input - near.input),
        None => limit,
    }
}
