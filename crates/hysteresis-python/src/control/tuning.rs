//! Gains and filters for a plant: how they are found, what they are, and what they make over frequency.

use hysteresis_control::linear::{FirstOrder, LinearDynamics};
use hysteresis_control::stage::{self, PEAK_SENSITIVITY, Stage, StageParts};
use hysteresis_control::tuning::{self, LoopFamily, Structure, TuningOptions};
use hysteresis_python_macros::{copies, function, methods};
use numpy::{Complex64, PyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};
use pythonize::{depythonize, pythonize};
use serde::{Deserialize, Serialize};

use crate::argument::{Argument, Asked, Class};
use crate::control::filters::as_objects;
use crate::convert::arguments::{unknown, word};
use crate::convert::arrays;
use crate::convert::errors::{raise, value, wrong_type};
use crate::convert::objects::{Reduced, keywords, reduce, shared};
use crate::plant::plant::Plant;
use crate::stage::stage::{is_nothing, stage_or_around};

/// Filters and gains of the feedback, and how robust the loop is with them: made by `tune`.
///
/// Gains belong to their filters: without them a lightly damped stage may become unstable. `open_loop`, `sensitivity`,
/// `complementary_sensitivity` and `worst_sensitivity` give the loop over frequency, `mpi_hyst.plot.tuning` draws it,
/// and `explanation` says in words what was chosen and why.
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

impl Class for Tuning {
    const CALLED: &'static str = "a Tuning, as mh.control.tune and stage.tune give";
}

/// What a family makes of frequencies and a slope.
type Response = fn(&LoopFamily, &[f64], f64) -> Result<Vec<Complex64>, hysteresis_core::Error>;

impl Tuning {
    pub(crate) fn of(stage: Stage, options: TuningOptions) -> Result<Self, stage::Error> {
        Ok(Self { made: stage.tune_with(&options)?, stage, options })
    }

    /// Gains and filters, if they are for a stage and a sampling interval: with others the loop may be unstable.
    pub(crate) fn of_stage(&self, stage: &Stage, dt: f64) -> PyResult<tuning::Tuning> {
        if self.options.dt.to_bits() != dt.to_bits() {
            return Err(value(
                "tuning",
                format_args!("expected one for dt = {dt:?}, got one for {:?}", self.options.dt),
            ));
        }
        if self.stage != *stage {
            return Err(value("tuning", "expected one of this stage, as `tune` of it gives, got one of another stage"));
        }
        Ok(self.made.clone())
    }

    fn family(&self) -> PyResult<LoopFamily> {
        self.stage.loop_family(&self.options, &self.made).map_err(raise)
    }

    /// At a slope that was given, or the greatest one.
    fn response<'py>(
        &self,
        frequencies: &Bound<'py, PyAny>,
        slope: Option<f64>,
        of: Response,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
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

    /// "proportional-integral" without filters; "low-pass", which keeps the loop away from a resonance; "active
    /// damping", a low-pass behind which a negative kp damps; "notch", for those lightly damped modes that need one.
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

    /// Up to which frequency in Hz disturbances are reduced to 1/sqrt(2) at least, for all slopes and modes that may
    /// be.
    #[getter]
    fn rejection_bandwidth(&self) -> f64 {
        self.made.rejection_bandwidth
    }

    /// The bandwidth in Hz of white noise of the sensor that the position follows, where the hysteresis has its
    /// greatest slope.
    #[getter]
    fn noise_bandwidth(&self) -> f64 {
        self.made.noise_bandwidth
    }

    /// What was tried, and roughly the ki of the best of its kind: why the structure was chosen. Empty without lightly
    /// damped modes.
    #[getter]
    fn tried(&self) -> Vec<(&'static str, f64)> {
        self.made.tried.iter().map(|(structure, ki)| (structure.name(), *ki)).collect()
    }

    /// In a few sentences: which structure was chosen and why, the bound on the sensitivity, crossover, margins and
    /// bandwidths.
    #[getter]
    fn explanation(&self) -> String {
        self.made.explanation(&self.options)
    }

