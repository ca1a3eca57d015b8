//! The loop over all operators: for thresholds that are not nested, for arbitrary initial outputs, and for drives that jump.

mod block;
mod course;
mod members;
mod sweep;

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::marker::PhantomData;

use super::checks::restore_tolerance;
use super::direction::Direction;
use super::four_lanes::{LANES, Lanes};
use super::line::{Line, Piece};
use super::solve::{Path, Point, Reach, solve};
use crate::error::{Error, check_finite, check_length};
use crate::operator::Operator;
use block::{Both, Bounds, Lower, LowerBelowZero, Slides, Split, Unmoved, Upper, UpperAboveZero, Weights, Whole};
use course::Push;
pub(crate) use members::Members;
use sweep::{Run, SlopeSweep, Slot, Sweep};

/// A bank of operators, each with its output.
#[derive(Clone, Debug)]
pub(crate) struct Bank {
    members: Arc<Members>,
    initial: Box<[Lanes]>,
    outputs: Box<[Lanes]>,
    /// The input that has led to the outputs; NaN if none may have.
    input: f64,
    /// What the outputs sum to.
    output: f64,
}

impl Bank {
    /// A bank whose operators all start from zero.
    pub(crate) fn at_rest(members: Arc<Members>) -> Self {
        let zeros: Box<[Lanes]> = members.blocks.iter().map(|_| [0.0; LANES]).collect();
        Self { members, initial: zeros.clone(), outputs: zeros, input: 0.0, output: 0.0 }
    }

    /// A bank that starts from the outputs `initial`; the first sample projects them onto what can be reached.
    pub(crate) fn new(members: Arc<Members>, initial: &[f64]) -> Result<Self, Error> {
        check_length("initial", members.len(), initial.len())?;
        for (i, z) in initial.iter().enumerate() {
            check_finite("initial", Some(i), *z)?;
        }
        let mut bank = Self::at_rest(members);
        in_lanes(&mut bank.initial, initial);
        bank.reset();
        Ok(bank)
    }

    pub(crate) fn reset(&mut self) {
        for (output, initial) in self.outputs.iter_mut().zip(&self.initial) {
            *output = *initial;
        }
        self.start_at(0.0);
    }

    /// Starts from the outputs as they are, the input being `input`, which need not have led to them.
    fn start_at(&mut self, input: f64) {
        self.output = self.sum();
        self.input = if self.is_at(input) { input } else { f64::NAN };
    }

    /// Whether a move of the input to `input` changes no operator.
    pub(crate) fn is_at(&self, input: f64) -> bool {
        self.members.iter().zip(self.outputs()).all(|((_, operator), z)| operator.next(*z, input) == *z)
    }

    /// The operator outputs z_i.
    pub(crate) fn outputs(&self) -> &[f64] {
        let lanes = self.outputs.as_flattened();
        lanes.get(..self.members.len()).unwrap_or(lanes)
    }

    /// Continues from saved operator outputs, which must sum to `output` but for rounding.
    pub(crate) fn restore(&mut self, outputs: &[f64], input: f64, output: f64) -> Result<(), Error> {
        if outputs.len() != self.members.len() || outputs.iter().any(|z| !z.is_finite()) {
            return Err(Error::State { expected: "one finite output for each operator" });
        }
        let (mut sum, mut scale) = (0.0, 0.0);
        for ((weight, _), z) in self.members.iter().zip(outputs) {
            sum += weight.at(*z) * z;
            scale += weight.magnitude() * (z.abs() + input.abs() + f64::MIN_POSITIVE);
        }
        if (sum - output).abs() > restore_tolerance(scale) {
            return Err(Error::State { expected: "operator outputs that sum to the output" });
        }
        in_lanes(&mut self.outputs, outputs);
        self.start_at(input);
        Ok(())
    }

    /// Takes over other weights of the same operators in the same order: whether they differ.
    pub(crate) fn reweigh(&mut self, members: &Arc<Members>) -> Result<bool, Error> {
        let differ = self.members.weigh_otherwise(members)?;
        self.members = members.clone();
        self.output = self.sum();
        Ok(differ)
    }

    /// Moves the input to `to`.
    pub(crate) fn move_input(&mut self, to: f64) {
        self.output = sweep(&self.members, &mut *self.outputs, Push::between(self.input, to), to);
        self.input = to;
    }

    /// [`move_input`](Self::move_input) for every sample that is admissible, all of them in one loop: how many are not. Inputs and
    /// outputs are relative to `origin`, samples and what is put out are not.
    pub(crate) fn run(&mut self, samples: &[f64], outputs: &mut [f64], origin: Point) -> u64 {
        if self.members.split {
            self.run_weighed::<Split>(samples, outputs, origin)
        } else {
            self.run_weighed::<Whole>(samples, outputs, origin)
        }
    }

