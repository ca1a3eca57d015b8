//! The two families of one-sided plays that a model is made of, with nested thresholds, and the sums that make their
//! cost independent of their size.

use core::hint::select_unpredictable;

use super::lookup::{Lookup, MAX_NUMBERS};
use super::polyline::{Direction, Line};
use crate::error::Error;
#[cfg(feature = "alloc")]
use crate::error::check_same;
use crate::operator::CoupledPlay;
use crate::real::Real;
#[cfg(feature = "alloc")]
use crate::real::check_same_count;
use crate::store::Store;

/// One-sided plays p_i(k) = max(0, x - a_i, min(x + b_i, p_i(k-1))) with weights w_i, sorted so that a and b never
/// decrease over i.
///
/// Then p_i + a_i never decreases in i and p_i - b_i never increases, from any state reachable from rest. So the
/// operators that slide on a branch are always a prefix of the family and the others are frozen.
#[derive(Clone, Debug)]
pub(crate) struct Family<T: Real, S: Store> {
    /// One per operator, and in the room that is left what stands past the last one.
    entries: S::Of<OperatorEntry<T>>,
    /// What stands past the last operator.
    beyond: OperatorEntry<T>,
    operators: usize,
    /// Where to look for an a_i, b_i and a_i + b_i.
    rises: Lookup<T, S>,
    falls: Lookup<T, S>,
    gaps: Lookup<T, S>,
}

/// The thresholds of operator i and the sums over all operators before it: what a step needs of an operator lies
/// together.
#[derive(Clone, Copy, Debug)]
struct OperatorEntry<T> {
    /// a_i: rising, the operator slides along x - a_i.
    rise: T,
    /// b_i: falling, the operator slides along x + b_i until it rests at zero.
    fall: T,
    /// a_i + b_i: the travel of the input between sliding one way and sliding the other.
    gap: T,
    /// Sum of w.
    weight: f64,
    /// Sum of -w a: added to w x while they slide upwards.
    risen: f64,
    /// Sum of w b: added to w x while they slide downwards.
    fallen: f64,
}

/// One one-sided play with its weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member<T> {
    /// Its place in the model.
    pub(crate) place: usize,
    pub(crate) weight: f64,
    pub(crate) rise: T,
    pub(crate) fall: T,
}

impl<T: Real, S: Store> Family<T, S> {
    /// The family in nested order; of equal members the first stays first.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the threshold `fall` of the first member that breaks the order, if no order nests
    /// both thresholds, [`Error::Whole`] for more members than a table can count.
    pub(crate) fn nested(fall: &'static str, members: &mut [Member<T>]) -> Result<Self, Error> {
        if members.len() > MAX_NUMBERS as usize {
            return Err(Error::whole("weights", None, "at most 4294967294", members.len()));
        }
        sort(members);
        let pairs = members.iter().zip(members.iter().skip(1));
        if let Some((_, next)) = pairs.into_iter().find(|(one, next)| one.fall > next.fall) {
            let expected = "nested thresholds: none below that of an operator of smaller r (for rb) or ra (for rc)";
            return Err(Error::domain(fall, Some(next.place), expected, next.fall.wide()));
        }
        let (infinity, operators) = (T::INFINITY, members.len());
        let mut next =
            OperatorEntry { rise: infinity, fall: infinity, gap: infinity, weight: 0.0, risen: 0.0, fallen: 0.0 };
        let mut entries: S::Of<OperatorEntry<T>> = S::filled(next, operators);
        let mut places = entries.as_mut().iter_mut();
        for (Member { weight, rise, fall, .. }, place) in members.iter().zip(&mut places) {
            *place = OperatorEntry { rise: *rise, fall: *fall, gap: *rise + *fall, ..next };
            next.weight += weight;
            next.risen -= weight * rise.wide();
            next.fallen += weight * fall.wide();
        }
        places.for_each(|place| *place = next);
        let of_operators = &entries.as_ref()[..operators];
        let lookup = |of: fn(&OperatorEntry<T>) -> T| Lookup::new(of_operators.iter().map(of));
        let (rises, falls, gaps) = (lookup(|entry| entry.rise), lookup(|entry| entry.fall), lookup(|entry| entry.gap));
        Ok(Self { beyond: next, operators, rises, falls, gaps, entries })
    }

