//! Validated, immutable parameters of the two models: equations (4) and (6).

mod checks;
mod conventional;
mod either;
mod invertibility;
#[cfg(feature = "json")]
mod json;
mod modified;
mod offsets;

pub use conventional::PrandtlIshlinskii;
pub use either::Model;
#[cfg(feature = "json")]
pub use json::{JsonError, SCHEMA, SCHEMA_SPLIT};
pub use modified::{ModifiedPrandtlIshlinskii, Ratios};
pub use offsets::Offsets;
