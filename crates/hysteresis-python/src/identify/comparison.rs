//! What a comparison of models hands over: a row for each model, and all of them as a table.

use hysteresis_identify as identification;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::{Deserialize, Serialize};

use super::intervals::Intervals;
use super::quality::Quality;
use super::records::{checked, signals};
use crate::argument::Words;
use crate::convert::arguments::{OrDefault, whole};
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
/// ['conventional', 'polynomial + plays', 'modified']
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

    /// How many numbers were fitted: those of the weight law, of polynomial or loop shift, output offsets and creep under way of the
    /// records, and everything that was searched.
    #[getter]
    fn unknowns(&self) -> usize {
        self.0.unknowns
    }

    /// The extensions in it: "creep", "loop shift", "dynamics", "maps". One that was "auto" is there if cross-validation kept it.
    #[getter]
    #[py(-> "list[Literal['creep', 'loop shift', 'dynamics']]")]
    fn kept(&self) -> Vec<&'static str> {
        self.0.kept.iter().map(|extension| extension.name()).collect()
    }

    /// The errors over the fitted samples of all records.
    #[getter]
    fn fit(&self) -> Quality {
        Quality::from(&self.0.fit)
    }

    /// Root mean square error on the held-out stretches, in the unit of the output: the mean of the squares over the stretches.
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

    /// Root mean square error on every held-out stretch, in the unit of the output. Stretch i is the i-th eighth of every record.
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
        #[py(*, "int" = 0)] record: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (place, records) = (record.map_or(Ok(0), |record| whole::<usize>("record", record))?, self.0.records());
        if place >= records {
            let expected = format_args!("expected a number below {records}, that of the fitted records, got {place}");
            return Err(errors::value("record", expected));
        }
        let signals = signals(u, Some(y))?;
        let records = checked(&signals, vec![0], &Intervals::known(&[]), &[])?;
        Ok(PyArray1::from_vec(py, self.0.residuals(place, records[0].input(), records[0].output())))
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

    /// Whether the models have the creep that was under way when a record began: in records whose start is skipped, if creep is not
    /// None. It is in all models alike, and no extension.
    #[getter]
    fn creep_under_way(&self) -> bool {
        self.0.has_creep_under_way()
    }

    /// The samples of each record that were taken for glitches and left out for all models, counted from 0 with the skipped ones.
    #[getter]
    fn left_out_samples(&self) -> Vec<Vec<usize>> {
        self.0.left_out_samples.clone()
    }

    /// All of it as lines for a terminal; the errors in the unit of the output and in % of its peak-to-peak.
    ///
    /// `unit` is the name of that unit, for the header. A star marks the simplest model that predicts as well as the best.
    fn table(&self, #[py("str" = "")] unit: OrDefault<'_>) -> PyResult<String> {
        Ok(self.0.table(&unit.word("unit", "a text", "")?))
    }

    fn __repr__(&self) -> String {
        let rows = self.0.models.iter().map(|row| format!("{} {:.4e}", row.name, row.held_out));
        format!("<Comparison: rms held out: {}>", rows.collect::<Vec<_>>().join(", "))
    }
}
