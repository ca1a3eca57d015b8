//! Identification of a stage of several axes: records with several drives and positions in, a result out.

use hysteresis_identify::{self as identification, AxesHysteresis, AxesOptions, AxesPlace, AxesRecord};
use hysteresis_python_macros::{function, methods};
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use pythonize::pythonize;

use super::diagnose::Finding;
use crate::argument::{CountOrAuto, SampleCount, Words};
use crate::convert::arrays::{array, check_room, copy, read_only};
use crate::convert::errors::{self, Place};
use crate::stage::multi_axis_stage::MultiAxisStage;

/// What `identify_axes` found: a stage of several axes, and how well it follows its records.
///
/// Errors are in the units of the positions, one for each. "Held out" are samples to which the model that is judged
/// was not fitted; the model that is handed out was then fitted to all.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> rng = np.random.default_rng(1)
/// >>> u = rng.standard_normal((3000, 2))  # V
/// >>> plant = mh.MultiAxisStage([[0.8, 0.1], [0.0, 0.7]], [[0.2, 0.0], [0.0, 0.3]], np.eye(2), np.zeros((2, 2)),
/// ...     bw=np.zeros((2, 0)), cq=np.zeros((0, 2)), dq=np.zeros((0, 2)), operators=[], dt=1e-3)
/// >>> y = plant.forward().run(u)  # a record: yours is measured
/// >>> found = mh.identify_axes(u, y, dt=1e-3, order=2, hysteresis="none")
/// >>> bool((found.errors < 1e-6).all())
/// True
/// >>> found.hysteresis, found.place
/// ('none', 'none')
#[pyclass(module = "mpi_hyst.results", frozen)]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub(crate) struct AxesIdentification(identification::AxesIdentification);

type Numbers<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

#[methods]
impl AxesIdentification {
    /// The stage.
    #[getter]
    fn model(&self) -> MultiAxisStage {
        MultiAxisStage(self.0.model.clone())
    }

    /// The hysteresis that was chosen: "none", "plays" or "duhem".
    #[getter]
    #[py(-> "Literal['none', 'plays', 'duhem']")]
    fn hysteresis(&self) -> &str {
        &self.0.hysteresis
    }

    /// Where it stands: "in_front" of the dynamics, or "inside" them.
    #[getter]
    #[py(-> "Literal['none', 'in_front', 'inside']")]
    fn place(&self) -> &str {
        &self.0.place
    }

    /// The rms error of each position over all fitted samples, noise included.
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        read_only(py, self.0.errors.iter().copied())
    }

    /// That of the chosen structure over samples to which it was not fitted.
    #[getter]
    fn held_out_errors<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        read_only(py, self.0.held_out_errors.iter().copied())
    }

    /// That of the best linear model over the same samples.
    #[getter]
    fn linear_errors<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        read_only(py, self.0.linear_errors.iter().copied())
    }

    /// The standard deviation of each position over all records.
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        read_only(py, self.0.deviations.iter().copied())
    }

    /// The modes from the lowest frequency up, each (frequency in Hz, damping ratio): of A, what rings while all
    /// operators stand.
    #[getter]
    fn modes(&self) -> Vec<(f64, f64)> {
        self.0.modes.iter().map(|mode| (*mode).into()).collect()
    }

    /// Standard errors of `modes`, of frequency and damping ratio of each.
    ///
    /// These, `operators_std` and `output_offset_std` are for noise with the spectrum of what the model leaves. What
    /// the model lacks and follows the drives is not in them. The matrices have none: other coordinates of the states,
    /// or a larger w with a smaller bw, are the same stage.
    #[getter]
    fn modes_std(&self) -> Vec<(f64, f64)> {
        let errors = &self.0.standard_errors;
        errors.frequencies.iter().copied().zip(errors.dampings.iter().copied()).collect()
    }

    /// Standard errors of the operators of `model`: an array for each, of the weights of its plays, or of f+ and then
    /// f- at its knots. They hold where w moves the positions, and the drives move q, by as much as in `model`: beside
    /// bw and cq the records tell no more. Infinite where the records do not tell a number; NaN for f at its bound.
    #[getter]
    #[py(-> "list[Vector]")]
    fn operators_std<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        self.0.standard_errors.operators.iter().map(|errors| read_only(py, errors.iter().copied())).collect()
    }

    /// Standard errors of the output offsets of `model`.
    #[getter]
    fn output_offset_std<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        read_only(py, self.0.standard_errors.output_offset.iter().copied())
    }

    /// All structures that were tried: name, states, parameters; fitted and held_out, rms errors over standard
    /// deviations; chosen, true for one of them.
    #[getter]
    #[py(-> "list[dict[str, Any]]")]
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
    /// - "poor_fit": the model leaves more than noise of a position.
    /// - "hysteresis_inside_not_told": a linear model predicts samples that were not fitted as well.
    /// - "memory_not_told": curves without memory in the place of the hysteresis do so.
    #[getter]
    fn warnings(&self) -> Vec<Finding> {
        self.0.warnings.iter().cloned().map(Finding::from).collect()
    }

    /// How many passes over the records the search took.
    #[getter]
    fn evaluations(&self) -> usize {
        self.0.evaluations
    }

    /// The numbers as a text.
    fn summary(&self) -> String {
        self.0.summary()
    }

    fn __repr__(&self) -> String {
        format!(
            "<AxesIdentification: {}, {} states, hysteresis {} ({})>",
            self.verdict(),
            self.0.model.states(),
            self.0.hysteresis,
            self.0.place
        )
    }
}

