//! From records to an identified model: the search, what is said of what it found, and the result.

use std::ops::ControlFlow;

use hysteresis_control::linear::{Creep, Modes, SecondOrder};
use hysteresis_control::stage::{LoopShift, RelaxingPlays, SlowGain};
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii};

use crate::choose::duhem::{runs_away, without_inverse};
use crate::choose::found::Found;
use crate::choose::glitches::search_without_glitches;
use crate::choose::linear_part::{joint_findings, untold_dead_time};
use crate::choose::search::{search_hysteresis, with_least_slope};
use crate::choose::structure::answers_tried;
use crate::choose::table::closed_terms;
use crate::choose::term_search::untold_map;
use crate::error::Error;
use crate::fit::joint::JointFit;
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{Progress, SearchMonitor, Span, Stop};
use crate::fit::projection::ProjectedFit;
use crate::fit::response::Chain;
use crate::fit::space::Space;
use crate::judge::finding_code::FindingCode;
use crate::judge::loops::{judged, turned_positions, with_positions};
use crate::judge::residual::coloured;
use crate::judge::{findings_of_fit, is_falling, is_poor, without_interval};
use crate::options::{Options, Setting};
use crate::records::record::{Intervals, Record, check_times, largest_range, leaving_out};
use crate::records::signal::{as_f64, bounds_of, sensor_noise};
use crate::result::identification::Identification;
use crate::result::quality::Quality;
use crate::terms::dynamics::LinearPart;
use crate::terms::operators::ModelKind;
use crate::terms::side_columns::SideColumns;
use crate::terms::weights::{WeightBasis, WeightLaw};
use crate::uncertainty::root::{ColouredFit, Root};
use crate::uncertainty::standard_errors::{Covariance, Spread, StandardErrors};

