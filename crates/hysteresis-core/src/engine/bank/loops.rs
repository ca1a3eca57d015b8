//! The loops over all operators of a bank, as many at once as a vector has numbers, without a branch: a [`Sweep`] takes
//! one sample, a [`Run`] many, a [`Look`] finds the straight line at an input, and [`Find`] the input at which the
//! output is what was asked for.

use core::array;
use core::marker::PhantomData;

use super::super::polyline::{Direction, Line, Path, Piece, Point, Reach, solve};
use super::super::vectors::{Lanes, Vectors};
use super::blocks::{
    BankLoop, Behind, Block, Both, Bounds, Falling, MOVES_BEFORE_A_LINE, Members, Rising, Side, Thresholds, Unguessed,
    Weights,
};
use crate::error::is_admissible;

/// Where a sweep reads the outputs of a block, and puts the next ones if they are kept.
pub(super) trait Slot<L> {
    fn last(&self) -> &L;
    fn keep(self, next: L);
}

impl<L> Slot<L> for &mut L {
    #[inline(always)]
    fn last(&self) -> &L {
        self
    }

    #[inline(always)]
    fn keep(self, next: L) {
        *self = next;
    }
}

impl<L> Slot<L> for &L {
    #[inline(always)]
    fn last(&self) -> &L {
        self
    }

    #[inline(always)]
    fn keep(self, _: L) {}
}

/// The outputs of a bank: where they may be written, the next ones are kept.
pub(super) trait Outputs {
    fn slots<L: Lanes>(self) -> impl Iterator<Item: Slot<L>>;
}

impl Outputs for &mut [f64] {
    #[inline(always)]
    fn slots<L: Lanes>(self) -> impl Iterator<Item: Slot<L>> {
        L::vectors_mut(self).iter_mut()
    }
}

impl Outputs for &[f64] {
    #[inline(always)]
    fn slots<L: Lanes>(self) -> impl Iterator<Item: Slot<L>> {
        L::vectors(self).iter()
    }
}

/// Every operator at the input `x`, coming from `start`: the sum of w_i z_i.
pub(super) struct Sweep<O, S, B> {
    pub(super) outputs: O,
    pub(super) start: S,
    pub(super) bounds: B,
    pub(super) x: f64,
}

impl<O: Outputs, S: Start, B: Bounds> BankLoop for Sweep<O, S, B> {
    type Output = f64;

    /// Each partial sum is made in the order of the model.
    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> f64 {
        let (x, mut sum) = (v.splat(self.x), v.nothing());
        for (block, slot) in blocks.iter().zip(self.outputs.slots::<V::Lanes>()) {
            let z = self.bounds.next(block, v, x, self.start.of(block, v, v.load(slot.last())));
            slot.keep(v.store(z));
            sum = v.sum_product(sum, W::of(block, v, z), z);
        }
        v.total(sum)
    }
}

/// The operators of a block at an input, as they are seen.
pub(super) struct Seen<V: Vectors> {
    last: V::Numbers,
    z: V::Numbers,
    is_below_inner: V::Mask,
    pub(super) slides: V::Mask,
}

impl<V: Vectors> Seen<V> {
    /// Moved to `x` from the output `last`. What slides has come to lo(x) and does not stick at zero.
    #[inline(always)]
    pub(super) fn at(side: impl Side, block: &Block<V::Lanes>, v: V, x: V::Numbers, last: V::Numbers) -> Self {
        let thresholds = side.thresholds(block);
        let (last, least) = (side.seen(v, last), thresholds.least(v, x));
        let is_below_inner = v.is_below(x, v.load(&thresholds.inner));
        let sticks_not = v.or(is_below_inner, v.is_at_most(v.load(&thresholds.outer), x));
        let slides = v.and(v.is_at_most(last, least), sticks_not);
        Self { last, z: v.max(least, last), is_below_inner, slides }
    }

    /// Where lo begins to push the output `z`.
    #[inline(always)]
    fn pushed_from(Thresholds { outer, inner }: &Thresholds<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        v.add(z, v.select(v.is_below(z, v.splat(0.0)), v.load(inner), v.load(outer)))
    }

