//! An oscillator with hysteresis inside: y'' + c y' + k y + z\[y\] = b u, where z is a Duhem operator of the motion y
//! itself.
//!
//! Cables, bearings, magnetic return springs and the Bouc-Wen oscillator are of this kind: no hysteresis in front of
//! linear dynamics is. [`equation`] is the differential equation and its steps, for numbers and for numbers with
//! derivatives alike; `model` the parameters; `forward` and `inverse` what runs; [`drive`] what a drive does
//! between its samples.

pub mod drive;
pub mod equation;
mod forward;
mod inverse;
mod model;

pub use crate::json_file::FileError;
pub use drive::Hold;
pub use forward::{OscillatorForward, OscillatorState};
pub use inverse::Motion;
pub use model::{HystereticOscillator, SCHEMA, tables, usual_sub_steps};
