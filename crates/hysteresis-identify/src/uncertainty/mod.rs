//! How far a fit may be from the truth: the colour of what it leaves, the covariance that follows, and the errors that are reported.

pub(crate) mod colour;
pub(crate) mod errors;
pub(crate) mod lags;
pub(crate) mod root;