    pub(crate) fn len(&self) -> usize {
        self.operators
    }

    /// The thresholds a and b of every operator, and the sum of the weights before it; then the sum of all.
    #[cfg(feature = "alloc")]
    pub(crate) fn entries(&self) -> impl Iterator<Item = (T, T, f64)> {
        let entries = self.entries.as_ref().iter().take(self.operators);
        entries.chain([&self.beyond]).map(|entry| (entry.rise, entry.fall, entry.weight))
    }

    /// Reads operator i and the next one.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn fetch(&self, i: usize) -> u64 {
        self.entry(i).weight.to_bits() ^ self.entry(i + 1).fallen.to_bits()
    }

    #[inline]
    fn entry(&self, i: usize) -> &OperatorEntry<T> {
        self.entries.as_ref().get(i).unwrap_or(&self.beyond)
    }

    /// The input at which operator i, at rest at zero or left at max(0, turned + b_i), starts to slide upwards.
    #[inline]
    pub(crate) fn starts_rising(&self, i: usize, turned: T) -> T {
        let entry = self.entry(i);
        Direction::Rising.further(entry.rise, turned + entry.gap)
    }

    /// Bounds, to rounding, of how many have started, the input having come up from `turned` to `x`.
    #[inline]
    pub(crate) fn started_rising(&self, turned: T, x: T) -> (usize, usize) {
        let ((one, most), (other, at_most)) = (self.rises.at_most(x), self.gaps.at_most(x - turned));
        (one.min(other), most.min(at_most))
    }

    /// The input at which operator i, left at turned - a_i, starts to slide downwards.
    #[inline]
    pub(crate) fn starts_falling(&self, i: usize, turned: T) -> T {
        turned - self.entry(i).gap
    }

    /// Bounds, to rounding, of how many have started, the input having come down from `turned` to `x`.
    #[inline]
    pub(crate) fn started_falling(&self, turned: T, x: T) -> (usize, usize) {
        self.gaps.at_most(turned - x)
    }

    /// The input at which operator i, sliding downwards, comes to rest at zero.
    #[inline]
    pub(crate) fn rests(&self, i: usize) -> T {
        -self.entry(i).fall
    }

    /// Bounds of how many rest at zero, the input having come down to `x`.
    #[inline]
    pub(crate) fn resting(&self, x: T) -> (usize, usize) {
        self.falls.at_most(-x)
    }

    /// Sum of |w_i| (input + a_i + b_i).
    #[cfg(feature = "alloc")]
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        let weight = |i: usize| self.entry(i + 1).weight - self.entry(i).weight;
        let entries = self.entries.as_ref().iter().take(self.operators).enumerate();
        entries.map(|(i, entry)| weight(i).abs() * (input + entry.gap.wide())).sum()
    }

    /// Sum over `from..to` of what operators that slide in `direction` give: w_i (x - a_i) or w_i (x + b_i), as a line
    /// in x.
    #[inline]
    pub(crate) fn sliding(&self, direction: Direction, from: usize, to: usize) -> Line {
        let (from, to) = (self.entry(from), self.entry(to));
        let rising = direction == Direction::Rising;
        let offset = select_unpredictable(rising, to.risen - from.risen, to.fallen - from.fallen);
        Line { slope: to.weight - from.weight, offset }
    }
}

/// Sorts by a, then by b; what is equal keeps its order.
pub(super) fn sort<T: Real>(members: &mut [Member<T>]) {
    members.sort_unstable_by(|one, other| {
        let (rise, fall) =
            (one.rise.wide().total_cmp(&other.rise.wide()), one.fall.wide().total_cmp(&other.fall.wide()));
        rise.then(fall).then(one.place.cmp(&other.place))
    });
}

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

/// What both sides of an identity have is a straight line that always slides, so the slope stays above it; the rest, if
/// it is split, is a one-sided play of no width.
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
