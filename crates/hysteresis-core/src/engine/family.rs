//! Parameters of a family of one-sided plays with nested thresholds, and the sums that make its cost independent
//! of its size.

use core::hint::select_unpredictable;

use super::direction::Direction;
use super::line::Line;
use super::lookup::{Lookup, MAX_NUMBERS};
use crate::error::Error;
use crate::real::Real;
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
    /// [`Error::Domain`] that names the threshold `fall` of the first member that breaks the order, if no order nests both
    /// thresholds, [`Error::Whole`] for more members than a table can count.
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
