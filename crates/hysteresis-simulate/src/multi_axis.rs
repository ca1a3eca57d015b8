//! Controllers and plants of several axes, and a reference for each.

use hysteresis_control::multi_axis::MultiAxisStageController;
use hysteresis_core::{AxesCommand, Error, HybridController, check_length};

use crate::closed_loop::{WATCH_INTERVAL, lead_in};
use crate::driven::DrivenAxes;
use crate::metrics::{LoopRecord, Run, check_reference};

/// References of several axes that were checked, ready to be followed.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController, MultiAxisController};
/// use hysteresis_simulate::multi_axis::MultiAxisTask;
/// use hysteresis_simulate::paper::{Benchmark, table_2};
/// use hysteresis_simulate::plant::MultiAxisPlant;
/// let gains = Benchmark::A1.gains();
/// let options = ControllerOptions::new(gains.kp, gains.ki, 1e-4, (-560.0, 560.0));
/// let controller = HybridController::new(table_2().forward().into(), None, &options)?;
/// let mut axes = MultiAxisController::new(vec![controller; 2], None)?.into();
/// let mut plant = MultiAxisPlant::new(vec![Benchmark::A1.plant(0), Benchmark::A1.plant(1)], &[1.0, 0.0, 0.0, 1.0])?;
/// let reference: Vec<f64> = (0..500).flat_map(|k| [2e-3 * f64::from(k), 0.0]).collect(); // um
/// let task = MultiAxisTask::new(&reference, 2, None)?;
/// let runs = task.track(&mut plant, &mut axes, None, |_| Ok::<_, core::fmt::Error>(()))?;
/// assert!(runs[1].metrics().max_position_error < 0.1);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct MultiAxisTask<'a> {
    reference: &'a [f64],
    axes: usize,
    period: Option<f64>,
}

impl<'a> MultiAxisTask<'a> {
    /// To follow rows of references (sample k of axis i at k N + i), of which the period in samples may be known.
    ///
    /// # Errors
    /// [`Error`] for references that are no whole rows, empty or not finite, or a period that is not shorter than they
    /// are or not above 0.
    pub fn new(reference: &'a [f64], axes: usize, period: Option<f64>) -> Result<Self, Error> {
        let (width, got) = (axes.max(1), reference.len());
        if !got.is_multiple_of(width) {
            return Err(Error::Rows { parameter: "reference", width, got });
        }
        check_reference(reference, None)?;
        // The period counts rows.
        check_reference(&reference[..got / width], period)?;
        Ok(Self { reference, axes: width, period })
    }

