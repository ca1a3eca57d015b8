//! Which models are compared.

use super::result::{Extension, Omission};
use crate::creep_model::CreepModel;
use crate::error::Error;
use crate::fit::intervals::Intervals;
use crate::loop_shift_model::LoopShiftModel;
use crate::map_model::MapModel;
use crate::options::{DynamicsModel, ModelKind, Options, Setting, Thresholds, WeightLaw};
use crate::record::Record;
use crate::search::Found;

/// The names of coupled plays alone, and of those with all extensions.
pub(super) const MODIFIED: &str = "modified";
pub(super) const ALL: &str = "modified + all";

/// A model to compare.
pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) options: Options,
    /// Whether the square and the cube of the drive stand beside its operators.
    pub(super) has_polynomial: bool,
}

impl Candidate {
    fn plain(name: &'static str, options: Options) -> Self {
        Self { name, options, has_polynomial: false }
    }

    /// The same with the weight law of another model of coupled plays, if there is one. Plays choose their own.
    pub(super) fn under(mut self, law: Option<&Law>) -> Self {
        if let Some(Law { weights, thresholds, smoothness }) = law.filter(|_| self.options.model == ModelKind::Modified)
        {
            self.options.weights = *weights;
            self.options.thresholds = thresholds.clone();
            self.options.smoothness = Setting::Fixed(*smoothness);
        }
        self
    }
}

/// What cross-validation chose for the weights of a model.
pub(super) struct Law {
    weights: WeightLaw,
    thresholds: Thresholds,
    smoothness: f64,
}

impl Law {
    pub(super) fn of(found: &Found) -> Self {
        let Options { weights, thresholds, .. } = found.options.clone();
        Self { weights, thresholds, smoothness: found.smoothness }
    }
}

/// The models to compare, the simplest first, and the extensions that are left out.
pub(super) type Candidates = (Vec<Candidate>, Vec<(Extension, Omission)>);

/// The models that these records can tell, and the extensions that they cannot.
pub(super) fn candidates(records: &[Record<'_>], asked: &Options) -> Result<Candidates, Error> {
    let told = asked.resolved(records)?;
    let creep = if told.creep == CreepModel::None { CreepModel::None } else { CreepModel::UnderWay };
    let modified = Options { creep, ..told.hysteresis_and_dead_time() };
    let conventional = plays(&modified);
    let mut candidates = vec![
        Candidate::plain("conventional", conventional.clone()),
        Candidate { name: "polynomial + plays", options: conventional, has_polynomial: true },
        Candidate::plain(MODIFIED, modified.clone()),
    ];
    let has_seconds = Intervals::of(records, asked)?.are_seconds();
    let mut omitted = Vec::new();
    for extension in Extension::ALL {
        if has(&told, extension) {
            candidates.push(Candidate::plain(name(extension), with(&modified, extension, &told)));
        } else {
            let reason = if !has(asked, extension) {
                Omission::NotAsked
            } else if has_seconds {
                Omission::NotTold
            } else {
                Omission::NoSamplingInterval
            };
            omitted.push((extension, reason));
        }
    }
    if Extension::ALL.into_iter().filter(|extension| has(&told, *extension)).count() > 1 {
        candidates.push(Candidate::plain(ALL, told));
    }
    Ok((candidates, omitted))
}

/// The same options for plays, which have no split weights.
fn plays(modified: &Options) -> Options {
    let weights = if modified.weights == WeightLaw::Split { WeightLaw::Free } else { modified.weights };
    Options { model: ModelKind::Conventional, weights, ..modified.clone() }
}

fn name(extension: Extension) -> &'static str {
    match extension {
        Extension::Creep => "modified + creep",
        Extension::LoopShift => "modified + loop shift",
        Extension::Dynamics => "modified + dynamics",
        Extension::Maps => "modified + maps",
    }
}

/// Whether options have an extension, or leave it open.
fn has(options: &Options, extension: Extension) -> bool {
    match extension {
        Extension::Creep => options.creep.has_terms() || options.creep == CreepModel::Auto,
        Extension::LoopShift => options.loop_shift != LoopShiftModel::None,
        Extension::Dynamics => options.dynamics != DynamicsModel::None,
        Extension::Maps => [options.input_map, options.output_map].iter().any(|map| *map != MapModel::None),
    }
}

/// Options with one extension of others.
fn with(plain: &Options, extension: Extension, told: &Options) -> Options {
    match extension {
        Extension::Creep => Options { creep: told.creep.clone(), ..plain.clone() },
        Extension::LoopShift => Options { loop_shift: told.loop_shift, ..plain.clone() },
        Extension::Dynamics => Options { dynamics: told.dynamics, amplifier: told.amplifier, ..plain.clone() },
        Extension::Maps => Options { input_map: told.input_map, output_map: told.output_map, ..plain.clone() },
    }
}
