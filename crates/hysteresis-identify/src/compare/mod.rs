//! Models side by side: each fitted to the same records and judged on the same stretches that it was not fitted to.

mod candidates;
mod judge;
mod result;
mod table;

use std::ops::ControlFlow;

use crate::compare::candidates::{ALL, Law, MODIFIED, candidates};
use crate::compare::judge::judged;
pub use crate::compare::result::{ComparedModel, Comparison, Extension, Omission};
use crate::error::Error;
use crate::fit::folds::{CrossValidation, FOLDS};
use crate::fit::monitor::{Progress, SearchMonitor, Stop};
use crate::fit::space::Space;
use crate::numeric::as_f64;
use crate::options::{ModelKind, Options};
use crate::record::Record;
use crate::robust::{leaving_out, search_without_glitches};
use crate::search::{search_all, search_polynomial};

/// Fits several models to the same records and judges each on stretches that it was not fitted to.
///
/// | model | y = |
/// |---|---|
/// | `conventional` | sum `w_i` p_i\[u\], p_i plays |
/// | `polynomial + plays` | `a_2` x^2 + `a_3` x^3 + sum `w_i` p_i\[u\], x the drive from -1 to 1 |
/// | `modified` | sum `w_i` z_i\[u\], z_i coupled plays |
/// | `modified + creep` and so on | the same with one extension |
/// | `modified + all` | with all extensions, as [`identify`](crate::identify) fits them |
///
/// The first play is the identity, so `w_0` is the linear term of the polynomial. Every model has a dead time, and an output offset
/// of each record; where `options` leave creep to the records, also the creep that was under way when a record began.
///
/// **The judge** is the same for all: every record is cut into eight stretches, and the i-th stretch of all records is predicted
/// from a fit to the other stretches. Weights, offsets and polynomial are fitted anew exactly; ratios, input offset, dead
/// time, dynamics and creep to first order about their values for all stretches. What is left open is chosen once, on all
/// stretches, as [`identify`](crate::identify) does: the extensions that stay, the number of operators, the weight law and the
/// smoothness. All modified models have the law and the operators of the last of them, so that they differ by their
/// extensions alone.
///
/// Samples that the last model takes for glitches are left out for all ([`Options::loss`]).
///
/// The model of `options` does not matter: plays and coupled plays are both fitted. Split weights are for coupled plays only; plays
/// then have free ones. A [`Stop`] of either kind ends the comparison without a result.
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
/// let [conventional, .., modified] = &found.models[..] else { panic!() };
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
    let options = Options { model: ModelKind::Modified, ..options.with_asked_modes() };
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
        let mut monitor = SearchMonitor::new(&mut report);
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

/// Gives the numbers of the modified model to those of its extensions that cross-validation left out: it is the same model, and
/// another search may end a little beside. The model with all extensions stays what [`identify`](crate::identify) finds.
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