/// Bytes for each number of a record that a fit needs: copies in other units.
const FIT_AXES: usize = 64;

/// A kind of hysteresis, or "auto".
#[derive(Clone, Copy, PartialEq)]
struct AnyHysteresis(Option<AxesHysteresis>);

impl Words for AnyHysteresis {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("auto", Self(None)),
        ("none", Self(Some(AxesHysteresis::None))),
        ("plays", Self(Some(AxesHysteresis::Plays))),
        ("duhem", Self(Some(AxesHysteresis::Duhem))),
    ];
}

impl From<AnyHysteresis> for Option<AxesHysteresis> {
    fn from(AnyHysteresis(hysteresis): AnyHysteresis) -> Self {
        hysteresis
    }
}

/// A place, or "auto".
#[derive(Clone, Copy, PartialEq)]
struct AnyPlace(Option<AxesPlace>);

impl Words for AnyPlace {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("auto", Self(None)),
        ("in_front", Self(Some(AxesPlace::InFront))),
        ("inside", Self(Some(AxesPlace::Inside))),
    ];
}

impl From<AnyPlace> for Option<AxesPlace> {
    fn from(AnyPlace(place): AnyPlace) -> Self {
        place
    }
}

/// Rows of samples, and how many columns they have.
struct Rows {
    numbers: Vec<f64>,
    columns: usize,
}

/// One matrix, or one for each record: a list of them, or an array of more dimensions.
fn signals(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Rows>> {
    let dimensions = |value: &Bound<'_, PyAny>| {
        value.getattr("shape").and_then(|shape| shape.extract::<Vec<usize>>()).unwrap_or_default()
    };
    if let [records, periods, samples, channels] = dimensions(value)[..] {
        let Some(rows) = periods.checked_mul(samples) else { return Err(errors::no_memory(name, samples)) };
        return signals(name, &value.call_method1("reshape", ((records, rows, channels),))?);
    }
    let one = |place: Place<'_>, value: &Bound<'_, PyAny>| {
        let given = array::<Ix2>(place, value, format_args!("an array of shape (samples, channels)"))?;
        Ok(Rows { columns: given.shape()[1], numbers: copy(name, given.as_slice()?)? })
    };
    let is_stack = dimensions(value).len() == 3;
    let is_list = is_stack || value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
    let items: Vec<_> = if is_list { value.try_iter()?.collect::<PyResult<_>>()? } else { Vec::new() };
    // A list of lists of numbers is one record.
    if !items.iter().any(|item| dimensions(item).len() == 2) {
        return Ok(vec![one(Place::from(name), value)?]);
    }
    let all = items.iter().enumerate().map(|(i, item)| {
        let shown = format!("{name}[{i}]");
        one(Place::part(name, &shown), item)
    });
    all.collect()
}

