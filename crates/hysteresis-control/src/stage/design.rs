//! Controllers, feedback, observation and learning made from a stage.

use hysteresis_core::{ControllerOptions, HybridController, Preview, Sections};

use super::{Error, Stage, rest_drive};
use crate::feedforward::{PreviewCoefficients, PreviewOptions, smoothing_kernel};
use crate::filters::sections;
use crate::learning::FeedbackLoop;
use crate::linear::SecondOrder;
use crate::tuning::{LoopFamily, Tuning, TuningOptions, light_modes, tune};

/// The peak of the sensitivity that gains are found for unless told: a phase margin of at least 34 degrees.
pub const PEAK_SENSITIVITY: f64 = 1.7;

/// Up to which share of the sampling rate a preview that nobody sized must follow references, and within which error.
const FOLLOWED: f64 = 0.01;
const FOLLOWED_WITHIN: f64 = 1e-3;

/// Twice as long a preview is worth its samples if the drives at a corner are larger than this many times those that it
/// makes.
const CALMER: f64 = 1.5;

/// Where the feed-forward of a controller comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FeedForwardKind {
    /// The exact inverse of maps, hysteresis, loop shift, relaxing plays, slow gain and creep, of the reference of now.
    Inverse,
    /// The same, of a target made of references that come `ahead` samples early: through the inverse of modes and dead
    /// time first, and last through that of the amplifier, which is in front of the hysteresis.
    Preview {
        /// How many samples early references come.
        ahead: usize,
        /// Over how many seconds they are smoothed besides; 0 for not at all. They come half of that earlier then.
        smoothing: f64,
    },
    /// Drives that come with every sample, from [`Stage::precompensate`].
    Given,
}

impl Stage {
    /// Gains of the feedback for every slope of the hysteresis, at a peak of the sensitivity.
    ///
    /// # Errors
    /// [`Error::Falling`]; [`Error`] for a `dt` that is not above 0, a peak outside 1.05 to 5, or dynamics that cannot
    /// be tuned for.
    pub fn tune(&self, dt: f64, peak_sensitivity: f64) -> Result<Tuning, Error> {
        self.tune_with(&self.tuning_options(dt, peak_sensitivity)?)
    }

    /// What [`tune`](Self::tune) asks for, with the slopes of this stage and what is known of its modes: to be changed
    /// and given to [`tune_with`](Self::tune_with).
    ///
    /// # Errors
    /// [`Error::Falling`], or a hysteresis without an inverse.
    pub fn tuning_options(&self, dt: f64, peak_sensitivity: f64) -> Result<TuningOptions, Error> {
        self.check_rising()?;
        let gain = self.parts().dynamics.static_gain().abs();
        let (low, high) = self.slope_range();
        // The gain of the dynamics is part of theirs.
        let usual = TuningOptions::new((low / gain, high / gain), dt, peak_sensitivity);
        Ok(TuningOptions { uncertainty: self.mode_uncertainty(), ..usual })
    }

    /// Filters and gains of the feedback for these options.
    ///
    /// # Errors
    /// As for [`tune`], and [`Error::NegativeDeadTime`].
    pub fn tune_with(&self, options: &TuningOptions) -> Result<Tuning, Error> {
        Ok(tune(&self.linear_part()?, options)?)
    }

    /// The loops that a tuning of this stage makes over frequency.
    ///
    /// # Errors
    /// As for [`tune_with`](Self::tune_with).
    pub fn loop_family(&self, options: &TuningOptions, tuning: &Tuning) -> Result<LoopFamily, Error> {
        Ok(LoopFamily::new(&self.linear_part()?, options, tuning)?)
    }

    /// Feedback with positive gains needs a position that rises with the drive.
    fn check_rising(&self) -> Result<(), Error> {
        self.rigid.check_invertible()?;
        let parts = self.parts();
        let falling =
            [&parts.input_map, &parts.output_map].into_iter().flatten().filter(|map| !map.is_rising()).count();
        let negative = parts.dynamics.static_gain() < 0.0;
        if (falling + usize::from(negative)) % 2 == 0 { Ok(()) } else { Err(Error::Falling) }
    }

    /// The window of references that leads through the inverse of amplifier, modes and dead time, sample by sample.
    ///
    /// # Errors
    /// [`Error`] for a window that cannot be.
    pub fn preview(&self, dt: f64, options: &PreviewOptions) -> Result<PreviewCoefficients, Error> {
        Ok(PreviewCoefficients::new(&self.linear_part()?, dt, options)?)
    }

    /// For how many seconds a reference must be smoothed so that its steps leave all lightly damped modes at rest:
    /// three periods of the slowest. 0 without such a mode.
    #[must_use]
    pub fn smoothing(&self) -> f64 {
        let slowest =
            light_modes(&self.parts().dynamics).iter().map(SecondOrder::frequency).fold(f64::INFINITY, f64::min);
        3.0 / slowest
    }

