//! Identification of an oscillator with hysteresis inside: a record in, a result out.

use hysteresis_control::oscillator::Hold;
use hysteresis_identify::{self as identification, OscillatorOptions};
use hysteresis_python_macros::{function, methods};
use numpy::PyArray1;
use pyo3::prelude::*;
use pythonize::pythonize;

use super::diagnose::Finding;
use crate::argument::{CountOrAuto, SampleCount, Words};
use crate::convert::arrays::{check_room, numbers, read_only};
use crate::convert::errors;
use crate::plant::oscillator::HystereticOscillator;

/// What `identify_oscillator` found: an oscillator with hysteresis inside, and how well it follows its record.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
/// >>> plant = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
/// >>> u = mh.signals.chirp(60.0, 5.0, 100.0, seconds=2.0, rate=1000)  # N
/// >>> y = plant.response(u, dt=1e-3)  # m, a record: yours is measured
/// >>> found = mh.identify_oscillator(u, y, dt=1e-3, hold="zero", knots=3)
/// >>> found.rms < 2e-3 * found.linear_rms
/// True
/// >>> print(found.summary().splitlines()[0])
/// Oscillator with hysteresis inside, 3 knots, 10 parameters
#[pyclass(module = "mpi_hyst.results", frozen)]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub(crate) struct OscillatorIdentification(identification::OscillatorIdentification);

#[methods]
impl OscillatorIdentification {
    /// The oscillator.
    #[getter]
    fn model(&self) -> HystereticOscillator {
        HystereticOscillator(self.0.model.clone())
    }

    /// What is added to the position of the model, in the unit of y.
    #[getter]
    fn output_offset(&self) -> f64 {
        self.0.output_offset
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.0.dt
    }

    /// What the drive does between samples: "zero" or "band_limited".
    #[getter]
    #[py(-> "Literal['zero', 'band_limited']")]
    fn hold(&self) -> &str {
        &self.0.hold
    }

    /// The number of integration steps in an interval that the fit took.
    #[getter]
    fn sub_steps(&self) -> usize {
        self.0.sub_steps
    }

    /// The number of periods that were averaged; 1 if the record does not repeat.
    #[getter]
    fn periods(&self) -> usize {
        self.0.periods
    }

    /// The rms error over all fitted samples of the mean of the periods, noise included, in the unit of y.
    #[getter]
    fn rms(&self) -> f64 {
        self.0.rms
    }

    /// That of the best linear oscillator, fitted to the same samples.
    #[getter]
    fn linear_rms(&self) -> f64 {
        self.0.linear_rms
    }

    /// The rms error, with the chosen number of knots, over samples to which the model was not fitted.
    #[getter]
    fn held_out_rms(&self) -> f64 {
        self.0.held_out_rms
    }

    /// Standard deviation of the noise of a measured sample, if several periods tell it.
    #[getter]
    fn noise(&self) -> Option<f64> {
        self.0.noise
    }

    /// Whether the knots cover all of z over the record: beyond them f is extrapolated.
    #[getter]
    fn covered(&self) -> bool {
        self.0.covered
    }

    /// Standard errors of b, c, k, f+ and f- at the knots, and the output offset, for noise with the spectrum of what
    /// the model leaves; infinite where the record does not tell a parameter.
    #[getter]
    fn standard_errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.standard_errors.iter().copied())
    }

    /// The standard error of the gain b.
    #[getter]
    fn gain_std(&self) -> f64 {
        self.0.standard_errors[0]
    }

    /// The standard error of the damping c, in 1/s.
    #[getter]
    fn damping_std(&self) -> f64 {
        self.0.standard_errors[1]
    }

    /// The standard error of the stiffness k, in 1/s^2.
    #[getter]
    fn stiffness_std(&self) -> f64 {
        self.0.standard_errors[2]
    }

    /// Standard errors of f+ at the knots.
    #[getter]
    fn rising_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.of_slopes().0.iter().copied())
    }

    /// Standard errors of f- at the knots.
    #[getter]
    fn falling_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.of_slopes().1.iter().copied())
    }

    /// The standard error of the output offset.
    #[getter]
    fn output_offset_std(&self) -> f64 {
        self.0.standard_errors[self.0.standard_errors.len() - 1]
    }

    /// The linear oscillator (0 knots) and every number of knots that was tried: knots, parameters, fitted_rms,
    /// held_out_rms.
    #[getter]
    #[py(-> "list[dict[str, float]]")]
    fn tried<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.0.tried)?)
    }

    /// Whether the result deserves trust: "green", "amber" or "red", the worst of `warnings`.
    #[getter]
    #[py(-> "Literal['green', 'amber', 'red']")]
    fn verdict(&self) -> &'static str {
        self.0.verdict().name()
    }

    /// What makes the numbers doubtful; empty if nothing does.
    ///
    /// - "poor_fit": the model leaves more than noise: the hysteresis is of another kind, or there is more than one
    ///   mode.
    /// - "hysteresis_inside_not_told": a linear oscillator predicts samples that were not fitted as well.
    #[getter]
    fn warnings(&self) -> Vec<Finding> {
        self.0.warnings.iter().cloned().map(Finding::from).collect()
    }

    /// How many passes over the record the search took.
    #[getter]
    fn evaluations(&self) -> usize {
        self.0.evaluations
    }

    /// The numbers as a text.
    fn summary(&self) -> String {
        self.0.summary()
    }

    fn __repr__(&self) -> String {
        let knots = self.0.model.hysteresis().knots().count();
        format!(
            "<OscillatorIdentification: {}, {knots} knots, rms {:.3e}, held out {:.3e}, linear {:.3e}>",
            self.verdict(),
            self.rms(),
            self.held_out_rms(),
            self.linear_rms()
        )
    }
}

