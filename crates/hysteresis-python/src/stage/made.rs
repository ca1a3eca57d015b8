//! What is made from a stage: each method hands its parts to the class or function that makes it.

use pyo3::PyTypeCheck;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};

use super::object::Stage;
use crate::control::controller::HybridController;
use crate::control::iterative::IterativeLearning;
use crate::control::linear::part::dynamics_object;
use crate::control::linear::state_space::StateSpace;
use crate::control::observer::Observer;
use crate::control::preview::Preview;
use crate::control::repetitive::RepetitiveControl;
use crate::control::tuning::Tuning;
use crate::convert::arguments::{pair, samples};
use crate::convert::errors::{self, raise};
use crate::convert::pickling::keywords;
use crate::plant::plant::Plant;
use crate::plant::run::Run;

type Keywords<'a, 'py> = Option<&'a Bound<'py, PyDict>>;

/// References come this many samples earlier than the dead time asks for, with `feedforward="preview"`.
const PREVIEW_SAMPLES: f64 = 8.0;

/// Calls a class or function of the compiled module; what the user gave replaces what the stage gives.
fn make<'py, T>(
    name: &str,
    positional: Bound<'py, PyTuple>,
    given: &Bound<'py, PyDict>,
    user: Keywords<'_, 'py>,
) -> PyResult<Bound<'py, T>>
where
    T: PyTypeCheck,
{
    if let Some(user) = user {
        given.update(user.as_mapping())?;
    }
    let made = positional.py().import("mpi_hyst._core")?.getattr(name)?.call(positional, Some(given))?;
    Ok(made.cast_into::<T>()?)
}

/// What the stage says of its linear part, as the keywords of the functions that take it apart.
fn linear_part<'py>(py: Python<'py>, stage: &Stage) -> PyResult<Bound<'py, PyDict>> {
    let parts = stage.0.parts();
    let given = PyDict::new(py);
    given.set_item("dynamics", dynamics_object(py, &stage.0.linear_part().map_err(raise)?)?)?;
    given.set_item("dead_time", parts.dead_time)?;
    Ok(given)
}

/// The keywords of learning: the loop around the stage, tuned unless gains are given.
fn loop_keywords<'py>(slf: &Bound<'py, Stage>, dt: f64, user: Keywords<'_, 'py>) -> PyResult<Bound<'py, PyDict>> {
    let (py, stage) = (slf.py(), &slf.get().0);
    let given = linear_part(py, slf.get())?;
    given.set_item("dt", dt)?;
    given.set_item("slope", stage.feedback_loop(dt, 0.0, 0.0).map_err(raise)?.slope)?;
    let has = |name: &str| user.is_some_and(|user| user.contains(name).unwrap_or(false));
    if !(has("kp") && has("ki")) {
        let tuning = py.detach(|| stage.tune(dt, hysteresis_control::stage::PEAK_SENSITIVITY)).map_err(raise)?;
        given.set_item("kp", tuning.kp)?;
        given.set_item("ki", tuning.ki)?;
    }
    Ok(given)
}

#[pymethods]
impl Stage {
    /// A plant: the stage between converters, with the noise of its sensor. Keywords are those of `plant.Plant`.
    #[pyo3(signature = (dt, **keywords))]
    fn plant<'py>(
        slf: &Bound<'py, Self>,
        dt: f64,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Plant>> {
        let py = slf.py();
        make("Plant", (slf,).into_pyobject(py)?, &keywords!(py, dt = dt), keywords)
    }

    /// Gains of the feedback, robust for every slope of the hysteresis. Keywords are those of `control.tune`.
    #[pyo3(signature = (dt, **keywords))]
    fn tune<'py>(
        slf: &Bound<'py, Self>,
        dt: f64,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Tuning>> {
        let py = slf.py();
        make("tune", (slf,).into_pyobject(py)?, &keywords!(py, dt = dt), keywords)
    }

