//! The stage: one object that holds all parts, its file, and what runs that is made from it.

mod design;
pub(crate) mod export;
pub(crate) mod file;
pub(crate) mod loop_shift;
mod made_controller;
pub(crate) mod object;
pub(crate) mod parts;
pub(crate) mod precompensate;
#[expect(clippy::module_inception, reason = "the class `Stage`")]
pub(crate) mod stage;
pub(crate) mod streams;
