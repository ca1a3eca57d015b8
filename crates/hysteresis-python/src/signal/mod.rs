//! Test signals and drives to identify from.

pub(crate) mod excitation;
pub(crate) mod signals;
