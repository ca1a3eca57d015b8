//! What a model may have more than plays, creep and drift: a Duhem operator beside the plays, and a map in front of
//! them.
//!
//! Each is tried with the chosen model. The best stays if it predicts held-out pairs and lengths better by what it must
//! gain; then the other is tried beside it. What is asked for is there without any trial.

use std::ops::ControlFlow;

use crate::choose::must_gain::{MUST_GAIN, is_better};
use crate::error::Error;
use crate::options::Options;
use crate::places::given::{Given, PlacesOptions};
use crate::places::judging::{check_equations, judged, left_to_explain, simplest};
use crate::places::result::PlacesCandidate;
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::space::{Axis, PlacePoint, PlaceSpace};
use crate::places::validation::MANY_LENGTHS;
use crate::terms::maps::MapModel;

/// By which factor a Duhem operator must lower the mean square error of prediction, by pairs and by lengths alone. With
/// pairs, which tell no place, simulated stages that need one gain 40 and more, and a Preisach stage that is predicted
/// worse with it 1.9 to 3.2. With known loads cells that need one gain 3.2 to 30, and others 1.1 to 1.9.
const MUST_GAIN_OF_DUHEM: (f64, f64) = (4.0, 2.5);

/// A Duhem operator is tried where so much of the mean square of what pairs are missed by is alike from pair to pair;
/// with lengths alone always.
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

    /// Whether it may be told. What is at the same place in front of a map is so behind it: many lengths alone tell
    /// one.
    fn is_promising(self, given: &Given<'_>, chosen: &FoundPlace) -> bool {
        match self {
            Self::Duhem => left_to_explain(given, &chosen.weighed) > LEAST_ALIKE,
            Self::InputMap => given.lengths.len() >= MANY_LENGTHS,
        }
    }

    /// By which factor it must lower the mean square error of prediction.
    fn must_gain(self, given: &Given<'_>) -> f64 {
        match self {
            Self::Duhem if given.pairs.is_empty() => MUST_GAIN_OF_DUHEM.1,
            Self::Duhem => MUST_GAIN_OF_DUHEM.0,
            Self::InputMap => MUST_GAIN,
        }
    }
}

/// Adds to the models that were found those with more; returns the number of the chosen one, and how each predicts.
pub(crate) fn with_further(
    search: &mut PlaceSearch<'_>,
    found: &mut Vec<FoundPlace>,
    (options, checked): (&PlacesOptions, &Options),
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<(usize, Vec<PlacesCandidate>), Error> {
    let mut candidates = judged(search, found, checked);
    let mut chosen = simplest(&candidates);
    loop {
        let missing = |one: &Further| !one.is_in(&found[chosen].space);
        let is_asked = |one: &Further| one.asked(options) == Some(true);
        let must = ALL.into_iter().filter(missing).find(is_asked);
        let open: Vec<Further> = ALL.into_iter().filter(|one| missing(one) && one.asked(options).is_none()).collect();
        let mut more: Vec<(usize, Further)> = Vec::new();
        for further in must.map_or(open, |one| vec![one]) {
            let one = tried(search, &found[chosen], further, must.is_some(), proceed)?;
            more.extend(one.is_some().then_some((found.len(), further)));
            found.extend(one);
        }
        if more.is_empty() {
            return Ok((chosen, candidates));
        }
        candidates = judged(search, found, checked);
        let by = |place: usize| &candidates[place].validation;
        more.retain(|(place, one)| {
            must.is_some() || is_better(by(*place), by(chosen), one.must_gain(&search.system.given))
        });
        let error = |(place, _): &&(usize, Further)| by(*place).typical_error();
        match more.iter().min_by(|p, q| error(p).total_cmp(&error(q))) {
            Some((best, _)) => chosen = *best,
            None => return Ok((chosen, candidates)),
        }
    }
}

/// A model with more; where that is left open, none if it is not promising, if there are too few equations, or if it
/// leaves no inverse.
fn tried(
    search: &mut PlaceSearch<'_>,
    chosen: &FoundPlace,
    further: Further,
    is_asked: bool,
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<FoundPlace>, Error> {
    let given = search.system.given;
    if !is_asked && !further.is_promising(&given, chosen) {
        return Ok(None);
    }
    let space = further.added_to(&chosen.space);
    search.system.uninformative = match check_equations(search, &space) {
        Err(Error::TooFewPairs { .. } | Error::TooFewLengths { .. }) if !is_asked => return Ok(None),
        uninformative => uninformative?,
    };
    let starts = further.starts(&space, &chosen.point);
    let found = search.find(space, starts, proceed)?;
    let has_inverse = found.without_inverse().is_none();
    Ok(Some(found).filter(|_| has_inverse || is_asked))
}
