//! Several axes that move each other: a hybrid controller for each actuator, and a matrix between axes and actuators.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::controller::{Command, HybridController};
use super::controller_state::ControllerState;
use super::law::Mode;
use super::options::check_stop;
use crate::error::{
    Bound, Error, check_all_finite, check_each_between, check_length, check_rows, check_rows_between, is_admissible,
    no_such,
};

/// A matrix is refused above this condition number: six of sixteen digits would be left.
const LARGEST_CONDITION: f64 = 1e10;

/// An invertible matrix between axes and actuators: y = M x.
///
/// Row i is `M_i1 x_1 + M_i2 x_2 + ...`, summed from the first column on. Entries that are zero are left out. So with
/// the identity y has the bits of x, and a number that is not finite (or beyond 1e100) makes NaN of those y alone that
/// depend on it.
///
/// ```
/// use hysteresis_core::AxisMatrix;
/// let coupling = AxisMatrix::new("coupling", 2, &[1.0, 0.25, 0.0, 1.0])?;
/// let mut y = [0.0; 2];
/// coupling.apply(&[2.0, 4.0], &mut y)?;
/// assert_eq!(y, [3.0, 4.0]);
/// coupling.apply(&[f64::INFINITY, 4.0], &mut y)?;
/// assert!(y[0].is_nan() && y[1] == 4.0);
/// let error = AxisMatrix::new("coupling", 2, &[1.0, 2.0, 2.0, 4.0]).unwrap_err();
/// assert!(error.to_string().starts_with("coupling: expected an invertible matrix with a condition number of at most 1e10"));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AxisMatrix {
    entries: Box<[f64]>,
    axes: usize,
}

impl AxisMatrix {
    /// The matrix for so many axes, row by row. The parameter is what errors call it.
    ///
    /// # Errors
    /// [`Error::Empty`] without an axis, [`Error::Length`] unless there are N x N entries, [`Error::Domain`] for an
    /// entry that is not finite, and for a matrix whose condition number (of the largest column sum) is above 1e10: the
    /// number that came is the condition number.
    pub fn new(parameter: &'static str, axes: usize, entries: &[f64]) -> Result<Self, Error> {
        if axes == 0 {
            return Err(Error::Empty { parameter });
        }
        check_length(parameter, axes.saturating_mul(axes), entries.len())?;
        check_all_finite(parameter, entries)?;
        let condition = condition(axes, entries);
        if condition <= LARGEST_CONDITION {
            return Ok(Self { entries: entries.into(), axes });
        }
        let expected = "an invertible matrix with a condition number of at most 1e10";
        Err(Error::domain(parameter, None, expected, condition))
    }

    /// The matrix that leaves everything as it is, for at least one axis.
    #[must_use]
    pub fn identity(axes: usize) -> Self {
        let axes = axes.max(1);
        let entry = |index: usize| f64::from(u8::from(index / axes == index % axes));
        Self { entries: (0..axes * axes).map(entry).collect(), axes }
    }

    /// How many axes there are.
    #[must_use]
    pub fn axes(&self) -> usize {
        self.axes
    }

    /// The entries, row by row.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// y = M x.
    ///
    /// # Errors
    /// [`Error::Length`] unless both have as many elements as there are axes; nothing is written then.
    pub fn apply(&self, x: &[f64], y: &mut [f64]) -> Result<(), Error> {
        check_length("x", self.axes, x.len())?;
        check_length("y", self.axes, y.len())?;
        for (y, row) in y.iter_mut().zip(self.rows()) {
            *y = product(row, x);
        }
        Ok(())
    }

    #[inline]
    pub(super) fn rows(&self) -> impl Iterator<Item = &[f64]> {
        // There is at least one axis; a row of no length would have no end.
        self.entries.chunks_exact(self.axes.max(1))
    }
}

/// A row times x.
#[inline]
pub(super) fn product(row: &[f64], x: &[f64]) -> f64 {
    let mut sum = None;
    for (entry, x) in row.iter().zip(x) {
        if *entry != 0.0 {
            if !is_admissible(*x) {
                return f64::NAN;
            }
            let term = entry * x;
            sum = Some(sum.map_or(term, |sum| sum + term));
        }
    }
    sum.unwrap_or(0.0)
}

