//! Where the search may go: the parameters that enter the model nonlinearly, and the model at each of their points.
//!
//! Spaces are made from records and options here, from others in `changes`.

mod changes;

use std::sync::Arc;

use hysteresis_control::linear::{Dynamics, FirstOrder, SecondOrder};
use hysteresis_core::Ratios;

use crate::error::Error;
use crate::fit::own_columns::OwnColumns;
use crate::fit::point::{Axis, Parameter, Point, duhem_axes, linear_axes, operator_axes};
use crate::fit::response::OperatorsAt;
use crate::fit::tangent::{Slope, Tangent};
use crate::options::{Options, Setting};
use crate::records::record::{Intervals, Record};
use crate::terms::creep::CreepBasis;
use crate::terms::duhem::{DuhemSpace, DuhemTable};
use crate::terms::dynamics::{AmplifierModel, LinearPart, Mode, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::{Curve, DrivePath, OutputMap};
use crate::terms::operators::{OperatorBank, Placement};
use crate::terms::relaxing_plays::RelaxingColumns;
use crate::terms::side_columns::{SideColumns, Sides};
use crate::terms::slow_gain::{GainAt, GainSpace};

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
    side: Option<SideColumns>,
    gain: Option<GainSpace>,
    duhem: Option<DuhemSpace>,
    /// How many modes there are beside the first.
    further_modes: usize,
    has_amplifier: bool,
    has_input_map: bool,
    output_map: Option<OutputMap>,
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
        let intervals = options.intervals(records)?;
        let creep = options.creep.basis(intervals.longest_record(), intervals.smallest())?;
        let underway = if intervals.are_seconds() {
            options.creep.underway(intervals.longest_record(), intervals.smallest())
        } else {
            CreepBasis::default()
        };
        let placement = Placement::new(records, options.has_plays(), &options.thresholds);
        let (low, high) = placement.bounds();
        let mut axes = operator_axes(options, (low, high));
        let mut origin = Point::zero().with_ratios(options.known_ratios().unwrap_or(Ratios::PAPER));
        let offset = match options.input_offset {
            Setting::Fixed(offset) => offset,
            Setting::Fit if options.chooses_coupling() => records.first().map_or(low, |record| record.input()[0]),
            Setting::Fit => low + 0.5 * (high - low),
        };
        origin = origin.with(Parameter::InputOffset, offset);
        let side = side_columns(records, options.loop_shift, None, &intervals, (low, high))?;
        match options.dead_time {
            Setting::Fixed(dead_time) => origin = origin.with(Parameter::DeadTime, dead_time),
            Setting::Fit => {
                let (lower, upper) = intervals.dead_times(options.order().is_some());
                let scale = 4.0 * intervals.smallest();
                axes.push(Axis { parameter: Parameter::DeadTime, lower, upper, scale });
            }
        }
        let searches_negative = axes.iter().any(|axis| axis.parameter == Parameter::DeadTime && axis.lower < 0.0);
        axes.extend(linear_axes(&intervals, options.order(), &creep, options.creep.largest()));
        let start = options.duhem.start()?;
        let duhem = start.map(|table| DuhemSpace { knots: table.knots.clone(), scale: table.scale() });
        if let Some(table) = start {
            axes.extend(duhem_axes(table.knots.len()));
            origin = at_duhem(&origin, table);
        }
        if let Some(axis) = axes.iter().find(|axis| axis.parameter == Parameter::LogFrequency) {
            origin = origin.with(Parameter::LogFrequency, 0.5 * (axis.lower + axis.upper));
        }
        let bandwidth = match options.amplifier {
            AmplifierModel::Bandwidth(bandwidth) => Some(bandwidth),
            AmplifierModel::None | AmplifierModel::Auto => None,
        };
        origin = bandwidth.map_or(origin, |bandwidth| origin.with(Parameter::LogBandwidth, bandwidth.ln()));
        let space = Self {
            placement,
            fixed_ratios: options.known_ratios(),
            dynamics: options.order(),
            own: Arc::new(OwnColumns::new(records, |place| intervals.of_record(place), &underway)),
            underway,
            creep,
            intervals,
            side,
            gain: None,
            duhem,
            further_modes: 0,
            has_amplifier: bandwidth.is_some(),
            has_input_map: false,
            output_map: None,
            axes,
            origin,
            unread: if searches_negative { 2 } else { 0 },
        };
        let (space, origin) = space.with_slow_gain(options.slow_gain, space.origin())?;
        Self { origin, ..space }.with_relaxing_plays(&options.relaxing_plays)
    }

    /// What every record has of its own.
    pub(crate) fn own(&self) -> &OwnColumns {
        &self.own
    }

    /// Whether there is a map in front of the hysteresis or behind it.
    pub(crate) fn has_map(&self) -> bool {
        self.maps() > 0
    }

    /// How many maps there are.
    pub(crate) fn maps(&self) -> usize {
        usize::from(self.has_input_map) + usize::from(self.output_map.is_some())
    }

    /// The creep that may be under way when a record begins.
    pub(crate) fn underway(&self) -> &CreepBasis {
        &self.underway
    }

    /// The columns beside the operators, if there are any.
    pub(crate) fn side(&self) -> Option<&SideColumns> {
        self.side.as_ref()
    }

    /// The columns of plays that relax, if there are any.
    pub(crate) fn relaxing(&self) -> Option<&RelaxingColumns> {
        self.side.as_ref()?.relaxing.as_ref()
    }

    /// How many columns there are beside the operators.
    pub(crate) fn sides(&self) -> Sides {
        self.side.as_ref().map_or_else(Sides::default, SideColumns::sides)
    }

    /// The same hysteresis with critically damped dynamics in place of its dead time, and no creep.
    pub(crate) fn start_at_hysteresis(&self, point: &Point) -> Point {
        let start = Parameter::of_hysteresis().fold(self.origin, |start, axis| start.with(axis, point.get(axis)));
        let lag = point.get(Parameter::DeadTime);
        if self.dynamics.is_some() {
            return self.critically_damped(&start, lag);
        }
        let left = lag - self.linear_part(&start).amplifier_lag();
        start.with(Parameter::DeadTime, self.nearest(Parameter::DeadTime, left))
    }

    /// The same point with critically damped dynamics of a lag, 2 / w, but not less than half a sample.
    pub(crate) fn critically_damped(&self, point: &Point, lag: f64) -> Point {
        let Some(axis) = self.axis(Parameter::LogFrequency) else { return *point };
        let frequency = 2.0 / (core::f64::consts::TAU * lag.max(0.5 * self.intervals.smallest()));
        let log = frequency.ln().clamp(axis.lower, axis.upper);
        point.with(Parameter::LogFrequency, log).with(Parameter::LogDamping, 0.0)
    }

    /// The same point with another dead time, and a single mode damped so that the lag of both stays.
    pub(crate) fn with_lag_kept(&self, point: &Point, dead_time: f64) -> Point {
        let point_there = point.with(Parameter::DeadTime, dead_time);
        let Some(axis) = self.axis(Parameter::LogDamping).filter(|_| self.further_modes == 0) else {
            return point_there;
        };
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

    /// How many modes there are.
    pub(crate) fn modes(&self) -> usize {
        if self.dynamics == Some(Order::Second) { 1 + self.further_modes } else { 0 }
    }

    /// How many amplitudes of creep are searched.
    pub(crate) fn creep_amplitudes(&self) -> usize {
        self.creep.directions.len()
    }

    /// What people call the creep that has a searched amplitude.
    pub(crate) fn name_of_creep(&self, amplitude: usize) -> String {
        self.creep.name_of(amplitude)
    }

    /// How many samples at the end of a record are not read: behind a negative dead time they act after it.
    pub(crate) fn unread_samples(&self) -> usize {
        self.unread
    }

    /// Between what the inputs of the records lie.
    pub(crate) fn input_bounds(&self) -> (f64, f64) {
        self.placement.bounds()
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
        let curve = |bounds, parameter: fn(usize) -> Parameter| {
            Curve::new(bounds, core::array::from_fn(|number| point.get(parameter(number))))
        };
        OperatorsAt {
            bank: OperatorBank::from_ratios(&self.thresholds(point), self.ratios(point)),
            input_offset: point.get(Parameter::InputOffset),
            path: DrivePath {
                bandwidth: self.bandwidth(point),
                is_seen_before: self.dynamics.is_none(),
                map: self.has_input_map.then(|| curve(self.placement.bounds(), Parameter::InputMap)),
            },
            output_map: self.output_map.as_ref().map(|map| curve(map.bounds, Parameter::OutputMap)),
            side: self.side.clone(),
            gain: self.slow_gain(point),
            duhem: self.duhem(point),
        }
    }

    /// The Duhem operator at a point, if there is one.
    pub(crate) fn duhem(&self, point: &Point) -> Option<DuhemTable> {
        let DuhemSpace { knots, scale } = self.duhem.as_ref()?;
        let values = |parameter: fn(usize) -> Parameter| {
            (0..knots.len()).map(|number| scale * point.get(parameter(number))).collect()
        };
        let (rising, falling) = (values(Parameter::DuhemRising), values(Parameter::DuhemFalling));
        let times = point.get(Parameter::DuhemLogAmplitude).exp();
        Some(DuhemTable { knots: knots.clone(), rising, falling }.scaled(times))
    }

    /// The slow gain at a point, if there is one.
    pub(crate) fn slow_gain(&self, point: &Point) -> Option<GainAt> {
        let gain = self.gain.as_ref()?;
        let known = (!gain.searches_time_constant()).then_some(gain.start);
        let time_constant = known.unwrap_or_else(|| point.get(Parameter::SlowGainLogTime).exp());
        Some(gain.at(point.get(Parameter::SlowGain), time_constant))
    }

    /// Of the amplifier, if there is one.
    fn bandwidth(&self, point: &Point) -> Option<f64> {
        self.has_amplifier.then(|| point.get(Parameter::LogBandwidth).exp())
    }

    /// What follows the operators at a point.
    pub(crate) fn linear_part(&self, point: &Point) -> LinearPart {
        let valid = "the bounds of the search hold frequency and damping within their domains";
        let frequency = point.get(Parameter::LogFrequency).exp();
        let dynamics = self.dynamics.map(|order| match order {
            Order::First => Dynamics::from(FirstOrder::new(frequency).expect(valid)),
            Order::Second => SecondOrder::new(frequency, point.get(Parameter::LogDamping).exp()).expect(valid).into(),
        });
        let further = |number| Mode {
            frequency: point.get(Parameter::ModeLogFrequency(number)).exp(),
            damping: point.get(Parameter::ModeLogDamping(number)).exp(),
            gain: point.get(Parameter::ModeGain(number)),
        };
        LinearPart {
            dynamics,
            further: (0..self.further_modes).map(further).collect(),
            amplitudes: self.creep.amplitudes(|number| point.get(Parameter::Creep(number))),
            time_constants: self.creep.time_constants.clone(),
            dead_time: point.get(Parameter::DeadTime),
            bandwidth: self.bandwidth(point),
        }
    }

    /// The model at a point, with the derivatives along the axes if weights are given at which to take them.
    pub(crate) fn tangent(&self, point: &Point, columns: usize, weights: Option<&[f64]>) -> Tangent {
        let slope = |(parameter, neighbour, distance): (Parameter, Point, f64)| match parameter {
            Parameter::DeadTime => Slope::DeadTime,
            Parameter::LogFrequency
            | Parameter::LogDamping
            | Parameter::ModeLogFrequency(_)
            | Parameter::ModeLogDamping(_)
            | Parameter::ModeGain(_) => Slope::Dynamics(self.linear_part(&neighbour), distance),
            Parameter::LogBandwidth => {
                Slope::Amplifier(self.operators(&neighbour), self.linear_part(&neighbour), distance)
            }
            Parameter::Creep(number) => Slope::Creep(self.creep.directions[number].clone()),
            _ => Slope::Operators(self.operators(&neighbour), distance),
        };
        let slopes = weights.map_or_else(Vec::new, |_| self.neighbours(point).into_iter().map(slope).collect());
        Tangent {
            operators: self.operators(point),
            linear: self.linear_part(point),
            columns,
            weights: weights.map_or_else(|| self.reference(columns), <[f64]>::to_vec),
            slopes,
        }
    }

    /// Weights about whose output an output map is linear, one for each column; none without such a map.
    fn reference(&self, columns: usize) -> Vec<f64> {
        let Some(map) = &self.output_map else { return Vec::new() };
        let weights = map.reference.iter().cycle().take(columns - self.sides().len());
        weights.copied().chain((0..self.sides().len()).map(|_| 0.0)).collect()
    }

    /// The point moved by `step` along the axes, each within its bounds.
    pub(crate) fn moved(&self, point: &Point, step: &[f64]) -> Point {
        self.axes.iter().zip(step).fold(*point, |point, (axis, step)| {
            point.with(axis.parameter, (point.get(axis.parameter) + step).clamp(axis.lower, axis.upper))
        })
    }

    /// How far a step goes along the axes, in their scales.
    pub(crate) fn size_of(&self, step: &[f64]) -> f64 {
        self.axes.iter().zip(step).map(|(axis, step)| step.abs() / axis.scale).fold(0.0, f64::max)
    }

    /// How far every axis lets a step go either way, `radius` scales at most.
    pub(crate) fn step_bounds(&self, point: &Point, radius: f64) -> Vec<(f64, f64)> {
        let within = |axis: &Axis| {
            let (value, reach) = (point.get(axis.parameter), radius * axis.scale);
            // A start beyond a bound comes back to it.
            ((axis.lower - value).clamp(-reach, reach), (axis.upper - value).clamp(-reach, reach))
        };
        self.axes.iter().map(within).collect()
    }

    /// For every axis a neighbour of the point within the bounds, and how far away it is: more than nothing.
    pub(crate) fn neighbours(&self, point: &Point) -> Vec<(Parameter, Point, f64)> {
        let neighbour = |axis: &Axis| {
            let value = point.get(axis.parameter);
            let step = (DIFFERENCE_STEP * axis.scale).max(2.0 * f64::EPSILON * value.abs()).max(f64::MIN_POSITIVE);
            let other = match (value + step, value - step) {
                (above, _) if above <= axis.upper => above,
                (_, below) if below >= axis.lower => below,
                _ if axis.upper - value > value - axis.lower => axis.upper,
                _ => axis.lower,
            };
            (axis.parameter, point.with(axis.parameter, other), other - value)
        };
        self.axes.iter().map(neighbour).collect()
    }

    /// The bounds of a parameter, if it is searched.
    pub(crate) fn axis(&self, parameter: Parameter) -> Option<&Axis> {
        self.axes.iter().find(|axis| axis.parameter == parameter)
    }

    /// The value that is nearest to one where the parameter is searched, and else the known one.
    pub(crate) fn nearest(&self, parameter: Parameter, value: f64) -> f64 {
        self.axis(parameter).map_or(self.origin.get(parameter), |axis| value.clamp(axis.lower, axis.upper))
    }

    pub(crate) fn searches(&self, parameter: Parameter) -> bool {
        self.axis(parameter).is_some()
    }
}

