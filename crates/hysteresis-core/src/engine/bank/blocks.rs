//! The operators of a bank side by side, as vectors take them: thresholds and weights of as many as a vector has
//! numbers are a block.
//!
//! Loops over the blocks are compiled for the vectors of each processor, and for weights that are the same above and
//! below zero or not.

use alloc::boxed::Box;

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use super::super::vectors::{Avx2, Avx512};
use super::super::vectors::{Portable, Processor, Vectors};
use crate::error::{Error, check_same};
use crate::model::ModifiedPrandtlIshlinskii;
use crate::operator::CoupledPlay;
use crate::real::check_same_count;

/// The thresholds of the bound behind an input that rises, or of one that falls in the mirror.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thresholds<L> {
    /// Above zero: r, or in the mirror ra.
    pub(super) outer: L,
    /// Below zero: rc, or in the mirror rb.
    pub(super) inner: L,
}

impl<L> Thresholds<L> {
    /// lo(x) of equation (5), or in the mirror -hi(-x): what the outputs cannot be below.
    #[inline(always)]
    pub(super) fn least<V: Vectors<Lanes = L>>(&self, v: V, x: V::Numbers) -> V::Numbers {
        lower(v, v.sub(x, v.load(&self.outer)), v.sub(x, v.load(&self.inner)))
    }

    /// [`least`](Self::least) at x or, for the sign -1, at -x: the same bits. Products are taken where a loop has
    /// nothing else to do than differences: a processor has other units for them.
    #[inline(always)]
    pub(super) fn least_signed<V: Vectors<Lanes = L>>(&self, v: V, x: V::Numbers, sign: V::Numbers) -> V::Numbers {
        let above = v.signed_sub(x, sign, v.load(&self.outer));
        lower(v, above, v.signed_sub(x, sign, v.load(&self.inner)))
    }
}

/// The lower bound, from what it is above zero and below.
#[inline(always)]
fn lower<V: Vectors>(v: V, above: V::Numbers, below: V::Numbers) -> V::Numbers {
    v.max(above, v.min(below, v.splat(0.0)))
}

/// Thresholds and weights of the operators of a vector. Lanes that are left over never move and weigh nothing. Aligned,
/// so that no vector lies in two lines of memory.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Block<L> {
    /// Of an input that rises, and of one that falls.
    pub(super) thresholds: [Thresholds<L>; 2],
    /// Above zero, and below.
    pub(super) weights: [L; 2],
}

impl<const N: usize> Block<[f64; N]> {
    pub(super) fn of(operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        let never = Thresholds { outer: [f64::INFINITY; N], inner: [f64::INFINITY; N] };
        let (mut rising, mut falling, [mut above, mut below]) = (never, never, [[0.0; N]; 2]);
        for (lane, (weight, operator)) in operators.iter().enumerate() {
            (rising.outer[lane], rising.inner[lane]) = (operator.r(), operator.rc());
            (falling.outer[lane], falling.inner[lane]) = (operator.ra(), operator.rb());
            (above[lane], below[lane]) = (weight.above, weight.below);
        }
        Self { thresholds: [rising, falling], weights: [above, below] }
    }

    /// Reads a number of each line of memory, or of each other one.
    #[inline]
    pub(super) fn fetch(&self) -> u64 {
        let Self { thresholds: [rising, falling], weights: [above, _] } = self;
        rising.outer[0].to_bits() ^ falling.outer[0].to_bits() ^ above[0].to_bits()
    }
}

/// The bounds that push the operators.
pub(super) trait Bounds: Copy {
    /// What the outputs `z` are at the input `x`.
    fn next<V: Vectors>(self, block: &Block<V::Lanes>, v: V, x: V::Numbers, z: V::Numbers) -> V::Numbers;
}

/// Those behind the input: seen from its side it rises.
#[derive(Clone, Copy)]
pub(super) struct Behind(pub(super) Unguessed);

impl Bounds for Behind {
    #[inline(always)]
    fn next<V: Vectors>(self, block: &Block<V::Lanes>, v: V, x: V::Numbers, z: V::Numbers) -> V::Numbers {
        let Self(side) = self;
        let least = side.thresholds(block).least(v, side.seen(v, x));
        side.seen(v, v.max(least, side.seen(v, z)))
    }
}

/// Both: right of every move, also from outputs that no input has led to.
#[derive(Clone, Copy)]
pub(super) struct Both;

