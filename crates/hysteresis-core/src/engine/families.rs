//! The two families of one-sided plays that a model is made of.

#[cfg(feature = "alloc")]
use super::checks::{check_same, check_same_count};
use super::family::{Family, Member};
use super::turning_points::Stack;
use crate::error::Error;
use crate::operator::CoupledPlay;
use crate::real::Real;
use crate::store::Store;

/// A model as w_0 x plus two families of one-sided plays, the second one mirrored.
///
/// A coupled play is p(x; a = r, b = rb) - p(-x; a = ra, b = rc), which needs r >= rc and ra >= rb.
#[derive(Clone, Debug)]
pub struct Families<T: Real, S: Store> {
    pub(super) identity_weight: f64,
    pub(crate) positive: Family<T, S>,
    pub(crate) negative: Family<T, S>,
}

/// What evaluates a model: its own families, or a pointer to them.
pub trait Evaluates: Clone + core::fmt::Debug {
    /// The numbers of inputs and outputs.
    type Number: Real;
    /// Where tables and turning points lie.
    type Store: Store;

    /// The families.
    #[doc(hidden)]
    fn families(&self) -> &Families<Self::Number, Self::Store>;
}

impl<T: Real, S: Store> Families<T, S> {
    /// The families of a model. `members` are the
    /// weights above and below zero and the operators, one by one, at most as many as there is room for.
    ///
    /// # Errors
    /// As [`Family::nested`].
    pub(crate) fn of(members: impl Iterator<Item = WeightsAndPlay> + Clone) -> Result<Self, Error> {
        let count = members.clone().count();
        let none = Member { place: 0, weight: 0.0, rise: T::ZERO, fall: T::ZERO };
        let mut identity_weight = 0.0;
        let (mut positive, mut negative): (S::Of<_>, S::Of<_>) = (S::filled(none, count), S::filled(none, count));
        let (mut above_zero, mut below_zero) = (0, 0);
        for (place, member) in members.enumerate() {
            identity_weight += straight(&member);
            if let Some(play) = play_above_zero(place, &member) {
                positive.as_mut()[above_zero] = play;
                above_zero += 1;
            }
            if let Some(play) = play_below_zero(place, &member) {
                negative.as_mut()[below_zero] = play;
                below_zero += 1;
            }
        }
        Ok(Self {
            identity_weight,
            positive: Family::nested("rb", &mut positive.as_mut()[..above_zero])?,
            negative: Family::nested("rc", &mut negative.as_mut()[..below_zero])?,
        })
    }
}

#[cfg(feature = "alloc")]
impl<S: Store> Families<f64, S> {
    /// Whether the weights differ too.
    ///
    /// # Errors
    /// [`Error::OtherOperators`] if the thresholds differ.
    pub(crate) fn check_same_operators(&self, other: &Self) -> Result<bool, Error> {
        let positive = compare(["r", "rb"], &self.positive, &other.positive)?;
        let negative = compare(["ra", "rc"], &self.negative, &other.negative)?;
        Ok(self.identity_weight != other.identity_weight || positive || negative)
    }

    /// An upper bound of what is summed for an output at inputs of that magnitude: what rounding is relative to.
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        self.identity_weight.abs() * input + self.positive.output_scale(input) + self.negative.output_scale(input)
    }
}

/// The weights above and below zero of an operator, and the operator.
pub(super) type WeightsAndPlay = (f64, f64, CoupledPlay);

/// What both sides of an identity have is a straight line that always slides, so the slope stays above it; the rest, if it
/// is split, is a one-sided play of no width.
fn straight((above, below, z): &WeightsAndPlay) -> f64 {
    if z.is_identity() { above.min(*below) } else { 0.0 }
}

/// What a member of a model is in the family above zero, if it is anything there.
pub(super) fn play_above_zero<T: Real>(place: usize, member: &WeightsAndPlay) -> Option<Member<T>> {
    let (straight, (above, _, z)) = (straight(member), member);
    let (rise, fall) = (T::narrow(z.r()), T::narrow(z.rb()));
    (!z.is_identity() || *above > straight).then_some(Member { place, weight: above - straight, rise, fall })
}

/// The same in the family below zero, in the mirrored coordinate.
pub(super) fn play_below_zero<T: Real>(place: usize, member: &WeightsAndPlay) -> Option<Member<T>> {
    let (straight, (_, below, z)) = (straight(member), member);
    let (rise, fall) = (T::narrow(z.ra()), T::narrow(z.rc()));
    (!z.is_identity() || *below > straight).then_some(Member { place, weight: below - straight, rise, fall })
}

/// Whether the weights of two families differ; their thresholds may not.
#[cfg(feature = "alloc")]
fn compare<S: Store>(
    [rise, fall]: [&'static str; 2],
    running: &Family<f64, S>,
    new: &Family<f64, S>,
) -> Result<bool, Error> {
    check_same_count(running.len(), new.len())?;
    let mut differ = false;
    for ((a, b, w), (other_a, other_b, other_w)) in running.entries().zip(new.entries()) {
        check_same(rise, a, other_a)?;
        check_same(fall, b, other_b)?;
        differ |= w != other_w;
    }
    Ok(differ)
}

/// Room for the turning points of both families.
#[derive(Clone, Debug)]
pub(crate) struct Stacks<T: Real, S: Store> {
    pub(crate) positive: Stack<T, S>,
    pub(crate) negative: Stack<T, S>,
}
