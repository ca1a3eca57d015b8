//! A controller, a plant and a reference: any controller, or that of a stage with what may surround it.

use core::convert::Infallible;

use hysteresis_control::StageController;
use hysteresis_core::{Command, Error, HybridController};

use crate::driven::Driven;
use crate::metrics::{LoopRecord, Run, check_reference};
use crate::plant::Plant;

/// Samples between two calls of the watch of a [`TrackingTask`].
pub const WATCH_INTERVAL: usize = 4096;

/// Lets a plant follow a reference: `controller(k, measured)` gives the drive for sample k, of which the reference is
/// `reference[k]`.
///
/// The plant starts from the state in which it is. A drive that is not finite is held back by it and counted.
///
/// ```
/// use hysteresis_core::{Process};
/// use hysteresis_simulate::paper;
/// use hysteresis_simulate::closed_loop::simulate;
/// use hysteresis_simulate::paper::Benchmark;
/// use hysteresis_simulate::signals::{Wave, sine};
/// let wave = Wave { amplitude: 3.3, frequency: 20.0, rate: 1e4, offset: 0.0 };
/// let reference = sine(wave, 0.15)?;
/// let (mut plant, gains) = (Benchmark::A1.plant(0), Benchmark::A1.gains());
/// let (mut feed_forward, mut sum) = (paper::table_2().forward(), 0.0);
/// let run = simulate(&mut plant, &reference, |k, measured| {
///     let error = reference[k] - measured;
///     sum += 1e-4 * error; // um s
///     feed_forward.step(reference[k]) + gains.kp * error + gains.ki * sum
/// })?;
/// let published = 0.293; // um
/// assert!((run.metrics().max_error / published - 1.0).abs() < 0.1);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error`] for a reference that is empty or not finite; nothing has moved then.
pub fn simulate(
    plant: &mut Plant,
    reference: &[f64],
    mut controller: impl FnMut(usize, f64) -> f64,
) -> Result<Run, Error> {
    let Ok(run) = TrackingTask::new(reference, None)?.run(
        plant,
        |k, measured| Ok::<_, Infallible>(controller(k, measured)),
        |_| Ok(()),
    );
    Ok(run)
}

/// A reference that was checked, ready to be followed.
#[derive(Clone, Copy, Debug)]
pub struct TrackingTask<'a> {
    reference: &'a [f64],
    period: Option<f64>,
}

impl<'a> TrackingTask<'a> {
    /// To follow a reference, of which the period in samples may be known.
    ///
    /// # Errors
    /// [`Error`] for a reference that is empty or not finite, or a period that is not shorter than it or not above 0.
    pub fn new(reference: &'a [f64], period: Option<f64>) -> Result<Self, Error> {
        check_reference(reference, period)?;
        Ok(Self { reference, period })
    }

    /// What is to be followed.
    #[must_use]
    pub fn reference(&self) -> &'a [f64] {
        self.reference
    }

    /// [`simulate`] for long runs, other plants and controllers that may fail: `watch(k)` is called before every 4096th
    /// sample, to show progress or to stop.
    ///
    /// # Errors
    /// Those of the controller, of the plant and of the watch, which end the run; the plant stays where it is then.
    pub fn run<E, P: Driven<E>>(
        &self,
        plant: &mut P,
        mut controller: impl FnMut(usize, f64) -> Result<f64, E>,
        watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Run, E> {
        let act = |plant: &mut P, k: usize, measured: f64| {
            let drive = controller(k, measured)?;
            plant.write(Some(k), drive)?;
            plant.put_out(Some(k), drive)
        };
        self.run_with(plant, act, watch)
    }

    /// The loop: `act(plant, k, measured)` writes the drive of sample k and returns what is really put out.
    fn run_with<E, P: Driven<E>>(
        &self,
        plant: &mut P,
        mut act: impl FnMut(&mut P, usize, f64) -> Result<f64, E>,
        mut watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Run, E> {
        let samples = self.reference.len();
        let [mut measured, mut position, mut drive] = [0; 3].map(|_| Vec::with_capacity(samples));
        for k in 0..samples {
            if k % WATCH_INTERVAL == 0 {
                watch(k)?;
            }
            let reading = plant.read(Some(k))?;
            measured.push(reading.measured);
            position.push(reading.position);
            drive.push(act(plant, k, reading.measured)?);
        }
        let record = LoopRecord { reference: self.reference.to_vec(), measured, position, drive };
        Ok(Run::of_loop(record, plant.limits(), self.period))
    }
}

/// A controller, and targets of its feed-forward that are known beforehand.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController};
/// use hysteresis_simulate::paper;
/// use hysteresis_simulate::closed_loop::TrackingTask;
/// use hysteresis_simulate::paper::Benchmark;
/// use hysteresis_simulate::signals::{Wave, sine};
/// use hysteresis_simulate::closed_loop::Tracking;
/// let reference = sine(Wave { amplitude: 3.3, frequency: 20.0, rate: 1e4, offset: 0.0 }, 0.15)?;
/// let gains = Benchmark::A1.gains();
/// let options = ControllerOptions::new(gains.kp, gains.ki, 1e-4, (-560.0, 560.0));
/// let mut controller = HybridController::new(paper::table_2().forward().into(), None, &options)?.into();
/// let task = TrackingTask::new(&reference, Some(500.0))?;
/// let run = Tracking::of(&mut controller).run(&task, &mut Benchmark::A1.plant(0), |_| Ok::<_, core::fmt::Error>(()))?;
/// assert!((run.metrics().max_error / 0.293 - 1.0).abs() < 0.1); // as published
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Tracking<'a> {
    /// What gives the drive of every sample, with an observer and learning of its own if it has them.
    pub controller: &'a mut StageController,
    /// The target of the feed-forward at every sample; without any it is the reference, or what the preview makes of
    /// it.
    pub targets: Option<&'a [f64]>,
    /// What is added to the target at every sample.
    pub corrections: Option<&'a [f64]>,
}

