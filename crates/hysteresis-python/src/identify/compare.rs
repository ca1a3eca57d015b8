//! Models side by side: arguments in, a comparison out.

use hysteresis_python_macros::function;
use std::ops::ControlFlow;

use hysteresis_core::Ratios;
use hysteresis_identify::{
    self as identification, AmplifierModel, CreepModel, DynamicsModel, LoopShiftModel, Loss, MapModel, ModesModel,
    Options, Setting, Stop, WeightLaw,
};
use pyo3::prelude::*;

use super::comparison::Comparison;
use super::identify::report;
use super::intervals::Intervals;
use super::options::{Smoothness, placed};
use super::records::{checked, signals, skips};
use crate::convert::arguments::callable;
use crate::convert::errors;

/// Fits several models to the same records and judges each on held-out stretches: what does each buy on these data?
///
/// | model | y |
/// | --- | --- |
/// | conventional | sum_i w_i p_i[u], p_i plays |
/// | polynomial + plays | a_2 x^2 + a_3 x^3 + sum_i w_i p_i[u], x the drive scaled to -1 to 1 |
/// | modified | sum_i w_i z_i[u], z_i coupled plays |
/// | modified + creep, + loop shift, + dynamics, + maps | the same with one extension |
/// | modified + all | with all extensions, as `identify` fits them |
///
/// Weights are not negative. p_0 and z_0 are the identity, so w_0 is the linear term of the polynomial. Polynomial + plays has no
/// exact inverse here: it is for comparison only. Every model has a dead time, and every record an output offset; where creep is
/// "auto", a record whose start is skipped also has the creep that was under way, in all models alike.
///
/// The judge is the same for all. Every record is cut into eight stretches, and the i-th stretch of all records is predicted from a
/// fit to the other stretches. Weights, offsets and polynomial are fitted anew exactly; ratios, input offset, dead time, dynamics
/// and creep to first order about their values for all stretches. What "auto" stands for is chosen once, on all stretches, as in
/// `identify`. All modified models have the weight law, the smoothness and the operators of the last of them, so that they differ
/// by their extensions alone.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and measured output (um). Or, for several records, a list of (u, y) pairs as the only argument.
/// dt : float or list of float, optional
///     Sampling interval in seconds. Without it there are no extensions, and times are in samples.
/// operators, weights, ratios, input_offset, dead_time, thresholds, smoothness, loss
///     As in `identify`, for every model. Plays have no ratios; for split weights they have free ones. Glitches are those that
///     the last model leaves.
/// creep, loop_shift, dynamics, modes, amplifier, input_map, output_map
///     As in `identify`, for the extensions. None leaves one out; modes and amplifier are those of the dynamics.
/// skip : int or list of int
///     Leading samples of each record that set the memory but are not fitted, or a time such as "2s".
/// progress : callable, optional
///     Called with (fraction done, best rms error so far). Ctrl-C stops either way.
///
/// Returns
/// -------
/// Comparison
///     One row for each model.
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
/// >>> y = mh.paper.table_1_recovered().forward().run(u)  # coupled plays
/// >>> found = mh.compare(u, y, operators=8)
/// >>> ", ".join(row.model for row in found.rows)
/// 'conventional, polynomial + plays, modified'
/// >>> found.simplest
/// 'modified'
/// >>> conventional, polynomial, modified = found.rows
/// >>> modified.held_out < 0.2 * min(conventional.held_out, polynomial.held_out)
/// True
/// >>> found.omitted.get("creep")
/// 'needs a sampling interval'
#[function]
#[gather(options: Options)]
pub(crate) fn compare(
    py: Python<'_>,
    #[py("Records")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike | None" = None)] y: Option<&Bound<'_, PyAny>>,
    #[py(*, "float | Sequence[float] | None" = None)] dt: Option<&Bound<'_, PyAny>>,
    #[py("int | Literal['auto'] | None" = None)] operators: Option<&Bound<'_, PyAny>>,
    #[py(field, "Literal['auto', 'free', 'quadratic', 'split']" = "auto")] weights: WeightLaw,
    #[py(field, "Literal['fit'] | tuple[float, float, float]" = "fit")] ratios: Setting<Ratios>,
    #[py(field, "Literal['fit'] | float" = "fit")] input_offset: Setting<f64>,
    #[py(field, "Literal['fit'] | float" = "fit")] dead_time: Setting<f64>,
    #[py(field, "Literal['auto', 1, 2] | None" = "auto")] dynamics: DynamicsModel,
    #[py(field, "Literal['auto', 1, 2, 3]" = "auto")] modes: ModesModel,
    #[py(field, "Literal['auto', 'log'] | int | ArrayLike | None" = "auto")] creep: CreepModel,
    #[py(field, "Literal['auto'] | float | None" = "auto")] loop_shift: LoopShiftModel,
    #[py(field, "Literal['auto'] | float | None" = "auto")] amplifier: AmplifierModel,
    #[py(field, "Literal['auto', 'smooth'] | None" = "auto")] input_map: MapModel,
    #[py(field, "Literal['auto', 'smooth'] | None" = "auto")] output_map: MapModel,
    #[py("Literal['uniform', 'quantiles', 'geometric'] | ArrayLike | None" = None)] thresholds: Option<
        &Bound<'_, PyAny>,
    >,
    #[py("Literal['auto'] | float" = "auto")] smoothness: Smoothness,
    #[py(field, "Literal['auto', 'squares', 'robust']" = "auto")] loss: Loss,
    #[py("Skip | Sequence[Skip]" = 0)] skip: Option<&Bound<'_, PyAny>>,
    #[py("Callable[[float, float], object] | None" = None)] progress: Option<Py<PyAny>>,
) -> PyResult<Comparison> {
    callable("progress", progress.as_ref().map(|progress| progress.bind(py)))?;
    // A copy: other threads may change the arrays while the interpreter is let go.
    let signals = signals(u, y)?;
    let intervals = Intervals::from_python(dt, signals.len())?;
    let options = Options {
        dt: intervals.common(),
        thresholds: placed(thresholds, operators)?,
        smoothness: smoothness.0,
        ..options
    };
    let records = checked(&signals, skips(skip, signals.len(), &intervals)?, &intervals, &[])?;
    let mut stopped_by = None;
    let found = py.detach(|| {
        identification::compare(&records, &options, &mut |now| match report(now, progress.as_ref()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                stopped_by = Some(error);
                ControlFlow::Break(Stop::Discard)
            }
        })
    });
    match (found, stopped_by) {
        (_, Some(error)) => Err(error),
        (Ok(found), None) => Ok(Comparison(found)),
        (Err(error), None) => Err(errors::identification(error)),
    }
}
