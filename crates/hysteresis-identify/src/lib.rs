//! Identification of hysteresis models from records of input and output.
//!
//! The model is
//!
//! ```text
//! y = output_offset + G[creep[g (sum_i w_i z_i + z + s + r)]]
//! ```
//!
//! z_i are plays, or coupled plays, at u - `input_offset`, z a Duhem operator there, s the loop shift, r plays that
//! relax, g the slow gain, and G linear dynamics with a dead time. In front of all there may be an amplifier and a map,
//! behind the hysteresis another map. Every record has its own output offset and starts from the virgin state. Weights
//! and output offsets enter linearly and follow from non-negative least squares; everything else is searched, and which
//! terms there are say stretches of the records that were not fitted. See [`identify`].
//!
//! After G. Wang, G. Chen, H. Zhou, F. Bai, IEEE/CAA J. Autom. Sinica 4(4), 782-791, 2017, equations (4)-(6).
//! Results are the same bits on every run on the same machine, on any number of threads.
//!
//! The way of a record:
//!
//! 1. `records` checks it once and says which of its samples become rows.
//! 2. `choose` asks which terms the records tell, and tries them one after the other.
//! 3. `terms` has each term: its option, and what it adds to the model.
//! 4. `fit` makes rows of a point (`rows`), finds the best weights (`projection`), and steps to a better point
//!    (`descent`).
//! 5. `algebra` does that work: QR of rows that stream in, and least squares with bounds.
//! 6. `uncertainty` says how far the numbers may be from the truth.
//! 7. `judge` looks for what the records cannot tell and what the model left in them: findings, and a verdict.
//! 8. `result` is what comes out. [`identify`] goes this way from beginning to end.
//!
//! `oscillator` is a way of its own, for hysteresis inside the dynamics: [`identify_oscillator`]. So is `axes`, for
//! several drives and positions: [`identify_axes`].
//!
//! `compare` goes it for several models, `many` for many actuators, `places` without a position sensor, and `recursive`
//! takes sample by sample while the actuator runs.

#![forbid(unsafe_code)]

mod algebra;
mod axes;
mod choose;
mod compare;
mod error;
mod fit;
mod identify;
mod identify_dynamics;
mod judge;
mod many;
mod options;
mod oscillator;
mod places;
mod records;
mod recursive;
mod result;
#[cfg(feature = "serde")]
mod saved;
mod terms;
mod threads;
mod uncertainty;

pub use axes::{
    AxesHysteresis, AxesIdentification, AxesOptions, AxesPlace, AxesRecord, AxesStandardErrors, AxesTrial,
    identify_axes,
};
pub use choose::cross_validation::CrossValidation;
pub use choose::trial::{TermTrial, TrialJudge, TrialOutcome};
pub use compare::compare;
pub use compare::comparison::{ComparedModel, Comparison, Extension, Omission};
pub use error::{Error, RecordError};
pub use fit::progress::{Progress, SearchStage, Stop};
pub use identify::identify;
pub use identify_dynamics::{DynamicsIdentification, DynamicsOptions, identify_dynamics};
pub use judge::diagnose;
pub use judge::finding::{Finding, Severity, Verdict};
pub use judge::finding_code::FindingCode;
pub use many::records::{ActuatorFit, BriefFinding, ManyIdentifications, ManyRecords};
pub use many::{identify_many, settled_options};
pub use options::{Loss, Options, Setting};
pub use oscillator::{OscillatorIdentification, OscillatorOptions, OscillatorTrial, identify_oscillator};
pub use places::given::{KnownLength, PlacePair, PlacesOptions};
pub use places::identify_places;
pub use places::result::{PlacesCandidate, PlacesIdentification};
pub use records::record::Record;
pub use recursive::regressors::MIN_IDENTITY_SHARE;
pub use recursive::{Frozen, RecursiveIdentifier, RecursiveOptions, RecursiveState};
pub use result::identification::Identification;
pub use result::left_out::LeftOutLoop;
pub use result::quality::{Quality, loop_width};
pub use terms::creep::CreepModel;
pub use terms::duhem::{DuhemModel, DuhemTable};
pub use terms::dynamics::{AmplifierModel, DynamicsModel, ModesModel, Order};
pub use terms::loop_shift::LoopShiftModel;
pub use terms::maps::MapModel;
pub use terms::operators::{ModelKind, RatiosModel, Thresholds};
pub use terms::relaxing_plays::RelaxingPlaysModel;
pub use terms::slow_gain::SlowGainModel;
pub use terms::weights::WeightLaw;
pub use uncertainty::standard_errors::{Covariance, StandardErrors};

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
