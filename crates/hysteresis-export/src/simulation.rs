//! What runs in a unit: its settings (`resources/settings.json`), its variables, and the simulation.

use hysteresis_control::binary::{self, Binary, Sampled};
use hysteresis_control::stage::{FeedForwardKind, Stage, StageForward};
use hysteresis_core::{HybridController, Process, QuasiStaticInverse};
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// By which share of a sampling interval a step may differ from a whole number of them: the difference of two large
/// times.
const TOLERANCE: f64 = 1e-6;
/// A step with more samples is a mistake.
const MOST_SAMPLES: f64 = 1e9;

/// A forward model, an inverse or a controller with inputs that stay until they are set, as a master of a co-simulation
/// wants it.
///
/// ```
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// use hysteresis_export::{Kind, Settings, Simulation};
/// let hysteresis =
///     ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts { limits: Some((0.0, 150.0)), ..StageParts::new(hysteresis) })?;
/// let mut simulation = Simulation::new(&stage, &Settings::new(Kind::Forward, 1e-4))?;
/// let (drive, position) = (0, 1);
/// simulation.set_real(drive, 10.0)?;
/// simulation.step(3e-4)?; // three samples
/// assert_eq!(simulation.real(position)?, 5.0);
/// let error = simulation.step(1.5e-4).unwrap_err();
/// assert_eq!(error.to_string(), "communicationStepSize: expected a whole multiple of the sampling interval, 0.0001 s, got 0.00015");
/// # Ok::<(), hysteresis_export::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Simulation {
    kind: Kind,
    dt: f64,
    /// As many as the kind has; the others stay 0.
    inputs: [f64; 2],
    machine: Machine,
}

#[derive(Clone, Debug)]
enum Machine {
    Forward(Box<StageForward>),
    Inverse(Box<QuasiStaticInverse>),
    Controller(Box<HybridController>),
}

impl Simulation {
    /// What `settings` says, made from a stage that rests.
    ///
    /// # Errors
    /// [`Error`] that names the part of the stage, or the setting.
    pub fn new(stage: &Stage, settings: &Settings) -> Result<Self, Error> {
        let dt = settings.dt;
        let plain = Settings::new(settings.kind, dt);
        if settings.kind != Kind::Controller
            && (settings.gains != plain.gains || settings.feedforward != plain.feedforward)
        {
            let parameter = if settings.gains.is_some() { "gains" } else { "feedforward" };
            return Err(Error::argument(parameter, "none without kind \"controller\"", settings.kind.name()));
        }
        let (machine, inputs) = match settings.kind {
            Kind::Forward => {
                let forward = stage.forward(dt)?;
                let drive = forward.drive();
                (Machine::Forward(forward.into()), [drive, 0.0])
            }
            Kind::Inverse => {
                let inverse = stage.inverse(dt, None)?;
                let position = inverse.position();
                (Machine::Inverse(inverse.into()), [position, 0.0])
            }
            Kind::Controller => {
                let position = stage.forward(dt)?.output();
                let options = match settings.gains {
                    Some(gains) => stage.controller_options_with_gains(dt, None, gains)?,
                    None => stage.controller_options(dt, None)?,
                };
                let source = settings.feedforward.feedforward(stage, dt)?;
                (Machine::Controller(stage.controller(source, &options)?.into()), [position; 2])
            }
        };
        Ok(Self { kind: settings.kind, dt, inputs, machine })
    }

