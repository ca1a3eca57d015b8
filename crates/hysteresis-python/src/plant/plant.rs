//! Plants: of one axis, and of several that are coupled.

use std::num::NonZeroUsize;

use hysteresis_control::linear::{self, LinearDynamics};
use hysteresis_control::stage::{self, StageParts};
use hysteresis_python_macros::methods;
use hysteresis_simulate::plant::{self, PlantOptions};
use numpy::ndarray::{Dim, Ix2};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use pythonize::pythonize;

use crate::argument::Asked;
use crate::convert::arrays::{array, read_only, zeros};
use crate::convert::errors::{self, raise, unexpected};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::stage::stage::{Stage, stage_or_around};
use crate::stream::blocks::BLOCK;

/// A stage between its two converters, as a controller sees it: drive in, measurement out.
///
/// `measured` and `position` are those of now; `step(drive)` holds the drive for `dt` and returns the next measurement,
/// read just before the next drive is put out. `run(drives)` returns the rows of a record instead. A plant starts at
/// rest: the drive has been 0, or the limit nearest to it, since forever. A drive beyond the limits is clamped, one
/// that is not finite leaves the one before; either is counted.
///
/// Parameters
/// ----------
/// stage : Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     A model with the keywords `dynamics`, `amplifier_bandwidth`, `creep`, `dead_time`, `noise` and `limits`, which
///     mean what they mean for a Stage, makes a stage.
/// dt : float
///     Sampling interval in seconds.
/// seed : int
///     Seed of the noise: the same seed gives the same numbers. White Gaussian noise by xoshiro256++ and the ziggurat
///     method.
/// dac_bits : int, optional
///     D/A converter: the nearest of 2^bits levels from one limit to the other, both included. Needs `limits`.
/// adc_bits, adc_range : int and (low, high), optional
///     A/D converter: the nearest of 2^bits levels from low to high, in the unit of the position.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> plant = mh.plant.Plant(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016,
/// ...                        limits=(-560.0, 560.0), dac_bits=16, adc_bits=24, adc_range=(-5.0, 5.0), dt=1e-4, seed=1)
/// >>> measured, position = plant.run([300.0] * 100)
/// >>> bool(abs(position[0]) < 1e-3), bool(abs(position[-1] - plant.position) < 1e-3)
/// (True, True)
/// >>> plant.reset()
/// >>> bool(plant.step(300.0) == measured[1])
/// True
/// >>> _ = plant.step(float("nan")), plant.step(900.0)
/// >>> plant.drive, plant.rejected, plant.clamped
/// (560.0, 1, 1)
#[pyclass(module = "mpi_hyst.plant")]
pub(crate) struct Plant {
    pub(crate) plant: plant::Plant,
    pub(super) options: PlantOptions,
}

/// What a plant has besides its stage.
#[derive(Default)]
pub(crate) struct Converters {
    pub(crate) seed: u64,
    pub(crate) dac_bits: Option<NonZeroUsize>,
    pub(crate) adc_bits: Option<NonZeroUsize>,
    pub(crate) adc_range: Option<(f64, f64)>,
}

impl Plant {
    /// The plant at 10 kHz without converters around a stage, with this seed of its noise.
    pub(crate) fn of_seed(stage: &stage::Stage, seed: u64) -> PyResult<Self> {
        let options = PlantOptions { seed, ..PlantOptions::new(1e-4) };
        Ok(Self { plant: plant::Plant::new(stage, &options).map_err(raise)?, options })
    }

    /// The plant around a stage.
    pub(crate) fn of(stage: &stage::Stage, dt: f64, converters: &Converters) -> PyResult<Self> {
        let Converters { seed, dac_bits, adc_bits, adc_range } = *converters;
        let options = PlantOptions {
            seed,
            dac_bits: dac_bits.map(bits),
            adc: adc(adc_bits.map(bits), adc_range)?,
            ..PlantOptions::new(dt)
        };
        let plant = plant::Plant::new(stage, &options).map_err(raise)?;
        Ok(Self { plant, options })
    }
}

