//! The position behind a noisy measurement.

use hysteresis_control::ObserverOptions;
use pyo3::prelude::*;

use super::linear::part::given_dynamics;
use crate::convert::arguments::numbers;
use crate::convert::errors::raise;
use crate::convert::objects::exclusive;
use crate::model::object::kernel_of;

/// A state observer: what the model of the actuator and a noisy measurement say together of the position.
///
/// A stationary Kalman filter on the linear part. The applied drive passes through the hysteresis model, w = H[u], and
/// moves position, velocity and d, what the model does not know, at the input of the dynamics: d is a random walk of
/// variance drift^2 a second. What the model knows has no lag; noise goes down with the bandwidth that `drift` asks for.
/// Feed the estimate to the controller instead of the measurement. Where measurements are missing the gain is that of what
/// is known then, and comes back to the stationary one.
///
/// Parameters
/// ----------
/// model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     The hysteresis of the actuator.
/// dynamics : SecondOrder or FirstOrder
///     What follows it.
/// noise : float
///     Root mean square of the measurement noise, in the unit of the displacement.
/// drift : float
///     By how much what the model does not know changes in one second, root mean square: creep, temperature, and the
///     error of the model while the reference moves.
/// dt : float
///     Sampling interval in seconds.
/// dead_time : float
///     What the sensor shows later than the dynamics explain, in seconds.
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
/// >>> observer = mh.control.Observer(actuator, dynamics=mh.plant.SecondOrder(400.0, 0.95), noise=0.016, drift=0.5, dt=1e-4)
/// >>> estimate = observer.step(0.0, 0.1)  # at rest, a first sample that is mostly noise
/// >>> 0.0 < estimate < 0.02
/// True
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct Observer(pub(crate) hysteresis_control::Observer);

#[pymethods]
impl Observer {
    #[new]
    #[pyo3(signature = (model, *, dynamics, noise, drift, dt, dead_time=None),
        text_signature = "(model, *, dynamics, noise, drift, dt, dead_time=0.0)")]
    fn new(
        model: &Bound<'_, PyAny>,
        dynamics: &Bound<'_, PyAny>,
        noise: &Bound<'_, PyAny>,
        drift: &Bound<'_, PyAny>,
        dt: &Bound<'_, PyAny>,
        dead_time: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        numbers!(noise, drift, dt, dead_time = 0.0);
        let (kernel, options) = (kernel_of("model", model)?, ObserverOptions { noise, drift, delay: dead_time / dt });
        let dynamics = given_dynamics(dynamics)?;
        hysteresis_control::Observer::new(&kernel, &dynamics, dt, &options).map(Self).map_err(raise)
    }

    /// Takes the drive that was held since the last sample, and the measurement of now; the position.
    ///
    /// Without a finite measurement the model goes on alone; that is counted.
    fn step(slf: &Bound<'_, Self>, drive: f64, measurement: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.0.step(drive, measurement))
    }

    /// What the model does not know, at the input of the dynamics, in the unit of the displacement.
    #[getter]
    fn disturbance(&self) -> f64 {
        self.0.disturbance()
    }

    /// The stationary gain for position, velocity over 2 pi f, and disturbance.
    #[getter]
    fn gain(&self) -> (f64, f64, f64) {
        self.0.gain().into()
    }

    /// How many drives or measurements were not finite.
    #[getter]
    fn rejected(&self) -> u64 {
        self.0.rejected()
    }

    /// Back to rest.
    fn reset(&mut self) {
        self.0.reset();
    }
}
