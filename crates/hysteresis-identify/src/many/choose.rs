//! What is left to cross-validation, chosen once for all actuators.

use std::ops::ControlFlow;
use std::slice;

use super::records::ManyRecords;
use super::share::Shared;
use crate::error::Error;
use crate::fit::monitor::{SearchMonitor, Stop};
use crate::options::{Options, Setting, WeightLaw};
use crate::search::search_all;

/// How many actuators are asked.
const ASKED: usize = 3;

/// Whether nothing is left to choose.
fn is_settled(options: &Options) -> bool {
    let counted = !options.thresholds.are_counted_by_validation();
    counted && options.weights != WeightLaw::Auto && options.smoothness != Setting::Fit
}

/// The options with everything chosen: the weight law of the most unknowns and the most operators that cross-validation asks for
/// on any of a few actuators, and the middle smoothness.
pub(super) fn settled(records: &ManyRecords<'_>, options: &Options, shared: &mut Shared<'_>) -> Result<Options, Error> {
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