    /// Moves on by so many seconds, a whole number of samples, with the inputs held.
    ///
    /// # Errors
    /// [`Error::Argument`] for another time; nothing has moved then.
    pub fn step(&mut self, seconds: f64) -> Result<(), Error> {
        let samples = (seconds / self.dt).round();
        let is_whole = (seconds - samples * self.dt).abs() <= TOLERANCE * self.dt;
        if !((1.0..=MOST_SAMPLES).contains(&samples) && is_whole) {
            let expected = format!("a whole multiple of the sampling interval, {:?} s", self.dt);
            return Err(Error::argument("communicationStepSize", expected, seconds));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to 1e9")]
        for _ in 0..samples as u64 {
            self.sample();
        }
        Ok(())
    }

    #[inline]
    fn sample(&mut self) {
        let [first, second] = self.inputs;
        match &mut self.machine {
            Machine::Forward(forward) => forward.advance(first),
            Machine::Inverse(inverse) => inverse.step(first),
            Machine::Controller(controller) => controller.step(first.into(), second),
        };
    }

    /// The real number of a reference.
    ///
    /// # Errors
    /// [`Error::Argument`] for a reference that is not that of a real number.
    pub fn real(&self, reference: u32) -> Result<f64, Error> {
        let variable = self.variable(reference, Type::Real)?;
        Ok(match &self.machine {
            _ if variable.role == Role::Input => self.inputs[place(variable)],
            Machine::Forward(forward) => forward.output(),
            Machine::Inverse(inverse) if variable.quantity == Quantity::Drive => inverse.output(),
            Machine::Inverse(inverse) => inverse.position(),
            Machine::Controller(controller) => match variable.quantity {
                Quantity::Kp => controller.options().kp,
                Quantity::Ki => controller.options().ki,
                _ => controller.drive(),
            },
        })
    }

    /// The whole number of a reference; counts that are larger than it can be stay at the largest.
    ///
    /// # Errors
    /// [`Error::Argument`] for a reference that is not that of a whole number.
    pub fn integer(&self, reference: u32) -> Result<i32, Error> {
        let variable = self.variable(reference, Type::Integer)?;
        let count = match &self.machine {
            Machine::Forward(forward) if variable.quantity == Quantity::Clamped => forward.clamped(),
            Machine::Forward(forward) => forward.rejected(),
            Machine::Inverse(inverse) => inverse.rejected(),
            Machine::Controller(controller) => {
                let counters = controller.counters();
                match variable.quantity {
                    Quantity::Missing => counters.missing_count,
                    Quantity::Implausible => counters.implausible_count,
                    Quantity::SaturatedSamples => counters.saturated_count,
                    Quantity::SlewingSamples => counters.slewing_count,
                    _ => counters.rejected_count,
                }
            }
        };
        Ok(i32::try_from(count).unwrap_or(i32::MAX))
    }

    /// The truth value of a reference.
    ///
    /// # Errors
    /// [`Error::Argument`] for a reference that is not that of a truth value.
    pub fn boolean(&self, reference: u32) -> Result<bool, Error> {
        let variable = self.variable(reference, Type::Boolean)?;
        Ok(match &self.machine {
            Machine::Forward(_) => false,
            Machine::Inverse(inverse) => inverse.saturated(),
            Machine::Controller(controller) if variable.quantity == Quantity::Slewing => controller.terms().slewing,
            Machine::Controller(controller) => controller.terms().saturated,
        })
    }

    /// Sets an input.
    ///
    /// # Errors
    /// [`Error::Argument`] for a reference that is not that of an input. Any number is taken: what is not finite is
    /// held back and counted by the next step.
    pub fn set_real(&mut self, reference: u32, value: f64) -> Result<(), Error> {
        let variable = self.variable(reference, Type::Real)?;
        if variable.role != Role::Input {
            return Err(Error::argument("value reference", "that of an input", variable.name));
        }
        self.inputs[place(variable)] = value;
        Ok(())
    }

    fn variable(&self, reference: u32, kind: Type) -> Result<&'static Variable, Error> {
        variable_at(self.kind, reference).filter(|variable| variable.kind() == kind).ok_or_else(|| {
            Error::argument("value reference", format!("that of a {kind:?} of this {}", self.kind.name()), reference)
        })
    }

    /// Everything that is remembered, inputs included, as bytes.
    #[must_use]
    pub fn state(&self) -> Vec<u8> {
        let machine = match &self.machine {
            Machine::Forward(forward) => Sampled { dt: self.dt, stream: forward.state() }.to_bytes(),
            Machine::Inverse(inverse) => Sampled { dt: self.dt, stream: inverse.state() }.to_bytes(),
            Machine::Controller(controller) => controller.state().to_bytes(),
        };
        binary::pack(binary::Kind::MockUp, &(self.inputs, machine))
    }

