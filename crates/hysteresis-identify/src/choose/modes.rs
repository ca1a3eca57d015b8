//! Modes beside the first, searched one after the other from what the fit without them leaves.
//!
//! A scan finds where another mode may be: what each candidate explains of what a fit leaves, eight modes at once.

use std::ops::Range;

use fearless_simd::{Simd, SimdFloat};

use hysteresis_control::linear::Block;

use crate::algebra::eight::{LANES, Lanes, SimdLoop, dispatch, load, splat};
use crate::error::Error;
use crate::fit::filter_lanes::{FilterLanes, Lane, Reading};
use crate::fit::joint::{Attempts, JointFit, JointProblem};
use crate::fit::point::{Axis, MAX_MODE_CYCLES, MAX_MODE_GAIN, MIN_MODE_CYCLES, Parameter, Point};
use crate::fit::progress::SearchMonitor;
use crate::fit::response::{hysteresis, through};
use crate::fit::space::Space;
use crate::records::course::Course;
use crate::records::record::Record;
use crate::records::signal::{as_f64, mean};
use crate::terms::dynamics::{LinearPart, Mode, SampledPart};
use crate::terms::operators::BLOCK;
use crate::uncertainty::root::{Gradients, Quantity, Root};

/// Which share of the wanted decrease a candidate must promise: the descent sharpens it.
const PROMISED: f64 = 0.7;

/// How many passes over the records a start may take before the best of them goes on.
const PASSES: usize = 8;

impl JointProblem<'_> {
    /// The best fit with a mode more, from a point near by; none if none promises to lower the sum of squares by
    /// `wanted`.
    pub(crate) fn with_mode(
        &self,
        near: &JointFit,
        wanted: f64,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Option<JointFit>, Error> {
        let candidates = candidates(self.records, near, PROMISED * wanted);
        if candidates.is_empty() {
            return Ok(None);
        }
        let space = near.space.with_mode();
        let starts: Vec<Point> = candidates.iter().map(|one| start(&space, &near.fit.point, one.mode)).collect();
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor).map(Some)
    }

    /// How many standard errors the gain of the last mode is from 0, widened for correlated residuals; 0 where the
    /// records do not tell it.
    pub(crate) fn deviations_of_last_gain(&self, found: &JointFit) -> f64 {
        let last = found.space.modes() - 1;
        let root = Root::of(&found.fit, &found.linearised, &found.space, found.rows(self.records));
        let gradients = Gradients { fit: &found.fit, basis: self.basis, space: &found.space };
        let error = root.error_of(&gradients.of(Quantity::Gain(last))) * self.colour(found).correlation_time.sqrt();
        let gain = found.space.linear_part(&found.fit.point).modes()[last].gain;
        if error > 0.0 { gain.abs() / error } else { 0.0 }
    }

    /// The best fit with the same modes and no amplifier, from a point near by: the dead time takes over its lag.
    pub(crate) fn without_amplifier(
        &self,
        near: &JointFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let (space, point) = (near.space.without_amplifier(), near.fit.point);
        let lag = near.space.linear_part(&point).amplifier_lag();
        let point = space.axis(Parameter::DeadTime).map_or(point, |axis| {
            let dead_time = point.get(Parameter::DeadTime) + lag;
            point.with(Parameter::DeadTime, dead_time.clamp(axis.lower, axis.upper))
        });
        self.search_from(space, &point, monitor)
    }
}

/// A point with this mode as the last one, within the bounds of the search: a scan may have found it just beyond.
fn start(space: &Space, point: &Point, mode: Mode) -> Point {
    let number = space.modes() - 2;
    let values = [
        (Parameter::ModeLogFrequency(number), mode.frequency.ln()),
        (Parameter::ModeLogDamping(number), mode.damping.ln()),
        (Parameter::ModeGain(number), mode.gain),
    ];
    let within =
        |parameter, value: f64| space.axis(parameter).map_or(value, |axis| value.clamp(axis.lower, axis.upper));
    values.into_iter().fold(*point, |point, (parameter, value)| point.with(parameter, within(parameter, value)))
}

