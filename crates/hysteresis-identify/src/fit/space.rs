//! Where the search may go: the parameters that enter the model nonlinearly, their bounds and scales.

use hysteresis_core::Ratios;

use crate::fit::course::turns;
use crate::fit::regressor::OperatorBank;
use crate::numeric::as_f64;
use crate::options::{ModelKind, Options, Setting, Thresholds};
use crate::record::Record;

/// The largest ra/r that is searched: the mirror image of an actuator with ra/r = 1/2.
const MAX_RA: f64 = 2.0;

/// How far beyond the range of the input its offset is searched, as a share of that range.
const OFFSET_MARGIN: f64 = 0.2;

/// The longest delay that is searched, as a share of the shortest record.
const MAX_DELAY_SHARE: f64 = 0.1;

/// The step of a finite difference, in scales: far above rounding, far below any curvature.
const DIFFERENCE_STEP: f64 = 1e-6;

/// Reversals nearer to each other than this share of the range count once.
const MERGED: f64 = 0.01;

/// A parameter that enters the model nonlinearly. rb is held as its share of ra, which turns ra >= rb into a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub(crate) enum Parameter {
    Ra,
    RbShare,
    Rc,
    InputOffset,
    Delay,
}

/// A value for every [`Parameter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point([f64; 5]);

impl Point {
    pub(crate) fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self.0[parameter as usize] = value;
        self
    }

    pub(crate) fn get(&self, parameter: Parameter) -> f64 {
        self.0[parameter as usize]
    }

    pub(crate) fn with_ratios(self, ratios: Ratios) -> Self {
        let share = if ratios.ra > 0.0 { ratios.rb / ratios.ra } else { 0.0 };
        self.with(Parameter::Ra, ratios.ra).with(Parameter::RbShare, share).with(Parameter::Rc, ratios.rc)
    }
}

/// A parameter that is searched, with its bounds and the size of a bold step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) parameter: Parameter,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    pub(crate) scale: f64,
}

/// The search space of one identification.
pub(crate) struct Space {
    model: ModelKind,
    thresholds: Thresholds,
    /// Kept beside the point, so that ratios that were given reach the model bit for bit.
    fixed_ratios: Option<Ratios>,
    input_low: f64,
    input_high: f64,
    /// The inputs at the reversals of every record, if the thresholds are made of them.
    reversals: Vec<Vec<f64>>,
    axes: Vec<Axis>,
    origin: Point,
}