/// Fits a model to records: weights w_i >= 0, one output offset per record, and whatever `options` leaves to search.
///
/// The sum of squared errors over all fitted samples is minimised. Weights and output offsets are exact at every point
/// of the search (QR of the regressor, block by block, then non-negative least squares on its triangle). Plays are
/// fitted first; coupled plays take their place if they predict better
/// ([`RatiosModel::Auto`](crate::RatiosModel::Auto)). Their ratios and input offset, and the delay, go from the best of
/// several starts on a selection of the samples to Gauss-Newton steps on all of them. `progress` is called after a pass
/// over the records; [`ControlFlow::Break`] stops, with the best so far as the result ([`Stop::KeepBest`]) or without
/// one.
///
/// Starts and terms that need no result of each other are searched on all processors if the records have 10 000 samples
/// or more together. The result has the same bits for any number of them, if it was not stopped. `progress` is called
/// by this thread alone, a few passes late at most.
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
/// [`Error::NoRecords`], [`Error::NoOperators`], [`Error::Record`] for times of samples that contradict the sampling
/// interval, [`Error::Core`] for bad thresholds, offset or delay, [`Error::Core`] for bad ratios,
/// [`Error::TooFewSamples`] for fewer fitted samples than twice the unknowns (weights, output offsets and searched
/// parameters), [`Error::Interrupted`] when `progress` said to stop and discard.
pub fn identify(
    records: &[Record<'_>],
    options: &Options,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<Stop>,
) -> Result<Identification, Error> {
    if records.is_empty() {
        return Err(Error::NoRecords);
    }
    let options = &options.with_asked_modes();
    options.check()?;
    check_times(records, options.dt)?;
    // What is wrong with the whole is said before the search of a part.
    Space::new(records, options)?;
    let asked = options.resolved(records)?;
    let mut monitor = SearchMonitor::new(progress).on_all_processors(records);
    if is_falling(records) {
        // Nothing else is worth a search if the sign is wrong.
        let plain = asked.hysteresis_and_dead_time();
        let plain = Options { weights: WeightLaw::Free, smoothness: Setting::Fixed(0.0), ..plain };
        let found = fit(records, &plain, &mut monitor)?;
        if found.partial || found.warnings.iter().any(|finding| finding.code == FindingCode::WrongSign) {
            return Ok(found);
        }
        monitor.hold();
    }
    let found = fit(records, &asked, &mut monitor)?;
    let terms_tried = [closed_terms(options, &asked, records)?, found.terms_tried].concat();
    Ok(Identification { terms_tried, ..found })
}

/// Searches, and judges what was found.
fn fit(records: &[Record<'_>], asked: &Options, monitor: &mut SearchMonitor<'_>) -> Result<Identification, Error> {
    let (found, left_out) = search_without_glitches(records, asked, monitor)?;
    let records = &leaving_out(records, &left_out)?[..];
    let found = identification(records, with_least_slope(records, found)?, monitor.evaluations())?;
    let error_band = found.band_of(records);
    let found = Identification { error_band, ..found }.with_wide_band_named(records);
    judge_sign(records, found, monitor)
}

/// Fits again with the sign of the position turned where that seems to be wrong, and says what it finds.
fn judge_sign(
    records: &[Record<'_>],
    found: Identification,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Identification, Error> {
    if found.partial || found.warnings.iter().all(|finding| finding.code != FindingCode::WrongSign) {
        return Ok(found);
    }
    let positions = turned_positions(records);
    let turned = with_positions(records, &positions)?;
    monitor.begin(Span { from: 1.0, to: 1.0 });
    // With as many operators as were chosen: a number that is left open is none.
    let plain = Options { smoothness: Setting::Fixed(0.0), ..found.options.hysteresis_alone() };
    let hysteresis = search_hysteresis(&turned, &plain, monitor)?.fit;
    let left = (hysteresis.fit.squares / as_f64(found.fit.samples)).sqrt() / found.fit.range;
    let warnings = judged(found.warnings, found.fit.nrmse, left);
    Ok(Identification { warnings, ..found })
}

fn identification(records: &[Record<'_>], found: Found, evaluations: usize) -> Result<Identification, Error> {
    let chain = found.fit.chain(found.interval(records));
    let untold_map = found.untold_map.and_then(untold_map);
    let of_operator = without_inverse(&found.fit, &found.basis).into_iter().chain(runs_away(records, &found));
    let colour = found.problem(records).colour(&found.fit);
    let answers = answers_tried(records, &found);
    let Found {
        fit: found,
        options,
        smoothness,
        basis,
        operators_tried,
        structure,
        linear,
        told_alone,
        trials,
        partial,
        ..
    } = found;
    let rows = found.rows(records);
    let JointFit { space, fit, linearised } = found;
    let white = Root::of(&fit, &linearised, &space, rows);
    let root = ColouredFit { records, space: &space, basis: &basis, fit: &fit, chain: &chain }
        .root(white, linearised.penalty());
    let intervals = space.intervals();
    let model = model(&options, &space, &basis, &fit, &chain)?;
    let standard_errors = StandardErrors::of(&fit, &root, &basis, &space);
    // What the others leave says nothing of dynamics that one record told.
    let standard_errors = match told_alone {
        Some(told) => standard_errors.with_dynamics_of(told.errors),
        None => standard_errors,
    };
    // Without a linear part a poor fit says it all.
    let mut warnings = findings_of_fit(records, &chain, &options.thresholds);
    let coloured = coloured(colour, largest_range(records)).filter(|_| linear.is_some() || !is_poor(&warnings));
    let told: Vec<_> = warnings.iter().map(|finding| finding.code).collect();
    let of_linear_part = match &linear {
        Some(linear) => joint_findings(&space, &fit, &standard_errors, linear),
        None => Vec::from_iter(untold_dead_time(&space, &fit, &standard_errors)),
    };
    warnings.extend(of_linear_part.into_iter().chain(coloured).filter(|finding| !told.contains(&finding.code)));
    warnings.extend(untold_map.into_iter().chain(of_operator));
    if !intervals.are_seconds() {
        warnings = without_interval(warnings, chain.linear.dead_time);
    }
    let (record_fits, left) = fits_of_records(records, &chain, intervals, &fit.output_offsets);
    let dead_time = chain.linear.dead_time;
    let (creep, creep_amplitudes) = creep(&space, &fit.point, &chain)?;
    Ok(Identification {
        warnings,
        model,
        ratios: space.ratios(&fit.point),
        dynamics: chain.linear.dynamics.filter(|_| chain.linear.further.is_empty()),
        modes: modes(&chain.linear)?,
        creep,
        creep_amplitudes,
        dead_time: intervals.are_seconds().then_some(dead_time),
        dead_time_samples: intervals.common().map(|dt| dead_time / dt),
        lag: chain.linear.lag(),
        dt: intervals.seconds(),
        drive_range: bounds_of(records.iter().map(Record::input_bounds)),
        position_range: bounds_of(records.iter().map(Record::output_bounds)),
        fit: Quality::pooled(&record_fits),
        record_fits,
        left_out_samples: records.iter().map(|record| record.left_out().to_vec()).collect(),
        noise: root.deviation,
        sensor_noise: Some(sensor_noise(&left).min(root.deviation)),
        error_band: None,
        kkt_residual: fit.kkt_residual,
        covariance: Covariance::new(&fit, &root, &basis, &space),
        spread: Spread::new(&fit, &root, &basis, &space),
        standard_errors,
        loop_shift: loop_shift(&space, &basis, &fit)?,
        relaxing_plays: relaxing_plays(&space, &basis, &fit)?,
        slow_gain: slow_gain(&space, &fit, &chain)?,
        weights: options.weights,
        terms_tried: [trials, answers].concat(),
        smoothness,
        weights_validation: structure.weights_tried,
        cross_validation: operators_tried,
        smoothness_validation: structure.smoothness_tried,
        terms_validation: structure.terms_tried,
        evaluations,
        partial,
        output_offsets: fit.output_offsets,
        chain,
        options,
        penalty: linearised.into_penalty(),
    })
}

/// How well every record is fitted, and what is left of it.
fn fits_of_records(
    records: &[Record<'_>],
    chain: &Chain,
    intervals: &Intervals,
    output_offsets: &[f64],
) -> (Vec<Quality>, Vec<Vec<f64>>) {
    let fitted = |(place, (record, offset)): (usize, (&Record<'_>, &f64))| {
        let response = chain.response_in(place, record.input(), intervals.of_record(place));
        let left = record.fitted().map(|k| record.output()[k] - response[k]).collect();
        (quality(record, &response, *offset), left)
    };
    records.iter().zip(output_offsets).enumerate().map(fitted).unzip()
}

/// The hysteresis. What the record shows as an offset has crept: the model has what was there before.
pub(crate) fn model(
    options: &Options,
    space: &Space,
    basis: &WeightBasis,
    fit: &ProjectedFit,
    chain: &Chain,
) -> Result<Model, Error> {
    // An output map has the output offset.
    let has_offset = chain.operators.output_map.is_none();
    let output = if has_offset { chain.rest_of(fit.output_offsets[0]) } else { 0.0 };
    let (ratios, thresholds) = (space.ratios(&fit.point), space.thresholds(&fit.point));
    let offsets = Offsets { input: fit.point.get(Parameter::InputOffset), output };
    Ok(match (options.model, basis.families(&fit.weights)) {
        (ModelKind::Conventional, (weights, _)) => Model::from(PrandtlIshlinskii::new(weights, &thresholds, offsets)?),
        (ModelKind::Modified, (above, below)) => {
            let model = ModifiedPrandtlIshlinskii::from_ratios(above, &thresholds, ratios, offsets)?;
            Model::from(if let Some(below) = below { model.with_negative_weights(below)? } else { model })
        }
    })
}

/// The creep, and its searched parameters.
fn creep(space: &Space, point: &Point, chain: &Chain) -> Result<(Option<Creep>, Vec<f64>), Error> {
    let parameters = (0..space.creep_amplitudes()).map(|number| point.get(Parameter::Creep(number))).collect();
    let linear = &chain.linear;
    if linear.time_constants.is_empty() {
        return Ok((None, parameters));
    }
    Ok((Some(Creep::new(&linear.amplitudes, &linear.time_constants)?), parameters))
}

/// The modes, from the lowest frequency up, if there are several.
fn modes(linear: &LinearPart) -> Result<Option<Modes>, Error> {
    if linear.further.is_empty() {
        return Ok(None);
    }
    let modes: Vec<_> = linear.in_order().into_iter().map(|(_, mode)| mode).collect();
    let gains: Vec<f64> = modes.iter().map(|mode| mode.gain).collect();
    let resonances = modes.iter().map(|mode| SecondOrder::new(mode.frequency, mode.damping));
    Ok(Some(Modes::new(&gains, &resonances.collect::<Result<Vec<_>, _>>()?)?))
}

/// The loop shift, if there is one.
fn loop_shift(space: &Space, basis: &WeightBasis, fit: &ProjectedFit) -> Result<Option<LoopShift>, Error> {
    let Some(SideColumns { center, half_range, filters, .. }) = space.side() else { return Ok(None) };
    let amplitudes = basis.amplitudes(&fit.weights);
    let second = amplitudes.get(1).copied().unwrap_or(0.0);
    let [filter] = &filters[..] else { return Ok(None) };
    Ok(Some(LoopShift::new(*center, *half_range, [amplitudes[0], second], filter.time_constant, filter.limit)?))
}

/// The plays that relax, if any weighs something.
fn relaxing_plays(space: &Space, basis: &WeightBasis, fit: &ProjectedFit) -> Result<Option<RelaxingPlays>, Error> {
    space.relaxing().map_or(Ok(None), |columns| columns.plays(basis.relaxing(&fit.weights)))
}

/// The slow gain, if there is one: about the position at which the hysteresis puts out nothing.
fn slow_gain(space: &Space, fit: &ProjectedFit, chain: &Chain) -> Result<Option<SlowGain>, Error> {
    let Some(gain) = space.slow_gain(&fit.point) else { return Ok(None) };
    let zero = chain.rest_of(fit.output_offsets[0]);
    Ok(Some(SlowGain::new(gain.half_range, gain.amplitude, zero, gain.time_constant)?))
}

fn quality(record: &Record<'_>, response: &[f64], output_offset: f64) -> Quality {
    let predicted: Vec<f64> = response.iter().map(|y| output_offset + y).collect();
    let [input, measured, predicted] =
        [record.input(), record.output(), &predicted].map(|signal| record.fitted_of(signal));
    Quality::of(&measured, &predicted, record.output_range()).with_loops(&input, &measured, &predicted)
}

#[cfg(test)]
mod tests {
    use crate::records::signal::white;

    use super::*;

    /// Loops that decay and grow again, of a play, bent, with noise.
    fn loops() -> (Vec<f64>, Vec<f64>) {
        let strokes = [10.0, 0.5, 8.0, 2.0, 6.0, 4.0, 7.0, 1.0, 9.0, 0.0].windows(2);
        let input: Vec<f64> = strokes
            .flat_map(|ends| (0..130_i32).map(|k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / 130.0))
            .collect();
        let (mut play, noise) = (input[0], white(input.len()));
        let output = input.iter().zip(noise).map(|(u, noise)| {
            play = play.clamp(u - 0.8, u + 0.8);
            let h = u + 0.5 * play;
            h + 0.02 * h * h + 0.02 * noise
        });
        let output = output.collect();
        (input, output)
    }

    #[test]
    fn a_fit_has_the_same_bits_on_any_number_of_threads() {
        let (input, output) = loops();
        let records = [Record::new(&input, &output, 0).unwrap()];
        let options = Options { dt: Some(1e-3), ..Options::default() }.resolved(&records).unwrap();
        let found = [1, 2, 5].map(|threads| {
            let mut report = |_: &Progress| ControlFlow::Continue(());
            let mut monitor = SearchMonitor::new(&mut report).on_threads(threads);
            format!("{:?}", fit(&records, &options, &mut monitor).unwrap())
        });
        // A map was chosen among others: the work that is shared out was done.
        assert!(found[0].contains("output_map: Some") || found[0].contains("input_map: Some"), "{}", found[0]);
        assert!(found[0] == found[1] && found[0] == found[2]);
    }
}
