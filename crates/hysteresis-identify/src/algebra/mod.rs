//! Linear algebra: eight numbers at once, QR of rows that stream in, and least squares with bounds.

pub(crate) mod bounded;
pub(crate) mod eight;
pub(crate) mod factor;
