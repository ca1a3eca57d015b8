//! A converter between numbers and codes.

use hysteresis_core::{Bound, Error, MAX_MAGNITUDE};

/// Converters with more bits than this do not exist, and their steps would meet the rounding of a double.
const MAX_BITS: u32 = 32;

/// A D/A or A/D converter: the nearest of 2^bits equally spaced levels from `low` to `high`, both included.
///
/// q = (high - low) / (2^bits - 1), output low + q round((x - low) / q) for x clamped to low..high: never further from
/// the clamped x than q / 2 (but for rounding), monotone, and a level is its own output. Half-way between two levels
/// the upper one is taken. Over limits that are symmetric about zero, the levels next to zero are +-q / 2.
///
/// ```
/// use hysteresis_simulate::plant::Quantiser;
/// let converter = Quantiser::new(2, (-3.0, 3.0))?;
/// assert_eq!([-9.0, -1.5, 0.2, 9.0].map(|x| converter.level(x)), [-3.0, -1.0, 1.0, 3.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantiser {
    bits: u32,
    low: f64,
    high: f64,
    /// 2^bits - 1.
    intervals: f64,
    step: f64,
}

impl Quantiser {
    /// A converter of so many bits over the range (low, high).
    ///
    /// # Errors
    /// [`Error::Domain`] unless there are 1 to 32 bits, the range is finite, and low lies below high by so much that
    /// doubles tell the levels apart.
    pub fn new(bits: u32, range: (f64, f64)) -> Result<Self, Error> {
        Self::named(["bits", "range"], bits, range)
    }

    /// [`new`](Self::new), with the names that errors give to its arguments.
    pub(super) fn named(names: [&'static str; 2], bits: u32, range: (f64, f64)) -> Result<Self, Error> {
        let (low, high) = check_range(names[1], range)?;
        // Steps of four spacings of doubles: a level is then found again from its own rounded value.
        let most = ((high - low) / (4.0 * f64::EPSILON * low.abs().max(high.abs()))).log2().floor();
        if most < 1.0 {
            let expected = Bound::Above { what: "the low end by enough for two levels", limit: low };
            return Err(Error::Domain { parameter: names[1], index: Some(1), expected, got: high });
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 32")]
        let most = most.min(f64::from(MAX_BITS)) as u32;
        if !(1..=most).contains(&bits) {
            let (expected, got) = (Bound::FromTo { first: 1, last: most as usize }, u64::from(bits));
            return Err(Error::Whole { parameter: names[0], index: None, expected, got });
        }
        let intervals = f64::from(u32::MAX >> (MAX_BITS - bits));
        Ok(Self { bits, low, high, intervals, step: (high - low) / intervals })
    }

    /// The number of bits.
    #[must_use]
    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// The lowest and the highest level.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// q, the distance between two levels.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.step
    }

    /// The level for a number.
    #[inline]
    #[must_use]
    pub fn level(&self, value: f64) -> f64 {
        // Not clamp: its assertion on the range is a panic that the optimiser cannot see is never reached.
        let within = value.max(self.low).min(self.high);
        let code = ((within - self.low) / self.step + 0.5).floor();
        // The highest level, too, without a rounding.
        if code < self.intervals { self.low + code * self.step } else { self.high }
    }
}

/// The range, if both ends are finite and the low one is below the high one.
pub(crate) fn check_range(parameter: &'static str, (low, high): (f64, f64)) -> Result<(f64, f64), Error> {
    for (index, got) in [low, high].into_iter().enumerate() {
        if got.abs().partial_cmp(&MAX_MAGNITUDE).is_none_or(core::cmp::Ordering::is_gt) {
            return Err(Error::Domain { parameter, index: Some(index), expected: Bound::Finite, got });
        }
    }
    if low < high {
        Ok((low, high))
    } else {
        let expected = Bound::Above { what: "the low end", limit: low };
        Err(Error::Domain { parameter, index: Some(1), expected, got: high })
    }
}