impl Bounds for Both {
    #[inline(always)]
    fn next<V: Vectors>(self, block: &Block<V::Lanes>, v: V, x: V::Numbers, z: V::Numbers) -> V::Numbers {
        let [rising, falling] = &block.thresholds;
        let greatest = v.negated(falling.least(v, v.negated(x)));
        v.max(rising.least(v, x), v.min(greatest, z))
    }
}

/// None: the outputs stay.
#[derive(Clone, Copy)]
pub(super) struct Unmoved;

impl Bounds for Unmoved {
    #[inline(always)]
    fn next<V: Vectors>(self, _: &Block<V::Lanes>, _: V, _: V::Numbers, z: V::Numbers) -> V::Numbers {
        z
    }
}

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
    /// Of a move of the input. (A comparison would become a branch.) A move from zero to -0 counts as a fall: it pushes
    /// nothing.
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

/// What outputs weigh.
pub(super) trait Weights {
    /// At the output `z`.
    fn of<V: Vectors>(block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers;

    /// From `z` on, both as they are seen.
    fn along<S: Side, V: Vectors>(side: S, block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers;
}

/// The same above and below zero.
pub(super) struct Whole;

impl Weights for Whole {
    #[inline(always)]
    fn of<V: Vectors>(block: &Block<V::Lanes>, v: V, _: V::Numbers) -> V::Numbers {
        v.load(&block.weights[0])
    }

    #[inline(always)]
    fn along<S: Side, V: Vectors>(_: S, block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        Self::of(block, v, z)
    }
}

/// By the sign of the output.
struct Split;

impl Weights for Split {
    /// At zero either will do.
    #[inline(always)]
    fn of<V: Vectors>(block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        let [above, below] = &block.weights;
        v.select(v.is_below(v.splat(0.0), z), v.load(above), v.load(below))
    }

    /// At zero it is about to come above.
    #[inline(always)]
    fn along<S: Side, V: Vectors>(side: S, block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        let (above, below) = side.weights(block);
        v.select(v.is_below(z, v.splat(0.0)), v.load(below), v.load(above))
    }
}

/// A loop over the blocks of a bank, with what its operators weigh.
pub(super) trait BankLoop {
    type Output;
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Self::Output;
}

/// The blocks of all operators.
#[derive(Debug)]
pub(super) enum Blocks {
    Portable(BlocksOf<Portable>),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Avx2(BlocksOf<Avx2>),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Avx512(BlocksOf<Avx512>),
}

impl Blocks {
    pub(super) fn on(processor: Processor, operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        match processor {
            Processor::Portable => Self::Portable(BlocksOf::new(Portable, operators)),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Processor::Avx2(avx2) => Self::Avx2(BlocksOf::new(avx2, operators)),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Processor::Avx512(avx512) => Self::Avx512(BlocksOf::new(avx512, operators)),
        }
    }

    /// Runs a loop with the instructions of the processor.
    #[inline(always)]
    pub(super) fn run<L: BankLoop, W: Weights>(&self, work: L) -> L::Output {
        match self {
            Self::Portable(all) => all.run::<L, W>(work),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx2(all) => all.run::<L, W>(work),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx512(all) => all.run::<L, W>(work),
        }
    }

    /// Reads of their memory so much that it is at hand.
    #[inline]
    pub(super) fn fetch(&self) -> u64 {
        match self {
            Self::Portable(all) => all.fetch(),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx2(all) => all.fetch(),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx512(all) => all.fetch(),
        }
    }
}

/// The blocks for vectors of one width.
#[derive(Debug)]
pub(super) struct BlocksOf<V: Vectors> {
    v: V,
    blocks: Box<[Block<V::Lanes>]>,
}

impl<const N: usize, V: Vectors<Lanes = [f64; N]>> BlocksOf<V> {
    fn new(v: V, operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        Self { v, blocks: operators.chunks(N).map(Block::of).collect() }
    }

    #[inline(always)]
    fn run<L: BankLoop, W: Weights>(&self, work: L) -> L::Output {
        self.v.compiled(
            #[inline(always)]
            |v| work.run::<V, W>(v, &self.blocks),
        )
    }

    #[inline]
    fn fetch(&self) -> u64 {
        self.blocks.iter().fold(0, |read, block| read ^ block.fetch())
    }
}

/// The weights and operators of a model.
#[derive(Debug)]
pub(crate) struct Members {
    /// In the order of the model.
    operators: Box<[(SplitWeight, CoupledPlay)]>,
    /// The same for vectors.
    pub(super) blocks: Blocks,
    /// Whether any operator weighs differently above and below zero: the sum of all others needs no choice.
    split: bool,
    /// The largest move that counts as small.
    pub(super) small_move: f64,
    /// About the slope of a long move: where a search begins.
    pub(super) slope: f64,
}

/// So many moves as the last one lead from one breakpoint to the next if it counts as small: fewer would not pay for a
/// line.
const MOVES_ON_A_LINE: f64 = 16.0;

/// After so many small moves in a row a line is drawn: where a drive just turns round, as a sine at its peak, a line
/// would not pay.
pub(super) const MOVES_BEFORE_A_LINE: u8 = 8;

/// The weights of an operator above and below zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SplitWeight {
    pub(super) above: f64,
    pub(super) below: f64,
}

impl SplitWeight {
    /// The weight of the output z; at zero either will do.
    #[inline]
    pub(super) fn at(self, z: f64) -> f64 {
        if z > 0.0 { self.above } else { self.below }
    }

