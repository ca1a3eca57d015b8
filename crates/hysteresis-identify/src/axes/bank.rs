//! One scalar operator as the fit sees it: its output, and how that depends on its input, its past and its parameters.

use hysteresis_control::multi_axis::ScalarOperator;
use hysteresis_core::{Duhem, DuhemForward, MAX_KNOTS, Operator, Play, Process};

use crate::error::Error;
use crate::records::signal::as_f64;

/// What f of a Duhem operator may not fall below, where 1 is where it begins.
const LEAST_SLOPE: f64 = 1e-3;

/// w = H\[q\].
#[derive(Clone, Debug)]
pub(super) enum Bank {
    Plays {
        thresholds: Vec<f64>,
        weights: Vec<f64>,
    },
    /// The twin of plays without memory: w bends at every threshold, on the side of its sign.
    Curve {
        thresholds: Vec<f64>,
        weights: Vec<f64>,
    },
    /// f+, then f-.
    Duhem {
        knots: Vec<f64>,
        slopes: Vec<f64>,
    },
}

/// A kind of operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Plays,
    Curve,
    Duhem,
}

impl Bank {
    /// With so many thresholds or knots for inputs within the reach on both sides of 0.
    pub(super) fn new(kind: Kind, size: usize, reach: f64) -> Self {
        let weights = vec![1.0 / as_f64(size); size];
        match kind {
            Kind::Plays => {
                let thresholds = (1..=size).map(|j| reach * as_f64(j) / as_f64(size + 1)).collect();
                Self::Plays { thresholds, weights }
            }
            Kind::Curve => {
                let bend = |j: usize| reach * as_f64(j / 2 + 1) / as_f64(size / 2 + 1);
                let thresholds = (0..size).map(|j| if j % 2 == 0 { bend(j) } else { -bend(j) }).collect();
                Self::Curve { thresholds, weights }
            }
            Kind::Duhem => {
                let knots: Vec<f64> = (0..size).map(|j| reach * (2.0 * as_f64(j) / as_f64(size - 1) - 1.0)).collect();
                // Loops to begin with: of a straight line nothing tells in which direction loops would be better.
                let rising = knots.iter().map(|z| 1.0 - 0.4 * z / reach);
                let falling = knots.iter().map(|z| 1.0 + 0.4 * z / reach);
                Self::Duhem { slopes: rising.chain(falling).collect(), knots }
            }
        }
    }

    /// Nearly the same operator with other thresholds or knots.
    pub(super) fn refined(&self, size: usize, reach: f64) -> Self {
        let mut fine = match self {
            Self::Plays { .. } => Self::new(Kind::Plays, size, reach),
            // It is there to compare with.
            Self::Curve { .. } => self.clone(),
            Self::Duhem { .. } => Self::new(Kind::Duhem, size, reach),
        };
        match (&mut fine, self) {
            (Self::Plays { thresholds, weights }, Self::Plays { thresholds: r, weights: before }) => {
                *weights = bends((r, before), thresholds, reach);
            }
            (Self::Duhem { knots, slopes }, Self::Duhem { knots: before, slopes: f }) => {
                if let Ok(duhem) = duhem(before, f) {
                    let (rising, falling) = slopes.split_at_mut(knots.len());
                    for ((z, up), down) in knots.iter().zip(rising).zip(falling) {
                        (*up, *down) = (duhem.slope(*z, true), duhem.slope(*z, false));
                    }
                }
            }
            _ => {}
        }
        fine
    }

    pub(super) fn numbers(&self) -> &[f64] {
        match self {
            Self::Plays { weights, .. } | Self::Curve { weights, .. } => weights,
            Self::Duhem { slopes, .. } => slopes,
        }
    }

