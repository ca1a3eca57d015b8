//! The number of operators, chosen where everything else is in the model.

use crate::error::Error;
use crate::fit::folds::{CrossValidation, Stretches, Terms};
use crate::fit::levels::{enough, levels};
use crate::fit::maps::Place;
use crate::fit::monitor::{SearchMonitor, Span};
use crate::fit::structure::Structure;
use crate::fit::variety::Variety;
use crate::fit::weight_basis::WeightBasis;
use crate::options::Options;
use crate::record::Record;
use crate::search::{Found, restructured};
use crate::thresholds::Count;

/// The numbers that are tried where any may be chosen.
const NUMBERS: [usize; 12] = [4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80];

/// The numbers that are tried, one after the other, where they are doubled; everything else is fitted with the first of them.
const DOUBLED: [usize; 3] = [20, 40, 80];

/// By which factor a doubled number must lower the mean square error on stretches: a fiftieth of the error. What is less is not worth
/// another search.
const MUST_GAIN: f64 = 1.04;

/// By which factor the best of all numbers must be better than one of fewer: a hundredth of the error. Short stretches tell less still
/// from chance, and it is worth nothing.
const MUST_GAIN_IN_AUTO: f64 = 1.02;

/// A held-out stretch is made of so many short ones, spread over the records. Longer ones have the only large stroke, or the only start
/// from rest: more weights predict these worse without them, whatever they gain elsewhere.
const TURNS: usize = 32;

/// The part of the work after it that the choice takes.
const CHOICE: Span = Span { from: 0.0, to: 0.3 };

/// How far a search is done before the number of operators is chosen, and after it: the search with the number chosen is a short one.
const BEFORE: f64 = 0.7;
const AFTER: f64 = 0.97;

