//! From records to an identified model.

use std::ops::ControlFlow;

use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};

use crate::diagnostics::diagnose;
use crate::error::Error;
use crate::fit::choice::{Choice, choose, levels};
use crate::fit::monitor::{Progress, SearchMonitor, Stop};
use crate::fit::projection::{Linearised, ProjectedFit, Projection};
use crate::fit::search::search;
use crate::fit::space::{Parameter, Point, Space};
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;
use crate::options::{ModelKind, Options};
use crate::record::Record;
use crate::result::identification::{Identification, predict};
use crate::result::quality::Quality;
use crate::result::spread::Spread;
use crate::result::standard_errors::{Root, StandardErrors};

/// Fits a model to records: weights w_i >= 0, one output offset per record, and whatever `options` leaves to search.
///
/// The sum of squared errors over all fitted samples is minimised. Weights and output offsets are exact at every
/// point of the search (QR of the regressor, block by block, then non-negative least squares on its triangle);
/// ratios, input offset and delay go from the best of several starts on a selection of the samples to Gauss-Newton
/// steps on all of them. `progress` is called after every pass over the records; [`ControlFlow::Break`] stops, with the
/// best so far as the result ([`Stop::KeepBest`]) or without one.
///
/// Input and output may have any unit; weights come in output unit per input unit, the delay in samples.
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// use hysteresis_identify::{Options, Record, Thresholds, identify};
///
/// let actuator = ModifiedPrandtlIshlinskii::from_ratios(
///     &[1.0, 0.3, 0.2, 0.1], &[0.0, 1.25, 2.5, 3.75], Ratios::PAPER, Offsets { input: 0.0, output: 7.0 })?;
/// let mut stream = actuator.forward();
/// let input: Vec<f64> = (0..800).map(|k| 5.0 * (1.0 - k as f64 / 800.0) * (k as f64 / 20.0).sin()).collect();
/// let output: Vec<f64> = input.iter().map(|u| stream.step(*u)).collect();
///
/// let options = Options { thresholds: Thresholds::Given(vec![0.0, 1.25, 2.5, 3.75]), ..Options::default() };
/// let found = identify(&[Record::new(&input, &output, 0)?], &options, &mut |_| ControlFlow::Continue(()))?;
/// assert!((found.ratios.rb - 0.30).abs() < 1e-6);
/// assert!(found.fit.rmse < 1e-9 * found.fit.range);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::NoRecords`], [`Error::NoOperators`], [`Error::Domain`] for bad thresholds, offset or delay,
/// [`Error::Core`] for bad ratios, [`Error::TooFewSamples`] for fewer fitted samples than twice the unknowns (weights,
/// output offsets and searched parameters), [`Error::Interrupted`] when `progress` said to stop and discard.
pub fn identify(
    records: &[Record<'_>],
    options: &Options,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<Stop>,
) -> Result<Identification, Error> {
    let Some(shortest) = records.iter().map(|record| record.input().len()).min() else {
        return Err(Error::NoRecords);
    };
    options.check(as_f64(shortest))?;
    let mut monitor = SearchMonitor::new(progress);
    let Choice { options: chosen, smoothness, weights_tried, operators_tried, smoothness_tried, start, stopped } =
        choose(records, options, &mut monitor)?;
    let (space, law) = (Space::new(records, &chosen), WeightBasis::new(&chosen));
    let levels = levels(records, &space, &law, smoothness, false)?;
    let all = &levels[levels.len() - 1];
    let (found, partial) = match stopped {
        Some(point) => (at(all, &point), true),
        None => match (search(&levels, &law, start.as_ref(), &mut monitor), monitor.kept()) {
            (Err(Error::Interrupted), Some(best)) => (at(all, &best), true),
            (found, _) => (found?, false),
        },
    };
    let root = Root::of(&found.0, &found.1, &space, all.rows());
    let standard_errors = StandardErrors::of(&found.0, &root, &law, &space);
    let spread = Spread::new(&found.0, &root, &found.1, &law, &space);
    let (model, ratios) = assemble(&chosen, &space, &law, &found.0)?;
    let ProjectedFit { point, output_offsets, kkt_residual, .. } = found.0;
    let delay = point.get(Parameter::Delay);
    let quality = |(record, offset): (&Record<'_>, &f64)| quality(record, &model, delay, *offset);
    let record_fits: Vec<_> = records.iter().zip(&output_offsets).map(quality).collect();
    Ok(Identification {
        warnings: diagnose(records, &model, delay)?,
        model,
        ratios,
        delay,
        output_offsets,
        fit: Quality::pooled(&record_fits),
        record_fits,
        kkt_residual,
        standard_errors,
        weights: chosen.weights,
        smoothness,
        weights_validation: weights_tried,
        cross_validation: operators_tried,
        smoothness_validation: smoothness_tried,
        evaluations: monitor.evaluations(),
        partial,
        spread,
        options: chosen,
        penalty: found.1.into_penalty(),
    })
}

/// The fit at a point and its derivatives there.
fn at(all: &Projection<'_>, point: &Point) -> (ProjectedFit, Linearised) {
    let fit = all.fit(point, None);
    all.linearise(point, &fit.weights, Some(&fit))
}

fn assemble(options: &Options, space: &Space, law: &WeightBasis, fit: &ProjectedFit) -> Result<(Model, Ratios), Error> {
    let (ratios, thresholds) = (space.ratios(&fit.point), space.thresholds(&fit.point));
    let offsets = Offsets { input: fit.point.get(Parameter::InputOffset), output: fit.output_offsets[0] };
    let model = match (options.model, law.families(&fit.weights)) {
        (ModelKind::Conventional, _) => Model::from(PrandtlIshlinskii::new(&fit.weights, &thresholds, offsets)?),
        (ModelKind::Modified, (above, below)) => {
            let model = ModifiedPrandtlIshlinskii::from_ratios(above, &thresholds, ratios, offsets)?;
            Model::from(if let Some(below) = below { model.with_negative_weights(below)? } else { model })
        }
    };
    Ok((model, ratios))
}

fn quality(record: &Record<'_>, model: &Model, delay: f64, output_offset: f64) -> Quality {
    let predicted = predict(model, delay, output_offset, record.input());
    let fitted = record.skip()..;
    let (measured, predicted) = (&record.output()[fitted.clone()], &predicted[fitted.clone()]);
    Quality::of(measured, predicted, record.output_range()).with_loops(&record.input()[fitted], measured, predicted)
}
