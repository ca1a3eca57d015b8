//! How far a fit may be from the truth: the covariance that follows from what it leaves, and the errors that are reported.

pub(crate) mod lags;
pub(crate) mod root;
pub(crate) mod standard_errors;