    /// Its output at the input zero, if it stays on its line.
    #[inline(always)]
    fn offset(&self, Thresholds { outer, inner }: &Thresholds<V::Lanes>, v: V) -> V::Numbers {
        let slid = v.negated(v.select(self.is_below_inner, v.load(inner), v.load(outer)));
        v.select(self.slides, slid, self.z)
    }

    /// Where its line begins, having come from `last`.
    #[inline(always)]
    fn begin(&self, Thresholds { outer, inner }: &Thresholds<V::Lanes>, v: V) -> V::Numbers {
        let (outer, inner, zero) = (v.load(outer), v.load(inner), v.splat(0.0));
        let below = v.select(self.is_below_inner, v.add(self.last, inner), outer);
        let begins = v.select(v.is_below(self.last, zero), below, v.add(self.last, outer));
        let stuck = v.select(v.is_below(self.last, self.z), inner, v.splat(f64::NEG_INFINITY));
        v.select(self.slides, begins, stuck)
    }

    /// Where its line ends ahead: where it is pushed, or sticks at zero.
    #[inline(always)]
    fn end(&self, thresholds: &Thresholds<V::Lanes>, v: V) -> V::Numbers {
        let sticks = v.select(self.is_below_inner, v.load(&thresholds.inner), v.splat(f64::INFINITY));
        v.select(self.slides, sticks, Self::pushed_from(thresholds, v, self.z))
    }

    /// Where its line ends behind: where the opposite bound pushes it, or infinitely far ahead if it slides; of an
    /// identity only where it weighs otherwise.
    #[inline(always)]
    fn back(&self, side: impl Side, block: &Block<V::Lanes>, v: V) -> V::Numbers {
        let opposite = side.opposite_thresholds(block);
        let (inner, outer, zero) = (v.load(&opposite.inner), v.load(&opposite.outer), v.splat(0.0));
        let is_above = v.is_below(zero, self.z);
        let turned = v.select(self.slides, v.splat(f64::INFINITY), v.sub(self.z, v.select(is_above, inner, outer)));
        let weighs_otherwise = v.select(v.is_below(self.z, zero), v.splat(f64::NEG_INFINITY), zero);
        let is_identity = v.is_at_most(v.add(outer, v.load(&side.thresholds(block).outer)), zero);
        v.select(is_identity, weighs_otherwise, turned)
    }
}

/// Where operators come from.
pub(super) trait Start: Copy {
    /// The outputs of the block there, the bank having put out `last`.
    fn of<V: Vectors>(self, block: &Block<V::Lanes>, v: V, last: V::Numbers) -> V::Numbers;
}

/// From the outputs that the bank has.
#[derive(Clone, Copy)]
pub(super) struct Here;

impl Start for Here {
    #[inline(always)]
    fn of<V: Vectors>(self, _: &Block<V::Lanes>, _: V, last: V::Numbers) -> V::Numbers {
        last
    }
}

/// From an input to which the bank has not been moved yet.
#[derive(Clone, Copy)]
pub(super) struct At(pub(super) f64);

impl Start for At {
    #[inline(always)]
    fn of<V: Vectors>(self, block: &Block<V::Lanes>, v: V, last: V::Numbers) -> V::Numbers {
        Both.next(block, v, v.splat(self.0), last)
    }
}

/// The stretch at the input `x`, every operator coming from `start`. It has the same bits wherever on it `x` is.
#[derive(Clone, Copy)]
pub(super) struct Look<'a, O> {
    pub(super) outputs: &'a [f64],
    pub(super) start: O,
    pub(super) direction: Direction,
    pub(super) x: f64,
}

impl<O: Start> BankLoop for Look<'_, O> {
    type Output = Piece;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Piece {
        match self.direction {
            Direction::Rising => self.seen_from::<V, W>(Rising, v, blocks),
            Direction::Falling => self.seen_from::<V, W>(Falling, v, blocks),
        }
    }
}

