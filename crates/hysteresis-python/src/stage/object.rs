//! The object of a stage.

use hysteresis_control::stage;
use pyo3::prelude::*;

use crate::argument::Class;

/// A whole stage: limits, dead time, amplifier, hysteresis, loop shift, creep, modes and sensor noise in one
/// object.
///
/// limits -> dead time -> amplifier -> input map -> hysteresis -> output map -> loop shift -> creep -> modes -> sensor
///
/// Made by `identify(...).stage`, by `load(path)`, or from its parts. Immutable. Everything that runs is made from it, so
/// parameters, limits and times are stated once. Times are in seconds, frequencies in Hz.
///
/// Parameters
/// ----------
/// hysteresis : ModifiedPrandtlIshlinskii or PrandtlIshlinskii
/// limits : (float, float), optional
///     The drive never leaves (low, high), in the unit of the drive.
/// slew : float, optional
///     How fast the drive may change, per second.
/// dead_time : float
///     What the sensor shows later than hysteresis and modes explain, in seconds, for a drive that is put out at t_k and held,
///     and a position that is read at t_k.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of a first-order amplifier in front of the hysteresis.
/// dynamics : FirstOrder, SecondOrder, Modes, StateSpace, a sequence of them in series, or an object of control or scipy
///     The modes and lags behind the hysteresis; their static gain may differ from 1.
/// creep : Creep, optional
/// loop_shift : LoopShift, optional
///     What motion of the drive adds behind the output map, in front of the creep.
/// input_map, output_map : (array, array), optional
///     The points (x, y) of a strictly monotone piecewise-linear map in front of the hysteresis, and of one behind it.
/// noise : float, optional
///     Rms noise of the sensor, in the unit of the position.
/// units : (str, str)
///     Names of the units of drive and position.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(
/// ...     mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dead_time=1e-4,
/// ...     dynamics=mh.plant.SecondOrder(800.0, 0.02), creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8))
/// >>> target = mh.signals.sine(2.5, 10.0, seconds=0.3, rate=10e3)
/// >>> drive = stage.precompensate(target, dt=1e-4)
/// >>> error = stage.forward(dt=1e-4).run(drive) - target
/// >>> bool(abs(error[1000:]).max() < 1e-3)  # um
/// True
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct Stage(pub(crate) stage::Stage);

impl Class for Stage {
    const CALLED: &'static str = "a mh.Stage";
}
