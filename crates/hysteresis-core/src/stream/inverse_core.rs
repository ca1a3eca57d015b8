//! The inverse direction of a stream, whatever its numbers are and wherever its memory lies.

use super::segment::{BLOCK, Segment};
use super::walk::Walk;
use crate::engine::{Direction, Memory, Piece, Point, Reach};
use crate::error::{Error, check_within_limits};
use crate::real::Real;

/// The exact inverse of a model, sample by sample.
#[derive(Clone, Debug)]
pub(crate) struct InverseCore<T, M> {
    segment: Segment<T>,
    /// The offsets of the model.
    pub(super) origin: Point<T>,
    limits: (T, T),
    /// The limits relative to the input offset, as the memory counts inputs.
    pub(super) reach: (T, T),
    pub(super) memory: M,
    pub(super) saturated: bool,
    pub(super) rejected: u64,
}

/// Where a target would bring an inverse.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "alloc"), expect(dead_code, reason = "controllers of arrays ask for all of it"))]
pub(crate) struct Look<T = f64> {
    pub(crate) drive: T,
    /// The output of the model there.
    pub(crate) reached: T,
    /// Whether the target is out of reach.
    pub(crate) saturated: bool,
}

/// Limits of a drive that has none.
pub(crate) fn unlimited<T: Real>() -> (T, T) {
    (-T::MAX_MAGNITUDE, T::MAX_MAGNITUDE)
}

impl<T: Real, M: Memory<T>> InverseCore<T, M> {
    /// At rest, or at the limit that is nearest; limits and memory were checked.
    pub(crate) fn new(memory: M, origin: Point<T>, limits: (T, T)) -> Self {
        let reach = (limits.0 - origin.input, limits.1 - origin.input);
        let nowhere = Segment::point(T::ZERO, T::ZERO);
        let mut stream = Self { segment: nowhere, origin, limits, reach, memory, saturated: false, rejected: 0 };
        stream.reset();
        stream
    }

    pub(crate) fn reset(&mut self) {
        self.memory.reset();
        let (low, high) = self.reach;
        let start = T::ZERO.max(low).min(high);
        let output = if start == T::ZERO {
            self.memory.output(T::ZERO)
        } else {
            self.memory.move_input(T::ZERO, start);
            self.memory.output(start)
        };
        self.saturated = false;
        self.rejected = 0;
        self.enter_segment(start, output);
    }

    /// The segment at a place of the memory.
    pub(super) fn enter_segment(&mut self, input: T, output: T) {
        self.draw_segment(input, output);
        self.open_segment(input, self.memory.back());
    }

    /// The segment ahead of a place of the memory. Where the line misses the place, by rounding at a kink or at a limit, the
    /// segment is a point, so that the next sample starts from exactly there; and where the target was out of reach, so that the
    /// next one decides anew.
    #[inline(always)]
    fn draw_segment(&mut self, input: T, output: T) {
        let piece = self.memory.inverse_piece(input, output, self.reach);
        self.segment = Segment::new(piece, output, self.origin.output);
        if self.saturated || self.segment.output() != input {
            self.stay_at(piece.direction, input, output);
        }
    }

    /// Lets the segment hold behind the place too, down to the input `back` and within the limits.
    #[inline]
    fn open_segment(&mut self, input: T, back: Option<T>) {
        if let Some(back) = back {
            let Piece { direction, line, .. } = self.memory.forward_piece(input);
            let back = line.at(direction.further(back, direction.reversed().limit(self.reach)));
            self.segment.open(back, self.origin.output);
        }
    }

    #[cold]
    #[inline(never)]
    fn stay_at(&mut self, direction: Direction, input: T, output: T) {
        self.segment = Segment::new(Piece::point(direction, output, input), output, self.origin.output);
    }

    /// Stays where it is, to be found there exactly: a search would come back to within a rounding.
    #[cold]
    #[inline(never)]
    fn stay(&mut self) {
        self.saturated = false;
        let here = self.known();
        self.enter_segment(here.input, here.output);
    }

    /// Where the memory is: its input, the drive, and its output, the target.
    #[inline]
    pub(super) fn known(&self) -> Point<T> {
        Point { input: self.segment.output(), output: self.segment.input() }
    }

    /// Whether the output `y` is the present one, and the memory has come to the drive.
    fn is_at(&self, y: T) -> bool {
        y == self.segment.input() && self.memory.is_at(self.segment.output())
    }

    /// The input that the memory has come to, as a drive: at a limit of the reach the very limit, never beyond.
    ///
    /// Nor is an input within the reach beyond a limit, however sums are rounded: the reach is the number nearest to what brings the
    /// sum to the limit, so the next number within it brings the sum there at most.
    #[inline]
    fn drive(&self, x: T) -> T {
        if x >= self.reach.1 {
            self.limits.1
        } else if x <= self.reach.0 {
            self.limits.0
        } else {
            x + self.origin.input
        }
    }

