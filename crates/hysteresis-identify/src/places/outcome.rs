//! What comes out of the chosen model: its numbers with their standard errors, what the others say beside it, and
//! findings.

use hysteresis_control::linear::Creep;
use hysteresis_control::stage::TemperatureTerm;
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};

use crate::choose::cross_validation::CrossValidation;
use crate::error::Error;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::places::given::Given;
use crate::places::judging::left_to_explain;
use crate::places::result::{PlacesCandidate, PlacesIdentification};
use crate::places::rivals::Rival;
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::space::{Axis, PlacePoint, PlaceSpace};
use crate::places::spread::Uncertainty;
use crate::places::weighing::Shares;
use crate::places::{doubts, rivals, spread};
use crate::records::signal;
use crate::terms::operators::ModelKind;
use crate::uncertainty::standard_errors::Spread;

/// The result of the chosen one of all models that were found.
pub(super) fn outcome(
    search: &PlaceSearch<'_>,
    all: &[FoundPlace],
    chosen: usize,
    candidates: Vec<PlacesCandidate>,
) -> Result<PlacesIdentification, Error> {
    let (found, smoothness) = (&all[chosen], candidates[chosen].validation.smoothness);
    let FoundPlace { space, point, weighed, .. } = found;
    let given = &search.system.given;
    let positions: Vec<_> = all.iter().map(|found| spread::positions(given, found)).collect();
    let trusts = trusts(&candidates, chosen, &positions, left_to_explain(given, weighed));
    let chain = found.chain(given.dt);
    let (weights, beside) = weighed.weights.split_at(chain.weights.len());
    let amplitudes = &beside[..space.not_of_stage()];
    let responses: Vec<Vec<f64>> = given.drives.iter().map(|drive| chain.response(drive, given.dt)).collect();
    let output_offset = -responses[0][0];
    let (low, high) = signal::bounds_of(responses.iter().map(|response| signal::bounds(response)));
    check_rising(given, low, high)?;
    let own_tangent = space.tangent(point, Some(&weighed.weights));
    let uncertainty = Uncertainty::new(search, found, smoothness, &own_tangent);
    let errors = StandardErrors { found, uncertainty: &uncertainty };
    let temperature = Temperature::new(search, &errors, weights.len(), amplitudes)?;
    let doubtful = Doubtful {
        pairs: Shares::left_out(&weighed.shares.of_pairs),
        lengths: Shares::left_out(&weighed.shares.of_lengths),
        uninformative: doubts::uninformative(given, &search.rows_at(space, point), weights.len()),
    };
    let apart = uncertainty.positions.hypot(apart(&positions, chosen, &trusts)) / (high - low);
    let warnings = warnings(search, &errors, &doubtful, &temperature, (high - low, apart));
    let moved = space.beside(point, None);
    Ok(PlacesIdentification {
        model: model(space, point, weights, chain.rest_of(output_offset))?,
        ratios: if space.model == ModelKind::Modified { point.as_ratios() } else { Ratios::PLAY },
        dead_time: point.dead_time,
        creep: match &chain.linear.time_constants[..] {
            [] => None,
            time_constants => Some(Creep::new(&chain.linear.amplitudes, time_constants)?),
        },
        creep_amplitudes: point.creep.clone(),
        dt: given.dt,
        drive_range: given.drive_bounds(),
        position_range: (low + output_offset, high + output_offset),
        mismatches: weighed.mismatches.iter().zip(&search.system.pair_deviations).map(|(e, r)| e * r).collect(),
        mismatch: if given.pairs.is_empty() {
            doubts::rms_of_kept(&weighed.length_errors, &doubtful.lengths)
        } else {
            weighed.shares.scales.pairs
        },
        length_errors: weighed.length_errors.clone(),
        weights_std: (0..weights.len()).map(|weight| errors.of_row(weight)).collect(),
        input_offset_std: errors.of_axis(Axis::InputOffset),
        dead_time_std: errors.of_axis(Axis::DeadTime),
        creep_std: (0..point.creep.len()).map(|number| errors.of_axis(Axis::Creep(number))).collect(),
        wrong_pairs: doubtful.pairs,
        wrong_lengths: doubtful.lengths,
        uninformative_pairs: doubtful.uninformative,
        smoothness,
        candidates,
        warnings,
        drift_amplitudes: moved.course_amplitudes(amplitudes),
        courses: moved.courses,
        drive_samples: given.drives.iter().map(|drive| drive.len()).collect(),
        temperature: temperature.term,
        temperature_std: temperature.errors,
        spread: Spread::from_zero(uncertainty.own, own_tangent, given.drives[0], given.dt),
        rivals: rivals(given, all, chosen, &trusts),
        chain,
        output_offset,
    })
}

