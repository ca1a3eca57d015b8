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
    /// a_i: rising, operator i slides along x - a_i.
    rise: Box<[f64]>,
    /// b_i: falling, operator i slides along x + b_i until it rests at zero.
    fall: Box<[f64]>,
    /// a_i + b_i: the travel of the input between sliding one way and sliding the other.
    gap: Box<[f64]>,
    /// Sums over the operators before i, for i = 0..=n.
    sums: Box<[Sums]>,
}

/// Sums of w, w a and w b over a prefix of the family.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    weight: f64,
    rise: f64,
    fall: f64,
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
        let mut sums = Vec::with_capacity(members.len() + 1);
        sums.push(total);
        for member in &members {
            total.weight += member.weight;
            total.rise += member.weight * member.rise;
            total.fall += member.weight * member.fall;
            sums.push(total);
        }
        Some(Self {
            rise: members.iter().map(|member| member.rise).collect(),
            fall: members.iter().map(|member| member.fall).collect(),
            gap: members.iter().map(|member| member.rise + member.fall).collect(),
            sums: sums.into(),
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.rise.len()
    }

    #[inline]
    pub(crate) fn rise(&self, i: usize) -> f64 {
        self.rise[i]
    }

    #[inline]
    pub(crate) fn fall(&self, i: usize) -> f64 {
        self.fall[i]
    }

    #[inline]
    pub(crate) fn gap(&self, i: usize) -> f64 {
        self.gap[i]
    }

    /// Sum of w_i (x - a_i) over `from..to`, as a line in x.
    #[inline]
    pub(crate) fn risen(&self, from: usize, to: usize) -> Line {
        let (from, to) = (self.sums[from], self.sums[to]);
        Line { slope: to.weight - from.weight, offset: from.rise - to.rise }
    }

    /// Sum of w_i (x + b_i) over `from..to`, as a line in x.
    #[inline]
    pub(crate) fn fallen(&self, from: usize, to: usize) -> Line {
        let (from, to) = (self.sums[from], self.sums[to]);
        Line { slope: to.weight - from.weight, offset: to.fall - from.fall }
    }
}
