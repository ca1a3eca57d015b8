//! Reversals of the input and the outputs at which they have left the plays of a family.

use alloc::vec::Vec;

use super::super::direction::Direction;
use super::super::memory_state::{FamilyState, TurningPointState};
use super::super::turning_points::TurningPoint;
use super::play_at::{PlayAt, rounding};

/// Where a branch ended, or is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reversal {
    ended: Direction,
    /// In the coordinate of the family.
    input: f64,
    /// How many plays slid on that branch, the narrowest ones.
    moved: usize,
}

impl Reversal {
    /// What a saved family tells of, newest first: the present branch, where its input is at `input`, and its turning points.
    pub(super) fn remembered(state: &FamilyState, direction: Direction, input: f64) -> Vec<Self> {
        let present = Self { ended: direction, input, moved: state.moved };
        let before = state.turning_points.iter().rev();
        let turned = before.map(|point| Self { ended: point.ended, input: point.input, moved: point.moved });
        core::iter::once(present).chain(turned).collect()
    }

    /// Where it leaves a play that slides.
    fn output(&self, play: &PlayAt) -> f64 {
        match self.ended {
            Direction::Rising => self.input - play.rise,
            Direction::Falling => (self.input + play.fall).max(0.0),
        }
    }

    /// Whether it leaves a play where that is, but for rounding.
    fn leaves(&self, play: &PlayAt) -> bool {
        (self.output(play) - play.output).abs() <= rounding(play.scale())
    }

    /// Whether it leaves the widest play that it moved where it would from another input.
    fn is_at(&self, input: f64, family: &[PlayAt]) -> bool {
        Self { input, ..*self }.leaves(&family[self.moved - 1])
    }

    /// How many of the plays that slid rest at zero.
    fn at_zero(&self, family: &[PlayAt]) -> usize {
        match self.ended {
            Direction::Rising => 0,
            Direction::Falling => family[..self.moved].partition_point(|play| self.input + play.fall <= 0.0),
        }
    }
}

/// Puts the plays of a family at rest where these reversals, newest first, have left them.
pub(super) fn left_by(family: &mut [PlayAt], reversals: &[Reversal]) {
    let mut moved = 0;
    for reversal in reversals {
        for play in &mut family[moved..reversal.moved] {
            play.output = reversal.output(play);
        }
        moved = reversal.moved;
    }
}

/// Turning points that lead to the plays of both families, the input being at `input`. What the model puts out at them is left open.
pub(super) fn memory_of(above: &[PlayAt], below: &[PlayAt], input: f64) -> TurningPointState {
    let (mut positive, mut negative) = (reversals(above, input), reversals(below, -input));
    let rises = has_moved(&positive, above, Direction::Rising, input)
        || has_moved(&negative, below, Direction::Falling, -input);
    let direction = if rises { Direction::Rising } else { Direction::Falling };
    let moving = (
        take_moving(&mut positive, above, direction, input),
        take_moving(&mut negative, below, direction.reversed(), -input),
    );
    let (numbers, last) = numbers(&oldest_first(&positive, above, 1.0), &oldest_first(&negative, below, -1.0));
    TurningPointState {
        direction,
        reversals: last,
        positive: family_state(above, moving.0, &positive, &numbers.0),
        negative: family_state(below, moving.1, &negative, &numbers.1),
    }
}

/// As few reversals as can be that leave a family where it is, newest first. The widest plays that rest at zero need none.
fn reversals(family: &[PlayAt], input: f64) -> Vec<Reversal> {
    let mut reversals = Vec::new();
    let mut moved = 0;
    while let Some(off_zero) = family[moved..].iter().position(|play| play.output > 0.0) {
        let falling = longest(family, moved + off_zero, Direction::Falling, input);
        let rising = longest(family, moved + off_zero, Direction::Rising, input);
        // What rests at zero where a wider play does not was left there by a fall.
        let is_rising = off_zero == 0
            && (rising.moved > falling.moved || rising.moved == falling.moved && !falling.is_at(input, family));
        let reversal = if is_rising { rising } else { falling };
        moved = reversal.moved;
        reversals.push(reversal);
    }
    reversals
}

