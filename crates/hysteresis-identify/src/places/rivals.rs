//! What a model lacks, as far as the other models that were tried say it.
//!
//! Standard errors know the errors of pairs and lengths alone. Where no model is right, those that explain the pairs
//! about as well say different positions: so far apart the truth may be, too. The square of the distance of a model
//! counts by the square of its trust, what the chosen one leaves of pairs that it was not fitted to over what this one
//! does: a model that explains them badly says little. One that counts little makes the mean of the others no smaller.
//!
//! A model that has all terms of the chosen one and more explains the pairs no better than chance, or it were chosen.
//! So its distance is the noise of the terms that it has more, and says of what the chosen one lacks as much as is left
//! to explain: its square counts by the share of the mismatches that is alike from pair to pair.

use crate::fit::response::Chain;
use crate::records::signal::{bounds, bounds_of};

/// A model that was not chosen.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Rival {
    pub(crate) chain: Chain,
    pub(crate) output_offset: f64,
    /// Above 0, at most 1.
    pub(crate) trust: f64,
}

/// A model of so many times the range says nothing: the pairs leave its weights open, and not those of the chosen one.
const MOST_RANGE: f64 = 2.0;

/// Whether pairs leave the weights of a model open, by what it and the chosen one say of positions along the drives.
pub(crate) fn is_open(positions: &[Vec<f64>], chosen: &[Vec<f64>]) -> bool {
    let range = |drives: &[Vec<f64>]| {
        let (low, high) = bounds_of(drives.iter().map(|drive| bounds(drive)));
        high - low
    };
    range(positions) > MOST_RANGE * range(chosen)
}

/// The trust in a model for what the chosen one and it leave of pairs that were not fitted; what is below `rounding` is
/// all the same.
pub(crate) fn trust(chosen: f64, left: f64, rounding: f64) -> f64 {
    (chosen.max(rounding) / left.max(rounding).max(f64::MIN_POSITIVE)).min(1.0)
}

/// The share of the mean square of values in their order that is alike from each to the next: 0 for noise, 1 for what
/// goes on smoothly (von Neumann, Ann. Math. Stat. 12, 367, 1941).
pub(crate) fn alike(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    let steps: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    if squares > 0.0 { (1.0 - 0.5 * steps / squares).clamp(0.0, 1.0) } else { 0.0 }
}

/// How far from positions the others are: the root of the mean square of all models, each by the square of the trust in
/// it, the chosen one among them.
pub(crate) fn distances<'a>(positions: &[f64], others: impl Iterator<Item = (Vec<f64>, &'a f64)>) -> Vec<f64> {
    let mut squares = vec![0.0; positions.len()];
    let mut weight = 1.0;
    for (other, trust) in others {
        weight += trust * trust;
        for ((square, position), other) in squares.iter_mut().zip(positions).zip(other) {
            *square += (trust * (other - position)).powi(2);
        }
    }
    squares.into_iter().map(|square: f64| (square / weight).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_counts_by_its_trust() {
        let others = [(vec![0.0, 13.0, 4.0], &0.5), (vec![0.0, 10.0, 7.0], &1.0)];
        assert_eq!(distances(&[0.0, 10.0, 4.0], others.into_iter()), [0.0, 1.0, 2.0]);
        assert_eq!(distances(&[1.0], std::iter::empty()), [0.0]);
    }

    #[test]
    fn a_model_that_is_not_trusted_makes_no_other_smaller() {
        let near = (vec![0.0, 3.0], &1.0);
        let alone = distances(&[0.0, 1.0], [near.clone()].into_iter());
        let with_a_bad_one = distances(&[0.0, 1.0], [near, (vec![0.0, 900.0], &1e-6)].into_iter());
        assert!((alone[1] - 2.0_f64.sqrt()).abs() < 1e-15);
        assert!((with_a_bad_one[1] - alone[1]).abs() < 1e-6);
    }

    #[test]
    fn a_model_of_more_than_twice_the_range_is_open() {
        let chosen = [vec![0.0, 1.0], vec![0.0, -1.0]];
        assert!(!is_open(&[vec![0.0, 2.0], vec![0.0, -2.0]], &chosen));
        assert!(is_open(&[vec![0.0, 2.1], vec![0.0, -2.0]], &chosen));
    }

    #[test]
    fn noise_is_not_alike_and_a_wave_is() {
        let wave: Vec<f64> = (0..100_u32).map(|k| (f64::from(k) / 10.0).sin()).collect();
        assert!(alike(&wave) > 0.99);
        let turned: Vec<f64> = (0..100_u32).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!(alike(&turned).abs() < 1e-15);
        let of_two: Vec<f64> = (0..100_u32).map(|k| if k / 2 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!(alike(&[1.0; 9]) > 0.99 && alike(&[0.0; 9]).abs() < 1e-15 && (alike(&of_two) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn a_model_that_leaves_twice_as_much_is_trusted_by_half() {
        assert!((trust(1.0, 2.0, 0.1) - 0.5).abs() < 1e-15);
        assert!((trust(2.0, 1.0, 0.1) - 1.0).abs() < 1e-15);
        assert!((trust(1e-9, 1e-8, 0.1) - 1.0).abs() < 1e-15);
        assert!(trust(0.0, 0.0, 0.0) < 1.0);
    }
}
