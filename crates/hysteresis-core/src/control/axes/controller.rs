use alloc::boxed::Box;
use alloc::vec::Vec;

use super::matrix::{AxisMatrix, product};
use crate::control::{Command, HybridController};
use crate::error::{Bound, Error, check_length};

/// Several axes that move each other, as those of an XY stage or a tip-tilt mirror: a [`HybridController`] for each actuator,
/// behind a static decoupling.
///
/// ```text
/// y = K p          actuators that are at p move the axes to y: the coupling of the plant
/// r' = D r         what the actuators are to reach, of the references r of the axes
/// y' = D y         where they are, of the measurements y
/// u_i = C_i(r'_i, y'_i)
/// ```
///
/// With D = K^-1 every actuator has a loop of its own, with the model of its own hysteresis. Limits, slew and what is counted
/// are those of the single controllers. Products are summed from the first axis on and leave out zero entries of D: with the
/// identity, the drives are bit for bit those of the single controllers.
///
/// A measurement that is not finite (or beyond 1e100) is a missing one for all actuators that depend on it, by an entry of D
/// that is not zero; such a reference is a bad one for them. The others go on.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan), [`commit`](Self::commit) and [`run`](Self::run) do not
/// allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, MultiAxisController};
/// use hysteresis_core::{Offsets, Process, Ratios};
/// let model = |w0| ModifiedPrandtlIshlinskii::from_ratios(&[w0, 1.7e-3], &[0.0, 150.0], Ratios::PAPER, Offsets::default());
/// let limits = (-500.0, 500.0); // V
/// let options = ControllerOptions::new(5.0, 6e3, 1e-4, limits);
/// let models = [model(4.3e-3)?, model(3.9e-3)?]; // um/V
/// let controllers: Result<_, _> = models
///     .iter()
///     .map(|model| HybridController::new(model.inverse(Some(limits))?.into(), None, &options))
///     .collect();
/// // The axes are y = K p with K = [1, 0.25; 0.5, 1].
/// let inverse = [8.0 / 7.0, -2.0 / 7.0, -4.0 / 7.0, 8.0 / 7.0];
/// let mut axes = MultiAxisController::new(controllers?, Some(&inverse))?;
/// let mut actuators = models.map(|model| model.forward());
/// let (mut drives, mut y) = ([0.0; 2], [0.0; 2]);
/// for k in 0..2000 {
///     let references = [1.5 * (0.01 * f64::from(k)).sin(), 0.0]; // um
///     axes.step((&references).into(), &y, &mut drives)?;
///     let p = [actuators[0].step(drives[0]), actuators[1].step(drives[1])];
///     y = [p[0] + 0.25 * p[1], 0.5 * p[0] + p[1]];
/// }
/// assert!(y[1].abs() < 1e-3, "x does not disturb y");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct MultiAxisController {
    pub(super) controllers: Box<[HybridController]>,
    pub(super) decoupling: AxisMatrix,
}

/// What is asked of one sample of all axes: as [`Command`], each with a number for every axis.
///
/// References alone are a command too: `(&[1.5, 0.0]).into()`.
///
/// ```
/// use hysteresis_core::AxesCommand;
/// let references = [1.5, 0.0];
/// let plain = AxesCommand { references: &[1.5, 0.0], targets: None, corrections: None, feedforward: None };
/// assert_eq!(AxesCommand::from(&references), plain);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxesCommand<'a> {
    /// The positions of the axes that are wanted.
    pub references: &'a [f64],
    /// Where the feed-forward is to bring the axes, if not to the references (or what previews make of them).
    pub targets: Option<&'a [f64]>,
    /// What learning adds to the targets of the axes.
    pub corrections: Option<&'a [f64]>,
    /// Volts of each actuator that replace the output of its feed-forward.
    pub feedforward: Option<&'a [f64]>,
}

impl<'a> From<&'a [f64]> for AxesCommand<'a> {
    #[inline]
    fn from(references: &'a [f64]) -> Self {
        Self { references, targets: None, corrections: None, feedforward: None }
    }
}

impl<'a, const N: usize> From<&'a [f64; N]> for AxesCommand<'a> {
    #[inline]
    fn from(references: &'a [f64; N]) -> Self {
        references.as_slice().into()
    }
}

impl AxesCommand<'_> {
    /// What is asked of actuator i, whose row of the decoupling this is.
    #[inline]
    fn of(&self, i: usize, row: &[f64]) -> Command {
        Command {
            reference: product(row, self.references),
            target: self.targets.map(|targets| product(row, targets)),
            correction: self.corrections.map_or(0.0, |corrections| product(row, corrections)),
            estimate: None,
            feedforward: self.feedforward.and_then(|volts| volts.get(i)).copied(),
        }
    }
}