impl Space {
    pub(crate) fn new(records: &[Record<'_>], options: &Options) -> Self {
        let (mut low, mut high, mut samples) = (f64::INFINITY, f64::NEG_INFINITY, usize::MAX);
        for record in records {
            low = low.min(record.input_bounds().0);
            high = high.max(record.input_bounds().1);
            samples = samples.min(record.input().len());
        }
        let range = high - low;
        let fixed_ratios = match (options.model, options.ratios) {
            (ModelKind::Conventional, _) => Some(Ratios::PLAY),
            (ModelKind::Modified, Setting::Fixed(ratios)) => Some(ratios),
            (ModelKind::Modified, Setting::Fit) => None,
        };
        let mut axes = Vec::new();
        let mut origin = Point([0.0; 5]).with_ratios(fixed_ratios.unwrap_or(Ratios::PAPER));
        if fixed_ratios.is_none() {
            let ratio = |parameter, upper| Axis { parameter, lower: 0.0, upper, scale: 1.0 };
            axes.extend([ratio(Parameter::Ra, MAX_RA), ratio(Parameter::RbShare, 1.0), ratio(Parameter::Rc, 1.0)]);
        }
        let offset = match options.input_offset {
            Setting::Fixed(offset) => offset,
            Setting::Fit => {
                if options.model == ModelKind::Modified {
                    let margin = OFFSET_MARGIN * range;
                    let parameter = Parameter::InputOffset;
                    axes.push(Axis { parameter, lower: low - margin, upper: high + margin, scale: range });
                }
                low + 0.5 * range
            }
        };
        origin = origin.with(Parameter::InputOffset, offset);
        match options.delay {
            Setting::Fixed(delay) => origin = origin.with(Parameter::Delay, delay),
            Setting::Fit => {
                let upper = MAX_DELAY_SHARE * as_f64(samples);
                axes.push(Axis { parameter: Parameter::Delay, lower: 0.0, upper, scale: 4.0 });
            }
        }
        let thresholds = options.thresholds.clone();
        let reversals = match thresholds {
            Thresholds::Quantiles(_) => records.iter().map(|record| reversals(record, MERGED * range)).collect(),
            _ => Vec::new(),
        };
        let model = options.model;
        Self { model, thresholds, fixed_ratios, input_low: low, input_high: high, reversals, axes, origin }
    }

    /// The searched parameters.
    pub(crate) fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The thresholds r_i at a point.
    pub(crate) fn thresholds(&self, point: &Point) -> Vec<f64> {
        let offset = point.get(Parameter::InputOffset);
        let reach = match self.model {
            ModelKind::Modified => (self.input_high - offset).abs().max((self.input_low - offset).abs()),
            ModelKind::Conventional => 0.5 * (self.input_high - self.input_low),
        };
        match &self.thresholds {
            // Cross-validation puts a number in place of this before a space is made.
            Thresholds::Auto | Thresholds::AutoQuantiles => Vec::new(),
            Thresholds::Given(thresholds) => thresholds.clone(),
            Thresholds::Uniform(n) => (0..*n).map(|i| as_f64(i) * reach / as_f64(*n)).collect(),
            Thresholds::Quantiles(n) => {
                let knots = self.amplitudes(offset, reach);
                (0..*n).map(|i| interpolated(&knots, as_f64(i) / as_f64(*n))).collect()
            }
        }
    }

    /// Zero, the amplitudes of the reversals in growing order and well apart, and the reach.
    fn amplitudes(&self, offset: f64, reach: f64) -> Vec<f64> {
        let mut amplitudes: Vec<f64> = match self.model {
            ModelKind::Modified => self.reversals.iter().flatten().map(|x| (x - offset).abs()).collect(),
            ModelKind::Conventional => {
                self.reversals.iter().flat_map(|x| x.windows(2).map(|x| 0.5 * (x[1] - x[0]).abs())).collect()
            }
        };
        amplitudes.sort_by(f64::total_cmp);
        let mut knots = vec![0.0];
        for amplitude in amplitudes {
            if amplitude - knots[knots.len() - 1] > MERGED * reach && amplitude < (1.0 - MERGED) * reach {
                knots.push(amplitude);
            }
        }
        knots.push(reach);
        knots
    }

    pub(crate) fn ratios(&self, point: &Point) -> Ratios {
        let ra = point.get(Parameter::Ra);
        let searched = Ratios { ra, rb: ra * point.get(Parameter::RbShare), rc: point.get(Parameter::Rc) };
        self.fixed_ratios.unwrap_or(searched)
    }

    /// The operators at a point.
    pub(crate) fn bank(&self, point: &Point) -> OperatorBank {
        OperatorBank::from_ratios(&self.thresholds(point), self.ratios(point))
    }

    /// The point moved by `step` along the axes, each within its bounds.
    pub(crate) fn moved(&self, point: &Point, step: &[f64]) -> Point {
        self.axes.iter().zip(step).fold(*point, |point, (axis, step)| {
            point.with(axis.parameter, (point.get(axis.parameter) + step).clamp(axis.lower, axis.upper))
        })
    }

    /// How far every axis lets a step go either way, `radius` scales at most.
    pub(crate) fn step_bounds(&self, point: &Point, radius: f64) -> Vec<(f64, f64)> {
        let within = |axis: &Axis| {
            let (value, reach) = (point.get(axis.parameter), radius * axis.scale);
            ((axis.lower - value).max(-reach), (axis.upper - value).min(reach))
        };
        self.axes.iter().map(within).collect()
    }

    /// For every axis a neighbour of the point within the bounds, and how far away it is.
    pub(crate) fn neighbours(&self, point: &Point) -> Vec<(Parameter, Point, f64)> {
        let neighbour = |axis: &Axis| {
            let value = point.get(axis.parameter);
            let step = DIFFERENCE_STEP * axis.scale;
            let other = if value + step <= axis.upper { value + step } else { value - step };
            (axis.parameter, point.with(axis.parameter, other), other - value)
        };
        self.axes.iter().map(neighbour).collect()
    }

    /// Where to look first: all combinations of a few ratios and input offsets, as far as they are searched.
    pub(crate) fn starts(&self) -> Vec<Point> {
        let ratios = [
            Ratios::PAPER,
            Ratios { ra: 0.95, rb: 0.65, rc: 0.65 },
            Ratios { ra: 0.6, rb: 0.3, rc: 0.35 },
            Ratios { ra: 1.6, rb: 0.6, rc: 0.35 },
            Ratios::PLAY,
        ];
        let mut starts = vec![self.origin];
        if self.searches(Parameter::Ra) {
            starts = ratios.iter().map(|ratios| self.origin.with_ratios(*ratios)).collect();
        }
        if self.searches(Parameter::InputOffset) {
            let range = self.input_high - self.input_low;
            let places = [0.5, 0.25, 0.75, 0.0, 1.0].map(|share| self.input_low + share * range);
            let at = |start: &Point| places.map(|place| start.with(Parameter::InputOffset, place));
            starts = starts.iter().flat_map(at).collect();
        }
        starts
    }

    /// Delays worth a look: doubling from one sample, if the delay is searched.
    pub(crate) fn delays(&self) -> Vec<f64> {
        let delay = self.axes.iter().find(|axis| axis.parameter == Parameter::Delay);
        let upper = delay.map_or(0.0, |axis| axis.upper);
        std::iter::successors(Some(1.0), |delay| Some(2.0 * delay)).take_while(|delay| *delay <= upper).collect()
    }

    fn searches(&self, parameter: Parameter) -> bool {
        self.axes.iter().any(|axis| axis.parameter == parameter)
    }
}

fn reversals(record: &Record<'_>, dead_band: f64) -> Vec<f64> {
    turns(record.input(), dead_band).into_iter().map(|k| record.input()[k]).collect()
}

/// The value a share of the way through evenly spaced knots, straight between them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the knots")]
fn interpolated(knots: &[f64], share: f64) -> f64 {
    let place = share * as_f64(knots.len() - 1);
    let below = (place as usize).min(knots.len() - 2);
    knots[below] + (place - as_f64(below)) * (knots[below + 1] - knots[below])
}