#[methods]
impl Plant {
    #[new]
    #[gather(converters: Converters)]
    fn new(
        #[py("Model | Stage")] stage: &Bound<'_, PyAny>,
        #[py(*)] dt: f64,
        #[py(field = 0)] seed: u64,
        #[py(field = None)] dac_bits: Option<NonZeroUsize>,
        #[py(field = None)] adc_bits: Option<NonZeroUsize>,
        #[py(field, "Sequence[float] | None" = None)] adc_range: Option<(f64, f64)>,
        #[py(= None)] dynamics: LinearDynamics,
        #[py(= None)] amplifier_bandwidth: Option<linear::FirstOrder>,
        #[py("Creep | None" = None)] creep: Option<linear::Creep>,
        #[py(= 0.0)] dead_time: Asked<f64>,
        #[py(= None)] noise: Option<f64>,
        #[py("Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
    ) -> PyResult<Self> {
        let amplifier = amplifier_bandwidth;
        let parts = StageParts { dynamics, amplifier, creep, noise, limits, ..StageParts::default() };
        Self::of(&stage_or_around("stage", stage, parts, dead_time)?, dt, &converters)
    }

    /// Holds the drive for one sampling interval and returns the measurement at its end.
    fn step(slf: &Bound<'_, Self>, drive: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.plant.step(drive))
    }

    /// The measurement of now: `measured`. With `write` a plant is used as hardware is, as `simulate` does with any
    /// object.
    fn read(&self) -> f64 {
        self.plant.measured()
    }

    /// Holds the drive for one sampling interval: `step` without the measurement, which `read` returns.
    fn write(slf: &Bound<'_, Self>, drive: f64) -> PyResult<()> {
        exclusive(slf)?.plant.step(drive);
        Ok(())
    }

    /// Takes an array of drives and returns the rows of a record, (measured, position): both at the moment at which the
    /// drive is put out.
    fn run<'py>(slf: &Bound<'py, Self>, drives: PyReadonlyArray1<'py, f64>) -> PyResult<(Vector<'py>, Vector<'py>)> {
        let py = drives.py();
        let samples = drives.as_slice()?;
        let (measured, position) = (zeros(py, Dim(samples.len()))?, zeros(py, Dim(samples.len()))?);
        {
            let mut plant = exclusive(slf)?;
            let (mut measured, mut position) = (measured.readwrite(), position.readwrite());
            let outputs = measured.as_slice_mut()?.chunks_mut(BLOCK).zip(position.as_slice_mut()?.chunks_mut(BLOCK));
            for (drives, (measured, position)) in samples.chunks(BLOCK).zip(outputs) {
                py.check_signals()?;
                plant.plant.run(drives, measured, position).map_err(raise)?;
            }
        }
        Ok((measured, position))
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval.
    fn follow(slf: &Bound<'_, Self>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.plant.follow(drives.as_slice()?).map_err(raise)
    }

