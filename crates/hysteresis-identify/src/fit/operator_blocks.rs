//! The operators of a tangent and of its neighbours, block by block: the columns of the weights, their output, and its
//! derivatives by what operators depend on.

use fearless_simd::{Simd, SimdBase};
use hysteresis_core::{DuhemForward, Process};

use crate::algebra::eight::{LANES, Lanes, SimdLoop, copy_signals, dispatch, load, splat};
use crate::fit::response::OperatorsAt;
use crate::fit::tangent::{Slope, Tangent};
use crate::terms::duhem::{DuhemTable, MOST_KNOTS};
use crate::terms::maps::{Curve, PathLane};
use crate::terms::operators::{BLOCK, BankLanes, Runs, WeightLanes};
use crate::terms::side_columns::SideLane;
use crate::terms::slow_gain::GainLane;

/// Where the signals of a block are: the first eight at all samples, then the next.
///
/// The columns of the operators begin at an eight, and those below zero at another; behind the last of them are those
/// beside the operators, and then, where there are derivatives, the output and its derivatives, and where there is an
/// output map, or a Duhem operator, what is known.
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
        let sides = tangent.operators.sides().len();
        let (columns, operators) = (tangent.columns, tangent.operators.bank.len());
        let eights = operators.div_ceil(LANES);
        let is_split = columns - sides > operators;
        let output = columns + if is_split { eights * LANES - operators } else { 0 };
        let known = output + if tangent.slopes.is_empty() { 0 } else { 1 + derivatives };
        let end = known + usize::from(tangent.operators.output_map.is_some() || tangent.operators.duhem.is_some());
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
    /// The weighted sum of the plays of the tangent, and its output in the last block.
    plays: [f64; BLOCK],
    pub(crate) output: [f64; BLOCK],
    /// Where the last sample is in the last block.
    last: usize,
}

/// What the drive becomes before it reaches operators, and the columns beside them, in a block.
struct Drive<'a> {
    path: PathLane<'a>,
    input_offset: f64,
    xs: [f64; BLOCK],
    runs: Runs,
    side: Option<(SideLane<'a>, Vec<[f64; BLOCK]>)>,
    gain: Option<(GainLane, [f64; BLOCK])>,
}

struct Bank<'a> {
    lanes: BankLanes,
    weights: WeightLanes,
    amplitudes: &'a [f64],
    output_map: Option<&'a Curve>,
    /// Which of the drives it is shown, and which have its columns beside them and its slow gain.
    drive: usize,
    side: usize,
    gain: usize,
    /// The operator beside the plays, and its output in the last block.
    duhem: Option<DuhemForward<MOST_KNOTS>>,
    beside: [f64; BLOCK],
    /// Whether its plays are those of the tangent itself.
    has_same_plays: bool,
}

impl<'a> OperatorBlocks<'a> {
    pub(crate) fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
        let here = &tangent.operators;
        let mut drives = vec![Drive::new(here, dt, true, true)];
        let mut bank = |at: &'a OperatorsAt| {
            let (is_same_drive, is_same_side) =
                (at.path == here.path && at.input_offset == here.input_offset, at.has_side_of(here));
            let is_same_gain = at.has_gain_of(here);
            let own = drives.len();
            if !(is_same_drive && is_same_side && is_same_gain) {
                drives.push(Drive::new(at, dt, !is_same_side, !is_same_gain));
            }
            let place = |is_same: bool| if is_same { 0 } else { own };
            let bank = Bank::new(at, &tangent.weights, place(is_same_drive), place(is_same_side), place(is_same_gain));
            Bank { has_same_plays: is_same_drive && at.bank == here.bank, ..bank }
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
        Self { input, layout, drives, here, there, z, plays: [0.0; BLOCK], output: [0.0; BLOCK], last: 0 }
    }

    /// Goes on to these samples, a block at most, and writes the signals there.
    pub(crate) fn put_out(&mut self, samples: &[usize], signals: &mut [Lanes]) {
        let (layout, count) = (self.layout, samples.len());
        for drive in &mut self.drives {
            drive.take(self.input, samples);
        }
        let last = std::mem::replace(&mut self.last, count - 1);
        if self.drives.iter().all(Drive::stands_still) {
            for block in signals.chunks_exact_mut(BLOCK) {
                let at_last = block[last];
                block[..count].fill(at_last);
            }
            let at_last = self.output[last];
            self.output[..count].fill(at_last);
            return;
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
            here.sums(z, &mut self.plays[..count]);
            here.add_beside(&self.plays[..count], &mut self.output[..count]);
        }
        if let Some(map) = here.output_map {
            let mut slopes = [0.0; BLOCK];
            let mut known = [0.0; BLOCK];
            for (k, slope) in slopes[..count].iter_mut().enumerate() {
                let output = self.output[k];
                let value;
                (value, *slope) = map.at(output);
                known[k] = value - *slope * self.plays[k];
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
        } else if here.duhem.is_some() {
            set(signals, layout.known, &here.beside[..count]);
        }
        here.add_behind(drives, &mut self.output[..count]);
        let sides = layout.columns - layout.operators * if layout.is_split { 2 } else { 1 };
        if let Some((_, values)) = &drives[0].side {
            for (number, values) in values.iter().enumerate() {
                set(signals, layout.output - sides + number, &values[..count]);
            }
        }
        if let Some((_, gains)) = &drives[0].gain {
            for block in signals.chunks_exact_mut(BLOCK) {
                for (lanes, gain) in block.iter_mut().zip(&gains[..count]) {
                    for value in lanes {
                        *value *= gain;
                    }
                }
            }
        }
        if layout.known > layout.output {
            set(signals, layout.output, &self.output[..count]);
        }
        let mut values = [0.0; BLOCK];
        for (number, (there, distance)) in self.there.iter_mut().enumerate() {
            if there.has_same_plays {
                there.move_beside(drives, count);
                there.add_beside(&self.plays[..count], &mut values[..count]);
            } else {
                there.put_out(drives, count, &mut self.z);
                let mut plays = [0.0; BLOCK];
                there.sums(&self.z, &mut plays[..count]);
                there.add_beside(&plays[..count], &mut values[..count]);
            }
            there.add_behind(drives, &mut values[..count]);
            for (value, output) in values.iter_mut().zip(&self.output) {
                *value = (*value - output) / *distance;
            }
            set(signals, layout.derivatives + number, &values[..count]);
        }
    }
}