/// Weights of zero are all that distances of the wrong sign leave.
fn check_rising(given: &Given<'_>, low: f64, high: f64) -> Result<(), Error> {
    if low < high {
        return Ok(());
    }
    let lengths = given.lengths.iter().map(|known| known.length);
    let longest = lengths.fold(0.0, |longest: f64, length| if length.abs() > longest.abs() { length } else { longest });
    let expected = "distances that rise with the drive: turn their signs if yours fall";
    Err(Error::domain("lengths", None, expected, longest))
}

/// The standard errors of a fit, by rows of the root of its covariance: weights, what stands beside them, axes.
struct StandardErrors<'a> {
    found: &'a FoundPlace,
    uncertainty: &'a Uncertainty,
}

impl StandardErrors<'_> {
    fn of_row(&self, row: usize) -> f64 {
        let root = &self.uncertainty.root;
        (0..root.ncols()).map(|k| root[(row, k)].powi(2)).sum::<f64>().sqrt()
    }

    /// 0 for what was not searched.
    fn of_axis(&self, axis: Axis) -> f64 {
        let place = self.found.space.axes.iter().position(|other| *other == axis);
        place.map_or(0.0, |place| self.of_row(self.found.weighed.weights.len() + place))
    }
}

/// The term of the temperature, if one was measured, with the standard errors of its two numbers.
struct Temperature {
    term: Option<TemperatureTerm>,
    errors: (f64, f64),
}

impl Temperature {
    /// The last one beside the operators is its sensitivity.
    fn new(
        search: &PlaceSearch<'_>,
        errors: &StandardErrors<'_>,
        columns: usize,
        amplitudes: &[f64],
    ) -> Result<Self, Error> {
        let Some(temperature) = search.system.given.temperatures.first() else {
            return Ok(Self { term: None, errors: (0.0, 0.0) });
        };
        let sensitivity = amplitudes.last().copied().unwrap_or_default();
        let term = TemperatureTerm::new(sensitivity, errors.found.point.thermal_lag, temperature[0])?;
        let errors = (errors.of_row(columns + amplitudes.len() - 1), errors.of_axis(Axis::ThermalLag));
        Ok(Self { term: Some(term), errors })
    }
}

/// Pairs and lengths that were left out, and pairs that say nothing.
struct Doubtful {
    pairs: Vec<usize>,
    lengths: Vec<usize>,
    uninformative: Vec<usize>,
}

/// What makes a result doubtful, over a span of positions that are told to a share of it.
fn warnings(
    search: &PlaceSearch<'_>,
    errors: &StandardErrors<'_>,
    doubtful: &Doubtful,
    temperature: &Temperature,
    (span, told_to): (f64, f64),
) -> Vec<Finding> {
    let (given, FoundPlace { space, point, weighed, .. }) = (&search.system.given, errors.found);
    let Doubtful { pairs, lengths, uninformative } = doubtful;
    let mut warnings = doubts::findings(given, weighed, span, (pairs, lengths), uninformative);
    warnings.extend(doubts::missed_lengths(given, &weighed.length_errors, lengths));
    warnings.extend(errors.found.without_inverse());
    warnings.extend(untold_dead_time(point.dead_time / given.dt, errors.of_axis(Axis::DeadTime) / given.dt));
    let is_searched = space.axes.contains(&Axis::ThermalLag);
    let longest_lag = if is_searched { given.longest_and_shortest().0 } else { f64::INFINITY };
    let untold = |term| doubts::untold_temperature(given, &term, temperature.errors, longest_lag);
    warnings.extend(temperature.term.and_then(untold));
    warnings.extend(doubts::untold_positions(told_to));
    warnings
}

