//! The fit of a hysteresis model: the best weights at every point, and the search for the point.

pub(crate) mod bounded;
pub(crate) mod choice;
pub(crate) mod course;
pub(crate) mod factor;
pub(crate) mod folds;
pub(crate) mod monitor;
pub(crate) mod projection;
pub(crate) mod regressor;
pub(crate) mod search;
pub(crate) mod smoothness;
pub(crate) mod space;
pub(crate) mod weight_basis;

pub use folds::CrossValidation;
pub use monitor::{Progress, SearchStage, Stop};
