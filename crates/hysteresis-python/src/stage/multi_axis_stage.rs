//! A stage of several axes with hysteresis in front of or inside its dynamics, and its stream.

use std::path::PathBuf;

use hysteresis_control::multi_axis::{self, Matrices, MultiAxisForwardState, PrecompensationOptions, ScalarOperator};
use hysteresis_core::{DuhemForward, Play};
use hysteresis_python_macros::methods;
use nalgebra::DMatrix;
use numpy::ndarray::{Dim, Ix1, Ix2};
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyType};
use pythonize::pythonize;

use crate::argument::Class;
use crate::convert::arrays::{PASS, array, check_room, is_slice, numbers, read_only, zeros};
use crate::convert::errors::{self, Place, in_use, raise, unexpected};
use crate::convert::files;
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::model::duhem::Duhem;
use crate::stream::stream_arrays::columns;

/// Rows between two looks at pending signals (Ctrl-C).
const ROWS: usize = 1 << 16;

/// Several axes with hysteresis in front of or inside dynamics that they share, sampled every `dt` seconds.
///
/// x(k+1) = A x(k) + B u(k) + Bw w(k), w_i = H_i\[q_i\], q = Cq x + Dq u, y = C x + D u + offset: n states, m drives,
/// p positions, and an operator for each of the h rows of q. It is causal: w acts from the next sample on. With Cq = 0
/// hysteresis stands in front of the dynamics, with another Cq inside them. `mh.identify_axes` finds one from records.
///
/// A and what the flattest and the steepest slopes of all operators make of it, A + Bw diag(dw/dq) Cq, must have their
/// eigenvalues inside the unit circle. That is necessary for bounded motion, not sufficient.
///
/// Parameters
/// ----------
/// a, b, c, d : arrays of shape (n, n), (n, m), (p, n), (p, m)
///     The linear dynamics, with drives and positions in your units. 1 to 256 states, drives and positions.
/// bw, cq, dq : arrays of shape (n, h), (h, n), (h, m)
///     How the operators act on the states, and what they see.
/// operators : sequence of h Duhem operators or pairs (thresholds, weights)
///     A pair is a sum of plays: thresholds of at least 0 in the unit of q, weights of any sign. The memory of an
///     operator that is given does not matter.
/// dt : float
///     The sampling interval in seconds.
/// output_offset : array of p floats, optional
///     What is added to the positions; 0 by default.
/// sub_steps : int
///     How many steps are taken in an interval, with the drives held, 1 to 1000: the matrices are those of `dt /
///     sub_steps` seconds. For hysteresis inside the dynamics, whose w then acts that much later and no more.
///     Matrices come from continuous equations then, or from a record with the rate of the sub-steps. Those of a
///     slower record have no part of a step: they were fitted with w that acts a whole sample later.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// Two axes that move each other by 3 %, each with a play in front:
///
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> one = np.eye(2)
/// >>> stage = mh.MultiAxisStage(0.5 * one, 0.4 * one, [[1.0, 0.03], [-0.03, 1.0]], 0 * one,
/// ...     bw=0.1 * one, cq=0 * one, dq=one, operators=[([0.2], [1.0]), ([0.2], [1.0])], dt=1e-3)
/// >>> stage
/// <MultiAxisStage: 2 drives, 2 positions, 2 states, 2 operators, dt 0.001 s>
/// >>> forward = stage.forward()
/// >>> forward.step([1.0, 0.0])
/// array([0., 0.])
/// >>> forward.step([1.0, 0.0]).round(4)
/// array([ 0.48  , -0.0144])
#[pyclass(module = "mpi_hyst", frozen)]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub(crate) struct MultiAxisStage(pub(crate) multi_axis::MultiAxisStage);

/// The positions of a stage of several axes, sample by sample: made by `stage.forward()`.
///
/// `step(u)` returns y(k), then holds u(k) for one interval; `advance(u)` holds u(k), then returns y(k+1). A drive
/// that is not finite, or beyond 1e100, counts as the last one of its axis; a sub-step that would bring a state
/// beyond 1e100 leaves the states as they are, and is the last one of its interval. `rejected` counts both.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.MultiAxisStage([[0.5]], [[0.5]], [[2.0]], [[0.0]],
/// ...     bw=[[0.1]], cq=[[0.0]], dq=[[1.0]], operators=[([1.0], [1.0])], dt=1e-3)
/// >>> stage.forward().run([[2.0], [2.0], [0.0]])
/// array([[0. ],
///        [2.2],
///        [3.3]])
#[pyclass(module = "mpi_hyst")]
pub(crate) struct MultiAxisForward {
    stream: multi_axis::MultiAxisForward,
    made_of: Py<MultiAxisStage>,
}

