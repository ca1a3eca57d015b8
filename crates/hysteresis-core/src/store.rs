//! Where the tables of a model and the turning points of a stream lie.

#[cfg(feature = "alloc")]
use alloc::boxed::Box;
use core::fmt::Debug;

/// Where they lie. As many numbers as are asked for, or as there is room for.
pub trait Store: Clone + Debug {
    /// Numbers, or other plain values, side by side.
    type Of<X: Copy + Debug>: AsRef<[X]> + AsMut<[X]> + Clone + Debug;

    /// At least `count` times the same value, if there is room.
    fn filled<X: Copy + Debug>(value: X, count: usize) -> Self::Of<X>;
}

/// On the heap, allocated once.
#[cfg(feature = "alloc")]
#[derive(Clone, Copy, Debug)]
pub(crate) enum Heap {}

#[cfg(feature = "alloc")]
impl Store for Heap {
    type Of<X: Copy + Debug> = Box<[X]>;

    fn filled<X: Copy + Debug>(value: X, count: usize) -> Box<[X]> {
        alloc::vec![value; count].into()
    }
}

/// Within what holds them, room for `N`.
#[derive(Clone, Copy, Debug)]
pub enum Inline<const N: usize> {}

impl<const N: usize> Store for Inline<N> {
    type Of<X: Copy + Debug> = [X; N];

    fn filled<X: Copy + Debug>(value: X, _count: usize) -> [X; N] {
        [value; N]
    }
}