/// A point with f+ and f- of a Duhem operator, in their scale.
pub(crate) fn at_duhem(point: &Point, table: &DuhemTable) -> Point {
    let (scale, point) = (table.scale(), &point.with(Parameter::DuhemLogAmplitude, 0.0));
    table.rising.iter().zip(&table.falling).enumerate().fold(*point, |point, (number, (rising, falling))| {
        let point = point.with(Parameter::DuhemRising(number), rising / scale);
        point.with(Parameter::DuhemFalling(number), falling / scale)
    })
}

/// The columns of plays that relax and of a loop shift, which is limited to what the records have; none without
/// seconds.
fn side_columns(
    records: &[Record<'_>],
    loop_shift: LoopShiftModel,
    relaxing: Option<RelaxingColumns>,
    intervals: &Intervals,
    bounds: (f64, f64),
) -> Result<Option<SideColumns>, Error> {
    if !intervals.are_seconds() {
        return Ok(None);
    }
    let filters = loop_shift.filters(intervals.longest_record(), intervals.smallest())?;
    let inputs = records.iter().enumerate().map(|(place, record)| (record.input(), intervals.of_record(place)));
    Ok(SideColumns::of(filters, relaxing, bounds).map(|columns| columns.limited_by(inputs)))
}

/// Where ratios are searched first.
const USUAL_RATIOS: [Ratios; 5] = [
    Ratios::PAPER,
    Ratios { ra: 0.95, rb: 0.65, rc: 0.65 },
    Ratios { ra: 0.6, rb: 0.3, rc: 0.35 },
    Ratios { ra: 1.6, rb: 0.6, rc: 0.35 },
    Ratios::PLAY,
];

impl Space {
    /// Where to look first.
    pub(crate) fn starts(&self) -> Vec<Point> {
        self.starts_at(self.origin())
    }

    /// A point with all combinations of a few ratios and input offsets, as far as they are searched.
    pub(crate) fn starts_at(&self, point: &Point) -> Vec<Point> {
        let mut starts = vec![*point];
        if self.searches(Parameter::Ra) {
            starts = USUAL_RATIOS.iter().map(|ratios| point.with_ratios(*ratios)).collect();
        }
        if self.searches(Parameter::InputOffset) {
            let (low, high) = self.input_bounds();
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
        let first = Some(self.intervals().smallest());
        std::iter::successors(first, |dead_time| Some(2.0 * dead_time)).take_while(|d| *d <= upper).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_apart_where_the_drive_varies_by_its_last_digits() {
        for (size, levels) in [(5.0, 10), (-5.0, 10), (1e6, 10), (1.0, 2), (5.0, 2), (1e-80, 2)] {
            let input: Vec<f64> = (0..100).map(|k| size + f64::from(k % levels) * f64::EPSILON * size).collect();
            let options = Options::default().with_coupled_plays();
            let space = Space::new(&[Record::new(&input, &input, 0).unwrap()], &options).unwrap();
            assert!(space.axes.iter().any(|axis| axis.parameter == Parameter::InputOffset));
            for (axis, (parameter, there, distance)) in space.axes.iter().zip(space.neighbours(space.origin())) {
                let is_within = (axis.lower..=axis.upper).contains(&there.get(parameter));
                assert!(distance != 0.0 && is_within, "{size}: {there:?}, {distance:e} away");
            }
        }
    }
}
