//! What an identification hands over: the model, its errors, and how far to trust it.

use hysteresis_control::linear::Dynamics;
use hysteresis_core::{DuhemForward, Ratios};
use hysteresis_identify::{self as identification, RecordError};
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyString;
use pythonize::pythonize;
use serde::{Deserialize, Serialize};

use super::diagnose::Finding;
use super::options::loop_shift_name;
use super::quality::{LeftOutLoop, Quality};
use super::records::{GivenRecords, Interval, Skips, check_place};
use crate::argument::Words;
use crate::convert::arrays::{matrix, read_only};
use crate::convert::errors::{self, raise, record, unexpected, warn};
use crate::linear::creep::Creep;
use crate::linear::dynamics::dynamics_object;
use crate::model::duhem::Duhem;
use crate::model::models::object;
use crate::stage::loop_shift::LoopShift;
use crate::stage::relaxing_plays::RelaxingPlays;
use crate::stage::slow_gain::SlowGain;
use crate::stage::stage::{Stage, points};

/// What `identify` found: the model, what follows it, and how well all of it fits.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=200)  # V
/// >>> y = mh.paper.table_1_recovered().forward().run(u)  # um
/// >>> found = mh.identify(u, y, dt=0.005, operators=12, input_offset=0.0, dead_time=0.0)
/// >>> found.fit.rmse_percent < 0.1, found.stage.drive_range
/// (True, (-500.0, 500.0))
#[pyclass(module = "mpi_hyst.results", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Identification {
    pub(super) found: identification::Identification,
    validations: Vec<identification::Quality>,
}

impl Identification {
    pub(crate) fn new(found: identification::Identification, validations: Vec<identification::Quality>) -> Self {
        Self { found, validations }
    }

    /// Whether the dead time is known to itself or to a sample. At its bound, zero, it has no error.
    fn tells_dead_time(&self) -> bool {
        let (value, error) =
            (self.found.dead_time.or(self.found.dead_time_samples), self.found.standard_errors.dead_time);
        let sample = self.found.dt.iter().copied().reduce(f64::max).unwrap_or(1.0);
        value.is_none_or(|value| value == 0.0 || error <= value.abs().max(sample))
    }
}

#[methods]
impl Identification {
    /// The hysteresis, with the output offset of the first record.
    #[getter]
    #[py(-> "Model")]
    fn model(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        object(py, self.found.model.clone())
    }

    /// The ratios (ra/r, rb/r, rc/r) of the thresholds; (1, 1, 1) for plays and for the conventional model.
    #[getter]
    fn ratios(&self) -> (f64, f64, f64) {
        let Ratios { ra, rb, rc } = self.found.ratios;
        (ra, rb, rc)
    }

    /// All of it as a stage, without limits and slew: what precompensation, controllers and plants are made from.
    ///
    /// A stage counts in seconds: of records without dt the dead time is left out, which `stage.identified["warnings"]`
    /// says.
    #[getter]
    fn stage(&self, py: Python<'_>) -> PyResult<Stage> {
        if let Some(samples) = self.found.left_out_dead_time() {
            warn(py, &format!("dead_time: {samples:.3} samples are not part of the stage: identify with dt"))?;
        }
        self.found.stage().map(Stage).map_err(raise)
    }

    /// The linear dynamics behind the hysteresis, of unit static gain, if there are any: FirstOrder or SecondOrder, or
    /// Modes if there are several.
    #[getter]
    #[py(-> "Lag | Modes | None")]
    fn dynamics(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        dynamics_object(py, &self.found.linear_dynamics())
    }

    /// The creep, if there is any.
    #[getter]
    fn creep(&self) -> Option<Creep> {
        self.found.creep.clone().map(Creep)
    }

    /// The loop shift, if there is one.
    #[getter]
    fn loop_shift(&self) -> Option<LoopShift> {
        self.found.loop_shift.map(LoopShift)
    }