    /// How many samples ahead of the dead time a preview must look: the fewest of 4, 8, .. 256 that follow references
    /// up to a hundredth of the sampling rate within 0.1 %, and make of a corner no drives that twice as many would
    /// make a third smaller; or else those that follow references best. A resonance needs 4, one far below the sampling
    /// rate behind an amplifier 16: what a shorter window makes of a corner no slew rate allows. Zeros in the right
    /// half plane need more.
    ///
    /// # Errors
    /// As for [`preview`](Self::preview).
    pub fn preview_ahead(&self, dt: f64) -> Result<usize, Error> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
        let passed = (self.causal_dead_time()? / dt).ceil() as usize;
        let mut best = (f64::INFINITY, passed.saturating_add(4));
        // The last window that follows well enough, and by how much the drives are larger than the references at most.
        let mut shorter: Option<(usize, f64)> = None;
        for more in (2..=8).map(|power| 1_usize << power) {
            let ahead = passed.saturating_add(more);
            let window = match self.preview(dt, &PreviewOptions::new(ahead)) {
                Ok(window) => window,
                // A dead time so long that no window reaches it is for the first one to name.
                Err(error) if best.0.is_infinite() => return Err(error),
                Err(_) => break,
            };
            let largest: f64 = window.coefficients().iter().map(|c| c.abs()).sum();
            if let Some((ahead, _)) = shorter.filter(|(_, before)| *before <= CALMER * largest) {
                return Ok(ahead);
            }
            let error = (1..=16).map(|part| window.error(f64::from(part) / 16.0 * FOLLOWED / dt)).fold(0.0, f64::max);
            if error < best.0 {
                best = (error, ahead);
            }
            if error <= FOLLOWED_WITHIN {
                shorter = Some((ahead, largest));
            }
        }
        Ok(shorter.map_or(best.1, |(ahead, _)| ahead))
    }

    /// The linear model of the loop around this stage with its inverse, these gains and filters: for learning. Its
    /// slope is the geometric mean of those of the hysteresis.
    ///
    /// # Errors
    /// [`Error::NegativeDeadTime`], [`Error::Falling`], or a hysteresis without an inverse.
    pub fn feedback_loop(&self, dt: f64, (kp, ki): (f64, f64), filters: Sections) -> Result<FeedbackLoop, Error> {
        self.check_rising()?;
        let (low, high) = self.slope_range();
        let slope = (low * high).sqrt() / self.parts().dynamics.static_gain().abs();
        Ok(FeedbackLoop { kp, ki, filters, slope, dynamics: self.linear_part()?, dt })
    }

    /// How many periods learning should let pass after each change: one where a mode is lightly damped, else none.
    #[must_use]
    pub fn periods_to_settle(&self) -> u32 {
        u32::from(!light_modes(&self.parts().dynamics).is_empty())
    }

    /// Options of a controller of this stage: tuned gains, the limits, the slew rate, and a gate for measurements that
    /// cannot be, more than a stroke outside the range of positions.
    ///
    /// # Errors
    /// As for [`tune`](Self::tune) and [`limits`](Self::limits); without limits [`Error::NoLimits`].
    pub fn controller_options(&self, dt: f64, limits: Option<(f64, f64)>) -> Result<ControllerOptions, Error> {
        self.controller_options_tuned(&self.tuning_options(dt, PEAK_SENSITIVITY)?, limits)
    }

    /// [`controller_options`](Self::controller_options) with gains that are tuned like this.
    ///
    /// # Errors
    /// As for [`controller_options`](Self::controller_options).
    pub fn controller_options_tuned(
        &self,
        tuning: &TuningOptions,
        limits: Option<(f64, f64)>,
    ) -> Result<ControllerOptions, Error> {
        self.controller_options_of(&self.tune_with(tuning)?, tuning.dt, limits)
    }

    /// [`controller_options`](Self::controller_options) with the gains and filters of a tuning of this stage for this
    /// sampling interval.
    ///
    /// # Errors
    /// As for [`controller_options_with_gains`](Self::controller_options_with_gains).
    pub fn controller_options_of(
        &self,
        tuning: &Tuning,
        dt: f64,
        limits: Option<(f64, f64)>,
    ) -> Result<ControllerOptions, Error> {
        let given = self.controller_options_with_gains(dt, limits, (tuning.kp, tuning.ki))?;
        Ok(ControllerOptions { filters: sections(&tuning.filters, dt)?, ..given })
    }

    /// [`controller_options`](Self::controller_options) with these gains and no filters, which belong to the gains that
    /// were tuned with them. Nothing is tuned.
    ///
    /// # Errors
    /// As for [`limits`](Self::limits); without limits [`Error::NoLimits`]; [`Error::Falling`].
    pub fn controller_options_with_gains(
        &self,
        dt: f64,
        limits: Option<(f64, f64)>,
        (kp, ki): (f64, f64),
    ) -> Result<ControllerOptions, Error> {
        self.check_rising()?;
        let Some(limits) = self.limits(limits)? else {
            return Err(Error::NoLimits);
        };
        let measurement_range = self.widest_position_range().map(|(low, high)| (2.0 * low - high, 2.0 * high - low));
        Ok(ControllerOptions {
            slew: self.parts().slew,
            start_drive: Some(rest_drive(Some(limits))),
            measurement_range,
            ..ControllerOptions::new(kp, ki, dt, limits)
        })
    }

    /// A controller of this stage.
    ///
    /// # Errors
    /// As for [`inverse`](Self::inverse), [`preview`](Self::preview), or options that no controller can have.
    pub fn controller(
        &self,
        feedforward: FeedForwardKind,
        options: &ControllerOptions,
    ) -> Result<HybridController, Error> {
        let limits = Some(options.limits);
        let (source, preview) = match feedforward {
            FeedForwardKind::Inverse => (self.inverse(options.dt, limits)?.into(), None),
            FeedForwardKind::Preview { ahead, smoothing } => {
                let window = self.preview(options.dt, &PreviewOptions::new(ahead))?;
                let plain = Preview::new(window.coefficients(), window.ahead())?;
                let preview =
                    if smoothing == 0.0 { plain } else { plain.smoothed(&smoothing_kernel(smoothing, options.dt)?)? };
                (self.inverse_behind_amplifier(options.dt, limits)?.into(), Some(preview))
            }
            FeedForwardKind::Given => (hysteresis_core::FeedForward::Given, None),
        };
        Ok(HybridController::new(source, preview, options)?)
    }
}