impl MultiAxisController {
    /// A controller for each actuator, and the decoupling row by row; none is the identity.
    ///
    /// # Errors
    /// [`Error::Empty`] without a controller; [`Error::Domain`] or [`Error::Whole`] for controllers of other sampling intervals or lengths of
    /// their previews than the first one; as [`AxisMatrix::new`] for the decoupling.
    pub fn new(controllers: Vec<HybridController>, decoupling: Option<&[f64]>) -> Result<Self, Error> {
        let parameter = "controllers";
        let Some(first) = controllers.first() else { return Err(Error::Empty { parameter }) };
        let (dt, window) = (first.options().dt, window(first));
        for (index, controller) in controllers.iter().enumerate() {
            let (length, ahead) = self::window(controller);
            let got = controller.options().dt;
            // Rounding apart: 1 / 10 kHz is one number, 0.1 ms may be another.
            if (got / dt - 1.0).abs() > 1e-9 {
                let expected = Bound::EqualTo { value: dt, what: "the sampling interval of the first one in seconds" };
                return Err(Error::Domain { parameter, index: Some(index), expected, got });
            }
            for (count, what, got) in [
                (window.0, "the length of the preview of the first one", length),
                (window.1, "the samples ahead of the preview of the first one", ahead),
            ] {
                if got != count {
                    let (expected, got) = (Bound::Exactly { count, what }, got as u64);
                    return Err(Error::Whole { parameter, index: Some(index), expected, got });
                }
            }
        }
        let decoupling = match decoupling {
            Some(entries) => AxisMatrix::new("decoupling", controllers.len(), entries)?,
            None => AxisMatrix::identity(controllers.len()),
        };
        Ok(Self { controllers: controllers.into(), decoupling })
    }

    /// Takes one sample of all axes and writes the drives of all actuators.
    ///
    /// # Errors
    /// [`Error::Length`] unless everything has an element for each axis; nothing is taken then.
    #[inline]
    pub fn step(&mut self, command: AxesCommand<'_>, measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        self.check(&command, measurements, drives)?;
        self.each(&command, measurements, drives, HybridController::step);
        Ok(())
    }

    /// Takes a block of samples, row by row (sample k of axis i at k N + i): bit for bit the drives of repeated
    /// [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Rows`] unless the references are whole rows, [`Error::Length`] unless all three slices have the same
    /// length; nothing is taken then.
    pub fn run(&mut self, references: &[f64], measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        let (width, got) = (self.controllers.len().max(1), references.len());
        if !got.is_multiple_of(width) {
            return Err(Error::Rows { parameter: "references", width, got });
        }
        check_length("measurements", got, measurements.len())?;
        check_length("drives", got, drives.len())?;
        let rows = references.chunks_exact(width).zip(measurements.chunks_exact(width));
        for ((references, measurements), drives) in rows.zip(drives.chunks_exact_mut(width)) {
            self.each(&references.into(), measurements, drives, HybridController::step);
        }
        Ok(())
    }

    /// The drives that [`step`](Self::step) would write, without taking the sample.
    ///
    /// # Errors
    /// As there.
    pub fn peek(&self, command: AxesCommand<'_>, measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        self.check(&command, measurements, drives)?;
        for (i, ((controller, row), drive)) in
            self.controllers.iter().zip(self.decoupling.rows()).zip(drives).enumerate()
        {
            *drive = controller.peek(command.of(i, row), product(row, measurements));
        }
        Ok(())
    }

    /// The drives for a sample, which only [`commit`](Self::commit) takes: as [`HybridController::plan`], for all axes.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn plan(&mut self, command: AxesCommand<'_>, measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        self.check(&command, measurements, drives)?;
        self.each(&command, measurements, drives, HybridController::plan);
        Ok(())
    }

    /// Takes the sample that was planned, on all axes. False, and no axis moves on, if one has no plan: without a plan, or
    /// after a change of its controller.
    pub fn commit(&mut self) -> bool {
        if self.controllers.iter().any(|controller| controller.planned.is_none()) {
            self.controllers.iter_mut().for_each(|controller| controller.planned = None);
            return false;
        }
        self.controllers.iter_mut().for_each(|controller| _ = controller.commit());
        true
    }

    #[inline]
    fn each(
        &mut self,
        command: &AxesCommand<'_>,
        measurements: &[f64],
        drives: &mut [f64],
        mut act: impl FnMut(&mut HybridController, Command, f64) -> f64,
    ) {
        let actuators = self.controllers.iter_mut().zip(self.decoupling.rows());
        for (i, ((controller, row), drive)) in actuators.zip(drives).enumerate() {
            *drive = act(controller, command.of(i, row), product(row, measurements));
        }
    }

    fn check(&self, command: &AxesCommand<'_>, measurements: &[f64], drives: &[f64]) -> Result<(), Error> {
        let axes = self.controllers.len();
        check_length("references", axes, command.references.len())?;
        check_length("measurements", axes, measurements.len())?;
        check_length("targets", axes, command.targets.map_or(axes, <[f64]>::len))?;
        check_length("corrections", axes, command.corrections.map_or(axes, <[f64]>::len))?;
        check_length("feedforward", axes, command.feedforward.map_or(axes, <[f64]>::len))?;
        check_length("drives", axes, drives.len())
    }

    /// The controller of every actuator.
    #[must_use]
    pub fn controllers(&self) -> &[HybridController] {
        &self.controllers
    }

    /// The controller of every actuator, to change one alone: its gains, its model, its filters.
    pub fn controllers_mut(&mut self) -> &mut [HybridController] {
        &mut self.controllers
    }

    /// The decoupling D.
    #[must_use]
    pub fn decoupling(&self) -> &AxisMatrix {
        &self.decoupling
    }
}

/// The length of the preview of a controller, and how many samples it looks ahead; zeros without one.
fn window(controller: &HybridController) -> (usize, usize) {
    controller.preview().map_or((0, 0), |preview| (preview.coefficients().len(), preview.ahead()))
}
