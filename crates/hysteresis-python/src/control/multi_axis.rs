//! A hybrid controller for each actuator of several axes, behind a static decoupling.

use hysteresis_control::multi_axis::{MultiAxisStageController, MultiAxisStageState, Tracking, TrackingOptions};
use hysteresis_core as core;
use hysteresis_core::AxesCommand;
use hysteresis_python_macros::methods;
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};
use pythonize::pythonize;

use crate::argument::{Argument, SampleCount, Words};
use crate::control::controller::HybridController;
use crate::control::filters::Filters;
use crate::control::shared_by_controllers::{ControllerTerms, mode_name, plain_state, source};
use crate::convert::arrays;
use crate::convert::errors::{self, Place, raise, unexpected};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, shared};
use crate::model::models::compiled_of;
use crate::plant::plant::{as_matrix, list_of, square};
use crate::stage::multi_axis_stage::MultiAxisStage;
use crate::stream::blocks::{Block, apply};
use crate::stream::stream_arrays::columns;

/// Rows between two looks at pending signals (Ctrl-C).
const ROWS: usize = 1 << 16;

/// Several axes that move each other, as those of an XY stage or a tip-tilt mirror: a HybridController for each
/// actuator, behind a static decoupling.
///
/// A plant with the coupling K moves its axes to y = K p when its actuators are at p. Actuator i gets the reference (D
/// r)_i and the measurement (D y)_i, with the decoupling D, usually the inverse of K: u_i = C_i((D r)_i, (D y)_i). So
/// each actuator has a loop of its own, with the model of its own hysteresis. Its limits, slew, filters and gates are
/// those of its controller, in the coordinates of the actuator.
///
/// Products are summed from the first axis on and leave out zero entries of D. So with the identity the drives are bit
/// for bit those of the single controllers. A measurement that is not finite (or beyond 1e100) is a missing one for all
/// actuators that depend on it, by an entry of D that is not zero; such a reference is a bad one for them. The other
/// actuators go on.
///
/// A `MultiAxisStage` may lead the axes: `stage.controller(limits)` makes such a controller. Then the drives of the
/// feed-forward are those with which its model follows the references best, and its observer tells what comes in with
/// the drives that the model does not know. The single controllers take both, and multiply the second by -kp. So the
/// error in `terms` is the negative disturbance, and not a tracking error. References come `ahead` samples early,
/// targets and corrections too.
///
/// Parameters
/// ----------
/// controllers : list of N HybridControllers
///     With the same `dt`, and previews of the same length that look equally far ahead, or none. Copies are taken, in
///     the state in which they are.
/// decoupling : array of shape (N, N), optional
///     D: finite, with a condition number (of the largest column sum) of at most 1e10. Without one the axes are those
///     of the actuators, or the inverse of the static gain of the stage.
/// stage : MultiAxisStage, optional
///     Leads the axes. The controllers take "given" volts then, and have previews that look as far ahead as the stage,
///     a kp from 0 to 1 and a ki of 0.
/// ahead : int, optional
///     How many samples early references come, with a stage; by default as many as its dynamics use.
/// peak_sensitivity : float, optional
///     By how much the feedback of a stage may at most amplify what disturbs a position, 1.05 to 5; by default 2.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> coupling = np.array([[1.0, 0.03], [-0.03, 1.0]])
/// >>> stage = mh.plant.MultiAxisPlant([mh.paper.plant("A1", seed=seed) for seed in (1, 2)], coupling)
/// >>> kp, ki = mh.paper.gains("A1")
/// >>> inverse = mh.paper.table_1_recovered().inverse((-560, 560))
/// >>> single = mh.control.HybridController(inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560))
/// >>> axes = mh.control.MultiAxisController([single, single], np.linalg.inv(coupling))
/// >>> axes.step([0.5, 0.0], stage.measured).shape
/// (2,)
/// >>> axes.reset()
/// >>> x = mh.signals.sine(3.3, 20.0, seconds=0.2)  # um
/// >>> runs = mh.plant.simulate(axes, stage, np.column_stack([x, np.zeros(x.size)]), period=500)
/// >>> runs[1].settled.max_position_error < 0.06  # um: noise; without decoupling 0.1 of the crosstalk are left
/// True
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct MultiAxisController {
    pub(crate) controller: MultiAxisStageController,
    /// The single controllers as they came, with what they were made of.
    pub(super) made_of: Vec<Py<HybridController>>,
    /// The stage that leads them, and by which peak of the sensitivity it was judged.
    pub(super) led_by: Option<(Py<MultiAxisStage>, f64)>,
}

