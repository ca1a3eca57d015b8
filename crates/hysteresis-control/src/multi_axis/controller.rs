//! The controller of a stage of several axes: a controller for each drive, and what leads all of them.

use hysteresis_core::{
    AxesCommand, Bound, ControllerOptions, Error, FeedForward, HybridController, Mode, MultiAxisController, Preview,
    check_length, is_admissible,
};
use serde::{Deserialize, Serialize};

use super::model::MultiAxisStage;
use super::tracking::{Asked, Numbers, Tracking, TrackingState};
use super::tracking_gains::TrackingOptions;

/// A [`MultiAxisController`] with the feed-forward and the observer of a [`MultiAxisStage`]:
///
/// ```text
/// u_i(k) = volts_i - kp_i d_i    volts = drives that lead the model along the references
///                                d = a disturbance that comes in with the drives, from the measurements
/// ```
///
/// Limits, slew, what is counted, holds, stops and the freedom from jumps are those of the single controllers. Their
/// references and measurements are (D r)_i and (D y)_i, D being the inverse of the static gain of the stage: the drives
/// that keep the positions there. Their error is -d_i, and not a tracking error: a kp of 1 takes away all of the
/// disturbance, one from 0 to 1 a share of it. There is no ki: d stays whatever the drives do, so it would wind up an
/// integral, and what lasts is in d itself. References come
/// [`ahead`](Tracking::ahead) samples early. Targets and corrections come as early, and enter the feed-forward in the
/// place of the references, or beside them. Without a stage it is the controller alone, bit for bit.
///
/// A measurement that one of the controllers does not believe moves the estimate of none. A reference, target,
/// correction or given feed-forward that is not finite (or beyond 1e100) is a bad one for all drives, as each has a
/// part in every position.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan), [`commit`](Self::commit) and [`run`](Self::run) do
/// not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_control::multi_axis::{Matrices, MultiAxisForward, MultiAxisStage, ScalarOperator, TrackingOptions};
/// use hysteresis_core::ControllerOptions;
/// use nalgebra::DMatrix;
/// let two = |a, b, c, d| DMatrix::from_row_slice(2, 2, &[a, b, c, d]);
/// let matrices = Matrices {
///     a: two(0.5, 0.1, 0.0, 0.6),
///     b: two(0.4, 0.0, 0.0, 0.3),
///     bw: two(0.1, 0.0, 0.0, 0.1),
///     c: two(1.0, 0.2, -0.2, 1.0),
///     d: two(0.0, 0.0, 0.0, 0.0),
///     cq: two(0.0, 0.0, 0.0, 0.0),
///     dq: two(1.0, 0.0, 0.0, 1.0),
/// };
/// let plays = ScalarOperator::plays(&[0.2], &[1.0])?;
/// let stage = MultiAxisStage::new(matrices, vec![plays.clone(), plays], vec![0.0, 0.0], 1e-3)?;
/// let options = ControllerOptions::new(1.0, 0.0, 1e-3, (-5.0, 5.0));
/// let mut controller = stage.controller(&[options; 2], &TrackingOptions::default())?;
/// let ahead = u32::try_from(controller.tracking().unwrap().ahead())?;
/// let wanted = |k: u32| [(0.02 * f64::from(k)).sin(), 0.5 * (0.03 * f64::from(k)).sin()];
/// let (mut plant, mut drives, mut y) = (MultiAxisForward::new(&stage), [0.0; 2], [0.0; 2]);
/// for k in 0..500 {
///     controller.step((&wanted(k + ahead)).into(), &y, &mut drives)?;
///     plant.advance(&drives, &mut y)?;
///     assert!(k < 100 || (0..2).all(|i| (y[i] - wanted(k + 1)[i]).abs() < 1e-3));
/// }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct MultiAxisStageController {
    controller: MultiAxisController,
    tracking: Option<Tracking>,
    planned: Option<Sample>,
}

/// What becomes of a sample.
#[derive(Clone, Copy, Debug)]
struct Sample {
    asked: Asked,
    /// What the feedback of each controller takes for its measurement.
    estimates: Numbers,
}

/// Everything that a [`MultiAxisStageController`] remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiAxisStageState {
    /// The decoupling, row by row.
    pub decoupling: Vec<f64>,
    /// What the controller of each actuator remembers.
    pub controllers: Vec<hysteresis_core::ControllerState>,
    /// Feed-forward and observer, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<TrackingState>,
}

impl From<MultiAxisController> for MultiAxisStageController {
    fn from(controller: MultiAxisController) -> Self {
        Self { controller, tracking: None, planned: None }
    }
}

