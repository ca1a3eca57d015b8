//! How far a fit may be from the truth: the covariance that follows from what it leaves, the errors that are
//! reported, and the band that holds the next record.

pub(crate) mod band;
pub(crate) mod lags;
pub(crate) mod root;
pub(crate) mod standard_errors;