    pub(super) fn magnitude(self) -> f64 {
        self.above.abs().max(self.below.abs())
    }
}

impl Members {
    pub(crate) fn of(model: &ModifiedPrandtlIshlinskii) -> Self {
        Self::on(Processor::here(), model)
    }

    pub(super) fn on(processor: Processor, model: &ModifiedPrandtlIshlinskii) -> Self {
        let operators: Box<[_]> =
            model.members().map(|(above, below, operator)| (SplitWeight { above, below }, operator)).collect();
        let blocks = Blocks::on(processor, &operators);
        let small_move = mean_distance(operators.iter().map(|(_, operator)| *operator)) / MOVES_ON_A_LINE;
        let (least, greatest) = model.slope_range();
        let slope = 0.5 * (least + greatest);
        Self { operators, blocks, split: model.is_split(), small_move, slope }
    }

    pub(crate) fn len(&self) -> usize {
        self.operators.len()
    }

    /// Runs a loop for the weights of the model and the instructions of the processor. Inline, so that a loop is not
    /// copied first.
    #[inline(always)]
    pub(super) fn run<L: BankLoop>(&self, work: L) -> L::Output {
        if self.split { self.blocks.run::<_, Split>(work) } else { self.blocks.run::<_, Whole>(work) }
    }

    /// How many small moves in a row there are with this one, `before` of them before it. To stay is none, and ends
    /// none.
    #[inline(always)]
    pub(super) fn small_moves(&self, before: u8, distance: f64) -> u8 {
        let with_it = MOVES_BEFORE_A_LINE.min(before + u8::from(distance != 0.0));
        if distance.abs() <= self.small_move { with_it } else { 0 }
    }

    /// The operators with their weights, in the order of the model.
    pub(super) fn iter(&self) -> impl Iterator<Item = (SplitWeight, CoupledPlay)> + Clone {
        self.operators.iter().copied()
    }

    /// The same as a model gives them: weights above and below zero, and the operator.
    pub(crate) fn of_model(&self) -> impl Iterator<Item = (f64, f64, CoupledPlay)> + Clone {
        self.iter().map(|(SplitWeight { above, below }, operator)| (above, below, operator))
    }

    /// Whether the weights of the same operators in the same order differ.
    pub(super) fn weigh_otherwise(&self, others: &Self) -> Result<bool, Error> {
        check_same_count(self.len(), others.len())?;
        let mut differ = false;
        for ((weight, z), (other_weight, other)) in self.iter().zip(others.iter()) {
            check_same("r", z.r(), other.r())?;
            check_same("ra", z.ra(), other.ra())?;
            check_same("rb", z.rb(), other.rb())?;
            check_same("rc", z.rc(), other.rc())?;
            differ |= weight != other_weight;
        }
        Ok(differ)
    }
}

/// The mean distance between breakpoints of operators whose widest one just moves.
fn mean_distance(operators: impl Iterator<Item = CoupledPlay>) -> f64 {
    let (mut widest, mut count) = (0.0, 0.0);
    for operator in operators.filter(|operator| !operator.is_identity()) {
        widest = f64::max(widest, operator.r().max(operator.ra()));
        count += 1.0;
    }
    // Without any, a line holds everywhere.
    if count > 0.0 { widest / count } else { f64::INFINITY }
}
