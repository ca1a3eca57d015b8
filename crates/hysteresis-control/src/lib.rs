//! What controls an actuator beside the sample-by-sample controller of the core: the linear dynamics behind its
//! hysteresis, feed-forward through their inverse, references with their derivatives, gains for the feedback, learning
//! from periods that repeat, and observation of the position behind a noisy measurement.
//!
//! Rooms know only those above them:
//!
//! - [`linear`]: modes, lags, creep, dead time, and what they do sample by sample; [`filters`] of a feedback.
//! - [`sampling`]: how long a signal may be; [`trajectory`]: motions of one axis and scans.
//! - [`feedforward`]: the inverse of linear dynamics. [`tuning`]: filters and gains. [`learning`]: from periods that
//!   repeat.
//! - [`stage`]: all of an actuator in one object, its file, and what is made from it.
//! - [`oscillator`]: hysteresis that acts on the motion itself, inside one mode.
//! - [`multi_axis`]: several drives and positions with hysteresis in front of or inside shared dynamics.
//! - [`Observer`], then [`StageController`], which joins controller, observer and learning.
//! - [`binary`]: stages and saved states as bytes.
//!
//! What a number must be is checked in `checks`; the Riccati equations of feed-forward and observer are in `riccati`.

#![forbid(unsafe_code)]

pub mod binary;
mod checks;
pub mod feedforward;
pub mod filters;
mod json_file;
pub mod learning;
pub mod linear;
pub mod multi_axis;
mod observer;
pub mod oscillator;
mod riccati;
pub mod sampling;
pub mod stage;
mod stage_controller;
pub mod trajectory;
pub mod tuning;

pub use observer::{Observer, ObserverOptions, ObserverState};
pub use stage_controller::{StageController, StageControllerState};

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs work that other languages call. A panic, which is a defect of the library, becomes its message: it must not
/// unwind into them. What the work was changing may be in any state then.
///
/// ```
/// use hysteresis_control::guarded;
/// assert_eq!(guarded(|| 2), Ok(2));
/// assert_eq!(guarded(|| panic!("{} is missing", "something")), Err::<(), _>("a defect of the library: something is missing".into()));
/// ```
///
/// # Errors
/// The message of a panic.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        let message = payload.downcast_ref::<String>().map(String::as_str);
        let message = message.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message");
        format!("a defect of the library: {message}")
    })
}

/// A count of samples, steps or cells.
#[expect(clippy::cast_precision_loss, reason = "counts are below 2^52")]
pub(crate) fn as_f64(count: usize) -> f64 {
    count as f64
}

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