impl MultiAxisStage {
    /// A controller with these options for each drive, usually kp = 1 and ki = 0, that leads this stage along
    /// references.
    ///
    /// # Errors
    /// As for [`Tracking::new`] and [`HybridController::new`], and [`MultiAxisStageController::with_tracking`].
    pub fn controller(
        &self,
        options: &[ControllerOptions],
        tracking: &TrackingOptions,
    ) -> Result<MultiAxisStageController, Error> {
        check_length("options", self.drives(), options.len())?;
        let limits: Vec<(f64, f64)> = options.iter().map(|one| one.limits).collect();
        let made = |options: &ControllerOptions, ahead: usize| {
            let mut coefficients = vec![0.0; ahead + 1];
            coefficients[ahead] = 1.0;
            HybridController::new(FeedForward::Given, Some(Preview::new(&coefficients, ahead)?), options)
        };
        let start = options.first().map_or(Ok(0), |options| made(options, 0).map(|one| one.bumpless_samples()))?;
        let tracking = Tracking::new(self, &limits, start, tracking)?;
        let single = options.iter().map(|options| made(options, tracking.ahead())).collect::<Result<_, _>>()?;
        let decoupled = MultiAxisController::new(single, Some(tracking.decoupling()))?;
        MultiAxisStageController::from(decoupled).with_tracking(tracking)
    }
}

impl MultiAxisStageController {
    /// Led by a stage at rest, which takes the present drives for those that go out until the first measurement. Its
    /// controllers take volts that are given with every sample, and previews that look as far ahead as the stage.
    ///
    /// # Errors
    /// [`Error`] for controllers of another number, sampling interval, feed-forward, preview or other limits, for a kp
    /// that is not from 0 to 1 and a ki that is not 0.
    pub fn with_tracking(mut self, tracking: Tracking) -> Result<Self, Error> {
        check_length("controllers", tracking.axes(), self.controller.controllers().len())?;
        for (i, (controller, limits)) in self.controller.controllers().iter().zip(tracking.limits()).enumerate() {
            let (options, ahead) = (controller.options(), controller.preview().map_or(0, Preview::ahead));
            let index = Some(i);
            if (options.dt / tracking.dt() - 1.0).abs() > 1e-9 {
                let expected = "controllers with the sampling interval of the stage";
                return Err(Error::domain("controllers", index, expected, options.dt));
            }
            if !matches!(controller.feedforward(), FeedForward::Given) {
                return Err(Error::NotGiven { index: i });
            }
            for (value, got) in [(limits.0, options.limits.0), (limits.1, options.limits.1)] {
                if value != got {
                    let expected = Bound::EqualTo { value, what: "the limit that the stage was given" };
                    return Err(Error::Domain { parameter: "controllers", index, expected, got });
                }
            }
            if ahead != tracking.ahead() {
                let expected = "previews that look as far ahead as the stage";
                return Err(Error::whole("controllers", index, expected, ahead));
            }
            check_gains(index, options.kp, options.ki)?;
        }
        self.discard_plan();
        self.tracking = Some(tracking);
        self.hold();
        Ok(self)
    }

    /// The feed-forward and the observer of the stage, if there is one.
    #[must_use]
    pub fn tracking(&self) -> Option<&Tracking> {
        self.tracking.as_ref()
    }

    /// The single controllers and their decoupling.
    #[must_use]
    pub fn controller(&self) -> &MultiAxisController {
        &self.controller
    }

    /// The same, for changes of filters, model and mode. Gains go to [`set_gains`](Self::set_gains), what the
    /// amplifiers get otherwise to [`follow`](Self::follow), [`start_at`](Self::start_at) and [`reset`](Self::reset) of
    /// the whole instead. Where a stage leads, the volts come from it, whatever the feed-forward of a controller is.
    pub fn controller_mut(&mut self) -> &mut MultiAxisController {
        &mut self.controller
    }

    /// Changes the gains of one actuator without a jump; see [`HybridController::set_gains`].
    ///
    /// # Errors
    /// As there, [`Error::Whole`] that names `axis` unless there is such an actuator, and where a stage leads
    /// [`Error::Domain`] for a kp that is not from 0 to 1 or a ki that is not 0; all is as before then.
    pub fn set_gains(&mut self, axis: usize, kp: f64, ki: f64) -> Result<(), Error> {
        if self.tracking.is_some() {
            check_gains(None, kp, ki)?;
        }
        self.controller.controller_mut(axis)?.set_gains(kp, ki)
    }