/// The condition number for the largest column sum of magnitudes; infinite or NaN for a matrix without an inverse.
fn condition(axes: usize, entries: &[f64]) -> f64 {
    let norm = |rows: &[Vec<f64>], first: usize| {
        let sum = |column: usize| rows.iter().map(|row| row[column].abs()).sum::<f64>();
        (first..first + axes).map(sum).fold(0.0, f64::max)
    };
    // [M I], which Gauss and Jordan turn into [I M^-1].
    let mut rows: Vec<Vec<f64>> = vec![vec![0.0; 2 * axes]; axes];
    for (i, (row, given)) in rows.iter_mut().zip(entries.chunks_exact(axes)).enumerate() {
        row[..axes].copy_from_slice(given);
        row[axes + i] = 1.0;
    }
    let own = norm(&rows, 0);
    for i in 0..axes {
        let pivot = (i..axes).fold(i, |best, k| if rows[k][i].abs() > rows[best][i].abs() { k } else { best });
        if rows[pivot][i] == 0.0 {
            return f64::INFINITY;
        }
        rows.swap(i, pivot);
        let scale = rows[i][i];
        rows[i].iter_mut().for_each(|entry| *entry /= scale);
        let pivot_row = rows[i].clone();
        for (k, row) in rows.iter_mut().enumerate() {
            let factor = row[i];
            if k != i && factor != 0.0 {
                row.iter_mut().zip(&pivot_row).for_each(|(entry, pivot)| *entry -= factor * pivot);
            }
        }
    }
    own * norm(&rows, axes)
}

/// Several axes that move each other, as those of an XY stage or a tip-tilt mirror: a [`HybridController`] for each
/// actuator, behind a static decoupling.
///
/// ```text
/// y = K p          actuators that are at p move the axes to y: the coupling of the plant
/// r' = D r         what the actuators are to reach, of the references r of the axes
/// y' = D y         where they are, of the measurements y
/// u_i = C_i(r'_i, y'_i)
/// ```
///
/// With D = K^-1 every actuator has a loop of its own, with the model of its own hysteresis. Limits, slew and what is
/// counted are those of the single controllers. Products are summed from the first axis on and leave out zero entries
/// of D: with the identity, the drives are bit for bit those of the single controllers.
///
/// A measurement that is not finite (or beyond 1e100) is a missing one for all actuators that depend on it, by an entry
/// of D that is not zero; such a reference is a bad one for them. The others go on.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan), [`commit`](Self::commit) and [`run`](Self::run) do
/// not allocate, lock, panic, log or read a clock.
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
    decoupling: AxisMatrix,
}

/// What is asked of one sample of all axes: as [`Command`], each with a number for every axis.
///
/// References alone are a command too: `(&[1.5, 0.0]).into()`.
///
/// ```
/// use hysteresis_core::AxesCommand;
/// let references = [1.5, 0.0];
/// let plain = AxesCommand { references: &[1.5, 0.0], targets: None, corrections: None, estimates: None, feedforward: None };
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
    /// What the feedback of each actuator takes instead of its measurement (D y), as the estimate of an observer.
    pub estimates: Option<&'a [f64]>,
    /// Volts of each actuator that replace the output of its feed-forward.
    pub feedforward: Option<&'a [f64]>,
}

impl<'a> From<&'a [f64]> for AxesCommand<'a> {
    #[inline]
    fn from(references: &'a [f64]) -> Self {
        Self { references, targets: None, corrections: None, estimates: None, feedforward: None }
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
            estimate: self.estimates.and_then(|estimates| estimates.get(i)).copied(),
            feedforward: self.feedforward.and_then(|volts| volts.get(i)).copied(),
        }
    }
}

impl MultiAxisController {
    /// A controller for each actuator, and the decoupling row by row; none is the identity.
    ///
    /// # Errors
    /// [`Error::Empty`] without a controller; [`Error::Domain`] or [`Error::Whole`] for controllers of other sampling
    /// intervals or lengths of their previews than the first one; as [`AxisMatrix::new`] for the decoupling.
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
        check_rows("references", width, got)?;
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

