//! Rows behind creep and dynamics, where every sample counts: made block by block.

use super::bank_lanes::BLOCK;
use super::eight::{LANES, Lanes};
use super::filter_lanes::{FilterLanes, Lane, Reading};
use super::linear_part::SampledPart;
use super::operator_blocks::{OperatorBlocks, set, signal};
use super::tangent::{Slope, Tangent};

/// The rows of one record; see [`TangentRows`](super::tangent::TangentRows).
pub(crate) struct FilteredRows<'a> {
    tangent: &'a Tangent,
    samples: usize,
    part: SampledPart,
    operators: OperatorBlocks<'a>,
    filters: FilterLanes,
    /// The signals of the operators, and copies of their output: one for each amplitude of creep, for the dead time, and for neighbouring
    /// dynamics, in this order.
    signals: Vec<Lanes>,
    copies: usize,
    readings: Vec<Lanes>,
    /// What is read before the record, once that has begun.
    rest: Vec<f64>,
    /// The samples of the last block.
    first: usize,
    taken: usize,
}

impl<'a> FilteredRows<'a> {
    pub(super) fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
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
        let signals = vec![[0.0; LANES]; lanes.len().div_ceil(LANES) * BLOCK];
        let copies = lanes.len() - operators.layout.end;
        let readings = signals.clone();
        let (rest, samples) = (Vec::new(), input.len());
        Self { tangent, samples, part, operators, filters, signals, copies, readings, rest, first: 0, taken: 0 }
    }

    pub(super) fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
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
        let (readings, k) = (&self.readings[..], source - self.first);
        layout.copy_columns(|eight| &readings[eight * BLOCK + k], columns);
        self.write_slopes(slopes, |lane| signal(readings, lane, k));
        if layout.end > layout.known { signal(readings, layout.known, k) } else { 0.0 }
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
