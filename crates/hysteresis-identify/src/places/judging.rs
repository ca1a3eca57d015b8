//! Whether pairs and lengths say enough, how each model predicts those that it was not fitted to, and what it leaves.

use crate::choose::cross_validation::CrossValidation;
use crate::error::Error;
use crate::options::{Options, Setting};
use crate::places::beside::DriftModel;
use crate::places::doubts;
use crate::places::given::{Given, PlacePair};
use crate::places::result::PlacesCandidate;
use crate::places::rivals;
use crate::places::rows::value_at;
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::space::PlaceSpace;
use crate::places::validation::PairStretches;
use crate::places::weighing::{Shares, Weighed};
use crate::records::signal::as_f64;

/// A simpler model stays unless another one predicts better by more than this factor of the mean square error.
const MARGIN: f64 = 1.02;

/// The fewest equations that say something, for each parameter that is searched, and beside them.
const EQUATIONS: (usize, usize) = (2, 4);

/// Checks that enough equations say something, at the first start, and that none says what cannot be; returns the pairs
/// that say nothing.
pub(super) fn check_equations(search: &PlaceSearch<'_>, space: &PlaceSpace) -> Result<Vec<usize>, Error> {
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

/// How each model predicts pairs. There is a model at least.
pub(super) fn judged(search: &PlaceSearch<'_>, found: &[FoundPlace], options: &Options) -> Vec<PlacesCandidate> {
    let shares = judging_shares(found);
    found.iter().map(|one| candidate(search, one, shares, options)).collect()
}

/// The number of the simplest model that predicts pairs as well as the best.
pub(super) fn simplest(candidates: &[PlacesCandidate]) -> usize {
    let validations: Vec<CrossValidation> = candidates.iter().map(|one| one.validation.clone()).collect();
    CrossValidation::good(&validations, MARGIN).next().unwrap_or(0)
}

/// How much every pair counts where candidates are judged: all by the same shares, those of the model that leaves
/// least. Each by its own would let a model leave out the pairs that it does not explain.
fn judging_shares(found: &[FoundPlace]) -> &Shares {
    let left = |shares: &Shares| (shares.scales.pairs, shares.scales.lengths.unwrap_or(f64::INFINITY));
    let shares = found.iter().map(|one| &one.weighed.shares);
    shares.reduce(|a, b| if left(b) < left(a) { b } else { a }).unwrap_or(&found[0].weighed.shares)
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

/// The share of the mismatches of pairs that were kept that is alike from each to the next, by their later instants: no
/// noise, but of what the model lacks. It counts from the rising branch to the falling one, or else from the earlier to
/// the later instant, however a pair is written. Without pairs all of what is missed may be.
pub(super) fn left_to_explain(given: &Given<'_>, weighed: &Weighed) -> f64 {
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
