//! What is left to cross-validation before anything else is searched: the number of operators.

use crate::error::Error;
use crate::fit::folds::{CrossValidation, SMOOTHNESS, Stretches, Terms};
use crate::fit::monitor::SearchMonitor;
use crate::fit::projection::{ProjectedFit, Projection};
use crate::fit::search::search;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::loop_shift_model::LoopShiftModel;
use crate::options::{Options, Setting, Thresholds};
use crate::record::Record;

/// The scan uses about this many samples per unknown, however long the records are.
const SCAN_SAMPLES_PER_UNKNOWN: usize = 40;

/// Before the descent on all samples, others on about so many: most steps of a long record cost little.
const REFINE_SAMPLES: [usize; 2] = [20_000, 160_000];

/// The numbers of operators that cross-validation chooses from.
const OPERATORS: [usize; 8] = [4, 6, 8, 12, 16, 20, 24, 32];

/// How many operators there are, where they were left open, and what cross-validation said.
pub(crate) struct OperatorChoice {
    pub(crate) options: Options,
    pub(crate) tried: Vec<CrossValidation>,
    /// The fit of the choice on many of the samples, if there was a choice: where to go on.
    pub(crate) start: Option<ProjectedFit>,
}

/// Chooses the number of operators, if `options` leave it open, each at the ratios, offset, dead time and smoothness that suit
/// it: the fewest that predict as well as the best. Stopped and told to keep the best, it chooses from what it has tried.
pub(crate) fn choose_operators(
    records: &[Record<'_>],
    options: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<OperatorChoice, Error> {
    let placed: fn(usize) -> Thresholds = match options.thresholds {
        Thresholds::Auto => Thresholds::Uniform,
        Thresholds::AutoQuantiles => Thresholds::Quantiles,
        Thresholds::AutoGeometric => Thresholds::Geometric,
        _ => return Ok(OperatorChoice { options: options.clone(), tried: Vec::new(), start: None }),
    };
    let searches = OPERATORS.len() + 1;
    let mut candidates: Vec<Candidate> = Vec::new();
    for (number, operators) in OPERATORS.into_iter().enumerate() {
        monitor.within(number, searches);
        let options = Options { thresholds: placed(operators), ..options.clone() };
        match candidate(records, &options, monitor) {
            // Few samples bear few operators.
            Err(Error::TooFewSamples { .. }) if !candidates.is_empty() => break,
            Err(Error::Interrupted) if monitor.keeps_best() && !candidates.is_empty() => break,
            // The best of the only one that was begun is kept with its options.
            Err(Error::Interrupted) if monitor.keeps_best() => {
                return Ok(OperatorChoice { options, tried: Vec::new(), start: None });
            }
            candidate => candidates.push(candidate?),
        }
    }
    monitor.within(searches - 1, searches);
    let tried: Vec<_> = candidates.iter().map(|candidate| candidate.validation.clone()).collect();
    let good = CrossValidation::good(&tried, 1.0).next().unwrap_or(0);
    let Candidate { options, fit, .. } = candidates.swap_remove(good);
    Ok(OperatorChoice { options, tried, start: Some(fit) })
}

/// Fitted on many of the samples and cross-validated.
struct Candidate {
    options: Options,
    fit: ProjectedFit,
    validation: CrossValidation,
}

fn candidate(records: &[Record<'_>], options: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Candidate, Error> {
    let (space, basis) = (Space::new(records, options)?, WeightBasis::new(options, 0));
    let levels = levels(records, &space, &basis, options.given_smoothness(), true)?;
    let (fit, _) = search(&levels, &basis, None, monitor)?;
    let stretches = Stretches::new(&levels[levels.len() - 1], &fit);
    let under = stretches.under(options, &basis);
    let terms = |smoothness| Terms { creep: 0, loop_shift: LoopShiftModel::None, smoothness };
    let tried: Vec<_> = options.smoothnesses().iter().map(|value| under.cross_validate(&terms(*value))).collect();
    let validation = CrossValidation::best(&tried).cloned().unwrap_or_else(|| under.cross_validate(&terms(0.0)));
    Ok(Candidate { options: options.clone(), validation, fit })
}

impl Options {
    /// The smoothness that was given; none while it is left to cross-validation.
    pub(crate) fn given_smoothness(&self) -> f64 {
        match self.smoothness {
            Setting::Fixed(smoothness) => smoothness,
            Setting::Fit => 0.0,
        }
    }

    /// What cross-validation tries for the smoothness.
    pub(crate) fn smoothnesses(&self) -> &[f64] {
        match &self.smoothness {
            Setting::Fixed(smoothness) => std::slice::from_ref(smoothness),
            Setting::Fit => &SMOOTHNESS,
        }
    }
}

/// How many samples there are, if there are enough for so many unknowns, and the latter.
pub(crate) fn enough(records: &[Record<'_>], space: &Space, basis: &WeightBasis) -> Result<(usize, usize), Error> {
    let unknowns = basis.freedom() + space.own().len() + space.axes().len();
    let samples: usize = records.iter().map(Record::fitted_samples).sum();
    if samples < 2 * unknowns {
        return Err(Error::TooFewSamples { expected: 2 * unknowns, got: samples });
    }
    Ok((samples, unknowns))
}

/// The same problem on ever more rows; `roughly` without the last of them.
pub(crate) fn levels<'a>(
    records: &'a [Record<'a>],
    space: &'a Space,
    basis: &'a WeightBasis,
    smoothness: f64,
    roughly: bool,
) -> Result<Vec<Projection<'a>>, Error> {
    let (samples, unknowns) = enough(records, space, basis)?;
    let mut strides = vec![(samples / (SCAN_SAMPLES_PER_UNKNOWN * unknowns)).max(1)];
    strides.extend(REFINE_SAMPLES.map(|rows| samples / rows).into_iter().filter(|stride| *stride > 1));
    strides.truncate(if roughly { 2 } else { strides.len() });
    if !roughly || strides.len() == 1 {
        strides.push(1);
    }
    Ok(strides.iter().map(|stride| Projection::new(records, space, basis, smoothness, *stride)).collect())
}
