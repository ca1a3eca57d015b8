//! The fit of a hysteresis model: the best weights at every point, and the search for the point.

mod amplifier;
pub(crate) mod bounded;
pub(crate) mod chain;
pub(crate) mod choice;
pub(crate) mod course;
pub(crate) mod curve;
pub(crate) mod dead_time;
pub(crate) mod drive_path;
pub(crate) mod factor;
pub(crate) mod folds;
pub(crate) mod gradients;
pub(crate) mod intervals;
pub(crate) mod joint;
mod lanes;
pub(crate) mod linear_part;
pub(crate) mod maps;
pub(crate) mod monitor;
pub(crate) mod own_columns;
mod placement;
pub(crate) mod point;
pub(crate) mod projection;
pub(crate) mod regressor;
pub(crate) mod response;
pub(crate) mod root;
pub(crate) mod search;
pub(crate) mod shift;
pub(crate) mod smoothness;
pub(crate) mod space;
mod starts;
pub(crate) mod structure;
pub(crate) mod tangent;
pub(crate) mod variety;
pub(crate) mod weight_basis;

pub use folds::CrossValidation;
pub use monitor::{Progress, SearchStage, Stop};
