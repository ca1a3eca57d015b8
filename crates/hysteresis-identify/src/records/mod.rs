//! What comes in: records, their signals and the way through them.

pub(crate) mod course;
pub(crate) mod record;
pub(crate) mod signal;