/// A search for everything that options ask for, with a number of operators that is known.
pub(crate) type Search = fn(&[Record<'_>], &Options, &mut SearchMonitor<'_>) -> Result<Found, Error>;

/// What a search finds with as many operators as `asked` asks for; with as many as are chosen where it leaves that open.
pub(crate) fn with_operators_chosen(
    records: &[Record<'_>],
    asked: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let Some(count) = asked.thresholds.count() else { return search(records, asked, monitor) };
    monitor.begin(Span { from: 0.0, to: BEFORE });
    let found = monitor.nested(|monitor| first_search(records, asked, search, count, monitor))?;
    if found.partial {
        return Ok(found);
    }
    monitor.begin(Span { from: BEFORE, to: AFTER });
    let mut choice = Choice { records, asked, found: &found, tried: Vec::new() };
    let chosen = match choice.choose(count, monitor) {
        Err(Error::Interrupted) if monitor.keeps_best() => {
            return Ok(Found { operators_tried: choice.tried, partial: true, ..found });
        }
        chosen => chosen?,
    };
    let operators_tried = choice.tried;
    let found = if chosen == found.options.operators() {
        found
    } else {
        // The part of the work before is done: progress does not go back.
        monitor.hold();
        with_operators(records, asked, found, chosen, monitor)?
    };
    Ok(Found { operators_tried, ..found })
}

/// With so many operators as are usual; with fewer where any may be chosen and the samples bear no more.
fn first_search(
    records: &[Record<'_>],
    asked: &Options,
    search: Search,
    count: Count,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let with = |operators| Options { thresholds: asked.thresholds.of(operators), ..asked.clone() };
    let [usual, ..] = DOUBLED;
    let fewer = NUMBERS.into_iter().rev().filter(|fewer| count == Count::Auto && *fewer < usual);
    let mut found = search(records, &with(usual), monitor);
    for operators in fewer {
        if !matches!(found, Err(Error::TooFewSamples { .. })) {
            break;
        }
        found = search(records, &with(operators), monitor);
    }
    found
}

/// The same with another number of operators: dynamics, creep, loop shift, maps and the weight law stay, under which that number was
/// judged; the smoothness is chosen anew, and everything that is searched goes on from where it was.
fn with_operators(
    records: &[Record<'_>],
    asked: &Options,
    found: Found,
    operators: usize,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let options = Options { thresholds: found.options.thresholds.of(operators), ..found.options.clone() };
    let anew = Options { smoothness: asked.smoothness, ..options.clone() };
    let place =
        Place { space: found.fit.space.with_thresholds(records, &options, &found.fit.fit), point: found.fit.fit.point };
    let Structure { terms_tried, weights_tried, .. } = found.structure.clone();
    let found = restructured(records, &anew, Found { options, ..found }, place.clone(), monitor)?;
    let found = Found { structure: Structure { terms_tried, weights_tried, ..found.structure }, ..found };
    // The last descent begins on a selection of the samples: what suits that may suit all of them less.
    let start = found.problem(records).at(&place.space, &place.point)?;
    Ok(if start.fit.objective < found.fit.fit.objective { Found { fit: start, ..found } } else { found })
}

/// A choice among numbers of operators, at a fit with one of them.
struct Choice<'a> {
    records: &'a [Record<'a>],
    asked: &'a Options,
    found: &'a Found,
    /// What cross-validation said of those that were tried.
    tried: Vec<CrossValidation>,
}

impl Choice<'_> {
    fn choose(&mut self, count: Count, monitor: &mut SearchMonitor<'_>) -> Result<usize, Error> {
        // Loops that are all alike say little for more than the usual number, and nothing for fewer.
        let (numbers, margin): (&[usize], f64) = match count {
            Count::Auto => (&NUMBERS, MUST_GAIN_IN_AUTO),
            Count::Refined => (&DOUBLED, Variety::of(self.records).margin().max(MUST_GAIN)),
        };
        let mut chosen = 0;
        for (done, operators) in numbers.iter().enumerate() {
            if !self.try_number(*operators, CHOICE.at(done, numbers.len()), monitor)? {
                break;
            }
            if count == Count::Refined && done > 0 {
                let pair = [self.tried[chosen].clone(), self.tried[done].clone()];
                // Twice as many are tried where as many are needed.
                if CrossValidation::good(&pair, margin).next() == Some(0) {
                    break;
                }
                chosen = done;
            }
        }
        if count == Count::Auto {
            chosen = CrossValidation::good(&self.tried, margin).next().unwrap_or(0);
        }
        Ok(self.tried.get(chosen).map_or(self.found.options.operators(), |one| one.operators))
    }

    /// Judges a number at the smoothness that suits it, where everything was fitted; says whether the samples bear it.
    fn try_number(&mut self, operators: usize, fraction: f64, monitor: &mut SearchMonitor<'_>) -> Result<bool, Error> {
        let Found { fit: found, options, smoothness, .. } = self.found;
        let options = &Options { thresholds: options.thresholds.of(operators), ..options.clone() };
        let space = found.space.with_thresholds(self.records, options, &found.fit);
        // Few samples are no reason to believe in a law of few unknowns.
        let open = Options { weights: self.asked.weights, ..options.clone() };
        if let Err(Error::TooFewSamples { .. }) =
            enough(self.records, &space, &WeightBasis::new(&open, space.shift_len()))
        {
            return Ok(false);
        }
        let basis = WeightBasis::new(options, space.shift_len());
        let levels = match levels(self.records, &space, &basis, *smoothness, true) {
            Err(Error::TooFewSamples { .. }) => return Ok(false),
            levels => levels?,
        };
        let projection = &levels[levels.len() - 1];
        let fit = projection.fit(&found.fit.point, None);
        monitor.looked(fraction)?;
        let stretches = Stretches::spread(projection, &fit, TURNS);
        let under = stretches.under(options, &basis);
        let terms = |smoothness| Terms { creep: space.creep_amplitudes(), loop_shift: options.loop_shift, smoothness };
        let tried: Vec<_> = options.smoothnesses().iter().map(|value| under.cross_validate(&terms(*value))).collect();
        let best = CrossValidation::best(&tried).cloned();
        self.tried.push(best.unwrap_or_else(|| under.cross_validate(&terms(*smoothness))));
        Ok(true)
    }
}
