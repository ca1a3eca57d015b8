//! Models side by side: each fitted to the same records and judged on the same stretches that it was not fitted to.

pub(crate) mod comparison;

use std::ops::ControlFlow;

use crate::choose::cross_validation::{CrossValidation, FOLDS, Stretches, Terms};
use crate::choose::found::Found;
use crate::choose::glitches::search_without_glitches;
use crate::choose::search::{search_all, search_polynomial};
use crate::compare::comparison::{ComparedModel, Comparison, Extension, Fitted, Omission};
use crate::error::Error;
use crate::fit::joint::JointFit;
use crate::fit::progress::{Progress, SearchMonitor, Stop};
use crate::fit::projection::Projection;
use crate::fit::space::Space;
use crate::options::{Options, Setting};
use crate::records::record::{Record, leaving_out};
use crate::records::signal::as_f64;
use crate::result::identification::judged as errors_of;
use crate::result::quality::Quality;
use crate::terms::creep::CreepModel;
use crate::terms::duhem::DuhemModel;
use crate::terms::dynamics::{AmplifierModel, DynamicsModel};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::{ModelKind, Thresholds};
use crate::terms::relaxing_plays::RelaxingPlaysModel;
use crate::terms::slow_gain::SlowGainModel;
use crate::terms::weights::WeightLaw;

/// Fits several models to the same records and judges each on stretches that it was not fitted to.
///
/// | model | y = |
/// |---|---|
/// | `conventional` | sum `w_i` p_i\[u\], p_i plays |
/// | `polynomial + plays` | `a_2` x^2 + `a_3` x^3 + sum `w_i` p_i\[u\], x the drive from -1 to 1 |
/// | `modified` | sum `w_i` z_i\[u\], z_i coupled plays |
/// | `modified + creep` and so on | the same with one [`Extension`] |
/// | `modified + all` | with all extensions, as [`identify`](crate::identify) fits them |
///
/// The first play is the identity, so `w_0` is the linear term of the polynomial. Every model has a dead time, and an
/// output offset of each record; where `options` leave creep to the records, also the creep that was under way when a
/// record began.
///
/// **The judge** is the same for all: every record is cut into eight stretches, and the i-th stretch of all records is
/// predicted from a fit to the other stretches. Weights, offsets and polynomial are fitted anew exactly; ratios, input
/// offset, dead time and what else is searched to first order about their values for all stretches. What is left open
/// is chosen once, on all stretches, as [`identify`](crate::identify) does: the extensions that stay, the number of
/// operators, the weight law and the smoothness. All modified models have the law and the operators of the last of
/// them, so that they differ by their extensions alone.
///
/// Samples that the last model takes for glitches are left out for all ([`Options::loss`]).
///
/// Without a sampling interval a Duhem operator is the only extension that is tried.
///
/// The model of `options` does not matter: plays and coupled plays are both fitted. Split weights are for coupled plays
/// only; plays then have free ones. A [`Stop`] of either kind ends the comparison without a result.
///
/// # Errors
/// As [`identify`](crate::identify).
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// use hysteresis_identify::{Options, Record, Thresholds, compare};
///
/// let actuator = ModifiedPrandtlIshlinskii::from_ratios(
///     &[1.0, 0.3, 0.2, 0.1], &[0.0, 1.25, 2.5, 3.75], Ratios::PAPER, Offsets::default())?;
/// let mut stream = actuator.forward();
/// let input: Vec<f64> = (0..800).map(|k| 5.0 * (1.0 - k as f64 / 800.0) * (k as f64 / 20.0).sin()).collect();
/// let output: Vec<f64> = input.iter().map(|u| stream.step(*u)).collect();
///
/// let options = Options { thresholds: Thresholds::Uniform(4), ..Options::default() };
/// let found = compare(&[Record::new(&input, &output, 0)?], &options, &mut |_| ControlFlow::Continue(()))?;
/// let [conventional, _, modified, _] = &found.models[..] else { panic!() };
/// assert!(modified.held_out < 0.2 * conventional.held_out);
/// assert_eq!(found.simplest().name, "modified");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn compare(
    records: &[Record<'_>],
    options: &Options,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<Stop>,
) -> Result<Comparison, Error> {
    if records.is_empty() {
        return Err(Error::NoRecords);
    }
    let options = Options { model: ModelKind::Modified, ..options.with_asked_modes().with_coupled_plays() };
    options.check()?;
    // What is wrong with the whole is said before the search of a part.
    Space::new(records, &options)?;
    let (mut candidates, omitted) = candidates(records, &options)?;
    let count = candidates.len();
    let (mut judgements, mut law, mut evaluations) = (Vec::new(), None, 0);
    let mut left_out = None;
    // Backwards, as the last of the coupled plays tells the others their weight law.
    while let Some(candidate) = candidates.pop() {
        let candidate = candidate.under(law.as_ref());
        let done = count - 1 - candidates.len();
        let mut report = |now: &Progress| {
            let fraction = (as_f64(done) + now.fraction) / as_f64(count);
            let now = Progress { fraction, evaluations: evaluations + now.evaluations, ..*now };
            // Half a comparison is none.
            match progress(&now) {
                ControlFlow::Break(_) => ControlFlow::Break(Stop::Discard),
                ControlFlow::Continue(()) => ControlFlow::Continue(()),
            }
        };
        let mut monitor = SearchMonitor::new(&mut report).on_all_processors(records);
        let found = match &left_out {
            // The last one tells what all of them leave out.
            None => {
                let (found, glitches) = search_without_glitches(records, &candidate.options, &mut monitor)?;
                left_out = Some(glitches);
                found
            }
            Some(glitches) => {
                let search = if candidate.has_polynomial { search_polynomial } else { search_all };
                search(&leaving_out(records, glitches)?, &candidate.options, &mut monitor)?
            }
        };
        let searched = monitor.evaluations();
        // It reports with the evaluations before.
        drop(monitor);
        evaluations += searched;
        law.get_or_insert_with(|| Law::of(&found));
        let fitted = leaving_out(records, left_out.get_or_insert_default())?;
        judgements.push(judged(&fitted, &candidate, found));
    }
    judgements.reverse();
    share_modified(&mut judgements);
    let (models, validations): (Vec<_>, Vec<_>) = judgements.into_iter().unzip();
    let simplest = CrossValidation::good(&validations, 1.0).next().unwrap_or(0);
    Ok(Comparison { models, simplest, omitted, stretches: FOLDS, left_out_samples: left_out.unwrap_or_default() })
}

