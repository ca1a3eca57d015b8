//! A falling input is a rising one in the mirror: x, z and their thresholds change sides.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::vectors::Vectors;
use super::block::{Block, Thresholds};

/// The side from which a bank is seen.
pub(super) trait Side: Copy {
    /// A number, seen or seen back.
    fn turned(self, number: f64) -> f64;

    /// Numbers, seen or seen back.
    fn seen<V: Vectors>(self, v: V, numbers: V::Numbers) -> V::Numbers;

    /// What is there for a rising input and for a falling one: of this side, and of the opposite one.
    fn sides<T>(self, both: &[T; 2]) -> (&T, &T);

    /// The thresholds of the bound behind the input.
    #[inline(always)]
    fn thresholds<L>(self, block: &Block<L>) -> &Thresholds<L> {
        self.sides(&block.thresholds).0
    }

    /// Those of the opposite bound, as they are seen from there.
    #[inline(always)]
    fn opposite_thresholds<L>(self, block: &Block<L>) -> &Thresholds<L> {
        self.sides(&block.thresholds).1
    }

    /// The weights above zero and below.
    #[inline(always)]
    fn weights<L>(self, block: &Block<L>) -> (&L, &L) {
        self.sides(&block.weights)
    }
}

/// The input rises.
#[derive(Clone, Copy)]
pub(super) struct Rising;

impl Side for Rising {
    #[inline(always)]
    fn turned(self, number: f64) -> f64 {
        number
    }

    #[inline(always)]
    fn seen<V: Vectors>(self, _: V, numbers: V::Numbers) -> V::Numbers {
        numbers
    }

    #[inline(always)]
    fn sides<T>(self, [rising, falling]: &[T; 2]) -> (&T, &T) {
        (rising, falling)
    }
}

/// The input falls.
#[derive(Clone, Copy)]
pub(super) struct Falling;

impl Side for Falling {
    #[inline(always)]
    fn turned(self, number: f64) -> f64 {
        -number
    }

    #[inline(always)]
    fn seen<V: Vectors>(self, v: V, numbers: V::Numbers) -> V::Numbers {
        v.turned(numbers, v.splat(-0.0))
    }

    #[inline(always)]
    fn sides<T>(self, [rising, falling]: &[T; 2]) -> (&T, &T) {
        (falling, rising)
    }
}

/// The input goes either way: no branch hangs on it, as a processor cannot guess the way of a drive that jumps.
#[derive(Clone, Copy)]
pub(super) struct Unguessed {
    /// -0 if the input falls, else 0.
    signed_zero: f64,
}

impl Unguessed {
    /// Of a move of the input. (A comparison would become a branch.) A move from zero to -0 counts as a fall: it pushes nothing.
    #[inline(always)]
    pub(super) fn of_move(from: f64, to: f64) -> Self {
        Self::of_distance(to - from)
    }

    /// Of a move by so much.
    #[inline(always)]
    pub(super) fn of_distance(distance: f64) -> Self {
        Self { signed_zero: 0.0_f64.copysign(distance) }
    }
}

impl Side for Unguessed {
    #[inline(always)]
    fn turned(self, number: f64) -> f64 {
        f64::from_bits(number.to_bits() ^ self.signed_zero.to_bits())
    }

    #[inline(always)]
    fn seen<V: Vectors>(self, v: V, numbers: V::Numbers) -> V::Numbers {
        v.turned(numbers, v.splat(self.signed_zero))
    }

    #[inline(always)]
    fn sides<T>(self, both: &[T; 2]) -> (&T, &T) {
        let side = usize::from(self.signed_zero.is_sign_negative());
        (&both[side], &both[1 - side])
    }
}
