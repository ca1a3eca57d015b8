//! Linear dynamics: immutable, comparable, hashable, picklable.

pub(crate) mod creep;
pub(crate) mod lags;
pub(crate) mod modes;
pub(crate) mod part;
mod response;
pub(crate) mod state_space;
