//! The linear part of an actuator from the keywords that several functions share.

use hysteresis_control::linear::{Chain, Delay, FirstOrder as Lag};
use pyo3::prelude::*;

use super::linear::{FirstOrder, SecondOrder};
use crate::convert::errors::{self, raise, unexpected};
use crate::identify::dynamics::DynamicsIdentification;

/// The keywords `dynamics`, `amplifier_bandwidth` and `delay`, as they came.
pub(crate) struct LinearPart<'a, 'py> {
    pub(crate) dynamics: Option<&'a Bound<'py, PyAny>>,
    pub(crate) amplifier_bandwidth: Option<f64>,
    pub(crate) delay: Option<f64>,
}

impl LinearPart<'_, '_> {
    /// Whether nothing was given: what follows its input at once.
    pub(crate) fn is_absent(&self) -> bool {
        self.dynamics.is_none() && self.amplifier_bandwidth.is_none() && self.delay.is_none()
    }

    /// The chain for a sampling interval; of an identification its dynamics, and its delay unless one was given.
    pub(crate) fn chain(&self, dt: f64) -> PyResult<Chain> {
        let amplifier = self.amplifier_bandwidth.map(Lag::new).transpose().map_err(|error| {
            let parameter = "amplifier_bandwidth";
            raise(hysteresis_control::linear::Error { parameter, ..error })
        })?;
        let (dynamics, identified) = match self.dynamics {
            None => (None, None),
            Some(object) => {
                if let Ok(resonance) = object.cast::<SecondOrder>() {
                    (Some(resonance.get().0.into()), None)
                } else if let Ok(lag) = object.cast::<FirstOrder>() {
                    (Some(lag.get().0.into()), None)
                } else if let Ok(identification) = object.cast::<DynamicsIdentification>() {
                    let found = &identification.get().found;
                    (Some(found.dynamics), Some(found))
                } else {
                    let expected = "a SecondOrder, a FirstOrder or a DynamicsIdentification";
                    return Err(unexpected("dynamics", expected, object));
                }
            }
        };
        let delay = match (self.delay, identified) {
            (Some(delay), _) => delay,
            (None, None) => 0.0,
            // Its delay counts samples of its own. 1 / rate may be another number than what was meant by it.
            (None, Some(found)) if (found.dt - dt).abs() <= 1e-9 * dt => found.delay,
            (None, Some(found)) => {
                let expected = format!("the sampling interval of the identification, {:?}, or a delay", found.dt);
                return Err(errors::value("dt", format_args!("expected {expected}, got {dt:?}")));
            }
        };
        Ok(Chain { amplifier, dynamics, delay: Delay::new(delay).map_err(raise)? })
    }

    /// Nothing, if there is no creep: an open loop would leave it as it is.
    pub(crate) fn refuse_creep(&self) -> PyResult<()> {
        let identified = self.dynamics.and_then(|object| object.cast::<DynamicsIdentification>().ok());
        if identified.is_some_and(|identification| identification.get().found.creep.is_some()) {
            let message = "expected no creep, which only feedback removes; to leave it as it is, give \
                           identification.dynamics and its delay";
            return Err(errors::value("dynamics", message));
        }
        Ok(())
    }
}
