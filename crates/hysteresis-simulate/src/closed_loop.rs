//! A controller, a plant and a reference.

use core::convert::Infallible;

use hysteresis_core::Error;

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
    pub(crate) fn run_with<E, P: Driven<E>>(
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
