//! What an identification leaves: the model, how well it fits, how far it can be trusted.

pub(crate) mod covariance;
pub(crate) mod identification;
mod left_out;
mod loop_width;
pub(crate) mod quality;
pub(crate) mod spread;
mod stage;
pub(crate) mod standard_errors;

pub use covariance::Covariance;
pub use identification::Identification;
pub use left_out::LeftOutLoop;
pub use loop_width::loop_width;
pub use quality::Quality;
pub use standard_errors::StandardErrors;
