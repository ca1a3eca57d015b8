//! The parameters that are searched, values for them, and the axes of the search: bounds and the size of a bold step.

use hysteresis_core::Ratios;

use crate::options::{Options, Setting};
use crate::records::record::Intervals;
use crate::terms::creep::{CreepBasis, MAX_AMPLITUDES};
use crate::terms::duhem::{self, MOST_KNOTS};
use crate::terms::dynamics::{MAX_MODES, Order};
use crate::terms::maps::COEFFICIENTS;
use crate::terms::slow_gain::{GainSpace, LARGEST};

/// A parameter that enters the model nonlinearly. rb is held as its share of ra, which turns ra >= rb into a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    Ra,
    RbShare,
    Rc,
    InputOffset,
    DeadTime,
    LogFrequency,
    LogDamping,
    /// Of the amplifier.
    LogBandwidth,
    /// A coefficient of the input map, by its number.
    InputMap(usize),
    /// A coefficient of the output map, by its number.
    OutputMap(usize),
    /// An amplitude of creep, by its number.
    Creep(usize),
    /// The amplitude of the slow gain, and the logarithm of its time constant.
    SlowGain,
    SlowGainLogTime,
    /// Of a mode beside the first, by its number from 0.
    ModeLogFrequency(usize),
    ModeLogDamping(usize),
    /// Its share in the static gain.
    ModeGain(usize),
    /// f+ and f- of the Duhem operator at a knot, by its number, in their scale.
    DuhemRising(usize),
    DuhemFalling(usize),
    /// How many times as large its output is as with the knots that were chosen, which move with it.
    DuhemLogAmplitude,
}

impl Parameter {
    /// Those of the hysteresis, of the operator beside it, and of the maps in front of it and behind it.
    pub(crate) fn of_hysteresis() -> impl Iterator<Item = Self> {
        let maps = (0..COEFFICIENTS).flat_map(|number| [Self::InputMap(number), Self::OutputMap(number)]);
        let duhem = (0..MOST_KNOTS).flat_map(|number| [Self::DuhemRising(number), Self::DuhemFalling(number)]);
        let alone = [Self::Ra, Self::RbShare, Self::Rc, Self::InputOffset, Self::DuhemLogAmplitude];
        alone.into_iter().chain(maps).chain(duhem)
    }

    /// Whether it is one of a mode beside the first.
    pub(crate) fn is_of_further_mode(self) -> bool {
        matches!(self, Self::ModeLogFrequency(_) | Self::ModeLogDamping(_) | Self::ModeGain(_))
    }

    /// Whether it is one of the Duhem operator.
    pub(crate) fn is_of_duhem(self) -> bool {
        matches!(self, Self::DuhemRising(_) | Self::DuhemFalling(_) | Self::DuhemLogAmplitude)
    }

    /// Those of the dynamics, and of the dead time and the amplifier beside them.
    pub(crate) fn of_dynamics() -> impl Iterator<Item = Self> {
        let further = |number| [Self::ModeLogFrequency(number), Self::ModeLogDamping(number), Self::ModeGain(number)];
        let first = [Self::DeadTime, Self::LogFrequency, Self::LogDamping, Self::LogBandwidth];
        first.into_iter().chain((0..MAX_MODES - 1).flat_map(further))
    }

    /// Whether it is one of those.
    pub(crate) fn is_of_dynamics(self) -> bool {
        Self::of_dynamics().any(|parameter| parameter == self)
    }

    fn place(self) -> usize {
        match self {
            Self::Ra => 0,
            Self::RbShare => 1,
            Self::Rc => 2,
            Self::InputOffset => 3,
            Self::DeadTime => 4,
            Self::LogFrequency => 5,
            Self::LogDamping => 6,
            Self::LogBandwidth => 7,
            Self::InputMap(number) => 8 + number,
            Self::OutputMap(number) => 8 + COEFFICIENTS + number,
            Self::Creep(number) => FIRST_AMPLITUDE + number,
            Self::SlowGain => SLOW_GAIN,
            Self::SlowGainLogTime => SLOW_GAIN + 1,
            Self::ModeLogFrequency(number) => FIRST_MODE + 3 * number,
            Self::ModeLogDamping(number) => FIRST_MODE + 3 * number + 1,
            Self::ModeGain(number) => FIRST_MODE + 3 * number + 2,
            Self::DuhemRising(number) => DUHEM + number,
            Self::DuhemFalling(number) => DUHEM + MOST_KNOTS + number,
            Self::DuhemLogAmplitude => DUHEM + 2 * MOST_KNOTS,
        }
    }
}

