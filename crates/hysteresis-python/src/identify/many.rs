//! Identification of many actuators: arrays in, small results out.

use hysteresis_python_macros::function;
use std::ops::ControlFlow;

use hysteresis_core::Ratios;
use hysteresis_identify::{self as identification, ManyRecords, ModelKind, Options, RecordError, Setting, WeightLaw};
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix2, IxDyn};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use super::intervals::duration;
use super::many_result::ManyIdentifications;
use super::many_tasks::Tasks;
use super::options::{Smoothness, placed};
use crate::convert::arguments::{callable, count};
use crate::convert::arrays::array;
use crate::convert::arrays::{FIT, check_room};
use crate::convert::errors::{self, raise, record, unexpected};

/// Fits a model to each of many actuators: hysteresis and dead time, as `identify` does for one.
///
/// Driven alike (one u for all), actuators share what depends on the drive alone: where to start and the first step take no pass over
/// the operators. Each is then fitted by itself on all of its samples. The fit is as good as that of `identify`; where several minima
/// of the error are nearly as deep, it may be another one. Driven each by its own drive, they get the very fit of `identify`.
///
/// All samples count: glitches are not looked for, as `identify` does with its `loss`. A position with glitches is fitted badly.
///
/// Parameters
/// ----------
/// u : array of shape (samples,) or (samples, M)
///     The drive of all actuators (V), or one for each.
/// Y : array of shape (samples, M)
///     The measured positions (um), a column for each actuator.
/// dt : float, optional
///     Sampling interval in seconds. Without it dead times are in samples.
/// model, ratios, input_offset, dead_time, thresholds
///     As for `identify`, the same for all actuators.
/// operators : int or "auto"
///     One number for all. It stays 20 where `identify` would double it.
/// weights : "auto", "free", "quadratic" or "split"
///     One law for all. "auto" asks the first, the middle and the last actuator that can be fitted, as `identify` would, and takes
///     the answer with the most unknowns; so it does with "auto" operators. Of a smoothness it takes the middle one.
/// smoothness : float or "auto"
///     As for `identify`, one for all.
/// skip : int or str
///     Leading samples that set the memory but are not fitted, or a time such as "2s".
/// threads : int
///     So many share out the actuators. The result has the same bits for any number of threads.
/// executor : concurrent.futures.Executor, optional
///     Takes the actuators in groups of 256, each as a call of this function with `threads`. The same bits again. Everything goes
///     through pickle if it has processes.
/// progress : callable, optional
///     Called with (share done, actuators done). Ctrl-C stops either way; calls that an executor has begun run to their end.
///
/// Returns
/// -------
/// ManyIdentifications
///     An actuator that cannot be fitted (a sample that is not finite, a position that never moves) has its reason in `errors`, and
///     takes nothing from the others.
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
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
/// >>> gains = [1.0, 1.25, 0.75]
/// >>> Y = np.column_stack([gain * mh.paper.table_1_recovered().forward().run(u) for gain in gains])
/// >>> found = mh.identify_many(u, Y, dt=0.01, weights="quadratic", smoothness=0.0, threads=2)
/// >>> found
/// <ManyIdentifications of 3 actuators, 20 operators: 3 green, 0 amber, 0 red>
/// >>> bool(found.nrmse.max() < 1e-3)
/// True
/// >>> inverse = found.actuator_array().inverse(limits=(-500.0, 500.0))
/// >>> drive = inverse.step([2.0, 2.0, 2.0])  # V
/// >>> bool(drive[1] < drive[0] < drive[2])
/// True
#[function]
#[gather(options: Options)]
#[expect(non_snake_case, reason = "a matrix, by its usual name")]
pub(crate) fn identify_many(
    py: Python<'_>,
    #[py("ArrayLike")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike")] Y: &Bound<'_, PyAny>,
    #[py(*, = None)] dt: Option<f64>,
    #[py(field, "Literal['modified', 'conventional']" = "modified")] model: ModelKind,
    #[py("int | Literal['auto'] | None" = 20)] operators: Option<&Bound<'_, PyAny>>,
    #[py(field, "Literal['auto', 'free', 'quadratic', 'split']" = "auto")] weights: WeightLaw,
    #[py(field, "Literal['fit'] | tuple[float, float, float]" = "fit")] ratios: Setting<Ratios>,
    #[py(field, "Literal['fit'] | float" = "fit")] input_offset: Setting<f64>,
    #[py(field, "Literal['fit'] | float" = "fit")] dead_time: Setting<f64>,
    #[py("Literal['uniform', 'quantiles', 'geometric'] | ArrayLike | None" = None)] thresholds: Option<
        &Bound<'_, PyAny>,
    >,
    #[py("Literal['auto'] | float" = "auto")] smoothness: Smoothness,
    #[py("Skip" = 0)] skip: Option<&Bound<'_, PyAny>>,
    #[py("int" = 1)] threads: Option<&Bound<'_, PyAny>>,
    #[py("Executor | None" = None)] executor: Option<&Bound<'_, PyAny>>,
    #[py("Callable[[float, int], object] | None" = None)] progress: Option<Py<PyAny>>,
) -> PyResult<ManyIdentifications> {
    callable("progress", progress.as_ref().map(|progress| progress.bind(py)))?;
    let options =
        Options { dt: dt, thresholds: placed(thresholds, operators)?.unrefined(), smoothness: smoothness.0, ..options };
    let skip = match skip {
        None => 0,
        Some(skip) => duration("skip", skip, dt)?
            .ok_or_else(|| unexpected("skip", "a number of samples, or a time such as \"2s\"", skip))?,
    };
    let threads = threads.map_or(Ok(1), |threads| count("threads", threads))?;
    // A copy: other threads may change the arrays while the interpreter is let go.
    let signals = Signals::from_python(u, Y, skip)?;
    let mut watch = Watch::new(progress, signals.actuators());
    let Some(executor) = executor else {
        let records = signals.records()?;
        let found =
            py.detach(|| identification::identify_many(&records, &options, threads, &mut |done| watch.look(done)));
        let found = watch.unless_stopped(found)?;
        return Ok(ManyIdentifications::new(&found, dt));
    };
    let settled = {
        let records = signals.records()?;
        let settled =
            py.detach(|| identification::settled_options(&records, &options, threads, &mut |_| watch.look(0)));
        watch.unless_stopped(settled)?
    };
    let given = [
        ("dt", dt.map(|dt| dt.into_bound_py_any(py)).transpose()?),
        (
            "ratios",
            held(&options.ratios).map(|ratios| (ratios.ra, ratios.rb, ratios.rc).into_bound_py_any(py)).transpose()?,
        ),
        ("input_offset", held(&options.input_offset).map(|offset| offset.into_bound_py_any(py)).transpose()?),
        ("dead_time", held(&options.dead_time).map(|time| time.into_bound_py_any(py)).transpose()?),
        ("thresholds", thresholds.cloned()),
    ];
    let tasks = Tasks { executor, options: &settled, skip, threads };
    tasks.run(u, Y, signals.has_own_drives(), &given, &mut watch)
}