/// Bytes for each sample that a fit needs: residuals and derivatives by 22 parameters in several copies, and two
/// drives on the half steps of up to 32 sub-steps, which resolve the fastest oscillator of the scan.
const FIT_INSIDE: usize = 1024 + 32 * 32;

/// What a drive does between samples, or "auto".
#[derive(Clone, Copy, PartialEq)]
enum AnyHold {
    Auto,
    Zero,
    BandLimited,
}

impl Words for AnyHold {
    const WORDS: &'static [(&'static str, Self)] =
        &[("auto", Self::Auto), ("zero", Self::Zero), ("band_limited", Self::BandLimited)];
}

impl From<AnyHold> for Option<Hold> {
    fn from(hold: AnyHold) -> Self {
        match hold {
            AnyHold::Auto => None,
            AnyHold::Zero => Some(Hold::Zero),
            AnyHold::BandLimited => Some(Hold::BandLimited),
        }
    }
}

/// Identifies an oscillator with hysteresis inside, y'' + c y' + k y + z\[y\] = b u, from a record.
///
/// For systems in which hysteresis acts on the motion itself: friction, cables, bearings, magnetic springs, the
/// Bouc-Wen oscillator. For a piezo stage `identify` is right: its hysteresis stands in front of the dynamics.
///
/// z is a `Duhem` operator of y. The search begins at the best linear oscillator and goes from 3 knots to 5 and 9 by
/// Gauss-Newton steps with derivatives that are exact but for the moment of turning, as long as more knots pay. Each
/// is fitted to the first 70 % of the samples and judged by a free simulation of the others: more knots must be
/// better there by two standard deviations. The chosen one is then fitted to all.
///
/// Periods of a steady record are averaged. A record that does not repeat begins at rest, at the output offset.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Drive and measured position, y[k] read at the moment at which u[k] is put out.
/// dt : float
///     Sampling interval in seconds; about ten samples in a period of the resonance are needed.
/// periods : "auto" or int
///     How many equal periods the record has, all of them steady: the drive repeats within 1e-9 of its range. "auto"
///     looks for them.
/// hold : "auto", "zero" or "band_limited"
///     What the drive does between samples: held by a converter, or smooth. "auto" takes what fits better with 3
///     knots.
/// knots : "auto", 3, 5 or 9
///     The number of knots of f+ and f-.
/// skip : int
///     Leading samples that are simulated but not fitted, of a record that does not repeat. The record must begin at
///     rest all the same.
///
/// Returns
/// -------
/// OscillatorIdentification
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
/// >>> plant = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
/// >>> u = mh.signals.chirp(60.0, 5.0, 100.0, seconds=2.0, rate=1000)  # N
/// >>> y = plant.response(u, dt=1e-3)  # m, a record: yours is measured
/// >>> found = mh.identify_oscillator(u, y, dt=1e-3, hold="zero", knots=3)
/// >>> round(found.model.gain, 3), round(found.model.damping, 2)
/// (0.5, 5.0)
#[function]
#[gather(options: OscillatorOptions = OscillatorOptions::default())]
pub(crate) fn identify_oscillator(
    py: Python<'_>,
    #[py("ArrayLike")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike")] y: &Bound<'_, PyAny>,
    #[py(*)] dt: f64,
    #[py(field = "auto")] periods: CountOrAuto,
    #[py(field = "auto")] hold: AnyHold,
    #[py(field = "auto")] knots: CountOrAuto,
    #[py(= 0)] skip: SampleCount,
) -> PyResult<OscillatorIdentification> {
    // A copy: other threads may change the arrays while the interpreter is let go.
    let (u, y) = (numbers("u", u)?, numbers("y", y)?);
    check_room("u", u.len(), FIT_INSIDE)?;
    let options = OscillatorOptions { skip: skip.0, ..options };
    let found = py.detach(|| identification::identify_oscillator(&u, &y, dt, &options));
    found.map(OscillatorIdentification).map_err(|error| errors::of_records(error, 1))
}