    pub(super) fn numbers_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Plays { weights, .. } | Self::Curve { weights, .. } => weights,
            Self::Duhem { slopes, .. } => slopes,
        }
    }

    /// Numbers that an operator can have.
    pub(super) fn clamp(&mut self) {
        if let Self::Duhem { slopes, .. } = self {
            for f in slopes {
                *f = f.max(LEAST_SLOPE);
            }
        }
    }

    /// Whether one of its numbers is at a bound of what operators can have.
    pub(super) fn is_at_bound(&self, number: f64) -> bool {
        self.acts_on_memory() && number <= LEAST_SLOPE
    }

    /// Its numbers with w times `of_w` and, if it takes any unit of q, q over `of_q`.
    pub(super) fn in_units(&self, of_w: f64, of_q: f64) -> Vec<f64> {
        match self {
            // Thresholds say in which unit q is.
            Self::Plays { weights, .. } | Self::Curve { weights, .. } => {
                weights.iter().map(|weight| weight * of_w).collect()
            }
            Self::Duhem { knots, slopes } => {
                let (rising, falling) = slopes.split_at(knots.len());
                let at = |f: &[f64], z: f64| {
                    let above = knots.iter().position(|knot| z < *knot).unwrap_or(knots.len() - 1).max(1);
                    let share = (z - knots[above - 1]) / (knots[above] - knots[above - 1]);
                    f[above - 1] + share * (f[above] - f[above - 1])
                };
                let branch = |f: &[f64]| knots.iter().map(|z| at(f, z / of_w) * of_w * of_q).collect::<Vec<_>>();
                [branch(rising), branch(falling)].concat()
            }
        }
    }

    /// How many memories it has.
    pub(super) fn elements(&self) -> usize {
        if self.acts_on_memory() { 1 } else { self.numbers().len() }
    }

    /// Whether parameters change the memory, not what is made of it.
    pub(super) fn acts_on_memory(&self) -> bool {
        matches!(self, Self::Duhem { .. })
    }

    /// The weight of each memory.
    pub(super) fn weights(&self) -> &[f64] {
        match self {
            Self::Plays { weights, .. } | Self::Curve { weights, .. } => weights,
            Self::Duhem { .. } => &[1.0],
        }
    }

    /// The operator of q where this one takes q times `gain`: w is the same. None for what has no memory.
    pub(super) fn operator(&self, gain: f64) -> Result<Option<ScalarOperator>, Error> {
        match self {
            Self::Plays { thresholds, weights } => {
                let thresholds: Vec<f64> = thresholds.iter().map(|r| r / gain).collect();
                let weights: Vec<f64> = weights.iter().map(|weight| weight * gain).collect();
                Ok(Some(ScalarOperator::plays(&thresholds, &weights)?))
            }
            Self::Curve { .. } => Ok(None),
            Self::Duhem { knots, slopes } => {
                let slopes: Vec<f64> = slopes.iter().map(|f| f * gain).collect();
                Ok(Some(ScalarOperator::duhem(duhem(knots, &slopes)?)))
            }
        }
    }

    pub(super) fn stream(&self) -> Result<BankStream, Error> {
        Ok(match self {
            Self::Plays { thresholds, weights } => {
                let plays = thresholds.iter().map(|r| Play::new(*r)).collect::<Result<_, _>>()?;
                BankStream::Plays { plays, weights: weights.clone(), outputs: vec![0.0; weights.len()] }
            }
            Self::Curve { thresholds, weights } => {
                BankStream::Curve { thresholds: thresholds.clone(), weights: weights.clone() }
            }
            Self::Duhem { knots, slopes } => {
                let forward = Box::new(DuhemForward::new(duhem(knots, slopes)?));
                BankStream::Duhem { knots: knots.clone(), forward }
            }
        })
    }
}

/// The weights at other thresholds with which first loading has the same w at each of them but the first, and at the
/// reach.
fn bends((thresholds, weights): (&[f64], &[f64]), there: &[f64], reach: f64) -> Vec<f64> {
    let loading = |q: f64| thresholds.iter().zip(weights).map(|(r, weight)| weight * (q - r).max(0.0)).sum::<f64>();
    let (mut slope, mut w) = (0.0, 0.0);
    let ends = there.iter().skip(1).chain([&reach]);
    let bend = |(r, end): (&f64, &f64)| {
        let (before, from) = (slope, w);
        w = loading(*end);
        slope = (w - from) / (end - r);
        slope - before
    };
    there.iter().zip(ends).map(bend).collect()
}

/// The operator of f+, then f-, at the knots.
fn duhem(knots: &[f64], slopes: &[f64]) -> Result<Duhem<MAX_KNOTS>, Error> {
    let (rising, falling) = slopes.split_at(knots.len());
    Ok(Duhem::new(knots, rising, falling)?)
}

