//! The stage: one object that holds all parts, its file, and what runs that is made from it.

mod design;
pub(crate) mod error_bounds;
pub(crate) mod files;
pub(crate) mod loop_shift;
mod multi_axis_design;
pub(crate) mod multi_axis_stage;
pub(crate) mod relaxing_plays;
pub(crate) mod slow_gain;
#[expect(clippy::module_inception, reason = "the class `Stage`")]
pub(crate) mod stage;
pub(crate) mod streams;
pub(crate) mod temperature;
