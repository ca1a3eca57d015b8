//! Parameters that are searched, and values for them.

use hysteresis_core::Ratios;

use super::curve::COEFFICIENTS;
use crate::creep_model::MAX_AMPLITUDES;
use crate::modes_model::MAX_MODES;

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
    /// Of a mode beside the first, by its number from 0.
    ModeLogFrequency(usize),
    ModeLogDamping(usize),
    /// Its share in the static gain.
    ModeGain(usize),
}

impl Parameter {
    /// Those of the hysteresis and of the maps in front of it and behind it.
    pub(crate) fn of_hysteresis() -> impl Iterator<Item = Self> {
        let maps = (0..COEFFICIENTS).flat_map(|number| [Self::InputMap(number), Self::OutputMap(number)]);
        [Self::Ra, Self::RbShare, Self::Rc, Self::InputOffset].into_iter().chain(maps)
    }

    /// Whether it is one of a mode beside the first.
    pub(crate) fn is_of_further_mode(self) -> bool {
        matches!(self, Self::ModeLogFrequency(_) | Self::ModeLogDamping(_) | Self::ModeGain(_))
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
            Self::ModeLogFrequency(number) => FIRST_MODE + 3 * number,
            Self::ModeLogDamping(number) => FIRST_MODE + 3 * number + 1,
            Self::ModeGain(number) => FIRST_MODE + 3 * number + 2,
        }
    }
}

/// Where the amplitudes of creep begin.
const FIRST_AMPLITUDE: usize = 8 + 2 * COEFFICIENTS;

/// Where the modes beside the first begin.
const FIRST_MODE: usize = FIRST_AMPLITUDE + MAX_AMPLITUDES;

/// How many values there are.
const VALUES: usize = FIRST_MODE + 3 * (MAX_MODES - 1);

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
