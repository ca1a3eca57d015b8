//! What a model may have more than plays, creep and drift: a Duhem operator beside the plays, and a map in front of them.
//!
//! Each is tried with the chosen model. The best stays if it predicts held-out pairs and lengths better by what it must gain; then the other
//! is tried beside it. What is asked for is there without any trial.

use std::ops::ControlFlow;

use crate::choose::table::{MUST_GAIN, MUST_GAIN_OF_LIKE_LOOPS, is_better};
use crate::error::Error;
use crate::options::Options;
use crate::places::doubts;
use crate::places::given::{Given, PlacesOptions};
use crate::places::result::PlacesCandidate;
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::space::{Axis, PlacePoint, PlaceSpace};
use crate::places::validation::MANY_LENGTHS;
use crate::places::{check_equations, judged, left_to_explain, simplest};
use crate::terms::maps::MapModel;

/// One is tried where so much of the mean square of what is left is alike from pair to pair.
const LEAST_ALIKE: f64 = 0.1;

/// The bends at which the search of a map begins, beside none: saturation, and its opposite.
const BENDS: [f64; 2] = [-0.4, 0.4];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Further {
    Duhem,
    InputMap,
}

const ALL: [Further; 2] = [Further::Duhem, Further::InputMap];

impl Further {
    /// Whether it must be there, or must not; none where that is open.
    fn asked(self, options: &PlacesOptions) -> Option<bool> {
        match (self, options.input_map) {
            (Self::Duhem, _) => options.duhem,
            (Self::InputMap, MapModel::Auto) => None,
            (Self::InputMap, map) => Some(map == MapModel::Smooth),
        }
    }

    fn is_in(self, space: &PlaceSpace) -> bool {
        match self {
            Self::Duhem => space.has_duhem,
            Self::InputMap => space.has_input_map(),
        }
    }

    fn added_to(self, space: &PlaceSpace) -> PlaceSpace {
        match self {
            Self::Duhem => space.with_duhem(),
            Self::InputMap => space.with_input_map(),
        }
    }

    fn starts(self, space: &PlaceSpace, point: &PlacePoint) -> Vec<PlacePoint> {
        match self {
            Self::Duhem => space.shapes_at(point),
            Self::InputMap => {
                let bent = BENDS.map(|bend| point.with(Axis::Bend(0), bend));
                std::iter::once(point.clone()).chain(bent).collect()
            }
        }
    }

    /// What is at the same place in front of a map is so behind it: lengths alone tell one.
    fn is_told(self, given: &Given<'_>) -> bool {
        self == Self::Duhem || given.lengths.len() >= MANY_LENGTHS
    }
}

/// Adds to the models that were found those with more; returns the number of the chosen one, and how each predicts.
pub(crate) fn with_further(
    search: &mut PlaceSearch<'_>,
    found: &mut Vec<FoundPlace>,
    (options, checked): (&PlacesOptions, &Options),
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<(usize, Vec<PlacesCandidate>), Error> {
    let mut candidates = judged(search, found, checked)?;
    let mut chosen = simplest(&candidates);
    loop {
        let missing = |one: &Further| !one.is_in(&found[chosen].space);
        let is_asked = |one: &Further| one.asked(options) == Some(true);
        let must = ALL.into_iter().filter(missing).find(is_asked);
        let open: Vec<Further> = ALL.into_iter().filter(|one| missing(one) && one.asked(options).is_none()).collect();
        let first = found.len();
        for further in must.map_or(open, |one| vec![one]) {
            let more = tried(search, &found[chosen], further, must.is_some(), proceed)?;
            found.extend(more);
        }
        if found.len() == first {
            return Ok((chosen, candidates));
        }
        candidates = judged(search, found, checked)?;
        let error = |place: &usize| candidates[*place].validation.typical_error();
        let best = (first..found.len()).min_by(|p, q| error(p).total_cmp(&error(q))).unwrap_or(chosen);
        let [one, before] = [best, chosen].map(|place| &candidates[place].validation);
        if must.is_none() && !is_better(one, before, must_gain(&search.system.given, &found[chosen])) {
            return Ok((chosen, candidates));
        }
        chosen = best;
    }
}

/// A model with more; where that is left open, none if what is left is noise alone, if it is not told, or if it leaves no inverse.
fn tried(
    search: &mut PlaceSearch<'_>,
    chosen: &FoundPlace,
    further: Further,
    is_asked: bool,
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<FoundPlace>, Error> {
    let given = search.system.given;
    let is_promising = further.is_told(&given) && left_to_explain(&given, &chosen.weighed) > LEAST_ALIKE;
    if !is_asked && !is_promising {
        return Ok(None);
    }
    let space = further.added_to(&chosen.space);
    search.system.uninformative = match check_equations(search, &space) {
        Err(Error::TooFewPairs { .. }) if !is_asked => return Ok(None),
        uninformative => uninformative?,
    };
    let starts = further.starts(&space, &chosen.point);
    let found = search.find(space, starts, proceed)?;
    let has_inverse = found.without_inverse().is_none();
    Ok(Some(found).filter(|_| has_inverse || is_asked))
}

/// By which factor it must lower the mean square error of prediction. On loops of one size anything that fits one predicts the next.
fn must_gain(given: &Given<'_>, found: &FoundPlace) -> f64 {
    let is_one_size = doubts::one_loop_size(given, &found.uninformative).is_some();
    if is_one_size { MUST_GAIN_OF_LIKE_LOOPS } else { MUST_GAIN }
}
