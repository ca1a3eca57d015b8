//! A stage for other tools.
//!
//! - [`c_header`]: its constants for C and C++, and the stage itself as bytes.
//! - [`MockUp`]: what a functional mock-up unit (FMI 2.0, co-simulation) says of itself. [`Simulation`] is what runs in it;
//!   `hysteresis-fmu` is the shared library around that. Both use one table of variables.
//!
//! Nothing is computed here: constants are those of the stage, and what runs is made by it.

mod c_header;
mod error;
mod mock_up;
mod simulation;

pub use c_header::{HeaderOptions, c_header};
pub use error::Error;
pub use mock_up::MockUp;
pub use simulation::{Kind, Settings, Simulation, Source};

use sha2::{Digest, Sha256};

/// A name of C for a text: what no name may have becomes an underscore.
///
/// ```
/// assert_eq!(hysteresis_export::c_name("x axis-2"), "x_axis_2");
/// assert_eq!(hysteresis_export::c_name("2nd"), "_2nd");
/// ```
#[must_use]
pub fn c_name(text: &str) -> String {
    let name: String = text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') { name } else { format!("_{name}") }
}

/// Of texts, one behind the other.
fn digest(texts: &[&str]) -> String {
    let mut hash = Sha256::new();
    for text in texts {
        hash.update(text);
    }
    let digits = |byte: &u8| [byte >> 4, byte & 15].map(|digit| char::from_digit(digit.into(), 16).unwrap_or_default());
    hash.finalize().iter().flat_map(digits).collect()
}

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
