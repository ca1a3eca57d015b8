//! Models side by side: arguments in, a row for each model out.

use hysteresis_identify::{
    self as identification, AmplifierModel, CreepModel, DuhemModel, DynamicsModel, LoopShiftModel, Loss, MapModel,
    ModesModel, Options, RatiosModel, RelaxingPlaysModel, Setting, SlowGainModel, Stop, WeightLaw,
};
use hysteresis_python_macros::{function, methods};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::{Deserialize, Serialize};

use super::options::{Operators, Placing, Smoothness, placed};
use super::quality::Quality;
use super::records::{GivenRecords, Interval, Skips, check_place};
use super::watch::Watch;
use crate::argument::{Callable, Words};
use crate::convert::errors;

/// What `compare` found: a row for each model, the simplest first.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
/// >>> compared = mh.compare(u, mh.paper.table_1_recovered().forward().run(u), operators=6)
/// >>> compared.simplest
/// 'modified'
#[pyclass(module = "mpi_hyst.results", frozen, eq, skip_from_py_object)]
#[derive(PartialEq, Serialize, Deserialize)]
pub(crate) struct Comparison(pub(super) identification::Comparison);

/// One model of a comparison, with its errors on what it was fitted to and on stretches held out.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
/// >>> compared = mh.compare(u, mh.paper.table_1_recovered().forward().run(u), operators=6)
/// >>> [model.model for model in compared.rows]
/// ['conventional', 'polynomial + plays', 'modified', 'modified + duhem']
#[pyclass(module = "mpi_hyst.results", frozen, eq, skip_from_py_object)]
#[derive(PartialEq, Serialize, Deserialize)]
pub(crate) struct ComparedModel(identification::ComparedModel);

#[methods]
impl ComparedModel {
    /// The name of the model, as `compare` lists them.
    #[getter]
    fn model(&self) -> &str {
        &self.0.name
    }

    /// What its weights might be: as given, or as cross-validation chose.
    #[getter]
    #[py(-> "Literal['free', 'quadratic', 'split']")]
    fn weights_law(&self) -> &'static str {
        self.0.weights.word()
    }

    /// How many numbers were fitted: those of the weight law, of polynomial or loop shift, output offsets and creep
    /// under way of the records, and everything that was searched.
    #[getter]
    fn unknowns(&self) -> usize {
        self.0.unknowns
    }

    /// The extensions in it: "creep", "loop shift", "relaxing plays", "slow gain", "dynamics", "maps", "duhem". One
    /// that was "auto" is there if cross-validation kept it.
    #[getter]
    #[py(-> "list[Literal['creep', 'loop shift', 'relaxing plays', 'slow gain', 'dynamics', 'maps', 'duhem']]")]
    fn kept(&self) -> Vec<&'static str> {
        self.0.kept.iter().map(|extension| extension.name()).collect()
    }

    /// The errors over the fitted samples of all records.
    #[getter]
    fn fit(&self) -> Quality {
        self.0.fit.into()
    }

    /// Root mean square error on the held-out stretches, in the unit of the output: the mean of the squares over the
    /// stretches.
    #[getter]
    fn held_out(&self) -> f64 {
        self.0.held_out
    }

    /// The same in % of `fit.range`, the peak-to-peak of the measured output.
    #[getter]
    fn held_out_percent(&self) -> f64 {
        self.0.percent(self.0.held_out)
    }

    /// The largest of `stretches`.
    #[getter]
    fn worst_stretch(&self) -> f64 {
        self.0.worst_stretch()
    }

    /// The same in % of `fit.range`.
    #[getter]
    fn worst_stretch_percent(&self) -> f64 {
        self.0.percent(self.0.worst_stretch())
    }

    /// Root mean square error on every held-out stretch, in the unit of the output. Stretch i is the i-th eighth of
    /// every record.
    #[getter]
    fn stretches(&self) -> Vec<f64> {
        self.0.stretches.clone()
    }

    /// Measured minus modelled output of a record that was fitted, all its samples: (n,) in the unit of y.
    ///
    /// The model is that of all stretches, with the output offset of the record and the creep that was under way in it.
    ///
    /// Parameters
    /// ----------
    /// u, y : arrays of n floats
    ///     Input and measured output, as they were given to `compare`.
    /// record : int
    ///     The number of the record among those that were fitted.
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
    /// >>> row = mh.compare(u, y, operators=8).rows[0]
    /// >>> bool(abs((row.residuals(u, y) ** 2).mean() ** 0.5 - row.fit.rmse) < 1e-12)
    /// True
    fn residuals<'py>(
        &self,
        py: Python<'py>,
        #[py("ArrayLike")] u: &Bound<'py, PyAny>,
        #[py("ArrayLike")] y: &Bound<'py, PyAny>,
        #[py(*, = 0)] record: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        check_place(record, self.0.records())?;
        let given = GivenRecords::new(u, Some(y), None, None, &[])?;
        let records = given.records()?;
        Ok(PyArray1::from_vec(py, self.0.residuals(record, records[0].input(), records[0].output())))
    }

    fn __repr__(&self) -> String {
        format!(
            "<ComparedModel {:?}: {} unknowns, rms {:.4e} fitted, {:.4e} held out ({:.3} % of range {:.4e})>",
            self.0.name,
            self.0.unknowns,
            self.0.fit.rmse,
            self.0.held_out,
            self.held_out_percent(),
            self.0.fit.range,
        )
    }
}