/// The value of a setting that is not searched for.
fn held<T: Copy>(setting: &Setting<T>) -> Option<T> {
    match setting {
        Setting::Fixed(value) => Some(*value),
        Setting::Fit => None,
    }
}

/// Drives and positions, one actuator after the other.
struct Signals {
    inputs: Vec<f64>,
    positions: Vec<f64>,
    samples: usize,
    own_drives: bool,
    skip: usize,
}

impl Signals {
    fn from_python(u: &Bound<'_, PyAny>, y: &Bound<'_, PyAny>, skip: usize) -> PyResult<Self> {
        let u = array::<IxDyn>("u", u, format_args!("an array of shape (samples,) or (samples, actuators)"))?;
        let y = array::<Ix2>("Y", y, format_args!("an array of shape (samples, actuators)"))?;
        let (samples, actuators) = (y.shape()[0], y.shape()[1]);
        let own_drives = match u.shape() {
            [_] => false,
            [_, _] => true,
            _ => {
                let expected = "an array of shape (samples,) or (samples, actuators)";
                return Err(errors::value("u", format_args!("expected {expected}, got {} dimensions", u.ndim())));
            }
        };
        if u.shape()[0] != samples || (own_drives && u.shape()[1] != actuators) {
            let expected = if own_drives {
                format!("an array of shape {:?}", (u.shape()[0], u.shape()[1]))
            } else {
                format!("an array of shape ({}, actuators)", u.shape()[0])
            };
            return Err(errors::value("Y", format_args!("expected {expected}, got shape {:?}", (samples, actuators))));
        }
        if actuators == 0 {
            return Err(errors::value("Y", "expected at least one actuator, got none"));
        }
        // Copies of both, and what the fits hold of one actuator each.
        check_room("Y", u.len().saturating_add(y.len()), 3 * size_of::<f64>())?;
        check_room("Y", samples, FIT)?;
        let inputs = u.as_array().t().iter().copied().collect();
        let positions = y.as_array().t().iter().copied().collect();
        Ok(Self { inputs, positions, samples, own_drives, skip })
    }

    fn actuators(&self) -> usize {
        self.positions.len() / self.samples.max(1)
    }

    fn has_own_drives(&self) -> bool {
        self.own_drives
    }

    fn records(&self) -> PyResult<ManyRecords<'_>> {
        let records: Result<_, RecordError> = if self.own_drives {
            ManyRecords::each(&self.inputs, &self.positions, self.samples, self.skip)
        } else {
            ManyRecords::shared(&self.inputs, &self.positions, self.skip)
        };
        records.map_err(|error| raise(record(error)))
    }
}

/// Tells Python how far the work is, and stops it on Ctrl-C or when the caller's function raises.
pub(super) struct Watch {
    progress: Option<Py<PyAny>>,
    actuators: usize,
    /// The number that was told last.
    told: Option<usize>,
    stopped_by: Option<PyErr>,
}

impl Watch {
    fn new(progress: Option<Py<PyAny>>, actuators: usize) -> Self {
        Self { progress, actuators, told: None, stopped_by: None }
    }

    #[expect(clippy::cast_precision_loss, reason = "a share")]
    pub(super) fn tell(&mut self, py: Python<'_>, done: usize) -> PyResult<()> {
        py.check_signals()?;
        if self.told.replace(done) == Some(done) {
            return Ok(());
        }
        let share = done as f64 / self.actuators as f64;
        self.progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (share, done)).map(drop))
    }

    fn look(&mut self, done: usize) -> ControlFlow<()> {
        match Python::attach(|py| self.tell(py, done)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.stopped_by = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    fn unless_stopped<T>(&mut self, found: Result<T, identification::Error>) -> PyResult<T> {
        match self.stopped_by.take() {
            Some(error) => Err(error),
            None => found.map_err(errors::identification),
        }
    }
}
