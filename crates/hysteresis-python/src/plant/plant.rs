//! Plants: an actuator between its converters.

use hysteresis_control::linear::Delay;
use hysteresis_simulate::plant::{self, PlantOptions};
use numpy::ndarray::Dim;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

use crate::control::linear::creep::given_creep;
use crate::control::linear::part::{amplifier, given_dynamics};
use crate::convert::arguments::{count, numbers, pair, whole};
use crate::convert::arrays::{vector, zeros};
use crate::convert::errors::{self, raise};
use crate::convert::objects::exclusive;
use crate::model::object::kernel_of;
use crate::stream::blocks::BLOCK;

type Vector<'py> = Bound<'py, PyArray1<f64>>;

/// An actuator between its two converters, as a controller sees it: drive in, measurement out.
///
/// drive -> D/A converter, limits -> amplifier -> hysteresis -> dynamics -> creep -> dead time -> position
/// -> noise -> A/D converter -> measurement
///
/// `measured` and `position` are those of now; `step(drive)` holds the drive for `dt` and returns the next measurement.
/// A plant starts at rest: the drive has been 0, or the limit nearest to it, since forever. A drive beyond the limits is
/// clamped, one that is not finite leaves the one before; either is counted.
///
/// All blocks are discretised exactly for a held drive, but for hysteresis between an amplifier and dynamics: there each
/// of `sub_steps` per sample holds the mean of the model's outputs at its ends. On the plant "P3" of the paper that
/// leaves 0.005 nm of a sine of 20 Hz, and 0.2 nm after steps across the whole range.
///
/// Parameters
/// ----------
/// hysteresis : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     Drive (V) in, displacement (um) out.
/// dynamics : SecondOrder or FirstOrder, optional
///     Behind the hysteresis.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of the amplifier, a first-order lag before the hysteresis.
/// creep : Creep, optional
///     Of the position.
/// dead_time : float
///     What the sensor shows later than hysteresis and dynamics explain, in seconds.
/// noise : float
///     Rms of the white Gaussian measurement noise, um: xoshiro256++ seeded by SplitMix64, normal by the ziggurat
///     method, one number per sample.
/// dac_bits : int, optional
///     D/A converter: the nearest of 2^bits levels from one limit to the other, both included. Needs `limits`.
/// adc_bits, adc_range : int and (low, high), optional
///     A/D converter: the nearest of 2^bits levels from low to high, um.
/// limits : (low, high), optional
///     Of the drive.
/// dt : float
///     Sampling interval in seconds.
/// seed : int
///     Of the noise: the same seed gives the same numbers.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.plant.Plant(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016,
/// ...                  limits=(-560.0, 560.0), dac_bits=16, adc_bits=24, adc_range=(-5.0, 5.0), dt=1e-4, seed=1)
/// >>> measured, position = stage.run([300.0] * 100)
/// >>> bool(measured[-1] == stage.measured), bool(position[-1] == stage.position)
/// (True, True)
/// >>> stage.reset()
/// >>> bool(stage.step(300.0) == measured[0])
/// True
/// >>> _ = stage.step(float("nan")), stage.step(900.0)
/// >>> stage.drive, stage.rejected, stage.clamped
/// (560.0, 1, 1)
#[pyclass(module = "mpi_hyst.plant")]
pub(crate) struct Plant(pub(crate) plant::Plant);

