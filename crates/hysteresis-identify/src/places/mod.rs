//! Identification without a position sensor: from pairs of instants at the same place, and from known lengths.
//!
//! If y(t1) = y(t2), the outputs of the operators differ by rows D with D w = 0: an equation that is linear in the weights. A known length
//! says D w = l. So non-negative least squares gives all weights at once, and what is not linear is searched as ever: input offset, ratios,
//! dead time, creep.
//!
//! 1. `given` checks what came.
//! 2. `space` names what is searched, `equations` has the `rows` of a point, `beside` what moves places beside the operators.
//! 3. `weighing` finds the best weights for rows, whatever some pairs say; `search` the best point.
//! 4. `validation` chooses model, creep, drift and smoothness by pairs that were not fitted, `further` what else the model has.
//! 5. `spread` says how far the numbers may be off, `rivals` what the model may lack, `doubts` what the pairs cannot tell; `result` is what comes out.

mod beside;
mod doubts;
mod equations;
mod further;
pub(crate) mod given;
pub(crate) mod result;
mod rivals;
mod rows;
mod search;
mod space;
mod spread;
mod validation;
mod weighing;

use std::ops::ControlFlow;

use hysteresis_control::linear::Creep;
use hysteresis_control::stage::TemperatureTerm;
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};

use crate::choose::cross_validation::CrossValidation;
use crate::error::Error;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::options::{Options, Setting};
use crate::places::beside::DriftModel;
use crate::places::equations::Equations;
use crate::places::further::with_further;
use crate::places::given::{Given, KnownLength, PlacePair, PlacesOptions};
use crate::places::result::{PlacesCandidate, PlacesIdentification};
use crate::places::rivals::Rival;
use crate::places::rows::value_at;
use crate::places::search::{FoundPlace, PlaceSearch, SEARCH_SMOOTHNESS};
use crate::places::space::{Axis, PlaceSpace};
use crate::places::spread::Uncertainty;
use crate::places::validation::{MANY_LENGTHS, PairStretches};
use crate::places::weighing::{RobustLoss, Shares, System, Weighed};
use crate::records::signal::{self, as_f64};
use crate::terms::creep::CreepModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::ModelKind;
use crate::uncertainty::standard_errors::Spread;

/// A simpler model stays unless another one predicts better by more than this factor of the mean square error.
const MARGIN: f64 = 1.02;

/// The fewest equations that say something, for each parameter that is searched, and beside them.
const EQUATIONS: (usize, usize) = (2, 4);