impl Class for MultiAxisStage {
    const CALLED: &'static str = "a mh.MultiAxisStage";
}

impl Class for MultiAxisForward {
    const CALLED: &'static str = "a stream that `stage.forward()` made (MultiAxisForward)";
}

/// Drives, and what the model misses with them.
type Precompensated<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// A matrix of any shape.
fn matrix(name: &str, value: &Bound<'_, PyAny>) -> PyResult<DMatrix<f64>> {
    let given = array::<Ix2>(name, value, format_args!("a matrix"))?;
    let (rows, columns) = (given.shape()[0], given.shape()[1]);
    Ok(DMatrix::from_row_slice(rows, columns, given.as_slice()?))
}

/// An operator: a Duhem, or the thresholds and weights of plays.
fn operator(place: usize, value: &Bound<'_, PyAny>) -> PyResult<ScalarOperator> {
    if let Ok(duhem) = value.cast::<Duhem>() {
        return Ok(ScalarOperator::duhem(*shared(duhem)?.0.duhem()));
    }
    let shown = format!("operators[{place}]");
    let here = || Place::part("operators", &shown);
    let expected = "a mh.Duhem, or a pair (thresholds, weights) of plays";
    let Ok((thresholds, weights)) = value.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() else {
        return Err(unexpected(here(), expected, value));
    };
    let (thresholds, weights) = (numbers(here(), &thresholds)?, numbers(here(), &weights)?);
    ScalarOperator::plays(&thresholds, &weights)
        .map_err(|error| errors::value(here(), format_args!("expected {expected}: {error}")))
}

/// A pair of limits for each drive.
pub(super) fn each_limits(limits: &Bound<'_, PyAny>, drives: usize) -> PyResult<Vec<(f64, f64)>> {
    if let Ok(both) = limits.extract::<(f64, f64)>() {
        return Ok(vec![both; drives]);
    }
    let expected = format_args!("(low, high), or an array of shape ({drives}, 2)");
    let given = columns::<Ix2>("limits", limits, 2, expected)?;
    if given.shape()[0] != drives {
        let got = given.shape()[0];
        return Err(errors::value("limits", format_args!("expected {drives} rows, got {got}")));
    }
    Ok(given.as_slice()?.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect())
}

/// What is written, in `out` or a new array of a shape.
fn written<'py, D: numpy::ndarray::Dimension>(
    py: Python<'py>,
    shape: D,
    out: Option<&Bound<'py, PyAny>>,
    work: impl FnOnce(&mut [f64]) -> PyResult<()>,
) -> PyResult<Bound<'py, PyArray<f64, D>>> {
    let Some(out) = out else {
        let new = zeros(py, shape)?;
        work(new.readwrite().as_slice_mut()?)?;
        return Ok(new);
    };
    let expected = format!("a C-contiguous array of float64 of shape {:?}", shape.slice());
    let Ok(array) = out.cast::<PyArray<f64, D>>() else { return Err(unexpected("out", expected, out)) };
    if array.shape() != shape.slice() || !is_slice(array) {
        return Err(errors::value("out", format_args!("expected {expected}, got shape {:?}", array.shape())));
    }
    work(array.try_readwrite().map_err(|_| in_use("out"))?.as_slice_mut()?)?;
    Ok(array.clone())
}

