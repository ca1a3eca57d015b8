//! Operators and models.

pub(crate) mod duhem;
pub(crate) mod methods;
pub(crate) mod models;
pub(crate) mod operators;
