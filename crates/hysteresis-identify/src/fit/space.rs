//! Where the search may go: the parameters that enter the model nonlinearly, their bounds and scales.

use std::sync::Arc;

use hysteresis_control::linear::{Dynamics, FirstOrder, SecondOrder};
use hysteresis_core::Ratios;

use super::intervals::Intervals;
use super::linear_part::LinearPart;
use super::own_columns::OwnColumns;
use super::placement::Placement;
use super::point::{Axis, Parameter, Point};
use super::regressor::{OperatorBank, OperatorsAt};
use super::shift::ShiftColumns;
use super::tangent::{Slope, Tangent};
use crate::creep_model::CreepBasis;
use crate::error::Error;
use crate::loop_shift_model::LoopShiftModel;
use crate::options::{ModelKind, Options, Order, Setting};
use crate::record::Record;

/// The largest ra/r that is searched: the mirror image of an actuator with ra/r = 1/2.
const MAX_RA: f64 = 2.0;

/// Where ratios are searched first.
const USUAL_RATIOS: [Ratios; 5] = [
    Ratios::PAPER,
    Ratios { ra: 0.95, rb: 0.65, rc: 0.65 },
    Ratios { ra: 0.6, rb: 0.3, rc: 0.35 },
    Ratios { ra: 1.6, rb: 0.6, rc: 0.35 },
    Ratios::PLAY,
];

/// How far beyond the range of the input its offset is searched, as a share of that range.
const OFFSET_MARGIN: f64 = 0.2;

/// The damping ratios that are searched.
const DAMPINGS: (f64, f64) = (1e-4, 10.0);

/// The highest frequency that is searched, in cycles per sample of the fastest record.
const MAX_CYCLES_PER_SAMPLE: f64 = 0.5;

/// The lowest frequency that is searched, in cycles per longest record.
const MIN_CYCLES_PER_RECORD: f64 = 1.0;

/// The largest amplitude of creep that is searched, per unit of its parameter: as a share of the position, per decade for
/// log-type creep.
const MAX_AMPLITUDE: f64 = 1.0;

/// The step of a finite difference, in scales: far above rounding, far below any curvature.
const DIFFERENCE_STEP: f64 = 1e-6;

/// The search space of one identification.
#[derive(Clone)]
pub(crate) struct Space {
    placement: Placement,
    /// Kept beside the point, so that ratios that were given reach the model bit for bit.
    fixed_ratios: Option<Ratios>,
    intervals: Intervals,
    dynamics: Option<Order>,
    creep: CreepBasis,
    shift: Option<ShiftColumns>,
    own: Arc<OwnColumns>,
    underway: CreepBasis,
    axes: Vec<Axis>,
    origin: Point,
    /// How many samples at the end of a record may be read before they act: where the dead time may be negative.
    unread: usize,
}

