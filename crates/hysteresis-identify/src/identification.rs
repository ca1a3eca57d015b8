//! From records to a model.

use std::ops::ControlFlow;

use faer::Mat;
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};

use crate::choice::{Choice, choose, levels};
use crate::diagnostics::{Finding, diagnose};
use crate::error::{Error, RecordError};
use crate::folds::CrossValidation;
use crate::law::Law;
use crate::options::{Form, Options, Weights};
use crate::projection::{Fit, Linearised, Projection};
use crate::quality::{Quality, as_f64};
use crate::record::{Record, check_finite};
use crate::regressor::{Bank, Regressor};
use crate::search::{Monitor, Progress, Stop, search};
use crate::space::{Parameter, Point, Space};
use crate::spread::Spread;
use crate::uncertainty::{Root, StandardErrors};

/// An identified model, and how well it fits.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Identification {
    /// The model, with the output offset of the first record.
    pub model: Model,
    /// The ratios of its thresholds; [`Ratios::PLAY`] for the conventional model.
    pub ratios: Ratios,
    /// By how many samples the output lags the input, fractions included.
    pub delay: f64,
    /// The output offset of every record, in the unit of the output.
    pub output_offsets: Vec<f64>,
    /// The quality over the fitted samples of all records.
    pub fit: Quality,
    /// The quality over the fitted samples of every record.
    pub record_fits: Vec<Quality>,
    /// By how much the weights miss the conditions of Karush, Kuhn and Tucker for the best ones at these ratios, offset
    /// and delay: the largest derivative of the sum of squares that a permitted change of a weight would follow
    /// downhill, as a share of the product of the norms of its column and of the data. Rounding: 1e-13 or less.
    pub kkt_residual: f64,
    /// How far the parameters may be from the truth.
    pub standard_errors: StandardErrors,
    /// What the weights might be: as given, or as cross-validation chose.
    pub weights: Weights,
    /// How smooth the weights were asked to be: as given, or as cross-validation chose.
    pub smoothness: f64,
    /// What cross-validation said of every weight law, if it chose; else empty.
    pub weights_validation: Vec<CrossValidation>,
    /// What cross-validation said of every number of operators, if it chose; else empty.
    pub cross_validation: Vec<CrossValidation>,
    /// What cross-validation said of every smoothness with as many operators as the model has, if it chose; else empty.
    pub smoothness_validation: Vec<CrossValidation>,
    /// How many passes over the records, whole or thinned, the search took.
    pub evaluations: usize,
    /// What these records cannot tell and what the model left in them: the findings of [`diagnose`].
    pub warnings: Vec<Finding>,
    /// Whether the search was stopped: the model is the best until then, its weights the best for its thresholds.
    pub partial: bool,
    spread: Spread,
    /// As asked for, with the number of operators that was chosen.
    pub(crate) options: Options,
    /// The rows that ask for smooth weights at the thresholds found, one column for each unknown.
    pub(crate) penalty: Mat<f64>,
}

impl Identification {
    /// The output for an input that starts from the virgin state: the model delayed by [`delay`](Self::delay) as
    /// during identification, with the output offset of the first record.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        Ok(predict(&self.model, self.delay, self.output_offsets[0], input))
    }

    /// The standard deviation of every sample of [`predict`](Self::predict), in the unit of the output, from the
    /// covariance of weights, ratios, input offset, delay and output offset, linearised at the fit.
    ///
    /// It tells how far the prediction may be from what the true parameters would predict; the noise of a measurement
    /// comes on top. Like the [`standard_errors`](Self::standard_errors) it takes the errors of successive samples for
    /// independent and the model for true. What was given, and what lies at a bound (a weight of zero, a ratio at its
    /// limit), counts as known. So does what the records do not tell at all: where the input goes further than they
    /// did, the truth may be further away.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict_std(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        Ok(self.spread.of(input))
    }

    /// How well the model predicts a record that it was not fitted to, from the virgin state and after the samples that
    /// the record skips.
    ///
    /// `output_offset` is that of the record; without one, the record has its own like every other: the one that suits
    /// it best. To judge the rest of a record whose beginning was fitted, skip that and give its offset.
    #[must_use]
    pub fn validate(&self, record: &Record<'_>, output_offset: Option<f64>) -> Quality {
        let mut predicted = predict(&self.model, self.delay, 0.0, record.input());
        let (measured, predicted) = (&record.output()[record.skip()..], &mut predicted[record.skip()..]);
        let offset = output_offset.unwrap_or_else(|| {
            let samples = as_f64(measured.len());
            measured.iter().zip(predicted.iter()).map(|(y, p)| (y - p) / samples).sum()
        });
        for p in predicted.iter_mut() {
            *p += offset;
        }
        let quality = Quality::of(measured, predicted, record.output_range());
        quality.with_loops(&record.input()[record.skip()..], measured, predicted)
    }

    /// Whether the model has an inverse. Weights are never negative, so the only obstacle is a weight of zero at
    /// threshold zero, or no operator there: the data showed no slope right after reversals.
    ///
    /// # Errors
    /// [`hysteresis_core::Error::NotInvertible`] with the weight at fault.
    pub fn check_invertible(&self) -> Result<(), hysteresis_core::Error> {
        match &self.model {
            Model::Conventional(model) => model.check_invertible(),
            Model::Modified(model) => model.check_invertible(),
        }
    }
}

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
    let mut monitor = Monitor::new(progress);
    let Choice { options: chosen, smoothness, weights_tried, operators_tried, smoothness_tried, start, stopped } =
        choose(records, options, &mut monitor)?;
    let (space, law) = (Space::new(records, &chosen), Law::new(&chosen));
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
    let Fit { point, output_offsets, kkt_residual, .. } = found.0;
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
fn at(all: &Projection<'_>, point: &Point) -> (Fit, Linearised) {
    let fit = all.fit(point, None);
    all.linearise(point, &fit.weights, Some(&fit))
}

fn assemble(options: &Options, space: &Space, law: &Law, fit: &Fit) -> Result<(Model, Ratios), Error> {
    let (ratios, thresholds) = (space.ratios(&fit.point), space.thresholds(&fit.point));
    let offsets = Offsets { input: fit.point.get(Parameter::InputOffset), output: fit.output_offsets[0] };
    let model = match (options.form, law.families(&fit.weights)) {
        (Form::Conventional, _) => Model::from(PrandtlIshlinskii::new(&fit.weights, &thresholds, offsets)?),
        (Form::Modified, (above, below)) => {
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

fn predict(model: &Model, delay: f64, output_offset: f64, input: &[f64]) -> Vec<f64> {
    let (bank, weights, offsets) = Bank::of_model(model);
    let mut regressor = Regressor::new(&bank, input, offsets.input, delay);
    let next = |k| {
        regressor.go_to(k, None);
        output_offset + regressor.output(&weights)
    };
    (0..input.len()).map(next).collect()
}
