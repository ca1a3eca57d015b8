//! A state of one method for a stream of the other: both tell of the same operators.
//!
//! A model is two families of one-sided plays p with thresholds a and b (see [`family`](super::family)), and an
//! operator output is z = p of the family above zero, or -p of the one below. A turning point says what it froze:
//! p = x - a where a rising branch ended at the input x, p = max(0, x + b) where a falling one did. So turning points
//! give all outputs ([`operators_of`]). The other way ([`turning_points_of`]) outputs that lie on one of these two lines side by
//! side, from the narrowest play to the widest, were left at one reversal, at the x of that line.
//!
//! An example: plays with a = b = 1, 2 and 3, and a drive of 0, 6, -2, 3. At 6 they are at 5, 4, 3, at -2 at 0, 0, 1,
//! and at 3 at 2, 1, 1. The first two lie on x - a with x = 3, where the drive is: they slide. The third may have been
//! left by a rise to 4 or by a fall to -2. Nothing that is yet to come depends on which it was.

use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use super::bank::{Bank, BankState, Members};
use super::branch::TurningPoint;
use super::family::{Member, WeightsAndPlay, play_above_zero, play_below_zero, sort};
use super::polyline::Direction;
use super::turning_point_state::{FamilyState, NestedModel, SharedEngine, TurningPointState};
use crate::error::Error;
use crate::operator::Operator;

/// The operator outputs that turning points tell of, saved at `input` and `output`.
///
/// # Errors
/// [`Error::State`] if the thresholds of the members are not nested, or if the model cannot be in the state.
pub(super) fn operators_of(
    members: &Arc<Members>,
    state: &TurningPointState,
    input: f64,
    output: f64,
) -> Result<BankState, Error> {
    let not_nested =
        Error::State { expected: "operator outputs: thresholds that are not nested have no turning points" };
    let model = NestedModel::of(members).map_err(|_| not_nested)?;
    SharedEngine::new(model.into()).restore(state, input, output)?;

    let TurningPointState { direction, positive, negative, .. } = state;
    let mut above = plays_above(members, &vec![0.0; members.len()]);
    let mut below = plays_below(members, &vec![0.0; members.len()]);
    left_by(&mut above, &Reversal::remembered(positive, *direction, input));
    left_by(&mut below, &Reversal::remembered(negative, direction.reversed(), -input));

    let mut outputs = vec![0.0; members.len()];
    for play in above.iter().filter(|play| play.output > 0.0) {
        outputs[play.place] = play.output;
    }
    for play in below.iter().filter(|play| play.output > 0.0) {
        let above_zero = outputs[play.place];
        if above_zero.min(play.output) > rounding(play.scale()) {
            return Err(Error::State { expected: "turning points that leave each operator on one side of zero" });
        }
        outputs[play.place] = above_zero - play.output;
    }
    // An identity has no memory, and what both its sides have is in neither family.
    for (output, (.., operator)) in outputs.iter_mut().zip(members.of_model()) {
        if operator.is_identity() {
            *output = input;
        }
    }
    let outputs = led_to(members, &outputs, input)?;
    Ok(BankState { outputs: outputs.into(), line: None, small_moves: 0 })
}

/// Turning points that lead to the outputs of a bank, saved at `input` and `output`.
///
/// # Errors
/// [`Error::State`] if the bank cannot be in the state, or if no drive leads to its outputs from rest: such
/// [initial outputs](crate::Forward::with_initial) keep to the bank.
pub(super) fn turning_points_of(
    model: &Arc<NestedModel>,
    state: &BankState,
    input: f64,
    output: f64,
) -> Result<TurningPointState, Error> {
    let members = &model.members;
    Bank::at_rest(members.clone()).restore(state, input, output)?;
    led_to(members, &state.outputs, input)?;
    let mirrored: Vec<f64> = state.outputs.iter().map(|z| -z).collect();
    let (above, below) = (plays_above(members, &state.outputs), plays_below(members, &mirrored));
    check_nested(&above)?;
    check_nested(&below)?;
    check_apart(&above, &below)?;
    SharedEngine::with_outputs(model, &memory_of(&above, &below, input), input)
}

/// The outputs as the input leaves them, which may change them by rounding alone.
fn led_to(members: &Members, outputs: &[f64], input: f64) -> Result<Vec<f64>, Error> {
    let led = |((.., operator), z): (WeightsAndPlay, &f64)| -> Result<f64, Error> {
        let next = operator.next(*z, input);
        if (next - z).abs() <= rounding(z.abs() + input.abs() + operator.r() + operator.ra()) {
            Ok(next)
        } else {
            Err(Error::State { expected: "operator outputs that the last input has led to" })
        }
    };
    members.of_model().zip(outputs).map(led).collect()
}

/// A one-sided play at an output.
#[derive(Clone, Copy, Debug)]
struct PlayAt {
    /// Its place in the model.
    pub(super) place: usize,
    pub(super) rise: f64,
    pub(super) fall: f64,
    /// Never below zero.
    pub(super) output: f64,
}

impl PlayAt {
    /// The input from which on it slides upwards.
    fn slides_up_at(&self) -> f64 {
        self.output + self.rise
    }

