//! The output of the model and its derivatives, row by row.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use pulp::{Arch, Simd, WithSimd};

use super::creep_lanes::CreepLanes;
use super::lanes::DynamicLanes;
use super::linear_part::{LinearPart, SampledPart};
use super::regressor::{OperatorsAt, Regressor};

/// How the derivative by a searched parameter is made.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Slope {
    /// By a parameter of the operators or of the maps and the amplifier beside them: those of a neighbour, and how far away it
    /// is.
    Operators(OperatorsAt, f64),
    /// By the bandwidth of the amplifier: the operators of a neighbour, the dynamics that it has, and how far away it is.
    Amplifier(OperatorsAt, LinearPart, f64),
    /// By the dead time.
    DeadTime,
    /// By a parameter of the dynamics: those of a neighbour, and how far away it is.
    Dynamics(LinearPart, f64),
    /// By an amplitude of creep: what its unit makes of every c_j.
    Creep(Vec<f64>),
}

/// The model at a point with its tangent: the columns of the weights, and the derivatives by the searched parameters.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Tangent {
    pub(crate) operators: OperatorsAt,
    pub(crate) linear: LinearPart,
    /// How many columns there are.
    pub(crate) columns: usize,
    /// One for each column: those at which derivatives and the slope of an output map are taken; none where there are neither.
    pub(crate) weights: Vec<f64>,
    pub(crate) slopes: Vec<Slope>,
}

impl Tangent {
    /// The rows of a record, before the first; `dt` in the unit of the dead time.
    pub(crate) fn rows<'a>(&'a self, input: &'a [f64], dt: f64) -> TangentRows<'a> {
        let dead_time_alone = self.linear.is_dead_time_alone();
        let is_plain = dead_time_alone && self.linear.dead_time >= 0.0;
        let rows = if is_plain {
            Rows::Plain(Box::new(PlainRows::new(self, input, dt)))
        } else {
            Rows::Filtered(Box::new(FilteredRows::new(self, input, dt)))
        };
        TangentRows { rows, arch: Arch::new() }
    }
}

/// The rows of one record: \[columns | derivatives\].
pub(crate) struct TangentRows<'a> {
    rows: Rows<'a>,
    arch: Arch,
}

enum Rows<'a> {
    /// Hysteresis and a dead time: between rows only the turns of the input need to be seen.
    Plain(Box<PlainRows<'a>>),
    /// With dynamics or creep every sample counts.
    Filtered(Box<FilteredRows<'a>>),
}

impl TangentRows<'_> {
    /// Goes to a sample, not before the last one, and writes its row, with the widest instructions of the processor. `turns` as
    /// for [`Regressor::go_to`]. Returns what is known beside the columns, as [`Regressor::row`].
    pub(crate) fn write(&mut self, sample: usize, turns: Option<&[usize]>, row: &mut [f64]) -> f64 {
        self.arch.dispatch(Write { rows: &mut self.rows, sample, turns, row })
    }
}

/// See [`TangentRows::write`].
struct Write<'r, 'a> {
    rows: &'r mut Rows<'a>,
    sample: usize,
    turns: Option<&'r [usize]>,
    row: &'r mut [f64],
}

impl WithSimd for Write<'_, '_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> f64 {
        match self.rows {
            Rows::Plain(rows) => rows.write(self.sample, self.turns, self.row),
            Rows::Filtered(rows) => rows.write(self.sample, self.row),
        }
    }
}

/// See [`Rows::Plain`].
struct PlainRows<'a> {
    tangent: &'a Tangent,
    dt: f64,
    here: Regressor<'a>,
    there: Vec<Option<(Regressor<'a>, f64)>>,
}

impl<'a> PlainRows<'a> {
    fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
        let delay = tangent.linear.dead_time / dt;
        let start = |at: &'a OperatorsAt| Regressor::new(at, input, delay, dt);
        let there = |slope: &'a Slope| match slope {
            Slope::Operators(at, distance) => Some((start(at), *distance)),
            _ => None,
        };
        Self { tangent, dt, here: start(&tangent.operators), there: tangent.slopes.iter().map(there).collect() }
    }

    #[inline(always)]
    fn write(&mut self, sample: usize, turns: Option<&[usize]>, row: &mut [f64]) -> f64 {
        let weights = &self.tangent.weights;
        let (columns, slopes) = row.split_at_mut(self.tangent.columns);
        self.here.go_to(sample, turns);
        let known = self.here.row(weights, columns);
        if slopes.is_empty() {
            return known;
        }
        let output = self.here.output(weights);
        for (slope, there) in slopes.iter_mut().zip(&mut self.there) {
            *slope = match there {
                Some((there, distance)) => {
                    there.go_to(sample, turns);
                    (there.output(weights) - output) / *distance
                }
                // Only the dead time has no neighbour here: an amplifier comes with dynamics.
                None => self.here.slope_over_delay(weights) / self.dt,
            };
        }
        known
    }
}

/// See [`Rows::Filtered`].
struct FilteredRows<'a> {
    tangent: &'a Tangent,
    dt: f64,
    samples: usize,
    part: SampledPart,
    here: Regressor<'a>,
    /// The operators of the neighbours, and how far away they are.
    there: Vec<(Regressor<'a>, f64)>,
    /// \[columns, their weighted sum, its derivatives by parameters of the operators, what is known\], and then through creep.
    signals: Vec<f64>,
    creep: CreepLanes,
    /// The same, and the derivatives by amplitudes of creep: through the dynamics.
    behind_creep: Vec<f64>,
    main: DynamicLanes,
    /// The weighted sum through neighbouring dynamics, and how far away they are.
    neighbours: Vec<(DynamicLanes, f64)>,
    readings: Vec<f64>,
    /// How many samples were put out.
    taken: usize,
}

