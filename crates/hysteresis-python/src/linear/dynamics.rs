//! Linear dynamics from whatever describes them, and the objects that describe them.

use hysteresis_control::linear::{self, Dynamics, LinearDynamics, Section};
use hysteresis_python_macros::py;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use super::sections::{Antiresonance, FirstOrder, Modes, SecondOrder, StateSpace};
use crate::argument::Argument;
use crate::convert::errors::{self, raise, unexpected};

/// One of the classes of this package, if it is one.
fn own(value: &Bound<'_, PyAny>) -> Option<LinearDynamics> {
    if let Ok(resonance) = value.cast::<SecondOrder>() {
        Some(resonance.get().dynamics())
    } else if let Ok(lag) = value.cast::<FirstOrder>() {
        Some(lag.get().dynamics())
    } else if let Ok(pair) = value.cast::<Antiresonance>() {
        Some(pair.get().dynamics())
    } else if let Ok(modes) = value.cast::<Modes>() {
        Some(modes.get().dynamics())
    } else {
        value.cast::<StateSpace>().ok().map(|matrices| matrices.get().dynamics())
    }
}

/// Matrices or polynomials of another package (scipy.signal, control), in continuous time, if it has any.
fn foreign(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<LinearDynamics>> {
    let py = value.py();
    let dt = value.getattr_opt("dt")?.filter(|dt| !dt.is_none()).map(|dt| dt.extract::<f64>()).transpose()?;
    if let Some(dt) = dt.filter(|dt| *dt != 0.0) {
        let got = format!("dynamics that are sampled every {dt} s");
        return Err(errors::value(name, format_args!("expected dynamics in continuous time, got {got}")));
    }
    let flat = |attribute: &str| value.getattr(attribute)?.call_method0("ravel");
    let matrices = ["A", "B", "C", "D"];
    let made = if matrices.iter().all(|matrix| value.hasattr(*matrix).unwrap_or(false)) {
        let d = py.import(intern!(py, "numpy"))?.call_method1(intern!(py, "ravel"), (value.getattr("D")?,))?;
        if d.len()? != 1 {
            let shape = value.getattr("D")?.getattr("shape")?;
            let got = format!("dynamics whose D has the shape {shape}");
            return Err(errors::value(name, format_args!("expected one input and one output, got {got}")));
        }
        let arguments = (value.getattr("A")?, flat("B")?, flat("C")?, d.get_item(0)?);
        py.get_type::<StateSpace>().call1(arguments)?
    } else if value.hasattr("num")? && value.hasattr("den")? {
        let numpy = py.import(intern!(py, "numpy"))?;
        let polynomial = |attribute| numpy.call_method1(intern!(py, "ravel"), (value.getattr(attribute)?,));
        let make = py.get_type::<StateSpace>().getattr("from_transfer_function")?;
        make.call1((polynomial("num")?, polynomial("den")?))?
    } else if value.hasattr("to_ss")? {
        return foreign(name, &value.call_method0("to_ss")?);
    } else {
        return Ok(None);
    };
    Ok(own(&made))
}

/// Linear dynamics from an object, or from a sequence of objects in series.
pub(crate) fn linear_dynamics(name: &str, value: &Bound<'_, PyAny>) -> PyResult<LinearDynamics> {
    if let Some(dynamics) = own(value) {
        return Ok(dynamics);
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let mut all = LinearDynamics::none();
        for part in value.try_iter()? {
            all = all.then(linear_dynamics(name, &part?)?);
        }
        return Ok(all);
    }
    let expected = "FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list of them in series, or an object of \
                    scipy.signal or control";
    foreign(name, value)?.ok_or_else(|| unexpected(name, expected, value))
}

/// None is no dynamics.
#[py("Dynamics | None")]
impl Argument<'_> for LinearDynamics {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() { Ok(Self::none()) } else { linear_dynamics(name, value) }
    }
}

/// A lag from its cut-off frequency in Hz: an amplifier.
#[py("float")]
impl Argument<'_> for linear::FirstOrder {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let bandwidth = f64::from_argument(name, value)?;
        Self::new(bandwidth).map_err(|error| raise(error.renamed(name, bandwidth)))
    }
}

/// The object of a section.
fn section(py: Python<'_>, section: &Section) -> PyResult<Py<PyAny>> {
    match section {
        Section::FirstOrder(lag) => Ok(Py::new(py, FirstOrder(*lag))?.into_any()),
        Section::SecondOrder(resonance) => Ok(Py::new(py, SecondOrder(*resonance))?.into_any()),
        Section::Antiresonance(pair) => Ok(Py::new(py, Antiresonance(*pair))?.into_any()),
        Section::Modes(modes) => Ok(Py::new(py, Modes(modes.clone()))?.into_any()),
        Section::StateSpace(matrices) => Ok(Py::new(py, StateSpace(matrices.clone()))?.into_any()),
    }
}

/// What `linear_dynamics` takes: nothing, one object, or a tuple of them in series. The dead time is not part of it.
pub(crate) fn dynamics_object(py: Python<'_>, dynamics: &LinearDynamics) -> PyResult<Option<Py<PyAny>>> {
    match dynamics.sections() {
        [] => Ok(None),
        [one] => section(py, one).map(Some),
        several => {
            let parts = several.iter().map(|one| section(py, one)).collect::<PyResult<Vec<_>>>()?;
            Ok(Some(PyTuple::new(py, parts)?.into_any().unbind()))
        }
    }
}

/// A lag or a resonance as an object.
pub(crate) fn dynamics(py: Python<'_>, dynamics: Dynamics) -> PyResult<Py<PyAny>> {
    section(py, &dynamics.into())
}

/// Amplifier, dynamics and dead time in series.
pub(crate) fn in_series(
    amplifier: Option<linear::FirstOrder>,
    dynamics: LinearDynamics,
    dead_time: f64,
) -> PyResult<LinearDynamics> {
    let amplifier = amplifier.map_or_else(LinearDynamics::none, LinearDynamics::from);
    amplifier.then(dynamics).with_dead_time(dead_time).map_err(raise)
}
