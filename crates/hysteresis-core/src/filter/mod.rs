//! Filters of second-order sections, sample by sample and of fixed memory: what shapes a feedback.
//!
//! Each file knows only those above it: `biquad`, `sections`, `stream`. How the coefficients follow from a frequency and a damping
//! ratio is for the crate that designs.

mod biquad;
mod sections;
mod stream;

pub use biquad::Biquad;
pub use sections::{FilterState, MAX_SECTIONS, Sections};
pub use stream::Filter;
