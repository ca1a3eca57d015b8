//! What makes records or a result doubtful: findings by name.

use hysteresis_core::Model;
use hysteresis_identify::{self as identification, Verdict};
use hysteresis_python_macros::{function, methods};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use super::records::{GivenRecords, Interval, Skips};
use crate::convert::errors::{self, raise, record, unexpected};

/// What makes records or a result doubtful: a code, a sentence, a number with the limit that it passed, and what to do.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
/// >>> model = mh.paper.table_1_recovered()
/// >>> found = mh.diagnose(u, -model.forward().run(u), model)  # a record that is wired the other way
/// >>> found[0].code, found[0].severity
/// ('wrong_sign', 'red')
#[pyclass(module = "mpi_hyst.results", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Finding {
    /// Which finding: one of the names that docs/findings.md explains.
    #[pyo3(get)]
    code: String,
    severity: String,
    /// One sentence with the numbers in it.
    #[pyo3(get)]
    message: String,
    /// The number that was compared.
    #[pyo3(get)]
    value: f64,
    /// What it was compared with.
    #[pyo3(get)]
    limit: f64,
    /// What to try next.
    #[pyo3(get)]
    hint: String,
    /// The record that shows it most, or None where there is one record only or all count together.
    #[pyo3(get)]
    record: Option<usize>,
    /// The sample of that record where it is, or where it ends; skipped samples count. None where it is no place.
    #[pyo3(get)]
    sample: Option<usize>,
}

impl From<identification::Finding> for Finding {
    fn from(found: identification::Finding) -> Self {
        let identification::Finding { code, severity, message, value, limit, hint, record, sample, .. } = found;
        let (code, severity) = (code.name().to_owned(), severity.name().to_owned());
        Self { code, severity, message, value, limit, hint, record, sample }
    }
}

#[methods]
impl Finding {
    /// "amber": a number is doubtful, or another record would make the result better. "red": the result is not that of
    /// the stage.
    #[getter]
    #[py(-> "Literal['amber', 'red']")]
    fn severity(&self) -> &str {
        &self.severity
    }

    fn __repr__(&self) -> String {
        let Self { code, severity, message, value, limit, record, .. } = self;
        let place = record.map_or_else(String::new, |record| format!("record {record}, "));
        format!("<Finding {code}, {severity}: {place}value {value:.3}, limit {limit:.3}: {message}>")
    }
}

/// The verdict on findings: that of the worst of them, or "green" if there is none.
///
/// Parameters
/// ----------
/// findings : list of Finding
///     Those of `diagnose`, or the warnings of an identification, whose `verdict` is the same.
///
/// Returns
/// -------
/// "green", "amber" or "red"
///
/// Raises
/// ------
/// TypeError
///     For what is no list of findings.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> actuator = mh.paper.table_1_recovered()
/// >>> u = mh.signals.sine(500.0, 1.0, seconds=5.0, rate=1000)
/// >>> mh.results.verdict(mh.diagnose(u, actuator.forward().run(u), actuator))  # full strokes alone
/// 'amber'
/// >>> mh.results.verdict([])
/// 'green'
#[function]
#[py(-> "Literal['green', 'amber', 'red']")]
pub(crate) fn verdict(#[py("Sequence[Finding]")] findings: &Bound<'_, PyAny>) -> PyResult<String> {
    let findings: Vec<PyRef<'_, Finding>> =
        findings.extract().map_err(|_| unexpected("findings", "a list of Finding", findings))?;
    let is = |name: &str| findings.iter().any(|finding| finding.severity == name);
    let verdicts = [Verdict::Red, Verdict::Amber];
    let worst = verdicts.into_iter().find(|verdict| is(verdict.name()));
    Ok(worst.unwrap_or(Verdict::Green).name().to_owned())
}

/// Looks for what records cannot tell and what a model left in them.
///
/// Every finding has a code, a severity, a number, a limit and what to try next. docs/findings.md lists the codes.
///
/// The residual is the measured minus the modelled output without its mean, over the fitted samples.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and measured output (um). Or, for several records, a list of (u, y) pairs and None.
/// model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     Fitted to these records.
/// skip : int or list of int
///     Leading samples of each record that were not fitted.
/// dt : float or list of float, optional
///     Sampling interval in seconds, one for all records or one for each.
/// dead_time : float
///     What y lags u, in seconds; in samples where there is no dt.
/// times : array or list of arrays, optional
///     When every sample was taken, in seconds, for each record: increasing, and their usual step that of dt.
///
/// Returns
/// -------
/// list of Finding
///     Empty if nothing was found. `results.verdict` says how bad it is.
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
/// >>> u = mh.signals.sine(500.0, 1.0, seconds=5.0, rate=1000)  # full strokes alone
/// >>> for found in mh.diagnose(u, actuator.forward().run(u), actuator):
/// ...     print(found.code, found.value, found.limit)
/// no_minor_loops 0.0 2.0
/// rate_dependence_not_told 1.0 1.5
/// >>> made = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=1000)
/// >>> y = actuator.forward().run(made.drive)
/// >>> mh.diagnose(made.drive, y, actuator, skip=made.initialization_samples)
/// []
#[function]
pub(crate) fn diagnose(
    py: Python<'_>,
    #[py("Records")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike | None")] y: Option<&Bound<'_, PyAny>>,
    model: Model,
    #[py(*, = 0)] skip: Skips,
    #[py(= None)] dt: Option<Interval>,
    #[py(= 0.0)] dead_time: f64,
    #[py("ArrayLike | Sequence[ArrayLike | None] | None" = None)] times: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<Finding>> {
    let given = GivenRecords::new(u, y, Some(&skip), dt, &[])?.at(times)?;
    let records = given.records()?;
    let found = py.detach(|| identification::diagnose(&records, &model, dead_time));
    Ok(found.map_err(errors::identification)?.into_iter().map(Finding::from).collect())
}

/// The widest distance between falling and rising outputs of full strokes at the same input.
///
/// A full stroke leads from the lowest to the highest twentieth of the input range, or back. The outputs of all rising
/// strokes are averaged in fifty parts of the range, those of the falling ones likewise, so noise averages out. Compare
/// what was measured with what a model makes of the same input; a lag widens the loops of both.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and output (um).
///
/// Returns
/// -------
/// float or None
///     In the unit of y; None without a full stroke in both directions.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.triangle(500.0, 1.0, seconds=3.0, rate=1000)
/// >>> round(mh.results.loop_width(u, mh.paper.table_1_recovered().forward().run(u)), 2)  # um
/// 0.49
#[function]
pub(crate) fn loop_width(u: PyReadonlyArray1<'_, f64>, y: PyReadonlyArray1<'_, f64>) -> PyResult<Option<f64>> {
    identification::loop_width(u.as_slice()?, y.as_slice()?).map_err(|error| raise(record(error)))
}