/// One number for each axis.
pub(super) fn one_each<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    axes: usize,
) -> PyResult<PyReadonlyArray1<'py, f64>> {
    columns(name, value, axes, format_args!("an array of shape ({axes},)"))
}

/// What is asked of a sample, converted.
struct Asked<'py> {
    references: PyReadonlyArray1<'py, f64>,
    measurements: PyReadonlyArray1<'py, f64>,
    targets: Option<PyReadonlyArray1<'py, f64>>,
    corrections: Option<PyReadonlyArray1<'py, f64>>,
    feedforward: Option<PyReadonlyArray1<'py, f64>>,
}

/// What acts on a sample and writes the drives.
type Act<'a> = &'a mut dyn FnMut(AxesCommand<'_>, &[f64], &mut [f64]) -> PyResult<()>;

impl<'py> Asked<'py> {
    /// The arguments references, measurements, targets, corrections and feedforward.
    fn new(axes: usize, [r, y]: [&Bound<'py, PyAny>; 2], [t, c, f]: [Option<&Bound<'py, PyAny>>; 3]) -> PyResult<Self> {
        Ok(Self {
            references: one_each("references", r, axes)?,
            measurements: one_each("measurements", y, axes)?,
            targets: t.map(|targets| one_each("targets", targets, axes)).transpose()?,
            corrections: c.map(|corrections| one_each("corrections", corrections, axes)).transpose()?,
            feedforward: f.map(|volts| one_each("feedforward", volts, axes)).transpose()?,
        })
    }

    /// The drives, in `out` or a new array. All is copied first, so `out` may be one of the arguments.
    fn through(self, out: Option<&Bound<'py, PyAny>>, act: Act<'_>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let copy = |given: Option<PyReadonlyArray1<'py, f64>>| {
            given.map(|given| given.as_slice().map(<[f64]>::to_vec)).transpose()
        };
        let measurements = self.measurements.as_slice()?.to_vec();
        let (targets, corrections, feedforward) =
            (copy(self.targets)?, copy(self.corrections)?, copy(self.feedforward)?);
        drop(self.measurements);
        let references = self.references.as_slice()?.to_vec();
        let asked = AxesCommand {
            references: &references,
            targets: targets.as_deref(),
            corrections: corrections.as_deref(),
            estimates: None,
            feedforward: feedforward.as_deref(),
        };
        apply(self.references, out, |block| {
            let (Block::Apart(_, drives) | Block::InPlace(drives)) = block;
            act(asked, &measurements, drives)
        })
    }
}

impl MultiAxisController {
    pub(crate) fn axes(&self) -> usize {
        self.single().len()
    }

    /// The single controllers.
    fn single(&self) -> &[core::HybridController] {
        self.controller.controller().controllers()
    }

    /// Controllers that a stage leads, with copies of these, and its decoupling unless another one is given.
    fn led(
        stage: &Bound<'_, MultiAxisStage>,
        (copies, decoupling): (Vec<HybridController>, Option<Vec<f64>>),
        options: &TrackingOptions,
    ) -> PyResult<Self> {
        let single: Vec<_> = copies.iter().map(|one| one.controller().clone()).collect();
        let limits: Vec<_> = single.iter().map(|one| one.options().limits).collect();
        let start = single.first().map_or(0, core::HybridController::bumpless_samples);
        let tracking = Tracking::new(&stage.get().0, &limits, start, options).map_err(raise)?;
        let decoupling = decoupling.unwrap_or_else(|| tracking.decoupling().to_vec());
        let decoupled = core::MultiAxisController::new(single, Some(&decoupling)).map_err(raise)?;
        let controller = MultiAxisStageController::from(decoupled).with_tracking(tracking).map_err(raise)?;
        Self::with_stage(stage, controller, copies, options.peak_sensitivity)
    }