impl<O: Start> Look<'_, O> {
    #[inline(always)]
    fn seen_from<V: Vectors, W: Weights>(self, side: impl Side, v: V, blocks: &[Block<V::Lanes>]) -> Piece {
        let (x, zero) = (v.splat(side.turned(self.x)), v.splat(0.0));
        let (mut slope, mut offset) = (v.nothing(), v.nothing());
        let (mut begin, mut end) = (v.splat(f64::NEG_INFINITY), v.splat(f64::INFINITY));
        for (block, last) in blocks.iter().zip(V::Lanes::vectors(self.outputs)) {
            let thresholds = side.thresholds(block);
            let seen = Seen::at(side, block, v, x, self.start.of(block, v, v.load(last)));
            let w = W::along(side, block, v, seen.z);
            slope = v.sum(slope, v.select(seen.slides, w, zero));
            offset = v.sum_product(offset, w, seen.offset(thresholds, v));
            begin = v.max(begin, seen.begin(thresholds, v));
            end = v.min(end, seen.end(thresholds, v));
        }
        Piece {
            direction: self.direction,
            line: Line { slope: v.total(slope), offset: side.turned(v.total(offset)) },
            begin: side.turned(v.largest(begin)),
            end: side.turned(v.smallest(end)),
        }
    }
}

/// Where the line at the input `x`, to which the operators have come, ends behind that: infinitely far ahead, if any
/// but an identity slides.
pub(super) struct LookBack<'a> {
    pub(super) outputs: &'a [f64],
    pub(super) direction: Direction,
    pub(super) x: f64,
}

impl BankLoop for LookBack<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> f64 {
        match self.direction {
            Direction::Rising => self.seen_from(Rising, v, blocks),
            Direction::Falling => self.seen_from(Falling, v, blocks),
        }
    }
}

impl LookBack<'_> {
    #[inline(always)]
    fn seen_from<V: Vectors>(self, side: impl Side, v: V, blocks: &[Block<V::Lanes>]) -> f64 {
        let x = v.splat(side.turned(self.x));
        let mut back = v.splat(f64::NEG_INFINITY);
        for (block, z) in blocks.iter().zip(V::Lanes::vectors(self.outputs)) {
            back = v.max(back, Seen::at(side, block, v, x, v.load(z)).back(side, block, v));
        }
        side.turned(v.largest(back))
    }
}

/// A search from `near` on, all of it in one loop for the instructions of the processor: where it comes to, and the
/// last piece that it looked at. `look` is the first look.
pub(super) struct Find<'a, O> {
    pub(super) look: Look<'a, O>,
    pub(super) near: Point,
    pub(super) to: f64,
    pub(super) limit: f64,
}

impl<O: Start> BankLoop for Find<'_, O> {
    type Output = (Reach, Piece);

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> (Reach, Piece) {
        let Self { look, near, to, limit } = self;
        let last = Piece::point(look.direction, near.input, near.output);
        let mut path = Ahead::<_, _, W> { v, blocks, look, last, weights: PhantomData };
        let reach = solve(&mut path, look.direction, near, None, look.x, to, limit);
        (reach, path.last)
    }
}

/// The inputs ahead of where a search began. A look does not move the bank.
struct Ahead<'a, V: Vectors, O, W> {
    v: V,
    blocks: &'a [Block<V::Lanes>],
    look: Look<'a, O>,
    last: Piece,
    weights: PhantomData<W>,
}

impl<V: Vectors, O: Start, W: Weights> Path<f64> for Ahead<'_, V, O, W> {
    type Checkpoint = ();

    #[inline(always)]
    fn checkpoint(&self) {}

    #[inline(always)]
    fn go_back(&mut self, (): ()) {}

    #[inline(always)]
    fn look(&mut self, _: Direction, x: f64) -> Piece {
        self.last = Look { x, ..self.look }.run::<V, W>(self.v, self.blocks);
        self.last
    }
}

/// The line of the output at the input `x` if a move there is the first one, from outputs that no input has led to.
pub(super) struct FirstLine<'a> {
    pub(super) outputs: &'a [f64],
    pub(super) x: f64,
}