    /// The open loop L(f) as complex numbers, with the modes as they are known.
    ///
    /// L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z) at z = exp(2 pi i f dt), with filters F and the sampled dynamics P,
    /// dead time included.
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
        #[py(= None)] slope: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        self.response(frequencies, slope, LoopFamily::open_loop)
    }

    /// The sensitivity S = 1 / (1 + L), what the loop leaves of a disturbance: arguments as for `open_loop`.
    #[like(open_loop)]
    fn sensitivity<'py>(&self) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        self.response(frequencies, slope, LoopFamily::sensitivity)
    }

    /// The complementary sensitivity T = L / (1 + L), what the feedback follows of a reference and of noise: arguments
    /// as for `open_loop`.
    #[like(open_loop)]
    fn complementary_sensitivity<'py>(&self) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        self.response(frequencies, slope, LoopFamily::complementary_sensitivity)
    }

    /// The greatest abs(S) over all slopes of the hysteresis and all modes that may be: nowhere above
    /// `peak_sensitivity`.
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
#[copies(tuning::Margins)]
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

/// What is asked of a tuning.
pub(crate) struct Demands {
    pub(crate) peak_sensitivity: f64,
    pub(crate) frequency_uncertainty: Option<f64>,
    pub(crate) damping_uncertainty: Option<f64>,
    pub(crate) structure: Option<Structure>,
}

impl Default for Demands {
    fn default() -> Self {
        Self {
            peak_sensitivity: PEAK_SENSITIVITY,
            frequency_uncertainty: None,
            damping_uncertainty: None,
            structure: None,
        }
    }
}

impl Demands {
    pub(crate) fn tune(self, py: Python<'_>, stage: Stage, dt: f64) -> PyResult<Tuning> {
        let mut options = stage.tuning_options(dt, self.peak_sensitivity).map_err(raise)?;
        let uncertainty = &mut options.uncertainty;
        uncertainty.frequency = self.frequency_uncertainty.unwrap_or(uncertainty.frequency);
        uncertainty.damping = self.damping_uncertainty.unwrap_or(uncertainty.damping);
        options.structure = self.structure;
        py.detach(|| Tuning::of(stage, options)).map_err(raise)
    }
}

impl Argument<'_> for Structure {
    fn from_argument(name: &'static str, structure: &Bound<'_, PyAny>) -> PyResult<Self> {
        let [names @ .., last] = Self::ALL.map(|structure| format!("{:?}", structure.name()));
        let expected = format!("{} or {last}", names.join(", "));
        let got = word(name, &expected, structure)?;
        let found = Self::ALL.into_iter().find(|structure| structure.name() == got);
        found.map_or_else(|| unknown(name, &expected, &got), Ok)
    }
}