    /// A controller that a stage leads already, and what its single controllers were made of.
    pub(crate) fn with_stage(
        stage: &Bound<'_, MultiAxisStage>,
        controller: MultiAxisStageController,
        copies: Vec<HybridController>,
        peak_sensitivity: f64,
    ) -> PyResult<Self> {
        let made_of = copies.into_iter().map(|one| Py::new(stage.py(), one)).collect::<PyResult<_>>()?;
        Ok(Self { controller, made_of, led_by: Some((stage.clone().unbind(), peak_sensitivity)) })
    }

    /// A count of every controller.
    fn counted<'py>(&self, py: Python<'py>, count: impl Fn(core::Counters) -> u64) -> Bound<'py, PyArray1<u64>> {
        PyArray1::from_iter(py, self.single().iter().map(|controller| count(controller.counters())))
    }
}

#[methods]
impl MultiAxisController {
    #[new]
    fn new(
        #[py("Iterable[HybridController]")] controllers: &Bound<'_, PyAny>,
        #[py("ArrayLike | None" = None)] decoupling: Option<&Bound<'_, PyAny>>,
        #[py(*, = None)] stage: Option<Bound<'_, MultiAxisStage>>,
        #[py(= None)] ahead: Option<SampleCount>,
        #[py(= None)] peak_sensitivity: Option<f64>,
    ) -> PyResult<Self> {
        let given = list_of::<HybridController>("controllers", "HybridController", controllers)?;
        let decoupling = decoupling.map(|matrix| square("decoupling", matrix, given.len())).transpose()?;
        let copies = given.iter().map(|one| shared(one)?.duplicate(one.py())).collect::<PyResult<Vec<_>>>()?;
        for (i, one) in copies.iter().enumerate() {
            if one.observer.is_some() || one.repetitive.is_some() {
                let place = format!("controllers[{i}]");
                let expected = "expected a controller without observer and learning of its own";
                return Err(errors::value(Place::part("controllers", &place), expected));
            }
        }
        if let Some(stage) = &stage {
            let peak_sensitivity = peak_sensitivity.unwrap_or(TrackingOptions::default().peak_sensitivity);
            let options = TrackingOptions { ahead: ahead.map(|ahead| ahead.0), peak_sensitivity };
            return Self::led(stage, (copies, decoupling), &options);
        }
        if ahead.is_some() {
            return Err(errors::value("ahead", "expected None without a stage, as previews know it"));
        }
        if let Some(peak) = peak_sensitivity {
            let expected = format_args!("expected None without a stage, got {peak:?}");
            return Err(errors::value("peak_sensitivity", expected));
        }
        let single = copies.iter().map(|one| one.controller().clone()).collect();
        let controller = core::MultiAxisController::new(single, decoupling.as_deref()).map_err(raise)?.into();
        let made_of = copies.into_iter().map(|one| Py::new(controllers.py(), one)).collect::<PyResult<_>>()?;
        Ok(Self { controller, made_of, led_by: None })
    }

