//! Identification of hysteresis models from records of input and output.
//!
//! The model is y(k) = `output_offset` + sum_i w_i z_i(k - delay), z_i the coupled play of the core at
//! u - `input_offset`; every record has its own output offset and starts from the virgin state. Weights and output
//! offsets enter linearly and follow from non-negative least squares; the three ratios of the thresholds, the input
//! offset and the delay are searched. See [`identify`].
//!
//! After G. Wang, G. Chen, H. Zhou, F. Bai, IEEE/CAA J. Autom. Sinica 4(4), 782-791, 2017, equations (4)-(6).
//! Results are the same bits on every run on the same machine; nothing here runs in parallel.

#![forbid(unsafe_code)]

mod bounded;
mod choice;
mod course;
mod diagnostics;
mod dynamics;
mod error;
mod factor;
mod folds;
mod identification;
mod law;
mod left_out;
mod loop_width;
mod options;
mod projection;
mod quality;
mod record;
mod recursive;
mod regressor;
mod search;
mod smoothness;
mod space;
mod spread;
mod uncertainty;

pub use diagnostics::{Defect, Finding, diagnose};
pub use dynamics::{
    CreepTerms, DynamicsIdentification, DynamicsOptions, Order, Uncertainty, Warning, identify_dynamics,
};
pub use error::{Error, RecordError};
pub use folds::CrossValidation;
pub use identification::{Identification, identify};
pub use left_out::LeftOutLoop;
pub use loop_width::loop_width;
pub use options::{Form, Options, Setting, Thresholds, Weights};
pub use quality::Quality;
pub use record::Record;
pub use recursive::{Frozen, MIN_IDENTITY_SHARE, RecursiveIdentifier, RecursiveOptions, RecursiveState};
pub use search::{Progress, Stage, Stop};
pub use uncertainty::StandardErrors;
