//! Identification: records in, models and how far to trust them out.

pub(crate) mod axes;
pub(crate) mod compare;
pub(crate) mod diagnose;
pub(crate) mod dynamics;
pub(crate) mod identification;
#[expect(clippy::module_inception, reason = "the function `identify`")]
pub(crate) mod identify;
pub(crate) mod many;
pub(crate) mod many_identifications;
mod options;
pub(crate) mod oscillator;
pub(crate) mod places;
pub(crate) mod quality;
mod records;
pub(crate) mod recursive;
mod watch;