    /// Takes a sample and returns the drives in volts, in `out` or a new array of shape (N,).
    ///
    /// `references` and `measurements` of the axes, arrays of N numbers; with previews the references of
    /// `preview.ahead` samples later. `targets` of the axes, if the feed-forward is to reach something else;
    /// `corrections`: what is added to them; `feedforward`: volts of the actuators that replace its output.
    fn step<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] references: &Bound<'py, PyAny>,
        #[py("ArrayLike")] measurements: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
        #[py(*, "ArrayLike | None" = None)] targets: Option<&Bound<'py, PyAny>>,
        #[py("ArrayLike | None" = None)] corrections: Option<&Bound<'py, PyAny>>,
        #[py("ArrayLike | None" = None)] feedforward: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let axes = shared(slf)?.axes();
        let asked = Asked::new(axes, [references, measurements], [targets, corrections, feedforward])?;
        asked.through(out, &mut |command, y, drives| exclusive(slf)?.controller.step(command, y, drives).map_err(raise))
    }

    /// The drives that `step` would return, without taking the sample.
    #[like(step)]
    fn peek<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let axes = shared(slf)?.axes();
        let asked = Asked::new(axes, [references, measurements], [targets, corrections, feedforward])?;
        asked.through(out, &mut |command, y, drives| shared(slf)?.controller.peek(command, y, drives).map_err(raise))
    }

    /// The drives for a sample, which only `commit` takes: write them to the amplifiers between the two, and if that
    /// fails, leave it.
    ///
    /// A plan replaces the one before; any change of a controller drops it.
    #[like(step)]
    fn plan<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let axes = shared(slf)?.axes();
        let asked = Asked::new(axes, [references, measurements], [targets, corrections, feedforward])?;
        asked.through(out, &mut |command, y, drives| exclusive(slf)?.controller.plan(command, y, drives).map_err(raise))
    }

    /// Takes the sample that was planned, on all axes; False, and none moves on, if there is no plan.
    fn commit(slf: &Bound<'_, Self>) -> PyResult<bool> {
        Ok(exclusive(slf)?.controller.commit())
    }

    /// Takes references and measurements of shape (samples, N), bit for bit like `step` in a loop; returns the drives,
    /// in `out` or a new array of that shape.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] references: &Bound<'py, PyAny>,
        #[py("ArrayLike")] measurements: &Bound<'py, PyAny>,
        #[py("Matrix | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (py, axes) = (slf.py(), shared(slf)?.axes());
        let expected = format!("an array of shape (samples, {axes})");
        let samples = columns::<Ix2>("references", references, axes, format_args!("{expected}"))?;
        let beside = columns::<Ix2>("measurements", measurements, axes, format_args!("{expected}"))?;
        let (rows, got) = (samples.shape()[0], beside.shape()[0]);
        if rows != got {
            return Err(errors::value(
                "measurements",
                format_args!("expected {rows} rows, as in references, got {got}"),
            ));
        }
        // A copy: what is written may overlap it.
        let measured = arrays::copy("measurements", beside.as_slice()?)?;
        drop(beside);
        apply(samples, out, |block| {
            let mut this = exclusive(slf)?;
            let mut take = |x: &[f64], y: &[f64], drives: &mut [f64]| {
                py.check_signals()?;
                this.controller.run(x, y, drives).map_err(raise)
            };
            match block {
                Block::Apart(x, drives) => {
                    let inputs = x.chunks(ROWS * axes).zip(measured.chunks(ROWS * axes));
                    inputs.zip(drives.chunks_mut(ROWS * axes)).try_for_each(|((x, y), drives)| take(x, y, drives))
                }
                Block::InPlace(samples) => {
                    let copy = arrays::copy("references", samples)?;
                    take(&copy, &measured, samples)
                }
            }
        })
    }

    /// The single controllers, as copies in their present states.
    #[getter]
    #[py(-> "tuple[HybridController, ...]")]
    fn controllers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let copies = self.made_of.iter().zip(self.single()).map(|(made, controller)| {
            let copy = made.borrow(py).duplicate(py)?;
            Bound::new(py, HybridController { stage_controller: controller.clone().into(), ..copy })
        });
        PyTuple::new(py, copies.collect::<PyResult<Vec<_>>>()?)
    }

    /// D, as an array of shape (N, N).
    #[getter]
    fn decoupling<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        as_matrix(py, self.controller.controller().decoupling().entries(), self.axes())
    }

    /// The present drives in volts: what the amplifiers have.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.single().iter().map(core::HybridController::drive))
    }

    /// The limits of the drives in volts, an array of shape (N, 2).
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let limits = self.single().iter().map(|controller| controller.options().limits);
        as_matrix(py, &limits.flat_map(<[f64; 2]>::from).collect::<Vec<_>>(), 2)
    }

    /// The sampling interval in seconds.
    #[getter]
    pub(super) fn dt(&self) -> f64 {
        self.single().first().map_or(0.0, |controller| controller.options().dt)
    }

    /// What the last samples of the actuators that were acted upon were made of, N ControllerTerms. Where a stage
    /// leads, `error` is the negative disturbance, in volts, and not a tracking error.
    #[getter]
    #[py(-> "tuple[ControllerTerms, ...]")]
    fn terms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let terms = self.single().iter().map(|one| Bound::new(py, ControllerTerms::from(one.terms())));
        PyTuple::new(py, terms.collect::<PyResult<Vec<_>>>()?)
    }

    /// For how many seconds at most the drives are not yet those of the law, from the next sample on: until the windows
    /// of the previews are full and the bumpless terms are gone.
    #[getter]
    fn lead_in(&self) -> f64 {
        self.single().iter().map(core::HybridController::lead_in).fold(0.0, f64::max)
    }

    /// How many samples early references come; 0 without previews.
    #[getter]
    fn ahead(&self) -> usize {
        self.single().first().and_then(core::HybridController::preview).map_or(0, core::Preview::ahead)
    }

    /// The stage that leads the axes, or None.
    #[getter]
    fn stage(&self, py: Python<'_>) -> Option<Py<MultiAxisStage>> {
        self.led_by.as_ref().map(|(stage, _)| stage.clone_ref(py))
    }

    /// What comes in with the drives that the model of the stage does not know, in volts, an array of N: zeros without
    /// a stage.
    #[getter]
    fn disturbance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        match self.controller.tracking() {
            Some(tracking) => PyArray1::from_slice(py, tracking.disturbance()),
            None => PyArray1::zeros(py, self.axes(), false),
        }
    }

    /// The proportional gains of the actuators in V/um, an array of N.
    #[getter]
    fn kp<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.single().iter().map(|one| one.options().kp))
    }

    /// The integral gains of the actuators in V/um/s, an array of N.
    #[getter]
    fn ki<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.single().iter().map(|one| one.options().ki))
    }

    /// How many references, targets or given feed-forwards of each actuator were not finite, or beyond 1e100, or
    /// missing.
    #[getter]
    fn rejected_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        self.counted(py, |counters| counters.rejected_count)
    }

    /// How many measurements each actuator missed: one that it depends on was not finite, or beyond 1e100.
    #[getter]
    fn missing_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        self.counted(py, |counters| counters.missing_count)
    }

    /// How many measurements of each actuator were finite but out of their range, or too far from the last one.
    #[getter]
    fn implausible_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        self.counted(py, |counters| counters.implausible_count)
    }

    /// How many samples asked for a drive of each actuator beyond its limits.
    #[getter]
    fn saturated_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        self.counted(py, |counters| counters.saturated_count)
    }

    /// How many samples asked for a faster move of each actuator than its slew allows.
    #[getter]
    fn slewing_count<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        self.counted(py, |counters| counters.slewing_count)
    }

    fn __len__(&self) -> usize {
        self.axes()
    }

    fn __repr__(&self) -> String {
        let drives: Vec<f64> = self.single().iter().map(core::HybridController::drive).collect();
        format!("<MultiAxisController of {} axes: dt {:?} s, drive {drives:?}>", self.axes(), self.dt())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let parts = (this.controllers(py)?, this.decoupling(py)?);
        let Some((stage, peak)) = &this.led_by else {
            return reduce(py.get_type::<Self>().into_any(), parts, keywords!(py), None);
        };
        let keywords = keywords!(py, stage = stage, ahead = this.ahead(), peak_sensitivity = peak);
        let state = Self::state(slf)?;
        reduce(py.get_type::<Self>().into_any(), parts, keywords, Some(state))
    }
}

