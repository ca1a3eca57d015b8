//! What a tuning is, and what it makes over frequency.

use hysteresis_control::stage::{self, Stage};
use hysteresis_control::tuning::{self, LoopFamily, TuningOptions};
use hysteresis_python_macros::methods;
use numpy::{Complex64, PyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};
use pythonize::{depythonize, pythonize};
use serde::{Deserialize, Serialize};

use super::filters::as_objects;
use crate::convert::arguments::numbers;
use crate::convert::arrays;
use crate::convert::errors::raise;
use crate::convert::pickling::{Reduced, keywords, reduce};

/// Filters and gains of the feedback, and how robust the loop is with them: made by `tune`.
///
/// Gains belong to their filters: without them a lightly damped stage may become unstable. `open_loop`, `sensitivity`,
/// `complementary_sensitivity` and `worst_sensitivity` give the loop over frequency, `mpi_hyst.plot.tuning` draws it, and `explanation`
/// says in words what was chosen and why.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95))
/// >>> tuning = stage.tune(dt=1e-4)
/// >>> tuning.ki > 0.0, tuning.peak_sensitivity <= 1.7
/// (True, True)
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Tuning {
    made: tuning::Tuning,
    /// For which stage, and what was asked for.
    stage: Stage,
    options: TuningOptions,
}

/// What a family makes of frequencies and a slope.
type Response = fn(&LoopFamily, &[f64], f64) -> Result<Vec<Complex64>, hysteresis_core::Error>;

impl Tuning {
    pub(crate) fn of(stage: Stage, options: TuningOptions) -> Result<Self, stage::Error> {
        Ok(Self { made: stage.tune_with(&options)?, stage, options })
    }

    fn family(&self) -> PyResult<LoopFamily> {
        self.stage.loop_family(&self.options, &self.made).map_err(raise)
    }

    /// At a slope that was given, or the greatest one.
    fn response<'py>(
        &self,
        frequencies: &Bound<'py, PyAny>,
        slope: Option<&Bound<'py, PyAny>>,
        of: Response,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        numbers!(slope);
        let numbers = arrays::numbers("frequencies", frequencies)?;
        let slope = slope.unwrap_or(self.options.slopes.1);
        let values = of(&self.family()?, &numbers, slope).map_err(raise)?;
        Ok(PyArray1::from_vec(frequencies.py(), values))
    }
}

#[methods]
impl Tuning {
    /// Proportional gain (V/um); negative for active damping.
    #[getter]
    fn kp(&self) -> f64 {
        self.made.kp
    }

    /// Integral gain (V/um/s).
    #[getter]
    fn ki(&self) -> f64 {
        self.made.ki
    }

    /// The sampling interval in seconds for which it is.
    #[getter]
    fn dt(&self) -> f64 {
        self.options.dt
    }

