//! Operators and models.

pub(crate) mod conventional;
mod methods;
pub(crate) mod modified;
pub(crate) mod object;
pub(crate) mod operators;
