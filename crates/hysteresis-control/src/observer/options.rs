use serde::{Deserialize, Serialize};

/// How much to believe.
///
/// ```
/// use hysteresis_control::ObserverOptions;
/// let options = ObserverOptions { noise: 0.016, drift: 0.5 }; // um, um per root of a second
/// assert_eq!(options.noise, 0.016);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserverOptions {
    /// The root mean square of the measurement noise, in the unit of the position.
    pub noise: f64,
    /// How fast what the model does not know may wander, in the unit of the position per square root of a second: the
    /// root mean square of its change over one second.
    pub drift: f64,
}
