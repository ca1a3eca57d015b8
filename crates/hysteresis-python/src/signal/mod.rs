//! Test signals and drives to identify from.

pub(crate) mod chirp;
pub(crate) mod excitation;
pub(crate) mod experiment;
pub(crate) mod multisine;
pub(crate) mod signals;
