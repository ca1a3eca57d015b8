//! Four numbers at once, by any instructions.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::array;

use super::{PARTIAL_SUMS, VectorLoop, Vectors, smallest};

type Lanes = [f64; 4];
type Mask = [bool; 4];

/// Plain arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

impl Vectors for Portable {
    type Lanes = Lanes;
    type Numbers = Lanes;
    type Mask = Mask;
    type Sum = Lanes;

    #[inline(always)]
    fn load(self, lanes: &Lanes) -> Lanes {
        *lanes
    }

    #[inline(always)]
    fn store(self, numbers: Lanes) -> Lanes {
        numbers
    }

    #[inline(always)]
    fn splat(self, number: f64) -> Lanes {
        [number; 4]
    }

    #[inline(always)]
    fn sub(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn add(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn product(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn signed_sub(self, a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        array::from_fn(|i| a[i] * b[i] - c[i])
    }

    #[inline(always)]
    fn min(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn max(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn is_below(self, a: Lanes, b: Lanes) -> Mask {
        array::from_fn(|i| a[i] < b[i])
    }

    #[inline(always)]
    fn is_at_most(self, a: Lanes, b: Lanes) -> Mask {
        array::from_fn(|i| a[i] <= b[i])
    }

    #[inline(always)]
    fn and(self, a: Mask, b: Mask) -> Mask {
        array::from_fn(|i| a[i] & b[i])
    }

    #[inline(always)]
    fn or(self, a: Mask, b: Mask) -> Mask {
        array::from_fn(|i| a[i] | b[i])
    }

    #[inline(always)]
    fn select(self, mask: Mask, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| if mask[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn turned(self, numbers: Lanes, signs: Lanes) -> Lanes {
        array::from_fn(|i| f64::from_bits(numbers[i].to_bits() ^ signs[i].to_bits()))
    }

    #[inline(always)]
    fn nothing(self) -> Lanes {
        self.splat(0.0)
    }

    #[inline(always)]
    fn sum(self, sum: Lanes, numbers: Lanes) -> Lanes {
        self.add(sum, numbers)
    }

    #[inline(always)]
    fn partial_sums(self, sum: Lanes) -> [f64; PARTIAL_SUMS] {
        sum
    }

    #[inline(always)]
    fn smallest(self, numbers: Lanes) -> f64 {
        smallest(numbers)
    }

    /// Out of line: where wider vectors are at hand, what calls this stays short.
    #[inline(never)]
    fn compiled<L: VectorLoop<Self>>(self, work: L) -> L::Output {
        work.run(self)
    }
}
