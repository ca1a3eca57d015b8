//! How a controller is set up.

use core::mem::MaybeUninit;

use hysteresis_control::stage::{self, FeedForwardKind};
use hysteresis_core::{ControllerOptions as Options, HybridController};

use crate::status::{Failure, Status, guard, tell};

/// Where the feed-forward of a controller comes from.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// The exact inverse of the reference of now.
    Inverse = 0,
    /// The exact inverse of a target made of references that come early (mpih_controller_ahead samples): through the inverse of
    /// amplifier, modes and dead time too.
    Preview = 1,
    /// Drives that come with every sample: mpih_controller_step_given.
    Given = 2,
}

/// How a controller is set up. Fill it with mpih_controller_options_default first, then change what you need. NaN stands for
/// what the stage says.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ControllerOptions {
    /// The lowest drive; both limits are given or none. They lie within those of the stage.
    pub limit_low: f64,
    /// The highest drive.
    pub limit_high: f64,
    /// The proportional gain, in V/um. Both gains are given or none: without them gains and filters are tuned for the stage.
    pub kp: f64,
    /// The integral gain, in V/um/s.
    pub ki: f64,
    /// How fast the drive may move, per second; infinity for no bound.
    pub slew: f64,
    /// The drive that the amplifier has at the start; NaN for 0 or the limit nearest to it.
    pub start_drive: f64,
    /// How long the difference at a start or a switch takes to go to zero, in seconds; NaN for 5 ms.
    pub bumpless_time: f64,
    /// The lowest measurement that the sensor can show; both ends are given or none. NaN for a stroke beyond the positions.
    pub measurement_low: f64,
    /// The highest measurement that the sensor can show.
    pub measurement_high: f64,
    /// The largest change of the measurement from one sample to the next; NaN for no bound.
    pub max_measurement_step: f64,
    /// Over how many seconds references with steps and corners are smoothed; 0 for not at all. With MPIH_FEEDFORWARD_PREVIEW
    /// only. The `smoothing` of the properties of a stage leaves its modes at rest.
    pub smoothing: f64,
    /// One of the numbers of mpih_feedforward.
    pub feedforward: i32,
    /// How many samples early references come, before smoothing; -1 for as many as the stage needs. With
    /// MPIH_FEEDFORWARD_PREVIEW only.
    pub ahead: i32,
    /// How many measurements in a row may be missing, the drive being held, before feed-forward goes on alone; -1 for 10. Where
    /// losses follow each other within the bumpless time, the last error stands in.
    pub max_missing: i32,
    /// 0.
    pub reserved: i32,
}

impl Default for ControllerOptions {
    fn default() -> Self {
        let open = f64::NAN;
        Self {
            limit_low: open,
            limit_high: open,
            kp: open,
            ki: open,
            slew: open,
            start_drive: open,
            bumpless_time: open,
            measurement_low: open,
            measurement_high: open,
            max_measurement_step: open,
            smoothing: 0.0,
            feedforward: Feedforward::Inverse as i32,
            ahead: -1,
            max_missing: -1,
            reserved: 0,
        }
    }
}

fn wrong(message: String) -> Failure {
    Failure::new(Status::Argument, message)
}

/// A number that may be left open.
pub(crate) fn given(number: f64) -> Option<f64> {
    (!number.is_nan()).then_some(number)
}

/// Two numbers that are given together or not at all.
fn pair(names: [&str; 2], numbers: [f64; 2]) -> Result<Option<(f64, f64)>, Failure> {
    match numbers.map(given) {
        [Some(one), Some(other)] => Ok(Some((one, other))),
        [None, None] => Ok(None),
        [Some(one), None] => {
            Err(wrong(format!("{}: expected a number beside {} = {one:?}, got nan", names[1], names[0])))
        }
        [None, Some(other)] => {
            Err(wrong(format!("{}: expected a number beside {} = {other:?}, got nan", names[0], names[1])))
        }
    }
}

/// Limits of the drive, or those of the stage.
pub(crate) fn limits(low: f64, high: f64) -> Result<Option<(f64, f64)>, Failure> {
    pair(["limit_low", "limit_high"], [low, high])
}

/// A count that may be left open by -1.
fn count(name: &str, got: i32) -> Result<Option<u32>, Failure> {
    match got {
        -1 => Ok(None),
        _ => u32::try_from(got).map(Some).map_err(|_| wrong(format!("{name}: expected 0 or more, or -1, got {got}"))),
    }
}

impl ControllerOptions {
    /// A controller of a stage.
    pub(crate) fn controller(&self, stage: &stage::Stage, dt: f64) -> Result<HybridController, Failure> {
        if self.reserved != 0 {
            return Err(wrong(format!("reserved: expected 0, got {}", self.reserved)));
        }
        let kind = self.kind(stage, dt)?;
        let limits = limits(self.limit_low, self.limit_high)?;
        let mut options = match pair(["kp", "ki"], [self.kp, self.ki])? {
            Some(gains) => stage.controller_options_with_gains(dt, limits, gains)?,
            None => stage.controller_options(dt, limits)?,
        };
        self.change(&mut options)?;
        Ok(stage.controller(kind, &options)?)
    }

    /// What is given takes the place of what the stage says.
    fn change(&self, options: &mut Options) -> Result<(), Failure> {
        if let Some(slew) = given(self.slew) {
            options.slew = (slew != f64::INFINITY).then_some(slew);
        }
        options.start_drive = given(self.start_drive).or(options.start_drive);
        options.bumpless_time = given(self.bumpless_time).unwrap_or(options.bumpless_time);
        let range = pair(["measurement_low", "measurement_high"], [self.measurement_low, self.measurement_high])?;
        options.measurement_range = range.or(options.measurement_range);
        options.max_measurement_step = given(self.max_measurement_step).or(options.max_measurement_step);
        options.max_missing = count("max_missing", self.max_missing)?.unwrap_or(options.max_missing);
        Ok(())
    }

    fn kind(&self, stage: &stage::Stage, dt: f64) -> Result<FeedForwardKind, Failure> {
        let ahead = count("ahead", self.ahead)?;
        if self.feedforward == Feedforward::Preview as i32 {
            let ahead = ahead.map_or_else(|| stage.preview_ahead(dt), |ahead| Ok(ahead as usize))?;
            return Ok(FeedForwardKind::Preview { ahead, smoothing: self.smoothing });
        }
        if let Some(ahead) = ahead {
            return Err(wrong(format!("ahead: expected -1 without MPIH_FEEDFORWARD_PREVIEW, got {ahead}")));
        }
        if self.smoothing != 0.0 {
            let got = self.smoothing;
            return Err(wrong(format!("smoothing: expected 0 without MPIH_FEEDFORWARD_PREVIEW, got {got:?}")));
        }
        match self.feedforward {
            known if known == Feedforward::Inverse as i32 => Ok(FeedForwardKind::Inverse),
            known if known == Feedforward::Given as i32 => Ok(FeedForwardKind::Given),
            got => Err(wrong(format!("feedforward: expected 0, 1 or 2, a number of mpih_feedforward, got {got}"))),
        }
    }
}

/// Fills the options with what the stage says: tuned gains with their filters, the limits and the slew rate of the stage, the
/// exact inverse of the reference of now.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_options_default(options: Option<&mut MaybeUninit<ControllerOptions>>) -> Status {
    guard(|| tell("options", options, ControllerOptions::default()))
}
