//! Creep behind the hysteresis, sample by sample.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::error::{Bound, Error, check_all_finite, check_between, check_finite, check_length};
use crate::real::unless_faded;

/// Creep at the samples: y(k) = h(k) + sum_j c_j q_j(k), q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k).
///
/// h is the position without creep, c_j the share of h by which the j-th term creeps, a_j = exp(-dt / tau_j) its decay
/// from sample to sample. This is the exact answer of first-order lags to an h that is held between samples. The newest
/// h does not enter the sum, so h(k) follows from y(k) and the states by one subtraction.
///
/// ```
/// use hysteresis_core::CreepTerms;
/// let creep = CreepTerms::new(&[0.01, 0.02], &[0.9, 0.99])?;
/// assert_eq!(creep.amplitudes(), [0.01, 0.02]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CreepTerms {
    amplitudes: Box<[f64]>,
    decays: Box<[f64]>,
}

/// What each term has crept, s_j = c_j q_j, beside its parameters: s_j(k+1) = a_j s_j(k) + c_j (1 - a_j) h(k).
///
/// One pass over one array serves a sample, and between the newest h and the next sum lies one product.
#[derive(Clone, Debug)]
pub(super) struct CreepMemory {
    terms: Box<[Term]>,
}

#[derive(Clone, Copy, Debug)]
struct Term {
    amplitude: f64,
    decay: f64,
    /// c_j (1 - a_j)
    gain: f64,
    /// s_j
    crept: f64,
}

impl CreepTerms {
    /// From the amplitudes c_j and the decays a_j.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are as many of each, [`Error::Domain`] for an amplitude that is not finite, a
    /// decay outside 0 to 1, or amplitudes whose magnitudes sum to more than 1e6.
    pub fn new(amplitudes: &[f64], decays: &[f64]) -> Result<Self, Error> {
        check_length("decays", amplitudes.len(), decays.len())?;
        let mut sum = 0.0;
        for (index, amplitude) in amplitudes.iter().enumerate() {
            sum += check_finite("amplitudes", Some(index), *amplitude)?.abs();
            if sum > 1e6 {
                let expected = Bound::Between { low: -1e6, high: 1e6 };
                return Err(Error::Domain { parameter: "amplitudes", index: Some(index), expected, got: *amplitude });
            }
        }
        for (index, decay) in decays.iter().enumerate() {
            check_between("decays", Some(index), *decay, (0.0, 1.0))?;
        }
        Ok(Self { amplitudes: amplitudes.into(), decays: decays.into() })
    }

    /// c_j.
    #[must_use]
    pub fn amplitudes(&self) -> &[f64] {
        &self.amplitudes
    }

    /// a_j.
    #[must_use]
    pub fn decays(&self) -> &[f64] {
        &self.decays
    }
}

impl CreepMemory {
    /// All states at zero; no terms, no creep.
    pub(super) fn new(creep: Option<&CreepTerms>) -> Self {
        let term = |(c, a): (&f64, &f64)| Term { amplitude: *c, decay: *a, gain: c * (1.0 - a), crept: 0.0 };
        let terms = creep.map(|creep| creep.amplitudes.iter().zip(&creep.decays).map(term).collect());
        Self { terms: terms.unwrap_or_default() }
    }

    /// sum_j s_j: what the position has crept.
    #[inline]
    pub(super) fn crept(&self) -> f64 {
        self.terms.iter().fold(0.0, |sum, term| sum + term.crept)
    }

    /// Holds h for one sampling interval.
    #[inline]
    pub(super) fn hold(&mut self, h: f64) {
        for term in &mut self.terms {
            term.crept = term.decay * term.crept + term.gain * h;
        }
        if unless_faded(h) == 0.0 {
            self.fade();
        }
    }

    /// Behind a position that has faded.
    #[cold]
    fn fade(&mut self) {
        self.terms.iter_mut().for_each(|term| term.crept = unless_faded(term.crept));
    }

    /// h has been held since forever.
    pub(super) fn settle(&mut self, h: f64) {
        for term in &mut self.terms {
            term.crept = term.amplitude * h;
        }
    }

    pub(super) fn states(&self) -> Vec<f64> {
        self.terms.iter().map(|term| term.crept).collect()
    }

    pub(super) fn check(&self, states: &[f64]) -> Result<(), Error> {
        check_length("state.creep", self.terms.len(), states.len())?;
        check_all_finite("state.creep", states)
    }

    /// Continues from states that were checked.
    pub(super) fn restore(&mut self, states: &[f64]) {
        for (term, state) in self.terms.iter_mut().zip(states) {
            term.crept = *state;
        }
    }
}
