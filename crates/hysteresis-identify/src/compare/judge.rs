//! How well a fitted model predicts stretches that it was not fitted to.

use super::candidates::Candidate;
use super::result::{ComparedModel, Extension, Fitted};
use crate::fit::CrossValidation;
use crate::fit::folds::{Stretches, Terms};
use crate::fit::joint::JointFit;
use crate::fit::projection::Projection;
use crate::record::Record;
use crate::result::identification::judged as errors_of;
use crate::result::quality::Quality;
use crate::search::Found;

/// The errors of a fit on what it was fitted to and on stretches held out.
pub(super) fn judged(records: &[Record<'_>], candidate: &Candidate, found: Found) -> (ComparedModel, CrossValidation) {
    let chain = found.fit.chain(found.interval(records));
    let Found { fit, options, smoothness, basis, .. } = found;
    let JointFit { space, fit, .. } = fit;
    let projection = Projection::new(records, &space, &basis, smoothness, 1);
    let terms = Terms { creep: space.creep_amplitudes(), loop_shift: options.loop_shift, smoothness };
    let validation = Stretches::new(&projection, &fit).under(&options, &basis).cross_validate(&terms);
    let kept = [
        (Extension::Creep, space.creep_amplitudes() > 0),
        (Extension::LoopShift, space.shift_len() > 0 && !candidate.has_polynomial),
        (Extension::Dynamics, space.order().is_some()),
        (Extension::Maps, space.has_map()),
    ];
    let intervals = (0..records.len()).map(|place| space.intervals().of_record(place)).collect();
    let fitted = Fitted { chain, output_offsets: fit.output_offsets, intervals };
    let quality = |(place, record): (usize, &Record<'_>)| {
        errors_of(record, &fitted.residuals(place, record.input(), record.output()))
    };
    let qualities: Vec<_> = records.iter().enumerate().map(quality).collect();
    let model = ComparedModel {
        name: candidate.name.to_owned(),
        weights: options.weights,
        unknowns: basis.freedom() + space.own().len() + space.axes().len(),
        kept: kept.into_iter().filter(|(_, is_kept)| *is_kept).map(|(extension, _)| extension).collect(),
        fit: Quality::pooled(&qualities),
        held_out: validation.rmse,
        stretches: validation.stretches.iter().map(|square| square.sqrt()).collect(),
        fitted,
    };
    (model, validation)
}
