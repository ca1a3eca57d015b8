//! A number by which a saved state knows its model.

/// A number that tells sets of parameters apart, so that a saved state is not restored into another model.
///
/// FNV-1a over the bits of numbers: no protection against intent, but against mistakes.
///
/// ```
/// use hysteresis_core::Fingerprint;
/// let of = |parts: &[&[f64]]| {
///     let mut fingerprint = Fingerprint::new();
///     parts.iter().for_each(|part| fingerprint.numbers(part));
///     fingerprint.finish()
/// };
/// assert_eq!(of(&[&[1.0, -0.0]]), of(&[&[1.0, 0.0]]));
/// assert_ne!(of(&[&[1.0], &[2.0, 3.0]]), of(&[&[1.0, 2.0], &[3.0]]));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Fingerprint(u64);

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

impl Default for Fingerprint {
    fn default() -> Self {
        Self::new()
    }
}

impl Fingerprint {
    /// Of no numbers yet.
    #[must_use]
    pub fn new() -> Self {
        Self(OFFSET)
    }

    /// Goes on where another fingerprint ended.
    #[must_use]
    pub fn continued(from: u64) -> Self {
        Self(from)
    }

    /// Takes in how many numbers follow, and the numbers: so the parts (1), (2, 3) differ from (1, 2), (3).
    pub fn numbers(&mut self, values: &[f64]) {
        self.count(values.len());
        for value in values {
            // Zero and minus zero are one parameter.
            self.word((value + 0.0).to_bits());
        }
    }

    /// Takes in a count.
    pub fn count(&mut self, count: usize) {
        self.word(count as u64);
    }

    fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(PRIME);
        }
    }

    /// The number, of 53 bits: JSON readers of every language keep it.
    #[must_use]
    pub fn finish(self) -> u64 {
        (self.0 ^ (self.0 >> 53)) & ((1 << 53) - 1)
    }
}