#[methods]
impl MultiAxisStage {
    #[new]
    fn new(
        #[py("ArrayLike")] a: &Bound<'_, PyAny>,
        #[py("ArrayLike")] b: &Bound<'_, PyAny>,
        #[py("ArrayLike")] c: &Bound<'_, PyAny>,
        #[py("ArrayLike")] d: &Bound<'_, PyAny>,
        #[py(*, "ArrayLike")] bw: &Bound<'_, PyAny>,
        #[py("ArrayLike")] cq: &Bound<'_, PyAny>,
        #[py("ArrayLike")] dq: &Bound<'_, PyAny>,
        #[py("Iterable[Duhem | tuple[ArrayLike, ArrayLike]]")] operators: &Bound<'_, PyAny>,
        dt: f64,
        #[py("ArrayLike | None" = None)] output_offset: Option<&Bound<'_, PyAny>>,
        #[py(= 1)] sub_steps: usize,
    ) -> PyResult<Self> {
        let matrices = Matrices {
            a: matrix("a", a)?,
            b: matrix("b", b)?,
            bw: matrix("bw", bw)?,
            c: matrix("c", c)?,
            d: matrix("d", d)?,
            cq: matrix("cq", cq)?,
            dq: matrix("dq", dq)?,
        };
        let Ok(items) = operators.try_iter() else {
            return Err(unexpected("operators", "a sequence of operators", operators));
        };
        let operators = items.enumerate().map(|(i, item)| operator(i, &item?)).collect::<PyResult<Vec<_>>>()?;
        let offset = match output_offset {
            Some(offset) => numbers("output_offset", offset)?,
            None => vec![0.0; matrices.c.nrows()],
        };
        let one_step = multi_axis::MultiAxisStage::new(matrices, operators, offset, dt).map_err(raise)?;
        one_step.with_sub_steps(sub_steps).map(Self).map_err(raise)
    }