/// Filters and gains of the proportional-integral feedback for a hysteresis with dynamics behind it.
///
/// The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z): the positional law kp e + ki sum(e) behind filters F, the
/// slope of the hysteresis, which lies between those of `model.slope_range`, and P the exact pulse transfer function of
/// amplifier, dynamics and dead time for an input that is held from one measurement to the next. Of all gains with
///
/// abs(1 / (1 + L)) <= peak_sensitivity at all frequencies and slopes, and the loop stable,
///
/// those with the greatest ki are taken: a constant disturbance is removed with the integrated error 1 / ki (Åström,
/// Panagopoulos and Hägglund, Automatica 34(5), 1998). Parts slower than 1e5 samples a radian and damping ratios below
/// 1e-7 are refused: their response does not show at the frequencies that are looked at.
///
/// Without modes of a damping ratio below 0.5 there are no filters. With some, no filter, low-passes and notches are
/// tried, each with the gains that suit it, and the bound holds for frequencies 5 % either way and for half to twice
/// the damping, unless other uncertainties are given. Of those whose ki is within 5 % of the greatest the simplest is
/// taken, unless a structure is given. Give a controller the filters with their gains.
///
/// Parameters
/// ----------
/// stage : Stage, Plant, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     A model with the keywords `dynamics`, `amplifier_bandwidth` and `dead_time` makes a stage; a plant has one.
/// dt : float
///     Sampling interval in seconds; a plant has its own.
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, or a list of them in series, optional
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     What the sensor shows later than the dynamics explain, in seconds, at most 1000 samples.
/// peak_sensitivity : float
///     1.05 to 5: 1.2 is cautious, 2 is bold. The gain may grow by M / (M - 1), the phase lag by 2 arcsin(1 / (2 M)).
/// frequency_uncertainty : float, optional
///     How far the frequencies of lightly damped modes may be from what is known: a share either way, 0 to 0.5, each by
///     itself, so that neighbours may come together or move apart. By default 0.05, or three standard errors of the
///     identification where they are more.
/// damping_uncertainty : float, optional
///     By which factor their damping may be less or more, 1 to 100, the same for all. By default 2, or what three
///     standard errors make of it.
/// structure : "proportional-integral", "low-pass", "active damping" or "notch", optional
///     The only one that is admitted; all but the first need a lightly damped mode.
///
/// Returns
/// -------
/// Tuning
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> tuning = mh.control.tune(mh.paper.table_1_recovered(), dt=1e-4, dynamics=mh.plant.SecondOrder(400.0, 0.95))
/// >>> round(tuning.kp), round(tuning.ki, -3), round(tuning.peak_sensitivity, 3)
/// (185, 358000.0, 1.7)
/// >>> mh.control.tune(mh.paper.plant("A1")).kp == tuning.kp
/// True
/// >>> tuning.at_max_slope
/// <Margins at slope 0.007919: gain margin 6.521, phase margin 47.1 degrees, crossover 408.658 Hz, peak sensitivity 1.700>
/// >>> flexure = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
/// >>> tuning = flexure.tune(1e-4)
/// >>> tuning.structure, tuning.rejection_bandwidth > 80.0  # Hz; gains alone allow a few
/// ('notch', True)
/// >>> plain = flexure.tune(1e-4, structure="proportional-integral")
/// >>> plain.filters, plain.rejection_bandwidth < 10.0
/// ((), True)
/// >>> flexure.tune(1e-4, frequency_uncertainty=0.01).ki > tuning.ki  # the mode is better known
/// True
#[function]
#[gather(demands: Demands)]
pub(crate) fn tune(
    py: Python<'_>,
    #[py("Model | Stage | Plant")] stage: &Bound<'_, PyAny>,
    #[py(*, = None)] dt: Option<f64>,
    #[py(field = 1.7)] peak_sensitivity: f64,
    #[py(= None)] dynamics: LinearDynamics,
    #[py(= None)] amplifier_bandwidth: Option<FirstOrder>,
    #[py(= 0.0)] dead_time: Asked<f64>,
    #[py(field = None)] frequency_uncertainty: Option<f64>,
    #[py(field = None)] damping_uncertainty: Option<f64>,
    #[py(field, "Structure | None" = None)] structure: Option<Structure>,
) -> PyResult<Tuning> {
    let parts = StageParts { dynamics, amplifier: amplifier_bandwidth, ..StageParts::default() };
    let (stage, dt) = match (stage.cast::<Plant>(), dt) {
        (Ok(plant), None) if is_nothing(&parts, dead_time) => {
            (shared(plant)?.plant.stage().clone(), shared(plant)?.plant.dt())
        }
        (Ok(_), _) => {
            return Err(wrong_type(
                "stage",
                "expected a stage or model beside other keywords, got a Plant, which has its own",
            ));
        }
        (Err(_), Some(dt)) => (stage_or_around("stage", stage, parts, dead_time)?, dt),
        (Err(_), None) => return Err(wrong_type("dt", "expected the sampling interval in seconds, got None")),
    };
    demands.tune(py, stage, dt)
}
