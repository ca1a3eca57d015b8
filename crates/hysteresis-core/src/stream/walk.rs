//! How a stream walks along its polyline, forward or inverse, whatever its numbers are and wherever its memory lies:
//! one sample at a time, or in blocks.
//!
//! A sample on the line of the last one is two comparisons and one multiply-add: [`Walk::take`] asks the [`Segment`].
//! One that leaves it moves the [`Memory`] of the stream, in `leave_segment` of [`ForwardCore`] or [`InverseCore`], and
//! draws the next segment.

use crate::engine::{Direction, Line, Memory, Piece, Point, Reach};
#[cfg(feature = "alloc")]
use crate::engine::{HeapMemory, Method};
use crate::error::{Error, check_length};
use crate::real::{Real, check_within_limits, unlimited};

/// How many samples are compared and evaluated as vectors.
const BLOCK: usize = 8;

/// The straight line that a stream is on, and the samples for which it stays on it.
///
/// Where operators slide, those are the samples ahead: a step back is a reversal. Where none does, as right after a
/// reversal, the line holds on both sides, and noise changes nothing that is remembered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment<T> {
    /// Of the direction of travel: times this, inputs grow along the branch.
    sign: T,
    /// The last input, times the sign.
    last: T,
    /// Where the line ends ahead, times the sign.
    end: T,
    /// Where it ends behind, times the sign; infinity as long as a step back leaves it at once.
    back: T,
    line: Line<T>,
}

impl<T: Real> Segment<T> {
    /// The segment at the input `last`, inputs being relative to `origin`. It ends where admissible inputs may end, so
    /// that none beyond is on it: the last one was admissible.
    #[inline]
    pub(super) fn new(piece: Piece<T>, last: T, origin: T) -> Self {
        let sign: T = piece.direction.sign();
        let (last, end, most) = (sign * last, sign * piece.end, surely_admissible(origin));
        let end = if end < most { end } else { most };
        Self { sign, last, end, back: T::INFINITY, line: piece.line }
    }

    /// A place that no sample is on: it begins at infinity, which a processor can predict of any signal, and ends at
    /// the last input.
    #[inline]
    pub(super) fn point(input: T, output: T) -> Self {
        let line = Line { slope: T::ZERO, offset: output };
        Self { sign: T::ONE, last: T::INFINITY, end: input, back: T::INFINITY, line }
    }

    /// Lets the line hold behind `last` too, down to but not including `back`; not where it is at its end. `origin` as
    /// in [`new`](Self::new).
    #[inline]
    fn open(&mut self, back: T, origin: T) {
        if self.last < self.end {
            self.back = (self.sign * back).max(-surely_admissible(origin));
        }
    }

    /// Whether an input that is not on the line lies behind it.
    #[inline(always)]
    fn lies_behind(&self, input: T) -> bool {
        self.sign * input < self.last
    }

    /// The output if the input lies on the line. False for NaN.
    #[inline]
    pub(super) fn peek(&self, input: T) -> Option<T> {
        let ahead = self.sign * input;
        ((ahead >= self.last || ahead > self.back) && ahead < self.end).then(|| self.at(input))
    }

    /// [`peek`](Self::peek), and moves there.
    #[inline]
    pub(super) fn step(&mut self, input: T) -> Option<T> {
        let output = self.peek(input);
        if output.is_some() {
            self.move_to(input);
        }
        output
    }

    /// Moves to an input on the line.
    #[inline(always)]
    pub(super) fn move_to(&mut self, input: T) {
        self.last = self.sign * input;
    }

    /// The output at an input on the line.
    #[inline(always)]
    pub(super) fn at(&self, input: T) -> T {
        self.line.at(input)
    }

    /// Whether all samples of a block surely lie on the line, compared as vectors. `relative` brings a sample to the
    /// origin of the line, and does not fall where that grows.
    #[inline(always)]
    pub(super) fn holds(&self, block: &[T; BLOCK], relative: impl Fn(T) -> T) -> bool {
        let ahead = |sample| self.sign * relative(sample);
        let mut holds = true;
        if self.back < T::INFINITY {
            for sample in block {
                holds &= (ahead(*sample) > self.back) & (ahead(*sample) < self.end);
            }
            return holds;
        }
        if self.sign > T::ZERO {
            for (last, next) in block.iter().zip(&block[1..]) {
                holds &= last <= next;
            }
        } else {
            for (last, next) in block.iter().zip(&block[1..]) {
                holds &= last >= next;
            }
        }
        holds & (ahead(block[0]) >= self.last) & (ahead(block[BLOCK - 1]) < self.end)
    }

    /// The last input.
    #[inline]
    pub(super) fn input(&self) -> T {
        self.sign * if self.last < T::INFINITY { self.last } else { self.end }
    }

    /// The output at the last input.
    #[inline]
    pub(super) fn output(&self) -> T {
        self.line.at(self.input())
    }

    /// The direction in which `input` lies.
    #[inline]
    fn direction_to(&self, input: T) -> Direction {
        let ahead = self.sign * input >= self.last;
        if ahead == (self.sign > T::ZERO) { Direction::Rising } else { Direction::Falling }
    }
}

