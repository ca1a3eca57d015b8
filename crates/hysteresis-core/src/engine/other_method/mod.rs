//! A state of one method for a stream of the other: both tell of the same operators.
//!
//! A model is two families of one-sided plays p with thresholds a and b (see [`families`](super::families)), and an
//! operator output is z = p of the family above zero, or -p of the one below. A turning point says what it froze:
//! p = x - a where a rising branch ended at the input x, p = max(0, x + b) where a falling one did. So turning points
//! give all outputs ([`operators_of`]). The other way ([`turning_points_of`]) outputs that lie on one of these two lines side by
//! side, from the narrowest play to the widest, were left at one reversal, at the x of that line.
//!
//! An example: plays with a = b = 1, 2 and 3, and a drive of 0, 6, -2, 3. At 6 they are at 5, 4, 3, at -2 at 0, 0, 1, and
//! at 3 at 2, 1, 1. The first two lie on x - a with x = 3, where the drive is: they slide. The third may have been left
//! by a rise to 4 or by a fall to -2. Nothing that is yet to come depends on which it was.

mod play_at;
mod reversals;

use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use super::bank::{Bank, Members};
use super::engine_changes::{NestedModel, SharedEngine};
use super::families::WeightsAndPlay;
use super::memory_state::{BankState, TurningPointState};
use crate::error::Error;
use crate::operator::Operator;
use play_at::{check_apart, check_nested, plays_above, plays_below, rounding};
use reversals::{Reversal, left_by, memory_of};

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
