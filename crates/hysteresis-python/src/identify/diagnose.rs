//! Diagnostics: records and a model in, findings by name out.

use hysteresis_identify as identification;
use hysteresis_python_macros::function;
use pyo3::prelude::*;

use super::finding::Finding;
use super::intervals::Intervals;
use super::records::{self, checked, signals, skips};
use crate::convert::arrays::vector;
use crate::convert::errors::{self, raise, record};
use crate::model::object::model_of;

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
/// >>> made = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=1000)
/// >>> y = actuator.forward().run(made.drive)
/// >>> mh.diagnose(made.drive, y, actuator, skip=made.initialization_samples)
/// []
#[function]
pub(crate) fn diagnose(
    py: Python<'_>,
    #[py("Records")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike | None")] y: Option<&Bound<'_, PyAny>>,
    #[py("Model")] model: &Bound<'_, PyAny>,
    #[py(*, "Skip | Sequence[Skip]" = 0)] skip: Option<&Bound<'_, PyAny>>,
    #[py("float | Sequence[float] | None" = None)] dt: Option<&Bound<'_, PyAny>>,
    #[py(= 0.0)] dead_time: f64,
    #[py("ArrayLike | Sequence[ArrayLike | None] | None" = None)] times: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<Finding>> {
    let model = model_of("model", model)?;
    // A copy: other threads may change the arrays while the interpreter is let go.
    let signals = signals(u, y)?;
    let intervals = Intervals::from_python(dt, signals.len())?;
    let times = records::times(times, signals.len())?;
    let records = checked(&signals, skips(skip, signals.len(), &intervals)?, &intervals, &times)?;
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
pub(crate) fn loop_width(
    #[py("ArrayLike")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike")] y: &Bound<'_, PyAny>,
) -> PyResult<Option<f64>> {
    let (u, y) = (vector("u", u)?, vector("y", y)?);
    identification::loop_width(u.as_slice()?, y.as_slice()?).map_err(|error| raise(record(error)))
}