    /// The window of references that leads through the inverse of amplifier, modes and dead time sample by sample. Keywords
    /// are those of `control.preview`.
    #[pyo3(signature = (dt, ahead, **keywords))]
    fn preview<'py>(
        slf: &Bound<'py, Self>,
        dt: f64,
        ahead: &Bound<'py, PyAny>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Preview>> {
        let py = slf.py();
        let given = linear_part(py, slf.get())?;
        let dynamics = given.as_any().call_method1("pop", ("dynamics",))?;
        given.set_item("ahead", ahead)?;
        make("preview", (dynamics, dt).into_pyobject(py)?, &given, keywords)
    }

    /// A controller: feed-forward of the exact inverse, and feedback that is tuned unless `kp` and `ki` are given.
    ///
    /// Parameters
    /// ----------
    /// dt : float
    ///     Sampling interval in seconds.
    /// limits : (float, float), optional
    ///     Within those of the stage; by default `drive_range`.
    /// feedforward : "inverse", "preview" or "given"
    ///     The inverse of maps, hysteresis and creep; the same behind a preview through amplifier, modes and dead time; or
    ///     drives that come with every sample, from `precompensate`.
    /// ahead : int, optional
    ///     With a preview: how many samples early references come; by default the dead time and 8 samples.
    /// **keywords
    ///     Those of `control.HybridController`. The stage gives slew rate, start drive, and a range of measurements that can
    ///     be: one stroke beyond its positions on both sides.
    #[pyo3(signature = (dt, *, limits=None, feedforward="inverse", ahead=None, **keywords))]
    fn controller<'py>(
        slf: &Bound<'py, Self>,
        dt: f64,
        limits: Option<&Bound<'py, PyAny>>,
        feedforward: &str,
        ahead: Option<&Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, HybridController>> {
        let (py, stage) = (slf.py(), &slf.get().0);
        let limits = limits.map(|limits| pair("limits", limits)).transpose()?;
        let options = py.detach(|| stage.controller_options(dt, limits)).map_err(raise)?;
        let given = keywords!(
            py,
            kp = options.kp,
            ki = options.ki,
            dt = dt,
            limits = options.limits,
            slew = options.slew,
            start_drive = options.start_drive,
            measurement_range = options.measurement_range,
        );
        let inverse = || slf.call_method1("inverse", (dt, options.limits));
        let source = match feedforward {
            "inverse" => inverse()?,
            "preview" => {
                let ahead = match ahead {
                    Some(ahead) => samples("ahead", ahead)?,
                    None => default_ahead(stage.parts().dead_time, dt),
                };
                given.set_item("preview", slf.call_method1("preview", (dt, ahead))?)?;
                inverse()?
            }
            "given" => PyString::new(py, "given").into_any(),
            other => {
                let expected = "\"inverse\", \"preview\" or \"given\"";
                return Err(errors::value("feedforward", format_args!("expected {expected}, got \"{other}\"")));
            }
        };
        make("HybridController", (source,).into_pyobject(py)?, &given, keywords)
    }

    /// The position behind a noisy measurement. `drift`: how fast what the stage does not know may wander, per root of a
    /// second. Keywords are those of `control.Observer`.
    #[pyo3(signature = (dt, *, drift, **keywords))]
    fn observer<'py>(
        slf: &Bound<'py, Self>,
        dt: f64,
        drift: &Bound<'py, PyAny>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Observer>> {
        let py = slf.py();
        make("Observer", (slf,).into_pyobject(py)?, &keywords!(py, dt = dt, drift = drift), keywords)
    }

    /// Learning from recorded periods. `bandwidth` in Hz; gains are tuned unless given. Keywords are those of
    /// `control.IterativeLearning`.
    #[pyo3(signature = (target, dt, *, bandwidth, **keywords))]
    fn iterative_learning<'py>(
        slf: &Bound<'py, Self>,
        target: &Bound<'py, PyAny>,
        dt: f64,
        bandwidth: &Bound<'py, PyAny>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, IterativeLearning>> {
        let given = loop_keywords(slf, dt, keywords)?;
        given.set_item("bandwidth", bandwidth)?;
        make("IterativeLearning", (target,).into_pyobject(slf.py())?, &given, keywords)
    }

    /// Learning sample by sample. `period` in samples, `bandwidth` in Hz; gains are tuned unless given. Keywords are those of
    /// `control.RepetitiveControl`.
    #[pyo3(signature = (period, dt, *, bandwidth, **keywords))]
    fn repetitive_control<'py>(
        slf: &Bound<'py, Self>,
        period: &Bound<'py, PyAny>,
        dt: f64,
        bandwidth: &Bound<'py, PyAny>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, RepetitiveControl>> {
        let given = loop_keywords(slf, dt, keywords)?;
        given.set_item("bandwidth", bandwidth)?;
        make("RepetitiveControl", (period,).into_pyobject(slf.py())?, &given, keywords)
    }

    /// Simulates the closed loop along a reference: the controller of this stage around the plant of this stage, or of
    /// another one.
    ///
    /// Parameters
    /// ----------
    /// reference : array of n floats
    /// dt : float
    ///     Sampling interval in seconds.
    /// plant : Stage or plant.Plant, optional
    ///     The truth, if it is not this stage.
    /// seed : int
    ///     Of the noise of the sensor.
    /// **keywords
    ///     Those of `controller`.
    ///
    /// Returns
    /// -------
    /// plant.Run
    #[pyo3(signature = (reference, dt, *, plant=None, seed=None, **keywords),
        text_signature = "($self, reference, dt, *, plant=None, seed=0, **keywords)")]
    fn simulate<'py>(
        slf: &Bound<'py, Self>,
        reference: &Bound<'py, PyAny>,
        dt: f64,
        plant: Option<&Bound<'py, PyAny>>,
        seed: Option<&Bound<'py, PyAny>>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Run>> {
        let py = slf.py();
        let controller = slf.call_method("controller", (dt,), keywords)?;
        let truth = match plant {
            Some(plant) if plant.is_instance_of::<Plant>() => plant.clone(),
            other => {
                let stage = other.map_or(slf.as_any(), |stage| stage);
                stage.call_method("plant", (dt,), Some(&keywords!(py, seed = seed)))?
            }
        };
        make("simulate", (controller, truth, reference).into_pyobject(py)?, &PyDict::new(py), None)
    }

    /// Amplifier and modes in matrices, without the dead time: for Bode plots and other tools.
    #[getter]
    fn state_space(&self) -> PyResult<StateSpace> {
        Ok(StateSpace(self.0.linear_part().map_err(raise)?.state_space()))
    }

    /// The linear part as a StateSpace of the package control; the dead time as a Pade approximation of the given order.
    ///
    /// Raises ImportError if the package is not installed.
    #[pyo3(signature = (pade=4))]
    fn to_control<'py>(&self, py: Python<'py>, pade: u32) -> PyResult<Bound<'py, PyAny>> {
        let control = py.import("control")?;
        let matrices = Bound::new(py, self.state_space()?)?;
        let system = matrices.call_method0("to_control")?;
        let dead_time = self.0.parts().dead_time;
        if dead_time == 0.0 {
            return Ok(system);
        }
        let delay =
            control.getattr("tf")?.call1(control.call_method1("pade", (dead_time, pade))?.cast_into::<PyTuple>()?)?;
        control.call_method1("series", (control.call_method1("ss", (delay,))?, system))
    }

    /// Amplifier and modes as a scipy.signal.StateSpace, without the dead time.
    ///
    /// Raises ImportError if scipy is not installed.
    fn to_scipy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Bound::new(py, self.state_space()?)?.call_method0("to_scipy")
    }
}

/// The dead time in samples, and the window beyond it.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is checked then")]
fn default_ahead(dead_time: f64, dt: f64) -> usize {
    ((dead_time / dt).ceil() + PREVIEW_SAMPLES) as usize
}
