//! What the controller of an array remembers, beside the streams of its inverses.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::counters::ArrayCounters;
use crate::control::Mode;
use crate::control::loop_state::check_terms;
use crate::control::options::check_drives;
use crate::error::{Error, check_length, check_positive};
use crate::stream::StreamState;

/// Where a stop goes, and how fast.
///
/// ```
/// use hysteresis_core::ArrayStop;
/// let stop = ArrayStop { rate: 100.0, rest_drive: vec![0.0, 5.0] };
/// assert_eq!(stop.rest_drive.len(), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ArrayStop {
    /// How fast the drives move, in volts per second. A slower slew bounds it.
    pub rate: f64,
    /// The drives at which it ends, in volts.
    pub rest_drive: Vec<f64>,
}

/// Everything that an [`ArrayController`](super::ArrayController) remembers: restored, it continues bit for bit.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayOptions, ArraySample, CompiledModel, Offsets, PrandtlIshlinskii, StreamArray};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let models = [CompiledModel::new(&(&model).into()), CompiledModel::new(&(&model).into())];
/// let inverse = StreamArray::inverse(&models, Some((-10.0, 10.0))).map_err(|wrong| wrong.error)?;
/// let mut controller = ArrayController::new(inverse, &ArrayOptions::new(1e-3))?;
/// let saved = controller.state();
/// let (mut drives, mut again) = ([0.0; 2], [0.0; 2]);
/// controller.step(&ArraySample::of(&[1.0, 2.0]), &mut drives)?;
/// controller.set_state(&saved)?;
/// controller.step(&ArraySample::of(&[1.0, 2.0]), &mut again)?;
/// assert_eq!(drives, again);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ArrayControllerState {
    /// The fingerprint of reconstruction, pairs, slew and bumpless time.
    pub setup: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The integral gain per second.
    pub ki: f64,
    /// The leak per second.
    pub leak: f64,
    /// What each inverse remembers.
    pub streams: Vec<StreamState>,
    /// The present drives.
    pub drives: Vec<f64>,
    /// The integral of every actuator, in the unit of the models' output.
    pub integral: Vec<f64>,
    /// What is left of the differences at a start or a change, in the same unit.
    pub bumpless: Vec<f64>,
    /// Whether a motion is under way. If not, the next sample starts one from the present drives.
    pub started: bool,
    /// For how many samples the bumpless term goes on.
    pub bumpless_samples: u32,
    /// For how many samples the integral still rests. A start shortens it to its bumpless time.
    pub integral_rest_samples: u32,
    /// What the controller does with its samples: run, hold or stop.
    pub mode: Mode,
    /// Where a stop goes; none in the other modes.
    pub stop: Option<ArrayStop>,
    /// What was counted.
    pub counters: ArrayCounters,
}

/// What changes from sample to sample, apart from the streams.
#[derive(Clone, Debug)]
pub(super) struct LoopState {
    pub(super) drives: Box<[f64]>,
    pub(super) integral: Box<[f64]>,
    pub(super) bumpless: Box<[f64]>,
    pub(super) started: bool,
    pub(super) bumpless_samples: u32,
    pub(super) integral_rest_samples: u32,
    pub(super) mode: Mode,
    pub(super) stop_rate: f64,
    pub(super) rest_drives: Box<[f64]>,
    pub(super) counters: ArrayCounters,
}

impl LoopState {
    /// At rest at these drives.
    pub(super) fn at(drives: Vec<f64>) -> Self {
        let zeros = || vec![0.0; drives.len()].into_boxed_slice();
        Self {
            integral: zeros(),
            bumpless: zeros(),
            rest_drives: zeros(),
            drives: drives.into(),
            started: false,
            bumpless_samples: 0,
            integral_rest_samples: u32::MAX,
            mode: Mode::Run,
            stop_rate: 0.0,
            counters: ArrayCounters::default(),
        }
    }

    /// As made, but for the drives.
    pub(super) fn reset(&mut self) {
        self.integral.fill(0.0);
        self.bumpless.fill(0.0);
        self.bumpless_samples = 0;
        self.mode = Mode::Run;
        self.counters = ArrayCounters::default();
        self.end_motion();
    }

    /// The next sample starts a motion from the present drives, with an integral that rests at first.
    pub(super) fn end_motion(&mut self) {
        (self.started, self.integral_rest_samples) = (false, u32::MAX);
    }

    /// The bumpless term after the next sample, as a share of the present one.
    #[inline]
    pub(super) fn bumpless_share(&self) -> f64 {
        let left = self.bumpless_samples.saturating_sub(1);
        if left > 0 { f64::from(left) / f64::from(self.bumpless_samples) } else { 0.0 }
    }

    pub(super) fn stop(&self) -> Option<ArrayStop> {
        (self.mode == Mode::Stop).then(|| ArrayStop { rate: self.stop_rate, rest_drive: self.rest_drives.to_vec() })
    }

    /// Takes over a state that was checked.
    pub(super) fn restore(&mut self, state: &ArrayControllerState) {
        self.drives.copy_from_slice(&state.drives);
        self.integral.copy_from_slice(&state.integral);
        self.bumpless.copy_from_slice(&state.bumpless);
        self.started = state.started;
        self.bumpless_samples = state.bumpless_samples;
        self.integral_rest_samples = state.integral_rest_samples;
        self.mode = state.mode;
        self.counters = state.counters;
        if let Some(stop) = &state.stop {
            self.stop_rate = stop.rate;
            self.rest_drives.copy_from_slice(&stop.rest_drive);
        }
    }
}

impl ArrayControllerState {
    /// Whether a controller with these limits can be in this state, as far as the streams do not say it.
    pub(super) fn check(&self, limits: &[(f64, f64)]) -> Result<(), Error> {
        let actuators = limits.len();
        check_length("state.streams", actuators, self.streams.len())?;
        check_drives("state.drives", &self.drives, limits.iter().copied())?;
        for (parameter, terms) in [("state.integral", &self.integral), ("state.bumpless", &self.bumpless)] {
            check_length(parameter, actuators, terms.len())?;
            check_terms(terms)?;
        }
        match (self.mode, &self.stop) {
            (Mode::Stop, Some(stop)) => {
                check_positive("state.stop.rate", stop.rate)?;
                check_drives("state.stop.rest_drive", &stop.rest_drive, limits.iter().copied())
            }
            (Mode::Run | Mode::Hold, None) => Ok(()),
            _ => Err(Error::State { expected: "the mode run or hold, or a stop with its rate and rest drives" }),
        }
    }
}
