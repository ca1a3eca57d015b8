//! The mixed signal, in arithmetic that every language does alike: integers, and products and sums of numbers.

/// Samples of one kind in a row.
const SEGMENT: u64 = 1000;

/// Smooth, noise, jumps, beyond every limit, and not finite, by turns: numbers of about 1 in magnitude.
///
/// ```
/// let first: Vec<f64> = same_bits::Mixed::new(1).take(3).collect();
/// assert_eq!(first, [-1.0, -0.998, -0.996]);
/// ```
#[derive(Clone, Debug)]
pub struct Mixed {
    /// xorshift64*: Vigna, ACM Trans. Math. Softw. 42(4), 2016.
    random: u64,
    k: u64,
    level: f64,
}

impl Mixed {
    /// The signal of a seed, which is not 0.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { random: seed, k: 0, level: 0.0 }
    }

    /// Evenly between -1 and 1, a multiple of 2^-52.
    fn noise(&mut self) -> f64 {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        #[expect(clippy::cast_precision_loss, reason = "53 bits")]
        let whole = (self.random.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64;
        whole / 4_503_599_627_370_496.0 - 1.0
    }
}

impl Iterator for Mixed {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let (k, noise) = (self.k, self.noise());
        self.k += 1;
        if k % 50 == 0 {
            self.level = noise;
        }
        let phase = k % 2000;
        #[expect(clippy::cast_precision_loss, reason = "at most 1000")]
        let triangle = phase.min(2000 - phase) as f64 / 500.0 - 1.0;
        Some(match k / SEGMENT % 5 {
            0 => triangle,
            1 => noise,
            2 => self.level,
            3 => 2.0 * triangle,
            _ if k % 7 == 0 => f64::NAN,
            _ if k % 11 == 0 => f64::INFINITY,
            _ if k % 13 == 0 => -1e200,
            _ => triangle,
        })
    }
}
