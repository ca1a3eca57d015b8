//! An actuator between its two converters, as a controller sees it: drive in, measurement out.
//!
//! u -> D/A converter, limits -> amplifier -> hysteresis -> dynamics -> creep -> delay -> position -> noise -> A/D
//!
//! # Timing
//! At the moment of sample k the measurement belongs to the position of that moment. The controller computes its drive
//! from it at once, and the drive is held until the moment of sample k + 1. So [`Plant::measured`] is the measurement
//! of now, and [`Plant::step`] holds a drive for one interval and returns the next one.

mod actuator;
mod error;
mod noise;
mod options;
mod quantiser;
mod simulation;

pub use error::Error;
pub use options::PlantOptions;
pub use quantiser::Quantiser;
pub(crate) use quantiser::check_range;
pub use simulation::{Events, Plant};
