//! How a running loop is asked to end: by another thread, or by a signal that would else end the program.

use hysteresis_python_macros::methods;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, Ordering};

use hysteresis_realtime::StopFlag;
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict, PyTuple};

use crate::argument::Class;

/// Asks a loop to go to rest and end, from any thread or handler of signals: given to `run` as `stop`.
///
/// It cannot be taken back: a loop that is given a flag which was requested before goes to rest at once. Ctrl-C, and
/// what else ends a loop from outside, requests it too.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh, threading
/// >>> stage = mh.paper.plant("A1").stage
/// >>> plant = mh.plant.Plant(stage, dt=1e-3)
/// >>> stop = mh.realtime.Stop()
/// >>> button = threading.Timer(0.1, stop.request)
/// >>> button.start()
/// >>> report = mh.realtime.run(stage, plant, [1.0], rest_drive=0.0, rest_rate=5e3, rate=1000, stop=stop)
/// >>> report.end, report.at_rest, stop.is_requested
/// ('requested', True, True)
#[pyclass(module = "mpi_hyst.realtime", frozen)]
#[derive(Default)]
pub(crate) struct Stop(pub(super) StopFlag);

impl Class for Stop {
    const CALLED: &'static str = "a Stop or None";
}

#[methods]
impl Stop {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Asks for the end.
    fn request(&self) {
        self.0.request();
    }

    /// Whether somebody asked for the end.
    #[getter]
    fn is_requested(&self) -> bool {
        self.0.is_requested()
    }

    fn __repr__(&self) -> &'static str {
        if self.0.is_requested() { "<Stop: requested>" } else { "<Stop: not requested>" }
    }

    /// Itself: a copy would stop nothing. It cannot be pickled, as its loop is one of this process.
    fn __deepcopy__<'py>(slf: Bound<'py, Self>, #[py("Any")] _memo: &Bound<'_, PyAny>) -> Bound<'py, Self> {
        slf
    }
}

/// Signals that end a program without a word. Where it has no handler of its own for them, they end the loop first.
const SIGNALS: [&str; 2] = ["SIGTERM", "SIGHUP"];

/// The handlers that were replaced, and the last signal that came meanwhile: 0 if none did.
pub(super) struct Signals<'py> {
    signal: Bound<'py, PyModule>,
    before: Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
    came: Arc<AtomicI32>,
}

impl<'py> Signals<'py> {
    /// Only the main thread of Python may have handlers.
    pub(super) fn end(py: Python<'py>, stop: &StopFlag) -> PyResult<Self> {
        let (threading, signal) = (py.import("threading")?, py.import("signal")?);
        let mut made = Self { signal, before: Vec::new(), came: Arc::default() };
        if !threading.call_method0("current_thread")?.is(&threading.call_method0("main_thread")?) {
            return Ok(made);
        }
        let (stop, came) = (stop.clone(), made.came.clone());
        let request = move |given: &Bound<'_, PyTuple>, _: Option<&Bound<'_, PyDict>>| -> PyResult<()> {
            stop.request();
            came.store(given.get_item(0)?.extract()?, Ordering::Relaxed);
            Ok(())
        };
        let handler = PyCFunction::new_closure(py, None, None, request)?;
        let default = made.signal.getattr("SIG_DFL")?;
        for name in SIGNALS {
            // Windows has no SIGHUP.
            let Some(number) = made.signal.getattr_opt(name)? else { continue };
            if made.signal.call_method1("getsignal", (&number,))?.eq(&default)? {
                let before = made.signal.call_method1("signal", (&number, &handler))?;
                made.before.push((number, before));
            }
        }
        Ok(made)
    }

    /// As it was before. A signal that came meanwhile then does what it would have done: it ends the program.
    pub(super) fn restore_and_pass_on(&mut self) -> PyResult<()> {
        let restored = self.restore();
        match self.came.swap(0, Ordering::Relaxed) {
            0 => restored,
            number => self.signal.call_method1("raise_signal", (number,)).map(drop),
        }
    }

    /// Every handler is restored, whatever another one raises.
    fn restore(&mut self) -> PyResult<()> {
        let restored = |(number, before): (Bound<'py, PyAny>, Bound<'py, PyAny>)| {
            let set = || self.signal.call_method1("signal", (&number, &before)).map(drop);
            // Python first runs the handlers of what has come. If one raises, as that of Ctrl-C does, it sets nothing.
            set().or_else(|error| set().and(Err(error)))
        };
        self.before.drain(..).map(restored).fold(Ok(()), PyResult::and)
    }
}

/// Also where not all of them could be replaced.
impl Drop for Signals<'_> {
    fn drop(&mut self) {
        // Nothing is left to do where it was called before; elsewhere another error is on its way.
        let _ = self.restore_and_pass_on();
    }
}
