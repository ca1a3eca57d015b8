//! Identification: records in, models and how far to trust them out.

mod choices;
pub(crate) mod compare;
pub(crate) mod comparison;
pub(crate) mod diagnose;
pub(crate) mod dynamics;
pub(crate) mod finding;
pub(crate) mod identification;
#[expect(clippy::module_inception, reason = "the function `identify`")]
pub(crate) mod identify;
mod intervals;
pub(crate) mod left_out;
pub(crate) mod many;
mod many_made;
pub(crate) mod many_result;
mod many_tasks;
mod options;
pub(crate) mod quality;
mod records;
pub(crate) mod recursive;