    fn run_weighed<W: Weights>(&mut self, samples: &[f64], outputs: &mut [f64], origin: Point) -> u64 {
        let Self { members, outputs: z, input, output, .. } = self;
        let Members { blocks, processor, .. } = &**members;
        processor.run(Run::<W> { blocks, z, input, output, origin, samples, outputs, by: PhantomData })
    }

    /// The sum of the outputs as they are.
    fn sum(&self) -> f64 {
        sweep_by::<Unmoved>(&self.members, &*self.outputs, 0.0)
    }

    /// The input that has led to the outputs; NaN if none may have.
    pub(crate) fn input(&self) -> f64 {
        self.input
    }

    /// The output of the present state.
    pub(crate) fn output(&self) -> f64 {
        self.output
    }

    /// The output after a move of the input to `to`.
    pub(crate) fn peek_input(&self, to: f64) -> f64 {
        sweep(&self.members, &*self.outputs, Push::between(self.input, to), to)
    }

    /// The input that brings the output to `to`, or the limit that comes closest. `from` is where the search starts.
    pub(crate) fn look_output(&self, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        let input = from.input.max(limits.0).min(limits.1);
        let near = Point { input, output: if input == self.input { self.output } else { self.peek_input(input) } };
        if near.output == to {
            return Reach { input, output: to, saturated: false };
        }
        let direction = if near.output <= to { Direction::Rising } else { Direction::Falling };
        let limit = direction.limit(limits);
        let guess = self.line_from(direction, input).inverted().at(to);
        let found = solve(&mut BankPath(self), direction, near, None, guess, to, limit);
        if found.input != limit {
            return Reach { saturated: false, output: to, ..found };
        }
        let most = self.peek_input(limit);
        let saturated = direction.leads_away(to, most);
        Reach { input: limit, output: if saturated { most } else { to }, saturated }
    }

    /// The line of the outputs over the input from `x` on in `direction`, every operator starting from its present output.
    fn line_from(&self, direction: Direction, x: f64) -> Line {
        let (output, slope) = match direction {
            _ if self.input.is_nan() => self.slope::<Both>(x),
            Direction::Rising => self.slope::<Lower>(x),
            Direction::Falling => self.slope::<Upper>(x),
        };
        Line { slope, offset: output - slope * x }
    }

    /// The output at `x` and the slope from there on.
    #[inline]
    fn slope<B: Slides>(&self, x: f64) -> (f64, f64) {
        let (Members { blocks, split, processor, .. }, outputs) = (&*self.members, &*self.outputs);
        if *split {
            processor.run(SlopeSweep::<B, Split> { blocks, outputs, x, by: PhantomData })
        } else {
            processor.run(SlopeSweep::<B, Whole> { blocks, outputs, x, by: PhantomData })
        }
    }
}

/// Every operator after a move of the input to `to`: the sum of w_i z_i.
#[inline]
fn sweep(members: &Members, outputs: impl IntoIterator<Item: Slot>, push: Push, to: f64) -> f64 {
    match push {
        Push::Up => sweep_by::<Lower>(members, outputs, to),
        Push::UpBelowZero => sweep_by::<LowerBelowZero>(members, outputs, to),
        Push::Down => sweep_by::<Upper>(members, outputs, to),
        Push::DownAboveZero => sweep_by::<UpperAboveZero>(members, outputs, to),
        Push::Either => sweep_by::<Both>(members, outputs, to),
    }
}

#[inline]
fn sweep_by<B: Bounds>(members: &Members, outputs: impl IntoIterator<Item: Slot>, x: f64) -> f64 {
    let Members { blocks, split, processor, .. } = members;
    if *split {
        processor.run(Sweep::<_, B, Split>::new(blocks, outputs, x))
    } else {
        processor.run(Sweep::<_, B, Whole>::new(blocks, outputs, x))
    }
}

/// Puts numbers of all operators into lanes; those that are left over stay.
fn in_lanes(lanes: &mut [Lanes], numbers: &[f64]) {
    for (lane, number) in lanes.as_flattened_mut().iter_mut().zip(numbers) {
        *lane = *number;
    }
}

/// Moves that do not move the bank: every operator starts from its present output.
struct BankPath<'a>(&'a Bank);