    /// The row of a sample; past its end the reference stands still.
    #[must_use]
    pub fn row(&self, k: usize) -> &'a [f64] {
        row_of(self.reference, self.axes, k)
    }

    /// The loop with any controller: `controller(k, measured, drives)` writes the drives of sample k, of which the
    /// references are row k. See [`TrackingTask::run`](crate::closed_loop::TrackingTask::run). Gives a run for each
    /// axis: reference, measurement and position of the axis, drive and limits of the actuator of the same number.
    ///
    /// # Errors
    /// Those of the controller, of the plant and of the watch, which end the run; the plant stays where it is then.
    pub fn run<E, P: DrivenAxes<E>>(
        &self,
        plant: &mut P,
        mut controller: impl FnMut(usize, &[f64], &mut [f64]) -> Result<(), E>,
        watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Vec<Run>, E> {
        let mut drives = vec![0.0; self.axes];
        let act = |plant: &mut P, k: usize, measured: &[f64], put_out: &mut [f64]| {
            controller(k, measured, &mut drives)?;
            plant.write(Some(k), &drives)?;
            plant.put_out(Some(k), &drives, put_out)
        };
        self.run_with(plant, act, watch)
    }

    /// The loop with hybrid controllers, and the targets of their feed-forward where these are not the references.
    /// Previews get their references early, and a stage that leads its targets too, as in
    /// [`Tracking::run`](crate::closed_loop::Tracking::run). Where a write of the plant fails, no controller has taken
    /// the sample.
    ///
    /// # Errors
    /// Those of the plant and of the watch, which end the run; controllers and plant stay where they are then.
    ///
    /// # Panics
    /// If controllers, plant or targets have not as many axes as the references.
    pub fn track<E, P: DrivenAxes<E>>(
        &self,
        plant: &mut P,
        axes: &mut MultiAxisStageController,
        targets: Option<&[f64]>,
        watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Vec<Run>, E> {
        check_length("controllers", self.axes, axes.controller().controllers().len())
            .expect("a controller for each axis");
        check_length("targets", self.reference.len(), targets.map_or(self.reference.len(), <[f64]>::len))
            .expect("a target for each reference");
        let (filling, ahead) = axes.controller().controllers().first().map_or((0, 0), lead_in);
        let early = axes.tracking().map_or(0, |_| ahead);
        let [mut measured, mut position, mut put_out, mut drives] = [0; 4].map(|_| vec![0.0; self.axes]);
        let target = |k: usize| targets.map(|targets| row_of(targets, self.axes, k));
        for k in 0..filling + ahead {
            plant.read(None, &mut measured, &mut position)?;
            let coming = k.saturating_sub(filling);
            let targets = target(coming).filter(|_| early > 0);
            let command = AxesCommand { targets, ..self.row(coming).into() };
            act(axes, plant, None, (command, &measured[..]), (&mut drives, &mut put_out))?;
        }
        let step = |plant: &mut P, k: usize, measured: &[f64], put_out: &mut [f64]| {
            let command = AxesCommand { targets: target(k + early), ..self.row(k + ahead).into() };
            act(axes, plant, Some(k), (command, measured), (&mut drives, put_out))
        };
        let runs = self.run_with(plant, step, watch)?;
        let within = |(run, controller): (Run, &HybridController)| run.within(controller.options().limits);
        Ok(runs.into_iter().zip(axes.controller().controllers()).map(within).collect())
    }

    fn run_with<E, P: DrivenAxes<E>>(
        &self,
        plant: &mut P,
        mut act: impl FnMut(&mut P, usize, &[f64], &mut [f64]) -> Result<(), E>,
        mut watch: impl FnMut(usize) -> Result<(), E>,
    ) -> Result<Vec<Run>, E> {
        let samples = self.reference.len() / self.axes;
        let empty = || Vec::with_capacity(samples);
        let record = |_| LoopRecord { reference: empty(), measured: empty(), position: empty(), drive: empty() };
        let mut records: Vec<LoopRecord> = (0..self.axes).map(record).collect();
        let [mut measured, mut position, mut put_out] = [0; 3].map(|_| vec![0.0; self.axes]);
        for (k, reference) in self.reference.chunks_exact(self.axes).enumerate() {
            if k % WATCH_INTERVAL == 0 {
                watch(k)?;
            }
            plant.read(Some(k), &mut measured, &mut position)?;
            act(plant, k, &measured, &mut put_out)?;
            for (i, record) in records.iter_mut().enumerate() {
                record.reference.push(reference[i]);
                record.measured.push(measured[i]);
                record.position.push(position[i]);
                record.drive.push(put_out[i]);
            }
        }
        let run = |(i, record)| Run::of_loop(record, plant.limits(i), self.period);
        Ok(records.into_iter().enumerate().map(run).collect())
    }
}

/// Row k of rows that stand still past their end.
fn row_of(rows: &[f64], width: usize, k: usize) -> &[f64] {
    let last = rows.len() / width - 1;
    &rows[k.min(last) * width..][..width]
}

/// Writes the drives for a sample. The controllers move on only if the write succeeds.
fn act<E, P: DrivenAxes<E>>(
    axes: &mut MultiAxisStageController,
    plant: &mut P,
    sample: Option<usize>,
    (command, measured): (AxesCommand<'_>, &[f64]),
    (drives, put_out): (&mut [f64], &mut [f64]),
) -> Result<(), E> {
    let decided =
        if P::WRITE_MAY_FAIL { axes.plan(command, measured, drives) } else { axes.step(command, measured, drives) };
    decided.expect("as many of everything as there are axes");
    plant.write(sample, drives)?;
    if P::WRITE_MAY_FAIL {
        axes.commit();
    }
    plant.put_out(sample, drives, put_out)
}
