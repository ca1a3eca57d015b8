//! A stage between its two converters, as a controller sees it: drive in, measurement out.
//!
//! u -> limits, D/A converter -> [stage](hysteresis_control::stage::Stage) -> position -> noise -> A/D converter
//!
//! # Timing
//! At t_k the controller reads the measurement, computes its drive from it at once, and the drive is held until t_(k+1):
//!
//! ```text
//! time       t_0                     t_1                     t_2
//! reading    measured()              step(u(0)) returns it   step(u(1)) returns it
//! drive         u(0)____________________u(1)____________________u(2)
//! row        (u(0), y(0))            (u(1), y(1))            (u(2), y(2))
//! ```
//!
//! [`Plant::step`] holds a drive for one interval and returns the next reading, taken just before the next drive.
//! [`Plant::run`] writes rows of a record: y(k) is read as u(k) is put out.

mod axes;
mod error;
mod noise;
mod options;
mod quantiser;
mod simulation;
mod state;

pub use axes::{MultiAxisPlant, MultiAxisPlantState};
pub use error::Error;
pub use options::PlantOptions;
pub use quantiser::Quantiser;
pub(crate) use quantiser::check_range;
pub use simulation::{Events, Plant};
pub use state::PlantState;
