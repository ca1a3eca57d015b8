//! What is left to cross-validation: the number of operators and how smooth their weights are.

use crate::error::Error;
use crate::folds::{CrossValidation, SMOOTHNESS, Stretches};
use crate::law::Law;
use crate::options::{Options, Setting, Thresholds};
use crate::projection::{Fit, Projection};
use crate::record::Record;
use crate::search::{Monitor, search};
use crate::space::Space;

/// The scan uses about this many samples per unknown, however long the records are.
const SCAN_SAMPLES_PER_UNKNOWN: usize = 40;

/// Before the descent on all samples, one on about so many: most steps of a long record cost little.
const REFINE_SAMPLES: usize = 20_000;

/// The numbers of operators that cross-validation chooses from.
const OPERATORS: [usize; 8] = [4, 6, 8, 12, 16, 20, 24, 32];

/// Options that leave nothing to cross-validation.
pub(crate) struct Choice {
    pub(crate) options: Options,
    pub(crate) smoothness: f64,
    /// What cross-validation said of every number of operators and of every smoothness, as far as it chose.
    pub(crate) operators_tried: Vec<CrossValidation>,
    pub(crate) smoothness_tried: Vec<CrossValidation>,
    /// The fit of the choice on many of the samples, if there was a choice: where to go on.
    pub(crate) start: Option<Fit>,
}

/// Chooses what `options` leave open, each candidate at the ratios, offset and delay that suit it.
pub(crate) fn choose(records: &[Record<'_>], options: &Options, monitor: &mut Monitor<'_>) -> Result<Choice, Error> {
    let placed: Option<fn(usize) -> Thresholds> = match options.thresholds {
        Thresholds::Auto => Some(Thresholds::Uniform),
        Thresholds::AutoQuantiles => Some(Thresholds::Quantiles),
        _ => None,
    };
    let Some(placed) = placed else {
        return match options.smoothness {
            Setting::Fixed(smoothness) => Ok(Choice {
                options: options.clone(),
                smoothness,
                operators_tried: Vec::new(),
                smoothness_tried: Vec::new(),
                start: None,
            }),
            Setting::Fit => {
                monitor.within(0, 2);
                let candidate = candidate(records, options, monitor)?;
                monitor.within(1, 2);
                Ok(candidate.chosen(Vec::new()))
            }
        };
    };
    let mut candidates = Vec::new();
    for (done, operators) in OPERATORS.into_iter().enumerate() {
        monitor.within(done, OPERATORS.len() + 1);
        let options = Options { thresholds: placed(operators), ..options.clone() };
        match candidate(records, &options, monitor) {
            Err(Error::TooFewSamples { .. }) if !candidates.is_empty() => break,
            candidate => candidates.push(candidate?),
        }
    }
    monitor.within(OPERATORS.len(), OPERATORS.len() + 1);
    let tried: Vec<_> = candidates.iter().map(|candidate| candidate.validation).collect();
    let good = CrossValidation::good(&tried).map(|one| one.operators).min();
    let smallest = candidates.into_iter().find(|candidate| Some(candidate.validation.operators) == good);
    // The best candidate is within the limit that it sets itself.
    smallest.map(|candidate| candidate.chosen(tried)).ok_or(Error::NoOperators)
}

/// A number of operators, fitted on many of the samples and cross-validated.
struct Candidate {
    options: Options,
    fit: Fit,
    validation: CrossValidation,
    smoothness_tried: Vec<CrossValidation>,
}

impl Candidate {
    fn chosen(self, operators_tried: Vec<CrossValidation>) -> Choice {
        Choice {
            smoothness: self.validation.smoothness,
            options: self.options,
            operators_tried,
            smoothness_tried: self.smoothness_tried,
            start: Some(self.fit),
        }
    }
}

fn candidate(records: &[Record<'_>], options: &Options, monitor: &mut Monitor<'_>) -> Result<Candidate, Error> {
    let (space, law) = (Space::new(records, options), Law::new(options));
    let given = match options.smoothness {
        Setting::Fixed(smoothness) => Some(smoothness),
        Setting::Fit => None,
    };
    let levels = levels(records, &space, &law, given.unwrap_or(0.0), true)?;
    let (fit, _) = search(&levels, &law, None, monitor)?;
    let stretches = Stretches::new(&levels[levels.len() - 1], &fit);
    let validate = |smoothness: f64| stretches.cross_validate(options.operators(), smoothness);
    let (validation, smoothness_tried) = match given {
        Some(smoothness) => (validate(smoothness), Vec::new()),
        None => {
            let tried = SMOOTHNESS.map(validate);
            let smoothest = CrossValidation::good(&tried).last().copied();
            (smoothest.unwrap_or(tried[0]), tried.to_vec())
        }
    };
    Ok(Candidate { options: options.clone(), fit, validation, smoothness_tried })
}

/// The same problem on ever more rows; `roughly` without the last of them.
pub(crate) fn levels<'a>(
    records: &'a [Record<'a>],
    space: &'a Space,
    law: &'a Law,
    smoothness: f64,
    roughly: bool,
) -> Result<Vec<Projection<'a>>, Error> {
    let unknowns = law.freedom() + records.len() + space.axes().len();
    let samples: usize = records.iter().map(Record::fitted_samples).sum();
    if samples < 2 * unknowns {
        return Err(Error::TooFewSamples { expected: 2 * unknowns, got: samples });
    }
    let mut strides = vec![(samples / (SCAN_SAMPLES_PER_UNKNOWN * unknowns)).max(1)];
    strides.extend(Some(samples / REFINE_SAMPLES).filter(|stride| *stride > 1));
    if !roughly || strides.len() == 1 {
        strides.push(1);
    }
    Ok(strides.iter().map(|stride| Projection::new(records, space, law, smoothness, *stride)).collect())
}
