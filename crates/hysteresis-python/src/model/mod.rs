//! Operators and models.

pub(crate) mod methods;
pub(crate) mod models;
pub(crate) mod operators;