impl Path<f64> for BankPath<'_> {
    type Checkpoint = ();

    fn checkpoint(&self) {}

    fn go_back(&mut self, (): ()) {}

    /// How far a line goes is not known: its piece is a point, but for rounding.
    fn look(&mut self, direction: Direction, input: f64) -> Piece {
        let rounding = direction.sign::<f64>() * 4.0 * f64::EPSILON * input.abs();
        Piece { direction, line: self.0.line_from(direction, input), begin: input - rounding, end: input + rounding }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::super::four_lanes::Processor;
    use super::*;
    use crate::model::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

    /// Of 64 samples 48 are small steps, on which the input often turns round, and 16 are jumps.
    fn drive() -> impl Iterator<Item = f64> {
        let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
        (0..2000).scan(0.0, move |x, k| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let noise = f64::from((seed >> 40) as u32) / f64::from(1_u32 << 24) - 0.5;
            *x = if k % 64 < 48 { *x + 3.0 * noise } else { 1200.0 * noise };
            Some(*x)
        })
    }

    /// Models with lanes left over and without, of few operators and of more, of whole and of split weights.
    fn models() -> impl Iterator<Item = ModifiedPrandtlIshlinskii> {
        [1_u32, 3, 4, 21, 40].into_iter().flat_map(|n| {
            let r: Vec<f64> = (0..n).map(|i| 400.0 * f64::from(i) / f64::from(n)).collect();
            let weights: Vec<f64> = (0..n).map(|i| 1.0 / f64::from(1 + i)).collect();
            let whole =
                ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap();
            let below: Vec<f64> = weights.iter().map(|w| 0.5 * w).collect();
            [whole.clone(), whole.with_negative_weights(&below).unwrap()]
        })
    }

    /// The bank of every model on this processor and on any, from rest and from outputs that no input has led to.
    fn banks() -> impl Iterator<Item = Bank> {
        models().flat_map(|model| {
            [Processor::here(), Processor::portable()].into_iter().flat_map(move |processor| {
                let members = Arc::new(Members::on(processor, &model));
                let odd: Vec<f64> = (0..members.len()).map(|i| if i % 2 == 0 { 700.0 } else { -900.0 }).collect();
                [Bank::at_rest(members.clone()), Bank::new(members, &odd).unwrap()]
            })
        })
    }

    /// The operators of a bank by their equation, one by one.
    struct OneByOne<'a> {
        members: &'a Members,
        z: Vec<f64>,
    }

    impl OneByOne<'_> {
        fn step(&mut self, x: f64) -> f64 {
            for (z, (_, operator)) in self.z.iter_mut().zip(self.members.iter()) {
                *z = operator.next(*z, x);
            }
            self.members.iter().zip(&self.z).map(|((weight, _), z)| weight.at(*z) * z).sum()
        }
    }

    #[test]
    fn every_operator_is_where_its_equation_puts_it_on_any_processor() {
        for mut bank in banks() {
            let members = bank.members.clone();
            let mut truth = OneByOne { members: &members, z: bank.outputs().into() };
            for x in drive() {
                let sum = truth.step(x);
                // Sums of another order, of less than 2000 in all.
                assert!((bank.peek_input(x) - sum).abs() <= 1e-11, "{x}");
                bank.move_input(x);
                assert_eq!(bank.outputs(), truth.z, "{x}");
                assert!((bank.output() - sum).abs() <= 1e-11, "{x}");
            }
        }
    }

    #[test]
    fn a_run_is_its_samples_on_any_processor() {
        let origin = Point { input: 5.0, output: -3.0 };
        let mut samples: Vec<f64> = drive().collect();
        samples[70] = f64::NAN;
        for mut bank in banks() {
            let mut one_by_one = bank.clone();
            let mut outputs = samples.clone();
            assert_eq!(bank.run(&samples, &mut outputs, origin), 1);
            for (x, output) in samples.iter().zip(outputs) {
                if !x.is_nan() {
                    one_by_one.move_input(x - origin.input);
                }
                assert_eq!(output, one_by_one.output() + origin.output, "{x}");
            }
            assert_eq!((bank.outputs(), bank.input()), (one_by_one.outputs(), one_by_one.input()));
        }
    }

    #[test]
    fn a_slope_is_that_of_the_outputs_ahead() {
        for mut bank in banks() {
            for x in drive().take(300) {
                // Also before the first move, from outputs that no input has led to.
                for (direction, ahead) in [(Direction::Rising, 1e-6), (Direction::Falling, -1e-6)] {
                    if bank.input().is_nan() || !direction.leads_away(bank.input(), x) {
                        let line = bank.line_from(direction, x);
                        let (near, far) = (bank.peek_input(x), bank.peek_input(x + ahead));
                        assert!((line.at(x) - near).abs() <= 1e-10);
                        // 1e-6 ahead there is no breakpoint here.
                        assert!((line.slope - (far - near) / ahead).abs() < 1e-5, "{direction:?} at {x}");
                    }
                }
                bank.move_input(x);
            }
        }
    }
}