    /// Takes one sample of all axes and writes the drives of all actuators.
    ///
    /// # Errors
    /// As [`MultiAxisController::step`]; nothing is taken then.
    #[inline]
    pub fn step(&mut self, command: AxesCommand<'_>, measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        let Some(sample) = self.sample(&command, measurements, drives)? else {
            return self.controller.step(command, measurements, drives);
        };
        self.planned = None;
        self.controller.step(led(command, &sample, drives.len()), measurements, drives)?;
        self.take(&sample);
        Ok(())
    }

    /// Takes a block of samples, row by row: bit for bit the drives of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// As [`MultiAxisController::run`]; nothing is taken then.
    pub fn run(&mut self, references: &[f64], measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        if self.tracking.is_none() {
            return self.controller.run(references, measurements, drives);
        }
        let (width, got) = (self.controller.controllers().len().max(1), references.len());
        if !got.is_multiple_of(width) {
            return Err(Error::Rows { parameter: "references", width, got });
        }
        check_length("measurements", got, measurements.len())?;
        check_length("drives", got, drives.len())?;
        let rows = references.chunks_exact(width).zip(measurements.chunks_exact(width));
        for ((references, measurements), drives) in rows.zip(drives.chunks_exact_mut(width)) {
            self.step(references.into(), measurements, drives)?;
        }
        Ok(())
    }

    /// The drives that [`step`](Self::step) would write, without taking the sample.
    ///
    /// # Errors
    /// As there.
    pub fn peek(&self, command: AxesCommand<'_>, measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        let Some(sample) = self.sample(&command, measurements, drives)? else {
            return self.controller.peek(command, measurements, drives);
        };
        self.controller.peek(led(command, &sample, drives.len()), measurements, drives)
    }

    /// The drives for a sample, which only [`commit`](Self::commit) takes.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn plan(&mut self, command: AxesCommand<'_>, measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        let Some(sample) = self.sample(&command, measurements, drives)? else {
            return self.controller.plan(command, measurements, drives);
        };
        self.controller.plan(led(command, &sample, drives.len()), measurements, drives)?;
        self.planned = Some(sample);
        Ok(())
    }

    /// Takes the sample that was planned; false, and nothing moves on, if there is none or a controller was changed
    /// since.
    pub fn commit(&mut self) -> bool {
        let (planned, committed) = (self.planned.take(), self.controller.commit());
        if let (Some(sample), true) = (planned, committed) {
            self.take(&sample);
        }
        committed
    }

    /// Forgets a plan.
    pub fn discard_plan(&mut self) {
        self.planned = None;
        self.controller.discard_plan();
    }

    /// What becomes of a sample where a stage leads.
    #[inline]
    fn sample(&self, command: &AxesCommand<'_>, measured: &[f64], drives: &[f64]) -> Result<Option<Sample>, Error> {
        let Some(tracking) = &self.tracking else { return Ok(None) };
        self.controller.check(command, measured, drives)?;
        let mut wanted = Numbers::default();
        let targets = command.targets.unwrap_or(command.references);
        let corrections = command.corrections.unwrap_or(&[]).iter().chain(core::iter::repeat(&0.0));
        for ((wanted, target), correction) in wanted.iter_mut().zip(targets).zip(corrections) {
            *wanted = target + correction;
        }
        let mut believed = true;
        let mut estimates = Numbers::default();
        let now = self.controller.now(command.references, measured);
        for ((estimate, controller), (reference, measured)) in
            estimates.iter_mut().zip(self.controller.controllers()).zip(now)
        {
            *estimate = reference;
            believed &= controller.believes(measured);
        }
        let mut asked = tracking.ask(&wanted, measured, believed);
        estimates.iter_mut().zip(&asked.disturbance).for_each(|(estimate, disturbance)| *estimate += disturbance);
        if !command.references.iter().chain(command.feedforward.unwrap_or(&[])).all(|one| is_admissible(*one)) {
            asked.volts = [f64::NAN; _];
        }
        Ok(Some(Sample { asked, estimates }))
    }

    /// Feed-forward and observer after a sample that the controllers have taken.
    #[inline]
    fn take(&mut self, sample: &Sample) {
        let Self { controller, tracking: Some(tracking), .. } = self else { return };
        let asked = &sample.asked;
        let admissible = asked.is_admissible();
        let (mut own, mut out, mut goes_on) = (Numbers::default(), Numbers::default(), false);
        let numbers = own.iter_mut().zip(&mut out).zip(&asked.volts).zip(tracking.last_drives());
        for ((((own, out), volts), last), controller) in numbers.zip(controller.controllers()) {
            let mode = controller.mode();
            goes_on |= admissible && matches!(mode, Mode::Run | Mode::Feedforward);
            *out = controller.drive();
            // The model remembers what was asked for; drives that a stop takes away go out as they are.
            *own = match mode {
                Mode::Stop => *out,
                Mode::Run | Mode::Feedforward if admissible && controller.is_under_way() => *volts,
                _ => last,
            };
        }
        tracking.take(asked, goes_on, (&own, &out));
    }

    /// Back to the start, at the present drives or others that the amplifiers have now. For what leads the stage it is
    /// as if they had come from rest one sample ago: [`follow`](Self::follow) tells it more.
    ///
    /// # Errors
    /// As [`MultiAxisController::reset_at`]; nothing changes then.
    pub fn reset(&mut self, drives: Option<&[f64]>) -> Result<(), Error> {
        match drives {
            Some(drives) => self.controller.reset_at(drives)?,
            None => self.controller.reset(),
        }
        self.planned = None;
        if let Some(tracking) = &mut self.tracking {
            tracking.reset();
        }
        self.hold();
        Ok(())
    }

    /// Takes over what was driven before, rows of drives, oldest first: model and controllers. Allocates.
    ///
    /// # Errors
    /// As [`MultiAxisController::follow`]; nothing changes then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        self.controller.follow(drives)?;
        self.planned = None;
        if let Some(tracking) = &mut self.tracking {
            tracking.follow(drives);
        }
        Ok(())
    }

    /// Goes on from other drives that the amplifiers have, with everything that is remembered. For what leads the stage
    /// they go out for one sample more: in a new controller, as if they had come from rest one sample ago.
    /// [`follow`](Self::follow) tells it more.
    ///
    /// # Errors
    /// As [`MultiAxisController::start_at`]; nothing changes then.
    pub fn start_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        self.controller.start_at(drives)?;
        self.planned = None;
        self.hold();
        Ok(())
    }

    /// What leads the stage takes the present drives for those that go out until the next measurement.
    fn hold(&mut self) {
        let Some(tracking) = &mut self.tracking else { return };
        let mut drives = Numbers::default();
        let controllers = self.controller.controllers();
        drives.iter_mut().zip(controllers).for_each(|(drive, controller)| *drive = controller.drive());
        tracking.hold(drives.get(..controllers.len()).unwrap_or(&drives));
    }

    /// Everything that is remembered. Allocates.
    #[must_use]
    pub fn state(&self) -> MultiAxisStageState {
        let hysteresis_core::MultiAxisControllerState { decoupling, controllers } = self.controller.state();
        MultiAxisStageState { decoupling, controllers, tracking: self.tracking.as_ref().map(Tracking::state) }
    }

    /// Goes on from a state of the same set-up, bit for bit. The amplifiers must be at its drives.
    ///
    /// # Errors
    /// [`Error`] as [`MultiAxisController::set_state`], and for a state with, or without, what this one has; nothing
    /// changes then.
    pub fn set_state(&mut self, state: &MultiAxisStageState) -> Result<(), Error> {
        let mut tracking = self.tracking.clone();
        match (&mut tracking, &state.tracking) {
            (None, None) => {}
            (Some(tracking), Some(saved)) => tracking.set_state(saved)?,
            _ => return Err(Error::State { expected: "what leads a stage if, and only if, the controller does" }),
        }
        let MultiAxisStageState { decoupling, controllers, .. } = state.clone();
        self.controller.set_state(&hysteresis_core::MultiAxisControllerState { decoupling, controllers })?;
        (self.tracking, self.planned) = (tracking, None);
        Ok(())
    }
}

/// Checks the gains of a controller that a stage leads: more than the disturbance would be fed back beyond the peak of
/// the sensitivity, and an integral of it has no end.
fn check_gains(index: Option<usize>, kp: f64, ki: f64) -> Result<(), Error> {
    if !(0.0..=1.0).contains(&kp) {
        return Err(Error::domain("kp", index, "0 to 1 where a stage leads: a share of the disturbance", kp));
    }
    if ki != 0.0 {
        return Err(Error::domain("ki", index, "0 where a stage leads: what lasts is in the disturbance", ki));
    }
    Ok(())
}

/// What the controllers are asked for where a stage leads. Given volts do not make up for what is not admissible.
#[inline]
fn led<'a>(command: AxesCommand<'a>, Sample { asked, estimates }: &'a Sample, axes: usize) -> AxesCommand<'a> {
    AxesCommand {
        references: command.references,
        targets: None,
        corrections: None,
        estimates: estimates.get(..axes),
        feedforward: command.feedforward.filter(|_| asked.is_admissible()).or(asked.volts.get(..axes)),
    }
}
