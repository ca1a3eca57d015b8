//! The memory of one stream: what a stream moves and asks.

use super::polyline::{Direction, Piece, Point, Reach};
use crate::real::Real;

/// A model's parameters together with the memory of one stream.
pub(crate) trait Memory<T: Real> {
    /// Back to the virgin state.
    fn reset(&mut self);

    /// Moves the input from `from` to `to`.
    fn move_input(&mut self, from: T, to: T);

    /// [`move_input`](Self::move_input); the piece over the input there, and [`back_after`](Self::back_after) that
    /// move.
    #[inline(always)]
    fn move_on(&mut self, from: T, to: T, step_back: bool) -> (Piece<T>, Option<T>) {
        self.move_input(from, to);
        (self.forward_piece(to), self.back_after(step_back))
    }

    /// Whether there may be moves after which no line is drawn.
    #[inline(always)]
    fn may_jump(&self) -> bool {
        false
    }

    /// Moves the input if no line is drawn after that move: the output there.
    #[inline(always)]
    fn jump(&mut self, _from: T, _to: T) -> Option<T> {
        None
    }

    /// [`jump`](Self::jump) from where another one led to, if that is far away.
    #[inline(always)]
    fn leap(&mut self, _to: T) -> Option<T> {
        None
    }

    /// The output after a move of the input from `from` to `to`.
    fn peek_input(&self, from: T, to: T) -> T;

    /// Moves on from `from` in `direction` until the output is `to` or the input is at a limit.
    fn move_output(&mut self, direction: Direction, from: Point<T>, to: T, limits: (T, T)) -> Reach<T>;

    /// Where [`move_output`](Self::move_output) would come to.
    fn peek_output(&self, direction: Direction, from: Point<T>, to: T, limits: (T, T)) -> Reach<T>;

    /// Whether a move to the present input `input` changes nothing.
    fn is_at(&self, input: T) -> bool;

    /// The piece over the input at the present position, the input being `input`.
    fn forward_piece(&self, input: T) -> Piece<T>;

    /// The piece over the output at the present position, the output being `output` and the input `input`.
    fn inverse_piece(&self, input: T, output: T, limits: (T, T)) -> Piece<T>;

    /// Where, over the input, the present piece ends behind the present position if it holds on both sides of that. A
    /// move ahead beyond the end of a piece never comes to one that does.
    fn back(&self) -> Option<T>;

    /// [`back`](Self::back) after a move that was a step back or not: nothing after any other.
    #[inline]
    fn back_after(&self, step_back: bool) -> Option<T> {
        if step_back { self.back() } else { None }
    }

    /// The output at the present position, the input being `input`.
    #[inline]
    fn output(&self, input: T) -> T {
        self.forward_piece(input).line.at(input)
    }
}
