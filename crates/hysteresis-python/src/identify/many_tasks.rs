//! Actuators shared out among the workers of an executor.

use hysteresis_identify::{ModelKind, Options, Setting};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice};

use super::many::Watch;
use super::many_result::ManyIdentifications;
use crate::argument::Words;
use crate::convert::errors::{unexpected, wrong_type};

/// So many actuators are one call: enough to be worth the tables that they share, few enough to go round.
const GROUP: usize = 256;

/// What every call is told.
pub(super) struct Tasks<'a, 'py> {
    pub(super) executor: &'a Bound<'py, PyAny>,
    /// With everything chosen.
    pub(super) options: &'a Options,
    pub(super) skip: usize,
    pub(super) threads: usize,
}

impl<'py> Tasks<'_, 'py> {
    /// Hands out all groups and puts their results together; `given` are the arguments that pass as they came.
    pub(super) fn run(
        &self,
        u: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
        own_drives: bool,
        given: &[(&str, Option<Bound<'py, PyAny>>)],
        watch: &mut Watch,
    ) -> PyResult<ManyIdentifications> {
        let py = u.py();
        let asarray = py.import("numpy")?.getattr("asarray")?;
        let (u, y) = (asarray.call1((u,))?, asarray.call1((y,))?);
        let function = py.import("mpi_hyst._core")?.getattr("identify_many")?;
        let keywords = self.keywords(py, given)?;
        let actuators: usize = y.getattr("shape")?.get_item(1)?.extract()?;
        let mut futures = Vec::new();
        let outcome = (|| {
            for first in (0..actuators).step_by(GROUP) {
                let columns = group(&y, first, actuators)?;
                let drive = if own_drives { group(&u, first, actuators)? } else { u.clone() };
                futures.push(self.submit((&function, drive, columns), &keywords)?);
            }
            gather(&futures, watch)
        })();
        if outcome.is_err() {
            for future in &futures {
                // What has begun runs to its end; the reason to stop is what counts.
                let _ = future.call_method0("cancel");
            }
        }
        outcome
    }

    fn submit(
        &self,
        arguments: (&Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>),
        keywords: &Bound<'py, PyDict>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let Ok(submit) = self.executor.getattr("submit") else {
            return Err(unexpected("executor", "an executor of concurrent.futures", self.executor));
        };
        submit.call(arguments, Some(keywords))
    }

    fn keywords(&self, py: Python<'py>, given: &[(&str, Option<Bound<'py, PyAny>>)]) -> PyResult<Bound<'py, PyDict>> {
        let keywords = PyDict::new(py);
        for (name, value) in given {
            if let Some(value) = value {
                keywords.set_item(name, value)?;
            }
        }
        keywords.set_item(
            "model",
            match self.options.model {
                ModelKind::Modified => "modified",
                ModelKind::Conventional => "conventional",
            },
        )?;
        if self.options.thresholds.are_counted_by_validation() {
            // Nothing could be fitted, so nothing was chosen.
            keywords.set_item("operators", "auto")?;
        } else {
            keywords.set_item("operators", self.options.operators())?;
        }
        keywords.set_item("weights", self.options.weights.word())?;
        match self.options.smoothness {
            Setting::Fixed(smoothness) => keywords.set_item("smoothness", smoothness)?,
            Setting::Fit => keywords.set_item("smoothness", "auto")?,
        }
        keywords.set_item("skip", self.skip)?;
        keywords.set_item("threads", self.threads)?;
        Ok(keywords)
    }
}

/// The columns of the actuators from number `first` on.
fn group<'py>(values: &Bound<'py, PyAny>, first: usize, actuators: usize) -> PyResult<Bound<'py, PyAny>> {
    let py = values.py();
    let bound = |index: usize| isize::try_from(index).map_err(|_| wrong_type("Y", "expected fewer actuators"));
    let columns = PySlice::new(py, bound(first)?, bound((first + GROUP).min(actuators))?, 1);
    values.get_item((PySlice::full(py), columns))
}

/// The results in the order of the actuators.
fn gather(futures: &[Bound<'_, PyAny>], watch: &mut Watch) -> PyResult<ManyIdentifications> {
    let mut all: Option<ManyIdentifications> = None;
    for future in futures {
        let result = future.call_method0("result")?;
        let part = result.cast::<ManyIdentifications>()?.get();
        let together = match all.take() {
            None => part.clone(),
            Some(all) => all.followed_by(part),
        };
        watch.tell(future.py(), together.len())?;
        all = Some(together);
    }
    all.ok_or_else(|| wrong_type("Y", "expected at least one actuator, got none"))
}
