//! Plants of several axes.

use hysteresis_python_macros::methods;
use hysteresis_simulate::plant;
use numpy::ndarray::{Dim, Ix2};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use pythonize::pythonize;

use super::plant::Plant;
use crate::convert::arrays::{array, read_only, vector, zeros};
use crate::convert::errors::{self, raise, unexpected};
use crate::convert::objects::{Reduced, keywords, reduce, saved};
use crate::convert::objects::{exclusive, shared};
use crate::stream::blocks::BLOCK;

type Vector<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// Several plants that move the same axes: an XY stage with crosstalk, or a tip-tilt-piston mirror on three actuators.
///
/// y = K p, with p the positions of the single plants and y those of the axes. Sensor i shows measured_i = y_i + noise_i; noise_i is
/// what the sensor of plant i adds, its `measured` minus its `position`. Drive i goes to plant i. The rest is as for `Plant`, with arrays of N
/// numbers, one for each axis: `step(drives)` holds the drives for `dt` and returns the next measurements.
///
/// Parameters
/// ----------
/// plants : list of N Plants
///     With the same `dt`. Copies are taken, in the state in which they are. Plants of the same seed have the same noise.
/// coupling : array of shape (N, N)
///     K, in the unit of the axes over that of the plants: finite, with a condition number (of the largest column sum) of at most 1e10.
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
/// >>> x, y = (mh.paper.plant("A1", seed=seed) for seed in (1, 2))
/// >>> stage = mh.plant.MultiAxisPlant([x, y], [[1.0, 0.03], [-0.03, 1.0]])
/// >>> measured, position = stage.run(np.tile([300.0, 0.0], (200, 1)))
/// >>> position.shape, bool(np.isclose(position[-1, 1], -0.03 * position[-1, 0]))
/// ((200, 2), True)
/// >>> bool(np.allclose(stage.position, stage.coupling @ [plant.position for plant in stage.plants]))
/// True
#[pyclass(module = "mpi_hyst.plant")]
pub(crate) struct MultiAxisPlant {
    pub(crate) plant: plant::MultiAxisPlant,
    /// The single plants as they came, which have the options.
    made_of: Vec<Py<Plant>>,
}

/// A square matrix, row by row, for so many axes.
pub(crate) fn square(name: &str, value: &Bound<'_, PyAny>, axes: usize) -> PyResult<Vec<f64>> {
    let expected = format!("an array of shape ({axes}, {axes})");
    let matrix = array::<Ix2>(name, value, format_args!("{expected}"))?;
    match matrix.shape() {
        [rows, columns] if (*rows, *columns) != (axes, axes) => {
            Err(errors::value(name, format_args!("expected {expected}, got shape ({rows}, {columns})")))
        }
        _ => Ok(matrix.as_slice()?.to_vec()),
    }
}

/// A matrix of so many columns as a new array.
pub(crate) fn as_matrix<'py>(py: Python<'py>, numbers: &[f64], columns: usize) -> PyResult<Matrix<'py>> {
    let matrix = zeros(py, Dim([numbers.len() / columns.max(1), columns]))?;
    matrix.readwrite().as_slice_mut()?.copy_from_slice(numbers);
    Ok(matrix)
}

/// The objects of a list, each of a class.
pub(crate) fn list_of<'py, C: PyClass>(
    name: &str,
    expected: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Vec<Bound<'py, C>>> {
    let Ok(items) = value.try_iter() else { return Err(unexpected(name, format_args!("a list of {expected}"), value)) };
    let mut found = Vec::new();
    for item in items {
        let item = item?;
        let Ok(object) = item.cast::<C>() else {
            let place = format!("{name}[{}]", found.len());
            return Err(unexpected(errors::Place::part(name, &place), format_args!("a {expected}"), &item));
        };
        found.push(object.clone());
    }
    Ok(found)
}

impl MultiAxisPlant {
    fn axes(&self) -> usize {
        self.plant.plants().len()
    }
}

#[methods]
impl MultiAxisPlant {
    #[new]
    fn new(
        #[py("Iterable[Plant]")] plants: &Bound<'_, PyAny>,
        #[py("ArrayLike")] coupling: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let py = plants.py();
        let plants = list_of::<Plant>("plants", "Plant", plants)?;
        let coupling = square("coupling", coupling, plants.len())?;
        let copies: Vec<Plant> = plants.iter().map(|plant| Ok(shared(plant)?.copy())).collect::<PyResult<_>>()?;
        let single = copies.iter().map(|plant| plant.plant.clone()).collect();
        let plant = plant::MultiAxisPlant::new(single, &coupling).map_err(raise)?;
        Ok(Self { plant, made_of: copies.into_iter().map(|plant| Py::new(py, plant)).collect::<PyResult<_>>()? })
    }