#[methods]
impl MultiAxisController {
    /// Changes the gains of actuator `axis`, counted from 0, without a jump: as `HybridController.set_gains`.
    ///
    /// A change of one actuator drops what is planned for all. What is refused leaves all as it was. Where a stage
    /// leads, `kp` is 0 to 1, the share of the disturbance that is taken away, and `ki` is 0: what lasts is in the
    /// disturbance itself.
    fn set_gains(slf: &Bound<'_, Self>, axis: usize, kp: f64, ki: f64) -> PyResult<()> {
        exclusive(slf)?.controller.set_gains(axis, kp, ki).map_err(raise)
    }

    /// Changes the filters of actuator `axis`, counted from 0, without a jump: as `HybridController.set_filters`.
    fn set_filters(slf: &Bound<'_, Self>, axis: usize, filters: Filters) -> PyResult<()> {
        let sections = filters.sections(shared(slf)?.dt())?;
        exclusive(slf)?
            .controller
            .controller_mut()
            .controller_mut(axis)
            .and_then(|one| one.set_filters(&sections))
            .map_err(raise)
    }

    /// Actuator `axis`, counted from 0, goes on with the weights and the output offset of another model of the same
    /// operators, without a jump: as `HybridController.set_model`.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if an inverse of the model may not exist; all is
    /// as before then.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> model, limits = mh.paper.table_1_recovered(), (-500.0, 500.0)
    /// >>> single = mh.control.HybridController(model.inverse(limits), kp=5.0, ki=6e3, dt=1e-4, limits=limits)
    /// >>> axes = mh.control.MultiAxisController([single, single])
    /// >>> for _ in range(60):
    /// ...     before = axes.step([1.0, 0.5], [1.0, 0.5])
    /// >>> stiffer = mh.ModifiedPrandtlIshlinskii(0.9 * model.weights, model.r, model.ra, model.rb, model.rc)
    /// >>> axes.set_model(0, stiffer)
    /// >>> axes.set_gains(1, kp=4.0, ki=5e3)
    /// >>> bool(abs(axes.step([1.0, 0.5], [1.0, 0.5]) - before).max() < 1.0)  # V: no jump
    /// True
    /// >>> axes.kp.tolist(), axes.mode
    /// ([5.0, 4.0], ('run', 'run'))
    fn set_model(slf: &Bound<'_, Self>, axis: usize, #[py("Model")] model: &Bound<'_, PyAny>) -> PyResult<()> {
        let compiled = compiled_of("model", model)?;
        let mut this = exclusive(slf)?;
        this.controller
            .controller_mut()
            .controller_mut(axis)
            .and_then(|one| one.set_model(&compiled))
            .map_err(raise)?;
        shared(this.made_of[axis].bind(slf.py()))?.remember_model(model)
    }