impl<'a> Tracking<'a> {
    /// The controller alone.
    pub fn of(controller: &'a mut StageController) -> Self {
        Self { controller, targets: None, corrections: None }
    }

    /// Lets the plant follow the reference of the task; see [`TrackingTask::run`] for `watch`.
    ///
    /// With a preview, references enter early: before the run, the plant stands at the first reference until the window
    /// of the preview is full and reaches as far ahead. A sample counts as saturated at the limits of the controller or
    /// of the plant, whichever are tighter.
    ///
    /// Where a write of the plant fails, the controller is as before that sample.
    ///
    /// # Errors
    /// Those of the plant and the watch, which end the run; controller and plant stay where they are then.
    pub fn run<E, P: Driven<E>>(
        self,
        task: &TrackingTask<'_>,
        plant: &mut P,
        watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Run, E> {
        self.run_with(task, plant, |_, _, _| Ok(()), watch)
    }

    /// As [`run`](Self::run); `adapt(controller, drive, measurement)` is called after every step of the controller,
    /// those before the run included, with a row of a record: the drive that is put out and the position read at that
    /// moment.
    ///
    /// # Errors
    /// Those of the plant, of `adapt` and of the watch, which end the run; controller and plant stay where they are
    /// then.
    pub fn run_with<E, P: Driven<E>>(
        self,
        task: &TrackingTask<'_>,
        plant: &mut P,
        mut adapt: impl FnMut(&mut HybridController, f64, f64) -> Result<(), E>,
        watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Run, E> {
        let (filling, ahead) = lead_in(self.controller.controller());
        let own = self.controller.controller().options().limits;
        let reference = task.reference();
        // Past its end the reference stands still.
        let coming = |k: usize| reference[k.min(reference.len() - 1)];
        // What is learned begins with the reference.
        self.controller.set_learning_waits(true);
        let led_in = (0..filling + ahead).try_for_each(|k| {
            let measured = plant.read(None)?.measured;
            act(self.controller, plant, None, (coming(k.saturating_sub(filling)).into(), measured))?;
            adapt_to(&mut adapt, self.controller, measured)
        });
        self.controller.set_learning_waits(false);
        led_in?;
        let step = |plant: &mut P, k: usize, measured: f64| {
            let target = self.targets.map(|targets| targets[k]);
            let correction = self.corrections.map_or(0.0, |corrections| corrections[k]);
            let command = Command { target, correction, ..coming(k + ahead).into() };
            let put_out = act(self.controller, plant, Some(k), (command, measured))?;
            adapt_to(&mut adapt, self.controller, measured)?;
            Ok(put_out)
        };
        Ok(task.run_with(plant, step, watch)?.within(own))
    }
}

fn adapt_to<E>(
    adapt: &mut impl FnMut(&mut HybridController, f64, f64) -> Result<(), E>,
    controller: &mut StageController,
    measured: f64,
) -> Result<(), E> {
    let drive = controller.controller().drive();
    adapt(controller.controller_mut(), drive, measured)
}

/// How many samples the window of a preview takes to fill, and how far it looks ahead.
pub(crate) fn lead_in(controller: &HybridController) -> (usize, usize) {
    controller.preview().map_or((0, 0), |preview| (preview.coefficients().len() - 1, preview.ahead()))
}

/// Writes the drive for a sample, and returns what is really put out. A controller moves on only if the write succeeds.
fn act<E, P: Driven<E>>(
    controller: &mut StageController,
    plant: &mut P,
    sample: Option<usize>,
    (command, measured): (Command, f64),
) -> Result<f64, E> {
    let drive = if P::WRITE_MAY_FAIL { controller.plan(command, measured) } else { controller.step(command, measured) };
    plant.write(sample, drive)?;
    if P::WRITE_MAY_FAIL {
        controller.commit();
    }
    plant.put_out(sample, drive)
}
