//! A shift of loops with their amplitude, sample by sample.

use alloc::vec;
use alloc::vec::Vec;

use super::follower::Follower;
use crate::error::{Bound, Error, check_all_finite, check_between, check_finite};
use crate::real::unless_faded;

/// The least and the greatest half range, and the greatest limit: products with admissible drives then stay finite.
const SCALE: (f64, f64) = (1e-50, 1e50);

/// Loop shift at the samples: s(k) = c_1 m(k) + c_2 n(k), added to the position behind the output map.
///
/// Measured on piezo stacks: the centre of a loop moves with its amplitude, or rate. No model of Preisach's class has
/// that. Here it follows from the motion of the drive u:
///
/// ```text
/// x(k) = (u(k) - center) / half_range
/// e(k) = x(k) - f(k), within -limit .. limit      f follows x with the time constant tau / 4
/// m' = (e^2 - m) / tau     n' = (x |e| - n) / tau
/// ```
///
/// The drive is held between samples, so x is constant there and e decays as exp(-4 t / tau). With a = exp(-dt / tau)
/// this is exactly
///
/// ```text
/// m(k+1) = a m(k) + (a - a^8) / 7  e(k)^2
/// n(k+1) = a n(k) + (a - a^4) / 3  x(k) |e(k)|
/// f(k+1) = x(k) - a^4 e(k)
/// ```
///
/// The newest drive enters none of the three before the next sample, so s(k) is known before u(k) is chosen. At rest e,
/// m and n are 0. The follower never stays behind by more than the limit: what was identified at some rates does not
/// grow without bound at higher ones.
///
/// x, e, m and n have no unit. The amplitudes c_1 and c_2 have that of the position.
///
/// ```
/// use hysteresis_core::LoopShiftTerms;
/// let shift = LoopShiftTerms::new(75.0, 75.0, [-3.0, 0.5], 0.2, 0.999)?; // V, V, um
/// assert_eq!((shift.amplitudes(), shift.limit()), ([-3.0, 0.5], 0.2));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopShiftTerms {
    center: f64,
    half_range: f64,
    amplitudes: [f64; 2],
    limit: f64,
    decay: f64,
}

/// m, n and f, and what becomes of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    terms: LoopShiftTerms,
    follower: Follower,
    /// (a - a^4) / 3
    product_gain: f64,
    /// n
    mean_product: f64,
}

impl LoopShiftTerms {
    /// From the drive in the middle of the range and half of that range, the amplitudes c_1 and c_2, the limit of e,
    /// and the decay a from sample to sample.
    ///
    /// # Errors
    /// [`Error::Domain`] for a centre or amplitude that is not finite, a half range outside 1e-50 to 1e50, a limit that
    /// is not above 0 or more than 1e50, or a decay outside 0 to 1.
    pub fn new(center: f64, half_range: f64, amplitudes: [f64; 2], limit: f64, decay: f64) -> Result<Self, Error> {
        check_finite("center", None, center)?;
        for (parameter, got) in [("half_range", half_range), ("limit", limit)] {
            if !(SCALE.0..=SCALE.1).contains(&got) {
                let expected = Bound::Words("a number above 0 (1e-50 to 1e50)");
                return Err(Error::Domain { parameter, index: None, expected, got });
            }
        }
        check_all_finite("amplitudes", &amplitudes)?;
        check_between("decay", None, decay, (0.0, 1.0))?;
        Ok(Self { center, half_range, amplitudes, limit, decay })
    }

    /// The drive in the middle of the range.
    #[must_use]
    pub fn center(&self) -> f64 {
        self.center
    }

    /// Half of the range of drives.
    #[must_use]
    pub fn half_range(&self) -> f64 {
        self.half_range
    }

    /// c_1 and c_2, in the unit of the position.
    #[must_use]
    pub fn amplitudes(&self) -> [f64; 2] {
        self.amplitudes
    }

    /// The largest magnitude of e.
    #[must_use]
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// a.
    #[must_use]
    pub fn decay(&self) -> f64 {
        self.decay
    }

    /// All parameters in one row.
    pub(super) fn numbers(&self) -> [f64; 6] {
        let [square, product] = self.amplitudes;
        [self.center, self.half_range, square, product, self.limit, self.decay]
    }
}

impl Motion {
    /// At rest in the middle of the range.
    pub(super) fn new(terms: &LoopShiftTerms) -> Self {
        let a = terms.decay;
        // As a product, so that no digit is lost where a is nearly 1.
        let product_gain = a * (1.0 - a) * (1.0 + a + a * a) / 3.0;
        Self { terms: *terms, follower: Follower::new(a, terms.limit), product_gain, mean_product: 0.0 }
    }

    /// s: by how much the loop has shifted.
    #[inline]
    pub(super) fn shift(&self) -> f64 {
        let [square, product] = self.terms.amplitudes;
        square * self.follower.mean_square() + product * self.mean_product
    }

    fn scaled(&self, drive: f64) -> f64 {
        (drive - self.terms.center) / self.terms.half_range
    }

    /// Holds a drive for one sampling interval.
    #[inline]
    pub(super) fn hold(&mut self, drive: f64) {
        let x = self.scaled(drive);
        let behind = self.follower.hold(x);
        self.mean_product = self.terms.decay * self.mean_product + self.product_gain * (x * behind.abs());
        if behind == 0.0 {
            self.mean_product = unless_faded(self.mean_product);
        }
    }

    /// The drive has been held since forever.
    pub(super) fn settle(&mut self, drive: f64) {
        self.follower.settle(self.scaled(drive));
        self.mean_product = 0.0;
    }

    /// m, n and f.
    pub(super) fn states(&self) -> Vec<f64> {
        vec![self.follower.mean_square(), self.mean_product, self.follower.place()]
    }

    /// Continues from a state that was checked.
    pub(super) fn restore(&mut self, [mean_square, mean_product, follower]: [f64; 3]) {
        self.follower.restore(mean_square, follower);
        self.mean_product = mean_product;
    }
}