    /// Goes on, bit for bit, from what [`state`](Self::state) gave in a simulation of the same stage and settings.
    ///
    /// # Errors
    /// [`Error`] that names what differs; it is as before then.
    pub fn set_state(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let (inputs, machine): ([f64; 2], Vec<u8>) = binary::unpack(binary::Kind::MockUp, bytes)?;
        match &mut self.machine {
            Machine::Forward(forward) => forward.set_state(&at(self.dt, &machine)?)?,
            Machine::Inverse(inverse) => inverse.set_state(&at(self.dt, &machine)?)?,
            Machine::Controller(controller) => controller.set_state(&Binary::from_bytes(&machine)?)?,
        }
        self.inputs = inputs;
        Ok(())
    }
}

/// Which input it is.
fn place(variable: &Variable) -> usize {
    usize::from(variable.quantity == Quantity::Measurement)
}

/// The state of a stream, if it belongs to this sampling interval.
fn at<T>(dt: f64, bytes: &[u8]) -> Result<T, Error>
where
    Sampled<T>: Binary,
{
    Sampled::<T>::from_bytes(bytes)?.at(dt).map_err(|got| Error::argument("state.dt", format!("{dt:?}"), got))
}

const SCHEMA: &str = "mpi_hyst/fmu/1";

/// What a unit runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The stage: a drive in, the position out.
    Forward,
    /// The exact inverse of its slow part: a target in, the drive out.
    Inverse,
    /// Feed-forward and feedback: reference and measurement in, the drive out.
    Controller,
}

impl Kind {
    /// The kind of that name.
    ///
    /// # Errors
    /// [`Error::Argument`] that lists the names.
    pub fn of(name: &str) -> Result<Self, Error> {
        match name {
            "forward" => Ok(Self::Forward),
            "inverse" => Ok(Self::Inverse),
            "controller" => Ok(Self::Controller),
            other => Err(Error::argument("kind", "\"forward\", \"inverse\" or \"controller\"", other)),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Inverse => "inverse",
            Self::Controller => "controller",
        }
    }
}

/// Where the feed-forward of a controller comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The exact inverse of the reference of now.
    #[default]
    Inverse,
    /// The same of references that come early, through the inverse of amplifier, modes and dead time too.
    Preview,
}

impl Source {
    /// The source of that name.
    ///
    /// # Errors
    /// [`Error::Argument`] that lists the names.
    pub fn of(name: &str) -> Result<Self, Error> {
        match name {
            "inverse" => Ok(Self::Inverse),
            "preview" => Ok(Self::Preview),
            other => Err(Error::argument("feedforward", "\"inverse\" or \"preview\"", other)),
        }
    }

    fn feedforward(self, stage: &Stage, dt: f64) -> Result<FeedForwardKind, Error> {
        Ok(match self {
            Self::Inverse => FeedForwardKind::Inverse,
            Self::Preview => FeedForwardKind::Preview { ahead: stage.preview_ahead(dt)?, smoothing: 0.0 },
        })
    }
}

/// What a unit runs, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The schema of its file.
    pub schema: String,
    /// What tells this unit from others; [`MockUp`](crate::mock_up::MockUp) fills it in.
    pub guid: String,
    /// What it runs.
    pub kind: Kind,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Of a controller: where its feed-forward comes from.
    pub feedforward: Source,
    /// Of a controller: kp and ki instead of tuned gains and filters.
    pub gains: Option<(f64, f64)>,
}

impl Settings {
    /// A controller has tuned gains, and the exact inverse of the reference of now.
    #[must_use]
    pub fn new(kind: Kind, dt: f64) -> Self {
        let (schema, guid) = (SCHEMA.into(), String::new());
        Self { schema, guid, kind, dt, feedforward: Source::default(), gains: None }
    }

    /// As text.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Serialising plain numbers and strings into memory has no way to fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// What [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    /// [`Error::Argument`] for a text that is something else.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let expected = || format!("settings of schema {SCHEMA:?}");
        let wrong = |error: serde_json::Error| Error::argument("settings.json", expected(), error.to_string());
        let settings: Self = serde_json::from_str(text).map_err(wrong)?;
        if settings.schema == SCHEMA {
            Ok(settings)
        } else {
            Err(Error::argument("settings.json", expected(), settings.schema))
        }
    }
}