    /// A, shape (n, n).
    #[getter]
    fn a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().a)
    }

    /// B, shape (n, m).
    #[getter]
    fn b<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().b)
    }

    /// Bw, shape (n, h).
    #[getter]
    fn bw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().bw)
    }

    /// C, shape (p, n).
    #[getter]
    fn c<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().c)
    }

    /// D, shape (p, m).
    #[getter]
    fn d<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().d)
    }

    /// Cq, shape (h, n).
    #[getter]
    fn cq<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().cq)
    }

    /// Dq, shape (h, m).
    #[getter]
    fn dq<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, &self.0.matrices().dq)
    }

    /// The operators: new `Duhem` operators at rest, and pairs (thresholds, weights) of plays.
    #[getter]
    #[py(-> "list[Duhem | tuple[list[float], list[float]]]")]
    fn operators<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let all = PyList::empty(py);
        for operator in self.0.operators() {
            match operator {
                ScalarOperator::Plays { plays, weights } => {
                    all.append((plays.iter().map(Play::r).collect::<Vec<_>>(), weights))?;
                }
                ScalarOperator::Duhem(duhem) => all.append(Bound::new(py, Duhem(DuhemForward::new(**duhem)))?)?,
            }
        }
        Ok(all)
    }

    /// What is added to the positions.
    #[getter]
    fn output_offset<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.output_offset().iter().copied())
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.0.dt()
    }

    /// How many steps are taken in an interval.
    #[getter]
    fn sub_steps(&self) -> usize {
        self.0.sub_steps()
    }

    /// A stream at rest.
    fn forward(slf: &Bound<'_, Self>) -> MultiAxisForward {
        let stream = multi_axis::MultiAxisForward::new(&slf.get().0);
        MultiAxisForward { stream, made_of: slf.clone().unbind() }
    }

    /// The drives for a whole reference, for a stage with as many drives as positions, and what the model misses with
    /// them.
    ///
    /// The linear part is inverted at every frequency, so zeros outside the unit circle do no harm: drives begin before
    /// the reference moves. What the operators add is found by passes, 150 at most, until nothing changes. The
    /// reference begins where the stage is, and should stay there for as long as its dynamics ring.
    ///
    /// Parameters
    /// ----------
    /// reference : array of shape (samples, p)
    ///     The positions.
    /// limits : (low, high), or an array of shape (p, 2), optional
    ///     Of every drive, or of each. Drives are found without them, and are held at them then.
    /// start : MultiAxisForward, optional
    ///     A stream of this stage that has had every drive so far: what it remembers is gone on from, and it stays as
    ///     it is. By default the stage is at rest, at `output_offset`.
    ///
    /// Returns
    /// -------
    /// drives, missed : array of shape (samples, p), array of p floats
    ///     `missed` is the rms difference of each position of the model with these drives.
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Warns
    /// -----
    /// HeldBackWarning
    ///     If limits hold drives back: look at what is missed.
    /// UserWarning
    ///     If drives still change after the last pass: look at what is missed. If the reference begins elsewhere than
    ///     the stage is, by more than a hundredth of its span.
    ///
    /// Examples
    /// --------
    /// One scan after the other, with all that hysteresis remembers:
    ///
    /// >>> import mpi_hyst as mh
    /// >>> import numpy as np
    /// >>> one = np.eye(2)
    /// >>> stage = mh.MultiAxisStage(0.5 * one, 0.4 * one, [[1.0, 0.03], [-0.03, 1.0]], 0 * one,
    /// ...     bw=0.1 * one, cq=0 * one, dq=one, operators=[([0.2], [1.0]), ([0.2], [1.0])], dt=1e-3)
    /// >>> way = (1.0 - np.cos(np.linspace(0.0, np.pi, 100)))[:, None] / 2.0 * [1.0, 0.5]
    /// >>> there, back = np.vstack([0.0 * way, way, way[-1] + 0.0 * way]), way[::-1]
    /// >>> bench = stage.forward()
    /// >>> drives, missed = stage.precompensate(there, limits=(-5.0, 5.0))
    /// >>> _ = bench.run(drives)
    /// >>> drives, missed = stage.precompensate(np.vstack([there[-50:], back]), limits=(-5.0, 5.0), start=bench)
    /// >>> bool(missed.max() < 1e-3)
    /// True
    #[py(-> "tuple[Matrix, Vector]")]
    fn precompensate<'py>(
        &self,
        py: Python<'py>,
        #[py("ArrayLike")] reference: &Bound<'py, PyAny>,
        #[py(*, "ArrayLike | None" = None)] limits: Option<&Bound<'py, PyAny>>,
        #[py(= None)] start: Option<Bound<'py, MultiAxisForward>>,
    ) -> PyResult<Precompensated<'py>> {
        let p = self.0.positions();
        let wanted = columns::<Ix2>("reference", reference, p, format_args!("an array of shape (samples, {p})"))?;
        let samples = wanted.shape()[0];
        // Spectra, and gains at every frequency.
        let both = p + self.0.operators().len() * self.0.sub_steps();
        check_room("reference", samples, PASS * both * (both + 2))?;
        let options = PrecompensationOptions {
            limits: limits.map(|given| each_limits(given, self.0.drives())).transpose()?,
            start: start.map(|stream| self.remembered(&stream)).transpose()?,
        };
        let found = self.0.precompensate(wanted.as_slice()?, &options).map_err(raise)?;
        if !found.converged {
            errors::warn(py, "precompensate: the drives still change after 150 passes; look at what the model misses")?;
        }
        if let Some(warning) = begins_elsewhere(wanted.as_slice()?, &found.begins_off) {
            errors::warn(py, &warning)?;
        }
        errors::warn_held_back(py, found.held_back, found.drives.len(), "the limits")?;
        let drives = zeros(py, Dim([samples, p]))?;
        drives.readwrite().as_slice_mut()?.copy_from_slice(&found.drives);
        Ok((drives, PyArray1::from_vec(py, found.missed)))
    }

    /// Writes the stage to a JSON file; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let json = self.0.to_json().map_err(|error| errors::file(&path, &error))?;
        files::write_json(py, path, json)
    }

    /// The stage that `save` wrote, bit for bit.
    ///
    /// Raises OSError if the file cannot be read, ValueError if it holds no stage of several axes.
    #[classmethod]
    fn load(_: &Bound<'_, PyType>, path: PathBuf) -> PyResult<Self> {
        files::load(&path, multi_axis::MultiAxisStage::from_json).map(Self)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        let Matrices { a, b, c, .. } = self.0.matrices();
        crate::convert::objects::hash([a, b, c].into_iter().flat_map(|matrix| matrix.iter().copied()))
    }

    fn __repr__(&self) -> String {
        let stage = &self.0;
        let sub_steps = match stage.sub_steps() {
            1 => String::new(),
            several => format!(" in {several} sub-steps"),
        };
        format!(
            "<MultiAxisStage: {} drives, {} positions, {} states, {} operators, dt {:?} s{sub_steps}>",
            stage.drives(),
            stage.positions(),
            stage.states(),
            stage.operators().len(),
            stage.dt()
        )
    }
}

