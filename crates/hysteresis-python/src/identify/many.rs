//! Identification of many actuators: arrays in, small results out.

use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use hysteresis_core::Ratios;
use hysteresis_identify::{
    self as identification, ManyRecords, ModelKind, Options, RatiosModel, RecordError, Setting, Thresholds, WeightLaw,
};
use hysteresis_python_macros::function;
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix2, IxDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};

use super::many_identifications::ManyIdentifications;
use super::options::{Operators, Placing, Smoothness, placed};
use super::records::{Skips, duration};
use super::watch::Watch;
use crate::argument::{Callable, Words};
use crate::convert::arrays::{FIT, array, check_room};
use crate::convert::errors::{self, raise, record, unexpected, wrong_type};
use crate::convert::objects::keywords;

/// Fits a model to each of many actuators: hysteresis and dead time, as `identify` does for one.
///
/// Driven alike (one u for all), actuators share what depends on the drive alone: where to start and the first step
/// take no pass over the operators. Each is then fitted by itself on all of its samples. The fit is as good as that of
/// `identify`; where several minima of the error are nearly as deep, it may be another one. Driven each by its own
/// drive, they get the very fit of `identify`.
///
/// All samples count: glitches are not looked for, as `identify` does with its `loss`. A position with glitches is
/// fitted badly.
///
/// Parameters
/// ----------
/// u : array of shape (samples,) or (samples, M)
///     The drive of all actuators (V), or one for each.
/// Y : array of shape (samples, M)
///     The measured positions (um), a column for each actuator.
/// dt : float, optional
///     Sampling interval in seconds. Without it dead times are in samples.
/// model, input_offset, dead_time, thresholds
///     As for `identify`, the same for all actuators.
/// ratios : "auto", "fit" or (ra, rb, rc)
///     Thresholds of the coupled plays as fractions of r, the same for all actuators. "auto" is "fit" here.
/// operators : int or "auto"
///     One number for all. It stays 20 where `identify` would double it.
/// weights : "auto", "free", "quadratic" or "split"
///     One law for all. "auto" asks the first, the middle and the last actuator that can be fitted, as `identify`
///     would, and takes the answer with the most unknowns; so it does with "auto" operators. Of a smoothness it takes
///     the middle one.
/// smoothness : float or "auto"
///     As for `identify`, one for all.
/// skip : int or str
///     Leading samples that set the memory but are not fitted, or a time such as "2s".
/// threads : int
///     So many share out the actuators. The result has the same bits for any number of threads.
/// executor : concurrent.futures.Executor, optional
///     Takes the actuators in groups of 256, each as a call of this function with `threads`. The same bits again.
///     Everything goes through pickle if it has processes.
/// progress : callable, optional
///     Called with (share done, actuators done). Ctrl-C stops either way; calls that an executor has begun run to their
///     end.
///
/// Returns
/// -------
/// ManyIdentifications
///     An actuator that cannot be fitted (a sample that is not finite, a position that never moves) has its reason in
///     `errors`, and takes nothing from the others.
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
    #[py(field = "modified")] model: ModelKind,
    #[py(= 20)] operators: Option<Operators>,
    #[py(field = "auto")] weights: WeightLaw,
    #[py(field = "auto")] ratios: RatiosModel,
    #[py(field = "fit")] input_offset: Setting<f64>,
    #[py(field = "fit")] dead_time: Setting<f64>,
    #[py(= None)] thresholds: Option<Placing>,
    #[py(field = "auto")] smoothness: Smoothness,
    #[py("Skip" = 0)] skip: Skips,
    #[py(= 1)] threads: NonZeroUsize,
    #[py("Executor | None" = None)] executor: Option<&Bound<'_, PyAny>>,
    #[py("Callable[[float, int], object] | None" = None)] progress: Option<Callable>,
) -> PyResult<ManyIdentifications> {
    let options = Options { dt, thresholds: placed(thresholds, operators)?.unrefined(), ..options };
    let skip = skip.0.bind(py);
    let skip = duration("skip", skip, dt)?
        .ok_or_else(|| unexpected("skip", "a number of samples, or a time such as \"2s\"", skip))?;
    // A copy: other threads may change the arrays while the interpreter is let go.
    let signals = Signals::from_python(u, Y, skip)?;
    let mut done = Done { watch: Watch::new(progress), actuators: signals.actuators(), told: None };
    let records = signals.records()?;
    let Some(executor) = executor else {
        let found = py
            .detach(|| identification::identify_many(&records, &options, threads.get(), &mut |count| done.look(count)));
        return Ok(ManyIdentifications::new(&done.unless_ended(found)?, dt));
    };
    let settled =
        py.detach(|| identification::settled_options(&records, &options, threads.get(), &mut |_| done.look(0)));
    let settled = done.unless_ended(settled)?;
    let keywords = keywords(py, &options, &settled, skip, threads)?;
    share_out(executor, (u, Y), signals.own_drives, &keywords, &mut done)
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

    fn records(&self) -> PyResult<ManyRecords<'_>> {
        let records: Result<_, RecordError> = if self.own_drives {
            ManyRecords::each(&self.inputs, &self.positions, self.samples, self.skip)
        } else {
            ManyRecords::shared(&self.inputs, &self.positions, self.skip)
        };
        records.map_err(|error| raise(record(error)))
    }
}

/// How many actuators are done, each number told once.
struct Done {
    watch: Watch,
    actuators: usize,
    /// The number that was told last.
    told: Option<usize>,
}