/// The reversal that ended in this direction and left play number `first`, and all the wider ones that it has left. What rounding
/// puts behind the present input was there.
fn longest(family: &[PlayAt], first: usize, ended: Direction, input: f64) -> Reversal {
    let play = &family[first];
    let turned = match ended {
        Direction::Rising => play.slides_up_at().max(input),
        Direction::Falling => play.slides_down_at().min(input),
    };
    let mut reversal = Reversal { ended, input: turned, moved: first + 1 };
    reversal.moved += family[reversal.moved..].iter().take_while(|play| reversal.leaves(play)).count();
    reversal
}

/// Whether a branch in this direction that has come to `input` has left the plays of the newest reversal: then they slide, and that
/// is no reversal. Plays of no width slide on any branch.
fn slides(reversals: &[Reversal], family: &[PlayAt], direction: Direction, input: f64) -> bool {
    reversals.first().is_some_and(|newest| {
        let branch = Reversal { ended: direction, input, moved: newest.moved };
        family[..branch.moved].iter().all(|play| branch.leaves(play))
    })
}

/// Whether that tells the direction of the branch.
fn has_moved(reversals: &[Reversal], family: &[PlayAt], direction: Direction, input: f64) -> bool {
    slides(reversals, family, direction, input) && !slides(reversals, family, direction.reversed(), input)
}

/// Takes off what is no reversal as its plays slide.
fn take_moving(reversals: &mut Vec<Reversal>, family: &[PlayAt], direction: Direction, input: f64) -> Reversal {
    let slide = slides(reversals, family, direction, input);
    Reversal { ended: direction, input, moved: if slide { reversals.remove(0).moved } else { 0 } }
}

/// A reversal as the model sees it: its input, the direction that it ended, and the width of the widest play that it left.
type Seen = (f64, Direction, f64);

fn oldest_first(reversals: &[Reversal], family: &[PlayAt], sign: f64) -> Vec<Seen> {
    let seen = |reversal: &Reversal| {
        let Reversal { ended, input, moved } = *reversal;
        (sign * input, if sign > 0.0 { ended } else { ended.reversed() }, family[moved - 1].width())
    };
    reversals.iter().rev().map(seen).collect()
}

/// The numbers of the reversals of both families, oldest first, and the last one: what left wider plays is older, as the intervals in
/// which operators hold lie in one another. A reversal may have left plays of both families.
fn numbers(positive: &[Seen], negative: &[Seen]) -> ((Vec<u64>, Vec<u64>), u64) {
    let (mut above, mut below) = (positive.iter().peekable(), negative.iter().peekable());
    let (mut numbers, mut last) = ((Vec::new(), Vec::new()), 0);
    while above.peek().is_some() || below.peek().is_some() {
        last += 1;
        let (one, other) = (above.peek(), below.peek());
        let (is_one, is_other) = match (one, other) {
            (Some(one), Some(other)) if is_same(one, other) => (true, true),
            (Some((.., one)), Some((.., other))) => (one >= other, one < other),
            (one, other) => (one.is_some(), other.is_some()),
        };
        if is_one {
            above.next();
            numbers.0.push(last);
        }
        if is_other {
            below.next();
            numbers.1.push(last);
        }
    }
    (numbers, last)
}

/// Whether the two families tell of the same reversal.
fn is_same((input, ended, width): &Seen, (other, other_ended, other_width): &Seen) -> bool {
    ended == other_ended && (input - other).abs() <= rounding(input.abs() + width + other_width)
}

/// What the engine keeps of a family: the reversals newest first, their numbers oldest first.
fn family_state(family: &[PlayAt], moving: Reversal, reversals: &[Reversal], numbers: &[u64]) -> FamilyState {
    let point = |(reversal, number): (&Reversal, &u64)| TurningPoint {
        input: reversal.input,
        output: 0.0,
        ended: reversal.ended,
        moved: reversal.moved,
        at_zero: reversal.at_zero(family),
        reversal: *number,
    };
    FamilyState {
        moved: moving.moved,
        at_zero: moving.at_zero(family),
        turning_points: reversals.iter().rev().zip(numbers).map(point).collect(),
    }
}
