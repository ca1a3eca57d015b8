//! What a controller may have beside feed-forward and feedback: observer, learning, gates of its measurements.

use hysteresis_control::learning;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use super::controller::HybridController;
use super::observer::Observer;
use super::repetitive::RepetitiveControl;
use crate::convert::errors::{self, raise};
use crate::convert::objects::{exclusive, shared};

impl HybridController {
    /// With copies of an observer before the feedback and of learning before the feed-forward.
    pub(crate) fn with_parts(
        mut self,
        py: Python<'_>,
        observer: Option<Py<Observer>>,
        repetitive: Option<Py<RepetitiveControl>>,
    ) -> PyResult<Self> {
        let observer = observer.map(|given| Py::new(py, shared(given.bind(py))?.clone())).transpose()?;
        let repetitive = repetitive.map(|given| Py::new(py, shared(given.bind(py))?.clone())).transpose()?;
        if let Some(own) = &observer {
            let copy = own.borrow(py).observer.clone();
            self.stage_controller = self.stage_controller.with_observer(copy).map_err(raise)?;
        }
        if let Some(own) = &repetitive {
            let copy = own.borrow(py).control.clone();
            self.stage_controller = self.stage_controller.with_repetitive(copy).map_err(raise)?;
        }
        (self.observer, self.repetitive) = (observer, repetitive);
        Ok(self)
    }
}

#[methods]
impl HybridController {
    /// The observer before the feedback, as a copy in its present state, or None. It has taken the present drive.
    #[getter]
    fn observer(&self, py: Python<'_>) -> Option<Observer> {
        let (made, now) = (self.observer.as_ref()?, self.stage_controller.observer()?);
        Some(Observer { observer: now.clone(), ..made.borrow(py).clone() })
    }

    /// Learning in the loop, as a copy in its present state, or None.
    #[getter]
    fn repetitive(&self, py: Python<'_>) -> Option<RepetitiveControl> {
        let (made, now) = (self.repetitive.as_ref()?, self.stage_controller.repetitive()?);
        Some(RepetitiveControl { control: now.clone(), ..made.borrow(py).clone() })
    }

    /// "learning"; "fading": what was learned goes to zero; "stopped": learning has diverged, and corrects nothing until
    /// `restart_learning` or `reset`. None without learning.
    #[getter]
    #[py(-> "LearningPhase | None")]
    fn learning_phase(&self) -> Option<&'static str> {
        self.stage_controller.repetitive().map(|repetitive| repetitive.phase().name())
    }

    /// How often learning has diverged: the error grew from period to period, on a stage that is too far from the model. It has stopped
    /// and faded out then.
    #[getter]
    fn divergence_count(&self) -> u64 {
        self.stage_controller.repetitive().map_or(0, learning::RepetitiveControl::divergence_count)
    }

    /// Lets learning begin anew: at once after it has stopped, else as soon as what was learned has faded out, so that nothing jumps.
    ///
    /// Raises ValueError for a controller that does not learn.
    fn restart_learning(slf: &Bound<'_, Self>) -> PyResult<()> {
        let learns = exclusive(slf)?.stage_controller.restart_learning();
        if learns { Ok(()) } else { Err(errors::value("repetitive", "expected a controller that learns, got None")) }
    }

    /// Measurements outside this range (low, high) count as missing; None without such a gate.
    #[getter]
    fn measurement_range(&self) -> Option<(f64, f64)> {
        self.controller().options().measurement_range
    }

    /// Measurements farther than this from the last good one count as missing; None without such a gate.
    #[getter]
    fn max_measurement_step(&self) -> Option<f64> {
        self.controller().options().max_measurement_step
    }
}