/// An operator that runs.
pub(super) enum BankStream {
    Plays { plays: Vec<Play>, weights: Vec<f64>, outputs: Vec<f64> },
    Curve { thresholds: Vec<f64>, weights: Vec<f64> },
    Duhem { knots: Vec<f64>, forward: Box<DuhemForward<MAX_KNOTS>> },
}

/// How a memory follows from the one before, from q, and from the q before: their derivatives.
pub(super) type Follows = [f64; 3];

impl BankStream {
    /// w for the next q; writes derivatives by the parameters (of w, or of the memory) and those of the memories.
    #[inline]
    pub(super) fn step(&mut self, q: f64, by_parameters: &mut [f64], follows: &mut [Follows]) -> f64 {
        match self {
            Self::Plays { plays, weights, outputs } => {
                let mut sum = 0.0;
                for (j, play) in plays.iter().enumerate() {
                    let next = play.next(outputs[j], q);
                    follows[j] = if next == outputs[j] { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
                    outputs[j] = next;
                    by_parameters[j] = next;
                    sum += weights[j] * next;
                }
                sum
            }
            Self::Curve { thresholds, weights } => {
                let mut sum = 0.0;
                for (j, r) in thresholds.iter().enumerate() {
                    let beyond = if *r > 0.0 { (q - r).max(0.0) } else { (q - r).min(0.0) };
                    follows[j] = [0.0, if beyond == 0.0 { 0.0 } else { 1.0 }, 0.0];
                    by_parameters[j] = beyond;
                    sum += weights[j] * beyond;
                }
                sum
            }
            Self::Duhem { knots, forward } => {
                let (before, from) = (forward.output(), forward.input());
                let z = forward.step(q);
                by_parameters.fill(0.0);
                if q == from {
                    follows[0] = [1.0, 0.0, 0.0];
                    return z;
                }
                let rising = q > from;
                let duhem = forward.duhem();
                let slope = duhem.slope(z, rising);
                // Of a move nothing counts but its length.
                follows[0] = [slope / duhem.slope(before, rising), slope, -slope];
                let place = if rising { 0 } else { knots.len() };
                by_slopes(knots, &mut by_parameters[place..place + knots.len()], (before, z), slope, |z| {
                    duhem.slope(z, rising)
                });
                z
            }
        }
    }
}

/// dz of the end of a move by f at each knot: f times the integral of its share over f^2, over z.
fn by_slopes(knots: &[f64], sums: &mut [f64], (from, to): (f64, f64), slope: f64, at: impl Fn(f64) -> f64) {
    // Gauss's rule with three places: steps are short beside the distance of knots.
    const PLACES: [(f64, f64); 3] =
        [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
    for (share, weight) in PLACES {
        let z = from + share * (to - from);
        let f = at(z);
        let part = weight * (to - from) * slope / (f * f);
        let above = knots.iter().position(|knot| z < *knot).unwrap_or(knots.len() - 1).max(1);
        let (low, high) = (knots[above - 1], knots[above]);
        let s = (z - low) / (high - low);
        // Beyond the outer knots a line that grows outwards goes on; where it falls f stays.
        let grows = at(high) > at(low);
        let s = s.clamp(if grows { 0.0 } else { f64::NEG_INFINITY }, if grows { f64::INFINITY } else { 1.0 });
        sums[above - 1] += part * (1.0 - s);
        sums[above] += part * s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_thresholds_are_nearly_the_same_operator() {
        for kind in [Kind::Plays, Kind::Duhem] {
            let loading = |bank: &Bank, q: f64| {
                let (count, elements) = (bank.numbers().len(), bank.elements());
                bank.stream().unwrap().step(q, &mut vec![0.0; count], &mut vec![[0.0; 3]; elements])
            };
            let coarse = Bank::new(kind, 4, 1.0);
            for (size, reach) in [(4, 2.0), (4, 0.5), (8, 1.0)] {
                let there = coarse.refined(size, reach);
                for q in [reach, -reach] {
                    let (got, want) = (loading(&there, q), loading(&coarse, q));
                    assert!((got - want).abs() < 0.1 * want.abs().max(0.1), "{kind:?} {size} {reach} {got} {want}");
                }
            }
        }
    }
}
