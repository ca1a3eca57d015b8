//! What diagnostics find.

use hysteresis_identify::{self as identification, Verdict};
use hysteresis_python_macros::{function, methods};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::convert::errors::unexpected;

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
    /// "amber": a number is doubtful, or another record would make the result better. "red": the result is not that of the
    /// stage.
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
