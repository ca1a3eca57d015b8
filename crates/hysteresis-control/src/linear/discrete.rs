//! Dynamics behind a hold, exactly discretised.

use nalgebra::{DMatrix, DVector};

use super::history::Split;
use super::state_space::rest;
use super::{Error, StateSpace};

/// The most time constants that a sampling interval may last.
const MAX_STIFFNESS: f64 = 1e6;

/// x' = A x + b u, y = c x + d u behind a dead time of (n + f) T, for an input that is held over T.
///
/// What acts over the interval from t_k on is first u(k-n-1), for f T, then u(k-n). The state is the distance from
/// where u(k-n-1) would let it rest, e(k) = x(k) - r u(k-n-1), r = -A^-1 b. With Phi = exp(A T), g = exp(A (1-f) T) r
/// and the static gain G
///
/// e(k+1) = Phi e(k) + g (u(k-n-1) - u(k-n)),
/// y(k) = G u(k-n-1) + c e(k) + d (1-f) (u(k-n) - u(k-n-1)).
///
/// So at rest e = 0 and nothing moves, not even a rounding. Of what passes at once (d) a dead time that is no whole
/// number of samples lets through the mean of its neighbours, as a [`Delay`](super::Delay) does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Discrete {
    pub(crate) phi: DMatrix<f64>,
    pub(crate) g: DVector<f64>,
    pub(crate) c: DVector<f64>,
    pub(crate) d: f64,
    pub(crate) gain: f64,
    pub(crate) dead_time: Split,
}

impl Discrete {
    pub(crate) fn new(dynamics: &StateSpace, dead_time: f64, dt: f64) -> Result<Self, Error> {
        let dead_time = Split::new(dead_time, dt)?;
        let StateSpace { a, b, c, d, gain, .. } = dynamics;
        let (c, d, gain) = (c.clone(), *d, *gain);
        if a.is_empty() {
            return Ok(Self { phi: a.clone(), g: b.clone(), c, d, gain, dead_time });
        }
        // One state alone is a decay, whatever its rate.
        if a.nrows() > 1 && a.amax() * dt > MAX_STIFFNESS {
            let expected = "at most 1e6 time constants of the fastest part of the dynamics";
            return Err(Error::domain("dt", None, expected, dt));
        }
        let phi = (a * dt).exp();
        let rest = rest(a, b);
        let g = if dead_time.share == 0.0 { &phi * rest } else { (a * (dt * (1.0 - dead_time.share))).exp() * rest };
        if !phi.iter().chain(&g).all(|entry| entry.is_finite()) {
            let expected = "a sampling interval at which the dynamics can be discretised";
            return Err(Error::domain("dt", None, expected, dt));
        }
        Ok(Self { phi, g, c, d, gain, dead_time })
    }
}
