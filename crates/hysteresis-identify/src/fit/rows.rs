//! The rows of the fit: the columns of the weights, and the derivatives of the output by what is searched.
//!
//! Operators are made block by block, for the point and for a neighbour along every axis. Behind a dead time alone only
//! the turns of the input need to be seen between rows. Behind creep and dynamics every sample counts.

use crate::algebra::eight::{LANES, Lanes};
use crate::fit::filter_lanes::{FilterLanes, Lane, Reading};
use crate::fit::operator_blocks::{OperatorBlocks, set};
use crate::fit::response::interpolated;
use crate::fit::tangent::{Slope, Tangent};
use crate::records::course::{Course, SeenSamples};
use crate::terms::dynamics::SampledPart;
use crate::terms::operators::BLOCK;

impl Tangent {
    /// The rows of a record, before the first; `dt` in the unit of the dead time. With a course they are those of its
    /// samples, one after the other; without, those of any.
    pub(crate) fn rows<'a>(&'a self, input: &'a [f64], dt: f64, course: Option<&'a Course>) -> TangentRows<'a> {
        let dead_time_alone = self.linear.is_dead_time_alone();
        let is_plain = dead_time_alone && self.linear.dead_time >= 0.0;
        if is_plain {
            TangentRows::Plain(Box::new(PlainRows::new(self, input, dt, course)))
        } else {
            TangentRows::Filtered(Box::new(FilteredRows::new(self, input, dt)))
        }
    }
}

/// The rows of one record: \[columns | derivatives\], with the widest instructions of the processor.
pub(crate) enum TangentRows<'a> {
    /// Hysteresis and a dead time: between rows only the turns of the input need to be seen.
    Plain(Box<PlainRows<'a>>),
    /// With dynamics or creep every sample counts.
    Filtered(Box<FilteredRows<'a>>),
}

impl TangentRows<'_> {
    /// Goes to a sample, not before the last one, and writes its row. Returns what is known beside the columns: zero
    /// without an output map and a Duhem operator.
    pub(crate) fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
        match self {
            Self::Plain(rows) => rows.write(sample, row),
            Self::Filtered(rows) => rows.write(sample, row),
        }
    }
}

/// The rows of one record; see [`TangentRows`].
pub(crate) struct PlainRows<'a> {
    tangent: &'a Tangent,
    dt: f64,
    /// The dead time in whole samples, and what is left of it.
    whole: usize,
    fraction: f64,
    to_see: SeenSamples<'a>,
    operators: OperatorBlocks<'a>,
    signals: Vec<Lanes>,
    /// The last sample of the block before.
    tail: Vec<Lanes>,
    samples: [usize; BLOCK],
    count: usize,
    /// Which of the block is the newest that a row needs.
    at: usize,
    row: Vec<Lanes>,
}

