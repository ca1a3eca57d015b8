//! How far the positions of neighbours may be apart.
//!
//! The positions that satisfy all limits of one sample, those of drives, slew and differences, are a convex set, and
//! the present positions lie in it. So every step here goes from a point of that set towards targets and stays in it.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::options::{ArrayOptions, check_one_or_each, one_or_each};
use crate::error::{Error, no_such};

/// How often all pairs, or all actuators, are gone through in a sample that needs it. A fixed number: the time is
/// bounded.
const SWEEPS: usize = 8;

/// What the difference keeps below its limit for the roundings of the inverse, relative to the limit.
const MARGIN: f64 = 1e-9;

/// Two actuators and how far their positions may be apart.
#[derive(Clone, Copy, Debug)]
struct Pair {
    first: usize,
    second: usize,
    most: f64,
    /// What is allowed in this sample: a pair that is too far apart already may stay so, but not grow.
    allowed: f64,
}

/// A pair as one of its actuators sees it.
#[derive(Clone, Copy, Debug)]
struct Link {
    other: usize,
    pair: usize,
}

/// All pairs, and those of every actuator.
#[derive(Clone, Debug)]
pub(super) struct Pairs {
    pairs: Box<[Pair]>,
    links: Box<[Box<[Link]>]>,
}

impl Pairs {
    pub(super) fn new(options: &ArrayOptions, actuators: usize) -> Result<Self, Error> {
        let ArrayOptions { neighbours, max_difference, .. } = options;
        if let ([], [first, ..]) = (&neighbours[..], &max_difference[..]) {
            return Err(Error::domain("max_difference", None, "none without neighbours", *first));
        }
        check_one_or_each("max_difference", max_difference, neighbours.len(), neighbours.is_empty())?;
        let (mut pairs, mut links) = (Vec::new(), vec![Vec::new(); actuators]);
        for (pair, (first, second)) in neighbours.iter().copied().enumerate() {
            for (of, other) in [(first, second), (second, first)] {
                let Some(links) = links.get_mut(of) else {
                    return Err(no_such("neighbours", Some(pair), of, actuators));
                };
                links.push(Link { other, pair });
            }
            if first == second {
                let expected = "two different actuators";
                return Err(Error::whole("neighbours", Some(pair), expected, first));
            }
            let most = one_or_each(max_difference, pair).unwrap_or(f64::INFINITY);
            pairs.push(Pair { first, second, most: most - MARGIN * most, allowed: most });
        }
        let links = links.into_iter().map(Vec::into_boxed_slice).collect();
        Ok(Self { pairs: pairs.into(), links })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Begins a sample at the present positions: whether `positions` are too far apart.
    #[inline]
    pub(super) fn begin(&mut self, present: &[f64], positions: &[f64]) -> bool {
        let mut violated = false;
        for pair in &mut self.pairs {
            pair.allowed = pair.difference(present).abs().max(pair.most);
            violated |= pair.difference(positions).abs() > pair.allowed;
        }
        violated
    }

    /// Moves targets that are too far apart towards each other, pair by pair: in the end most of them are within their
    /// limits.
    #[inline]
    pub(super) fn draw_together(&self, targets: &mut [f64]) {
        for _ in 0..SWEEPS {
            for pair in &self.pairs {
                let difference = pair.difference(targets);
                let excess = difference.abs() - pair.most;
                if excess > 0.0 {
                    let half = (0.5 * excess).copysign(difference);
                    add(targets, pair.first, -half);
                    add(targets, pair.second, half);
                }
            }
        }
    }

    /// Goes from the present positions to the targets as far as all pairs allow: first all actuators along a straight
    /// line, then each by itself. `positions` are where they come to.
    #[inline]
    pub(super) fn approach(&self, present: &[f64], targets: &[f64], positions: &mut [f64]) {
        let share = self.pairs.iter().map(|pair| pair.share(present, targets)).fold(1.0, f64::min);
        for ((position, from), to) in positions.iter_mut().zip(present).zip(targets) {
            *position = from + share * (to - from);
        }
        for sweep in 0..SWEEPS {
            for i in 0..targets.len() {
                // To and fro: a chain of actuators moves as a whole from either end.
                let actuator = if sweep % 2 == 0 { i } else { targets.len() - 1 - i };
                self.move_one(actuator, targets, positions);
            }
        }
    }

    /// Moves one actuator towards its target as far as its pairs allow, the others being where they are.
    #[inline]
    fn move_one(&self, actuator: usize, targets: &[f64], positions: &mut [f64]) {
        let (Some(links), Some(target)) = (self.links.get(actuator), targets.get(actuator)) else { return };
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for link in links {
            let allowed = self.pairs.get(link.pair).map_or(f64::INFINITY, |pair| pair.allowed);
            let other = at(positions, link.other);
            (low, high) = (low.max(other - allowed), high.min(other + allowed));
        }
        if low <= high
            && let Some(position) = positions.get_mut(actuator)
        {
            *position = target.max(low).min(high);
        }
    }
}

impl Pair {
    #[inline]
    fn difference(&self, positions: &[f64]) -> f64 {
        at(positions, self.first) - at(positions, self.second)
    }

    /// Which part of the way to the targets the pair may go.
    #[inline]
    fn share(&self, present: &[f64], targets: &[f64]) -> f64 {
        let (from, to) = (self.difference(present), self.difference(targets));
        if to.abs() <= self.allowed {
            return 1.0;
        }
        let share = (self.allowed.copysign(to) - from) / (to - from);
        share.clamp(0.0, 1.0)
    }
}

#[inline]
fn at(numbers: &[f64], index: usize) -> f64 {
    numbers.get(index).copied().unwrap_or(0.0)
}

#[inline]
fn add(numbers: &mut [f64], index: usize, summand: f64) {
    if let Some(number) = numbers.get_mut(index) {
        *number += summand;
    }
}

#[cfg(test)]
mod tests {
    use super::{ArrayOptions, Pairs};

    #[test]
    fn a_pair_at_its_limit_is_not_too_far_apart() {
        let options =
            ArrayOptions { neighbours: [(0, 1)].into(), max_difference: [1.0].into(), ..ArrayOptions::new(1e-3) };
        let mut pairs = Pairs::new(&options, 2).unwrap();
        let most = pairs.pairs[0].most;
        assert!(!pairs.begin(&[0.0, 0.0], &[most, 0.0]) && !pairs.begin(&[0.0, 0.0], &[0.0, most]));
        assert!(pairs.begin(&[0.0, 0.0], &[1.0, 0.0]) && pairs.begin(&[0.0, 0.0], &[0.0, 1.0]));
    }
}
