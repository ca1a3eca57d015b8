//! Linear dynamics: lags, resonances, matrices, creep.

pub(crate) mod creep;
pub(crate) mod dynamics;
pub(crate) mod sections;
