//! What a loop drives: a plant of ours, or anything else that can be read and written to.

use crate::plant::{MultiAxisPlant, Plant};

/// What is known at the moment of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// What the controller sees. A number that is not finite (or beyond 1e100) is a missing measurement.
    pub measured: f64,
    /// Where the position really is; the measurement where nothing else is known.
    pub position: f64,
}

/// What a loop drives.
///
/// At every sample the loop reads, and then writes the drive that is held until the next sample. The number of the
/// sample is for messages. It is None for samples before the run, while the window of a preview fills.
///
/// ```
/// use hysteresis_simulate::closed_loop::TrackingTask;
/// use hysteresis_simulate::driven::{Driven, Reading};
/// struct Lag(f64); // um
/// impl Driven<&'static str> for Lag {
///     const WRITE_MAY_FAIL: bool = true;
///     fn read(&mut self, _: Option<usize>) -> Result<Reading, &'static str> {
///         Ok(Reading { measured: self.0, position: self.0 })
///     }
///     fn write(&mut self, _: Option<usize>, drive: f64) -> Result<(), &'static str> {
///         self.0 += 0.5 * (0.01 * drive - self.0);
///         Ok(())
///     }
///     fn put_out(&mut self, _: Option<usize>, drive: f64) -> Result<f64, &'static str> {
///         Ok(drive)
///     }
///     fn limits(&self) -> Option<(f64, f64)> {
///         None
///     }
/// }
/// let task = TrackingTask::new(&[1.0; 50], None).unwrap();
/// let run = task.run(&mut Lag(0.0), |_, measured| Ok(100.0 * measured + 100.0 * (1.0 - measured)), |_| Ok(()))?;
/// assert!((run.record().position[49] - 1.0).abs() < 1e-12);
/// # Ok::<(), &'static str>(())
/// ```
pub trait Driven<E> {
    /// Whether [`write`](Self::write) may fail. A hybrid controller then plans each sample, and takes it when it was
    /// written.
    const WRITE_MAY_FAIL: bool;

    /// The measurement and the position of now.
    ///
    /// # Errors
    /// Whatever ends the run.
    fn read(&mut self, sample: Option<usize>) -> Result<Reading, E>;

    /// Holds a drive for one sampling interval.
    ///
    /// # Errors
    /// Whatever ends the run. The drive of the sample before is taken for the present one then.
    fn write(&mut self, sample: Option<usize>, drive: f64) -> Result<(), E>;

    /// The drive that is really put out, after this one was written.
    ///
    /// # Errors
    /// Whatever ends the run. The controller has taken the sample by then.
    fn put_out(&mut self, sample: Option<usize>, drive: f64) -> Result<f64, E>;

    /// The limits of the drive (low, high), as far as known.
    fn limits(&self) -> Option<(f64, f64)>;
}

impl<E> Driven<E> for Plant {
    const WRITE_MAY_FAIL: bool = false;

    #[inline]
    fn read(&mut self, _: Option<usize>) -> Result<Reading, E> {
        Ok(Reading { measured: self.measured(), position: self.position() })
    }

    #[inline]
    fn write(&mut self, _: Option<usize>, drive: f64) -> Result<(), E> {
        self.step(drive);
        Ok(())
    }

    #[inline]
    fn put_out(&mut self, _: Option<usize>, _: f64) -> Result<f64, E> {
        Ok(self.drive())
    }

    fn limits(&self) -> Option<(f64, f64)> {
        Plant::limits(self)
    }
}

/// What a loop drives along several axes: as [`Driven`], with a number for each axis.
pub trait DrivenAxes<E> {
    /// Whether [`write`](Self::write) may fail.
    const WRITE_MAY_FAIL: bool;

    /// Writes the measurements and the positions of now.
    ///
    /// # Errors
    /// Whatever ends the run.
    fn read(&mut self, sample: Option<usize>, measured: &mut [f64], position: &mut [f64]) -> Result<(), E>;

    /// Holds the drives for one sampling interval.
    ///
    /// # Errors
    /// Whatever ends the run.
    fn write(&mut self, sample: Option<usize>, drives: &[f64]) -> Result<(), E>;

    /// Writes the drives that are really put out, after these were written.
    ///
    /// # Errors
    /// Whatever ends the run. The controllers have taken the sample by then.
    fn put_out(&mut self, sample: Option<usize>, drives: &[f64], put_out: &mut [f64]) -> Result<(), E>;

    /// The limits of the drive of an actuator (low, high), as far as known.
    fn limits(&self, actuator: usize) -> Option<(f64, f64)>;
}

/// The loop has checked that there are as many axes.
impl<E> DrivenAxes<E> for MultiAxisPlant {
    const WRITE_MAY_FAIL: bool = false;

    fn read(&mut self, _: Option<usize>, measured: &mut [f64], position: &mut [f64]) -> Result<(), E> {
        measured.copy_from_slice(self.measured());
        position.copy_from_slice(self.position());
        Ok(())
    }

    fn write(&mut self, _: Option<usize>, drives: &[f64]) -> Result<(), E> {
        self.step(drives).expect("a drive for each axis");
        Ok(())
    }

    fn put_out(&mut self, _: Option<usize>, _: &[f64], put_out: &mut [f64]) -> Result<(), E> {
        put_out.iter_mut().zip(self.plants()).for_each(|(put_out, plant)| *put_out = plant.drive());
        Ok(())
    }

    fn limits(&self, actuator: usize) -> Option<(f64, f64)> {
        self.plants().get(actuator).and_then(Plant::limits)
    }
}