    /// Actuator `axis`, counted from 0, goes on with another feed-forward without a jump: as
    /// `HybridController.set_feedforward`. Not where a stage leads, which gives the volts.
    fn set_feedforward(
        slf: &Bound<'_, Self>,
        axis: usize,
        #[py("FeedForward")] feedforward: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let dt = shared(slf)?.dt();
        if shared(slf)?.led_by.is_some() {
            return Err(errors::value(
                "feedforward",
                "expected no other one where a stage leads, which gives the volts",
            ));
        }
        let (feedforward, source) = source(feedforward, dt)?;
        let mut this = exclusive(slf)?;
        this.controller
            .controller_mut()
            .controller_mut(axis)
            .and_then(|one| one.set_feedforward(feedforward))
            .map_err(raise)?;
        exclusive(this.made_of[axis].bind(slf.py()))?.source = source;
        Ok(())
    }

    /// What each actuator does with its samples, N words: "run"; "feedforward": the proportional term is off, the
    /// integral is frozen and stays part of the drive; "hold": the drive stays and nothing advances; "stop", which
    /// `stop` begins.
    ///
    /// Set one of the first three at any time, or a list of N of them: no change of mode is a jump.
    #[getter]
    #[py(-> "tuple[Literal['run', 'feedforward', 'hold', 'stop'], ...]")]
    fn mode<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.single().iter().map(|one| mode_name(one.mode())))
    }

    #[setter]
    fn set_mode(
        slf: &Bound<'_, Self>,
        #[py("Literal['run', 'feedforward', 'hold'] | Sequence[Literal['run', 'feedforward', 'hold']]")] mode: &Bound<
            '_,
            PyAny,
        >,
    ) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let modes = if mode.is_instance_of::<PyString>() {
            vec![core::Mode::from_argument("mode", mode)?; axes]
        } else {
            let words = mode.extract::<Vec<String>>().ok().filter(|words| words.len() == axes);
            let expected = core::Mode::expected();
            let words = words
                .ok_or_else(|| unexpected("mode", format_args!("{expected}, or a list of {axes} of these"), mode))?;
            let each = words.iter().enumerate().map(|(i, word)| {
                core::Mode::named(word).ok_or_else(|| {
                    let place = format!("mode[{i}]");
                    errors::value(Place::part("mode", &place), format_args!("expected {expected}, got \"{word}\""))
                })
            });
            each.collect::<PyResult<Vec<_>>>()?
        };
        let mut this = exclusive(slf)?;
        let mut each = this.controller.controller_mut().controllers_mut().iter_mut().zip(modes);
        each.try_for_each(|(one, mode)| one.set_mode(mode)).map_err(raise)
    }

    /// Whether all drives are held. An attribute: set it to True to hold, to False to go on in the mode before, also
    /// after a stop.
    #[getter]
    fn hold(&self) -> bool {
        self.single().iter().all(|controller| controller.mode() == core::Mode::Hold)
    }

    #[setter]
    fn set_hold(slf: &Bound<'_, Self>, hold: bool) -> PyResult<()> {
        if hold {
            exclusive(slf)?.controller.controller_mut().hold();
        } else {
            exclusive(slf)?.controller.controller_mut().release();
        }
        Ok(())
    }

    /// Ramps every drive to its rest drive (V, an array of N, by default zeros) at `rate` (V/s), or at its slew if that
    /// is slower, and holds it there.
    ///
    /// From the next sample on every `step` puts out the next drives of the ramps, for any references and measurements.
    /// `hold = False` starts a motion from the drives that are reached then.
    fn stop(
        slf: &Bound<'_, Self>,
        rate: f64,
        #[py("ArrayLike | None" = None)] rest_drives: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let rest_drives = match rest_drives {
            Some(given) => one_each("rest_drives", given, axes)?.as_slice()?.to_vec(),
            None => vec![0.0; axes],
        };
        exclusive(slf)?.controller.controller_mut().stop(rate, &rest_drives).map_err(raise)
    }

    /// All axes back to the start, in mode "run", with all counters at zero. The drives stay as they are, or are
    /// `drives` if the amplifiers have others now.
    ///
    /// For a stage that leads it is as if the drives had come from rest one sample ago: `follow` tells it more.
    fn reset(
        slf: &Bound<'_, Self>,
        #[py("ArrayLike | None" = None)] drives: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let drives = drives.map(|given| one_each("drives", given, axes)).transpose()?;
        let mut this = exclusive(slf)?;
        let drives = drives.as_ref().map(|drives| drives.as_slice()).transpose()?;
        this.controller.reset(drives).map_err(raise)
    }

    /// Takes over what was driven before, an array of shape (samples, N), oldest drives first, one row per sampling
    /// interval; the next motion starts from the last row.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let drives = columns::<Ix2>("drives", drives, axes, format_args!("an array of shape (samples, {axes})"))?;
        exclusive(slf)?.controller.follow(drives.as_slice()?).map_err(raise)
    }

    /// Goes on from other drives that the amplifiers have, with everything that is remembered.
    ///
    /// For a stage that leads they go out for one sample more: in a new controller, as if they had come from rest one
    /// sample ago. `follow` tells it more.
    fn start_at(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let axes = shared(slf)?.axes();
        let drives = one_each("drives", drives, axes)?;
        exclusive(slf)?.controller.start_at(drives.as_slice()?).map_err(raise)
    }

    /// Everything that the axes remember, as a dictionary to keep; set it to continue from there bit for bit. The
    /// amplifiers must be at its drives. Axes with another decoupling, other gains, dt or limits refuse it.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.controller.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let plain: MultiAxisStageState = plain_state(state)?;
        exclusive(slf)?.controller.set_state(&plain).map_err(raise)
    }
}
