//! A number that tells sets of parameters apart, so that a saved state is not restored into another model.

/// FNV-1a over the bits of numbers: no protection against intent, but against mistakes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fingerprint(u64);

const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Self(OFFSET)
    }

    /// Goes on where another fingerprint ended.
    pub(crate) fn continued(from: u64) -> Self {
        Self(from)
    }

    /// Takes in how many numbers follow, and the numbers: so [1], [2, 3] differs from [1, 2], [3].
    pub(crate) fn numbers(&mut self, values: &[f64]) {
        self.count(values.len());
        for value in values {
            // Zero and minus zero are one parameter.
            self.word((value + 0.0).to_bits());
        }
    }

    pub(crate) fn count(&mut self, count: usize) {
        self.word(count as u64);
    }

    fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(PRIME);
        }
    }

    /// The number, of 53 bits: JSON readers of every language keep it.
    pub(crate) fn finish(self) -> u64 {
        (self.0 ^ (self.0 >> 53)) & ((1 << 53) - 1)
    }
}
