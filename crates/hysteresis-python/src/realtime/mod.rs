//! The loop of a stage in real time.

pub(crate) mod other_side;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod stop;
