//! Many actuators at once.
//!
//! Actuators with one drive share what depends on the drive alone. `scan.rs` has the columns of the operators and their
//! derivatives at many points, factorised; so where an actuator should start, and its first step, take no pass over the
//! operators. `descent.rs` goes on from there with passes of its own, on normal equations (`normal.rs`). Actuators with
//! a drive each are searched like single ones. `search.rs` does both and shares the work out among threads; every
//! actuator is fitted by itself, so their number changes no bit, and neither do the other actuators.

pub(crate) mod descent;
pub(crate) mod normal;
pub(crate) mod records;
pub(crate) mod scan;
pub(crate) mod search;

use std::ops::ControlFlow;
use std::slice;

use crate::choose::search::search_all;
use crate::error::Error;
use crate::fit::progress::{SearchMonitor, Stop};
use crate::fit::projection::levels;
use crate::fit::space::Space;
use crate::many::records::{ManyIdentifications, ManyRecords};
use crate::many::search::{MOST_WEIGHTS, fit_each, fit_sharing};
use crate::options::{Loss, Options, Setting};
use crate::terms::duhem::DuhemModel;
use crate::terms::side_columns::Sides;
use crate::terms::weights::WeightLaw;
use crate::threads::Shared;

/// Fits a model of hysteresis and a dead time to each of many actuators, on up to `threads` threads.
///
/// The model, what is searched and what is minimised are those of [`identify`](crate::identify()) without maps, and
/// with [`RatiosModel::Fit`](crate::RatiosModel::Fit) for [`Auto`](crate::RatiosModel::Auto). Actuators with a drive of
/// their own are searched in the same way and come to the same bits. Actuators with one drive share the work that
/// depends on the drive alone, and come to as good a fit in a small part of the time; where an objective has several
/// minima of nearly the same height, it may be another one of them.
///
/// All samples count: glitches are not looked for, whatever [`Options::loss`] leaves open. A robust loss is refused.
///
/// What is left to cross-validation is chosen once for all actuators ([`settled_options`]). An actuator that cannot be
/// fitted has its error in the result and takes nothing from the others. The result does not depend on the number of
/// threads, nor on which other actuators there are, but for that choice. `progress` is called on the calling thread,
/// with the number of actuators that are done; [`ControlFlow::Break`] stops.
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// use hysteresis_identify::{ManyRecords, Options, Thresholds, WeightLaw, identify_many};
///
/// let input: Vec<f64> = (0..800).map(|k| 5.0 * (1.0 - k as f64 / 800.0) * (k as f64 / 20.0).sin()).collect();
/// let thresholds = [0.0, 1.25, 2.5, 3.75];
/// let mut positions = Vec::new();
/// for gain in [1.0, 1.5, 2.0] {
///     let weights = [gain, 0.3, 0.2, 0.1];
///     let actuator =
///         ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default())?;
///     let mut stream = actuator.forward();
///     positions.extend(input.iter().map(|u| stream.step(*u)));
/// }
/// let options =
///     Options { thresholds: Thresholds::Given(thresholds.to_vec()), weights: WeightLaw::Free, ..Options::default() };
/// let records = ManyRecords::shared(&input, &positions, 0)?;
/// let found = identify_many(&records, &options, 2, &mut |_| ControlFlow::Continue(()))?;
/// for fit in found.actuators {
///     assert!(fit?.nrmse() < 1e-9);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Those of [`identify`](crate::identify()) that are about the options or the length of the records;
/// [`Error::LinearPart`] for dynamics or creep; [`Error::DuhemMany`] for a Duhem operator; [`Error::RobustMany`] for a
/// robust loss; [`Error::Interrupted`] when `progress` said to stop.
pub fn identify_many(
    records: &ManyRecords<'_>,
    options: &Options,
    threads: usize,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<ManyIdentifications, Error> {
    let mut shared = Shared::new(threads, progress);
    let options = settled(records, options, &mut shared)?;
    check_length(records, &options)?;
    let is_shared = records.is_shared() && options.weight_basis(Sides::default()).columns() <= MOST_WEIGHTS;
    let actuators = if is_shared {
        fit_sharing(records, &options, &mut shared)?
    } else {
        fit_each(records, &options, &mut shared)?
    };
    Ok(ManyIdentifications { actuators, options })
}

/// What is wrong with the length of all records is said once.
fn check_length(records: &ManyRecords<'_>, options: &Options) -> Result<(), Error> {
    let Some(record) = (0..records.actuators()).find_map(|m| records.record(m).ok()) else { return Ok(()) };
    let (record, basis) = (std::slice::from_ref(&record), options.weight_basis(Sides::default()));
    levels(record, &Space::new(record, options)?, &basis, 0.0, false).map(drop)
}

/// The options with everything chosen that is left to cross-validation, once for all actuators.
///
/// [`Thresholds::Refined`](crate::Thresholds::Refined) and its kin stay 20 operators: one number is for all.
///
/// The first, the middle and the last actuator that can be fitted are asked. Of their answers the weight law of the
/// most unknowns counts, the largest number of operators, and the middle smoothness.
///
/// # Errors
/// As [`identify_many`].
pub fn settled_options(
    records: &ManyRecords<'_>,
    options: &Options,
    threads: usize,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<Options, Error> {
    settled(records, options, &mut Shared::new(threads, progress))
}

fn settled(records: &ManyRecords<'_>, options: &Options, shared: &mut Shared<'_>) -> Result<Options, Error> {
    options.check()?;
    if options.loss == Loss::Robust {
        return Err(Error::RobustMany);
    }
    if matches!(options.duhem, DuhemModel::Fit | DuhemModel::Near(_)) {
        return Err(Error::DuhemMany);
    }
    // What is left open is left out here.
    if options.needs_seconds() {
        return Err(Error::LinearPart);
    }
    let options = Options { thresholds: options.thresholds.unrefined(), ..options.hysteresis_and_dead_time() };
    let options = options.with_coupled_plays();
    chosen_once(records, &options, shared)
}

/// How many actuators are asked.
const ASKED: usize = 3;

/// Whether nothing is left to choose.
fn is_settled(options: &Options) -> bool {
    let counted = !options.thresholds.are_counted_by_validation();
    counted && options.weights != WeightLaw::Auto && options.smoothness != Setting::Fit
}

/// The options with everything chosen: the weight law of the most unknowns and the most operators that cross-validation
/// asks for on any of a few actuators, and the middle smoothness.
fn chosen_once(records: &ManyRecords<'_>, options: &Options, shared: &mut Shared<'_>) -> Result<Options, Error> {
    let fitted: Vec<_> = (0..records.actuators()).filter_map(|m| records.record(m).ok()).collect();
    if is_settled(options) || fitted.is_empty() {
        return Ok(options.clone());
    }
    let count = ASKED.min(fitted.len());
    let place = |number: usize| number * (fitted.len() - 1) / (count - 1).max(1);
    let choices = shared.all(count, false, |number, underway| {
        let mut report =
            |_: &_| if underway.is_stopped() { ControlFlow::Break(Stop::Discard) } else { ControlFlow::Continue(()) };
        let record = slice::from_ref(&fitted[place(number)]);
        let found = search_all(record, options, &mut SearchMonitor::new(&mut report))?;
        Ok::<_, Error>(Chosen { options: found.options, smoothness: found.smoothness })
    });
    let choices: Vec<Chosen> = choices.ok_or(Error::Interrupted)?.into_iter().collect::<Result<_, _>>()?;
    Ok(together(options, &choices))
}

/// What one actuator asks for.
struct Chosen {
    options: Options,
    smoothness: f64,
}

fn together(options: &Options, choices: &[Chosen]) -> Options {
    let freedom = |law: WeightLaw| match law {
        WeightLaw::Auto | WeightLaw::Quadratic => 0,
        WeightLaw::Free => 1,
        WeightLaw::Split => 2,
    };
    let laws = choices.iter().map(|choice| choice.options.weights);
    let most = choices.iter().max_by_key(|choice| choice.options.operators());
    let mut smoothness: Vec<f64> = choices.iter().map(|choice| choice.smoothness).collect();
    smoothness.sort_by(f64::total_cmp);
    Options {
        weights: laws.max_by_key(|law| freedom(*law)).unwrap_or(options.weights),
        thresholds: most.map_or_else(|| options.thresholds.clone(), |most| most.options.thresholds.clone()),
        smoothness: Setting::Fixed(smoothness.get(smoothness.len() / 2).copied().unwrap_or(0.0)),
        ..options.clone()
    }
}
