//! Where another mode may be: what each candidate explains of what a fit leaves.

mod products;

use std::ops::Range;

use products::Products;

use super::axes::{MAX_MODE_CYCLES, MAX_MODE_GAIN, MIN_MODE_CYCLES};
use super::course::Course;
use super::creep_filter::CreepFilter;
use super::joint::JointFit;
use super::linear_part::{LinearPart, Mode, SampledPart};
use super::point::Parameter;
use super::response::{hysteresis, through};
use crate::numeric::as_f64;
use crate::record::Record;

/// A mode with its best share in the static gain, and by how much it lowers the sum of squares to first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) mode: Mode,
    decrease: f64,
}

/// The dampings of the first look, and the ratios of its frequencies: neighbours overlap.
const LOOK: [(f64, f64); 2] = [(0.02, 1.04), (0.1, 1.2)];

/// How many of its maxima are looked at closely.
const MAXIMA: usize = 3;

/// A maximum of the first look explains at least this share of what is there.
const SEEN: f64 = 0.3;

/// The close look: frequencies to either side, their ratio, and dampings.
const NEAR: i32 = 8;
const NEAR_RATIO: f64 = 1.005;
const DAMPINGS: [f64; 7] = [0.003, 0.007, 0.015, 0.03, 0.06, 0.12, 0.25];

/// Modes whose frequencies are nearer than this are not told apart.
const APART: f64 = 0.05;

/// A column that has less than this share of itself apart from the others is one of them.
const OF_ITS_OWN: f64 = 1e-6;