/// Identifies a stage from pairs of instants at the same place and from known lengths, without a position sensor.
///
/// Every pair says D w = 0 and every length D w = l, with D the difference of the operators' outputs, behind creep and dead time, between the two
/// instants. Weights w >= 0 follow by least squares with a robust loss, so that a few wrong pairs do no harm; input offset,
/// dead time and whatever else `options` leaves open are searched. Which model, whether there is creep, whether what is seen drifts,
/// and how smooth the weights are is chosen by cross-validation over the pairs. The lengths alone set the scale.
///
/// Beside the plays there may be a Duhem operator, and in front of them a map, which lengths alone tell.
///
/// With temperatures T the position has the further term kappa (theta - T at the first sample), theta' = (T - theta) / tau.
///
/// Pairs do not tell an offset: the position is 0 at the first sample of the first drive. Every drive starts from rest at the input
/// offset, and from there at its first sample. So the input offset of plays is what was before: near the first drive for a stage that
/// begins virgin, halfway to the last load for one that was loaded. `proceed` is called between steps; [`ControlFlow::Break`] stops.
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// use hysteresis_identify::{KnownLength, PlacePair, PlacesOptions, identify_places};
///
/// let actuator = ModifiedPrandtlIshlinskii::from_ratios(
///     &[1.0, 0.3, 0.2, 0.1], &[0.0, 1.0, 2.0, 3.0], Ratios::PAPER, Offsets::default())?;
/// let mut stream = actuator.forward();
/// let drive: Vec<f64> = (0..1200).map(|k| (5.0 - k as f64 / 400.0) * (k as f64 / 30.0).sin()).collect();
/// let place: Vec<f64> = drive.iter().map(|u| stream.step(*u)).collect(); // which nobody measured
///
/// // Where it passes the same place: up, then down again.
/// let passes = |level: f64| (1..1200).filter(|k| (place[k - 1] < level) != (place[*k] < level))
///     .map(|k| k as f64 - (place[k] - level) / (place[k] - place[k - 1])).collect::<Vec<_>>();
/// let pairs: Vec<PlacePair> = (-20..20)
///     .flat_map(|level| passes(0.2 * f64::from(level)).windows(2).map(|t| PlacePair::new(0, t[0], t[1])).collect::<Vec<_>>())
///     .collect();
/// let length = KnownLength::new(0, passes(-2.0)[0], passes(3.0)[0], 5.0);
///
/// let options = PlacesOptions::new(1e-3);
/// let found = identify_places(&[&drive], &pairs, &[length], &options, &mut || ControlFlow::Continue(()))?;
/// let predicted = found.predict(&drive)?;
/// assert!((predicted[400] - predicted[300] - (place[400] - place[300])).abs() < 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Core`] or [`Error::Record`] for drives, pairs, lengths or options outside their domain, [`Error::TooFewPairs`] if too few of the
/// pairs and lengths say anything, [`Error::TooFewLengths`] if there are no pairs and too few lengths, [`Error::Interrupted`] when `proceed` said so.
pub fn identify_places(
    drives: &[&[f64]],
    pairs: &[PlacePair],
    lengths: &[KnownLength],
    options: &PlacesOptions,
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<PlacesIdentification, Error> {
    let given = Given::new(drives, pairs, lengths, options.dt)?.with_temperatures(&options.temperatures)?;
    let checked = as_options(options);
    checked.check()?;
    if options.input_map == MapModel::Smooth && lengths.len() < MANY_LENGTHS {
        let expected = "at least 16 beside a map, as pairs tell none";
        return Err(Error::whole("lengths", expected, lengths.len()));
    }
    let smoothness = match options.smoothness {
        Setting::Fixed(smoothness) => smoothness,
        Setting::Fit => SEARCH_SMOOTHNESS,
    };
    let equations = Equations::new(&given);
    let unit = given.drive_steps().map(|step| step * step).sum();
    let mut search = PlaceSearch { unit, system: System::new(given), equations, smoothness };
    let mut found: Vec<FoundPlace> = Vec::new();
    for (model, creep, drift) in models(options, &given) {
        let space = search.told(PlaceSpace::new(&given, options, model, (&creep, drift))?);
        search.system.uninformative = check_equations(&search, &space)?;
        let plain = found.iter().find(|plain| plain.space.model == model);
        let starts = plain.map_or_else(|| space.starts(), |plain| vec![space.beginning_at(&plain.point)]);
        found.push(search.find(space, starts, proceed)?);
    }
    let (chosen, candidates) = with_further(&mut search, &mut found, (options, &checked), proceed)?;
    let found = found.into_iter().zip(&candidates);
    let found: Vec<FoundPlace> = found.map(|(one, by)| settled(&mut search, one, by.validation.smoothness)).collect();
    result(&search, &found, chosen, candidates)
}

/// How each model predicts pairs.
fn judged(search: &PlaceSearch<'_>, found: &[FoundPlace], options: &Options) -> Result<Vec<PlacesCandidate>, Error> {
    // There is a model always.
    let shares = judging_shares(found).ok_or(Error::NoOperators)?;
    Ok(found.iter().map(|one| candidate(search, one, shares, options)).collect())
}

/// The number of the simplest model that predicts pairs as well as the best.
fn simplest(candidates: &[PlacesCandidate]) -> usize {
    let validations: Vec<CrossValidation> = candidates.iter().map(|one| one.validation.clone()).collect();
    CrossValidation::good(&validations, MARGIN).next().unwrap_or(0)
}

/// The same as options of a fit to records, to be checked by the same rules.
fn as_options(options: &PlacesOptions) -> Options {
    Options {
        thresholds: options.thresholds.clone(),
        ratios: options.ratios.into(),
        input_offset: options.input_offset,
        smoothness: options.smoothness,
        dt: Some(options.dt),
        ..Options::default()
    }
}

/// The models to try, the simplest first. Creep that the drives are too short for is not tried. Lengths alone are not taken to drift, but by
/// what goes on of what was before: they have a temperature for that.
fn models(options: &PlacesOptions, given: &Given<'_>) -> Vec<(ModelKind, CreepModel, DriftModel)> {
    let kinds = options.model.map_or_else(|| ModelKind::ALL.to_vec(), |model| vec![model]);
    let creeps = match &options.creep {
        CreepModel::Auto if CreepModel::Slow.basis(given.longest_and_shortest().0, given.dt).is_ok() => {
            vec![CreepModel::None, CreepModel::Slow]
        }
        CreepModel::Auto | CreepModel::UnderWay => vec![CreepModel::None],
        known => vec![known.clone()],
    };
    let mut models = Vec::new();
    for kind in kinds {
        for creep in &creeps {
            let can_settle = *creep != CreepModel::None || !given.temperatures.is_empty();
            let drifts = match options.drift {
                Some(true) => vec![DriftModel::Steady],
                None if !given.pairs.is_empty() => vec![DriftModel::None, DriftModel::Steady],
                None if can_settle => vec![DriftModel::None, DriftModel::Settling],
                Some(false) | None => vec![DriftModel::None],
            };
            models.extend(drifts.into_iter().map(|drift| (kind, creep.clone(), drift)));
        }
    }
    models
}

/// Checks that enough equations say something, at the first start, and that none says what cannot be; returns the pairs that say nothing.
fn check_equations(search: &PlaceSearch<'_>, space: &PlaceSpace) -> Result<Vec<usize>, Error> {
    let given = &search.system.given;
    let starts = space.starts();
    let rows = search.rows_at(space, &starts[starts.len() / 2]);
    let columns = rows.width - space.beside;
    let uninformative = doubts::uninformative(given, &rows, columns);
    let got = given.pairs.len() - uninformative.len() + given.lengths.len();
    let expected = EQUATIONS.0 * (space.axes.len() + space.beside) + EQUATIONS.1;
    if got < expected {
        let is_by_lengths = given.pairs.is_empty();
        return Err(if is_by_lengths {
            Error::TooFewLengths { expected, got }
        } else {
            Error::TooFewPairs { expected, got }
        });
    }
    doubts::check_signs(given, &rows, columns)?;
    Ok(uninformative)
}

/// How much every pair counts where candidates are judged: all by the same shares, those of the model that leaves least. Each by its own
/// would let a model leave out the pairs that it does not explain.
fn judging_shares(found: &[FoundPlace]) -> Option<&Shares> {
    let shares = found.iter().map(|one| &one.weighed.shares);
    let left = |shares: &Shares| (shares.scales.pairs, shares.scales.lengths.unwrap_or(f64::INFINITY));
    shares.reduce(|a, b| if left(b) < left(a) { b } else { a })
}

/// How a model predicts pairs that it was not fitted to, at the smoothness that suits it.
fn candidate(search: &PlaceSearch<'_>, found: &FoundPlace, shares: &Shares, options: &Options) -> PlacesCandidate {
    let stretches = PairStretches::new(search, found, shares);
    let validate = |smoothness: &f64| {
        let law = search.law(&found.space, &found.point, *smoothness);
        stretches.validate(&law, found.space.creep.directions.len(), *smoothness)
    };
    // Without any smoothness weights that pairs do not tell are open: that must be asked for.
    let is_tried = |smoothness: &&f64| **smoothness > 0.0 || options.smoothness != Setting::Fit;
    let tried: Vec<CrossValidation> = options.smoothnesses().iter().filter(is_tried).map(validate).collect();
    let validation = CrossValidation::best(&tried).unwrap_or(&tried[0]).clone();
    let drift = found.space.drift != DriftModel::None;
    PlacesCandidate {
        model: found.space.model,
        drift,
        duhem: found.space.has_duhem,
        input_map: found.space.has_input_map(),
        validation,
    }
}

/// The weights of the chosen model with wrong pairs left out, at the scale that the lengths say.
fn settled(search: &mut PlaceSearch<'_>, found: FoundPlace, smoothness: f64) -> FoundPlace {
    let FoundPlace { space, point, uninformative, .. } = found;
    search.system.uninformative.clone_from(&uninformative);
    let rows = search.rows_at(&space, &point);
    let law = search.law(&space, &point, smoothness);
    // At the smoothness of the search other pairs and lengths may have been far away.
    let all = search.system.robust(&rows, &law, (RobustLoss::Huber, None), search.system.first_shares());
    let weighed = search.system.robust(&rows, &law, (RobustLoss::Bisquare, None), all.shares);
    let factor = search.system.scale_to_lengths(&weighed);
    let weights = weighed.weights.iter().map(|weight| factor * weight).collect();
    let mut weighed = search.system.weighed(&rows, weights, weighed.shares);
    if search.system.pairs() > 0 {
        weighed.shares.scales.pairs = search.system.scale_of(&weighed.mismatches);
    }
    FoundPlace { space, point, weighed, uninformative }
}

fn result(
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
    let columns = chain.weights.len();
    let (weights, beside) = weighed.weights.split_at(columns);
    let amplitudes = &beside[..space.not_of_stage()];
    let responses: Vec<Vec<f64>> = given.drives.iter().map(|drive| chain.response(drive, given.dt)).collect();
    let output_offset = -responses[0][0];
    let (low, high) = signal::bounds_of(responses.iter().map(|response| signal::bounds(response)));
    // Weights of zero are all that distances of the wrong sign leave.
    if low >= high {
        let expected = "distances that rise with the drive: turn their signs if yours fall";
        let longest = given
            .lengths
            .iter()
            .fold(0.0, |longest: f64, known| if known.length.abs() > longest.abs() { known.length } else { longest });
        return Err(Error::domain("lengths", None, expected, longest));
    }
    let own_tangent = space.tangent(point, Some(&weighed.weights));
    let uncertainty = Uncertainty::new(search, found, smoothness, &own_tangent);
    let root = &uncertainty.root;
    let deviation = |row: usize| (0..root.ncols()).map(|k| root[(row, k)].powi(2)).sum::<f64>().sqrt();
    let linear = weighed.weights.len();
    let of_axis = |axis: Axis| {
        let place = space.axes.iter().position(|other| *other == axis);
        place.map_or(0.0, |place| deviation(linear + place))
    };
    let moved = space.beside(point, None);
    let first = given.temperatures.first().map(|temperature| temperature[0]);
    let sensitivity = amplitudes.last().copied().unwrap_or_default();
    let temperature = first.map(|first| TemperatureTerm::new(sensitivity, point.thermal_lag, first)).transpose()?;
    let temperature_std =
        first.map_or((0.0, 0.0), |_| (deviation(columns + amplitudes.len() - 1), of_axis(Axis::ThermalLag)));
    let dead_time_std = of_axis(Axis::DeadTime);
    let creep_std: Vec<f64> = (0..point.creep.len()).map(|number| of_axis(Axis::Creep(number))).collect();
    let uninformative_pairs = doubts::uninformative(given, &search.rows_at(space, point), columns);
    let wrong_pairs = Shares::left_out(&weighed.shares.of_pairs);
    let wrong_lengths = Shares::left_out(&weighed.shares.of_lengths);
    let mut warnings =
        doubts::findings(given, weighed, high - low, (&wrong_pairs, &wrong_lengths), &uninformative_pairs);
    warnings.extend(doubts::missed_lengths(given, &weighed.length_errors, &wrong_lengths));
    warnings.extend(found.without_inverse());
    warnings.extend(untold_dead_time(point.dead_time / given.dt, dead_time_std / given.dt));
    let longest_lag =
        if space.axes.contains(&Axis::ThermalLag) { given.longest_and_shortest().0 } else { f64::INFINITY };
    warnings
        .extend(temperature.and_then(|term| doubts::untold_temperature(given, &term, temperature_std, longest_lag)));
    let apart = apart(&positions, chosen, &trusts);
    warnings.extend(doubts::untold_positions(uncertainty.positions.hypot(apart) / (high - low)));
    let spread = Spread::from_zero(uncertainty.own, own_tangent, given.drives[0], given.dt);
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
            doubts::rms_of_kept(&weighed.length_errors, &wrong_lengths)
        } else {
            weighed.shares.scales.pairs
        },
        length_errors: weighed.length_errors.clone(),
        weights_std: (0..columns).map(deviation).collect(),
        input_offset_std: of_axis(Axis::InputOffset),
        dead_time_std,
        creep_std,
        wrong_pairs,
        wrong_lengths,
        uninformative_pairs,
        smoothness,
        candidates,
        warnings,
        drift_amplitudes: moved.course_amplitudes(amplitudes),
        courses: moved.courses,
        drive_samples: given.drives.iter().map(|drive| drive.len()).collect(),
        temperature,
        temperature_std,
        spread,
        rivals: rivals(given, all, chosen, &trusts),
        chain,
        output_offset,
    })
}