/// What is said of a reference that begins elsewhere than the stage is.
fn begins_elsewhere(reference: &[f64], begins_off: &[f64]) -> Option<String> {
    /// As a share of the span of a position.
    const NEAR: f64 = 0.01;
    let p = begins_off.len();
    let span = |i: usize| {
        let column = || reference.iter().skip(i).step_by(p).copied();
        column().fold(f64::NEG_INFINITY, f64::max) - column().fold(f64::INFINITY, f64::min)
    };
    let i = (0..p).find(|i| begins_off[*i].abs() > NEAR * span(*i))?;
    let (wanted, stands) = (reference[i], reference[i] - begins_off[i]);
    Some(format!(
        "reference[0, {i}]: begins at {wanted:.4}, where the stage is at {stands:.4}: that is missed, and the drives jump; put the way \
         there in front of the reference"
    ))
}

impl MultiAxisStage {
    /// What a stream of this stage remembers.
    fn remembered(&self, stream: &Bound<'_, MultiAxisForward>) -> PyResult<MultiAxisForwardState> {
        let stream = shared(stream)?;
        if stream.made_of.get().0 == self.0 {
            Ok(stream.stream.state())
        } else {
            Err(errors::value("start", "expected a stream of this stage, got one of another"))
        }
    }
}

fn rows<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let new = zeros(py, Dim([matrix.nrows(), matrix.ncols()]))?;
    // By rows, as numpy keeps them.
    new.readwrite().as_slice_mut()?.copy_from_slice(matrix.transpose().as_slice());
    Ok(new)
}

#[methods]
impl MultiAxisForward {
    /// Takes the drives, an array of m numbers, and returns the positions y(k), in `out` or a new array of p numbers;
    /// then holds the drives for one interval.
    fn step<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] u: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (m, p) = shared(slf)?.sizes();
        let drives = columns::<Ix1>("u", u, m, format_args!("an array of shape ({m},)"))?;
        written(slf.py(), Dim([p]), out, |y| exclusive(slf)?.stream.step(drives.as_slice()?, y).map_err(raise))
    }

    /// A plant in a loop: holds the drives u(k) for one interval, and returns the positions y(k+1) at its end, while
    /// they are still held.
    #[like(step)]
    fn advance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (m, p) = shared(slf)?.sizes();
        let drives = columns::<Ix1>("u", u, m, format_args!("an array of shape ({m},)"))?;
        written(slf.py(), Dim([p]), out, |y| exclusive(slf)?.stream.advance(drives.as_slice()?, y).map_err(raise))
    }

    /// Takes drives of shape (samples, m), bit for bit like `step` in a loop; returns the positions, in `out` or a new
    /// array of shape (samples, p).
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] u: &Bound<'py, PyAny>,
        #[py("Matrix | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (py, (m, p)) = (slf.py(), shared(slf)?.sizes());
        let drives = columns::<Ix2>("u", u, m, format_args!("an array of shape (samples, {m})"))?;
        let samples = drives.shape()[0];
        check_room("u", samples, p * size_of::<f64>())?;
        written(py, Dim([samples, p]), out, |y| {
            let mut this = exclusive(slf)?;
            for (u, y) in drives.as_slice()?.chunks(ROWS * m).zip(y.chunks_mut(ROWS * p)) {
                py.check_signals()?;
                this.stream.run(u, y).map_err(raise)?;
            }
            Ok(())
        })
    }

    /// Back to rest.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.stream.reset();
        Ok(())
    }

    /// How many drives were not admissible, and how many samples would have brought a state beyond 1e100.
    #[getter]
    fn rejected(&self) -> u64 {
        self.stream.rejected()
    }

    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(slf.py(), &shared(slf)?.stream.state())?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.stream.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let py = slf.py();
        let make = shared(slf)?.made_of.bind(py).getattr(intern!(py, "forward"))?;
        reduce(make, (), keywords!(py), Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let (m, p) = self.sizes();
        format!("<MultiAxisForward: {m} drives, {p} positions>")
    }
}

impl MultiAxisForward {
    fn sizes(&self) -> (usize, usize) {
        (self.stream.drives(), self.stream.positions())
    }
}
