//! The inverse of a strictly increasing polyline.

use super::turning_points::Direction;
use super::{Piece, Reach};

/// A point of the polyline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) input: f64,
    pub(crate) output: f64,
}

/// Moves `place` from `near`, in `direction`, until the output is `target`, or to `limit` if it is not there yet.
/// `slope` is that of the polyline at `near`, or NaN; `far` lies beyond the target, if it is known.
///
/// `look(place, input)` moves a place to an input ahead and gives the piece there. The first look is where the target
/// would be on a smooth curve through what is known, every other where the last piece, prolonged, has it: Newton's
/// method. It ends as soon as that lies within the piece, so the answer is exact on that line. Bracketed, with a
/// bisection every fourth step.
#[inline]
#[expect(clippy::too_many_arguments, reason = "all that is known of the two ends of one search")]
pub(crate) fn solve<P: Copy>(
    place: &mut P,
    direction: Direction,
    mut near: Known,
    slope: f64,
    mut far: Option<Known>,
    target: f64,
    limit: f64,
    look: impl Fn(&mut P, f64) -> Piece,
) -> Reach {
    let mut near_place = *place;
    let mut near_end = near.input;
    let mut guess = match first_guess(near, slope, far, target) {
        guess if guess == near.input => guess,
        guess => bracketed(direction, guess, near, far, limit),
    };
    for step in 1_u32.. {
        let piece = look(place, guess);
        let newton = piece.line.inverted().at(target);
        let begin = direction.reversed().nearer(piece.begin, near.input);
        let on_piece = direction.has_passed(begin, newton) && !direction.has_passed(piece.end, newton);
        if on_piece && !direction.leads_away(newton, limit) {
            return Reach { input: newton, output: target, saturated: false };
        }
        let here = Known { input: guess, output: piece.line.at(guess) };
        let short = direction.has_passed(here.output, target);
        let points_ahead = direction.leads_away(newton, guess);
        let collapsed = far.is_some_and(|far| guess == far.input) || guess == near.input && step > 1;
        if short != points_ahead || collapsed {
            // The target is here, but for rounding.
            return Reach { input: guess, output: target, saturated: false };
        }
        if short {
            if guess == limit {
                return Reach { input: limit, output: here.output, saturated: target != here.output };
            }
            (near, near_place, near_end) = (here, *place, piece.end);
        } else {
            if begin == near_end {
                // The pieces meet in between, and rounding leaves the target to neither.
                return Reach { input: near_end, output: target, saturated: false };
            }
            far = Some(here);
            *place = near_place;
        }
        let next = if step % 4 == 0 { f64::NAN } else { newton };
        guess = bracketed(direction, next, near, far, limit);
    }
    Reach { input: near.input, output: near.output, saturated: true }
}

/// Where a hyperbola that leaves `near` with `slope` and goes through `far` has the output `target`: as good as the
/// parabola for slopes that change little, and cheaper. Of what is not known, it makes the best.
#[inline]
fn first_guess(near: Known, slope: f64, far: Option<Known>, target: f64) -> f64 {
    let rise = target - near.output;
    let Some(far) = far else { return if slope.is_nan() { near.input } else { near.input + rise / slope } };
    let (width, height) = (far.input - near.input, far.output - near.output);
    let chord = height / width;
    let slope = if slope.is_nan() { chord } else { slope };
    near.input + rise / (slope + (chord - slope) * (rise / height))
}

/// The guess if it lies between what is known, else the middle; or the limit if nothing beyond the target is known.
#[inline]
fn bracketed(direction: Direction, guess: f64, near: Known, far: Option<Known>, limit: f64) -> f64 {
    let end = far.map_or(limit, |far| far.input);
    let within = direction.leads_away(guess, near.input) && !direction.has_passed(end, guess);
    match far {
        _ if within => guess,
        Some(far) => near.input + 0.5 * (far.input - near.input),
        None => limit,
    }
}