/// What a variable tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Drive,
    Position,
    Target,
    Reference,
    Measurement,
    Kp,
    Ki,
    Saturated,
    Slewing,
    Rejected,
    Clamped,
    Missing,
    Implausible,
    SaturatedSamples,
    SlewingSamples,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Input,
    Output,
    Parameter,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Real,
    Integer,
    Boolean,
}

pub(crate) struct Variable {
    pub(crate) quantity: Quantity,
    pub(crate) role: Role,
    pub(crate) name: &'static str,
    pub(crate) description: &'static str,
}

impl Variable {
    pub(crate) fn kind(&self) -> Type {
        use Quantity::{Clamped, Implausible, Missing, Rejected, Saturated, SaturatedSamples, Slewing, SlewingSamples};
        match self.quantity {
            Saturated | Slewing => Type::Boolean,
            Rejected | Clamped | Missing | Implausible | SaturatedSamples | SlewingSamples => Type::Integer,
            _ => Type::Real,
        }
    }
}

const fn variable(quantity: Quantity, role: Role, name: &'static str, description: &'static str) -> Variable {
    Variable { quantity, role, name, description }
}

const REJECTED: &str = "How many inputs were not finite (or beyond 1e100): they change nothing";

const FORWARD: &[Variable] = &[
    variable(
        Quantity::Drive,
        Role::Input,
        "drive",
        "The drive, held over the step; kept within the limits of the stage",
    ),
    variable(Quantity::Position, Role::Output, "position", "The position at the end of the step"),
    variable(Quantity::Rejected, Role::Output, "rejected", REJECTED),
    variable(Quantity::Clamped, Role::Output, "clamped", "How many drives lay beyond the limits of the stage"),
];

const INVERSE: &[Variable] = &[
    variable(Quantity::Target, Role::Input, "target", "Where the position is to be"),
    variable(Quantity::Drive, Role::Output, "drive", "The drive for the target, to be held over the same step"),
    variable(Quantity::Position, Role::Output, "position", "Where the position is then, as the model says"),
    variable(
        Quantity::Saturated,
        Role::Output,
        "saturated",
        "Whether the target is out of reach and the drive at a limit",
    ),
    variable(Quantity::Rejected, Role::Output, "rejected", REJECTED),
];

const CONTROLLER: &[Variable] = &[
    variable(Quantity::Reference, Role::Input, "reference", "Where the position is to be"),
    variable(Quantity::Measurement, Role::Input, "measurement", "The position read at the beginning of the step"),
    variable(Quantity::Drive, Role::Output, "drive", "The drive, to be held over the same step"),
    variable(Quantity::Saturated, Role::Output, "saturated", "Whether the law asked for a drive beyond the limits"),
    variable(Quantity::Slewing, Role::Output, "slewing", "Whether the slew rate held the drive back"),
    variable(Quantity::Rejected, Role::Output, "rejected", "How many references were not finite: they hold the drive"),
    variable(Quantity::Missing, Role::Output, "missing", "How many measurements were not finite"),
    variable(Quantity::Implausible, Role::Output, "implausible", "How many measurements cannot be"),
    variable(Quantity::SaturatedSamples, Role::Output, "saturated_samples", "How many samples were saturated"),
    variable(Quantity::SlewingSamples, Role::Output, "slewing_samples", "How many samples the slew rate held back"),
    variable(Quantity::Kp, Role::Parameter, "kp", "The proportional gain"),
    variable(Quantity::Ki, Role::Parameter, "ki", "The integral gain"),
];

/// The variables of a unit, in the order of their references.
pub(crate) fn variables(kind: Kind) -> &'static [Variable] {
    match kind {
        Kind::Forward => FORWARD,
        Kind::Inverse => INVERSE,
        Kind::Controller => CONTROLLER,
    }
}

/// The variable of a reference.
fn variable_at(kind: Kind, reference: u32) -> Option<&'static Variable> {
    variables(kind).get(usize::try_from(reference).ok()?)
}
