//! The operators of a tangent over a block of samples: the columns, the output and its derivatives by parameters of the operators.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use fearless_simd::{Simd, SimdBase};

use super::bank_lanes::{BLOCK, BankLanes, Runs, WeightLanes};
use super::curve::Curve;
use super::drive_path::PathLane;
use super::eight::{LANES, Lanes, SimdLoop, copy_signals, dispatch, load, splat};
use super::regressor::OperatorsAt;
use super::shift::{ShiftColumns, ShiftLane};
use super::tangent::{Slope, Tangent};

/// Where the signals of a block are: the first eight at all samples, then the next.
///
/// The columns of the operators begin at an eight, and those below zero at another; behind the last of them are those of the loop shift,
/// and then, where there are derivatives, the output and its derivatives, and where there is an output map what is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// How many columns there are, how many of them above zero, and the eights that those take.
    columns: usize,
    operators: usize,
    eights: usize,
    is_split: bool,
    pub(crate) output: usize,
    pub(crate) derivatives: usize,
    pub(crate) known: usize,
    pub(crate) end: usize,
}

impl Layout {
    fn new(tangent: &Tangent, derivatives: usize) -> Self {
        let shifts = tangent.operators.shift.as_ref().map_or(0, ShiftColumns::len);
        let (columns, operators) = (tangent.columns, tangent.operators.bank.len());
        let eights = operators.div_ceil(LANES);
        let is_split = columns - shifts > operators;
        let output = columns + if is_split { eights * LANES - operators } else { 0 };
        let known = output + if tangent.slopes.is_empty() { 0 } else { 1 + derivatives };
        let end = known + usize::from(tangent.operators.output_map.is_some());
        Self { columns, operators, eights, is_split, output, derivatives: output + 1, known, end }
    }

    /// The lane of a column.
    pub(crate) fn lane(&self, column: usize) -> usize {
        if self.is_split && column >= self.operators { column - self.operators + self.eights * LANES } else { column }
    }

    /// Copies the columns of a sample, of which `eight` has the signals.
    pub(crate) fn copy_columns<'s>(&self, eight: impl Fn(usize) -> &'s Lanes, columns: &mut [f64]) {
        let (first, rest) = columns.split_at_mut(if self.is_split { self.operators } else { 0 });
        let begin = if self.is_split { self.eights } else { 0 };
        copy_signals(&eight, first);
        copy_signals(|number| eight(begin + number), rest);
    }
}

/// The signal of a lane at a sample.
pub(crate) fn signal(signals: &[Lanes], lane: usize, sample: usize) -> f64 {
    signals[lane / LANES * BLOCK + sample][lane % LANES]
}

/// Writes the signal of a lane.
pub(crate) fn set(signals: &mut [Lanes], lane: usize, values: &[f64]) {
    let block = &mut signals[lane / LANES * BLOCK..][..values.len()];
    block.iter_mut().zip(values).for_each(|(lanes, value)| lanes[lane % LANES] = *value);
}

/// The operators of a tangent and of its neighbours on their way through a record.
pub(crate) struct OperatorBlocks<'a> {
    input: &'a [f64],
    pub(crate) layout: Layout,
    /// What the operators are shown; the first one by the tangent itself.
    drives: Vec<Drive<'a>>,
    here: Bank<'a>,
    /// The neighbours, and how far away they are.
    there: Vec<(Bank<'a>, f64)>,
    z: Vec<Lanes>,
    /// The output of the tangent in the last block.
    pub(crate) output: [f64; BLOCK],
}

/// What the drive becomes before it reaches operators, and the loop shift, in a block.
struct Drive<'a> {
    path: PathLane<'a>,
    input_offset: f64,
    xs: [f64; BLOCK],
    runs: Runs,
    shift: Option<(ShiftLane<'a>, Vec<[f64; BLOCK]>)>,
}

struct Bank<'a> {
    lanes: BankLanes,
    weights: WeightLanes,
    amplitudes: &'a [f64],
    output_map: Option<&'a Curve>,
    /// Which of the drives it is shown, and which has its loop shift.
    drive: usize,
    shift: usize,
}

