//! What is left to cross-validation: the weight law, the number of operators, and how smooth their weights are.

use crate::error::Error;
use crate::fit::folds::{CrossValidation, SMOOTHNESS, Stretches};
use crate::fit::monitor::SearchMonitor;
use crate::fit::point::Point;
use crate::fit::projection::{ProjectedFit, Projection};
use crate::fit::search::search;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::options::{Options, Setting, Thresholds, WeightLaw};
use crate::record::Record;

/// The scan uses about this many samples per unknown, however long the records are.
const SCAN_SAMPLES_PER_UNKNOWN: usize = 40;

/// Before the descent on all samples, others on about so many: most steps of a long record cost little.
const REFINE_SAMPLES: [usize; 2] = [20_000, 160_000];

/// With how many operators the weight law is chosen if their number is left open too.
const USUAL_OPERATORS: usize = 20;

/// The numbers of operators that cross-validation chooses from.
const OPERATORS: [usize; 8] = [4, 6, 8, 12, 16, 20, 24, 32];

/// The laws that cross-validation chooses from, those with fewer unknowns first.
const LAWS: [WeightLaw; 3] = [WeightLaw::Quadratic, WeightLaw::Free, WeightLaw::Split];

/// Options that leave nothing to cross-validation, and what it said.
pub(crate) struct Choice {
    pub(crate) options: Options,
    pub(crate) smoothness: f64,
    pub(crate) weights_tried: Vec<CrossValidation>,
    pub(crate) operators_tried: Vec<CrossValidation>,
    pub(crate) smoothness_tried: Vec<CrossValidation>,
    /// The fit of the choice on many of the samples, if there was a choice: where to go on.
    pub(crate) start: Option<ProjectedFit>,
    /// Where the choice was stopped, if it was and the best is to be kept.
    pub(crate) stopped: Option<Point>,
}

/// What to keep if the choice is stopped: the best candidate so far, or before there is one the candidate in work.
struct Underway {
    options: Options,
    best: Option<(CrossValidation, Point)>,
}

