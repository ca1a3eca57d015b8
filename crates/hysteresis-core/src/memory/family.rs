//! Parameters of a family of one-sided plays with nested thresholds, and the sums that make its cost independent
//! of its size.

use alloc::boxed::Box;
use alloc::vec::Vec;

/// One-sided plays p_i(k) = max(0, x - a_i, min(x + b_i, p_i(k-1))) with weights w_i, sorted so that a and b never
/// decrease over i.
///
/// Then p_i + a_i never decreases in i and p_i - b_i never increases, from any state reachable from rest. So the
/// operators that slide on a branch are always a prefix of the family and the others are frozen.
#[derive(Clone, Debug)]
pub(crate) struct Family {
    /// One rung per operator and one above them all: what a step needs of an operator lies together.
    rungs: Box<[Rung]>,
}

/// The thresholds of operator i and the sums over all operators before it.
#[derive(Clone, Copy, Debug)]
struct Rung {
    /// a_i: rising, the operator slides along x - a_i.
    rise: f64,
    /// b_i: falling, the operator slides along x + b_i until it rests at zero.
    fall: f64,
    /// a_i + b_i: the travel of the input between sliding one way and sliding the other.
    gap: f64,
    /// Sum of w.
    weight: f64,
    /// Sum of w a.
    weighted_rise: f64,
    /// Sum of w b.
    weighted_fall: f64,
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
        let mut next = Rung { rise: 0.0, fall: 0.0, gap: 0.0, weight: 0.0, weighted_rise: 0.0, weighted_fall: 0.0 };
        let mut rungs = Vec::with_capacity(members.len() + 1);
        for Member { weight, rise, fall } in members {
            rungs.push(Rung { rise, fall, gap: rise + fall, ..next });
            next.weight += weight;
            next.weighted_rise += weight * rise;
            next.weighted_fall += weight * fall;
        }
        rungs.push(next);
        Some(Self { rungs: rungs.into() })
    }

    pub(crate) fn len(&self) -> usize {
        self.rungs.len() - 1
    }

    #[inline]
    pub(crate) fn rise(&self, i: usize) -> f64 {
        self.rungs[i].rise
    }

    #[inline]
    pub(crate) fn fall(&self, i: usize) -> f64 {
        self.rungs[i].fall
    }

    #[inline]
    pub(crate) fn gap(&self, i: usize) -> f64 {
        self.rungs[i].gap
    }

    /// Sum of |w_i| (input + a_i + b_i).
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        self.rungs.windows(2).map(|pair| (pair[1].weight - pair[0].weight).abs() * (input + pair[0].gap)).sum()
    }

    /// Sum of w_i (x - a_i) over `from..to`, as a line in x.
    #[inline]
    pub(crate) fn risen(&self, from: usize, to: usize) -> Line {
        let (from, to) = (&self.rungs[from], &self.rungs[to]);
        Line { slope: to.weight - from.weight, offset: from.weighted_rise - to.weighted_rise }
    }

    /// Sum of w_i (x + b_i) over `from..to`, as a line in x.
    #[inline]
    pub(crate) fn fallen(&self, from: usize, to: usize) -> Line {
        let (from, to) = (&self.rungs[from], &self.rungs[to]);
        Line { slope: to.weight - from.weight, offset: to.weighted_fall - from.weighted_fall }
    }
}
