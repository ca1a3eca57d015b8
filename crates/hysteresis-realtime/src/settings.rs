//! What is asked of a loop: what it follows, how it runs, and why it cannot start.

use core::fmt;
use std::path::PathBuf;

use hysteresis_control::StageController;
use hysteresis_core::{Error as CoreError, FeedForward, Mode, check_all_finite, is_admissible};
use serde::{Deserialize, Serialize};

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
    /// For how many seconds before each deadline it spins instead of sleeping. It first looks at the coming sample, so
    /// that the processor has all at hand.
    pub spin: f64,
    /// The processor on which it runs, counted from 0.
    pub cpu: Option<usize>,
    /// The priority of `SCHED_FIFO`, 1 to 99.
    pub fifo: Option<u8>,
    /// Whether all memory of the process stays in memory, until the last loop that wants it has ended.
    pub lock_memory: bool,
    /// The file to which samples are written: npy, an array of records. One that is there is replaced when the first
    /// samples are written.
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

/// What the loop does when the drive of a sample is written only after the next sample was due.
///
/// ```
/// use hysteresis_realtime::MissPolicy;
/// assert_eq!(MissPolicy::default(), MissPolicy::Skip);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MissPolicy {
    /// The loop goes on with the first deadline that is still to come. Samples between are not taken: the reference is
    /// that of the time, and the controller takes fewer steps than time went by.
    #[default]
    Skip,
    /// The loop takes the samples that are due one after the other, without sleep, until it is on time. So the
    /// controller takes every sample of the reference. The drive moves meanwhile by what the slew gives for the time
    /// that goes by, which is next to nothing.
    CatchUp {
        /// When the loop is further behind than so many samples, those before are skipped.
        at_most: u32,
    },
    /// The loop goes to rest.
    Stop,
}

/// For how long measurements may be missing, in seconds.
///
/// A fresh measurement is one that the input says is new, and that the controller believes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchdogTimes {
    /// For so long the last fresh measurement stands in for one that does not come. With 0 it never does. From then on
    /// the controller is told that there is none: it holds the drive, unless it is still coming back from the last
    /// loss.
    pub stale_after: f64,
    /// After so long without a fresh measurement the drive goes to rest, for good.
    pub rest_after: f64,
}

/// Positions, one per sampling interval.
///
/// ```
/// use hysteresis_realtime::Reference;
/// let reference = Reference::periodic(vec![0.0, 1.0, 2.0])?;
/// assert_eq!([2, 3, 100].map(|sample| reference.at(sample)), [2.0, 0.0, 1.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Reference {
    positions: Box<[f64]>,
    repeats: bool,
}

impl Reference {
    /// Positions that are followed again and again.
    ///
    /// # Errors
    /// [`CoreError`] for none, or one that is not finite.
    pub fn periodic(positions: Vec<f64>) -> Result<Self, CoreError> {
        Self::new(positions, true)
    }

    /// Positions that are followed once; then the loop goes to rest.
    ///
    /// # Errors
    /// [`CoreError`] for none, or one that is not finite.
    pub fn once(positions: Vec<f64>) -> Result<Self, CoreError> {
        Self::new(positions, false)
    }

    fn new(positions: Vec<f64>, repeats: bool) -> Result<Self, CoreError> {
        let parameter = "reference";
        if positions.is_empty() {
            return Err(CoreError::Empty { parameter });
        }
        check_all_finite(parameter, &positions)?;
        Ok(Self { positions: positions.into(), repeats })
    }

    /// The position wanted at a sample; past the end the last one.
    #[inline]
    #[must_use]
    pub fn at(&self, sample: u64) -> f64 {
        let length = self.positions.len() as u64;
        let sample = if self.repeats { sample % length } else { sample.min(length - 1) };
        usize::try_from(sample).ok().and_then(|sample| self.positions.get(sample)).copied().unwrap_or(f64::NAN)
    }

    /// How many samples there are, if they are followed once.
    #[must_use]
    pub fn length(&self) -> Option<u64> {
        (!self.repeats).then_some(self.positions.len() as u64)
    }
}

/// Why a loop could not start: the message names the parameter, what was expected and what came.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Parameter(hysteresis_core::Error),
    /// A controller whose feed-forward is given with every sample: the loop has references only.
    GivenFeedForward,
    /// A controller in a hold or a stop, in which nothing would move it.
    Rests(Mode),
    /// The file of the record.
    Record {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// The thread of the loop.
    Thread(std::io::Error),
}

impl Error {
    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Parameter(error) => error.parameter(),
            Self::GivenFeedForward | Self::Rests(_) => Some("controller"),
            Self::Record { .. } => Some("record"),
            Self::Thread(_) => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::GivenFeedForward => f.write_str(
                "controller: expected a feed-forward from references, got one that is given with every sample",
            ),
            Self::Rests(mode) => {
                let mode = if *mode == Mode::Stop { "stop" } else { "hold" };
                write!(f, "controller: expected one that moves, got one in its {mode}; `release` lets it go on")
            }
            Self::Record { path, error } => {
                write!(f, "record: expected a file to write to, got {}: {error}", path.display())
            }
            Self::Thread(error) => write!(f, "the thread of the loop could not start: {error}"),
        }
    }
}

impl core::error::Error for Error {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Parameter(error) => Some(error),
            Self::Record { error, .. } | Self::Thread(error) => Some(error),
            Self::GivenFeedForward | Self::Rests(_) => None,
        }
    }
}

impl From<hysteresis_core::Error> for Error {
    fn from(error: hysteresis_core::Error) -> Self {
        Self::Parameter(error)
    }
}
