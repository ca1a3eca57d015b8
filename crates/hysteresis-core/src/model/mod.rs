//! Validated, immutable parameters of the two models: equations (4) and (6).

#[cfg(feature = "alloc")]
mod closed_form;
#[cfg(feature = "json")]
mod json;
#[cfg(feature = "alloc")]
mod prandtl_ishlinskii;
mod validity;

#[cfg(feature = "json")]
pub use json::{JsonError, SCHEMA, SCHEMA_SPLIT};
#[cfg(feature = "alloc")]
pub use prandtl_ishlinskii::{Model, ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
pub use validity::{Offsets, Ratios};
pub(crate) use validity::{check_invertible, check_weights};
