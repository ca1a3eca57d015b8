//! Identification without a position sensor: from pairs of instants at the same place, and from known lengths.
//!
//! If y(t1) = y(t2), the outputs of the operators differ by rows D with D w = 0: an equation that is linear in the
//! weights. A known length says D w = l. So non-negative least squares gives all weights at once, and what is not
//! linear is searched as ever: input offset, ratios, dead time, creep.
//!
//! 1. `given` checks what came.
//! 2. `space` names what is searched, `equations` has the `rows` of a point, `beside` what moves places beside the
//!    operators.
//! 3. `weighing` finds the best weights for rows, whatever some pairs say; `search` the best point.
//! 4. `judging` says how each model predicts pairs that were not fitted (`validation`): so model, creep, drift and
//!    smoothness are chosen, and by `further` what else the model has.
//! 5. `spread` says how far the numbers may be off, `rivals` what the model may lack, `doubts` what the pairs cannot
//!    tell. `outcome` puts it all together, a `result`.

mod beside;
mod doubts;
mod equations;
mod further;
pub(crate) mod given;
mod judging;
mod outcome;
pub(crate) mod result;
mod rivals;
mod rows;
mod search;
mod space;
mod spread;
mod validation;
mod weighing;

use std::ops::ControlFlow;

use crate::error::Error;
use crate::options::{Options, Setting};
use crate::places::beside::DriftModel;
use crate::places::equations::Equations;
use crate::places::further::with_further;
use crate::places::given::{Given, KnownLength, PlacePair, PlacesOptions};
use crate::places::judging::check_equations;
use crate::places::outcome::outcome;
use crate::places::result::PlacesIdentification;
use crate::places::search::{FoundPlace, PlaceSearch, SEARCH_SMOOTHNESS};
use crate::places::space::PlaceSpace;
use crate::places::validation::MANY_LENGTHS;
use crate::places::weighing::{RobustLoss, System};
use crate::terms::creep::CreepModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::ModelKind;

/// Identifies a stage from pairs of instants at the same place and from known lengths, without a position sensor.
///
/// Every pair says D w = 0 and every length D w = l, with D the difference of the operators' outputs, behind creep and
/// dead time, between the two instants. Weights w >= 0 follow by least squares with a robust loss, so that a few wrong
/// pairs do no harm; input offset, dead time and whatever else `options` leaves open are searched. Which model, whether
/// there is creep, whether what is seen drifts, and how smooth the weights are is chosen by cross-validation over the
/// pairs. The lengths alone set the scale.
///
/// Beside the plays there may be a Duhem operator, and in front of them a map, which lengths alone tell.
///
/// With temperatures T the position has the further term kappa (theta - T at the first sample), theta' = (T - theta) /
/// tau.
///
/// Pairs do not tell an offset: the position is 0 at the first sample of the first drive. Every drive starts from rest
/// at the input offset, and from there at its first sample. So the input offset of plays is what was before: near the
/// first drive for a stage that begins virgin, halfway to the last load for one that was loaded. `proceed` is called
/// between steps; [`ControlFlow::Break`] stops.
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
/// [`Error::Core`] or [`Error::Record`] for drives, pairs, lengths or options outside their domain,
/// [`Error::TooFewPairs`] if too few of the pairs and lengths say anything, [`Error::TooFewLengths`] if there are no
/// pairs and too few lengths, [`Error::Interrupted`] when `proceed` said so.
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
    outcome(&search, &found, chosen, candidates)
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

/// The models to try, the simplest first. Creep that the drives are too short for is not tried. Lengths alone are not
/// taken to drift, but by what goes on of what was before: they have a temperature for that.
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
