//! What stands between a stage and the numbers of its controller: converters, and the noise of a measurement.

use hysteresis_core::{Bound, Error, MAX_MAGNITUDE};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

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

/// White Gaussian noise, the same numbers for the same seed on every machine.
///
/// The generator is xoshiro256++, its state filled from the seed by SplitMix64 (`Xoshiro256PlusPlus::seed_from_u64` of
/// rand_xoshiro), the distribution `StandardNormal` of rand_distr (the ziggurat method). One number per sample, times
/// the rms. These numbers are part of the interface: a release that changes them says so.
#[derive(Clone, Debug)]
pub(super) struct Noise {
    generator: Xoshiro256PlusPlus,
    rms: f64,
    seed: u64,
}

impl Noise {
    pub(super) fn new(rms: f64, seed: u64) -> Self {
        Self { generator: Xoshiro256PlusPlus::seed_from_u64(seed), rms, seed }
    }

    /// The noise of the next sample.
    #[inline]
    pub(super) fn next(&mut self) -> f64 {
        if self.rms == 0.0 {
            return 0.0;
        }
        let normal: f64 = StandardNormal.sample(&mut self.generator);
        self.rms * normal
    }

    /// What makes the numbers to come.
    pub(super) fn generator(&self) -> &Xoshiro256PlusPlus {
        &self.generator
    }

    /// Goes on with these numbers.
    pub(super) fn resume(&mut self, generator: Xoshiro256PlusPlus) {
        self.generator = generator;
    }

    /// Back to the first number.
    pub(super) fn restart(&mut self) {
        *self = Self::new(self.rms, self.seed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published reference implementations (<https://prng.di.unimi.it>), written down again.
    fn xoshiro256plusplus(mut seed: u64) -> impl FnMut() -> u64 {
        let mut split_mix = || {
            seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (seed ^ (seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let mut s = [split_mix(), split_mix(), split_mix(), split_mix()];
        move || {
            let output = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
            let shifted = s[1] << 17;
            s[2] ^= s[0];
            s[3] ^= s[1];
            s[1] ^= s[2];
            s[0] ^= s[3];
            s[2] ^= shifted;
            s[3] = s[3].rotate_left(45);
            output
        }
    }

    #[test]
    fn the_generator_is_the_one_that_is_named() {
        use rand_xoshiro::rand_core::Rng;
        for seed in [0, 1, u64::MAX] {
            let mut noise = Noise::new(1.0, seed);
            let mut reference = xoshiro256plusplus(seed);
            assert!((0..100).all(|_| noise.generator.next_u64() == reference()));
        }
    }

    /// A release of a library must not change the numbers of a seed unnoticed.
    #[test]
    fn a_seed_has_its_numbers() {
        let first = |seed| {
            let mut noise = Noise::new(1.0, seed);
            [noise.next(), noise.next(), noise.next()]
        };
        assert_eq!(first(0), [-0.292_803_298_604_708_16, -0.713_120_616_814_431_5, -0.105_321_160_353_188_6]);
        assert_eq!(first(1), [0.843_998_613_622_176_1, 0.715_560_712_730_593_1, -1.915_871_443_618_758_5]);
    }

    #[test]
    fn it_is_white_and_normal() {
        let count = 100_000_u32;
        let samples: Vec<f64> = {
            let mut noise = Noise::new(2.0, 5);
            (0..count).map(|_| noise.next()).collect()
        };
        let n = f64::from(count);
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / n;
        // Five standard deviations of each estimate: 1/sqrt(n), sqrt(2/n), sqrt(96/n), 1/sqrt(n).
        let scaled = || samples.iter().map(|x| x / 2.0);
        assert!(mean(&mut scaled()).abs() < 5.0 / n.sqrt());
        assert!((mean(&mut scaled().map(|x| x * x)) - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        assert!((mean(&mut scaled().map(|x| x.powi(4))) - 3.0).abs() < 5.0 * (96.0 / n).sqrt());
        for lag in [1, 2, 17] {
            let product = mean(&mut scaled().zip(scaled().skip(lag)).map(|(x, y)| x * y));
            assert!(product.abs() < 5.0 / n.sqrt(), "{lag}: {product}");
        }
    }
}