impl Space {
    /// # Errors
    /// As [`Intervals::of`], and [`Error::Core`] for creep that the records cannot tell.
    pub(crate) fn new(records: &[Record<'_>], options: &Options) -> Result<Self, Error> {
        let intervals = Intervals::of(records, options)?;
        let creep = options.creep.basis(intervals.longest_record(), intervals.smallest())?;
        let underway = if intervals.are_seconds() {
            options.creep.underway(intervals.longest_record(), intervals.smallest())
        } else {
            CreepBasis::default()
        };
        let placement = Placement::new(records, options);
        let (low, high) = placement.bounds();
        let range = high - low;
        let shift = shift_columns(records, options.loop_shift, &intervals, (low, high))?;
        let fixed_ratios = match (options.model, options.ratios) {
            (ModelKind::Conventional, _) => Some(Ratios::PLAY),
            (ModelKind::Modified, Setting::Fixed(ratios)) => Some(ratios),
            (ModelKind::Modified, Setting::Fit) => None,
        };
        let mut axes = Vec::new();
        let mut origin = Point::zero().with_ratios(fixed_ratios.unwrap_or(Ratios::PAPER));
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
        match options.dead_time {
            Setting::Fixed(dead_time) => origin = origin.with(Parameter::DeadTime, dead_time),
            Setting::Fit => {
                let (lower, upper) = intervals.dead_times(options.order().is_some());
                let scale = 4.0 * intervals.smallest();
                axes.push(Axis { parameter: Parameter::DeadTime, lower, upper, scale });
            }
        }
        let searches_negative = axes.iter().any(|axis| axis.parameter == Parameter::DeadTime && axis.lower < 0.0);
        axes.extend(linear_axes(&intervals, options.order(), &creep));
        for axis in axes.iter().filter(|axis| axis.parameter == Parameter::LogFrequency) {
            origin = origin.with(Parameter::LogFrequency, 0.5 * (axis.lower + axis.upper));
        }
        Ok(Self {
            placement,
            fixed_ratios,
            dynamics: options.order(),
            own: Arc::new(OwnColumns::new(records, |place| intervals.of_record(place), &underway)),
            underway,
            creep,
            intervals,
            shift,
            axes,
            origin,
            unread: if searches_negative { 2 } else { 0 },
        })
    }

    /// The same with a parameter that is known.
    pub(crate) fn with_known(&self, parameter: Parameter, value: f64) -> Self {
        let axes = self.axes.iter().filter(|axis| axis.parameter != parameter).copied().collect();
        Self { axes, origin: self.origin.with(parameter, value), ..self.clone() }
    }

    /// The same with the loop shift of other options; a space with powers has none.
    pub(crate) fn with_loop_shift(&self, records: &[Record<'_>], loop_shift: LoopShiftModel) -> Result<Self, Error> {
        if self.shift.as_ref().is_some_and(|columns| columns.powers > 0) {
            return Ok(self.clone());
        }
        let shift = shift_columns(records, loop_shift, &self.intervals, self.placement.bounds())?;
        Ok(Self { shift, ..self.clone() })
    }

    /// The same with the square and the cube of the drive, centred and scaled, beside the operators in place of a loop shift.
    pub(crate) fn with_powers(&self) -> Self {
        let (low, high) = self.placement.bounds();
        let (center, half_range) = (0.5 * (low + high), 0.5 * (high - low));
        let shift = (low < high).then_some(ShiftColumns { center, half_range, powers: 2, filters: Vec::new() });
        Self { shift, ..self.clone() }
    }

    /// The same with the first amplitudes of creep alone.
    pub(crate) fn with_creep_amplitudes(&self, amplitudes: usize) -> Self {
        let is_kept = |axis: &&Axis| !matches!(axis.parameter, Parameter::Creep(number) if number >= amplitudes);
        let axes = self.axes.iter().filter(is_kept).copied().collect();
        Self { axes, creep: self.creep.first(amplitudes), ..self.clone() }
    }

    /// What every record has of its own.
    pub(crate) fn own(&self) -> &OwnColumns {
        &self.own
    }

    /// The creep that may be under way when a record begins.
    pub(crate) fn underway(&self) -> &CreepBasis {
        &self.underway
    }

    /// The columns of the loop shift, if there are any.
    pub(crate) fn shift(&self) -> Option<&ShiftColumns> {
        self.shift.as_ref()
    }

    /// How many columns the loop shift has.
    pub(crate) fn shift_len(&self) -> usize {
        self.shift.as_ref().map_or(0, ShiftColumns::len)
    }

    /// The same hysteresis with critically damped dynamics in place of its dead time, and no creep.
    pub(crate) fn start_at_hysteresis(&self, point: &Point) -> Point {
        let operators = [Parameter::Ra, Parameter::RbShare, Parameter::Rc, Parameter::InputOffset];
        let start = operators.iter().fold(self.origin, |start, axis| start.with(*axis, point.get(*axis)));
        let lag = point.get(Parameter::DeadTime);
        match self.dynamics {
            Some(_) => self.critically_damped(&start, lag),
            None if self.searches(Parameter::DeadTime) => start.with(Parameter::DeadTime, lag),
            None => start,
        }
    }

    /// The same point with critically damped dynamics of a lag, 2 / w, but not less than half a sample.
    pub(crate) fn critically_damped(&self, point: &Point, lag: f64) -> Point {
        let Some(axis) = self.axis(Parameter::LogFrequency) else { return *point };
        let frequency = 2.0 / (core::f64::consts::TAU * lag.max(0.5 * self.intervals.smallest()));
        let log = frequency.ln().clamp(axis.lower, axis.upper);
        point.with(Parameter::LogFrequency, log).with(Parameter::LogDamping, 0.0)
    }

    /// The same point with another dead time, and second-order dynamics damped so that the lag of both stays.
    pub(crate) fn with_lag_kept(&self, point: &Point, dead_time: f64) -> Point {
        let point_there = point.with(Parameter::DeadTime, dead_time);
        let Some(axis) = self.axis(Parameter::LogDamping) else { return point_there };
        let w = core::f64::consts::TAU * point.get(Parameter::LogFrequency).exp();
        let change = 0.5 * w * (point.get(Parameter::DeadTime) - dead_time);
        let damping = point.get(Parameter::LogDamping).exp() + change;
        let log = damping.max(axis.lower.exp()).ln().clamp(axis.lower, axis.upper);
        point_there.with(Parameter::LogDamping, log)
    }

    /// The point of what is known, and of what is searched in its middle.
    pub(crate) fn origin(&self) -> &Point {
        &self.origin
    }

    /// The order of the dynamics, if there are any.
    pub(crate) fn order(&self) -> Option<Order> {
        self.dynamics
    }

    /// How many amplitudes of creep are searched.
    pub(crate) fn creep_amplitudes(&self) -> usize {
        self.creep.directions.len()
    }

    /// How many samples at the end of a record are not read: behind a negative dead time they act after it.
    pub(crate) fn unread_samples(&self) -> usize {
        self.unread
    }

    pub(crate) fn intervals(&self) -> &Intervals {
        &self.intervals
    }

    /// The searched parameters.
    pub(crate) fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The thresholds r_i at a point.
    pub(crate) fn thresholds(&self, point: &Point) -> Vec<f64> {
        self.placement.thresholds(point.get(Parameter::InputOffset))
    }

    pub(crate) fn ratios(&self, point: &Point) -> Ratios {
        let ra = point.get(Parameter::Ra);
        let searched = Ratios { ra, rb: ra * point.get(Parameter::RbShare), rc: point.get(Parameter::Rc) };
        self.fixed_ratios.unwrap_or(searched)
    }

    /// The operators at a point.
    pub(crate) fn operators(&self, point: &Point) -> OperatorsAt {
        let bank = OperatorBank::from_ratios(&self.thresholds(point), self.ratios(point));
        OperatorsAt { bank, input_offset: point.get(Parameter::InputOffset), shift: self.shift.clone() }
    }

    /// What follows the operators at a point.
    pub(crate) fn linear_part(&self, point: &Point) -> LinearPart {
        let valid = "the bounds of the search hold frequency and damping within their domains";
        let frequency = point.get(Parameter::LogFrequency).exp();
        let dynamics = self.dynamics.map(|order| match order {
            Order::First => Dynamics::from(FirstOrder::new(frequency).expect(valid)),
            Order::Second => SecondOrder::new(frequency, point.get(Parameter::LogDamping).exp()).expect(valid).into(),
        });
        LinearPart {
            dynamics,
            amplitudes: self.creep.amplitudes(|number| point.get(Parameter::Creep(number))),
            time_constants: self.creep.time_constants.clone(),
            dead_time: point.get(Parameter::DeadTime),
        }
    }

    /// The model at a point, with the derivatives along the axes if weights are given at which to take them.
    pub(crate) fn tangent(&self, point: &Point, columns: usize, weights: Option<&[f64]>) -> Tangent {
        let slope = |(parameter, neighbour, distance): (Parameter, Point, f64)| match parameter {
            Parameter::DeadTime => Slope::DeadTime,
            Parameter::LogFrequency | Parameter::LogDamping => Slope::Dynamics(self.linear_part(&neighbour), distance),
            Parameter::Creep(number) => Slope::Creep(self.creep.directions[number].clone()),
            _ => Slope::Operators(self.operators(&neighbour), distance),
        };
        let slopes = weights.map_or_else(Vec::new, |_| self.neighbours(point).into_iter().map(slope).collect());
        Tangent {
            operators: self.operators(point),
            linear: self.linear_part(point),
            columns,
            weights: weights.unwrap_or(&[]).to_vec(),
            slopes,
        }
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
        let mut starts = vec![self.origin];
        if self.searches(Parameter::Ra) {
            starts = USUAL_RATIOS.iter().map(|ratios| self.origin.with_ratios(*ratios)).collect();
        }
        if self.searches(Parameter::InputOffset) {
            let (low, high) = self.placement.bounds();
            let places = [0.5, 0.25, 0.75, 0.0, 1.0].map(|share| low + share * (high - low));
            let at = |start: &Point| places.map(|place| start.with(Parameter::InputOffset, place));
            starts = starts.iter().flat_map(at).collect();
        }
        starts
    }

    /// A point, and the same with each of the usual ratios, if they are searched.
    pub(crate) fn with_other_ratios(&self, point: &Point) -> Vec<Point> {
        let others =
            USUAL_RATIOS.iter().filter(|_| self.searches(Parameter::Ra)).map(|ratios| point.with_ratios(*ratios));
        std::iter::once(*point).chain(others).collect()
    }

    /// Dead times worth a look: doubling from one sample, if it is searched.
    pub(crate) fn dead_times(&self) -> Vec<f64> {
        let upper = self.axis(Parameter::DeadTime).map_or(0.0, |axis| axis.upper);
        let first = Some(self.intervals.smallest());
        std::iter::successors(first, |dead_time| Some(2.0 * dead_time)).take_while(|d| *d <= upper).collect()
    }

    /// The bounds of a parameter, if it is searched.
    pub(crate) fn axis(&self, parameter: Parameter) -> Option<&Axis> {
        self.axes.iter().find(|axis| axis.parameter == parameter)
    }

    fn searches(&self, parameter: Parameter) -> bool {
        self.axis(parameter).is_some()
    }
}

/// Frequency, damping and amplitudes of creep.
/// The columns of a loop shift, limited to what the records have; none without seconds.
fn shift_columns(
    records: &[Record<'_>],
    model: LoopShiftModel,
    intervals: &Intervals,
    bounds: (f64, f64),
) -> Result<Option<ShiftColumns>, Error> {
    if !intervals.are_seconds() {
        return Ok(None);
    }
    let columns = model.columns(bounds, intervals.longest_record(), intervals.smallest())?;
    let inputs = records.iter().enumerate().map(|(place, record)| (record.input(), intervals.of_record(place)));
    Ok(columns.map(|columns| columns.limited_by(inputs)))
}

fn linear_axes(intervals: &Intervals, dynamics: Option<Order>, creep: &CreepBasis) -> Vec<Axis> {
    let mut axes = Vec::new();
    if dynamics.is_some() {
        let (lower, upper) =
            (MIN_CYCLES_PER_RECORD / intervals.longest_record(), MAX_CYCLES_PER_SAMPLE / intervals.smallest());
        axes.push(Axis { parameter: Parameter::LogFrequency, lower: lower.ln(), upper: upper.ln(), scale: 1.0 });
    }
    if dynamics == Some(Order::Second) {
        let (lower, upper) = (DAMPINGS.0.ln(), DAMPINGS.1.ln());
        axes.push(Axis { parameter: Parameter::LogDamping, lower, upper, scale: 4.0 });
    }
    let amplitude = |number| Axis { parameter: Parameter::Creep(number), lower: 0.0, upper: MAX_AMPLITUDE, scale: 0.1 };
    axes.extend((0..creep.directions.len()).map(amplitude));
    axes
}