    /// Holds the drives for one sampling interval and returns the measurements at its end.
    fn step<'py>(slf: &Bound<'py, Self>, #[py("ArrayLike")] drives: &Bound<'py, PyAny>) -> PyResult<Vector<'py>> {
        Self::write(slf, drives)?;
        Ok(PyArray1::from_slice(slf.py(), shared(slf)?.plant.measured()))
    }

    /// The measurements of now, as an array that is yours.
    fn read<'py>(&self, py: Python<'py>) -> Vector<'py> {
        PyArray1::from_slice(py, self.plant.measured())
    }

    /// Holds the drives for one sampling interval: `step` without the measurements, which `read` returns.
    fn write(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let drives = vector("drives", drives)?;
        exclusive(slf)?.plant.step(drives.as_slice()?).map_err(raise)
    }

    /// Takes drives of shape (samples, N) and returns the rows of a record, (measured, position), both of that shape and at
    /// the moment at which the drives are put out.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] drives: &Bound<'py, PyAny>,
    ) -> PyResult<(Matrix<'py>, Matrix<'py>)> {
        let (py, axes) = (slf.py(), shared(slf)?.axes());
        let expected = format!("an array of shape (samples, {axes})");
        let drives = array::<Ix2>("drives", drives, format_args!("{expected}"))?;
        let [samples, columns] = [drives.shape()[0], drives.shape()[1]];
        if columns != axes {
            return Err(errors::value("drives", format_args!("expected {expected}, got shape ({samples}, {columns})")));
        }
        let (measured, position) = (zeros(py, Dim([samples, axes]))?, zeros(py, Dim([samples, axes]))?);
        {
            let mut plant = exclusive(slf)?;
            let (mut measured, mut position) = (measured.readwrite(), position.readwrite());
            let block = (BLOCK / axes).max(1) * axes;
            let outputs = measured.as_slice_mut()?.chunks_mut(block).zip(position.as_slice_mut()?.chunks_mut(block));
            for (drives, (measured, position)) in drives.as_slice()?.chunks(block).zip(outputs) {
                py.check_signals()?;
                plant.plant.run(drives, measured, position).map_err(raise)?;
            }
        }
        Ok((measured, position))
    }

    /// Back to the start, at rest: the same drives give the same measurements again, noise included.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.plant.reset();
        Ok(())
    }

    /// The single plants, as copies in their present states.
    #[getter]
    #[py(-> "tuple[Plant, ...]")]
    fn plants<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let pairs = self.plant.plants().iter().zip(&self.made_of);
        let copies =
            pairs.map(|(plant, made)| Bound::new(py, Plant { plant: plant.clone(), options: made.borrow(py).options }));
        PyTuple::new(py, copies.collect::<PyResult<Vec<_>>>()?)
    }

    /// K, as an array of shape (N, N).
    #[getter]
    fn coupling<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        as_matrix(py, self.plant.coupling().entries(), self.axes())
    }

    /// A plant in the same state that goes on by itself.
    fn copy(&self, py: Python<'_>) -> Self {
        Self { plant: self.plant.clone(), made_of: self.made_of.iter().map(|plant| plant.clone_ref(py)).collect() }
    }

    /// The measurements of now.
    #[getter]
    fn measured<'py>(&self, py: Python<'py>) -> PyResult<Vector<'py>> {
        read_only(py, self.plant.measured().iter().copied())
    }

    /// The true positions of now.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Vector<'py>> {
        read_only(py, self.plant.position().iter().copied())
    }

    /// The drives that were put out last, V.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> PyResult<Vector<'py>> {
        read_only(py, self.plant.plants().iter().map(plant::Plant::drive))
    }

    /// The limits of the drives, an array of shape (N, 2): infinite where a plant has none.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> PyResult<Matrix<'py>> {
        let limits = |plant: &plant::Plant| plant.limits().unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let flat: Vec<f64> = self.plant.plants().iter().map(limits).flat_map(<[f64; 2]>::from).collect();
        as_matrix(py, &flat, 2)
    }

    /// Sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.plant.dt()
    }

    /// Everything that the plants remember, as a dictionary to keep; set it to continue from there bit for bit, noise included.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.plant.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.plant.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let parts = (this.plants(py)?, this.coupling(py)?);
        reduce(py.get_type::<Self>().into_any(), parts, keywords!(py), None)
    }

    fn __len__(&self) -> usize {
        self.axes()
    }

    fn __repr__(&self) -> String {
        format!("<MultiAxisPlant of {} axes: dt {:?} s, position {:?}>", self.axes(), self.dt(), self.plant.position())
    }
}
