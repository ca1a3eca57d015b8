//! Identification: arguments in, a model and its errors out.

use std::ops::ControlFlow;

use hysteresis_core::Ratios;
use hysteresis_identify::{self as identification, Error, Options, Progress, Record, Setting};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{read_only, vector};
use crate::errors;
use crate::identify_arguments::{form, law, law_name, placed, setting, smooth};
use crate::models;
use crate::records::{HeldOut, signals, skips};

/// The errors of a fit, each with its unit or base.
///
/// `max_error` and `rmse` are in the unit of the output, `mse` in its square; the percentages are of `range`, the
/// peak-to-peak of the measured output over the fitted samples.
#[pyclass(module = "mpi_hyst", frozen, get_all)]
pub(crate) struct Quality {
    /// Largest absolute error, in the unit of the output.
    max_error: f64,
    /// Root mean square error, in the unit of the output.
    rmse: f64,
    /// Mean square error, in the unit of the output squared.
    mse: f64,
    /// Peak-to-peak of the measured output over the fitted samples: the base of the percentages.
    range: f64,
    /// Largest absolute error in % of range.
    max_error_percent: f64,
    /// Root mean square error in % of range.
    rmse_percent: f64,
    /// How many samples were fitted.
    samples: usize,
}

impl From<&identification::Quality> for Quality {
    fn from(quality: &identification::Quality) -> Self {
        let identification::Quality { max_error, rmse, mse, range, max_error_percent, rmse_percent, samples, .. } =
            *quality;
        Self { max_error, rmse, mse, range, max_error_percent, rmse_percent, samples }
    }
}

#[pymethods]
impl Quality {
    pub(crate) fn __repr__(&self) -> String {
        format!(
            "<Quality: max {:.4e} ({:.3} %), rms {:.4e} ({:.3} %) of range {:.4e}, {} samples>",
            self.max_error, self.max_error_percent, self.rmse, self.rmse_percent, self.range, self.samples
        )
    }
}

/// What `identify` found: the model, its delay, and how well it fits.
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct Identification {
    found: identification::Identification,
    validations: Vec<identification::Quality>,
}

#[pymethods]
impl Identification {
    /// The model, with the output offset of the first record.
    #[getter]
    fn model(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        models::object(py, self.found.model.clone())
    }

    /// The ratios (ra/r, rb/r, rc/r) of the thresholds; (1, 1, 1) for the conventional model.
    #[getter]
    fn ratios(&self) -> (f64, f64, f64) {
        let Ratios { ra, rb, rc } = self.found.ratios;
        (ra, rb, rc)
    }

    /// By how many samples the output lags the input, fractions included.
    #[getter]
    fn delay(&self) -> f64 {
        self.found.delay
    }