/// The largest magnitude relative to `origin` up to which every sample is admissible.
#[inline]
fn surely_admissible<T: Real>(origin: T) -> T {
    T::MAX_MAGNITUDE - origin.abs()
}

/// A stream: on a segment, and when it leaves that, on another.
pub(crate) trait Walk<T: Real> {
    fn segment(&mut self) -> &mut Segment<T>;

    /// A sample relative to the origin of the segments. Does not fall where the sample grows.
    fn relative(&self, sample: T) -> T;

    /// What is put out for a value of the segment.
    fn finished(&self, value: T) -> T;

    /// [`finished`](Self::finished) for every value of a block.
    #[inline(always)]
    fn finished_block(&self, values: [T; BLOCK]) -> [T; BLOCK] {
        values.map(|value| self.finished(value))
    }

    /// Takes a sample that does not lie on the segment, with what it is relative to the origin; the value of the next
    /// segment there.
    fn leave_segment(&mut self, sample: T, relative: T) -> T;

    #[inline]
    fn step(&mut self, sample: T) -> T {
        self.take(sample).0
    }

    /// [`step`](Self::step) if the sample lies on the segment.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    fn step_on_line(&mut self, sample: T) -> Option<T> {
        let relative = self.relative(sample);
        let value = self.segment().step(relative)?;
        Some(self.finished(value))
    }

    /// [`step`](Self::step), and whether the sample lay on the segment.
    #[inline(always)]
    fn take(&mut self, sample: T) -> (T, bool) {
        let relative = self.relative(sample);
        let on_line = self.segment().step(relative);
        let value = on_line.unwrap_or_else(|| self.leave_segment(sample, relative));
        (self.finished(value), on_line.is_some())
    }

    /// [`step`](Self::step) for every sample.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is room for as many outputs; nothing is taken then.
    fn run(&mut self, mut samples: &[T], mut outputs: &mut [T]) -> Result<(), Error> {
        check_length("output", samples.len(), outputs.len())?;
        while !samples.is_empty() {
            let taken = self.run_on_lines(samples, outputs, false);
            (samples, outputs) = behind(taken, samples, outputs);
        }
        Ok(())
    }

    /// Takes the samples on the segment, and some of those behind them: how many. After a long line, or if
    /// `only_to_the_next`, none behind the first that leaves it.
    #[inline(always)]
    fn run_on_lines(&mut self, samples: &[T], outputs: &mut [T], only_to_the_next: bool) -> usize {
        let on_line = self.run_on_line(samples, outputs);
        let (samples, outputs) = behind(on_line, samples, outputs);
        on_line + self.run_to_the_next_line(samples, outputs, only_to_the_next || on_line > 0)
    }

    /// Takes the blocks that lie on the segment, as vectors: how many samples that is.
    #[inline(always)]
    fn run_on_line(&mut self, samples: &[T], outputs: &mut [T]) -> usize {
        let mut segment = *self.segment();
        let blocks = samples.as_chunks::<BLOCK>().0;
        let mut on_line = 0;
        for block in blocks {
            if !segment.holds(block, |sample| self.relative(sample)) {
                break;
            }
            segment.move_to(self.relative(block[BLOCK - 1]));
            on_line += 1;
        }
        let blocks = blocks.get(..on_line).unwrap_or_default();
        for (output, block) in outputs.as_chunks_mut::<BLOCK>().0.iter_mut().zip(blocks) {
            *output = self.finished_block(block.map(|sample| segment.at(self.relative(sample))));
        }
        *self.segment() = segment;
        on_line * BLOCK
    }

    /// Takes samples one by one: how many. After a long line that ends as soon as the next one begins, which is long
    /// too; where lines are shorter than blocks, as in noise, to try again at once would not pay.
    #[inline(always)]
    fn run_to_the_next_line(&mut self, samples: &[T], outputs: &mut [T], after_long_line: bool) -> usize {
        let mut taken = 0;
        let most = if after_long_line { BLOCK } else { 4 * BLOCK };
        for (sample, output) in samples.iter().zip(outputs).take(most) {
            let (value, on_line) = self.take(*sample);
            *output = value;
            taken += 1;
            if after_long_line && !on_line {
                break;
            }
        }
        taken
    }
}

/// What is left behind the first so many: nothing past the end, where an index would panic.
#[inline(always)]
pub(super) fn behind<'a, 'b, T>(taken: usize, samples: &'a [T], outputs: &'b mut [T]) -> (&'a [T], &'b mut [T]) {
    (samples.get(taken..).unwrap_or_default(), outputs.get_mut(taken..).unwrap_or_default())
}

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
#[cfg_attr(not(feature = "alloc"), expect(dead_code, unreachable_pub, reason = "for controllers of arrays"))]
pub struct Look<T = f64> {
    pub(crate) drive: T,
    /// The output of the model there.
    pub(crate) reached: T,
    /// Whether the target is out of reach.
    pub(crate) saturated: bool,
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

    /// The segment ahead of a place of the memory. Where the line misses the place, by rounding at a kink or at a
    /// limit, the segment is a point, so that the next sample starts from exactly there; and where the target was out
    /// of reach, so that the next one decides anew.
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
    /// Nor is an input within the reach beyond a limit, however sums are rounded: the reach is the number nearest to
    /// what brings the sum to the limit, so the next number within it brings the sum there at most.
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