impl<'a> FilteredRows<'a> {
    fn new(tangent: &'a Tangent, input: &'a [f64], dt: f64) -> Self {
        let start = |at: &'a OperatorsAt| Regressor::new(at, input, 0.0, dt);
        let part = SampledPart::new(&tangent.linear, dt);
        let (mut there, mut neighbours, mut amplitudes) = (Vec::new(), Vec::new(), 0);
        for slope in &tangent.slopes {
            match slope {
                Slope::Operators(at, distance) => there.push((start(at), *distance)),
                Slope::Dynamics(linear, distance) => {
                    neighbours.push((DynamicLanes::new(&SampledPart::new(linear, dt), 1), *distance));
                }
                Slope::Amplifier(at, linear, distance) => {
                    there.push((start(at), *distance));
                    neighbours.push((DynamicLanes::new(&SampledPart::new(linear, dt), 1), *distance));
                }
                Slope::Creep(_) => amplitudes += 1,
                Slope::DeadTime => {}
            }
        }
        // Without derivatives there is no need of the weighted sum.
        let derivatives = if tangent.slopes.is_empty() { 0 } else { 1 + there.len() };
        let known = usize::from(tangent.operators.output_map.is_some());
        let creeping = tangent.columns + derivatives + known;
        let lanes = creeping + amplitudes;
        Self {
            tangent,
            dt,
            samples: input.len(),
            here: start(&tangent.operators),
            there,
            signals: vec![0.0; creeping],
            creep: CreepLanes::new(&part, creeping),
            behind_creep: vec![0.0; lanes],
            main: DynamicLanes::new(&part, lanes),
            neighbours,
            readings: vec![0.0; lanes],
            taken: 0,
            part,
        }
    }

    #[inline(always)]
    fn write(&mut self, sample: usize, row: &mut [f64]) -> f64 {
        // Before the record, and behind its end, the first and the last sample are held.
        let source = self.part.source(sample);
        let last = source.map_or(1, |source| source + 1);
        while self.taken < last {
            self.put_out();
        }
        let n = self.tangent.columns;
        let (columns, slopes) = row.split_at_mut(n);
        let before = source.is_none();
        let readings = &mut self.readings;
        if before {
            readings.copy_from_slice(&self.behind_creep);
        } else {
            self.main.read(readings);
        }
        columns.copy_from_slice(&readings[..n]);
        let (mut operators, mut amplitudes) = (n + 1, self.signals.len());
        let mut neighbours = self.neighbours.iter();
        let along = |neighbour: Option<&(DynamicLanes, f64)>| {
            neighbour.filter(|_| !before).map_or(0.0, |(lane, distance)| (lane.read_one(0) - readings[n]) / distance)
        };
        for (value, slope) in slopes.iter_mut().zip(&self.tangent.slopes) {
            *value = match slope {
                Slope::Operators(..) => next(readings, &mut operators),
                Slope::Creep(_) => next(readings, &mut amplitudes),
                Slope::DeadTime if before => 0.0,
                Slope::DeadTime => self.main.slope_over_dead_time(n, self.dt),
                Slope::Dynamics(..) => along(neighbours.next()),
                Slope::Amplifier(..) => next(readings, &mut operators) + along(neighbours.next()),
            };
        }
        self.tangent.operators.output_map.as_ref().map_or(0.0, |_| readings[self.signals.len() - 1])
    }

    /// Puts out the next sample.
    #[inline(always)]
    fn put_out(&mut self) {
        let (n, weights) = (self.tangent.columns, &self.tangent.weights);
        let sample = self.taken.min(self.samples - 1);
        self.here.go_to(sample, None);
        let known = self.here.row(weights, &mut self.signals[..n]);
        if self.tangent.operators.output_map.is_some() {
            let last = self.signals.len() - 1;
            self.signals[last] = known;
        }
        if !self.tangent.slopes.is_empty() {
            let output = self.here.output(weights);
            self.signals[n] = output;
            for (signal, (there, distance)) in self.signals[n + 1..].iter_mut().zip(&mut self.there) {
                there.go_to(sample, None);
                *signal = (there.output(weights) - output) / *distance;
            }
        }
        self.creep.settle(&self.signals);
        let (behind_creep, behind_amplitudes) = self.behind_creep.split_at_mut(self.signals.len());
        let directions = self.tangent.slopes.iter().filter_map(|slope| match slope {
            Slope::Creep(direction) => Some(direction),
            _ => None,
        });
        for (signal, direction) in behind_amplitudes.iter_mut().zip(directions) {
            *signal = self.creep.sum(direction, n);
        }
        self.creep.put_out(&self.signals, behind_creep);
        self.main.put_out(&self.behind_creep);
        for (lane, _) in &mut self.neighbours {
            lane.put_out(&self.behind_creep[n..=n]);
        }
        self.taken += 1;
    }
}

/// The value at a place, which moves on.
fn next(values: &[f64], place: &mut usize) -> f64 {
    *place += 1;
    values[*place - 1]
}