impl<'a> OperatorBlocks<'a> {
    pub(crate) fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
        let here = &tangent.operators;
        let mut drives = vec![Drive::new(here, dt, true)];
        let mut bank = |at: &'a OperatorsAt| {
            let (is_same_drive, is_same_shift) =
                (at.path == here.path && at.input_offset == here.input_offset, at.has_shift_of(here));
            let own = drives.len();
            if !(is_same_drive && is_same_shift) {
                drives.push(Drive::new(at, dt, !is_same_shift));
            }
            let place = |is_same: bool| if is_same { 0 } else { own };
            Bank::new(at, &tangent.weights, place(is_same_drive), place(is_same_shift))
        };
        let here = bank(here);
        let mut there = Vec::new();
        for slope in &tangent.slopes {
            if let Slope::Operators(at, distance) | Slope::Amplifier(at, _, distance) = slope {
                there.push((bank(at), *distance));
            }
        }
        let layout = Layout::new(tangent, there.len());
        let z = vec![[0.0; LANES]; here.lanes.eights() * BLOCK];
        Self { input, layout, drives, here, there, z, output: [0.0; BLOCK] }
    }

    /// Goes on to these samples, a block at most, and writes the signals there.
    pub(crate) fn put_out(&mut self, samples: &[usize], signals: &mut [Lanes]) {
        let (layout, count) = (self.layout, samples.len());
        for drive in &mut self.drives {
            drive.take(self.input, samples);
        }
        let drives = &self.drives[..];
        let here = &mut self.here;
        let (columns, z) = (&mut signals[..], &mut self.z[..]);
        if layout.is_split {
            here.put_out(drives, count, z);
            dispatch(Split { z, signals: columns });
        } else {
            here.put_out(drives, count, columns);
        }
        if layout.end > layout.columns || !self.there.is_empty() {
            let z = if layout.is_split { &*z } else { &*columns };
            here.sums(z, &mut self.output[..count]);
        }
        if let Some(map) = here.output_map {
            let mut slopes = [0.0; BLOCK];
            let mut known = [0.0; BLOCK];
            for (k, slope) in slopes[..count].iter_mut().enumerate() {
                let output = self.output[k];
                let value;
                (value, *slope) = map.at(output);
                known[k] = value - *slope * output;
            }
            let eights = layout.eights * if layout.is_split { 2 } else { 1 };
            for block in signals.chunks_exact_mut(BLOCK).take(eights) {
                for (lanes, slope) in block.iter_mut().zip(&slopes[..count]) {
                    for value in lanes {
                        *value *= slope;
                    }
                }
            }
            set(signals, layout.known, &known[..count]);
        }
        here.add_behind(drives, &mut self.output[..count]);
        let shifts = layout.columns - layout.operators * if layout.is_split { 2 } else { 1 };
        if let Some((_, values)) = &drives[0].shift {
            for (number, values) in values.iter().enumerate() {
                set(signals, layout.output - shifts + number, &values[..count]);
            }
        }
        if layout.known > layout.output {
            set(signals, layout.output, &self.output[..count]);
        }
        let mut values = [0.0; BLOCK];
        for (number, (there, distance)) in self.there.iter_mut().enumerate() {
            there.put_out(drives, count, &mut self.z);
            there.sums(&self.z, &mut values[..count]);
            there.add_behind(drives, &mut values[..count]);
            for (value, output) in values.iter_mut().zip(&self.output) {
                *value = (*value - output) / *distance;
            }
            set(signals, layout.derivatives + number, &values[..count]);
        }
    }
}

impl<'a> Drive<'a> {
    fn new(at: &'a OperatorsAt, dt: f64, has_shift: bool) -> Self {
        let columns = at.shift.as_ref().filter(|_| has_shift);
        let shift = columns.map(|columns| (ShiftLane::new(columns, dt), vec![[0.0; BLOCK]; columns.len()]));
        Self { path: at.path.lane(dt), input_offset: at.input_offset, xs: [0.0; BLOCK], runs: Runs::new(), shift }
    }

    fn take(&mut self, input: &[f64], samples: &[usize]) {
        let count = samples.len();
        for ((k, x), sample) in self.xs.iter_mut().enumerate().zip(samples) {
            let u = input[*sample];
            *x = self.path.next(u) - self.input_offset;
            if let Some((lane, columns)) = &mut self.shift {
                lane.next(self.path.voltage(u));
                lane.write(columns.iter_mut().map(|column| &mut column[k]));
            }
        }
        self.runs.take(&self.xs[..count]);
    }
}

impl<'a> Bank<'a> {
    fn new(at: &'a OperatorsAt, weights: &'a [f64], drive: usize, shift: usize) -> Self {
        let shifts = at.shift.as_ref().map_or(0, ShiftColumns::len);
        let (weights, amplitudes) = weights.split_at(weights.len().saturating_sub(shifts));
        let weights = WeightLanes::new(weights, at.bank.len());
        Self { lanes: BankLanes::new(&at.bank), weights, amplitudes, output_map: at.output_map.as_ref(), drive, shift }
    }

    fn put_out(&mut self, drives: &[Drive<'_>], count: usize, z: &mut [Lanes]) {
        let drive = &drives[self.drive];
        self.lanes.put_out(&drive.xs[..count], &drive.runs, z);
    }

    /// The weighted sums of the operators.
    fn sums(&self, z: &[Lanes], sums: &mut [f64]) {
        self.weights.sums(z, sums);
    }

    /// Makes outputs of the weighted sums of the operators: the output map, and the loop shift beside it.
    fn add_behind(&self, drives: &[Drive<'_>], sums: &mut [f64]) {
        if let Some(map) = self.output_map {
            for sum in &mut *sums {
                *sum = map.at(*sum).0;
            }
        }
        if let Some((_, values)) = &drives[self.shift].shift {
            for (amplitude, values) in self.amplitudes.iter().zip(values) {
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += amplitude * value);
            }
        }
    }
}

/// Outputs above and below zero.
struct Split<'a> {
    z: &'a [Lanes],
    signals: &'a mut [Lanes],
}

impl SimdLoop for Split<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (above, below) = self.signals.split_at_mut(self.z.len());
        let zero = splat(simd, 0.0);
        for (z, (above, below)) in self.z.iter().zip(above.iter_mut().zip(below)) {
            let z = load(simd, z);
            *above = z.max(zero).into();
            *below = z.min(zero).into();
        }
    }
}