/// Where the amplitudes of creep begin.
const FIRST_AMPLITUDE: usize = 8 + 2 * COEFFICIENTS;

/// Where the slow gain is.
const SLOW_GAIN: usize = FIRST_AMPLITUDE + MAX_AMPLITUDES;

/// Where the modes beside the first begin.
const FIRST_MODE: usize = SLOW_GAIN + 2;

/// Where the Duhem operator is.
const DUHEM: usize = FIRST_MODE + 3 * (MAX_MODES - 1);

/// How many values there are.
const VALUES: usize = DUHEM + 2 * MOST_KNOTS + 1;

/// A value for every [`Parameter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point([f64; VALUES]);

impl Point {
    pub(crate) fn zero() -> Self {
        Self([0.0; VALUES])
    }

    pub(crate) fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self.0[parameter.place()] = value;
        self
    }

    pub(crate) fn get(&self, parameter: Parameter) -> f64 {
        self.0[parameter.place()]
    }

    /// The same with the dynamics of another one.
    pub(crate) fn with_dynamics_of(self, other: &Self) -> Self {
        Parameter::of_dynamics().fold(self, |point, parameter| point.with(parameter, other.get(parameter)))
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

impl Axis {
    /// Whether a point lies between the bounds: at one of them the search ended, and what it looks for may lie beyond.
    pub(crate) fn is_inside(&self, point: &Point) -> bool {
        self.lower < point.get(self.parameter) && !self.is_at_upper(point)
    }

    pub(crate) fn is_at_upper(&self, point: &Point) -> bool {
        point.get(self.parameter) >= self.upper
    }
}

/// The damping ratios that are searched.
pub(crate) const DAMPINGS: (f64, f64) = (1e-4, 10.0);

/// The highest frequency that is searched, in cycles per sample of the fastest record.
const MAX_CYCLES_PER_SAMPLE: f64 = 0.5;

/// The lowest frequency that is searched, in cycles per longest record.
const MIN_CYCLES_PER_RECORD: f64 = 1.0;

/// Between what the coefficients of a map are searched: slopes from e^-4 to e^4 of the mean one at the ends.
pub(crate) const COEFFICIENT_BOUND: f64 = 2.0;

/// The highest bandwidth of an amplifier that is searched, in cycles per sample of the fastest record: its lag is a
/// twelfth of a sample.
const MAX_BANDWIDTH_CYCLES: f64 = 2.0;

/// The highest frequency of a mode beside the first, in cycles per sample of the fastest record: a faster one is not
/// told from its alias.
pub(crate) const MAX_MODE_CYCLES: f64 = 0.45;

/// The lowest, in cycles per longest record: what is slower may be creep.
pub(crate) const MIN_MODE_CYCLES: f64 = 10.0;

/// The damping ratios of a mode beside the first: it resonates, else it may stand for any lag.
const MODE_DAMPINGS: (f64, f64) = (1e-4, 0.5);

/// The largest share of a mode in the static gain; neighbours of opposite signs may both exceed 1.
pub(crate) const MAX_MODE_GAIN: f64 = 2.0;

/// The axes of a mode beside the first, by its number.
pub(crate) fn mode_axes(intervals: &Intervals, number: usize) -> [Axis; 3] {
    let axis = |parameter, lower, upper, scale| Axis { parameter, lower, upper, scale };
    let (lowest, highest) = (MIN_MODE_CYCLES / intervals.longest_record(), MAX_MODE_CYCLES / intervals.smallest());
    [
        axis(Parameter::ModeLogFrequency(number), lowest.ln(), highest.ln(), 1.0),
        axis(Parameter::ModeLogDamping(number), MODE_DAMPINGS.0.ln(), MODE_DAMPINGS.1.ln(), 4.0),
        axis(Parameter::ModeGain(number), -MAX_MODE_GAIN, MAX_MODE_GAIN, 1.0),
    ]
}

/// The largest ra/r that is searched: the mirror image of an actuator with ra/r = 1/2.
const MAX_RA: f64 = 2.0;

/// How far beyond the range of the input its offset is searched, as a share of that range.
const OFFSET_MARGIN: f64 = 0.2;

/// The axes of the ratios and of the input offset, as far as they are searched, for an input between two bounds. Plays
/// have none: their input offset moves the virgin state alone.
pub(crate) fn operator_axes(options: &Options, (low, high): (f64, f64)) -> Vec<Axis> {
    let mut axes = Vec::new();
    if options.known_ratios().is_none() {
        let ratio = |parameter, upper| Axis { parameter, lower: 0.0, upper, scale: 1.0 };
        axes.extend([ratio(Parameter::Ra, MAX_RA), ratio(Parameter::RbShare, 1.0), ratio(Parameter::Rc, 1.0)]);
    }
    if options.input_offset == Setting::Fit && !options.has_plays() {
        let (range, parameter) = (high - low, Parameter::InputOffset);
        let margin = OFFSET_MARGIN * range;
        axes.push(Axis { parameter, lower: low - margin, upper: high + margin, scale: range });
    }
    axes
}

/// That of the bandwidth of an amplifier.
pub(crate) fn bandwidth_axis(intervals: &Intervals) -> Axis {
    let lower = MIN_CYCLES_PER_RECORD / intervals.longest_record();
    let upper = MAX_BANDWIDTH_CYCLES / intervals.smallest();
    Axis { parameter: Parameter::LogBandwidth, lower: lower.ln(), upper: upper.ln(), scale: 1.0 }
}

/// Those of the coefficients of a map.
pub(crate) fn map_axes(parameter: fn(usize) -> Parameter) -> impl Iterator<Item = Axis> {
    let (lower, upper) = (-COEFFICIENT_BOUND, COEFFICIENT_BOUND);
    (0..COEFFICIENTS).map(move |number| Axis { parameter: parameter(number), lower, upper, scale: 1.0 })
}

/// How far the amplitude of a Duhem operator is searched either way, and a bold step. Its knots move with it.
const DUHEM_LOG_AMPLITUDE: (f64, f64) = (1.5, 0.5);

/// Those of f+ and f- at so many knots, and of the amplitude.
pub(crate) fn duhem_axes(knots: usize) -> impl Iterator<Item = Axis> {
    let (lower, upper) = duhem::BOUNDS;
    let parameters = (0..knots).flat_map(|number| [Parameter::DuhemRising(number), Parameter::DuhemFalling(number)]);
    let (most, scale) = DUHEM_LOG_AMPLITUDE;
    let amplitude = Axis { parameter: Parameter::DuhemLogAmplitude, lower: -most, upper: most, scale };
    parameters.map(move |parameter| Axis { parameter, lower, upper, scale: duhem::STEP }).chain([amplitude])
}

/// Those of a slow gain.
pub(crate) fn gain_axes(gain: &GainSpace) -> Vec<Axis> {
    let mut axes = vec![Axis { parameter: Parameter::SlowGain, lower: -LARGEST, upper: LARGEST, scale: 0.05 }];
    if gain.searches_time_constant() {
        let (lower, upper) = gain.time_constants;
        axes.push(Axis { parameter: Parameter::SlowGainLogTime, lower: lower.ln(), upper: upper.ln(), scale: 1.0 });
    }
    axes
}

/// Those of frequency, damping and the amplitudes of creep.
pub(crate) fn linear_axes(
    intervals: &Intervals,
    dynamics: Option<Order>,
    creep: &CreepBasis,
    largest_creep: f64,
) -> Vec<Axis> {
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
    axes.extend(creep_axes(creep, largest_creep));
    axes
}

/// Those of the amplitudes of creep.
pub(crate) fn creep_axes(creep: &CreepBasis, largest: f64) -> impl Iterator<Item = Axis> {
    let amplitude = move |number| Axis { parameter: Parameter::Creep(number), lower: 0.0, upper: largest, scale: 0.1 };
    (0..creep.directions.len()).map(amplitude)
}