/// The candidates that may lower the sum of squares by this much, the best first.
pub(super) fn candidates(records: &[Record<'_>], near: &JointFit, worth: f64) -> Vec<Candidate> {
    let scan = Scan::new(records, near);
    let mut first = Vec::new();
    for (damping, ratio) in LOOK {
        first.extend(scan.maxima(&scan.frequencies(ratio).map(|frequency| (frequency, damping)).collect::<Vec<_>>()));
    }
    let mut best: Vec<Candidate> = Vec::new();
    for one in apart(first, SEEN * worth) {
        let around = |step| one.mode.frequency * NEAR_RATIO.powi(step);
        let grid = (-NEAR..=NEAR).flat_map(|step| DAMPINGS.map(|damping| (around(step), damping)));
        best.extend(
            scan.explained(&grid.collect::<Vec<_>>()).into_iter().max_by(|a, b| a.decrease.total_cmp(&b.decrease)),
        );
    }
    apart(best, worth)
}

/// Those of at least this worth, the best first, each apart from the better ones.
fn apart(mut all: Vec<Candidate>, worth: f64) -> Vec<Candidate> {
    all.sort_by(|a, b| b.decrease.total_cmp(&a.decrease));
    let mut kept: Vec<Candidate> = Vec::new();
    for one in all {
        let is_near = |better: &Candidate| are_near(better.mode.frequency, one.mode.frequency);
        if one.decrease >= worth && kept.len() < MAXIMA && !kept.iter().any(is_near) {
            kept.push(one);
        }
    }
    kept
}

pub(super) fn are_near(one: f64, other: f64) -> bool {
    (one / other).ln().abs() < APART
}

/// What a fit leaves and what its other parameters might make of that.
struct Scan {
    signals: Vec<Signals>,
    /// The linear part of the fit, with its first mode alone.
    first: LinearPart,
    modes: Vec<Mode>,
    /// The frequencies to look at.
    range: (f64, f64),
    /// The residual at the rows of all records, one after the other.
    residual: Vec<f64>,
    /// The derivatives by the parameters of the linear part, orthonormal, at the same rows.
    columns: Vec<Vec<f64>>,
}

struct Signals {
    dt: f64,
    /// Behind the creep.
    input: Vec<f64>,
    /// Its rows, and where they are among those of all records.
    course: Course,
    rows: Range<usize>,
}

impl Signals {
    /// The samples that are rows.
    fn samples(&self) -> impl Iterator<Item = usize> {
        (0..self.course.len()).map(|row| self.course.sample(row))
    }
}

impl Scan {
    fn new(records: &[Record<'_>], near: &JointFit) -> Self {
        let (space, fit) = (&near.space, &near.fit);
        let (part, chain) = (space.linear_part(&fit.point), near.chain(1.0));
        let (mut signals, mut residual) = (Vec::<Signals>::new(), Vec::new());
        for (place, record) in records.iter().enumerate() {
            let dt = space.intervals().of_record(place);
            let output = hysteresis(&chain.operators, &fit.weights, record.input(), 0.0, dt);
            let mut creep = CreepFilter::new(&SampledPart::new(&part, dt));
            let input = output.iter().map(|h| creep.next(*h)).collect();
            let course = Course::new(record, 1, space.unread_samples());
            let one = Signals { dt, input, rows: residual.len()..residual.len() + course.len(), course };
            let predicted = chain.response_in(place, record.input(), dt);
            residual.extend(one.samples().map(|k| record.output()[k] - predicted[k]));
            signals.push(one);
        }
        let intervals = space.intervals();
        let range = (MIN_MODE_CYCLES / intervals.longest_record(), MAX_MODE_CYCLES / intervals.smallest());
        let modes = part.modes();
        let first = LinearPart { further: Vec::new(), amplitudes: Vec::new(), time_constants: Vec::new(), ..part };
        let mut scan = Self { signals, first, modes, range, residual, columns: Vec::new() };
        let residual = std::mem::take(&mut scan.residual);
        scan.residual = scan.centred(residual);
        scan.take_columns(near);
        scan
    }

    /// What the parameters of the linear part and the gain of the hysteresis change to first order.
    fn take_columns(&mut self, near: &JointFit) {
        let behind_creep = |part: LinearPart| LinearPart { amplitudes: Vec::new(), time_constants: Vec::new(), ..part };
        let here = self.answers(&behind_creep(near.space.linear_part(&near.fit.point)));
        let mut columns = vec![here.clone()];
        for (parameter, neighbour, distance) in near.space.neighbours(&near.fit.point) {
            use Parameter::{DeadTime, LogDamping, LogFrequency};
            if matches!(parameter, DeadTime | LogDamping | LogFrequency) || parameter.is_of_further_mode() {
                let there = self.answers(&behind_creep(near.space.linear_part(&neighbour)));
                columns.push(there.iter().zip(&here).map(|(there, here)| (there - here) / distance).collect());
            }
        }
        for column in columns {
            let mut column = self.centred(column);
            let size = dot(&column, &column);
            for other in &self.columns {
                let share = dot(&column, other);
                column.iter_mut().zip(other).for_each(|(value, other)| *value -= share * other);
            }
            let left = dot(&column, &column);
            if left > OF_ITS_OWN * size {
                for value in &mut *column {
                    *value /= left.sqrt();
                }
                self.columns.push(column);
            }
        }
    }

    /// The answers of a linear part at the rows of all records.
    fn answers(&self, part: &LinearPart) -> Vec<f64> {
        let of_record = |signals: &Signals| {
            let answer = through(part, &signals.input, signals.dt);
            signals.samples().map(|k| answer[k]).collect::<Vec<_>>()
        };
        self.signals.iter().flat_map(of_record).collect()
    }

    /// The same without its mean over every record, which an output offset has.
    fn centred(&self, mut column: Vec<f64>) -> Vec<f64> {
        for signals in &self.signals {
            let rows = &mut column[signals.rows.clone()];
            let mean = rows.iter().sum::<f64>() / as_f64(rows.len());
            for value in &mut *rows {
                *value -= mean;
            }
        }
        column
    }

    fn frequencies(&self, ratio: f64) -> impl Iterator<Item = f64> {
        let (lowest, highest) = self.range;
        std::iter::successors(Some(highest), move |frequency| Some(frequency / ratio)).take_while(move |f| *f > lowest)
    }

    /// The candidates that explain more than their neighbours in this list.
    fn maxima(&self, grid: &[(f64, f64)]) -> Vec<Candidate> {
        let all = self.explained(grid);
        let decrease = |place: Option<usize>| place.and_then(|i| all.get(i)).map_or(0.0, |one| one.decrease);
        let is_maximum = |i: &usize| decrease(Some(*i)) >= decrease(i.checked_sub(1)).max(decrease(Some(i + 1)));
        (0..all.len()).filter(is_maximum).map(|i| all[i]).collect()
    }

    /// What modes of these frequencies and dampings explain.
    fn explained(&self, grid: &[(f64, f64)]) -> Vec<Candidate> {
        let candidate =
            |(frequency, damping): &(f64, f64)| Mode { frequency: *frequency, damping: *damping, gain: 0.0 };
        let modes: Vec<Mode> = grid.iter().map(candidate).collect();
        let Products { squares, with_residual, with_columns } = Products::new(self, &modes);
        let explained = |(i, mode): (usize, Mode)| {
            let own = squares[i] - with_columns.iter().map(|product| product[i].powi(2)).sum::<f64>();
            let is_known = self.modes.iter().any(|one| are_near(one.frequency, mode.frequency));
            if is_known || own <= OF_ITS_OWN * squares[i] {
                return Candidate { mode, decrease: 0.0 };
            }
            let gain = (with_residual[i] / own).clamp(-MAX_MODE_GAIN, MAX_MODE_GAIN);
            Candidate { mode: Mode { gain, ..mode }, decrease: gain * (2.0 * with_residual[i] - gain * own) }
        };
        modes.into_iter().enumerate().map(explained).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