impl<'a> PlainRows<'a> {
    pub(crate) fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64, course: Option<&'a Course>) -> Self {
        let delay = tangent.linear.dead_time / dt;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let operators = OperatorBlocks::new(tangent, input, dt);
        let eights = operators.layout.end.div_ceil(LANES);
        let course = course.filter(|_| tangent.operators.need_turns_alone());
        Self {
            tangent,
            dt,
            whole,
            fraction: delay - delay.floor(),
            to_see: SeenSamples::new(input.len(), course, whole),
            operators,
            signals: vec![[0.0; LANES]; eights * BLOCK],
            tail: vec![[0.0; LANES]; eights],
            samples: [0; BLOCK],
            count: 0,
            at: 0,
            row: vec![[0.0; LANES]; eights],
        }
    }

    pub(crate) fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
        let newest = sample.saturating_sub(self.whole);
        while self.count == 0 || self.samples[self.at] < newest {
            if self.at + 1 < self.count {
                self.at += 1;
            } else if !self.put_out() {
                break;
            }
        }
        let layout = self.operators.layout;
        for ((lanes, block), tail) in self.row.iter_mut().zip(self.signals.chunks_exact(BLOCK)).zip(&self.tail) {
            let (now, before) = (block[self.at], if self.at == 0 { *tail } else { block[self.at - 1] });
            *lanes = std::array::from_fn(|i| interpolated(now[i], before[i], self.fraction));
        }
        let lanes = &self.row;
        let signal = |lane: usize| lanes[lane / LANES][lane % LANES];
        let (columns, slopes) = row.split_at_mut(self.tangent.columns);
        layout.copy_columns(|eight| &lanes[eight], columns);
        let mut derivatives = layout.derivatives..;
        for (value, slope) in slopes.iter_mut().zip(&self.tangent.slopes) {
            *value = match slope {
                Slope::Operators(..) | Slope::Amplifier(..) => derivatives.next().map_or(0.0, signal),
                // Only the dead time has no neighbour here.
                _ => self.slope_over_dead_time(),
            };
        }
        if layout.end > layout.known { signal(layout.known) } else { 0.0 }
    }

    fn slope_over_dead_time(&self) -> f64 {
        let (eight, lane) = (self.operators.layout.output / LANES, self.operators.layout.output % LANES);
        let block = &self.signals[eight * BLOCK..];
        let before = if self.at == 0 { &self.tail[eight] } else { &block[self.at - 1] };
        (before[lane] - block[self.at][lane]) / self.dt
    }

    /// Goes on by a block; says whether there was any.
    fn put_out(&mut self) -> bool {
        let mut samples = [0; BLOCK];
        let mut count = 0;
        for (place, sample) in samples.iter_mut().zip(&mut self.to_see) {
            *place = sample;
            count += 1;
        }
        if count == 0 {
            return false;
        }
        let is_first = self.count == 0;
        for (tail, block) in self.tail.iter_mut().zip(self.signals.chunks_exact(BLOCK)) {
            *tail = block[self.at];
        }
        self.operators.put_out(&samples[..count], &mut self.signals);
        if is_first {
            // Samples before the record's start hold the first one.
            for (tail, block) in self.tail.iter_mut().zip(self.signals.chunks_exact(BLOCK)) {
                *tail = block[0];
            }
        }
        (self.samples, self.count, self.at) = (samples, count, 0);
        true
    }
}

/// The rows of one record; see [`TangentRows`].
pub(crate) struct FilteredRows<'a> {
    tangent: &'a Tangent,
    samples: usize,
    part: SampledPart,
    operators: OperatorBlocks<'a>,
    filters: FilterLanes,
    /// The signals of the operators, and copies of their output: one for each amplitude of creep, for the dead time,
    /// and for neighbouring dynamics, in this order.
    signals: Vec<Lanes>,
    copies: usize,
    readings: Vec<Lanes>,
    row: Vec<Lanes>,
    /// What is read before the record, once that has begun.
    rest: Vec<f64>,
    /// The samples of the last block.
    first: usize,
    taken: usize,
}

/// Filters learn to pass still blocks in records of so many blocks: it takes them about as long as fifteen.
const LEAST_BLOCKS: usize = 256;

