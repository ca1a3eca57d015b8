//! Plays that follow late, sample by sample.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::error::{Bound, Error, check_all_finite, check_between, check_finite, check_length};
use crate::operator::{Operator, Play};
use crate::real::unless_faded;

/// Plays that relax, at the samples: r(k) = sum_j s_j(k), added to the position behind the output map.
///
/// Loops of rate-independent hysteresis are as wide at any speed. Those of many actuators are not: what a threshold
/// holds back follows within a time of its own. Here plays of a few thresholds go through first-order lags:
///
/// ```text
/// z_i(k) = max(min(z_i(k-1), x(k) + r_i), x(k) - r_i)        x(k) = u(k) - origin
/// s_j(k+1) = a_j s_j(k) + (1 - a_j) sum_i v_ij z_i(k)        a_j = exp(-dt / tau_j)
/// ```
///
/// This is the exact answer of the lags to plays that are held between samples. The newest drive enters no s_j before
/// the next sample: r(k) is known before u(k) is chosen, so the inverse is one subtraction.
///
/// Thresholds and origin have the unit of the drive, weights v_ij that of the position per unit of the drive. One
/// threshold of 0 is creep of the drive itself. The creep operators of P. Krejci and K. Kuhnen, IEE Proc. Control
/// Theory Appl. 148 (2001) 185-192, are kin: their thresholds lie within the lag.
///
/// ```
/// use hysteresis_core::RelaxingPlayTerms;
/// let plays = RelaxingPlayTerms::new(&[0.0, 20.0], 0.0, &[0.9, 0.99], &[vec![0.01, 0.02], vec![0.0, 0.03]])?;
/// assert_eq!(plays.decays(), [0.9, 0.99]);
/// assert!(plays.thresholds().eq([0.0, 20.0]));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxingPlayTerms {
    plays: Box<[Play]>,
    origin: f64,
    decays: Box<[f64]>,
    /// v_ij, a row for every lag.
    weights: Box<[Box<[f64]>]>,
}

/// z_i and s_j, and what becomes of them.
#[derive(Clone, Debug)]
pub(super) struct Relaxation {
    origin: f64,
    plays: Box<[Held]>,
    lags: Box<[Lag]>,
}

/// A play and z_i.
#[derive(Clone, Copy, Debug)]
struct Held {
    play: Play,
    output: f64,
}

/// One lag.
#[derive(Clone, Debug)]
struct Lag {
    decay: f64,
    weights: Box<[f64]>,
    /// s_j
    relaxed: f64,
}

impl RelaxingPlayTerms {
    /// From the thresholds r_i, the drive at which all plays are virgin, the decays a_j, and for each of these the
    /// weights v_ij of all plays.
    ///
    /// # Errors
    /// [`Error::Domain`] for thresholds that are not finite, below 0 or not strictly rising, a decay outside 0 to 1, an
    /// origin or a weight that is not finite; [`Error::Length`] unless there is a row of weights for every decay and in
    /// it a weight for every threshold; [`Error::Whole`] without a threshold or a decay.
    pub fn new(thresholds: &[f64], origin: f64, decays: &[f64], weights: &[Vec<f64>]) -> Result<Self, Error> {
        for (parameter, numbers) in [("thresholds", thresholds), ("decays", decays)] {
            if numbers.is_empty() {
                return Err(Error::whole(parameter, None, "at least one number", 0));
            }
        }
        let mut plays: Vec<Play> = Vec::with_capacity(thresholds.len());
        for (index, threshold) in thresholds.iter().enumerate() {
            let play = Play::indexed("thresholds", Some(index), *threshold)?;
            if let Some(limit) = plays.last().map(Play::r).filter(|before| play.r() <= *before) {
                let (index, expected) = (Some(index), Bound::Above { what: "the one before", limit });
                return Err(Error::Domain { parameter: "thresholds", index, expected, got: play.r() });
            }
            plays.push(play);
        }
        check_finite("origin", None, origin)?;
        for (index, decay) in decays.iter().enumerate() {
            check_between("decays", Some(index), *decay, (0.0, 1.0))?;
        }
        check_length("weights", decays.len(), weights.len())?;
        for row in weights {
            check_length("weights", thresholds.len(), row.len())?;
            check_all_finite("weights", row)?;
        }
        let weights = weights.iter().map(|row| row.as_slice().into()).collect();
        Ok(Self { plays: plays.into(), origin, decays: decays.into(), weights })
    }