    #[inline]
    pub(crate) fn output(&self) -> T {
        self.drive(self.segment.output())
    }

    #[inline]
    pub(crate) fn reached(&self) -> T {
        self.segment.input() + self.origin.output
    }

    pub(crate) fn saturated(&self) -> bool {
        self.saturated
    }

    pub(crate) fn limits(&self) -> Option<(T, T)> {
        (self.limits != unlimited()).then_some(self.limits)
    }

    pub(crate) fn rejected(&self) -> u64 {
        self.rejected
    }

    pub(crate) fn memory(&self) -> &M {
        &self.memory
    }

    /// Where [`step`](Self::step) would come to.
    #[inline]
    pub(crate) fn look(&self, target: T) -> Look<T> {
        let y = target - self.origin.output;
        let Point { input: here, output } = self.known();
        let reach = match self.segment.peek(y) {
            Some(input) => Reach { input, output: y, saturated: false },
            None if self.is_at(y) => Reach { input: here, output, saturated: false },
            None if target.is_admissible() => {
                self.memory.peek_output(self.segment.direction_to(y), self.known(), y, self.reach)
            }
            None => Reach { input: here, output, saturated: self.saturated },
        };
        let Reach { input, output, saturated } = reach;
        Look { drive: self.drive(input), reached: output + self.origin.output, saturated }
    }

    /// The output of the model that [`follow_drive`](Self::follow_drive) would return.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn look_at_drive(&self, drive: T) -> T {
        if !drive.is_admissible() {
            return self.reached();
        }
        self.memory.peek_input(self.segment.output(), self.input_at(drive)) + self.origin.output
    }

    /// A drive, kept within the limits, as the memory counts inputs.
    #[inline]
    fn input_at(&self, drive: T) -> T {
        let within = drive.max(self.limits.0).min(self.limits.1);
        (within - self.origin.input).max(self.reach.0).min(self.reach.1)
    }

    /// Remembers another drive than the one that a target asks for, and returns the output of the model there.
    #[inline]
    pub(crate) fn follow_drive(&mut self, drive: T) -> T {
        if drive.is_admissible() {
            let x = self.input_at(drive);
            self.memory.move_input(self.segment.output(), x);
            self.saturated = false;
            self.enter_segment(x, self.memory.output(x));
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.reached()
    }

    /// Takes over drives, oldest first, if all are within the limits.
    pub(crate) fn follow(&mut self, drives: &[T]) -> Result<(), Error> {
        check_within_limits("drives", drives, self.limits)?;
        for drive in drives {
            self.follow_drive(*drive);
        }
        Ok(())
    }
}

impl<T: Real, M: Memory<T>> Walk<T> for InverseCore<T, M> {
    #[inline(always)]
    fn segment(&mut self) -> &mut Segment<T> {
        &mut self.segment
    }

    #[inline(always)]
    fn relative(&self, target: T) -> T {
        target - self.origin.output
    }

    #[inline(always)]
    fn finished(&self, x: T) -> T {
        self.drive(x)
    }

    /// As vectors where no limit is near.
    #[inline(always)]
    fn finished_block(&self, inputs: [T; BLOCK]) -> [T; BLOCK] {
        let least = one_of(inputs, |a, b| if a < b { a } else { b });
        let most = one_of(inputs, |a, b| if a > b { a } else { b });
        if least > self.reach.0 && most < self.reach.1 {
            inputs.map(|x| x + self.origin.input)
        } else {
            inputs.map(|x| self.drive(x))
        }
    }

    #[cold]
    #[inline(never)]
    fn leave_segment(&mut self, target: T, y: T) -> T {
        if self.is_at(y) {
            self.stay();
        } else if target.is_admissible() {
            let step_back = self.segment.lies_behind(y);
            let reached = self.memory.move_output(self.segment.direction_to(y), self.known(), y, self.reach);
            self.saturated = reached.saturated;
            self.draw_segment(reached.input, reached.output);
            self.open_segment(reached.input, self.memory.back_after(step_back));
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.segment.output()
    }
}

/// The one of a block that is chosen from any two, by halves, as vectors are compared.
#[inline(always)]
fn one_of<T: Real>(block: [T; BLOCK], chosen: impl Fn(T, T) -> T) -> T {
    let [a, b, c, d, e, f, g, h] = block;
    let [a, b, c, d] = [chosen(a, e), chosen(b, f), chosen(c, g), chosen(d, h)];
    let [a, b] = [chosen(a, c), chosen(b, d)];
    chosen(a, b)
}