    /// Takes the sample that was planned, on all axes. False, and no axis moves on, if one has no plan: without a plan,
    /// or after a change of its controller.
    pub fn commit(&mut self) -> bool {
        if self.controllers.iter().any(|controller| controller.planned.is_none()) {
            self.controllers.iter_mut().for_each(|controller| controller.planned = None);
            return false;
        }
        self.controllers.iter_mut().for_each(|controller| _ = controller.commit());
        true
    }

    /// Forgets a plan.
    pub fn discard_plan(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::discard_plan);
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

    /// Checks that everything has an element for each axis.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn check(&self, command: &AxesCommand<'_>, measurements: &[f64], drives: &[f64]) -> Result<(), Error> {
        let axes = self.controllers.len();
        check_length("references", axes, command.references.len())?;
        check_length("measurements", axes, measurements.len())?;
        check_length("targets", axes, command.targets.map_or(axes, <[f64]>::len))?;
        check_length("corrections", axes, command.corrections.map_or(axes, <[f64]>::len))?;
        check_length("estimates", axes, command.estimates.map_or(axes, <[f64]>::len))?;
        check_length("feedforward", axes, command.feedforward.map_or(axes, <[f64]>::len))?;
        check_length("drives", axes, drives.len())
    }

    /// What an actuator is to reach now, and what it measures, of the axes: (D r)_i, or what its preview has for now,
    /// and (D y)_i.
    #[inline]
    pub fn now<'a>(&'a self, references: &'a [f64], measurements: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
        let actuators = self.controllers.iter().zip(self.decoupling.rows());
        actuators.map(|(controller, row)| {
            (controller.reference_of_now(product(row, references)), product(row, measurements))
        })
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

/// Everything that a [`MultiAxisController`] remembers: restored, it continues bit for bit.
///
/// It also names the decoupling of its controller: one with another decoupling refuses it.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, MultiAxisController};
/// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
/// let controller = HybridController::new(FeedForward::None, None, &options)?;
/// let mut axes = MultiAxisController::new(vec![controller; 2], Some(&[1.0, 0.5, 0.0, 1.0]))?;
/// let (mut drives, mut again) = ([0.0; 2], [0.0; 2]);
/// axes.step((&[3.0, 1.0]).into(), &[0.5, 0.5], &mut drives)?;
/// let saved = axes.state();
/// axes.step((&[3.0, 2.0]).into(), &[1.0, 0.5], &mut drives)?;
/// axes.set_state(&saved)?;
/// axes.step((&[3.0, 2.0]).into(), &[1.0, 0.5], &mut again)?;
/// assert_eq!(again, drives);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct MultiAxisControllerState {
    /// The decoupling, row by row.
    pub decoupling: Vec<f64>,
    /// What the controller of each actuator remembers.
    pub controllers: Vec<ControllerState>,
}

