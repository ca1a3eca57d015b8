//! Operators and models.

pub(crate) mod conventional;
pub(crate) mod methods;
pub(crate) mod modified;
pub(crate) mod object;
pub(crate) mod operators;