/// The trust in each of the models that were tried, which say these positions along the drives; none in one whose weights are open. In one
/// that has all of the chosen one and more it is less, by what is `left` to explain.
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

/// The share of the mismatches of pairs that were kept that is alike from each to the next, by their later instants: no noise, but of what the
/// model lacks. It counts from the rising branch to the falling one, or else from the earlier to the later instant, however a pair is written.
/// Without pairs all of what is missed may be.
fn left_to_explain(given: &Given<'_>, weighed: &Weighed) -> f64 {
    if given.pairs.is_empty() {
        return 1.0;
    }
    let mut kept: Vec<(usize, f64, f64)> = (given.pairs.iter().zip(&weighed.mismatches).zip(&weighed.shares.of_pairs))
        .filter(|(_, share)| **share > 0.0)
        .map(|((pair, mismatch), _)| (pair.drive, pair.first.max(pair.second), direction(given, pair) * mismatch))
        .collect();
    kept.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    rivals::alike(&kept.into_iter().map(|(_, _, mismatch)| mismatch).collect::<Vec<_>>())
}

/// 1 for a pair from a rising branch to a falling one, -1 for the other way; on like branches by time.
fn direction(given: &Given<'_>, pair: &PlacePair) -> f64 {
    let drive = given.drives[pair.drive];
    let rise = |instant: f64| {
        let last = as_f64(drive.len() - 1);
        value_at(drive, (instant + 0.5).min(last)) - value_at(drive, (instant - 0.5).max(0.0))
    };
    match (rise(pair.first) > 0.0, rise(pair.second) > 0.0) {
        (true, false) => 1.0,
        (false, true) => -1.0,
        _ => (pair.second - pair.first).signum(),
    }
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

/// How far from the positions of the chosen model the others are along a drive, rms, by the trust in each; the most of all drives.
fn apart(positions: &[Vec<Vec<f64>>], chosen: usize, trusts: &[f64]) -> f64 {
    let of_drive = |(drive, own): (usize, &Vec<f64>)| {
        let others = others(positions, chosen, trusts).map(|(other, trust)| (other[drive].clone(), trust));
        signal::rms(&rivals::distances(own, others))
    };
    positions[chosen].iter().enumerate().map(of_drive).fold(0.0, f64::max)
}

fn model(space: &PlaceSpace, point: &space::PlacePoint, weights: &[f64], output: f64) -> Result<Model, Error> {
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
