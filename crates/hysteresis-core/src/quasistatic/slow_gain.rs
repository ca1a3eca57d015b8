//! A gain that follows the amplitude slowly, sample by sample.

use alloc::vec;
use alloc::vec::Vec;

use super::follower::Follower;
use crate::error::{Bound, Error, check_between, check_finite};

/// The least and the greatest half range.
const SCALE: (f64, f64) = (1e-50, 1e50);

/// The largest magnitude of kappa: the gain stays between a half and one and a half, whatever the drive does.
const LARGEST: f64 = 0.5;

/// The slow gain at the samples: v(k) = zero + (1 + kappa m(k)) (h(k) - zero), behind output map and loop shift.
///
/// Measured on piezo stacks: while a drive cycles, all loops become smaller by a few parts in a thousand, within a
/// minute. No model of Preisach's class has that. Here the gain follows from the motion of the drive u:
///
/// ```text
/// x(k) = u(k) / half_range
/// e(k) = x(k) - f(k), within -1 .. 1      f follows x with the time constant tau / 4
/// m' = (e^2 - m) / tau
/// ```
///
/// The drive is held between samples, so x is constant there and e decays as exp(-4 t / tau). With a = exp(-dt / tau)
/// this is exactly
///
/// ```text
/// m(k+1) = a m(k) + (a - a^8) / 7  e(k)^2
/// f(k+1) = x(k) - a^4 e(k)
/// ```
///
/// The newest drive enters neither before the next sample: the gain is known before u(k) is chosen, so the inverse is
/// one division. At rest m is 0 and the gain 1; a sine over the whole range that is fast beside tau has m = 1/2, and no
/// drive has more than 1. `zero` is the position that the gain leaves where it is.
///
/// x, e, m and kappa have no unit.
///
/// ```
/// use hysteresis_core::SlowGainTerms;
/// let gain = SlowGainTerms::new(75.0, -0.008, 40.0, 0.99997)?; // V, 1, um
/// assert_eq!((gain.amplitude(), gain.zero()), (-0.008, 40.0));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlowGainTerms {
    half_range: f64,
    amplitude: f64,
    zero: f64,
    decay: f64,
}

/// m and f, and what becomes of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Activity {
    terms: SlowGainTerms,
    follower: Follower,
}

impl SlowGainTerms {
    /// From half of the range of drives, the amplitude kappa, the position that stays where it is, and the decay a from
    /// sample to sample.
    ///
    /// # Errors
    /// [`Error::Domain`] for a half range outside 1e-50 to 1e50, an amplitude outside -0.5 to 0.5, a position that is
    /// not finite, or a decay outside 0 to 1.
    pub fn new(half_range: f64, amplitude: f64, zero: f64, decay: f64) -> Result<Self, Error> {
        if !(SCALE.0..=SCALE.1).contains(&half_range) {
            let expected = Bound::Words("a number above 0 (1e-50 to 1e50)");
            return Err(Error::Domain { parameter: "half_range", index: None, expected, got: half_range });
        }
        check_between("amplitude", None, amplitude, (-LARGEST, LARGEST))?;
        check_finite("zero", None, zero)?;
        check_between("decay", None, decay, (0.0, 1.0))?;
        Ok(Self { half_range, amplitude, zero, decay })
    }

    /// Half of the range of drives.
    #[must_use]
    pub fn half_range(&self) -> f64 {
        self.half_range
    }

    /// kappa.
    #[must_use]
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// The position that the gain leaves where it is.
    #[must_use]
    pub fn zero(&self) -> f64 {
        self.zero
    }

    /// a.
    #[must_use]
    pub fn decay(&self) -> f64 {
        self.decay
    }

    /// All parameters in one row.
    pub(super) fn numbers(&self) -> [f64; 4] {
        [self.half_range, self.amplitude, self.zero, self.decay]
    }
}

impl Activity {
    /// At rest at the drive 0.
    pub(super) fn new(terms: &SlowGainTerms) -> Self {
        Self { terms: *terms, follower: Follower::new(terms.decay, 1.0) }
    }

    /// 1 + kappa m.
    #[inline]
    pub(super) fn gain(&self) -> f64 {
        1.0 + self.terms.amplitude * self.follower.mean_square()
    }

    pub(super) fn zero(&self) -> f64 {
        self.terms.zero
    }

    /// Holds a drive for one sampling interval.
    #[inline]
    pub(super) fn hold(&mut self, drive: f64) {
        self.follower.hold(drive / self.terms.half_range);
    }

    /// The drive has been held since forever.
    pub(super) fn settle(&mut self, drive: f64) {
        self.follower.settle(drive / self.terms.half_range);
    }

    /// m and f.
    pub(super) fn states(&self) -> Vec<f64> {
        vec![self.follower.mean_square(), self.follower.place()]
    }

    /// A state that there can be: of m, which comes first.
    pub(super) fn check(name: &'static str, place: usize, mean_square: f64) -> Result<(), Error> {
        check_between(name, Some(place), mean_square, (0.0, 1.0)).map(drop)
    }

    /// Continues from a state that was checked.
    pub(super) fn restore(&mut self, mean_square: f64, follower: f64) {
        self.follower.restore(mean_square, follower);
    }
}
