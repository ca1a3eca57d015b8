//! What runs in a unit.

use hysteresis_control::binary::{self, Binary, Sampled};
use hysteresis_control::stage::{Stage, StageForward};
use hysteresis_core::{HybridController, Process, QuasiStaticInverse};

use super::settings::{Kind, Settings};
use super::variables::{Quantity, Role, Type, Variable, variable_at};
use crate::error::Error;

/// By which share of a sampling interval a step may differ from a whole number of them: the difference of two large times.
const TOLERANCE: f64 = 1e-6;
/// A step with more samples is a mistake.
const MOST_SAMPLES: f64 = 1e9;

/// A forward model, an inverse or a controller with inputs that stay until they are set, as a master of a co-simulation wants
/// it.
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
    /// [`Error::Argument`] for a reference that is not that of an input. Any number is taken: what is not finite is held back
    /// and counted by the next step.
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