    /// r_i.
    pub fn thresholds(&self) -> impl ExactSizeIterator<Item = f64> {
        self.plays.iter().map(Play::r)
    }

    /// The drive at which all plays are virgin.
    #[must_use]
    pub fn origin(&self) -> f64 {
        self.origin
    }

    /// a_j.
    #[must_use]
    pub fn decays(&self) -> &[f64] {
        &self.decays
    }

    /// v_ij, a row for every lag.
    pub fn weights(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.weights.iter().map(AsRef::as_ref)
    }

    /// All parameters in one row.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> {
        let rows = self.weights.iter().flat_map(|row| row.iter());
        let others = core::iter::once(&self.origin).chain(&self.decays).chain(rows);
        self.thresholds().chain(others.copied())
    }
}

impl Relaxation {
    /// At rest at the origin.
    pub(super) fn new(terms: &RelaxingPlayTerms) -> Self {
        let held = |play: &Play| Held { play: *play, output: 0.0 };
        let lag = |(decay, weights): (&f64, &[f64])| Lag { decay: *decay, weights: weights.into(), relaxed: 0.0 };
        Self {
            origin: terms.origin,
            plays: terms.plays.iter().map(held).collect(),
            lags: terms.decays.iter().zip(terms.weights()).map(lag).collect(),
        }
    }

    /// r.
    #[inline]
    pub(super) fn relaxed(&self) -> f64 {
        self.lags.iter().fold(0.0, |sum, lag| sum + lag.relaxed)
    }

    /// Holds a drive for one sampling interval.
    #[inline]
    pub(super) fn hold(&mut self, drive: f64) {
        self.move_plays(drive);
        for lag in &mut self.lags {
            let target = lag.target(&self.plays);
            lag.relaxed = lag.decay * lag.relaxed + (1.0 - lag.decay) * target;
            if unless_faded(target) == 0.0 {
                lag.relaxed = unless_faded(lag.relaxed);
            }
        }
    }

    #[inline]
    fn move_plays(&mut self, drive: f64) {
        let x = drive - self.origin;
        for held in &mut self.plays {
            held.output = held.play.next(held.output, x);
        }
    }

    /// The drive has been held since forever: the plays are virgin but for the way there.
    pub(super) fn settle(&mut self, drive: f64) {
        for play in &mut self.plays {
            play.output = 0.0;
        }
        self.move_plays(drive);
        for lag in &mut self.lags {
            lag.relaxed = lag.target(&self.plays);
        }
    }

    /// How many numbers a state has.
    pub(super) fn states_len(&self) -> usize {
        self.plays.len() + self.lags.len()
    }

    /// z_i, then s_j.
    pub(super) fn states(&self) -> Vec<f64> {
        self.plays.iter().map(|play| play.output).chain(self.lags.iter().map(|lag| lag.relaxed)).collect()
    }

    /// Continues from states that were checked.
    pub(super) fn restore(&mut self, states: &[f64]) {
        let outputs = self.plays.iter_mut().map(|play| &mut play.output);
        let relaxed = self.lags.iter_mut().map(|lag| &mut lag.relaxed);
        outputs.chain(relaxed).zip(states).for_each(|(place, state)| *place = *state);
    }
}

impl Lag {
    /// Where it comes to in the end, the plays being held.
    #[inline]
    fn target(&self, plays: &[Held]) -> f64 {
        self.weights.iter().zip(plays).fold(0.0, |sum, (weight, play)| sum + weight * play.output)
    }
}
