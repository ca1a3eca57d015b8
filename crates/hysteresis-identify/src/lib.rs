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

mod amplifier_model;
mod colour;
mod compare;
mod creep_model;
mod diagnostics;
mod dynamics;
mod error;
mod finding;
mod finding_code;
mod fit;
mod glitches;
mod identify;
mod joint_findings;
mod joint_search;
mod lag_beside_maps;
mod loop_shift_model;
mod loss;
mod many;
mod map_findings;
mod map_model;
mod modes_model;
mod no_interval;
mod numeric;
mod operator_choice;
mod options;
mod quiet_record;
mod record;
mod recursive;
mod result;
mod robust;
#[cfg(feature = "serde")]
mod saved;
mod search;
mod signal;
mod thresholds;
mod turned_sign;
mod what_to_try;
#[cfg(test)]
mod white_noise;

pub use amplifier_model::AmplifierModel;
pub use compare::{ComparedModel, Comparison, Extension, Omission, compare};
pub use creep_model::CreepModel;
pub use diagnostics::diagnose;
pub use dynamics::{DynamicsIdentification, DynamicsOptions, identify_dynamics};
pub use error::{Error, RecordError};
pub use finding::{Finding, Severity, Verdict};
pub use finding_code::FindingCode;
pub use fit::{CrossValidation, Progress, SearchStage, Stop};
pub use identify::identify;
pub use loop_shift_model::LoopShiftModel;
pub use loss::Loss;
pub use many::{ActuatorFit, BriefFinding, ManyIdentifications, ManyRecords, identify_many, settled_options};
pub use map_model::MapModel;
pub use modes_model::ModesModel;
pub use options::{DynamicsModel, ModelKind, Options, Order, Setting, Thresholds, WeightLaw};
pub use record::Record;
pub use recursive::{Frozen, MIN_IDENTITY_SHARE, RecursiveIdentifier, RecursiveOptions, RecursiveState};
pub use result::{Covariance, Identification, LeftOutLoop, Quality, StandardErrors, loop_width};

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