#[methods]
impl Comparison {
    /// One row for each model, the simplest first.
    #[getter]
    fn rows(&self) -> Vec<ComparedModel> {
        self.0.models.iter().cloned().map(ComparedModel).collect()
    }

    /// The name of the simplest model that predicts held-out stretches as well as the best one.
    ///
    /// As well: the factor between their mean square errors, over the stretches, is 1 within its standard error.
    #[getter]
    fn simplest(&self) -> &str {
        &self.0.simplest().name
    }

    /// The extensions that were not tried, each with the reason.
    #[getter]
    #[py(-> "dict[str, str]")]
    fn omitted<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let omitted = PyDict::new(py);
        for (extension, reason) in &self.0.omitted {
            omitted.set_item(extension.name(), reason.reason())?;
        }
        Ok(omitted)
    }

    /// Whether the models have the creep that was under way when a record began: in records whose start is skipped, if
    /// creep is not None. It is in all models alike, and no extension.
    #[getter]
    fn creep_under_way(&self) -> bool {
        self.0.has_creep_under_way()
    }

    /// The samples of each record that were taken for glitches and left out for all models, counted from 0 with the
    /// skipped ones.
    #[getter]
    fn left_out_samples(&self) -> Vec<Vec<usize>> {
        self.0.left_out_samples.clone()
    }

    /// All of it as lines for a terminal; the errors in the unit of the output and in % of its peak-to-peak.
    ///
    /// `unit` is the name of that unit, for the header. A star marks the simplest model that predicts as well as the
    /// best.
    fn table(&self, #[py(= "")] unit: String) -> PyResult<String> {
        Ok(self.0.table(&unit))
    }

    fn __repr__(&self) -> String {
        let rows = self.0.models.iter().map(|row| format!("{} {:.4e}", row.name, row.held_out));
        format!("<Comparison: rms held out: {}>", rows.collect::<Vec<_>>().join(", "))
    }
}

