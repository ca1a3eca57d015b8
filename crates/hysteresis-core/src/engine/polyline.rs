//! What a model is over its input: straight lines from breakpoint to breakpoint. And the inverse of such a line that
//! always rises.

use crate::model::Offsets;
use crate::real::Real;

/// Which way the input moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Direction {
    /// Towards larger inputs.
    Rising,
    /// Towards smaller inputs.
    Falling,
}

impl Direction {
    /// Of a move of the input; falling if it was nowhere before.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn of_move(from: f64, to: f64) -> Self {
        if to >= from { Self::Rising } else { Self::Falling }
    }

    /// +1 or -1: turns a falling branch into a rising one of the mirrored input.
    #[inline(always)]
    pub(crate) fn sign<T: Real>(self) -> T {
        match self {
            Self::Rising => T::ONE,
            Self::Falling => -T::ONE,
        }
    }

    /// The one of two limits, low and high, that lies ahead.
    #[inline(always)]
    pub(crate) fn limit<T: Real>(self, (low, high): (T, T)) -> T {
        match self {
            Self::Rising => high,
            Self::Falling => low,
        }
    }

    /// Whether a move goes the other way.
    #[inline(always)]
    pub(crate) fn leads_away<T: Real>(self, from: T, to: T) -> bool {
        match self {
            Self::Rising => to < from,
            Self::Falling => to > from,
        }
    }

    /// Whether the input, come to `x`, has reached `mark`.
    #[inline(always)]
    pub(crate) fn has_passed<T: Real>(self, mark: T, x: T) -> bool {
        match self {
            Self::Rising => mark <= x,
            Self::Falling => mark >= x,
        }
    }

    /// Of two inputs, the one that comes first.
    #[inline(always)]
    pub(crate) fn nearer<T: Real>(self, one: T, other: T) -> T {
        match self {
            Self::Rising => {
                if one < other {
                    one
                } else {
                    other
                }
            }
            Self::Falling => {
                if one > other {
                    one
                } else {
                    other
                }
            }
        }
    }

    /// Of two inputs, the one that comes last.
    #[inline(always)]
    pub(crate) fn further<T: Real>(self, one: T, other: T) -> T {
        self.reversed().nearer(one, other)
    }

    #[inline(always)]
    pub(crate) fn reversed(self) -> Self {
        match self {
            Self::Rising => Self::Falling,
            Self::Falling => Self::Rising,
        }
    }
}

/// A straight line: output = slope * input + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line<T = f64> {
    pub(crate) slope: T,
    pub(crate) offset: T,
}

impl<T: Real> Line<T> {
    #[inline]
    pub(crate) fn at(self, input: T) -> T {
        self.slope * input + self.offset
    }

    /// The input as a line in the output.
    #[inline]
    pub(crate) fn inverted(self) -> Self {
        Self { slope: self.slope.recip(), offset: -self.offset / self.slope }
    }
}

/// A straight line and how far, in the direction of travel, it holds: from `begin` up to but not including `end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<T = f64> {
    pub(crate) direction: Direction,
    pub(crate) line: Line<T>,
    pub(crate) begin: T,
    pub(crate) end: T,
}

impl<T: Real> Piece<T> {
    /// A piece of no length: every new sample is evaluated anew.
    pub(crate) fn point(direction: Direction, input: T, output: T) -> Self {
        Self { direction, line: Line { slope: T::ZERO, offset: output }, begin: input, end: input }
    }

    /// The same piece over the output, up to a limit of the input.
    #[inline]
    pub(crate) fn inverse(self, limits: (T, T)) -> Self {
        let Self { direction, line, begin, end } = self;
        let end = direction.nearer(end, direction.limit(limits));
        Self { direction, line: line.inverted(), begin: line.at(begin), end: line.at(end) }
    }
}

/// A point of the polyline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point<T = f64> {
    pub(crate) input: T,
    pub(crate) output: T,
}