    /// The output offset of every record, in the unit of the output.
    #[getter]
    fn output_offsets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.output_offsets.iter().copied())
    }

    /// The errors over the fitted samples of all records.
    #[getter]
    fn fit(&self) -> Quality {
        Quality::from(&self.found.fit)
    }

    /// The errors over the fitted samples of each record.
    #[getter]
    fn records(&self) -> Vec<Quality> {
        self.found.record_fits.iter().map(Quality::from).collect()
    }

    /// The errors over all held-out samples, or None if none were held out.
    #[getter]
    fn validation(&self) -> Option<Quality> {
        let pooled = identification::Quality::pooled(&self.validations);
        (!self.validations.is_empty()).then(|| Quality::from(&pooled))
    }

    /// The errors over the held-out samples of each record.
    #[getter]
    fn validation_records(&self) -> Vec<Quality> {
        self.validations.iter().map(Quality::from).collect()
    }

    /// Standard errors of the weights w_i, read-only; NaN where the weight is zero.
    ///
    /// From the fit linearised in weights and searched parameters together, errors of samples taken as independent.
    /// With smoothness they take the penalty for knowledge: second differences that scatter about zero as it says.
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

    /// Standard errors of the ratios: 0 where given, NaN where at a bound.
    #[getter]
    fn ratios_std(&self) -> (f64, f64, f64) {
        self.found.standard_errors.ratios.into()
    }

    /// Standard error of the input offset: 0 if it was given.
    #[getter]
    fn input_offset_std(&self) -> f64 {
        self.found.standard_errors.input_offset
    }

    /// Standard error of the delay in samples: 0 if it was given, NaN at a bound.
    #[getter]
    fn delay_std(&self) -> f64 {
        self.found.standard_errors.delay
    }

    /// What cross-validation said of every number of operators: pairs (operators, rms error); empty unless "auto".
    #[getter]
    fn cross_validation(&self) -> Vec<(usize, f64)> {
        self.found.cross_validation.iter().map(|one| (one.operators, one.rmse)).collect()
    }

    /// What the weights might be: as given, or as cross-validation chose.
    #[getter]
    fn weights_law(&self) -> &'static str {
        law_name(self.found.weights)
    }

    /// What cross-validation said of every weight law: pairs (law, rms error); empty unless "auto".
    #[getter]
    fn weights_validation(&self) -> Vec<(&'static str, f64)> {
        self.found.weights_validation.iter().map(|one| (law_name(one.weights), one.rmse)).collect()
    }

    /// How smooth the weights were asked to be: as given, or as cross-validation chose.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.found.smoothness
    }

    /// What cross-validation said of every smoothness: pairs (smoothness, rms error); empty unless "auto".
    #[getter]
    fn smoothness_validation(&self) -> Vec<(f64, f64)> {
        self.found.smoothness_validation.iter().map(|one| (one.smoothness, one.rmse)).collect()
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

    /// The output for the input `u` from the virgin state, delayed as the records were.
    fn predict<'py>(&self, py: Python<'py>, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let predicted = self.found.predict(vector("u", u)?.as_slice()?);
        predicted.map(|y| PyArray1::from_vec(py, y)).map_err(|error| PyValueError::new_err(named(&error.to_string())))
    }

    fn __repr__(&self) -> String {
        format!("<Identification: delay {:.3} samples, fit {}>", self.found.delay, self.fit().__repr__())
    }
}

/// Fits a model to measured records.
///
/// y(k) = output_offset + sum_i w_i z_i(k - delay), z_i the operators at u - input_offset. Weights are non-negative
/// least squares, exact at every step of a search over ratios, input offset and delay. Every record starts from the
/// virgin state and has its own output offset.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and measured output (um). Or, for several records in one fit, a list of (u, y) pairs as the only
///     argument.
/// model : "modified" or "conventional"
///     Coupled plays, or plays for comparison.
/// weights : "auto", "free", "quadratic" or "split"
///     Any w_i >= 0; or w_0 >= 0 and w_i = c0 + c1 i + c2 i^2 >= 0; or weights of their own below zero, which only the
///     modified model has. "auto" takes the first of quadratic, free and split that predicts held-out stretches of the
///     records as well as the best, within the standard error of the ratio of their mean squares.
/// operators : int or "auto"
///     How many: 20 unless thresholds are given. With uniform thresholds r_i = i X / n; the first is the identity.
///     "auto" takes the fewest that predict held-out stretches of the records as well as any; every stretch is predicted
///     from weights, offsets, ratios and delay fitted to the others (the searched ones linearised about those of all).
/// ratios : "fit" or (ra, rb, rc)
///     Thresholds as fractions of r.
/// input_offset : "fit" or float
///     In the unit of u. The conventional model fixes it at the middle of the input range.
/// delay : "fit" or float
///     Samples by which y lags u, fractions included.
/// thresholds : "uniform", "quantiles" or array, optional
///     The r_i: evenly spaced, at quantiles of the amplitudes at which u turns round, or given.
/// smoothness : float or "auto"
///     Adds smoothness U D to the sum of squared errors: U the sum of squares of u about its mean, D that of the second
///     differences w_(i-1) - 2 w_i + w_(i+1), i >= 1, of each family (of weights per threshold interval, divided, where
///     thresholds are uneven). A number without unit: 1 weighs such a difference like an error of the slope w_0.
///     "auto" takes of 0 and the decades 1e-6 to 100 the one that predicts held-out stretches best.
/// skip : int or list of int
///     Leading samples of each record that set the memory but are not fitted.
/// validate : (u, y), (u, y, skip), a list of these, or float, optional
///     Records that are held out, each judged with the output offset that suits it; or the share at the end of every
///     record that is held out, judged with the record's own offset.
/// progress : callable, optional
///     Called with (fraction done, best rms error so far). Ctrl-C stops either way.
///
/// Returns
/// -------
/// Identification
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> actuator = mh.paper.table_1_recovered()
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=1000)
/// >>> found = mh.identify(u, actuator.forward().run(u), input_offset=0.0, delay=0.0)
/// >>> [round(ratio, 4) for ratio in found.ratios]
/// [0.95, 0.3, 0.35]
#[pyfunction]
#[pyo3(signature = (u, y=None, *, model="modified", weights="auto", operators=None, ratios=None, input_offset=None, delay=None, thresholds=None, smoothness=None, skip=None, validate=None, progress=None),
    text_signature = "(u, y=None, *, model='modified', weights='auto', operators=None, ratios='fit', input_offset='fit', delay='fit', thresholds=None, smoothness=0.0, skip=0, validate=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "one per keyword of the Python function")]