impl<'a> FilteredRows<'a> {
    pub(crate) fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
        Self::passing(tangent, input, dt, input.len() >= LEAST_BLOCKS * BLOCK)
    }

    /// The same, filters passing still blocks or not.
    fn passing(tangent: &'a Tangent, input: &'a [f64], dt: f64, passes: bool) -> Self {
        let operators = OperatorBlocks::new(tangent, input, dt);
        let part = SampledPart::new(&tangent.linear, dt);
        let neighbours: Vec<_> = tangent
            .slopes
            .iter()
            .filter_map(|slope| match slope {
                Slope::Dynamics(linear, _) | Slope::Amplifier(_, linear, _) => Some(SampledPart::new(linear, dt)),
                _ => None,
            })
            .collect();
        let through = |part, reading| Lane { direct: 1.0, amplitudes: &tangent.linear.amplitudes, part, reading };
        let mut lanes: Vec<_> = (0..operators.layout.end).map(|_| through(&part, Reading::Position)).collect();
        for slope in &tangent.slopes {
            if let Slope::Creep(amplitudes) = slope {
                lanes.push(Lane { direct: 0.0, amplitudes, part: &part, reading: Reading::Position });
            }
        }
        if tangent.slopes.contains(&Slope::DeadTime) {
            lanes.push(through(&part, Reading::OverDeadTime(dt)));
        }
        lanes.extend(neighbours.iter().map(|part| through(part, Reading::Position)));
        let filters = FilterLanes::new(&part.decays, &lanes);
        let filters = if passes { filters.passing_still_blocks() } else { filters };
        let row = vec![[0.0; LANES]; lanes.len().div_ceil(LANES)];
        let signals = vec![[0.0; LANES]; row.len() * BLOCK];
        let copies = lanes.len() - operators.layout.end;
        let readings = signals.clone();
        let (rest, samples) = (Vec::new(), input.len());
        Self { tangent, samples, part, operators, filters, signals, copies, readings, row, rest, first: 0, taken: 0 }
    }

    pub(crate) fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
        // Before the record, and behind its end, the first and the last sample are held.
        let source = self.part.source(sample);
        while self.taken <= source.unwrap_or(0) {
            self.put_out(source.unwrap_or(0));
        }
        let (columns, slopes) = row.split_at_mut(self.tangent.columns);
        let layout = self.operators.layout;
        let Some(source) = source else {
            self.write_at_rest(columns, slopes);
            return if layout.end > layout.known { self.rest[layout.known] } else { 0.0 };
        };
        self.filters.row(source - self.first, &self.readings, &mut self.row);
        let lanes = &self.row;
        let reading = |lane: usize| lanes[lane / LANES][lane % LANES];
        layout.copy_columns(|eight| &lanes[eight], columns);
        self.write_slopes(slopes, reading);
        if layout.end > layout.known { reading(layout.known) } else { 0.0 }
    }

    fn write_at_rest(&self, columns: &mut [f64], slopes: &mut [f64]) {
        for (number, value) in columns.iter_mut().enumerate() {
            *value = self.rest[self.operators.layout.lane(number)];
        }
        self.write_slopes(slopes, |lane| self.rest[lane]);
    }

    fn write_slopes(&self, slopes: &mut [f64], reading: impl Fn(usize) -> f64) {
        let layout = &self.operators.layout;
        let amplitudes = self.tangent.slopes.iter().filter(|slope| matches!(slope, Slope::Creep(_))).count();
        let (mut operators, mut amplitude, over_dead_time) = (layout.derivatives, layout.end, layout.end + amplitudes);
        let mut neighbour = over_dead_time + usize::from(self.tangent.slopes.contains(&Slope::DeadTime));
        for (value, slope) in slopes.iter_mut().zip(&self.tangent.slopes) {
            let next = |place: &mut usize| {
                *place += 1;
                reading(*place - 1)
            };
            *value = match slope {
                Slope::Operators(..) => next(&mut operators),
                Slope::Creep(_) => next(&mut amplitude),
                Slope::DeadTime => reading(over_dead_time),
                Slope::Dynamics(_, distance) => (next(&mut neighbour) - reading(layout.output)) / distance,
                Slope::Amplifier(_, _, distance) => {
                    next(&mut operators) + (next(&mut neighbour) - reading(layout.output)) / distance
                }
            };
        }
    }

    /// Puts out the next block: no further than the record goes, or the sample that is needed.
    fn put_out(&mut self, needed: usize) {
        let (first, last) = (self.taken, self.samples - 1);
        let end = (first + BLOCK).min((needed + 1).max(self.samples));
        let (begin, count) = (self.operators.layout.end, end - first);
        let samples: [usize; BLOCK] = std::array::from_fn(|k| (first + k).min(last));
        self.operators.put_out(&samples[..count], &mut self.signals);
        for copy in begin..begin + self.copies {
            set(&mut self.signals, copy, &self.operators.output[..count]);
        }
        self.filters.put_out(count, &self.signals, &mut self.readings);
        if first == 0 {
            self.rest = (0..begin + self.copies).map(|lane| self.filters.at_rest(lane)).collect();
        }
        (self.first, self.taken) = (first, end);
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Ratios;
    use proptest::prelude::*;

    use crate::fit::point::Parameter;
    use crate::fit::response::{OperatorsAt, Regressor, response};
    use crate::fit::space::Space;
    use crate::options::Options;
    use crate::records::record::Record;
    use crate::terms::creep::CreepModel;
    use crate::terms::duhem::DuhemTable;
    use crate::terms::dynamics::{DynamicsModel, LinearPart, Order};
    use crate::terms::loop_shift::LoopShiftModel;
    use crate::terms::maps::{Curve, OutputMap};
    use crate::terms::operators::{OperatorBank, Thresholds};
    use crate::terms::slow_gain::SlowGainModel;

    use super::*;

    /// The rows of a drive that moves, rests and moves again are the same whether filters pass still blocks or take
    /// them sample by sample, and the output is that of the plain loops.
    #[test]
    fn still_blocks_are_passed_to_the_same_rows() {
        let way = |k: u32| 3.0 * (f64::from(k) / 30.0).sin() + 1.2 * (f64::from(k) / 7.0).sin();
        let small = |k: u32| way(400) + 0.01 * (f64::from(k) / 3.0).sin();
        let input: Vec<f64> = (0..400)
            .map(way)
            .chain(std::iter::repeat_n(way(400), 213))
            .chain((0..300).map(small))
            .chain(std::iter::repeat_n(small(300), 150))
            .chain((0..77).map(way))
            .collect();
        let record = Record::new(&input, &input, 0).unwrap().sampled_every(0.01).unwrap();
        let records = [record];
        let plain = Options {
            thresholds: Thresholds::Uniform(20),
            dynamics: DynamicsModel::Order(Order::Second),
            creep: CreepModel::TimeConstants(vec![0.3, 1.0]),
            slow_gain: SlowGainModel::None,
            loop_shift: LoopShiftModel::None,
            ..Options::default()
        };
        let shifted = Options { loop_shift: LoopShiftModel::Both(0.3), ..plain.clone() };
        let map = OutputMap { bounds: (-4.0, 5.0), reference: [0.3; 20].into() };
        let space = |options: &Options| Space::new(&records, options).unwrap();
        let origin = |space: Space| (*space.origin(), space);
        let with_gain = space(&plain);
        let (with_gain, at) = with_gain.with_slow_gain(SlowGainModel::TimeConstant(3.0), with_gain.origin()).unwrap();
        let spaces = [
            origin(space(&plain)),
            origin(space(&plain).with_amplifier()),
            origin(space(&plain).with_input_map().with_output_map(map).with_amplifier()),
            origin(space(&shifted)),
            (at.with(Parameter::SlowGain, 0.1), with_gain),
        ];
        for (number, (point, space)) in spaces.iter().enumerate() {
            let columns = plain.weight_basis(space.sides()).columns();
            let weights: Vec<f64> = (1_u32..).take(columns).map(|i| 0.5 / f64::from(i)).collect();
            let point = point.with(Parameter::Creep(0), 0.02).with(Parameter::Creep(1), 0.03);
            let tangent = space.tangent(&point, columns, Some(&weights));
            let want = response(&tangent.operators, &weights, &tangent.linear, &input, 0.01);
            let mut both = [true, false].map(|passes| FilteredRows::passing(&tangent, &input, 0.01, passes));
            let mut rows = [true, false].map(|_| vec![0.0; columns + tangent.slopes.len()]);
            for (k, want) in want.iter().enumerate() {
                let known: Vec<f64> = both.iter_mut().zip(&mut rows).map(|(one, row)| one.write(k, row)).collect();
                assert!((known[0] - known[1]).abs() < 1e-9);
                let output: f64 = rows[0].iter().zip(&weights).map(|(column, weight)| column * weight).sum();
                assert!((output + known[0] - want).abs() < 1e-9, "{number} {k}: {output} {want}");
                for (passed, taken) in rows[0].iter().zip(&rows[1]) {
                    // Derivatives are differences over a millionth of a parameter.
                    assert!((passed - taken).abs() < 1e-7 * (1.0 + taken.abs()), "{number} {k}: {passed} {taken}");
                }
            }
        }
    }

    proptest! {
        /// The rows of the regressor, sample by sample, thinned or not: columns bit for bit, derivatives but for
        /// rounding.
        #[test]
        fn equals_the_regressor(
            moving in prop::collection::vec(prop_oneof![-10.0..10.0_f64, Just(1.0)], 5..150),
            r in prop::collection::vec(0.0..8.0_f64, 1..12),
            delay in prop_oneof![0.0..5.0_f64, Just(0.0), Just(2.0)],
            stride in 1_usize..5,
            families in 1_usize..3,
            (has_map, has_duhem) in any::<(bool, bool)>(),
        ) {
            // It stands still for some blocks, and goes on.
            let (first, last) = (moving[0], moving[moving.len() - 1]);
            let input: Vec<f64> =
                moving.into_iter().chain(std::iter::repeat_n(last, 3 * BLOCK)).chain([first, last]).collect();
            // An input that never moves is no record.
            prop_assume!(input[3..].iter().any(|u| *u != input[3]));
            let record = Record::new(&input, &input, 3).unwrap();
            let course = Course::new(&record, stride, 0).with_all_turns(&input);
            let map = has_map.then(|| Curve::new((-10.0, 10.0), [0.3, 0.1, 0.0]));
            let duhem = |back| has_duhem.then(|| DuhemTable::bouc_wen(4.0, back));
            let at = |ra| OperatorsAt {
                output_map: map.clone(),
                duhem: duhem(1.0),
                ..OperatorsAt::alone(OperatorBank::from_ratios(&r, Ratios { ra, ..Ratios::PAPER }), 0.5)
            };
            let weights: Vec<f64> = (1_u32..).take(families * r.len()).map(|i| 0.2 / f64::from(i)).collect();
            let dt = 0.5;
            let tangent = Tangent {
                operators: at(0.9),
                linear: LinearPart::delay(delay * dt),
                columns: weights.len(),
                weights: weights.clone(),
                slopes: vec![
                    Slope::Operators(at(0.8), -0.1),
                    Slope::DeadTime,
                    Slope::Operators(OperatorsAt { duhem: duhem(1.9), ..at(0.9) }, 0.2),
                ],
            };
            let (neighbour, bent) = (at(0.8), OperatorsAt { duhem: duhem(1.9), ..at(0.9) });
            let mut rows = PlainRows::new(&tangent, &input, dt, Some(&course));
            let start = |at| Regressor::new(at, &input, delay, dt);
            let (mut here, mut there, mut aside) = (start(&tangent.operators), start(&neighbour), start(&bent));
            let (mut got, mut want) = (vec![0.0; weights.len() + 3], vec![0.0; weights.len()]);
            for number in 0..course.len() {
                let k = course.sample(number);
                let known = rows.write(k, &mut got);
                here.go_to(k);
                there.go_to(k);
                aside.go_to(k);
                let known_there = here.row(&weights, &mut want);
                let (columns, slopes) = got.split_at(weights.len());
                let is_close = |got: f64, want: f64| (got - want).abs() < 1e-10;
                for (got, want) in columns.iter().zip(&want) {
                    prop_assert!(if has_map { is_close(*got, *want) } else { got == want }, "sample {}", k);
                }
                prop_assert!(is_close(known, known_there), "sample {}: {} {}", k, known, known_there);
                let slope = (there.output(&weights) - here.output(&weights)) / -0.1;
                prop_assert!(is_close(slopes[0], slope), "sample {}: {} {}", k, slopes[0], slope);
                let slope = (aside.output(&weights) - here.output(&weights)) / 0.2;
                prop_assert!(is_close(slopes[2], slope), "sample {}: {} {}", k, slopes[2], slope);
                prop_assert!(is_close(slopes[1], here.slope_over_delay(&weights) / dt), "sample {}", k);
            }
        }
    }
}
