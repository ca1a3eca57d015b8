//! Validated, immutable parameters of the two models: equations (4) and (6).

mod checks;
#[cfg(feature = "alloc")]
mod conventional;
#[cfg(feature = "alloc")]
mod either;
mod invertibility;
#[cfg(feature = "json")]
mod json;
#[cfg(feature = "alloc")]
mod modified;
mod offsets;
mod ratios;

pub(crate) use checks::check_weights;
#[cfg(feature = "alloc")]
pub use conventional::PrandtlIshlinskii;
#[cfg(feature = "alloc")]
pub use either::Model;
pub(crate) use invertibility::check as check_invertible;
#[cfg(feature = "json")]
pub use json::{JsonError, SCHEMA, SCHEMA_SPLIT};
#[cfg(feature = "alloc")]
pub use modified::ModifiedPrandtlIshlinskii;
pub use offsets::Offsets;
pub use ratios::Ratios;