/// Chooses what `options` leave open, each candidate at the ratios, offset and dead time that suit it: first the weight law,
/// then the number of operators, the smoothness of each on the way. Stopped and told to keep the best, it chooses from what
/// it has tried until then.
pub(crate) fn choose(
    records: &[Record<'_>],
    options: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Choice, Error> {
    let mut underway = Underway { options: options.clone(), best: None };
    match (choose_all(records, options, &mut underway, monitor), monitor.kept()) {
        (Err(Error::Interrupted), Some(point)) => {
            let Underway { options, best } = underway;
            let (smoothness, point) =
                best.map_or((given_smoothness(&options), point), |(validation, point)| (validation.smoothness, point));
            let nothing = Vec::new;
            Ok(Choice {
                options,
                smoothness,
                weights_tried: nothing(),
                operators_tried: nothing(),
                smoothness_tried: nothing(),
                start: None,
                stopped: Some(point),
            })
        }
        (choice, _) => choice,
    }
}

/// The smoothness that was given; none while it is left to cross-validation.
fn given_smoothness(options: &Options) -> f64 {
    match options.smoothness {
        Setting::Fixed(smoothness) => smoothness,
        Setting::Fit => 0.0,
    }
}

fn choose_all(
    records: &[Record<'_>],
    options: &Options,
    underway: &mut Underway,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Choice, Error> {
    let placed: Option<fn(usize) -> Thresholds> = match options.thresholds {
        Thresholds::Auto => Some(Thresholds::Uniform),
        Thresholds::AutoQuantiles => Some(Thresholds::Quantiles),
        _ => None,
    };
    let mut options = options.clone();
    let (mut weights_tried, mut operators_tried, mut best) = (Vec::new(), Vec::new(), None);
    let (laws, counts) = (options.weights == WeightLaw::Auto, placed.is_some());
    let searches = usize::from(laws) * LAWS.len() + usize::from(counts) * OPERATORS.len() + 1;
    if laws {
        let thresholds = placed.map_or(options.thresholds.clone(), |placed| placed(USUAL_OPERATORS));
        let with = |weights| Options { weights, thresholds: thresholds.clone(), ..options.clone() };
        // Few samples are no reason to believe in the law of few unknowns.
        let free = with(WeightLaw::Free);
        enough(records, &Space::new(records, &free)?, &WeightBasis::new(&free))?;
        let possible = LAWS.into_iter().map(with).filter(Options::is_law_of_its_own).collect();
        let (candidate, tried) = simplest_good(records, possible, (0, searches), underway, monitor)?;
        options.weights = candidate.options.weights;
        weights_tried = tried;
        best = Some(candidate);
    }
    if let Some(placed) = placed {
        let with = |operators| Options { thresholds: placed(operators), ..options.clone() };
        let done = usize::from(laws) * LAWS.len();
        let possible = OPERATORS.into_iter().map(with).collect();
        let (candidate, tried) = simplest_good(records, possible, (done, searches), underway, monitor)?;
        operators_tried = tried;
        best = Some(candidate);
    }
    if best.is_none() && options.smoothness == Setting::Fit {
        monitor.within(0, 2);
        underway.options = options.clone();
        best = Some(candidate(records, &options, monitor)?);
        monitor.within(1, 2);
    } else {
        monitor.within(searches - 1, searches);
    }
    let choice = Choice {
        smoothness: given_smoothness(&options),
        options,
        weights_tried,
        operators_tried,
        smoothness_tried: Vec::new(),
        start: None,
        stopped: None,
    };
    Ok(match best {
        None => choice,
        Some(Candidate { options, fit, validation, smoothness_tried }) => {
            Choice { options, smoothness: validation.smoothness, smoothness_tried, start: Some(fit), ..choice }
        }
    })
}

/// Fitted on many of the samples and cross-validated.
struct Candidate {
    options: Options,
    fit: ProjectedFit,
    validation: CrossValidation,
    smoothness_tried: Vec<CrossValidation>,
}

/// Of candidates with ever more unknowns the first that is as good as the best, and what cross-validation said of all;
/// those for which there are too few samples are left out, unless it is all of them. They are searches number `done` and
/// on of so many.
fn simplest_good(
    records: &[Record<'_>],
    options: Vec<Options>,
    (done, searches): (usize, usize),
    underway: &mut Underway,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Candidate, Vec<CrossValidation>), Error> {
    let mut candidates: Vec<Candidate> = Vec::new();
    let earlier = underway.best.as_ref().map(|(validation, _)| validation.clone());
    for (number, options) in options.into_iter().enumerate() {
        monitor.within(done + number, searches);
        if underway.best.is_none() {
            underway.options = options.clone();
        }
        match candidate(records, &options, monitor) {
            Err(Error::TooFewSamples { .. }) if !candidates.is_empty() => break,
            candidate => candidates.push(candidate?),
        }
        // What an earlier choice found is kept until one of these predicts as well: the first are the coarsest.
        let tried: Vec<_> =
            candidates.iter().map(|candidate| candidate.validation.clone()).chain(earlier.clone()).collect();
        if let Some(best) = candidates.get(good(&tried)) {
            underway.options = best.options.clone();
            underway.best = Some((best.validation.clone(), best.fit.point));
        }
    }
    let tried: Vec<_> = candidates.iter().map(|candidate| candidate.validation.clone()).collect();
    let good = good(&tried);
    Ok((candidates.swap_remove(good), tried))
}

/// The first of the candidates that is as good as the best.
fn good(tried: &[CrossValidation]) -> usize {
    CrossValidation::good(tried).next().unwrap_or(0)
}

fn candidate(records: &[Record<'_>], options: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Candidate, Error> {
    let (space, basis) = (Space::new(records, options)?, WeightBasis::new(options));
    let given = match options.smoothness {
        Setting::Fixed(smoothness) => Some(smoothness),
        Setting::Fit => None,
    };
    let levels = levels(records, &space, &basis, given.unwrap_or(0.0), true)?;
    let (fit, _) = search(&levels, &basis, None, monitor)?;
    let stretches = Stretches::new(&levels[levels.len() - 1], &fit);
    let validate = |smoothness: f64| stretches.cross_validate(options, smoothness);
    let smoothness_tried = if given.is_none() { SMOOTHNESS.map(validate).to_vec() } else { Vec::new() };
    let best = CrossValidation::best(&smoothness_tried).cloned();
    let validation = best.unwrap_or_else(|| validate(given.unwrap_or(0.0)));
    Ok(Candidate { options: options.clone(), fit, validation, smoothness_tried })
}

/// How many samples there are, if there are enough for so many unknowns, and the latter.
fn enough(records: &[Record<'_>], space: &Space, basis: &WeightBasis) -> Result<(usize, usize), Error> {
    let unknowns = basis.freedom() + records.len() + space.axes().len();
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