impl<'a> Drive<'a> {
    fn new(at: &'a OperatorsAt, dt: f64, has_side: bool, has_gain: bool) -> Self {
        let columns = at.side.as_ref().filter(|_| has_side);
        let side = columns.map(|columns| (SideLane::new(columns, dt), vec![[0.0; BLOCK]; columns.len()]));
        let gain = at.gain.as_ref().filter(|_| has_gain).map(|gain| (GainLane::new(gain, dt), [1.0; BLOCK]));
        Self { path: at.path.lane(dt), input_offset: at.input_offset, xs: [0.0; BLOCK], runs: Runs::new(), side, gain }
    }

    fn take(&mut self, input: &[f64], samples: &[usize]) {
        let count = samples.len();
        for ((k, x), sample) in self.xs.iter_mut().enumerate().zip(samples) {
            let u = input[*sample];
            *x = self.path.next(u) - self.input_offset;
            if let Some((lane, columns)) = &mut self.side {
                lane.next(self.path.voltage(u));
                lane.write(columns.iter_mut().map(|column| &mut column[k]));
            }
            if let Some((lane, gains)) = &mut self.gain {
                lane.next(self.path.voltage(u));
                gains[k] = lane.gain();
            }
        }
        self.runs.take(&self.xs[..count]);
    }

    /// Whether nothing has changed since the last block's last sample.
    fn stands_still(&self) -> bool {
        self.runs.stand_still() && self.side.is_none() && self.gain.is_none()
    }
}

impl<'a> Bank<'a> {
    fn new(at: &'a OperatorsAt, weights: &'a [f64], drive: usize, side: usize, gain: usize) -> Self {
        let sides = at.sides().len();
        let (weights, amplitudes) = weights.split_at(weights.len().saturating_sub(sides));
        let weights = WeightLanes::new(weights, at.bank.len());
        Self {
            lanes: BankLanes::new(&at.bank),
            weights,
            amplitudes,
            output_map: at.output_map.as_ref(),
            drive,
            side,
            gain,
            duhem: at.duhem.as_ref().map(DuhemTable::stream),
            beside: [0.0; BLOCK],
            has_same_plays: false,
        }
    }

    fn put_out(&mut self, drives: &[Drive<'_>], count: usize, z: &mut [Lanes]) {
        let drive = &drives[self.drive];
        self.lanes.put_out(&drive.xs[..count], &drive.runs, z);
        self.move_beside(drives, count);
    }

    /// Moves what stands beside the plays.
    fn move_beside(&mut self, drives: &[Drive<'_>], count: usize) {
        let Some(duhem) = &mut self.duhem else { return };
        for (z, x) in self.beside.iter_mut().zip(&drives[self.drive].xs[..count]) {
            *z = duhem.step(*x);
        }
    }

    /// The weighted sums of the plays with what stands beside them.
    fn add_beside(&self, plays: &[f64], sums: &mut [f64]) {
        for (sum, (plays, z)) in sums.iter_mut().zip(plays.iter().zip(&self.beside)) {
            *sum = plays + z;
        }
    }

    /// The weighted sums of the operators.
    fn sums(&self, z: &[Lanes], sums: &mut [f64]) {
        self.weights.sums(z, self.lanes.still(), sums);
    }

    /// Makes outputs of the weighted sums of the operators: the output map, and the columns beside it.
    fn add_behind(&self, drives: &[Drive<'_>], sums: &mut [f64]) {
        if let Some(map) = self.output_map {
            for sum in &mut *sums {
                *sum = map.at(*sum).0;
            }
        }
        if let Some((_, values)) = &drives[self.side].side {
            for (amplitude, values) in self.amplitudes.iter().zip(values) {
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += amplitude * value);
            }
        }
        if let Some((_, gains)) = &drives[self.gain].gain {
            sums.iter_mut().zip(gains).for_each(|(sum, gain)| *sum *= gain);
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