/// Fits several models to the same records and judges each on held-out stretches: what does each buy on these data?
///
/// | model | y |
/// | --- | --- |
/// | conventional | sum_i w_i p_i[u], p_i plays |
/// | polynomial + plays | a_2 x^2 + a_3 x^3 + sum_i w_i p_i[u], x the drive scaled to -1 to 1 |
/// | modified | sum_i w_i z_i[u], z_i coupled plays |
/// | modified + creep, + loop shift, + relaxing plays, + slow gain, + dynamics, + maps, + duhem | the same with one extension |
/// | modified + all | with all extensions, as `identify` fits them |
///
/// Weights are not negative. p_0 and z_0 are the identity, so w_0 is the linear term of the polynomial. Polynomial +
/// plays has no exact inverse here: it is for comparison only. Every model has a dead time, and every record an output
/// offset; where creep is "auto", a record whose start is skipped also has the creep that was under way, in all models
/// alike.
///
/// The judge is the same for all. Every record is cut into eight stretches, and the i-th stretch of all records is
/// predicted from a fit to the other stretches. Weights, offsets and polynomial are fitted anew exactly; ratios, input
/// offset, dead time and what else is searched to first order about their values for all stretches. What "auto" stands
/// for is chosen once, on all stretches, as in `identify`. All modified models have the weight law, the smoothness and
/// the operators of the last of them, so that they differ by their extensions alone.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and measured output (um). Or, for several records, a list of (u, y) pairs as the only argument.
/// dt : float or list of float, optional
///     Sampling interval in seconds. Without it a Duhem operator is the only extension, and times are in samples.
/// operators, weights, ratios, input_offset, dead_time, thresholds, smoothness, loss
///     As in `identify`, for every model. Plays have no ratios; for coupled plays "auto" is "fit". For split weights
///     plays have free ones. Glitches are those that the last model leaves.
/// creep, loop_shift, relaxing_plays, slow_gain, dynamics, modes, amplifier, input_map, output_map, duhem
///     As in `identify`, for the extensions. None leaves one out; modes and amplifier are those of the dynamics.
/// skip : int or list of int
///     Leading samples of each record that set the memory but are not fitted, or a time such as "2s".
/// progress : callable, optional
///     Called with (fraction done, best rms error so far), in the calling thread. Ctrl-C stops either way. All
///     processors are used, as by identify.
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
/// 'conventional, polynomial + plays, modified, modified + duhem'
/// >>> found.simplest
/// 'modified'
/// >>> conventional, polynomial, modified, _ = found.rows
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
    #[py(*, = None)] dt: Option<Interval>,
    #[py(= None)] operators: Option<Operators>,
    #[py(field = "auto")] weights: WeightLaw,
    #[py(field = "auto")] ratios: RatiosModel,
    #[py(field = "fit")] input_offset: Setting<f64>,
    #[py(field = "fit")] dead_time: Setting<f64>,
    #[py(field = "auto")] dynamics: DynamicsModel,
    #[py(field = "auto")] modes: ModesModel,
    #[py(field = "auto")] creep: CreepModel,
    #[py(field = "auto")] loop_shift: LoopShiftModel,
    #[py(field = "auto")] relaxing_plays: RelaxingPlaysModel,
    #[py(field = "auto")] slow_gain: SlowGainModel,
    #[py(field = "auto")] duhem: DuhemModel,
    #[py(field = "auto")] amplifier: AmplifierModel,
    #[py(field = "auto")] input_map: MapModel,
    #[py(field = "auto")] output_map: MapModel,
    #[py(= None)] thresholds: Option<Placing>,
    #[py(field = "auto")] smoothness: Smoothness,
    #[py(field = "auto")] loss: Loss,
    #[py(= 0)] skip: Skips,
    #[py("Callable[[float, float], object] | None" = None)] progress: Option<Callable>,
) -> PyResult<Comparison> {
    let given = GivenRecords::new(u, y, Some(&skip), dt, &[])?;
    let options = Options { dt: given.common_dt(), thresholds: placed(thresholds, operators)?, ..options };
    let records = given.records()?;
    let mut watch = Watch::new(progress);
    let found = py.detach(|| {
        identification::compare(&records, &options, &mut |now| {
            watch.look((now.fraction, now.best_rmse)).map_break(|()| Stop::Discard)
        })
    });
    watch.check()?;
    found.map(Comparison).map_err(errors::identification)
}
