//! A million mixed samples through everything that a stage makes, and the SHA-256 of what comes out: the C interface,
//! the Python package, functional mock-up units and the record of a loop in real time must give the same digests.
//!
//! With `s` a [`Mixed`] signal of seed 1, `d` one of seed 2 without its first 503 samples, so that both are seldom bad
//! at once, and a sampling interval of 0.1 ms:
//!
//! ```text
//! forward     position(k) = step(60 + 90 s(k))
//! inverse     drive(k)    = step(14 + 18 s(k))
//! controller  drive(k)    = step(14 + 18 s(k), y(k))            y(k) = advance(drive(k-1)) of a forward model; y(0) = 0
//! observer    position(k) = step(drive(k-1), y(k))              where d(k) is not finite, y(k) is d(k)
//! plant       position(k) = advance(60 + 90 s(k))
//! loop        drive(k)    = step(r(k), y(k))                    r(k) is 14 + 18 s(k), or the last one where that is not finite
//! ```
//!
//! The loop has its y from drives of its own, as the controller. A loop in real time takes no other references, so its
//! record has these drives. Numbers beyond 1e100 count as not finite.
//!
//! Only Rust and Python can ask for a method. There the hysteresis alone, by the bank, must give the same digests too:
//!
//! ```text
//! bank-forward  output(k) = step(60 + 90 s(k))
//! bank-inverse  input(k)  = step(14 + 18 s(k))                  within the limits of the stage
//! ```

mod signal;

use hysteresis_control::stage::{Error, FeedForwardKind, Stage};
use hysteresis_control::{Observer, ObserverOptions};
use hysteresis_core::{CompiledModel, Forward, Inverse, Method, Process};
use sha2::{Digest, Sha256};

pub use signal::Mixed;

/// How many samples.
pub const SAMPLES: usize = 1_000_000;

/// The sampling interval in seconds.
pub const DT: f64 = 1e-4;

/// How fast the observer lets what the model does not know wander, in um per root of a second.
pub const DRIFT: f64 = 0.5;

/// By how many samples the second signal is ahead.
const SHIFT: usize = 503;

/// The names of the outputs, in their order.
pub const NAMES: [&str; 6] = ["forward", "inverse", "controller", "observer", "plant", "loop"];

/// The names of the outputs by the bank, in their order.
pub const BANK_NAMES: [&str; 2] = ["bank-forward", "bank-inverse"];

/// The outputs for a stage with limits and a noise.
///
/// # Errors
/// As for what is made from the stage.
pub fn outputs(stage: &Stage) -> Result<[Vec<f64>; 6], Error> {
    let mut forward = stage.forward(DT)?;
    let positions = Mixed::new(1).map(|s| forward.step(60.0 + 90.0 * s)).take(SAMPLES).collect();
    let mut inverse = stage.inverse(DT, None)?;
    let drives = Mixed::new(1).map(|s| inverse.step(14.0 + 18.0 * s)).take(SAMPLES).collect();
    let [controlled, observed] = closed_loop(stage, Mixed::new(1).map(|s| 14.0 + 18.0 * s))?;
    let mut plant = stage.forward(DT)?;
    let advanced = Mixed::new(1).map(|s| plant.advance(60.0 + 90.0 * s)).take(SAMPLES).collect();
    let [looped, _] = closed_loop(stage, finite_references())?;
    Ok([positions, drives, controlled, observed, advanced, looped])
}

/// The outputs by the bank of a stage's hysteresis, the inverse within its limits.
///
/// # Errors
/// As for what is made from the hysteresis.
pub fn outputs_by_bank(stage: &Stage) -> Result<[Vec<f64>; 2], Error> {
    let hysteresis = CompiledModel::new(&stage.parts().hysteresis);
    let mut forward = Forward::with_method(&hysteresis, Method::Bank)?;
    let outputs = Mixed::new(1).map(|s| forward.step(60.0 + 90.0 * s)).take(SAMPLES).collect();
    let mut inverse = Inverse::with_method(&hysteresis, stage.parts().limits, Method::Bank)?;
    let inputs = Mixed::new(1).map(|s| inverse.step(14.0 + 18.0 * s)).take(SAMPLES).collect();
    Ok([outputs, inputs])
}

/// The references of the loop.
pub fn finite_references() -> impl Iterator<Item = f64> {
    Mixed::new(1).map(|s| 14.0 + 18.0 * s).scan(14.0, |last, reference| {
        if reference.abs() < 1e100 {
            *last = reference;
        }
        Some(*last)
    })
}

/// What is read at each sample, for what the plant shows: that, or what is not finite.
pub fn readings() -> impl Iterator<Item = impl Fn(f64) -> f64> {
    Mixed::new(2).skip(SHIFT).map(|d| move |position| if d.abs() < 1e100 { position } else { d })
}

fn closed_loop(stage: &Stage, references: impl Iterator<Item = f64>) -> Result<[Vec<f64>; 2], Error> {
    let mut plant = stage.forward(DT)?;
    let mut controller = stage.controller(FeedForwardKind::Inverse, &stage.controller_options(DT, None)?)?;
    let options = ObserverOptions { noise: stage.parts().noise.ok_or(Error::NoNoise)?, drift: DRIFT };
    let mut observer = Observer::new(stage, DT, &options)?;
    let (mut drive, mut position) = (0.0, 0.0);
    let rows = references.zip(readings()).take(SAMPLES).map(|(reference, read)| {
        let measured = read(position);
        let estimate = observer.step(drive, measured);
        drive = controller.step(reference.into(), measured);
        position = plant.advance(drive);
        (drive, estimate)
    });
    let (drives, estimates) = rows.unzip();
    Ok([drives, estimates])
}

/// The SHA-256 of numbers, little-endian, in hexadecimal digits.
#[must_use]
pub fn digest(numbers: &[f64]) -> String {
    let mut hash = Sha256::new();
    for number in numbers {
        hash.update(number.to_le_bytes());
    }
    let digits = |byte: &u8| [byte >> 4, byte & 15].map(|digit| char::from_digit(digit.into(), 16).unwrap_or_default());
    hash.finalize().iter().flat_map(digits).collect()
}
