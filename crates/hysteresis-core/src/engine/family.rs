//! Parameters of a family of one-sided plays with nested thresholds, and the sums that make its cost independent
//! of its size.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::hint::select_unpredictable;

use super::direction::Direction;
use super::line::Line;
use super::lookup::{Lookup, MAX_NUMBERS};

/// One-sided plays p_i(k) = max(0, x - a_i, min(x + b_i, p_i(k-1))) with weights w_i, sorted so that a and b never
/// decrease over i.
///
/// Then p_i + a_i never decreases in i and p_i - b_i never increases, from any state reachable from rest. So the
/// operators that slide on a branch are always a prefix of the family and the others are frozen.
#[derive(Clone, Debug)]
pub(crate) struct Family {
    /// One per operator.
    entries: Box<[OperatorEntry]>,
    /// What stands past the last operator.
    beyond: OperatorEntry,
    /// Where to look for an a_i, b_i and a_i + b_i.
    rises: Lookup,
    falls: Lookup,
    gaps: Lookup,
}

/// The thresholds of operator i and the sums over all operators before it: what a step needs of an operator lies
/// together.
#[derive(Clone, Copy, Debug)]
struct OperatorEntry {
    /// a_i: rising, the operator slides along x - a_i.
    rise: f64,
    /// b_i: falling, the operator slides along x + b_i until it rests at zero.
    fall: f64,
    /// a_i + b_i: the travel of the input between sliding one way and sliding the other.
    gap: f64,
    /// Sum of w.
    weight: f64,
    /// Sum of -w a: added to w x while they slide upwards.
    risen: f64,
    /// Sum of w b: added to w x while they slide downwards.
    fallen: f64,
}

/// One one-sided play with its weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub(crate) weight: f64,
    pub(crate) rise: f64,
    pub(crate) fall: f64,
}

impl Family {
    /// The family in nested order, or nothing if no order nests both thresholds.
    pub(crate) fn nested(mut members: Vec<Member>) -> Option<Self> {
        members.sort_by(|one, other| one.rise.total_cmp(&other.rise).then(one.fall.total_cmp(&other.fall)));
        if !members.is_sorted_by(|one, other| one.fall <= other.fall) {
            return None;
        }
        if members.len() > MAX_NUMBERS as usize {
            return None;
        }
        let infinity = f64::INFINITY;
        let mut next =
            OperatorEntry { rise: infinity, fall: infinity, gap: infinity, weight: 0.0, risen: 0.0, fallen: 0.0 };
        let mut entries = Vec::with_capacity(members.len());
        for Member { weight, rise, fall } in &members {
            entries.push(OperatorEntry { rise: *rise, fall: *fall, gap: rise + fall, ..next });
            next.weight += weight;
            next.risen -= weight * rise;
            next.fallen += weight * fall;
        }
        let lookup = |of: fn(&OperatorEntry) -> f64| Lookup::new(entries.iter().map(of));
        let (rises, falls, gaps) = (lookup(|entry| entry.rise), lookup(|entry| entry.fall), lookup(|entry| entry.gap));
        Some(Self { entries: entries.into(), beyond: next, rises, falls, gaps })
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// The thresholds a and b of every operator, and the sum of the weights before it; then the sum of all.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        self.entries.iter().chain([&self.beyond]).map(|entry| (entry.rise, entry.fall, entry.weight))
    }

    #[inline]
    fn entry(&self, i: usize) -> &OperatorEntry {
        self.entries.get(i).unwrap_or(&self.beyond)
    }

    /// The input at which operator i, at rest at zero or left at max(0, turned + b_i), starts to slide upwards.
    #[inline]
    pub(crate) fn starts_rising(&self, i: usize, turned: f64) -> f64 {
        let entry = self.entry(i);
        Direction::Rising.further(entry.rise, turned + entry.gap)
    }

    /// Bounds, to rounding, of how many have started, the input having come up from `turned` to `x`.
    #[inline]
    pub(crate) fn started_rising(&self, turned: f64, x: f64) -> (usize, usize) {
        let ((one, most), (other, at_most)) = (self.rises.at_most(x), self.gaps.at_most(x - turned));
        (one.min(other), most.min(at_most))
    }

    /// The input at which operator i, left at turned - a_i, starts to slide downwards.
    #[inline]
    pub(crate) fn starts_falling(&self, i: usize, turned: f64) -> f64 {
        turned - self.entry(i).gap
    }

    /// Bounds, to rounding, of how many have started, the input having come down from `turned` to `x`.
    #[inline]
    pub(crate) fn started_falling(&self, turned: f64, x: f64) -> (usize, usize) {
        self.gaps.at_most(turned - x)
    }

    /// The input at which operator i, sliding downwards, comes to rest at zero.
    #[inline]
    pub(crate) fn rests(&self, i: usize) -> f64 {
        -self.entry(i).fall
    }

    /// Bounds of how many rest at zero, the input having come down to `x`.
    #[inline]
    pub(crate) fn resting(&self, x: f64) -> (usize, usize) {
        self.falls.at_most(-x)
    }

    /// Sum of |w_i| (input + a_i + b_i).
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        let weight = |i: usize| self.entry(i + 1).weight - self.entry(i).weight;
        self.entries.iter().enumerate().map(|(i, entry)| weight(i).abs() * (input + entry.gap)).sum()
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
