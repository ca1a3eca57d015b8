//! One-sided plays with their outputs, and what such outputs must satisfy if some drive has led to them.

use alloc::vec::Vec;

use super::super::bank::Members;
use super::super::families::{WeightsAndPlay, play_above_zero, play_below_zero};
use super::super::family::{Member, sort};
use crate::error::Error;

/// A one-sided play at an output.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlayAt {
    /// Its place in the model.
    pub(super) place: usize,
    pub(super) rise: f64,
    pub(super) fall: f64,
    /// Never below zero.
    pub(super) output: f64,
}

impl PlayAt {
    /// The input from which on it slides upwards.
    pub(super) fn slides_up_at(&self) -> f64 {
        self.output + self.rise
    }

    /// The input from which on it slides downwards, or rests at zero.
    pub(super) fn slides_down_at(&self) -> f64 {
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

/// How far sums of numbers of that magnitude may be off by rounding: hundreds of units in the last place, and far less than a
/// state of the other method may change an output.
pub(super) fn rounding(scale: f64) -> f64 {
    1e-14 * scale + f64::MIN_POSITIVE
}

/// The plays of the family above zero in its order, at the operator outputs of a model.
pub(super) fn plays_above(members: &Members, outputs: &[f64]) -> Vec<PlayAt> {
    plays(members, outputs, play_above_zero)
}

/// The same of the family below zero, at the operator outputs times -1.
pub(super) fn plays_below(members: &Members, mirrored: &[f64]) -> Vec<PlayAt> {
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
pub(super) fn check_nested(family: &[PlayAt]) -> Result<(), Error> {
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

/// Between the inputs from which on it slides an operator holds its output. Of an operator above zero and one below it, one of
/// these intervals lies in the other: were they staggered, whatever set one operator would have moved the other.
///
/// A turning point relies on it: back there the model is back at its output, whatever the drive did between.
pub(super) fn check_apart(above: &[PlayAt], below: &[PlayAt]) -> Result<(), Error> {
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
