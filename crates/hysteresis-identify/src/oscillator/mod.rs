//! Hysteresis inside the dynamics: a record in, an oscillator y'' + c y' + k y + z\[y\] = b u out.
//!
//! The way of a record: `data` checks it, finds its periods and averages them. `pass` runs the model over it, with
//! the derivatives of every sample by all parameters: `dual` numbers in the steps of the model itself. `descent` goes
//! down by Gauss-Newton steps in a trust region. `identify` begins at the best linear oscillator, and with `friction`
//! about it, and goes from few knots to many; held-out samples say how many. `result` is what comes out.

mod data;
mod descent;
mod dual;
mod friction;
mod identify;
mod pass;
mod result;

pub use identify::{OscillatorOptions, identify_oscillator};
pub use result::{OscillatorIdentification, OscillatorTrial};