impl JointFit {
    /// Whether every mode is one of its own: apart from the others, and the further ones within the bounds of their
    /// search.
    pub(crate) fn has_distinct_modes(&self) -> bool {
        let modes = self.space.linear_part(&self.fit.point).modes();
        let is_apart = |(number, one): (usize, &Mode)| {
            modes[..number].iter().all(|other| !are_near(one.frequency, other.frequency))
        };
        let is_inside = |axis: &Axis| !axis.parameter.is_of_further_mode() || axis.is_inside(&self.fit.point);
        modes.iter().enumerate().all(is_apart) && self.space.axes().iter().all(is_inside)
    }
}

/// A mode with its best share in the static gain, and by how much it lowers the sum of squares to first order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) mode: Mode,
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
pub(crate) fn candidates(records: &[Record<'_>], near: &JointFit, worth: f64) -> Vec<Candidate> {
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

fn are_near(one: f64, other: f64) -> bool {
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
            let mut creep = SampledPart::new(&part, dt).creep_at(output.first().copied());
            let input = output.iter().map(|h| creep.step(*h)).collect();
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
            let mean = mean(rows);
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

/// So many modes at a time, with the first one, go through a record: what they need stays in the nearest cache.
const MODES: usize = 4 * LANES - 1;

/// For each mode the products of the difference that it makes, which is how far its answer is from that of the first
/// mode.
struct Products {
    squares: Vec<f64>,
    with_residual: Vec<f64>,
    with_columns: Vec<Vec<f64>>,
}

impl Products {
    fn new(scan: &Scan, modes: &[Mode]) -> Self {
        let columns = vec![Vec::with_capacity(modes.len()); scan.columns.len()];
        let (squares, with_residual) = (Vec::with_capacity(modes.len()), Vec::with_capacity(modes.len()));
        let mut all = Self { squares, with_residual, with_columns: columns };
        for modes in modes.chunks(MODES) {
            all.append(scan, modes);
        }
        all
    }

    fn append(&mut self, scan: &Scan, modes: &[Mode]) {
        let parts: Vec<LinearPart> = std::iter::once(scan.first.clone())
            .chain(modes.iter().map(|mode| LinearPart { dynamics: Some(mode.dynamics()), ..scan.first.clone() }))
            .collect();
        let eights = parts.len().div_ceil(LANES);
        let mut totals = vec![Sums::zero(scan.columns.len()); eights];
        for signals in &scan.signals {
            let sampled: Vec<_> = parts.iter().map(|part| SampledPart::new(part, signals.dt)).collect();
            let lane = |part| Lane { direct: 1.0, amplitudes: &[], part, reading: Reading::FromInput };
            let lanes: Vec<_> = sampled.iter().map(lane).collect();
            let mut filters = FilterLanes::new(&[], &lanes);
            let mut sums = vec![Sums::zero(scan.columns.len()); eights];
            let (mut inputs, mut answers) = (vec![[0.0; LANES]; eights * BLOCK], vec![[0.0; LANES]; eights * BLOCK]);
            // Before the record the modes are at rest; behind its end the last sample is held.
            let sources = signals.samples().map(|sample| sampled[0].source(sample)).zip(signals.rows.clone());
            let mut rows = sources.filter_map(|(source, row)| Some((source?, row))).peekable();
            let (mut taken, last) = (0, signals.input.len() - 1);
            let mut places = Vec::with_capacity(BLOCK);
            while rows.peek().is_some() {
                for block in inputs.chunks_exact_mut(BLOCK) {
                    for (lanes, sample) in block.iter_mut().zip(taken..) {
                        *lanes = [signals.input[sample.min(last)]; LANES];
                    }
                }
                filters.put_out(BLOCK, &inputs, &mut answers);
                places.clear();
                while let Some((source, row)) = rows.next_if(|(source, _)| *source < taken + BLOCK) {
                    places.push((source - taken, row));
                }
                let first: [f64; BLOCK] = std::array::from_fn(|k| answers[k][0]);
                for (sums, answers) in sums.iter_mut().zip(answers.chunks_exact(BLOCK)) {
                    dispatch(Add { scan, sums, answers, first: &first, places: &places });
                }
                taken += BLOCK;
            }
            for (total, sums) in totals.iter_mut().zip(&sums) {
                total.add_centred(sums, as_f64(signals.rows.len()));
            }
        }
        let lanes = |sums: fn(&Sums) -> &Lanes| totals.iter().flat_map(sums).copied().skip(1).take(modes.len());
        self.squares.extend(lanes(|sums| &sums.squares));
        self.with_residual.extend(lanes(|sums| &sums.with_residual));
        for (number, column) in self.with_columns.iter_mut().enumerate() {
            let all = totals.iter().flat_map(|sums| sums.with_columns[number]).skip(1).take(modes.len());
            column.extend(all);
        }
    }
}

/// Sums over rows, of eight modes.
#[derive(Clone)]
struct Sums {
    differences: Lanes,
    squares: Lanes,
    with_residual: Lanes,
    with_columns: Vec<Lanes>,
}

impl Sums {
    fn zero(columns: usize) -> Self {
        let zero = [0.0; LANES];
        Self { differences: zero, squares: zero, with_residual: zero, with_columns: vec![zero; columns] }
    }

    /// Adds those of a record, about the means of the differences; residual and columns have none.
    fn add_centred(&mut self, record: &Self, rows: f64) {
        let add = |to: &mut Lanes, what: &Lanes| to.iter_mut().zip(what).for_each(|(to, what)| *to += what);
        let centred = std::array::from_fn(|i| record.squares[i] - record.differences[i].powi(2) / rows);
        add(&mut self.squares, &centred);
        add(&mut self.with_residual, &record.with_residual);
        for (to, what) in self.with_columns.iter_mut().zip(&record.with_columns) {
            add(to, what);
        }
    }
}

/// Adds the rows of a block.
struct Add<'a> {
    scan: &'a Scan,
    sums: &'a mut Sums,
    answers: &'a [Lanes],
    first: &'a [f64],
    /// Where in the block the rows are, and which they are.
    places: &'a [(usize, usize)],
}

impl SimdLoop for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { scan, sums, answers, first, places } = self;
        let difference = |k: usize| load(simd, &answers[k]) - splat(simd, first[k]);
        let mut of_all = load(simd, &sums.differences);
        let mut squares = load(simd, &sums.squares);
        let mut with_residual = load(simd, &sums.with_residual);
        for (k, row) in places {
            let difference = difference(*k);
            of_all += difference;
            squares = difference.mul_add(difference, squares);
            with_residual = difference.mul_add(splat(simd, scan.residual[*row]), with_residual);
        }
        sums.differences = of_all.into();
        sums.squares = squares.into();
        sums.with_residual = with_residual.into();
        for (sum, column) in sums.with_columns.iter_mut().zip(&scan.columns) {
            let mut with_column = load(simd, sum);
            for (k, row) in places {
                with_column = difference(*k).mul_add(splat(simd, column[*row]), with_column);
            }
            *sum = with_column.into();
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::options::Options;
    use crate::terms::dynamics::{DynamicsModel, Order};

    use super::*;

    #[test]
    fn starts_lie_within_the_bounds_of_their_search() {
        let input: Vec<f64> = (0..400).map(|k| (f64::from(k) / 9.0).sin()).collect();
        let record = Record::new(&input, &input, 0).unwrap();
        let dynamics = DynamicsModel::Order(Order::Second);
        let options = Options { dt: Some(1e-3), dynamics, ..Options::default() };
        let space = Space::new(&[record], &options).unwrap().with_mode();
        let beyond = Mode { frequency: 1.0, damping: 0.9, gain: -7.0 };
        let start = start(&space, space.origin(), beyond);
        for axis in space.axes().iter().filter(|axis| axis.parameter.is_of_further_mode()) {
            let value = start.get(axis.parameter);
            assert!((axis.lower..=axis.upper).contains(&value), "{:?} {value}", axis.parameter);
        }
    }
}