pub(crate) fn identify(
    py: Python<'_>,
    u: &Bound<'_, PyAny>,
    y: Option<&Bound<'_, PyAny>>,
    model: &str,
    weights: &str,
    operators: Option<&Bound<'_, PyAny>>,
    ratios: Option<&Bound<'_, PyAny>>,
    input_offset: Option<&Bound<'_, PyAny>>,
    delay: Option<&Bound<'_, PyAny>>,
    thresholds: Option<&Bound<'_, PyAny>>,
    smoothness: Option<&Bound<'_, PyAny>>,
    skip: Option<&Bound<'_, PyAny>>,
    validate: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Identification> {
    let options = Options {
        form: form(model)?,
        weights: law(weights)?,
        thresholds: placed(thresholds, operators)?,
        ratios: match setting::<(f64, f64, f64)>("ratios", "three numbers (ra, rb, rc)", ratios)? {
            Setting::Fixed((ra, rb, rc)) => Setting::Fixed(Ratios { ra, rb, rc }),
            Setting::Fit => Setting::Fit,
        },
        input_offset: setting("input_offset", "a number", input_offset)?,
        delay: setting("delay", "a number", delay)?,
        smoothness: smooth(smoothness)?,
    };
    // A copy: other threads may change the arrays while the interpreter is let go.
    let signals = signals(u, y)?;
    let skips = skips(skip, signals.len())?;
    let held_out = validate.map(HeldOut::from_python).transpose()?;
    let mut records = Vec::with_capacity(signals.len());
    for (i, ((u, y), skip)) in signals.iter().zip(skips).enumerate() {
        // Unequal lengths are for the record to name.
        let cut = held_out.as_ref().filter(|_| u.len() == y.len()).map(|held_out| held_out.begins(u.len()));
        let record = Record::new(&u[..cut.unwrap_or(u.len())], &y[..cut.unwrap_or(y.len())], skip);
        records.push(record.map_err(|error| {
            invalid(&if signals.len() > 1 { error.in_record(i).to_string() } else { error.to_string() })
        })?);
    }
    let validations = held_out.as_ref().map_or(Ok(Vec::new()), |held_out| held_out.records(&signals))?;
    let mut stopped_by = None;
    let found = py.detach(|| {
        identification::identify(&records, &options, &mut |now| match report(now, progress.as_ref()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                stopped_by = Some(error);
                ControlFlow::Break(())
            }
        })
    });
    match (found, stopped_by) {
        (_, Some(error)) => Err(error),
        (Ok(found), None) => {
            let own_offset = |i: usize| matches!(held_out, Some(HeldOut::Share(_))).then(|| found.output_offsets[i]);
            let validate = |(i, record): (usize, &Record<'_>)| found.validate(record, own_offset(i));
            let validations = validations.iter().enumerate().map(validate).collect();
            Ok(Identification { found, validations })
        }
        (Err(Error::Core(error)), None) => Err(errors::core(error)),
        (Err(error), None) => Err(invalid(&error.to_string())),
    }
}

/// Tells Python how far the search is, and stops it on Ctrl-C or when the caller's function raises.
fn report(now: &Progress, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    Python::attach(|py| {
        py.check_signals()?;
        progress.map_or(Ok(()), |progress| progress.call1(py, (now.fraction, now.best_rmse)).map(drop))
    })
}

/// The records of the core call the signals input and output; Python calls them u and y.
pub(crate) fn named(message: &str) -> String {
    message.replace("input[", "u[").replace("output[", "y[").replace("input:", "u:").replace("output:", "y:")
}

pub(crate) fn invalid(message: &str) -> PyErr {
    PyValueError::new_err(named(message))
}
