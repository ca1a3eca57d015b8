//! A plant that shows and does anything.

use hysteresis_control::stage::StageForward;
use hysteresis_simulate::driven::{Driven, Reading};

use super::episode::{Breach, Guard};
use crate::signal::Random;

/// Once in so many samples the sensor begins to show something else.
const FAULT_ONCE_IN: f64 = 60.0;

/// Once in so many samples a drive is not written.
const LOST_ONCE_IN: f64 = 150.0;

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ended {
    /// The drive was not written: the amplifier still has the last one.
    Lost,
    /// A drive that must not be.
    Broken(Breach),
}

#[derive(Clone, Copy, Debug)]
enum Fault {
    None,
    Nothing(f64),
    Jump(f64),
    Frozen(f64),
}

/// A stage on a bench nobody looks after: a sensor that shows nothing, infinities, jumps, the codes of an overflow, or
/// always the same, and writes that fail. Every drive that it is given passes a [`Guard`].
#[derive(Clone, Debug)]
pub struct Bench {
    stage: StageForward,
    guard: Guard,
    random: Random,
    fault: Fault,
    left: usize,
    noise: f64,
}

impl Bench {
    /// A bench around a stage, with noise of that size.
    #[must_use]
    pub fn new(stage: StageForward, guard: Guard, noise: f64, seed: u64) -> Self {
        Self { stage, guard, random: Random::new(seed), fault: Fault::None, left: 0, noise }
    }

    /// What the sensor shows now.
    pub fn show(&mut self) -> f64 {
        let Self { random, stage, .. } = self;
        let measured = stage.output() + self.noise * random.signed();
        if self.left > 0 {
            self.left -= 1;
        } else if random.once_in(FAULT_ONCE_IN) {
            self.left = if random.once_in(4.0) { random.below(60) } else { random.below(3) };
            let codes = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 9.9e37, -1e99];
            self.fault = match random.below(4) {
                0 => Fault::Jump(10.0 * random.signed()),
                1 => Fault::Frozen(measured),
                _ => Fault::Nothing(codes[random.below(6)]),
            };
        } else {
            self.fault = Fault::None;
        }
        match self.fault {
            Fault::None => measured,
            Fault::Nothing(code) => code,
            Fault::Jump(by) => measured + by,
            Fault::Frozen(at) => at,
        }
    }

    /// Holds a drive for one sample; whether it was written.
    ///
    /// # Errors
    /// [`Breach`] for a drive that must not be.
    pub fn put_out(&mut self, drive: f64) -> Result<bool, Breach> {
        if self.random.once_in(LOST_ONCE_IN) {
            self.stage.advance(self.guard.last());
            return Ok(false);
        }
        self.hold(drive)?;
        Ok(true)
    }

    /// Holds a drive for one sample, without fail.
    ///
    /// # Errors
    /// [`Breach`] for a drive that must not be.
    pub fn hold(&mut self, drive: f64) -> Result<(), Breach> {
        self.guard.pass(drive)?;
        self.stage.advance(drive);
        Ok(())
    }

    /// The drive that the amplifier has.
    #[must_use]
    pub fn drive(&self) -> f64 {
        self.guard.last()
    }

    /// Somebody brings the amplifier to another drive.
    pub fn told(&mut self, drive: f64) {
        self.guard.told(drive);
    }
}

impl Driven<Ended> for Bench {
    const WRITE_MAY_FAIL: bool = true;

    fn read(&mut self, _: Option<usize>) -> Result<Reading, Ended> {
        Ok(Reading { measured: self.show(), position: self.stage.output() })
    }

    fn write(&mut self, _: Option<usize>, drive: f64) -> Result<(), Ended> {
        if self.put_out(drive).map_err(Ended::Broken)? { Ok(()) } else { Err(Ended::Lost) }
    }

    fn put_out(&mut self, _: Option<usize>, _: f64) -> Result<f64, Ended> {
        Ok(self.drive())
    }

    fn limits(&self) -> Option<(f64, f64)> {
        None
    }
}