    /// The filters before both gains: Notch, LowPass.
    #[getter]
    #[py(-> "tuple[AnyFilter, ...]")]
    fn filters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        as_objects(py, &self.made.filters)
    }

    /// "proportional-integral" without filters; "low-pass", which keeps the loop away from a resonance; "active damping", a low-pass
    /// behind which a negative kp damps; "notch", for those lightly damped modes that need one.
    #[getter]
    #[py(-> "Structure")]
    fn structure(&self) -> &'static str {
        self.made.structure.name()
    }

    /// The margins where the hysteresis has its smallest slope, with the modes as they are known.
    #[getter]
    fn at_min_slope(&self) -> Margins {
        self.made.at_min_slope.into()
    }

    /// The margins where it has its greatest slope.
    #[getter]
    fn at_max_slope(&self) -> Margins {
        self.made.at_max_slope.into()
    }

    /// The peak of the sensitivity over all slopes between and all modes that may be.
    #[getter]
    fn peak_sensitivity(&self) -> f64 {
        self.made.peak_sensitivity
    }

    /// The peak of the sensitivity that was allowed.
    #[getter]
    fn peak_sensitivity_limit(&self) -> f64 {
        self.options.peak_sensitivity
    }

    /// Up to which frequency in Hz disturbances are reduced to 1/sqrt(2) at least, for all slopes and modes that may be.
    #[getter]
    fn rejection_bandwidth(&self) -> f64 {
        self.made.rejection_bandwidth
    }

    /// The bandwidth in Hz of white noise of the sensor that the position follows, where the hysteresis has its greatest slope.
    #[getter]
    fn noise_bandwidth(&self) -> f64 {
        self.made.noise_bandwidth
    }

    /// What was tried, and roughly the ki of the best of its kind: why the structure was chosen. Empty without lightly damped modes.
    #[getter]
    fn tried(&self) -> Vec<(&'static str, f64)> {
        self.made.tried.iter().map(|(structure, ki)| (structure.name(), *ki)).collect()
    }

    /// In a few sentences: which structure was chosen and why, the bound on the sensitivity, crossover, margins and bandwidths.
    #[getter]
    fn explanation(&self) -> String {
        self.made.explanation(&self.options)
    }

    /// The open loop L(f) as complex numbers, with the modes as they are known.
    ///
    /// L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z) at z = exp(2 pi i f dt), with filters F and the sampled dynamics P, dead time included.
    ///
    /// Parameters
    /// ----------
    /// frequencies : array of n floats
    ///     In Hz, above 0 and at most half of the sampling rate.
    /// slope : float, optional
    ///     The slope of the hysteresis (um/V); by default the greatest, `at_max_slope.slope`.
    ///
    /// Returns
    /// -------
    /// array of n complex numbers
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> tuning = mh.control.tune(mh.paper.plant("A1"))
    /// >>> round(float(abs(tuning.open_loop([tuning.at_max_slope.crossover])[0])), 9)
    /// 1.0
    fn open_loop<'py>(
        &self,
        #[py("ArrayLike")] frequencies: &Bound<'py, PyAny>,
        #[py("float | None" = None)] slope: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        self.response(frequencies, slope, LoopFamily::open_loop)
    }

    /// The sensitivity S = 1 / (1 + L), what the loop leaves of a disturbance: arguments as for `open_loop`.
    fn sensitivity<'py>(
        &self,
        #[py("ArrayLike")] frequencies: &Bound<'py, PyAny>,
        #[py("float | None" = None)] slope: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        self.response(frequencies, slope, LoopFamily::sensitivity)
    }

    /// The complementary sensitivity T = L / (1 + L), what the feedback follows of a reference and of noise: arguments as for
    /// `open_loop`.
    fn complementary_sensitivity<'py>(
        &self,
        #[py("ArrayLike")] frequencies: &Bound<'py, PyAny>,
        #[py("float | None" = None)] slope: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        self.response(frequencies, slope, LoopFamily::complementary_sensitivity)
    }

    /// The greatest abs(S) over all slopes of the hysteresis and all modes that may be: nowhere above `peak_sensitivity`.
    ///
    /// Frequencies are as for `open_loop`.
    fn worst_sensitivity<'py>(
        &self,
        #[py("ArrayLike")] frequencies: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let numbers = arrays::numbers("frequencies", frequencies)?;
        let worst = self.family()?.worst_sensitivity(&numbers).map_err(raise)?;
        Ok(PyArray1::from_vec(frequencies.py(), worst))
    }

    fn __repr__(&self) -> String {
        let tuning::Tuning { kp, ki, at_min_slope, at_max_slope, peak_sensitivity, .. } = &self.made;
        let (low, high) = (at_min_slope.crossover, at_max_slope.crossover);
        let (low, high) = (low.min(high), low.max(high));
        let loops = format!("crossover {low:.3} to {high:.3} Hz, peak sensitivity {peak_sensitivity:.3}");
        let structure = if self.made.filters.is_empty() { String::new() } else { format!("{}, ", self.structure()) };
        format!("<Tuning: {structure}kp {kp:.6}, ki {ki:.6}, {loops}>")
    }

    #[classmethod]
    fn _restored(
        _: &Bound<'_, PyType>,
        made: &Bound<'_, PyAny>,
        options: &Bound<'_, PyAny>,
        stage: &str,
    ) -> PyResult<Self> {
        let stage = Stage::from_json(stage).map_err(raise)?;
        Ok(Self { made: depythonize(made)?, stage, options: depythonize(options)? })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
        let values = (pythonize(py, &self.made)?, pythonize(py, &self.options)?, self.stage.to_json());
        reduce(make, values, keywords!(py), None)
    }
}

/// How robust a loop is at one slope of the hysteresis.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95))
/// >>> margins = stage.tune(dt=1e-4).at_max_slope
/// >>> margins.phase_margin > 30.0, margins.peak_sensitivity <= 1.7  # degrees
/// (True, True)
#[pyclass(module = "mpi_hyst.control", frozen, get_all, skip_from_py_object)]
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Margins {
    /// The slope (um/V).
    slope: f64,
    /// The factor by which the gain may grow until the loop oscillates; infinite if it never does.
    gain_margin: f64,
    /// How many degrees the phase may lag more, the least over all frequencies with abs(L) = 1.
    phase_margin: f64,
    /// The highest frequency in Hz with abs(L) = 1.
    crossover: f64,
    /// The peak of the sensitivity abs(1 / (1 + L)).
    peak_sensitivity: f64,
    /// Where that peak is, in Hz.
    peak_frequency: f64,
}

impl From<tuning::Margins> for Margins {
    fn from(made: tuning::Margins) -> Self {
        let tuning::Margins { slope, gain_margin, phase_margin, crossover, peak_sensitivity, peak_frequency } = made;
        Self { slope, gain_margin, phase_margin, crossover, peak_sensitivity, peak_frequency }
    }
}

#[methods]
impl Margins {
    fn __repr__(&self) -> String {
        let Self { slope, gain_margin, phase_margin, crossover, peak_sensitivity, .. } = self;
        let margins = format!("gain margin {gain_margin:.3}, phase margin {phase_margin:.1} degrees");
        format!(
            "<Margins at slope {slope:.6}: {margins}, crossover {crossover:.3} Hz, peak sensitivity {peak_sensitivity:.3}>"
        )
    }
}