/// Identifies several axes with hysteresis in front of or inside dynamics that they share, from records of all drives
/// and positions.
///
/// The model is that of `MultiAxisStage`: x+ = A x + B u + Bw w, q = Cq x + Dq u, w = H\[q\], y = C x + D u + offset,
/// with an operator for each drive or, inside the dynamics, for each position.
///
/// The search begins at linear models, by a subspace method whose order held-out samples choose. Then each drive gets
/// an operator in front of the dynamics (q = u), and these may then see the states. Inside the dynamics it also begins
/// with operators that see the positions, or what a mode gives to them. All numbers descend by Levenberg-Marquardt
/// steps with forward tangents. Every structure is fitted to a part of the records and judged by a free simulation of
/// the rest: the last 30 % of several records, or of the samples of one. The best of each kind in front and inside get
/// more thresholds or knots if that pays, and the best of them is fitted to all. It is stable, and so is what the
/// steepest and the flattest operators make of it.
///
/// Parameters
/// ----------
/// u, y : arrays of shape (samples, m) and (samples, p), or several of them
///     Drives and measured positions, y[k] read at the moment at which u[k] is put out. Several records are several
///     realisations of the same interval, each from rest at u = 0: a list of arrays, or one of shape (realisations,
///     samples, m). Periods follow each other within a record: shape (realisations, periods, samples, m) says so, too.
/// dt : float
///     The sampling interval in seconds.
/// order : "auto" or int
///     The number of states, without those of the operators; 40 at most.
/// hysteresis : "auto", "none", "plays" or "duhem"
///     Its kind. "auto" takes what predicts best, "none" too.
/// place : "auto", "in_front" or "inside"
///     Whether an operator sees its drive, or a combination of states and drives.
/// skip : int
///     Leading samples of each record that are simulated but not fitted.
///
/// Returns
/// -------
/// AxesIdentification
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> rng = np.random.default_rng(1)
/// >>> plant = mh.MultiAxisStage([[0.8]], [[0.2]], [[1.0]], [[0.0]],
/// ...     bw=[[0.1]], cq=[[0.0]], dq=[[1.0]], operators=[([0.5, 1.0], [1.0, 1.0])], dt=1e-3)
/// >>> u = np.convolve(rng.standard_normal(4009), np.ones(10) / 3, "valid")[:, None]  # V
/// >>> y = plant.forward().run(u)  # a record: yours is measured
/// >>> found = mh.identify_axes(u, y, dt=1e-3, order=1, hysteresis="plays", place="in_front")
/// >>> bool(found.held_out_errors[0] < 0.3 * found.linear_errors[0])
/// True
#[function]
#[gather(options: AxesOptions = AxesOptions::default())]
pub(crate) fn identify_axes(
    py: Python<'_>,
    #[py("ArrayLike | Sequence[ArrayLike]")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike | Sequence[ArrayLike]")] y: &Bound<'_, PyAny>,
    #[py(*)] dt: f64,
    #[py(field = "auto")] order: CountOrAuto,
    #[py(field = "auto")] hysteresis: AnyHysteresis,
    #[py(field = "auto")] place: AnyPlace,
    #[py(= 0)] skip: SampleCount,
) -> PyResult<AxesIdentification> {
    // Copies: other threads may change the arrays while the interpreter is let go.
    let (drives, positions) = (signals("u", u)?, signals("y", y)?);
    if drives.len() != positions.len() {
        let (expected, got) = (drives.len(), positions.len());
        return Err(errors::value("y", format_args!("expected as many records as u has, {expected}, got {got}")));
    }
    for (name, all) in [("u", &drives), ("y", &positions)] {
        let expected = all[0].columns;
        if let Some(i) = all.iter().position(|rows| rows.columns != expected) {
            let (shown, got) = (format!("{name}[{i}]"), all[i].columns);
            let message = format!("expected {expected} columns, as the first record has, got {got}");
            return Err(errors::value(Place::part(name, &shown), message));
        }
    }
    let room = |rows: &[Rows]| rows.iter().map(|rows| rows.numbers.len()).sum::<usize>();
    check_room("u", room(&drives) + room(&positions), FIT_AXES)?;
    let options = AxesOptions { skip: skip.0, ..options };
    let (m, p, count) = (drives[0].columns, positions[0].columns, drives.len());
    let found = py.detach(|| {
        let pairs = drives.iter().zip(&positions);
        let records: Vec<_> = pairs.map(|(u, y)| AxesRecord { u: &u.numbers, y: &y.numbers }).collect();
        identification::identify_axes(&records, m, p, dt, &options)
    });
    found.map(AxesIdentification).map_err(|error| errors::of_records(error, count))
}