    /// The input from which on it slides downwards, or rests at zero.
    fn slides_down_at(&self) -> f64 {
        self.output - self.fall
    }

    /// How far the input moves from where it slides one way to where it slides the other.
    pub(super) fn width(&self) -> f64 {
        self.rise + self.fall
    }

    /// What its inputs and outputs were rounded to.
    pub(super) fn scale(&self) -> f64 {
        self.output + self.width()
    }
}

/// How far sums of numbers of that magnitude may be off by rounding: hundreds of units in the last place, and far less
/// than a state of the other method may change an output.
pub(super) fn rounding(scale: f64) -> f64 {
    1e-14 * scale + f64::MIN_POSITIVE
}

/// The plays of the family above zero in its order, at the operator outputs of a model.
fn plays_above(members: &Members, outputs: &[f64]) -> Vec<PlayAt> {
    plays(members, outputs, play_above_zero)
}

/// The same of the family below zero, at the operator outputs times -1.
fn plays_below(members: &Members, mirrored: &[f64]) -> Vec<PlayAt> {
    plays(members, mirrored, play_below_zero)
}

fn plays(members: &Members, outputs: &[f64], play: fn(usize, &WeightsAndPlay) -> Option<Member<f64>>) -> Vec<PlayAt> {
    let mut family: Vec<_> =
        members.of_model().enumerate().filter_map(|(place, member)| play(place, &member)).collect();
    sort(&mut family);
    let at = |Member { place, rise, fall, .. }| PlayAt { place, rise, fall, output: outputs[place].max(0.0) };
    family.into_iter().map(at).collect()
}

const NO_DRIVE: Error =
    Error::State { expected: "operator outputs that some drive leads to from rest: turning points can tell no others" };

/// Any drive moves the plays of a family in their order, the narrowest first: up or down, a wider one slides no sooner.
fn check_nested(family: &[PlayAt]) -> Result<(), Error> {
    for (narrow, wide) in family.iter().zip(family.iter().skip(1)) {
        let slack = rounding(narrow.scale() + wide.scale());
        if narrow.slides_up_at() > wide.slides_up_at() + slack
            || narrow.slides_down_at() < wide.slides_down_at() - slack
        {
            return Err(NO_DRIVE);
        }
    }
    Ok(())
}

/// Between the inputs from which on it slides an operator holds its output. Of an operator above zero and one below it,
/// one of these intervals lies in the other: were they staggered, whatever set one operator would have moved the other.
///
/// A turning point relies on it: back there the model is back at its output, whatever the drive did between.
fn check_apart(above: &[PlayAt], below: &[PlayAt]) -> Result<(), Error> {
    let above: Vec<&PlayAt> = above.iter().filter(|play| play.output > 0.0).collect();
    for play in below.iter().filter(|play| play.output > 0.0) {
        let slack = |other: &PlayAt| rounding(play.scale() + other.scale());
        // Wider plays have wider intervals, so the first one that ends above this one tells of all.
        let sooner = |other: &&PlayAt| other.slides_up_at() + play.slides_down_at() <= slack(other);
        let Some(other) = above.get(above.partition_point(sooner)) else { continue };
        if play.slides_up_at() + other.slides_down_at() > slack(other) {
            return Err(NO_DRIVE);
        }
    }
    Ok(())
}

/// Where a branch ended, or is.
#[derive(Clone, Copy, Debug)]
struct Reversal {
    ended: Direction,
    /// In the coordinate of the family.
    input: f64,
    /// How many plays slid on that branch, the narrowest ones.
    moved: usize,
}

impl Reversal {
    /// What a saved family tells of, newest first: the present branch, where its input is at `input`, and its turning
    /// points.
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
fn left_by(family: &mut [PlayAt], reversals: &[Reversal]) {
    let mut moved = 0;
    for reversal in reversals {
        for play in &mut family[moved..reversal.moved] {
            play.output = reversal.output(play);
        }
        moved = reversal.moved;
    }
}

/// Turning points that lead to the plays of both families, the input being at `input`. What the model puts out at them
/// is left open.
fn memory_of(above: &[PlayAt], below: &[PlayAt], input: f64) -> TurningPointState {
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

/// As few reversals as can be that leave a family where it is, newest first. The widest plays that rest at zero need
/// none.
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

/// The reversal that ended in this direction and left play number `first`, and all the wider ones that it has left.
/// What rounding puts behind the present input was there.
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

/// Whether a branch in this direction that has come to `input` has left the plays of the newest reversal: then they
/// slide, and that is no reversal. Plays of no width slide on any branch.
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

/// A reversal as the model sees it: its input, the direction that it ended, and the width of the widest play that it
/// left.
type Seen = (f64, Direction, f64);

fn oldest_first(reversals: &[Reversal], family: &[PlayAt], sign: f64) -> Vec<Seen> {
    let seen = |reversal: &Reversal| {
        let Reversal { ended, input, moved } = *reversal;
        (sign * input, if sign > 0.0 { ended } else { ended.reversed() }, family[moved - 1].width())
    };
    reversals.iter().rev().map(seen).collect()
}

/// The numbers of the reversals of both families, oldest first, and the last one: what left wider plays is older, as
/// the intervals in which operators hold lie in one another. A reversal may have left plays of both families.
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
