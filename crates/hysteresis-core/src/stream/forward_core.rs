//! The forward direction of a stream, whatever its numbers are and wherever its memory lies.

use super::segment::Segment;
use super::walk::Walk;
#[cfg(feature = "alloc")]
use super::walk::behind;
#[cfg(feature = "alloc")]
use crate::engine::{HeapMemory, Method};
use crate::engine::{Memory, Piece, Point};
#[cfg(feature = "alloc")]
use crate::error::{Error, check_length};
use crate::real::Real;

/// A model, sample by sample.
#[derive(Clone, Debug)]
pub(crate) struct ForwardCore<T, M> {
    segment: Segment<T>,
    /// The offsets of the model.
    pub(super) origin: Point<T>,
    pub(super) memory: M,
    pub(super) rejected: u64,
}

impl<T: Real, M: Memory<T>> ForwardCore<T, M> {
    pub(crate) fn new(memory: M, origin: Point<T>) -> Self {
        let nowhere = Segment::point(T::ZERO, T::ZERO);
        let mut stream = Self { segment: nowhere, origin, memory, rejected: 0 };
        stream.enter_segment(T::ZERO);
        stream
    }

    #[inline]
    pub(crate) fn peek(&self, input: T) -> T {
        let x = input - self.origin.input;
        let y = match self.segment.peek(x) {
            Some(y) => y,
            None if input.is_admissible() => self.memory.peek_input(self.segment.input(), x),
            None => self.segment.output(),
        };
        y + self.origin.output
    }

    pub(crate) fn reset(&mut self) {
        self.memory.reset();
        self.enter_segment(T::ZERO);
        self.rejected = 0;
    }

    /// The segment at the input to which the memory has come.
    pub(super) fn enter_segment(&mut self, x: T) {
        self.draw_segment(x, self.memory.forward_piece(x), self.memory.back());
    }

    /// The segment of a piece that may hold behind the input too.
    #[inline(always)]
    fn draw_segment(&mut self, x: T, piece: Piece<T>, back: Option<T>) {
        self.segment = Segment::new(piece, x, self.origin.input);
        if let Some(back) = back {
            self.segment.open(back, self.origin.input);
        }
    }

    /// Moves to an input that is not on the segment: the output there.
    #[inline(never)]
    fn move_on(&mut self, x: T) -> T {
        let step_back = self.segment.lies_behind(x);
        let (piece, back) = self.memory.move_on(self.segment.input(), x, step_back);
        self.draw_segment(x, piece, back);
        self.segment.output()
    }

    /// [`move_on`](Self::move_on) of a memory that may jump.
    #[inline(never)]
    fn jump(&mut self, x: T) -> T {
        let jump = self.memory.leap(x);
        let Some(y) = jump.or_else(|| self.memory.jump(self.segment.input(), x)) else { return self.move_on(x) };
        self.segment = Segment::point(x, y);
        y
    }

    /// The last input and output, relative to the offsets.
    #[cfg(feature = "alloc")]
    pub(super) fn known(&self) -> Point<T> {
        Point { input: self.segment.input(), output: self.segment.output() }
    }

    pub(crate) fn output(&self) -> T {
        self.segment.output() + self.origin.output
    }

    pub(crate) fn memory(&self) -> &M {
        &self.memory
    }

    pub(crate) fn rejected(&self) -> u64 {
        self.rejected
    }
}

#[cfg(feature = "alloc")]
impl ForwardCore<f64, HeapMemory> {
    /// [`run`](Walk::run); as long as a bank draws no lines to walk along, it has a loop of its own.
    pub(super) fn run_by_method(&mut self, mut samples: &[f64], mut outputs: &mut [f64]) -> Result<(), Error> {
        if self.memory.method() == Method::TurningPoints {
            return self.run(samples, outputs);
        }
        check_length("output", samples.len(), outputs.len())?;
        while !samples.is_empty() {
            let taken = match self.run_without_line(samples, outputs) {
                0 => self.run_on_lines(samples, outputs, true),
                taken => taken,
            };
            (samples, outputs) = behind(taken, samples, outputs);
        }
        Ok(())
    }

    /// Takes samples as long as a bank, led by an input, has drawn no line and none is to be drawn: how many.
    #[inline]
    fn run_without_line(&mut self, samples: &[f64], outputs: &mut [f64]) -> usize {
        let HeapMemory::Bank(bank) = &mut self.memory else { return 0 };
        let Some(taken) = bank.run(samples, outputs, self.origin) else { return 0 };
        self.rejected = self.rejected.saturating_add(taken.rejected);
        let Point { input, output } = bank.now();
        self.segment = Segment::point(input, output);
        taken.samples
    }
}

impl<T: Real, M: Memory<T>> Walk<T> for ForwardCore<T, M> {
    #[inline(always)]
    fn segment(&mut self) -> &mut Segment<T> {
        &mut self.segment
    }

    #[inline(always)]
    fn relative(&self, input: T) -> T {
        input - self.origin.input
    }

    #[inline(always)]
    fn finished(&self, y: T) -> T {
        y + self.origin.output
    }

    #[cold]
    #[inline(never)]
    fn leave_segment(&mut self, input: T, x: T) -> T {
        if !input.is_admissible() {
            self.rejected = self.rejected.saturating_add(1);
            return self.segment.output();
        }
        // Each way keeps its own registers, and neither waits for what the other needs.
        if self.memory.may_jump() { self.jump(x) } else { self.move_on(x) }
    }
}
