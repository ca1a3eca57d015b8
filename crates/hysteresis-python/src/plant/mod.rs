//! Plants, closed loops and the paper's benchmark.

pub(crate) mod foreign;
pub(crate) mod oscillator;
pub(crate) mod paper;
#[expect(clippy::module_inception, reason = "the class `Plant`")]
pub(crate) mod plant;
pub(crate) mod run;
pub(crate) mod simulate;