    /// Back to the start, at rest: the same drives give the same measurements again, noise included.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.plant.reset();
        Ok(())
    }

    /// The stage between the converters.
    #[getter]
    fn stage(&self) -> Stage {
        Stage(self.plant.stage().clone())
    }

    /// A plant in the same state that goes on by itself.
    pub(super) fn copy(&self) -> Self {
        Self { plant: self.plant.clone(), options: self.options }
    }

    /// The measurement of now, um.
    #[getter]
    fn measured(&self) -> f64 {
        self.plant.measured()
    }

    /// The true position of now, um.
    #[getter]
    fn position(&self) -> f64 {
        self.plant.position()
    }

    /// The drive that the D/A converter put out last, V.
    #[getter]
    fn drive(&self) -> f64 {
        self.plant.drive()
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.plant.limits()
    }

    /// Sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.plant.dt()
    }

    /// Sub-steps per sample: 1, or 8 to 64 if an amplifier comes before hysteresis and dynamics:
    /// ceil(16 2 pi (f_amplifier + f_dynamics) dt).
    #[getter]
    fn sub_steps(&self) -> u32 {
        self.plant.sub_steps()
    }

    /// How many drives were not finite, or beyond 1e100: the one before was held.
    #[getter]
    fn rejected(&self) -> u64 {
        self.plant.events().rejected
    }

    /// How many drives were clamped to the limits.
    #[getter]
    fn clamped(&self) -> u64 {
        self.plant.events().clamped
    }

    /// How many measurements were clamped to the range of the A/D converter.
    #[getter]
    fn overrange(&self) -> u64 {
        self.plant.events().overrange
    }

    /// Everything that the plant remembers, as a dictionary to keep; set it to continue from there bit for bit, noise
    /// included.
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
        let PlantOptions { dt, seed, dac_bits, adc } = this.options;
        let (adc_bits, adc_range) = adc.unzip();
        let keywords =
            keywords!(py, dt = dt, seed = seed, dac_bits = dac_bits, adc_bits = adc_bits, adc_range = adc_range,);
        reduce(py.get_type::<Self>().into_any(), (this.stage(),), keywords, Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let limits = self.limits().map_or("none".to_owned(), |(low, high)| format!("({low:?}, {high:?})"));
        format!("<Plant: dt {:?} s, limits {limits}, position {:?}>", self.dt(), self.position())
    }
}

/// A number of bits; the plant says how many there may be.
fn bits(bits: NonZeroUsize) -> u32 {
    u32::try_from(bits.get()).unwrap_or(u32::MAX)
}

/// Bits and range of the A/D converter, which go together.
fn adc(adc_bits: Option<u32>, adc_range: Option<(f64, f64)>) -> PyResult<Option<(u32, (f64, f64))>> {
    match (adc_bits, adc_range) {
        (None, None) => Ok(None),
        (Some(bits), Some(range)) => Ok(Some((bits, range))),
        (Some(_), None) => Err(errors::value("adc_range", "expected (low, high) for adc_bits to span, got none")),
        (None, Some(_)) => Err(errors::value("adc_bits", "expected the bits that span adc_range, got none")),
    }
}

type Vector<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// Several plants that move the same axes: an XY stage with crosstalk, or a tip-tilt-piston mirror on three actuators.
///
/// y = K p, with p the positions of the single plants and y those of the axes. Sensor i shows measured_i = y_i +
/// noise_i; noise_i is what the sensor of plant i adds, its `measured` minus its `position`. Drive i goes to plant i.
/// The rest is as for `Plant`, with arrays of N numbers, one for each axis: `step(drives)` holds the drives for `dt`
/// and returns the next measurements.
///
/// Parameters
/// ----------
/// plants : list of N Plants
///     With the same `dt`. Copies are taken, in the state in which they are. Plants of the same seed have the same
///     noise.
/// coupling : array of shape (N, N)
///     K, in the unit of the axes over that of the plants: finite, with a condition number (of the largest column sum)
///     of at most 1e10.
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
    fn step<'py>(slf: &Bound<'py, Self>, drives: PyReadonlyArray1<'py, f64>) -> PyResult<Vector<'py>> {
        exclusive(slf)?.plant.step(drives.as_slice()?).map_err(raise)?;
        Ok(PyArray1::from_slice(slf.py(), shared(slf)?.plant.measured()))
    }

    /// The measurements of now, as an array that is yours.
    fn read<'py>(&self, py: Python<'py>) -> Vector<'py> {
        PyArray1::from_slice(py, self.plant.measured())
    }

    /// Holds the drives for one sampling interval: `step` without the measurements, which `read` returns.
    fn write(slf: &Bound<'_, Self>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.plant.step(drives.as_slice()?).map_err(raise)
    }

    /// Takes drives of shape (samples, N) and returns the rows of a record, (measured, position), both of that shape
    /// and at the moment at which the drives are put out.
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

    /// Everything that the plants remember, as a dictionary to keep; set it to continue from there bit for bit, noise
    /// included.
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
