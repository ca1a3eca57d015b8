//! What a temperature adds to the position of a stage.

use hysteresis_control::stage;
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::argument::Argument;
use crate::control::filters::Filter;
use crate::convert::errors::{raise, unexpected, value};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

/// What a second, slow input adds to the position of a stage: the temperature T, or any other.
///
/// y = stage(u) + sensitivity (theta - reference);
/// theta' = (T - theta) / time_constant.
///
/// Everything that runs a stage is at the reference. So the term is added behind a forward model, and taken from the
/// target of an inverse: in two lines, sample by sample. Sampled, theta(k) = a theta(k-1) + (1 - a) T(k) with a =
/// exp(-dt / time_constant).
///
/// Parameters
/// ----------
/// sensitivity : float
///     kappa, in the unit of the position per kelvin.
/// time_constant : float
///     tau in seconds: how much later the part that expands has the temperature; 0 is no lag.
/// reference : float
///     The temperature at which nothing is added.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// A gauge that drifts by 0.02 kg per kelvin, a minute late. Loads of its readings:
///
/// >>> import mpi_hyst as mh
/// >>> term = mh.plant.TemperatureTerm(0.02, time_constant=60.0, reference=20.0)
/// >>> gauge = mh.Stage(mh.PrandtlIshlinskii([1.0, 0.01], [0.0, 5.0]), temperature=term)
/// >>> inverse, lag = gauge.inverse(1.0), term.lag(1.0)
/// >>> lag.settle(30.0)  # it has been at 30 degrees for long
/// >>> round(inverse.step(4.2 - term.at(lag.step(30.0))), 6)
/// 4.0
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct TemperatureTerm(pub(crate) stage::TemperatureTerm);

#[methods]
impl TemperatureTerm {
    #[new]
    fn new(sensitivity: f64, time_constant: f64, reference: f64) -> PyResult<Self> {
        stage::TemperatureTerm::new(sensitivity, time_constant, reference).map(Self).map_err(raise)
    }

    /// kappa, in the unit of the position per kelvin.
    #[getter]
    fn sensitivity(&self) -> f64 {
        self.0.sensitivity()
    }

    /// tau in seconds.
    #[getter]
    fn time_constant(&self) -> f64 {
        self.0.time_constant()
    }

    /// The temperature at which nothing is added.
    #[getter]
    fn reference(&self) -> f64 {
        self.0.reference()
    }

    /// The lag from T to theta, sampled every `dt` seconds, at rest at the reference: `settle` it where it begins
    /// elsewhere.
    fn lag(&self, dt: f64) -> PyResult<Filter> {
        self.0.lag(dt).map(|filter| Filter::of(filter, dt)).map_err(raise)
    }

    /// What is added at theta, in the unit of the position.
    fn at(&self, theta: f64) -> PyResult<f64> {
        Ok(self.0.at(theta))
    }

    /// What is added along temperatures, sampled every `dt` seconds, that were at their first value for long.
    fn response<'py>(
        &self,
        py: Python<'py>,
        temperature: PyReadonlyArray1<'py, f64>,
        dt: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let added = self.0.response(temperature.as_slice()?, dt);
        added.map(|added| PyArray1::from_vec(py, added)).map_err(raise)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        hash([self.sensitivity(), self.time_constant(), self.reference()].into_iter())
    }

    fn __repr__(&self) -> String {
        format!(
            "TemperatureTerm(sensitivity={:?}, time_constant={:?}, reference={:?})",
            self.sensitivity(),
            self.time_constant(),
            self.reference()
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arguments = (self.sensitivity(), self.time_constant(), self.reference());
        reduce(py.get_type::<Self>().into_any(), arguments, keywords!(py), None)
    }
}

/// What a term, if there is one, adds along temperatures, one for each of so many samples.
pub(crate) fn added(
    term: Option<&stage::TemperatureTerm>,
    temperature: &[f64],
    samples: usize,
    dt: f64,
) -> PyResult<Vec<f64>> {
    let Some(term) = term else {
        return Err(value("temperature", "expected None for what has no temperature term, got an array"));
    };
    if temperature.len() != samples {
        let got = temperature.len();
        return Err(value("temperature", format_args!("expected {samples} samples, got {got}")));
    }
    term.response(temperature, dt).map_err(raise)
}

impl Argument<'_> for stage::TemperatureTerm {
    fn from_argument(name: &'static str, given: &Bound<'_, PyAny>) -> PyResult<Self> {
        given
            .cast::<TemperatureTerm>()
            .map(|term| term.get().0)
            .map_err(|_| unexpected(name, "a TemperatureTerm", given))
    }
}