    /// The plays that relax, if there are any. Thresholds and time constants of which none weighs anything are left
    /// out.
    #[getter]
    fn relaxing_plays(&self) -> Option<RelaxingPlays> {
        self.found.relaxing_plays.clone().map(RelaxingPlays)
    }

    /// The slow gain, if there is one.
    #[getter]
    fn slow_gain(&self) -> Option<SlowGain> {
        self.found.slow_gain.map(SlowGain)
    }

    /// The Duhem operator beside the plays, at rest, or None.
    #[getter]
    fn duhem(&self) -> Option<Duhem> {
        self.found.duhem().map(|duhem| Duhem(DuhemForward::new(duhem)))
    }

    /// What the output lags the input besides, in seconds; None for records without dt.
    #[getter]
    fn dead_time(&self) -> Option<f64> {
        self.found.dead_time
    }

    /// The same in samples; None for records of several sampling intervals.
    #[getter]
    fn dead_time_samples(&self) -> Option<f64> {
        self.found.dead_time_samples
    }

    /// How much later slow motion is seen: dead time and lag of the dynamics together, in seconds; in samples without
    /// dt.
    #[getter]
    fn lag(&self) -> f64 {
        self.found.lag
    }

    /// The sampling interval of every record in seconds; empty if there is none.
    #[getter]
    fn dt(&self) -> Vec<f64> {
        self.found.dt.clone()
    }

    /// The lowest and the highest input of all records.
    #[getter]
    fn drive_range(&self) -> (f64, f64) {
        self.found.drive_range
    }

    /// The lowest and the highest output of all fitted samples, ringing and noise included.
    ///
    /// What references may ask for is `stage.position_range`.
    #[getter]
    fn position_range(&self) -> (f64, f64) {
        self.found.position_range
    }

    /// Standard deviation of what is left, the root of the sum of squares over the degrees of freedom, in the unit of
    /// the output: noise of the sensor, and what the model lacks.
    #[getter]
    fn noise(&self) -> f64 {
        self.found.noise
    }

    /// Rms noise of the sensor, in the unit of the output: the white part of the residuals, from their second
    /// differences, of the record that has least of it. Where the model lacks something it is below `noise`.
    #[getter]
    fn sensor_noise(&self) -> f64 {
        self.found.sensor_noise()
    }