impl BankLoop for FirstLine<'_> {
    type Output = Line;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Line {
        let (x, zero) = (v.splat(self.x), v.splat(0.0));
        let (mut output, mut slope) = (v.nothing(), v.nothing());
        for (block, last) in blocks.iter().zip(V::Lanes::vectors(self.outputs)) {
            let last = v.load(last);
            let z = Both.next(block, v, x, last);
            let w = W::of(block, v, z);
            output = v.sum_product(output, w, z);
            let rises = Seen::at(Rising, block, v, x, last).slides;
            let falls = Seen::at(Falling, block, v, v.negated(x), last).slides;
            slope = v.sum(slope, v.select(v.or(rises, falls), w, zero));
        }
        let slope = v.total(slope);
        Line { slope, offset: v.total(output) - slope * self.x }
    }
}

/// How many samples go through a block together: as many as there are registers for.
const TOGETHER: usize = 4;

/// Takes every sample, up to the first admissible one after which a line is to be drawn. Inputs and outputs are
/// relative to `origin`, samples and what is put out are not.
pub(super) struct Run<'a> {
    pub(super) members: &'a Members,
    pub(super) z: &'a mut [f64],
    /// The last input and what the outputs sum to.
    pub(super) input: &'a mut f64,
    pub(super) output: &'a mut f64,
    /// How many moves were small, one after the other.
    pub(super) small_moves: &'a mut u8,
    pub(super) origin: Point,
    pub(super) samples: &'a [f64],
    pub(super) outputs: &'a mut [f64],
}

/// What a run took: how many samples, and how many of them are not admissible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Taken {
    pub(crate) samples: usize,
    pub(crate) rejected: u64,
}

impl BankLoop for Run<'_> {
    type Output = Taken;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Taken {
        let Self { members, z, input, output, small_moves, origin, samples, outputs } = self;
        let taken = Taken { samples: 0, rejected: 0 };
        let mut runner =
            Runner { members, z, input: *input, output: output.to_bits(), small_moves: *small_moves, origin, taken };
        runner.run::<V, W>(v, blocks, samples, outputs);
        (*input, *output, *small_moves) = (runner.input, f64::from_bits(runner.output), runner.small_moves);
        runner.taken
    }
}

/// A bank on its way through the samples.
struct Runner<'a> {
    members: &'a Members,
    z: &'a mut [f64],
    input: f64,
    /// As bits: as a number it would be kept in one vector with the input, and every input would wait for the output
    /// before it.
    output: u64,
    small_moves: u8,
    origin: Point,
    taken: Taken,
}