impl<T: Real> Point<T> {
    /// The same point over the mirrored input.
    #[inline]
    pub(crate) fn mirrored(self) -> Self {
        Self { input: -self.input, ..self }
    }
}

/// The place of the model's zero, in numbers of another kind.
impl<T: Real> From<Offsets> for Point<T> {
    fn from(offsets: Offsets) -> Self {
        Self { input: T::narrow(offsets.input), output: T::narrow(offsets.output) }
    }
}

/// Where a move towards a given output came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach<T = f64> {
    /// The input there.
    pub(crate) input: T,
    /// The output there: what was asked for, or what the limit allows.
    pub(crate) output: T,
    pub(crate) saturated: bool,
}

/// What moves along a polyline.
pub(crate) trait Path<T: Real> {
    /// What it takes to come back to a position.
    type Checkpoint: Copy;
    fn checkpoint(&self) -> Self::Checkpoint;
    fn go_back(&mut self, to: Self::Checkpoint);
    /// Moves to an input ahead; the piece there.
    fn look(&mut self, direction: Direction, input: T) -> Piece<T>;
}

/// Moves `path` from `near`, in `direction`, until the output is `target`, or to `limit` if it is not there yet.
/// `far` lies beyond the target, if it is known.
///
/// The first look is at `guess`, every other where the last piece, prolonged, has the target: Newton's method. It ends
/// as soon as that lies within the piece, so the answer is exact on that line. Every fourth step makes sure that there
/// are few: it halves what is left, or, as long as nothing beyond the target is known, goes much further.
#[inline(always)]
pub(crate) fn solve<T: Real>(
    path: &mut impl Path<T>,
    direction: Direction,
    mut near: Point<T>,
    mut far: Option<Point<T>>,
    guess: T,
    target: T,
    limit: T,
) -> Reach<T> {
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
        // It holds where it was looked at, also if rounding lets it begin beyond that.
        let begin = direction.nearer(direction.further(piece.begin, near.input), guess);
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
            Some(_) => T::NAN,
            None => newton + T::narrow(FURTHER) * (newton - guess),
        };
        guess = bracketed(direction, next, near, far, limit);
    }
}

/// How many times as far as Newton's method a step goes that is to find what lies beyond the target.
const FURTHER: f64 = 16.0;

/// Where the target may be, for a first look: where a hyperbola that leaves `near` with `slope` and goes through `far`
/// has the output `target`: as good as a parabola for slopes that change little, and a single division. Without `far`,
/// a straight line.
#[inline(always)]
pub(crate) fn first_guess<T: Real>(near: Point<T>, slope: T, far: Option<Point<T>>, target: T) -> T {
    let rise = target - near.output;
    let Some(far) = far else { return near.input + rise / slope };
    let (width, height) = (far.input - near.input, far.output - near.output);
    near.input + rise * height * width / (slope * width * (height - rise) + height * rise)
}

/// The guess if it lies between what is known, else the middle; or the limit if nothing beyond the target is known.
#[inline(always)]
fn bracketed<T: Real>(direction: Direction, guess: T, near: Point<T>, far: Option<Point<T>>, limit: T) -> T {
    let end = far.map_or(limit, |far| far.input);
    let within = direction.leads_away(guess, near.input) && !direction.has_passed(end, guess);
    match far {
        _ if within => guess,
        Some(far) => near.input + T::HALF * (far.input - near.input),
        None => limit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_guess_is_exact_at_both_ends_and_leaves_with_the_slope() {
        let (near, far, slope) = (Point { input: 1.0, output: 2.0 }, Point { input: 5.0, output: 8.0 }, 3.0);
        let guess = |target: f64| first_guess(near, slope, Some(far), target);
        assert!((guess(far.output) - far.input).abs() < 1e-12 && (guess(near.output) - near.input).abs() < 1e-12);
        let rise = 1e-6;
        assert!(((guess(near.output + rise) - near.input) / rise - 1.0 / slope).abs() < 1e-5);
        assert!((first_guess(near, slope, None, 8.0_f64) - 3.0).abs() < 1e-12);
    }
}