/// The trust in each of the models that were tried, which say these positions along the drives; none in one whose
/// weights are open. In one that has all of the chosen one and more it is less, by what is `left` to explain.
fn trusts(candidates: &[PlacesCandidate], chosen: usize, positions: &[Vec<Vec<f64>>], left: f64) -> Vec<f64> {
    let CrossValidation { rmse, rounding, .. } = &candidates[chosen].validation;
    let trust = |(one, said): (&PlacesCandidate, &Vec<Vec<f64>>)| {
        if rivals::is_open(said, &positions[chosen]) {
            return 0.0;
        }
        let counts = if one.contains(&candidates[chosen]) { left.sqrt() } else { 1.0 };
        counts * rivals::trust(*rmse, one.validation.rmse, rounding.sqrt())
    };
    candidates.iter().zip(positions).map(trust).collect()
}

/// All but the chosen one that are trusted at all.
fn others<'a, T>(all: &'a [T], chosen: usize, trusts: &'a [f64]) -> impl Iterator<Item = (&'a T, &'a f64)> {
    let is_rival = move |(number, (_, trust)): &(usize, (&T, &f64))| *number != chosen && **trust > 0.0;
    all.iter().zip(trusts).enumerate().filter(is_rival).map(|(_, other)| other)
}

fn rivals(given: &Given<'_>, all: &[FoundPlace], chosen: usize, trusts: &[f64]) -> Vec<Rival> {
    let rival = |(found, trust): (&FoundPlace, &f64)| {
        let chain = found.chain(given.dt);
        let output_offset = -chain.response(&given.drives[0][..1], given.dt)[0];
        Rival { chain, output_offset, trust: *trust }
    };
    others(all, chosen, trusts).map(rival).collect()
}

/// How far from the positions of the chosen model the others are along a drive, rms, by the trust in each; the most of
/// all drives.
fn apart(positions: &[Vec<Vec<f64>>], chosen: usize, trusts: &[f64]) -> f64 {
    let of_drive = |(drive, own): (usize, &Vec<f64>)| {
        let others = others(positions, chosen, trusts).map(|(other, trust)| (other[drive].clone(), trust));
        signal::rms(&rivals::distances(own, others))
    };
    positions[chosen].iter().enumerate().map(of_drive).fold(0.0, f64::max)
}

fn model(space: &PlaceSpace, point: &PlacePoint, weights: &[f64], output: f64) -> Result<Model, Error> {
    let offsets = Offsets { input: point.input_offset, output };
    let thresholds = space.thresholds(point);
    Ok(match space.model {
        ModelKind::Conventional => Model::from(PrandtlIshlinskii::new(weights, &thresholds, offsets)?),
        ModelKind::Modified => {
            Model::from(ModifiedPrandtlIshlinskii::from_ratios(weights, &thresholds, point.as_ratios(), offsets)?)
        }
    })
}

/// The finding about a dead time, in samples, that the pairs do not tell.
fn untold_dead_time(samples: f64, deviation: f64) -> Option<Finding> {
    let limit = samples.max(0.5);
    let message = format!("the dead time is {samples:.2} samples with a standard error of {deviation:.2}");
    (deviation > limit).then(|| Finding::new(FindingCode::DeadTimeConfounded, deviation, limit, message))
}
