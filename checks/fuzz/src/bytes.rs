//! Bytes as choices and numbers.

use arbitrary::Unstructured;

/// The bytes of an input, read from the front.
#[derive(Debug)]
pub(crate) struct Bytes<'a> {
    rest: Unstructured<'a>,
}

impl<'a> Bytes<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self { rest: Unstructured::new(data) }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// The next byte; 0 past the end.
    pub(crate) fn byte(&mut self) -> u8 {
        self.rest.arbitrary().unwrap_or(0)
    }

    /// One of `choices` cases.
    pub(crate) fn below(&mut self, choices: u8) -> u8 {
        self.byte() % choices
    }

    pub(crate) fn coin(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// What follows, up to `most` bytes.
    pub(crate) fn some(&mut self, most: usize) -> &'a [u8] {
        let size = most.min(self.rest.len());
        self.rest.bytes(size).unwrap_or_default()
    }

    /// Mostly a number from -1 to 1 times `scale`, sometimes one that no sensor should show, or any bits.
    pub(crate) fn number(&mut self, scale: f64) -> f64 {
        let what = self.byte();
        let bits: u64 = if what == 0 { self.rest.arbitrary().unwrap_or(0) } else { 0 };
        let share: i16 = if what >= 16 { self.rest.arbitrary().unwrap_or(0) } else { 0 };
        match what {
            0 => f64::from_bits(bits),
            1 => f64::NAN,
            2 => f64::INFINITY,
            3 => f64::NEG_INFINITY,
            4 => 1e100,
            5 => -1e100,
            6 => f64::MAX,
            7 => f64::MIN,
            8 => f64::MIN_POSITIVE,
            9 => 5e-324,
            10 => -0.0,
            11 => 0.0,
            12 => scale,
            13 => -scale,
            14 => 100.0 * scale,
            15 => -100.0 * scale,
            _ => scale * f64::from(share) / f64::from(i16::MAX),
        }
    }

    /// Mostly a number from 10^low to 10^high, sometimes a bad one.
    pub(crate) fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        let what = self.byte();
        if what < 8 {
            return self.number(1.0);
        }
        10_f64.powf(low + (high - low) * f64::from(what - 8) / 247.0)
    }

    /// Up to fifteen numbers.
    pub(crate) fn numbers(&mut self, scale: f64) -> Vec<f64> {
        let count = self.below(16);
        (0..count).map(|_| self.number(scale)).collect()
    }
}