#[pymethods]
impl Plant {
    #[new]
    #[pyo3(
        signature = (hysteresis, *, dynamics=None, amplifier_bandwidth=None, creep=None, dead_time=None, noise=None, dac_bits=None,
            adc_bits=None, adc_range=None, limits=None, dt, seed=None),
        text_signature = "(hysteresis, *, dynamics=None, amplifier_bandwidth=None, creep=None, dead_time=0.0, noise=0.0, \
            dac_bits=None, adc_bits=None, adc_range=None, limits=None, dt, seed=0)"
    )]
    #[expect(clippy::too_many_arguments, reason = "one per keyword of the Python class")]
    fn new(
        hysteresis: &Bound<'_, PyAny>,
        dynamics: Option<&Bound<'_, PyAny>>,
        amplifier_bandwidth: Option<&Bound<'_, PyAny>>,
        creep: Option<&Bound<'_, PyAny>>,
        dead_time: Option<&Bound<'_, PyAny>>,
        noise: Option<&Bound<'_, PyAny>>,
        dac_bits: Option<&Bound<'_, PyAny>>,
        adc_bits: Option<&Bound<'_, PyAny>>,
        adc_range: Option<&Bound<'_, PyAny>>,
        limits: Option<&Bound<'_, PyAny>>,
        dt: &Bound<'_, PyAny>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let default = PlantOptions::default();
        numbers!(amplifier_bandwidth, dead_time, noise = default.noise, dt);
        let design = PlantOptions {
            amplifier: amplifier_bandwidth.map(amplifier).transpose()?,
            dynamics: dynamics.map(given_dynamics).transpose()?,
            creep: creep.map(given_creep).transpose()?,
            delay: dead_time.map_or(Ok(default.delay), Delay::new).map_err(raise)?,
            noise,
            seed: seed.map_or(Ok(default.seed), |seed| whole::<u64>("seed", seed))?,
            limits: limits.map(|limits| pair("limits", limits)).transpose()?,
            dac_bits: dac_bits.map(|value| bits("dac_bits", value)).transpose()?,
            adc: adc(adc_bits, adc_range)?,
            dt,
        };
        plant::Plant::new(&kernel_of("hysteresis", hysteresis)?, &design).map(Self).map_err(raise)
    }

    /// Holds the drive for one sampling interval and returns the measurement at its end.
    fn step(slf: &Bound<'_, Self>, drive: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.0.step(drive))
    }

    /// Takes an array of drives: (measured, position) at the end of the interval of each, bit for bit like `step` in a
    /// loop.
    fn run<'py>(slf: &Bound<'py, Self>, drives: &Bound<'py, PyAny>) -> PyResult<(Vector<'py>, Vector<'py>)> {
        let py = drives.py();
        let drives = vector("drives", drives)?;
        let samples = drives.as_slice()?;
        let (measured, position) = (zeros(py, Dim(samples.len()))?, zeros(py, Dim(samples.len()))?);
        {
            let mut plant = exclusive(slf)?;
            let (mut measured, mut position) = (measured.readwrite(), position.readwrite());
            let outputs = measured.as_slice_mut()?.chunks_mut(BLOCK).zip(position.as_slice_mut()?.chunks_mut(BLOCK));
            for (drives, (measured, position)) in samples.chunks(BLOCK).zip(outputs) {
                py.check_signals()?;
                plant.0.run(drives, measured, position).map_err(raise)?;
            }
        }
        Ok((measured, position))
    }

    /// Back to the start, at rest: the same drives give the same measurements again, noise included.
    fn reset(&mut self) {
        self.0.reset();
    }

    /// A plant in the same state that goes on by itself.
    fn copy(&self) -> Self {
        Self(self.0.clone())
    }

    /// The measurement of now, um.
    #[getter]
    fn measured(&self) -> f64 {
        self.0.measured()
    }

    /// The true position of now, um.
    #[getter]
    fn position(&self) -> f64 {
        self.0.position()
    }

    /// The drive that the D/A converter put out last, V.
    #[getter]
    fn drive(&self) -> f64 {
        self.0.drive()
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.0.limits()
    }

    /// Sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.0.dt()
    }

    /// Sub-steps per sample: 1, or 8 to 64 if an amplifier comes before hysteresis and dynamics:
    /// ceil(16 2 pi (f_amplifier + f_dynamics) dt).
    #[getter]
    fn sub_steps(&self) -> u32 {
        self.0.sub_steps()
    }

    /// How many drives were not finite, or beyond 1e100: the one before was held.
    #[getter]
    fn rejected(&self) -> u64 {
        self.0.events().rejected
    }

    /// How many drives were clamped to the limits.
    #[getter]
    fn clamped(&self) -> u64 {
        self.0.events().clamped
    }

    /// How many measurements were clamped to the range of the A/D converter.
    #[getter]
    fn overrange(&self) -> u64 {
        self.0.events().overrange
    }

    fn __repr__(&self) -> String {
        let limits = self.limits().map_or("none".to_owned(), |(low, high)| format!("({low:?}, {high:?})"));
        format!("<Plant: dt {:?} s, limits {limits}, position {:?}>", self.dt(), self.position())
    }
}

/// A number of bits; the plant says how many there may be.
fn bits(name: &str, value: &Bound<'_, PyAny>) -> PyResult<u32> {
    Ok(u32::try_from(count(name, value)?).unwrap_or(u32::MAX))
}

/// Bits and range of the A/D converter, which go together.
fn adc(
    adc_bits: Option<&Bound<'_, PyAny>>,
    adc_range: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<(u32, (f64, f64))>> {
    match (adc_bits, adc_range) {
        (None, None) => Ok(None),
        (Some(value), Some(range)) => Ok(Some((bits("adc_bits", value)?, pair("adc_range", range)?))),
        (Some(_), None) => Err(errors::value("adc_range", "expected (low, high) for adc_bits to span, got none")),
        (None, Some(_)) => Err(errors::value("adc_bits", "expected the bits that span adc_range, got none")),
    }
}