/// Gives the numbers of the modified model to those of its extensions that cross-validation left out: it is the same
/// model, and another search may end a little beside. The model with all extensions stays what
/// [`identify`](crate::identify) finds.
fn share_modified(judgements: &mut [(ComparedModel, CrossValidation)]) {
    let Some(place) = judgements.iter().position(|(model, _)| model.name == MODIFIED) else { return };
    let (modified, validation) = judgements[place].clone();
    for (model, own_validation) in &mut judgements[place + 1..] {
        if model.kept.is_empty() && model.name != ALL {
            *model = ComparedModel { name: model.name.clone(), ..modified.clone() };
            *own_validation = validation.clone();
        }
    }
}

/// The names of coupled plays alone, and of those with all extensions.
const MODIFIED: &str = "modified";
pub(crate) const ALL: &str = "modified + all";

/// A model to compare.
pub(crate) struct Candidate {
    pub(crate) name: String,
    pub(crate) options: Options,
    /// Whether the square and the cube of the drive stand beside its operators.
    has_polynomial: bool,
}

impl Candidate {
    fn plain(name: &str, options: Options) -> Self {
        Self { name: name.to_owned(), options, has_polynomial: false }
    }

    /// The same with the weight law of another model of coupled plays, if there is one. Plays choose their own.
    fn under(mut self, law: Option<&Law>) -> Self {
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
struct Law {
    weights: WeightLaw,
    thresholds: Thresholds,
    smoothness: f64,
}

impl Law {
    fn of(found: &Found) -> Self {
        let Options { weights, thresholds, .. } = found.options.clone();
        Self { weights, thresholds, smoothness: found.smoothness }
    }
}

/// The models to compare, the simplest first, and the extensions that are left out.
type Candidates = (Vec<Candidate>, Vec<(Extension, Omission)>);

/// The models that these records can tell, and the extensions that they cannot.
pub(crate) fn candidates(records: &[Record<'_>], asked: &Options) -> Result<Candidates, Error> {
    let told = asked.resolved(records)?;
    let creep = if told.creep == CreepModel::None { CreepModel::None } else { CreepModel::UnderWay };
    let modified = Options { creep, duhem: DuhemModel::None, ..told.hysteresis_and_dead_time() };
    let conventional = plays(&modified);
    let mut candidates = vec![
        Candidate::plain("conventional", conventional.clone()),
        Candidate { has_polynomial: true, ..Candidate::plain("polynomial + plays", conventional) },
        Candidate::plain(MODIFIED, modified.clone()),
    ];
    let has_seconds = asked.intervals(records)?.are_seconds();
    let mut omitted = Vec::new();
    for extension in Extension::ALL {
        if has(&told, extension) {
            let name = format!("{MODIFIED} + {}", extension.name());
            candidates.push(Candidate::plain(&name, with(&modified, extension, &told)));
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

/// Whether options have an extension, or leave it open.
fn has(options: &Options, extension: Extension) -> bool {
    match extension {
        Extension::Creep => options.creep.has_terms() || options.creep == CreepModel::Auto,
        Extension::LoopShift => options.loop_shift != LoopShiftModel::None,
        Extension::RelaxingPlays => options.relaxing_plays != RelaxingPlaysModel::None,
        Extension::SlowGain => options.slow_gain != SlowGainModel::None,
        Extension::Dynamics => {
            options.dynamics != DynamicsModel::None || matches!(options.amplifier, AmplifierModel::Bandwidth(_))
        }
        Extension::Maps => [options.input_map, options.output_map].iter().any(|map| *map != MapModel::None),
        Extension::Duhem => options.duhem != DuhemModel::None,
    }
}

/// Options with one extension of others.
fn with(plain: &Options, extension: Extension, told: &Options) -> Options {
    match extension {
        Extension::Creep => Options { creep: told.creep.clone(), ..plain.clone() },
        Extension::LoopShift => Options { loop_shift: told.loop_shift, ..plain.clone() },
        Extension::RelaxingPlays => Options { relaxing_plays: told.relaxing_plays.clone(), ..plain.clone() },
        Extension::SlowGain => Options { slow_gain: told.slow_gain, ..plain.clone() },
        Extension::Dynamics => Options { dynamics: told.dynamics, amplifier: told.amplifier, ..plain.clone() },
        Extension::Maps => Options { input_map: told.input_map, output_map: told.output_map, ..plain.clone() },
        Extension::Duhem => Options { duhem: told.duhem.clone(), ..plain.clone() },
    }
}

/// The errors of a fit on what it was fitted to and on stretches held out.
pub(crate) fn judged(records: &[Record<'_>], candidate: &Candidate, found: Found) -> (ComparedModel, CrossValidation) {
    let chain = found.fit.chain(found.interval(records));
    let Found { fit, options, smoothness, basis, .. } = found;
    let JointFit { space, fit, .. } = fit;
    let projection = Projection::new(records, &space, &basis, smoothness, 1);
    let terms = Terms { creep: space.creep_amplitudes(), loop_shift: options.loop_shift, smoothness };
    let validation = Stretches::new(&projection, &fit).under(&options, &basis).cross_validate(&terms);
    let kept = [
        (Extension::Creep, space.creep_amplitudes() > 0),
        (Extension::LoopShift, space.side().is_some_and(|side| !side.filters.is_empty())),
        (Extension::RelaxingPlays, space.relaxing().is_some()),
        (Extension::SlowGain, space.has_slow_gain()),
        (Extension::Dynamics, space.order().is_some() || space.has_amplifier()),
        (Extension::Maps, space.has_map()),
        (Extension::Duhem, space.duhem(&fit.point).is_some()),
    ];
    let intervals = (0..records.len()).map(|place| space.intervals().of_record(place)).collect();
    let fitted = Fitted { chain, output_offsets: fit.output_offsets, intervals };
    let quality = |(place, record): (usize, &Record<'_>)| {
        errors_of(record, &fitted.residuals(place, record.input(), record.output()))
    };
    let qualities: Vec<_> = records.iter().enumerate().map(quality).collect();
    let model = ComparedModel {
        name: candidate.name.clone(),
        // What was not chosen among few operators is free.
        weights: if options.weights == WeightLaw::Auto { WeightLaw::Free } else { options.weights },
        unknowns: basis.freedom() + space.own().len() + space.axes().len(),
        kept: kept.into_iter().filter(|(_, is_kept)| *is_kept).map(|(extension, _)| extension).collect(),
        fit: Quality::pooled(&qualities),
        held_out: validation.rmse,
        stretches: validation.stretches.iter().map(|square| square.sqrt()).collect(),
        fitted,
    };
    (model, validation)
}