impl MultiAxisController {
    /// Changes what all axes do with their samples; see [`HybridController::set_mode`].
    ///
    /// # Errors
    /// [`Error::StopWithoutRate`] for [`Mode::Stop`]; all is as before then.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), Error> {
        self.controllers.iter_mut().try_for_each(|controller| controller.set_mode(mode))
    }

    /// Holds all drives.
    pub fn hold(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::hold);
    }

    /// Back from a hold or a stop, on all axes.
    pub fn release(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::release);
    }

    /// Ramps every drive to its rest drive at `rate` volts per second; see
    /// [`HybridController::stop`].
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a rest drive for each actuator, [`Error::Domain`] for a rate that is not above
    /// zero or a rest drive outside its limits; all is as before then.
    pub fn stop(&mut self, rate: f64, rest_drives: &[f64]) -> Result<(), Error> {
        check_stop(["rate", "rest_drives"], rate, rest_drives, self.limits())?;
        let mut each = self.controllers.iter_mut().zip(rest_drives);
        each.try_for_each(|(controller, rest_drive)| controller.stop(rate, *rest_drive))
    }

    /// The controller of one actuator, to change it alone: its gains, filters, model or mode. A change drops what is
    /// planned.
    ///
    /// # Errors
    /// [`Error::Whole`] that names `axis` unless there is such an actuator.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, MultiAxisController};
    /// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
    /// let controller = HybridController::new(FeedForward::None, None, &options)?;
    /// let mut axes = MultiAxisController::new(vec![controller; 2], None)?;
    /// axes.controller_mut(1)?.set_gains(1.0, 300.0)?;
    /// assert_eq!([0, 1].map(|i| axes.controllers()[i].options().kp), [2.0, 1.0]);
    /// assert_eq!(axes.controller_mut(2).unwrap_err().parameter(), Some("axis"));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn controller_mut(&mut self, axis: usize) -> Result<&mut HybridController, Error> {
        let axes = self.controllers.len();
        self.controllers.get_mut(axis).ok_or_else(|| no_such("axis", None, axis, axes))
    }

    /// All axes as made, but for options and gains that were changed since and for the drives, which stay.
    pub fn reset(&mut self) {
        self.controllers.iter_mut().for_each(HybridController::reset);
    }

    /// [`reset`](Self::reset), the amplifiers being at other drives now.
    ///
    /// # Errors
    /// As [`start_at`](Self::start_at); all is as before then.
    pub fn reset_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        self.start_at(drives)?;
        self.reset();
        Ok(())
    }

    /// Takes over what was driven before, rows of one drive for each actuator, oldest first: see
    /// [`HybridController::follow`]. Without any nothing changes. Allocates.
    ///
    /// # Errors
    /// [`Error::Rows`] unless they are whole rows, [`Error::Domain`] for a drive that is not finite or outside its
    /// limits, [`Error::CannotFollow`] for a feed-forward that knows targets alone; all is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, MultiAxisController};
    /// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
    /// let controller = HybridController::new(FeedForward::None, None, &options)?;
    /// let mut axes = MultiAxisController::new(vec![controller; 2], None)?;
    /// axes.follow(&[8.0, 1.0, 4.0, 2.0])?;
    /// assert_eq!([0, 1].map(|i| axes.controllers()[i].drive()), [4.0, 2.0]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_rows_between("drives", drives, &self.limits())?;
        let width = self.controllers.len().max(1);
        let mut moved = self.controllers.clone();
        for (i, controller) in moved.iter_mut().enumerate() {
            let column: Vec<f64> = drives.iter().skip(i).step_by(width).copied().collect();
            controller.follow(&column)?;
        }
        self.controllers = moved;
        Ok(())
    }

    /// The limits of the drive of every actuator.
    fn limits(&self) -> impl ExactSizeIterator<Item = (f64, f64)> + Clone + '_ {
        self.controllers.iter().map(|controller| controller.options().limits)
    }

    /// Goes on from other drives that the amplifiers have, with everything that is remembered.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is a drive for each actuator, [`Error::Domain`] for one outside its limits; all
    /// is as before then.
    pub fn start_at(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_each_between("drives", drives, self.limits())?;
        let mut each = self.controllers.iter_mut().zip(drives);
        each.try_for_each(|(controller, drive)| controller.start_at(*drive))
    }

    /// Everything that the axes remember. Allocates.
    #[must_use]
    pub fn state(&self) -> MultiAxisControllerState {
        MultiAxisControllerState {
            decoupling: self.decoupling.entries().to_vec(),
            controllers: self.controllers.iter().map(HybridController::state).collect(),
        }
    }

    /// Continues from `state`, bit for bit. The amplifiers must be at the drives of the state. Allocates.
    ///
    /// # Errors
    /// [`Error::State`] for another decoupling or number of axes, and those of
    /// [`HybridController::set_state`]; all is as before then.
    pub fn set_state(&mut self, state: &MultiAxisControllerState) -> Result<(), Error> {
        if state.decoupling != self.decoupling.entries() {
            return Err(Error::State { expected: "the decoupling that the controller has" });
        }
        if state.controllers.len() != self.controllers.len() {
            return Err(Error::State { expected: "as many controllers as there are axes" });
        }
        let mut restored = self.controllers.clone();
        for (controller, state) in restored.iter_mut().zip(&state.controllers) {
            controller.set_state(state)?;
        }
        self.controllers = restored;
        Ok(())
    }
}