impl Runner<'_> {
    #[inline(always)]
    fn run<V: Vectors, W: Weights>(&mut self, v: V, blocks: &[Block<V::Lanes>], samples: &[f64], outputs: &mut [f64]) {
        let ((samples, last_samples), (outputs, last_outputs)) = (samples.as_chunks(), outputs.as_chunks_mut());
        for (samples, outputs) in samples.iter().zip(outputs) {
            if let Some(inputs) = self.moves(samples) {
                *outputs = self.together::<V, W>(v, blocks, inputs);
            } else if !self.one_by_one::<V, W>(v, blocks, samples, outputs) {
                return;
            }
        }
        self.one_by_one::<V, W>(v, blocks, last_samples, last_outputs);
    }

    /// The inputs of samples that are all admissible, none of them leading to a line.
    #[inline(always)]
    #[expect(clippy::needless_bitwise_bool, reason = "vectors have no branches")]
    fn moves(&mut self, samples: &[f64; TOGETHER]) -> Option<[f64; TOGETHER]> {
        let inputs = samples.map(|sample| sample - self.origin.input);
        let (mut last, mut small_moves, mut all) = (self.input, self.small_moves, true);
        for (sample, x) in samples.iter().zip(inputs) {
            small_moves = self.members.small_moves(small_moves, x - last);
            all &= is_admissible(*sample) & (small_moves < MOVES_BEFORE_A_LINE);
            last = x;
        }
        if all {
            self.small_moves = small_moves;
        }
        all.then_some(inputs)
    }

    /// Moves to every input: the outputs there.
    #[inline(always)]
    fn together<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        inputs: [f64; TOGETHER],
    ) -> [f64; TOGETHER] {
        let [a, b, c, d] = inputs;
        let moves = [(self.input, a), (a, b), (b, c), (c, d)];
        let falls: u8 = moves.iter().map(|(from, to)| u8::from(to < from)).sum();
        // 1 if none of the four falls, -1 if all do; of moves from zero to -0, where either sign will do, -1. Every
        // product waits for it, so it is not made of `falls`: that would take a conversion.
        let sign = 1.0_f64.copysign(d - self.input);
        let sums = match usize::from(falls) {
            0 => self.one_way::<V, W>(v, blocks, inputs, Rising, sign),
            TOGETHER => self.one_way::<V, W>(v, blocks, inputs, Falling, sign),
            _ => self.either_way::<V, W>(v, blocks, inputs, moves.map(|(from, to)| Unguessed::of_move(from, to))),
        };
        (self.input, self.output) = (d, sums[TOGETHER - 1].to_bits());
        self.taken.samples += TOGETHER;
        sums.map(|sum| sum + self.origin.output)
    }

    /// The sum at every input, as a [`Sweep`] takes it (a zero of the mirror is made one of this side), all of them
    /// being on the way to the same side. Its sign comes as a number that the compiler does not know, or it would make
    /// differences of the products.
    #[inline(always)]
    fn one_way<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        inputs: [f64; TOGETHER],
        side: impl Side,
        sign: f64,
    ) -> [f64; TOGETHER] {
        let (sign, mut sums) = (v.splat(sign), [v.nothing(); TOGETHER]);
        for (block, slot) in blocks.iter().zip(V::Lanes::vectors_mut(self.z)) {
            let thresholds = side.thresholds(block);
            let mut z = side.seen(v, v.load(slot));
            for (x, sum) in inputs.iter().zip(&mut sums) {
                z = v.max(thresholds.least_signed(v, v.splat(*x), sign), z);
                *sum = v.sum_product(*sum, W::along(side, block, v, z), z);
            }
            *slot = v.store(side.seen(v, z));
        }
        sums.map(|sum| side.turned(v.total(sum)) + 0.0)
    }

    /// The same for each input on the way to its side.
    #[inline(always)]
    fn either_way<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        inputs: [f64; TOGETHER],
        sides: [Unguessed; TOGETHER],
    ) -> [f64; TOGETHER] {
        let mut sums = [v.nothing(); TOGETHER];
        for (block, slot) in blocks.iter().zip(V::Lanes::vectors_mut(self.z)) {
            let mut z = v.load(slot);
            for ((x, side), sum) in inputs.iter().zip(sides).zip(&mut sums) {
                let least = side.thresholds(block).least(v, v.splat(side.turned(*x)));
                let seen = v.max(least, side.seen(v, z));
                *sum = v.sum_product(*sum, W::along(side, block, v, seen), seen);
                z = side.seen(v, seen);
            }
            *slot = v.store(z);
        }
        array::from_fn(|k| sides[k].turned(v.total(sums[k])) + 0.0)
    }

    /// Moves to one input after the other: whether none led to a line.
    #[inline(always)]
    fn one_by_one<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        samples: &[f64],
        outputs: &mut [f64],
    ) -> bool {
        for (sample, put_out) in samples.iter().zip(outputs) {
            if is_admissible(*sample) {
                let (from, x) = (self.input, *sample - self.origin.input);
                let small_moves = self.members.small_moves(self.small_moves, x - from);
                if small_moves == MOVES_BEFORE_A_LINE {
                    return false;
                }
                self.small_moves = small_moves;
                let bounds = Behind(Unguessed::of_move(from, x));
                let output = Sweep { outputs: &mut *self.z, start: Here, bounds, x }.run::<V, W>(v, blocks);
                (self.input, self.output) = (x, output.to_bits());
            } else {
                self.taken.rejected += 1;
            }
            *put_out = f64::from_bits(self.output) + self.origin.output;
            self.taken.samples += 1;
        }
        true
    }
}
