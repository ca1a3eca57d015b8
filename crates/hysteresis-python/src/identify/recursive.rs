//! Recursive identification: one sample in, one prediction error out.

use hysteresis_control::linear::LinearDynamics;
use hysteresis_core::Model;
use hysteresis_identify::{self as identification, RecursiveOptions, Setting};
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};

use crate::argument::Class;
use crate::convert::errors::{self, raise, wrong_type};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, shared};
use crate::linear::dynamics::{dynamics_object, in_series};
use crate::model::models::object;

/// The weights of a model that follow a running actuator: recursive least squares with forgetting.
///
/// y(k) = output_offset + sum_i w_i z_i(k), y(k) read as u(k) is put out, z_i the operators of `model` at u -
/// input_offset: thresholds stay, weights and output offset are estimated, sample by sample, from the virgin state.
/// With forgetting = 1 the estimate is that of least squares over all samples (to 1e-13 um/V on the paper's actuator).
/// The weights of `.model` are the nearest to the estimate that are not negative, the identity weight at least 1e-6 of
/// the given one, so its inverse exists at every sample; `Inverse.set_model` takes it into a running inverse without a
/// jump of the drive.
///
/// Parameters
/// ----------
/// model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     Where to start; invertible.
/// forgetting : float
///     What a sample counts after the next one, from 0.5 to 1: the memory is 1 / (1 - forgetting) samples long.
/// output_offset : "fit" or float
///     Fit the offset of the sensor as one more unknown, starting from that of the model, or hold it at a value.
/// covariance : float
///     Variance of every unknown at the start, in units of the variance of the measurement noise; the unknowns are w_i
///     X and the output offset, X the largest threshold rounded up to a power of two. By default the samples alone
///     decide; with 1 the model counts as one sample of full range.
/// covariance_limit : float
///     The variance that forgetting may bring back where nothing is excited, in the same units.
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
///     What lies between the hysteresis and the measurement. Without any, y follows u at once.
/// dead_time : float
///     What y lags u besides, in seconds.
/// dt : float, optional
///     Sampling interval in seconds, which dynamics and dead time need.
///
/// Raises
/// ------
/// NotInvertibleError, ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> plant = mh.paper.table_1_recovered().forward()
/// >>> identifier = mh.RecursiveIdentifier(mh.paper.table_1(), forgetting=0.999)
/// >>> for u in mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=1000):
/// ...     error = identifier.update(u, plant.step(u))
/// >>> bool(abs(identifier.model.weights - mh.paper.table_1_recovered().weights).max() < 1e-7)
/// True
/// >>> abs(error) < 1e-9, identifier.frozen  # the drive has died out
/// (True, 'poor_excitation')
#[pyclass(module = "mpi_hyst")]
pub(crate) struct RecursiveIdentifier(pub(crate) identification::RecursiveIdentifier);

impl Class for RecursiveIdentifier {
    const CALLED: &'static str = "a mh.RecursiveIdentifier";
}

#[methods]
impl RecursiveIdentifier {
    #[new]
    #[gather(options: RecursiveOptions, put_options)]
    fn new(
        model: Model,
        #[py(*, field = 1.0)] forgetting: f64,
        #[py(field = "fit")] output_offset: Setting<f64>,
        #[py(field = 1e12)] covariance: f64,
        #[py(field = 1e4)] covariance_limit: f64,
        #[py(= None)] dynamics: LinearDynamics,
        #[py(= 0.0)] dead_time: f64,
        #[py(= None)] dt: Option<f64>,
    ) -> PyResult<Self> {
        let dynamics = match (in_series(None, dynamics, dead_time)?, dt) {
            (none, _) if none == LinearDynamics::none() => None,
            (dynamics, Some(dt)) => Some((dynamics, dt)),
            (_, None) => {
                return Err(wrong_type("dt", "expected the sampling interval in seconds beside dynamics, got None"));
            }
        };
        let options = RecursiveOptions { dynamics, ..options };
        identification::RecursiveIdentifier::new(&model, &options).map(Self).map_err(raise)
    }

    /// Takes the input u and the output y read as u is put out; the prediction error: y minus what `model` predicted
    /// before.
    ///
    /// A sample that is not finite changes no weight and gives the last error again; a good u moves the operators all
    /// the same.
    fn update(slf: &Bound<'_, Self>, u: f64, y: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.0.update(u, y))
    }

    /// Takes over the drives before, oldest first: operators and dynamics move, nothing is learned.
    fn follow(slf: &Bound<'_, Self>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.0.follow(drives.as_slice()?).map_err(raise)
    }

    /// The model as of the last sample: the given one with other weights and output offset.
    #[getter]
    #[py(-> "Model")]
    fn model(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        object(py, self.0.model())
    }

    /// Why the last sample changed no weight: None if it did, else one word.
    ///
    /// "poor_excitation": it says less than forgetting would lose, as at standstill (its leverage z'Pz is below
    /// 1.25 (1 - forgetting)); nothing is forgotten meanwhile. "not_finite": input or output is NaN, infinite or beyond
    /// 1e100.
    #[getter]
    #[py(-> "Literal['poor_excitation', 'not_finite'] | None")]
    fn frozen(&self) -> Option<&'static str> {
        self.0.frozen().map(identification::Frozen::name)
    }

    /// How many samples were not finite, or beyond 1e100.
    #[getter]
    fn rejected(&self) -> u64 {
        self.0.rejected()
    }

    /// What a sample counts after the next one.
    #[getter]
    fn forgetting(&self) -> f64 {
        self.0.options().forgetting
    }

    /// The covariance of the estimate: a matrix over the weights, then the output offset if it is fitted.
    ///
    /// Of a split model the w_i come first, then the v_i, but for an identity that weighs the same on both sides.
    ///
    /// In units of the variance of the measurement noise: times that, the diagonal is the variance of each.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let m = self.0.unknowns();
        PyArray1::from_vec(py, self.0.covariance()).reshape([m, m])
    }

    /// Back to the given model, the operators at rest.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.0.reset();
        Ok(())
    }

    /// Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.0.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let wrong = |error| errors::value("state", format_args!("expected what .state returned; {error}"));
        let state = depythonize(state).map_err(wrong)?;
        exclusive(slf)?.0.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let options = this.0.options();
        let keywords = keywords!(py);
        Self::put_options(options, &keywords)?;
        if let Some((dynamics, dt)) = &options.dynamics {
            keywords.set_item("dynamics", dynamics_object(py, dynamics)?)?;
            keywords.set_item("dead_time", dynamics.dead_time())?;
            keywords.set_item("dt", dt)?;
        }
        let model = object(py, this.0.given().clone())?;
        reduce(py.get_type::<Self>().into_any(), (model,), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let frozen = self.frozen().map_or(String::new(), |reason| format!(", frozen: {reason}"));
        format!("<RecursiveIdentifier of {} unknowns, forgetting {}{frozen}>", self.0.unknowns(), self.forgetting())
    }
}