impl Done {
    #[expect(clippy::cast_precision_loss, reason = "a share")]
    fn tell(&mut self, py: Python<'_>, count: usize) -> PyResult<()> {
        py.check_signals()?;
        if self.told.replace(count) == Some(count) {
            return Ok(());
        }
        self.watch.tell(py, (count as f64 / self.actuators as f64, count))
    }

    fn look(&mut self, count: usize) -> ControlFlow<()> {
        let told = Python::attach(|py| self.tell(py, count));
        self.watch.goes_on(told)
    }

    fn unless_ended<T>(&mut self, found: Result<T, identification::Error>) -> PyResult<T> {
        self.watch.check()?;
        found.map_err(errors::identification)
    }
}

/// So many actuators are one call: enough to be worth the tables that they share, few enough to go round.
const GROUP: usize = 256;

/// Hands out all groups to the workers of an executor and puts their results together.
fn share_out<'py>(
    executor: &Bound<'py, PyAny>,
    (u, y): (&Bound<'py, PyAny>, &Bound<'py, PyAny>),
    own_drives: bool,
    keywords: &Bound<'py, PyDict>,
    done: &mut Done,
) -> PyResult<ManyIdentifications> {
    let py = u.py();
    let Ok(submit) = executor.getattr("submit") else {
        return Err(unexpected("executor", "an executor of concurrent.futures", executor));
    };
    let asarray = py.import("numpy")?.getattr("asarray")?;
    let (u, y) = (asarray.call1((u,))?, asarray.call1((y,))?);
    let function = py.import("mpi_hyst._core")?.getattr("identify_many")?;
    let actuators: usize = y.getattr("shape")?.get_item(1)?.extract()?;
    let mut futures = Vec::new();
    let outcome = (|| {
        for first in (0..actuators).step_by(GROUP) {
            let columns = group(&y, first, actuators)?;
            let drive = if own_drives { group(&u, first, actuators)? } else { u.clone() };
            futures.push(submit.call((&function, drive, columns), Some(keywords))?);
        }
        gather(&futures, done)
    })();
    if outcome.is_err() {
        for future in &futures {
            // What has begun runs to its end; the reason to stop is what counts.
            let _ = future.call_method0("cancel");
        }
    }
    outcome
}

/// What every call is told: the options as they were asked for, but what was chosen for all.
fn keywords<'py>(
    py: Python<'py>,
    asked: &Options,
    settled: &Options,
    skip: usize,
    threads: NonZeroUsize,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = keywords!(
        py,
        dt = asked.dt,
        model = asked.model.word(),
        weights = settled.weights.word(),
        skip = skip,
        threads = threads.get(),
    );
    match asked.ratios {
        RatiosModel::Fixed(Ratios { ra, rb, rc }) => keywords.set_item("ratios", (ra, rb, rc))?,
        RatiosModel::Auto | RatiosModel::Fit => keywords.set_item("ratios", "fit")?,
    }
    if let Setting::Fixed(offset) = asked.input_offset {
        keywords.set_item("input_offset", offset)?;
    }
    if let Setting::Fixed(seconds) = asked.dead_time {
        keywords.set_item("dead_time", seconds)?;
    }
    match settled.smoothness {
        Setting::Fixed(smoothness) => keywords.set_item("smoothness", smoothness)?,
        Setting::Fit => keywords.set_item("smoothness", "auto")?,
    }
    match &asked.thresholds {
        Thresholds::Given(thresholds) => keywords.set_item("thresholds", thresholds)?,
        Thresholds::Quantiles(_) | Thresholds::RefinedQuantiles | Thresholds::AutoQuantiles => {
            keywords.set_item("thresholds", "quantiles")?;
        }
        Thresholds::Geometric(_) | Thresholds::RefinedGeometric | Thresholds::AutoGeometric => {
            keywords.set_item("thresholds", "geometric")?;
        }
        Thresholds::Uniform(_) | Thresholds::Refined | Thresholds::Auto => {}
    }
    if settled.thresholds.are_counted_by_validation() {
        // Nothing could be fitted, so nothing was chosen.
        keywords.set_item("operators", "auto")?;
    } else {
        keywords.set_item("operators", settled.operators())?;
    }
    Ok(keywords)
}

/// The columns of the actuators from number `first` on.
fn group<'py>(values: &Bound<'py, PyAny>, first: usize, actuators: usize) -> PyResult<Bound<'py, PyAny>> {
    let py = values.py();
    let bound = |index: usize| isize::try_from(index).map_err(|_| wrong_type("Y", "expected fewer actuators"));
    let columns = PySlice::new(py, bound(first)?, bound((first + GROUP).min(actuators))?, 1);
    values.get_item((PySlice::full(py), columns))
}

/// The results in the order of the actuators.
fn gather(futures: &[Bound<'_, PyAny>], done: &mut Done) -> PyResult<ManyIdentifications> {
    let mut all: Option<ManyIdentifications> = None;
    for future in futures {
        let result = future.call_method0("result")?;
        let part = result.cast::<ManyIdentifications>()?.get();
        let together = match all.take() {
            None => part.clone(),
            Some(all) => all.followed_by(part),
        };
        done.tell(future.py(), together.len())?;
        all = Some(together);
    }
    all.ok_or_else(|| wrong_type("Y", "expected at least one actuator, got none"))
}
