//! Parameters of a family of one-sided plays with nested thresholds, and the sums that make its cost independent
//! of its size.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::marks::Marks;
use super::turning_points::Direction;

/// One-sided plays p_i(k) = max(0, x - a_i, min(x + b_i, p_i(k-1))) with weights w_i, sorted so that a and b never
/// decrease over i.
///
/// Then p_i + a_i never decreases in i and p_i - b_i never increases, from any state reachable from rest. So the
/// operators that slide on a branch are always a prefix of the family and the others are frozen.
#[derive(Clone, Debug)]
pub(crate) struct Family {
    /// a_i: rising, the operator slides along x - a_i.
    rises: Marks,
    /// b_i: falling, the operator slides along x + b_i until it rests at zero.
    falls: Marks,
    /// a_i + b_i: the travel of the input between sliding one way and sliding the other.
    gaps: Marks,
    /// One per operator, over all operators before it.
    sums: Box<[Sums]>,
    /// Over all operators.
    total: Sums,
}

/// Sums over the first operators of a family.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Of w.
    weight: f64,
    /// Of -w a: what is added to w x while they slide upwards.
    risen: f64,
    /// Of w b: what is added to w x while they slide downwards.
    fallen: f64,
}

/// One one-sided play with its weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub(crate) weight: f64,
    pub(crate) rise: f64,
    pub(crate) fall: f64,
}

/// A straight line: output = slope * input + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) slope: f64,
    pub(crate) offset: f64,
}

impl Line {
    #[inline]
    pub(crate) fn at(self, input: f64) -> f64 {
        self.slope * input + self.offset
    }

    /// The input as a line in the output.
    #[inline]
    pub(crate) fn inverted(self) -> Self {
        Self { slope: self.slope.recip(), offset: -self.offset / self.slope }
    }
}

impl Family {
    /// The family in nested order, or nothing if no order nests both thresholds.
    pub(crate) fn nested(mut members: Vec<Member>) -> Option<Self> {
        members.sort_by(|one, other| one.rise.total_cmp(&other.rise).then(one.fall.total_cmp(&other.fall)));
        if !members.is_sorted_by(|one, other| one.fall <= other.fall) {
            return None;
        }
        let mut total = Sums::default();
        let mut sums = Vec::with_capacity(members.len());
        for Member { weight, rise, fall } in &members {
            sums.push(total);
            total.weight += weight;
            total.risen -= weight * rise;
            total.fallen += weight * fall;
        }
        let marks = |of: fn(&Member) -> f64| Marks::new(members.iter().map(of).collect());
        let (rises, falls, gaps) = (marks(|m| m.rise), marks(|m| m.fall), marks(|m| m.rise + m.fall));
        Some(Self { rises, falls, gaps, sums: sums.into(), total })
    }

    pub(crate) fn len(&self) -> usize {
        self.sums.len()
    }

    /// The input at which operator i, at rest at zero or left at max(0, turned + b_i), starts to slide upwards.
    #[inline]
    pub(crate) fn starts_rising(&self, i: usize, turned: f64) -> f64 {
        self.rises.get(i).max(turned + self.gaps.get(i))
    }

    /// How many operators have started, the input having come up from `turned` to `x`: to rounding.
    #[inline]
    pub(crate) fn started_rising(&self, turned: f64, x: f64) -> usize {
        self.rises.at_most(x).min(self.gaps.at_most(x - turned))
    }

    /// The input at which operator i, left at turned - a_i, starts to slide downwards.
    #[inline]
    pub(crate) fn starts_falling(&self, i: usize, turned: f64) -> f64 {
        turned - self.gaps.get(i)
    }

    /// How many operators have started, the input having come down from `turned` to `x`: to rounding.
    #[inline]
    pub(crate) fn started_falling(&self, turned: f64, x: f64) -> usize {
        self.gaps.at_most(turned - x)
    }

    /// The input at which operator i, sliding downwards, comes to rest at zero.
    #[inline]
    pub(crate) fn rests(&self, i: usize) -> f64 {
        -self.falls.get(i)
    }

    /// How many operators that slide downwards have come to rest at the input `x`.
    #[inline]
    pub(crate) fn resting(&self, x: f64) -> usize {
        self.falls.at_most(-x)
    }

    /// Sum of |w_i| (input + a_i + b_i).
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        (0..self.len())
            .map(|i| (self.sums(i + 1).weight - self.sums(i).weight).abs() * (input + self.gaps.get(i)))
            .sum()
    }

    /// Sum over `from..to` of what operators that slide in `direction` give: w_i (x - a_i) or w_i (x + b_i), as a line
    /// in x.
    #[inline]
    pub(crate) fn sliding(&self, direction: Direction, from: usize, to: usize) -> Line {
        let (from, to) = (self.sums(from), self.sums(to));
        let offset = match direction {
            Direction::Rising => to.risen - from.risen,
            Direction::Falling => to.fallen - from.fallen,
        };
        Line { slope: to.weight - from.weight, offset }
    }

    /// The sums over the operators before i.
    #[inline]
    fn sums(&self, i: usize) -> Sums {
        self.sums.get(i).copied().unwrap_or(self.total)
    }
}
