//! What is asked of a loop.

use std::path::PathBuf;

use hysteresis_control::StageController;
use hysteresis_core::{Error as CoreError, FeedForward, Mode, is_admissible};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::policy::MissPolicy;
use crate::watchdog::WatchdogTimes;

/// Shorter intervals are shorter than what a clock and a wake-up take.
const SHORTEST: f64 = 1e-6;
const LONGEST: f64 = 10.0;
/// Times above are no times of a loop, and times in nanoseconds stay exact in a double.
const LONGEST_TIME: f64 = 9e6;

/// How a loop runs. The sampling interval is that of its controller.
///
/// ```
/// use hysteresis_realtime::{MissPolicy, Settings};
/// let settings = Settings { seconds: Some(10.0), ..Settings::new(0.0, 2000.0) }; // V, V/s
/// assert_eq!(settings.misses, MissPolicy::Skip);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The drive at which the loop ends, in volts.
    pub rest_drive: f64,
    /// How fast it goes there, in volts per second. A slower slew of the controller bounds it.
    pub rest_rate: f64,
    /// After how many seconds it goes to rest; without, when it is asked to or the reference is over.
    pub seconds: Option<f64>,
    /// What becomes of missed deadlines.
    pub misses: MissPolicy,
    /// For how long measurements may be missing. Without, for ever: the drive is then held.
    pub watchdog: Option<WatchdogTimes>,
    /// The loop ends where it is after so many writes in a row that failed.
    pub write_faults: u32,
    /// For how many seconds before each deadline it spins instead of sleeping. It first looks at the coming sample, so that the processor
    /// has all at hand.
    pub spin: f64,
    /// The processor on which it runs, counted from 0.
    pub cpu: Option<usize>,
    /// The priority of `SCHED_FIFO`, 1 to 99.
    pub fifo: Option<u8>,
    /// Whether all memory of the process stays in memory, until the last loop that wants it has ended.
    pub lock_memory: bool,
    /// The file to which samples are written: npy, an array of records. One that is there is replaced when the first samples are written.
    pub record: Option<PathBuf>,
    /// How many samples may wait to be written.
    pub ring: usize,
}

impl Settings {
    /// Without an end in time, skipping what it misses, no measurement standing in for another one and a watchdog
    /// of 100 ms; at most 100 failed writes in a row;
    /// without spinning, privileges and record.
    #[must_use]
    pub fn new(rest_drive: f64, rest_rate: f64) -> Self {
        Self {
            rest_drive,
            rest_rate,
            seconds: None,
            misses: MissPolicy::default(),
            watchdog: Some(WatchdogTimes { stale_after: 0.0, rest_after: 0.1 }),
            write_faults: 100,
            spin: 0.0,
            cpu: None,
            fifo: None,
            lock_memory: false,
            record: None,
            ring: 1 << 16,
        }
    }

    /// Checks everything, so that nothing can fail later.
    pub(crate) fn check(&self, controller: &StageController) -> Result<(), Error> {
        let options = controller.controller().options();
        check("dt", options.dt, (SHORTEST, LONGEST), "a sampling interval of the controller from 1e-6 to 10 seconds")?;
        if matches!(controller.controller().feedforward(), FeedForward::Given) {
            return Err(Error::GivenFeedForward);
        }
        if let mode @ (Mode::Hold | Mode::Stop) = controller.controller().mode() {
            return Err(Error::Rests(mode));
        }
        let (low, high) = options.limits;
        if !(low <= self.rest_drive && self.rest_drive <= high) {
            let expected = "a drive within the limits of the controller";
            return Err(CoreError::domain("rest_drive", None, expected, self.rest_drive).into());
        }
        self.check_rate(options.dt, (low, high), options.slew)?;
        if let Some(seconds) = self.seconds {
            check("seconds", seconds, (options.dt, LONGEST_TIME), "a time from the sampling interval to 9e6 seconds")?;
        }
        if let Some(WatchdogTimes { stale_after, rest_after }) = self.watchdog {
            check(
                "rest_after",
                rest_after,
                (options.dt, LONGEST_TIME),
                "a time from the sampling interval to 9e6 seconds",
            )?;
            check("stale_after", stale_after, (0.0, rest_after), "a time from 0 to rest_after")?;
        }
        check("spin", self.spin, (0.0, LONGEST), "a time from 0 to 10 seconds")?;
        if self.write_faults == 0 {
            return Err(CoreError::whole("write_faults", None, "a whole number from 1", 0).into());
        }
        if let Some(priority) = self.fifo
            && !(1..=99).contains(&priority)
        {
            return Err(CoreError::whole("fifo", None, "a priority from 1 to 99", priority.into()).into());
        }
        if self.ring == 0 {
            return Err(CoreError::whole("ring", None, "a whole number from 1", 0).into());
        }
        Ok(())
    }

    /// The ramp must come to its end: a step that is lost in the rounding of the drive never would.
    fn check_rate(&self, dt: f64, (low, high): (f64, f64), slew: Option<f64>) -> Result<(), Error> {
        let rate = self.rest_rate;
        let step = rate.min(slew.unwrap_or(f64::INFINITY)) * dt;
        let smallest = low.abs().max(high.abs()) * 1e-12;
        if is_admissible(rate) && rate > 0.0 && step > smallest {
            return Ok(());
        }
        let expected = "a rate above 0 that moves the drive at every sample";
        Err(CoreError::domain("rest_rate", None, expected, rate).into())
    }
}

fn check(parameter: &'static str, got: f64, (low, high): (f64, f64), expected: &'static str) -> Result<(), Error> {
    if low <= got && got <= high { Ok(()) } else { Err(CoreError::domain(parameter, None, expected, got).into()) }
}