    /// The output offset of every record, in the unit of the output.
    #[getter]
    fn output_offsets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.output_offsets.iter().copied())
    }

    /// The errors over the fitted samples of all records.
    #[getter]
    fn fit(&self) -> Quality {
        self.found.fit.into()
    }

    /// The errors over the fitted samples of each record.
    #[getter]
    fn records(&self) -> Vec<Quality> {
        self.found.record_fits.iter().copied().map(Quality::from).collect()
    }

    /// The errors over all held-out samples, or None if none were held out.
    #[getter]
    fn validation(&self) -> Option<Quality> {
        let pooled = identification::Quality::pooled(&self.validations);
        (!self.validations.is_empty()).then(|| Quality::from(pooled))
    }

    /// The errors over the held-out samples of each record.
    #[getter]
    fn validation_records(&self) -> Vec<Quality> {
        self.validations.iter().copied().map(Quality::from).collect()
    }

    /// Standard errors of the weights w_i, read-only; NaN where the weight is zero.
    ///
    /// From the fit linearised in weights and searched parameters together. They allow for residuals that are
    /// correlated in time, and for creep and dynamics that are not in the model (docs/standard_errors.md). With
    /// smoothness they hold if the true weights are smooth: second differences that scatter about zero as the penalty
    /// says.
    #[getter]
    fn weights_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.standard_errors.weights.iter().copied())
    }

    /// Standard errors of the weights below zero, read-only: those of `weights_std` unless the weights are split.
    #[getter]
    fn weights_negative_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let errors = &self.found.standard_errors;
        let split = !errors.weights_negative.is_empty();
        read_only(py, if split { &errors.weights_negative } else { &errors.weights }.iter().copied())
    }

    /// Standard errors of the ratios: 0 where given and for plays, NaN where at a bound.
    #[getter]
    fn ratios_std(&self) -> (f64, f64, f64) {
        self.found.standard_errors.ratios.into()
    }

    /// Standard error of the input offset: 0 if it was given, and for plays.
    #[getter]
    fn input_offset_std(&self) -> f64 {
        self.found.standard_errors.input_offset
    }

    /// Standard error of the dead time, in the unit of `lag`: 0 if it was given or left out, NaN at a bound.
    #[getter]
    fn dead_time_std(&self) -> f64 {
        self.found.standard_errors.dead_time
    }

    /// Standard error of the lag, in its unit; NaN if a part of it lies at a bound or is not told.
    #[getter]
    fn lag_std(&self) -> f64 {
        self.found.standard_errors.lag
    }

    /// Standard error of the frequency of the dynamics in Hz, of several modes the first; 0 without any, NaN at a
    /// bound.
    #[getter]
    fn frequency_std(&self) -> f64 {
        self.found.standard_errors.frequency
    }

    /// Standard error of the damping ratio, of several modes that of the first; 0 without one, NaN at a bound.
    #[getter]
    fn damping_std(&self) -> f64 {
        self.found.standard_errors.damping
    }

    /// The searched amplitudes of creep: the share of a step per decade of log-type creep, from 0.1 s on and then
    /// below; else the share of every term.
    #[getter]
    fn creep_amplitudes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.creep_amplitudes.iter().copied())
    }

    /// Standard errors of `creep_amplitudes`.
    #[getter]
    fn creep_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.standard_errors.creep.iter().copied())
    }

    /// Standard errors of the amplitudes of the loop shift.
    #[getter]
    fn loop_shift_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.standard_errors.loop_shift.iter().copied())
    }

    /// Standard errors of the weights of relaxing plays, a row for every time constant; NaN for weights of 0.
    #[getter]
    fn relaxing_plays_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let errors = &self.found.standard_errors.relaxing_plays;
        matrix(py, errors, errors.first().map_or(0, Vec::len))
    }

    /// Standard errors of the amplitude of the slow gain and of its time constant in seconds; 0 for what was given.
    #[getter]
    fn slow_gain_std(&self) -> (f64, f64) {
        self.found.standard_errors.slow_gain.into()
    }

    /// The names of what was estimated, in the order of `covariance`.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.found.covariance.parameters.clone()
    }

    /// The covariance of `parameters`: what was given or lies at a bound is left out.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(PyArray2::from_vec2(py, &self.found.covariance.matrix)?)
    }

    /// By how much the weights miss the conditions (Karush, Kuhn, Tucker) of the best ones: rounding, 1e-13 or less.
    #[getter]
    fn kkt_residual(&self) -> f64 {
        self.found.kkt_residual
    }

    /// How many passes over the records the search took.
    #[getter]
    fn evaluations(&self) -> usize {
        self.found.evaluations
    }

    /// Whether the result deserves trust: "green", "amber" or "red", the worst of `warnings`.
    ///
    /// Amber: some numbers are doubtful, or another record would make the result better. Red: this is not the stage.
    #[getter]
    #[py(-> "Literal['green', 'amber', 'red']")]
    fn verdict(&self) -> &'static str {
        self.found.verdict().name()
    }

    /// What these records cannot tell and what the model left in them. docs/findings.md explains every code.
    #[getter]
    fn warnings(&self) -> Vec<Finding> {
        self.found.warnings.iter().cloned().map(Finding::from).collect()
    }

    /// The same result with what reading its records took for granted: a finding `assumed` for each sentence, before
    /// all others. The verdict counts them, and the stage keeps them.
    ///
    /// Parameters
    /// ----------
    /// sentences : list of str
    ///     As `mpi_hyst.io` has them: the doubtful ones of `record.assumed`.
    ///
    /// Returns
    /// -------
    /// Identification
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     For what is no list of str.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=200)
    /// >>> y = mh.paper.table_1_recovered().forward().run(u)
    /// >>> found = mh.identify(u, y, operators=12, input_offset=0.0, dead_time=0.0)
    /// >>> doubtful = found.assuming(["record.csv: no unit in 'pos': um is assumed"])
    /// >>> found.verdict, doubtful.verdict, doubtful.stage.identified["warnings"][0]["code"]
    /// ('green', 'amber', 'assumed')
    fn assuming(&self, #[py("Sequence[str]")] sentences: &Bound<'_, PyAny>) -> PyResult<Self> {
        let expected = "a list of str";
        if sentences.is_instance_of::<PyString>() {
            return Err(unexpected("sentences", expected, sentences));
        }
        let given: Vec<String> = sentences.extract().map_err(|_| unexpected("sentences", expected, sentences))?;
        Ok(Self { found: self.found.clone().assuming(given), validations: self.validations.clone() })
    }

    /// Whether Ctrl-C ended the search: the model is the best until then, its weights the best for its thresholds.
    #[getter]
    fn partial(&self) -> bool {
        self.found.partial
    }

    /// The output for the input `u` from the virgin state and at rest at its first value: through creep, dynamics and
    /// dead time. `u` is sampled every `dt` seconds, by default like the first record.
    ///
    /// `return_std=True` gives no band that holds the next record: it is the effect of noise on the fit alone. Then a
    /// pair is returned: the output, and the standard deviation of every sample of it. What the model lacks comes on
    /// top, often several times as much, and the noise of a measurement; `leave_one_loop_out` and a record that was not
    /// fitted tell these. The deviation follows from the covariance of all that was fitted, linearised at the fit; it
    /// allows for residuals that are correlated in time, like the standard errors. What was given and what lies at a
    /// bound (a weight of zero, a ratio at its limit) counts as known, and so does what the records do not tell at all:
    /// beyond the inputs that they reach, the truth may be further away: a UserWarning says so.
    ///
    /// `interval=0.95` gives a band that holds the next record: the output, and for every sample a lower and an upper
    /// bound within which a measured sample lies with that probability. It rests on loops held out in turn: on where
    /// the drive turned round last, where it is, how fast and for how long it has moved, and where nothing like it was
    /// recorded on what stages lack there by experience. The offset of the other record is apart, as every record has
    /// its own.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> import numpy as np
    /// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    /// >>> noise = np.random.default_rng(1).normal(0.0, 0.015, u.size)  # um
    /// >>> y = mh.paper.table_1_recovered().forward().run(u) + noise
    /// >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    /// >>> predicted, std = found.predict(u, return_std=True)
    /// >>> predicted.shape == std.shape == u.shape, bool(0 < std.max() < 0.015)
    /// (True, True)
    /// >>> predicted, low, high = found.predict(u, interval=0.95)
    /// >>> bool(((low < y) & (y < high)).mean() >= 0.93)
    /// True
    #[overload(
        "(self, u: ArrayLike, *, dt: float | None=None, return_std: Literal[False]=False, interval: None=None) -> Vector"
    )]
    #[overload(
        "(self, u: ArrayLike, *, dt: None=None, return_std: Literal[True], interval: None=None) -> tuple[Vector, Vector]"
    )]
    #[overload(
        "(self, u: ArrayLike, *, dt: float | None=None, return_std: Literal[False]=False, interval: float) -> tuple[Vector, Vector, Vector]"
    )]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        #[py(*, = None)] dt: Option<f64>,
        #[py(= false)] return_std: bool,
        #[py(= None)] interval: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        check_prediction(dt, return_std, interval)?;
        let input = u.as_slice()?;
        let array = |values: Result<Vec<f64>, RecordError>| {
            values.map(|values| PyArray1::from_vec(py, values)).map_err(|error| raise(record(error)))
        };
        let predicted = array(dt.map_or_else(|| self.found.predict(input), |dt| self.found.predict_at(input, dt)))?;
        if let Some(found) = self.found.extrapolation(input) {
            warn(py, &format!("u: {}", found.message))?;
        }
        if let Some(level) = interval {
            let dt = dt.or(self.found.dt.first().copied()).unwrap_or(1.0);
            let half = self.found.predict_interval(input, dt, level).map_err(raise)?;
            let bound = |sign: f64| -> PyResult<_> {
                let pairs =
                    predicted.readonly().as_slice()?.iter().zip(&half).map(|(y, half)| y + sign * half).collect();
                Ok(PyArray1::from_vec(py, pairs))
            };
            return Ok((predicted.clone(), bound(-1.0)?, bound(1.0)?).into_pyobject(py)?.into_any());
        }
        if !return_std {
            return Ok(predicted.into_any());
        }
        Ok((predicted, array(self.found.predict_std(input))?).into_pyobject(py)?.into_any())
    }

    /// Fits the weights anew without each loop of the records, and predicts the loop that was left out.
    ///
    /// A model that only remembers its records does worse there. All else stays as found. A
    /// loop leads from one maximum of the input to the next; maxima are those from which the input comes down by a
    /// twentieth of its range at least. What comes before the first maximum of a record belongs to its first loop, what
    /// comes after the last to its last. Of more than 200 loops, neighbours are left out together.
    ///
    /// Parameters
    /// ----------
    /// u, y : arrays of n floats
    ///     The samples that were fitted. Or, for several records, a list of (u, y) pairs alone.
    /// skip : int or list of int
    ///     Leading samples of each record that were not fitted, or a time.
    /// dt : float or list of float, optional
    ///     Sampling interval in seconds; by default that of the fitted records.
    ///
    /// Returns
    /// -------
    /// list of LeftOutLoop
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came; also for fewer than two loops.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    /// >>> y = mh.paper.table_1_recovered().forward().run(u)
    /// >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    /// >>> rows = found.leave_one_loop_out(u, y)
    /// >>> len(rows), rows[0].start, rows[0].fitted.rmse < rows[0].left_out.rmse
    /// (10, 0, True)
    fn leave_one_loop_out(
        &self,
        py: Python<'_>,
        #[py("ArrayLike | Sequence[tuple[ArrayLike, ArrayLike]]")] u: &Bound<'_, PyAny>,
        #[py("ArrayLike | None" = None)] y: Option<&Bound<'_, PyAny>>,
        #[py(*, = 0)] skip: Skips,
        #[py(= None)] dt: Option<Interval>,
    ) -> PyResult<Vec<LeftOutLoop>> {
        let given = GivenRecords::new(u, y, Some(&skip), dt, &self.found.dt)?;
        let records = given.records()?;
        let found = py.detach(|| self.found.leave_one_loop_out(&records));
        Ok(found.map_err(errors::identification)?.iter().map(LeftOutLoop::from).collect())
    }

    /// The modes of second-order dynamics from the lowest frequency up, each (frequency in Hz, damping ratio, gain);
    /// the gains sum to 1. Empty without such dynamics.
    #[getter]
    fn modes(&self) -> Vec<(f64, f64, f64)> {
        match (&self.found.modes, self.found.dynamics) {
            (Some(modes), _) => {
                let both = modes.modes().iter().zip(modes.gains());
                both.map(|(mode, gain)| (mode.frequency(), mode.damping(), *gain)).collect()
            }
            (None, Some(Dynamics::SecondOrder(mode))) => vec![(mode.frequency(), mode.damping(), 1.0)],
            (None, _) => Vec::new(),
        }
    }

    /// Standard errors of `modes`: of frequency, damping ratio and gain of each; a single mode has its gain of 1
    /// without error.
    #[getter]
    fn modes_std(&self) -> Vec<(f64, f64, f64)> {
        let errors = &self.found.standard_errors;
        match (&self.found.modes, self.found.dynamics) {
            (Some(_), _) => errors.modes.iter().map(|of_mode| (*of_mode).into()).collect(),
            (None, Some(Dynamics::SecondOrder(_))) => vec![(errors.frequency, errors.damping, 0.0)],
            (None, _) => Vec::new(),
        }
    }

    /// The bandwidth of the amplifier in front of the hysteresis in Hz, if one was found.
    #[getter]
    fn amplifier_bandwidth(&self) -> Option<f64> {
        self.found.amplifier().map(|amplifier| amplifier.frequency())
    }

    /// The points (x, y) of the map in front of the hysteresis, if there is one: drive in, drive out.
    #[getter]
    fn input_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.found.input_map().as_ref().map(points)
    }

    /// The points (x, y) of the map behind the hysteresis, if there is one: position in, position out.
    #[getter]
    fn output_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.found.output_map().as_ref().map(points)
    }

    /// The samples of each record that were taken for glitches and left out of the fit, counted from 0 with the skipped
    /// ones. They enter none of the errors of the fit.
    #[getter]
    fn left_out_samples(&self) -> Vec<Vec<usize>> {
        self.found.left_out_samples.clone()
    }

    /// Measured minus modelled output of a record, all its samples: (n,) in the unit of y.
    ///
    /// Parameters
    /// ----------
    /// u, y : arrays of n floats
    ///     Input and measured output.
    /// record : int, optional
    ///     The number of the record among those that were fitted, or whose beginning was: then its output offset
    ///     counts, and the creep that was under way when it began. Without it the record has those that suit it best.
    /// skip : int or str
    ///     Leading samples that do not count for what suits it best, or a time.
    /// dt : float, optional
    ///     Sampling interval in seconds; by default that of the record, and of the first one without `record`.
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    /// >>> y = mh.paper.table_1_recovered().forward().run(u)
    /// >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    /// >>> bool(abs((found.residuals(u, y, record=0) ** 2).mean() ** 0.5 - found.fit.rmse) < 1e-12)
    /// True
    fn residuals<'py>(
        &self,
        py: Python<'py>,
        #[py("ArrayLike")] u: &Bound<'py, PyAny>,
        #[py("ArrayLike")] y: &Bound<'py, PyAny>,
        #[py(*, = None)] record: Option<usize>,
        #[py("Skip" = 0)] skip: Skips,
        #[py("float | None" = None)] dt: Option<Interval>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        if let Some(place) = record {
            check_place(place, self.found.output_offsets.len())?;
        }
        let known = self.found.dt.get(record.unwrap_or(0)).or(self.found.dt.first());
        let given = GivenRecords::new(u, Some(y), Some(&skip), dt, known.map_or(&[], std::slice::from_ref))?;
        Ok(PyArray1::from_vec(py, self.found.residuals(&given.records()?[0], record)))
    }

    /// What cross-validation said of the numbers of operators that were tried: pairs (operators, error), the error the
    /// geometric mean of the rms errors on the stretches that were held out; empty where the number was given.
    #[getter]
    fn cross_validation(&self) -> Vec<(usize, f64)> {
        self.found.cross_validation.iter().map(|one| (one.operators, one.typical_error())).collect()
    }

    /// What the weights might be: as given, or as cross-validation chose.
    #[getter]
    #[py(-> "Literal['free', 'quadratic', 'split']")]
    fn weights_law(&self) -> &'static str {
        self.found.weights.word()
    }

    /// Which terms were tried, or not, and why, in the order of the search. A term may be there more than once: it is
    /// tried again when the model has changed. What cross-validation chose comes last. Keys:
    ///
    /// - term: its name;
    /// - beside: what the model had then of maps, slow gain, relaxing plays, creep of every decade, a lag in front; creep,
    ///   loop shift and operators name what of these and of the weights is beside them;
    /// - outcome: "better" if the search went on with it, else a word for why not, as "not_better" or "cannot_be_told";
    ///   the explanation of identification lists them;
    /// - judged_by: "held_out_error", the typical error on held-out stretches, or "evidence", the sum of squares in
    ///   variances of the noise;
    /// - gain: by which factor that error falls, or by how many variances that sum; None where nothing was judged;
    /// - needed: what it had to be; None where it was not tried.
    ///
    /// >>> import mpi_hyst as mh
    /// >>> u = mh.signals.triangle(5.0, 1.0, seconds=3.0, rate=200)
    /// >>> found = mh.identify(u, 0.2 * u + 0.001 * u * u, dt=0.005)
    /// >>> [one["term"] for one in found.terms_tried if one["outcome"] == "cannot_be_told"]
    /// ['loop shift', 'slow gain', 'relaxing plays']
    #[getter]
    #[py(-> "list[dict[str, Any]]")]
    fn terms_tried<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.found.terms_tried)?)
    }

    /// What cross-validation said of every weight law at the first number of operators: pairs (law, error) as in
    /// `cross_validation`; empty unless "auto". Where that was for the quadratic law, free weights may be taken later,
    /// with the number of operators.
    #[getter]
    #[py(-> "list[tuple[Literal['free', 'quadratic', 'split'], float]]")]
    fn weights_validation(&self) -> Vec<(&'static str, f64)> {
        self.found.weights_validation.iter().map(|one| (one.weights.word(), one.typical_error())).collect()
    }

    /// How smooth the weights were asked to be: as given, or as cross-validation chose.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.found.smoothness
    }

    /// What cross-validation said of the terms that may be left out: (number of amplitudes of creep, loop shift, error
    /// as in `cross_validation`), the best of every kind, the simplest first; empty if there was nothing to choose.
    #[getter]
    fn terms_validation(&self) -> Vec<(usize, String, f64)> {
        self.found
            .terms_validation
            .iter()
            .map(|one| (one.creep, loop_shift_name(one.loop_shift), one.typical_error()))
            .collect()
    }

    /// What cross-validation said of every smoothness: pairs (smoothness, error) as in `cross_validation`; empty unless
    /// "auto".
    #[getter]
    fn smoothness_validation(&self) -> Vec<(f64, f64)> {
        self.found.smoothness_validation.iter().map(|one| (one.smoothness, one.typical_error())).collect()
    }

    fn __repr__(&self) -> String {
        let partial = if self.found.partial { "partial, " } else { "" };
        let verdict = self.found.verdict().name();
        let dead_time = match (self.found.dead_time, self.found.dead_time_samples) {
            _ if !self.tells_dead_time() => "dead time not determined".to_owned(),
            (Some(seconds), _) => format!("dead time {seconds:.3e} s"),
            (None, Some(samples)) => format!("dead time {samples:.3} samples"),
            (None, None) => "several sampling intervals".to_owned(),
        };
        let modes = self.found.modes.as_ref().map_or_else(String::new, |modes| {
            let frequencies: Vec<_> = modes.modes().iter().map(|mode| format!("{:.1}", mode.frequency())).collect();
            format!("modes at {} Hz, ", frequencies.join(", "))
        });
        format!("<Identification: {verdict}, {partial}{modes}{dead_time}, fit {}>", self.fit().__repr__())
    }
}

/// The sampling interval of a prediction: above 0, and that of the first record where its standard deviation is asked
/// for.
fn check_prediction(dt: Option<f64>, return_std: bool, interval: Option<f64>) -> PyResult<()> {
    if let (true, Some(level)) = (return_std, interval) {
        return Err(errors::value("interval", format_args!("expected None beside return_std, got {level:?}")));
    }
    let Some(dt) = dt else { return Ok(()) };
    let expected = if return_std {
        "None beside return_std, which is for the sampling of the first record"
    } else if dt > 0.0 && dt.is_finite() {
        return Ok(());
    } else {
        "a finite number above 0"
    };
    Err(errors::value("dt", format_args!("expected {expected}, got {dt:?}")))
}
