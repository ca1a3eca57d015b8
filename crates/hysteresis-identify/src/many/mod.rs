//! Many actuators at once.
//!
//! Actuators with one drive share what depends on the drive alone. `scan.rs` has the columns of the operators and their
//! derivatives at many points, factorised; so where an actuator should start, and its first step, take no pass over the
//! operators. `descent.rs` goes on from there with passes of its own, on normal equations (`normal.rs`). Actuators with a drive
//! each (`own.rs`) are searched like single ones. `share.rs` shares the work out among threads; every actuator is fitted by
//! itself, so their number changes no bit, and neither do the other actuators.

mod boxed;
mod choose;
mod columns;
mod descent;
mod normal;
mod own;
mod records;
mod result;
mod scan;
mod settle;
mod share;
mod shared;
mod visits;

use std::ops::ControlFlow;

pub use records::ManyRecords;
pub use result::{ActuatorFit, BriefFinding, ManyIdentifications};
use share::Shared;

use crate::error::Error;
use crate::fit::levels::levels;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::loss::Loss;
use crate::options::Options;

/// Fits a model of hysteresis and a dead time to each of many actuators, on up to `threads` threads.
///
/// The model, what is searched and what is minimised are those of [`identify`](crate::identify()) without maps. Actuators with a drive of
/// their own are searched in the same way and come to the same bits. Actuators with one drive share the work that depends on the drive
/// alone, and come to as good a fit in a small part of the time; where an objective has several minima of nearly the same
/// height, it may be another one of them.
///
/// All samples count: glitches are not looked for, whatever [`Options::loss`] leaves open. A robust loss is refused.
///
/// What is left to cross-validation is chosen once for all actuators ([`settled_options`]). An actuator that cannot be fitted has
/// its error in the result and takes nothing from the others. The result does not depend on the number of threads, nor on which
/// other actuators there are, but for that choice. `progress` is called on the calling thread, with the number of actuators
/// that are done; [`ControlFlow::Break`] stops.
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
/// Those of [`identify`](crate::identify()) that are about the options or the length of the records; [`Error::LinearPart`] for
/// dynamics or creep; [`Error::RobustMany`] for a robust loss; [`Error::Interrupted`] when `progress` said to stop.
pub fn identify_many(
    records: &ManyRecords<'_>,
    options: &Options,
    threads: usize,
    progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
) -> Result<ManyIdentifications, Error> {
    let mut shared = Shared::new(threads, progress);
    let options = settled(records, options, &mut shared)?;
    check_length(records, &options)?;
    let is_shared = records.is_shared() && WeightBasis::new(&options, 0).columns() <= shared::MOST_WEIGHTS;
    let actuators = if is_shared {
        shared::fit_all(records, &options, &mut shared)?
    } else {
        own::fit_all(records, &options, &mut shared)?
    };
    Ok(ManyIdentifications { actuators, options })
}

/// What is wrong with the length of all records is said once.
fn check_length(records: &ManyRecords<'_>, options: &Options) -> Result<(), Error> {
    let Some(record) = (0..records.actuators()).find_map(|m| records.record(m).ok()) else { return Ok(()) };
    let (record, basis) = (std::slice::from_ref(&record), WeightBasis::new(options, 0));
    levels(record, &Space::new(record, options)?, &basis, 0.0, false).map(drop)
}

/// The options with everything chosen that is left to cross-validation, once for all actuators.
///
/// [`Thresholds::Refined`](crate::Thresholds::Refined) and its kin stay 20 operators: one number is for all.
///
/// The first, the middle and the last actuator that can be fitted are asked. Of their answers the weight law of the most
/// unknowns counts, the largest number of operators, and the middle smoothness.
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
    // What is left open is left out here.
    if options.needs_seconds() {
        return Err(Error::LinearPart);
    }
    let options = Options { thresholds: options.thresholds.unrefined(), ..options.hysteresis_and_dead_time() };
    choose::settled(records, &options, shared)
}
