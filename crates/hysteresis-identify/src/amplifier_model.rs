//! Which amplifier to fit in front of the hysteresis.

use crate::error::Error;

/// The amplifier in front of the hysteresis: a lag of first order.
///
/// ```
/// use hysteresis_identify::{AmplifierModel, DynamicsModel, Options, Order};
/// let dynamics = DynamicsModel::Order(Order::Second);
/// let options =
///     Options { dt: Some(1e-4), dynamics, amplifier: AmplifierModel::Bandwidth(400.0), ..Options::default() };
/// assert_ne!(options.amplifier, AmplifierModel::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AmplifierModel {
    /// None.
    None,
    /// One whose bandwidth is fitted, if second-order dynamics are and the records tell it from a dead time.
    #[default]
    Auto,
    /// Of this bandwidth in Hz; beside second-order dynamics.
    Bandwidth(f64),
}

impl AmplifierModel {
    /// Checks a bandwidth, and that there are dynamics beside it: without them a dead time has its lag.
    pub(crate) fn check(self, has_dynamics: bool) -> Result<(), Error> {
        let Self::Bandwidth(bandwidth) = self else { return Ok(()) };
        if !(bandwidth.is_finite() && bandwidth > 0.0) {
            return Err(Error::domain("amplifier", None, "a bandwidth in Hz above 0", bandwidth));
        }
        if !has_dynamics {
            let expected = "none without second-order dynamics (dynamics 2): a dead time has its lag";
            return Err(Error::domain("amplifier", None, expected, bandwidth));
        }
        Ok(())
    }
}
