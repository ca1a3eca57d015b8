//! What is left to cross-validation once everything was fitted: which terms stay, the weight law, how smooth the
//! weights are, and how many operators there are.

use crate::choose::cross_validation::{CrossValidation, Stretches, StretchesUnderLaw, Terms};
use crate::choose::found::{Found, LinearEvidence, Place, Search, Structure};
use crate::choose::table::TABLE;
use crate::choose::term_search::{Candidate, Chosen, TermSearch};
use crate::choose::told::Variety;
use crate::choose::trial::{TermTrial, TrialOutcome};
use crate::error::Error;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::{enough, rough};
use crate::fit::space::Space;
use crate::options::{Options, Setting};
use crate::records::record::Record;
use crate::terms::creep::CreepModel;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::operators::Count;
use crate::terms::weights::WeightLaw;

/// The laws that cross-validation chooses from, those with fewer unknowns first.
const LAWS: [WeightLaw; 3] = [WeightLaw::Quadratic, WeightLaw::Free, WeightLaw::Split];

/// How smooth the weights are while the terms are chosen, where their smoothness is left open: ragged weights follow
/// what a term leaves.
const USUAL_SMOOTHNESS: f64 = 1e-3;

/// How smooth the weights are where all loops are alike.
const SMOOTHNESS_OF_LIKE_LOOPS: f64 = 1e-2;

/// What was asked for, and where its fit is.
pub(crate) struct StructureProblem<'a> {
    pub(crate) records: &'a [Record<'a>],
    /// What was asked for, with the number of operators chosen.
    pub(crate) asked: &'a Options,
    /// Where everything was fitted but what is chosen here.
    pub(crate) space: &'a Space,
    pub(crate) point: &'a Point,
}

impl StructureProblem<'_> {
    /// Chooses the terms with weights of the widest law, then law and smoothness with these terms: of the candidates
    /// that predict stretches as well as the best, the simplest.
    pub(crate) fn choose(&self) -> Result<Structure, Error> {
        let Self { records, asked, space, .. } = *self;
        let space = space.with_loop_shift(records, asked.loop_shift)?;
        let sides = space.sides();
        let laws = self.laws(&space)?;
        let laws: Vec<_> = laws.iter().map(|options| (options, options.weight_basis(sides))).collect();
        let Some((_, widest)) = laws.last() else { return Ok(Structure::default()) };
        let usual = if asked.smoothness == Setting::Fit { USUAL_SMOOTHNESS } else { asked.given_smoothness() };
        let projection = rough(records, &space, widest, usual)?;
        let fit = projection.fit(self.point, None);
        let stretches = Stretches::new(&projection, &fit);
        let under: Vec<_> = laws.iter().map(|(options, law)| stretches.under(options, law)).collect();
        let (terms, terms_tried) = self.terms(&under[under.len() - 1], &space, usual);
        let (best, tried): (Vec<_>, Vec<_>) = under.iter().map(|law| self.smoothness(law, &terms)).unzip();
        let good = CrossValidation::good(&best, self.margin()).next().unwrap_or(0);
        let is_chosen = |more: &[CrossValidation]| more.len() > 1;
        Ok(Structure {
            weights: best[good].weights,
            smoothness: best[good].smoothness,
            creep: terms.creep,
            loop_shift: terms.loop_shift,
            terms_tried,
            smoothness_tried: tried.into_iter().nth(good).filter(|tried| is_chosen(tried)).unwrap_or_default(),
            weights_tried: if is_chosen(&best) { best } else { Vec::new() },
        })
    }

    /// The options with every law to choose from, the widest one last: those for which there are too few samples left
    /// out.
    fn laws(&self, space: &Space) -> Result<Vec<Options>, Error> {
        let asked = self.asked;
        if asked.weights != WeightLaw::Auto {
            return Ok(vec![asked.clone()]);
        }
        let with = |weights| Options { weights, ..asked.clone() };
        // Few samples are no reason to believe in the law of few unknowns.
        enough(self.records, space, &with(WeightLaw::Free).weight_basis(space.sides()))?;
        let is_borne = |options: &Options| enough(self.records, space, &options.weight_basis(space.sides())).is_ok();
        Ok(LAWS.into_iter().map(with).filter(Options::is_law_of_its_own).filter(is_borne).collect())
    }

    /// The terms that stay, and what cross-validation said of the best of every kind.
    fn terms(
        &self,
        stretches: &StretchesUnderLaw<'_>,
        space: &Space,
        smoothness: f64,
    ) -> (Terms, Vec<CrossValidation>) {
        let all = space.creep_amplitudes();
        let creeps: Vec<usize> = if self.asked.creep == CreepModel::Auto { (0..=all).collect() } else { vec![all] };
        let kinds = shift_kinds(self.asked.loop_shift, space);
        let (mut tried, mut candidates_of_kinds) = (Vec::new(), Vec::new());
        for shifts in kinds {
            for creep in &creeps {
                let candidates = shifts.iter().map(|shift| Terms { creep: *creep, loop_shift: *shift, smoothness });
                let validated = candidates.map(|terms| (stretches.cross_validate(&terms), terms));
                let best = validated.min_by(|(p, _), (q, _)| p.rmse.total_cmp(&q.rmse));
                candidates_of_kinds.extend(best.map(|(validation, terms)| {
                    tried.push(validation);
                    terms
                }));
            }
        }
        let good = CrossValidation::good(&tried, 1.0).next().unwrap_or(0);
        (candidates_of_kinds[good], if tried.len() > 1 { tried } else { Vec::new() })
    }

    /// The smoothness that predicts best under a law, and all that were tried. Where loops are alike one predicts the
    /// other with any weights: then it is a usual one, unless that is clearly worse.
    fn smoothness(&self, law: &StretchesUnderLaw<'_>, terms: &Terms) -> (CrossValidation, Vec<CrossValidation>) {
        let with = |smoothness: &f64| law.cross_validate(&Terms { smoothness: *smoothness, ..*terms });
        let tried: Vec<_> = self.asked.smoothnesses().iter().map(with).collect();
        let margin = self.margin();
        let is_alike = |place: &usize| margin > 1.0 && tried[*place].smoothness == SMOOTHNESS_OF_LIKE_LOOPS;
        let alike = CrossValidation::good(&tried, margin).find(is_alike).map(|place| &tried[place]);
        let best = alike.or_else(|| CrossValidation::best(&tried)).cloned();
        (best.unwrap_or_else(|| with(&0.0)), tried)
    }

    /// By which factor of the mean square error a law must be better than a simpler one.
    fn margin(&self) -> f64 {
        Variety::of(self.records).margin()
    }
}

/// The loop shifts to choose from, those of as many amplitudes together: none, one, two.
fn shift_kinds(asked: LoopShiftModel, space: &Space) -> Vec<Vec<LoopShiftModel>> {
    let Some(side) = space.side() else { return vec![vec![LoopShiftModel::None]] };
    if asked != LoopShiftModel::Auto {
        return vec![vec![asked]];
    }
    let of = |kind: fn(f64) -> LoopShiftModel| side.filters.iter().map(|filter| kind(filter.time_constant)).collect();
    vec![vec![LoopShiftModel::None], of(LoopShiftModel::Square), of(LoopShiftModel::Both)]
}

/// A point with only the first amplitudes of creep.
pub(crate) fn with_creep_amplitudes(point: &Point, space: &Space, amplitudes: usize) -> Point {
    (amplitudes..space.creep_amplitudes()).fold(*point, |point, number| point.with(Parameter::Creep(number), 0.0))
}

/// How many last descents there are at most, each but the first with the smoothness that is chosen where the one before
/// led. An amplifier that goes in the last of them has one more.
const DESCENTS: usize = 3;

/// The same with what cross-validation chooses, fitted anew; what was found as it is where it needs coupled plays.
pub(crate) fn with_structure(
    records: &[Record<'_>],
    asked: &Options,
    found: Found,
    plain: Point,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    monitor.begin_structure();
    let smoothness = if asked.smoothness == Setting::Fit { USUAL_SMOOTHNESS } else { found.smoothness };
    let search = TermSearch { table: &TABLE, records, asked, smoothness, plain, variety: Variety::of(records) };
    let chosen = monitor.unless_stopped(|monitor| search.choose(&found, monitor))?;
    let Some(chosen) = chosen else { return Ok(found.stopped()) };
    let Some(Chosen { candidate: Candidate { options, place, linear, .. }, untold, trials }) = chosen else {
        let place = Place { space: found.fit.space.clone(), point: found.fit.fit.point };
        let found = Found { trials: [found.trials.clone(), search.nothing_left(&found)].concat(), ..found };
        return restructured(records, asked, found, place, monitor);
    };
    let found = Found { trials: [found.trials, trials].concat(), ..found };
    if search.needs_coupling(&options) {
        return Ok(Found { needs_coupling: true, ..found });
    }
    // An amplitude for every decade was chosen for good.
    let settled = if options.creep == CreepModel::EveryDecade { options.creep.clone() } else { asked.creep.clone() };
    let asked = &Options { creep: settled, ..asked.clone() };
    // Dynamics that were sought with all records are not those that one record told.
    let keeps_told = place.space.order().is_some() && !place.space.searches(Parameter::LogFrequency);
    let told_alone = found.told_alone.filter(|_| keeps_told);
    restructured(records, asked, Found { options, linear, told_alone, untold_map: untold, ..found }, place, monitor)
}

/// The same with terms, weight law and smoothness as cross-validation chooses them at a place, fitted anew from there.
fn restructured(
    records: &[Record<'_>],
    asked: &Options,
    found: Found,
    Place { space, point }: Place,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let mut structure = StructureProblem { records, asked, space: &space, point: &point }.choose()?;
    let mut options = Options { weights: structure.weights, loop_shift: structure.loop_shift, ..found.options.clone() };
    let mut space = space.with_loop_shift(records, options.loop_shift)?;
    let mut point = point;
    if asked.creep == CreepModel::Auto {
        point = with_creep_amplitudes(&point, &space, structure.creep);
        space = space.with_creep_amplitudes(structure.creep);
        options.creep = [CreepModel::UnderWay, CreepModel::Slow, CreepModel::SlowAndFast][structure.creep].clone();
    }
    let basis = options.weight_basis(space.sides());
    // A map is linear about the weights: what suits those of a place that was fitted roughly may suit those that a
    // descent leads to no more.
    let is_open = asked.smoothness == Setting::Fit && space.has_map();
    let smoothness = if is_open { USUAL_SMOOTHNESS } else { structure.smoothness };
    let problem = JointProblem { records, options: &options, basis: &basis, smoothness };
    let (fit, partial) = last_descents(problem, &mut structure, Place { space, point }, monitor)?;
    let is_told = |_: &LinearEvidence| {
        let asked = matches!(asked.dynamics, DynamicsModel::Order(_));
        asked || fit.space.order().is_some() || fit.space.creep_amplitudes() > 0 || fit.space.has_amplifier()
    };
    let linear = found.linear.filter(is_told);
    Ok(Found { fit, smoothness: structure.smoothness, options, basis, structure, linear, partial, ..found })
}

/// The last descent, with the smoothness that is chosen where it led until that stays the same, and without an
/// amplifier that is fast without bound; and whether it was stopped.
fn last_descents(
    mut problem: JointProblem<'_>,
    structure: &mut Structure,
    Place { mut space, mut point }: Place,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(JointFit, bool), Error> {
    let (records, options) = (problem.records, problem.options);
    let mut descents = 0;
    loop {
        structure.smoothness = problem.smoothness;
        monitor.within(1, 2);
        let fit = monitor.unless_stopped(|monitor| problem.search_around(space.clone(), &point, monitor))?;
        let Some(fit) = fit else {
            // Once about the weights that were begun with, then about its own. Of several starts that were tried at
            // once, the one that was looked at first may be worse than what was begun with.
            let begun = problem.at(&space, &point)?;
            let kept = monitor.kept().map(|kept| problem.at(&space, &kept)).transpose()?;
            let best = kept.filter(|kept| kept.fit.objective < begun.fit.objective).unwrap_or(begun);
            return Ok((problem.at(&best.space, &best.fit.point)?, true));
        };
        descents += 1;
        if fit.has_amplifier_at_bound() {
            monitor.hold();
            (space, point) = (fit.space.without_amplifier(), fit.fit.point);
            continue;
        }
        if options.smoothness != Setting::Fit || descents >= DESCENTS {
            return Ok((fit, false));
        }
        // It was chosen at ratios that suit another one.
        monitor.hold();
        (space, point) = (fit.space.clone(), fit.fit.point);
        let again = StructureProblem { records, asked: options, space: &space, point: &point }.choose()?;
        structure.smoothness_tried = again.smoothness_tried;
        if again.smoothness == problem.smoothness {
            return Ok((fit, false));
        }
        problem.smoothness = again.smoothness;
    }
}

/// What was left to cross-validation beside the number of operators, as trials of terms: every answer to a question but
/// the simplest is one.
pub(crate) fn answers_tried(records: &[Record<'_>], found: &Found) -> Vec<TermTrial> {
    let Found { structure, options, smoothness, .. } = found;
    let margin = Variety::of(records).margin();
    let laws = &structure.weights_tried;
    let good = CrossValidation::good(laws, margin).next().unwrap_or(0);
    // More operators may have asked for another law later: their row says so.
    let law = |place: usize| {
        let is_chosen = place == good && laws[place].weights == options.weights;
        answer(&law_name(laws[place].weights), &laws[place], &laws[0], margin, is_chosen)
    };
    let laws: Vec<TermTrial> = (1..laws.len()).map(law).collect();
    let smooth = Vec::from_iter(smooth_weights(&structure.smoothness_tried, *smoothness, margin));
    [creep_and_shift(&structure.terms_tried), laws, smooth].concat()
}

fn law_name(law: WeightLaw) -> String {
    format!("{} weights", law.name())
}

/// One answer to a question, beside a simpler one.
fn answer(name: &str, one: &CrossValidation, simpler: &CrossValidation, margin: f64, is_chosen: bool) -> TermTrial {
    let (gain, needed) = (simpler.typical_error() / one.typical_error(), one.needed_beside(simpler, margin));
    let outcome = match is_chosen {
        true => TrialOutcome::Better,
        false if gain >= needed => TrialOutcome::Beaten,
        false => TrialOutcome::NotBetter,
    };
    TermTrial::by_stretches(name, needed.powi(2), outcome).with_gain(gain)
}

/// Each kind of creep beside the loop shift that is chosen, and each loop shift beside the creep.
fn creep_and_shift(tried: &[CrossValidation]) -> Vec<TermTrial> {
    let good = CrossValidation::good(tried, 1.0).next().unwrap_or(0);
    let Some((simplest, chosen)) = tried.first().zip(tried.get(good)) else { return Vec::new() };
    let creep = |one: &CrossValidation| {
        let is_more = one.creep > simplest.creep;
        is_more.then(|| ["slow creep", "slow and fast creep"][one.creep.min(2) - 1])
    };
    let shift = |one: &CrossValidation| match (one.loop_shift, simplest.loop_shift) {
        (LoopShiftModel::Square(_), LoopShiftModel::None) => Some("loop shift of one amplitude"),
        (LoopShiftModel::Both(_), LoopShiftModel::None) => Some("loop shift of two amplitudes"),
        _ => None,
    };
    let trials = |name: &dyn Fn(&CrossValidation) -> Option<&'static str>,
                  beside: &dyn Fn(&CrossValidation) -> Option<&'static str>| {
        let rows: Vec<_> = tried.iter().filter(|one| beside(one) == beside(chosen)).collect();
        let without = rows.iter().find(|one| name(one).is_none());
        let rows = rows.iter().filter_map(|one| {
            let trial = answer(name(one)?, one, without?, 1.0, name(one) == name(chosen));
            Some(TermTrial { beside: beside(chosen).map(str::to_owned).into_iter().collect(), ..trial })
        });
        rows.collect::<Vec<_>>()
    };
    [trials(&creep, &shift), trials(&shift, &creep)].concat()
}

/// Smooth weights beside those of no smoothness: those that are chosen, or else the best.
fn smooth_weights(tried: &[CrossValidation], chosen: f64, margin: f64) -> Option<TermTrial> {
    let (rough, smooth) = tried.split_first()?;
    let is_chosen = |one: &&CrossValidation| one.smoothness == chosen;
    let best = || smooth.iter().min_by(|p, q| p.typical_error().total_cmp(&q.typical_error()));
    let one = smooth.iter().find(is_chosen).or_else(best)?;
    let outcome = if is_chosen(&one) { TrialOutcome::Better } else { TrialOutcome::NotBetter };
    // Of loops that are all alike the usual smoothness is taken unless it is worse by the margin.
    let gain = rough.typical_error() / one.typical_error();
    Some(TermTrial::by_stretches("smooth weights", margin.recip(), outcome).with_gain(gain))
}

/// The numbers that are tried where any may be chosen.
const NUMBERS: [usize; 12] = [4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80];

/// The numbers that are tried, one after the other, where they are doubled; everything else is fitted with the first of
/// them.
const DOUBLED: [usize; 3] = [20, 40, 80];

/// By which factor a doubled number must lower the mean square error on stretches: a fiftieth of the error. What is
/// less is not worth another search.
const MUST_GAIN_OF_OPERATORS: f64 = 1.04;

/// By which factor the best of all numbers must be better than one of fewer: a hundredth of the error. Short stretches
/// tell less still from chance, and it is worth nothing.
const MUST_GAIN_IN_AUTO: f64 = 1.02;

/// A held-out stretch is made of so many short ones, spread over the records. Longer ones have the only large stroke,
/// or the only start from rest: more weights predict these worse without them, whatever they gain elsewhere.
const TURNS: usize = 32;

/// The part of the work after it that the choice takes.
const CHOICE: Span = Span { from: 0.0, to: 0.3 };

/// How far a search is done before the number of operators is chosen, and after it: the search with the number chosen
/// is a short one.
const BEFORE: f64 = 0.7;
const AFTER: f64 = 0.97;

/// What a search finds with as many operators as `asked` asks for; with as many as are chosen where it leaves that
/// open.
pub(crate) fn with_operators_chosen(
    records: &[Record<'_>],
    asked: &Options,
    search: Search,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let Some(count) = asked.thresholds.count() else { return search(records, asked, monitor) };
    monitor.begin(Span { from: 0.0, to: BEFORE });
    let mut found = monitor.nested(|monitor| first_search(records, asked, search, count, monitor))?;
    if found.partial {
        return Ok(found);
    }
    // If the chosen weight law is not the one of this fit, everything is fitted with it, and the numbers are judged
    // once more: no other law is left open then.
    for _ in 0..2 {
        monitor.begin(Span { from: BEFORE, to: AFTER });
        monitor.hold();
        let mut choice = Choice { records, asked, found: &found, tried: Vec::new() };
        let chosen = monitor.unless_stopped(|monitor| choice.choose(count, monitor))?;
        let Some(chosen) = chosen else {
            let tried = choice.tried;
            let operators_tried = if found.operators_tried.is_empty() { tried } else { found.operators_tried };
            return Ok(Found { operators_tried, ..found }.stopped());
        };
        let operators_tried = choice.tried;
        let before = (found.options.operators(), found.options.weights);
        let chosen = chosen.map_or(before, |chosen| (chosen.operators, chosen.weights));
        if chosen != before {
            monitor.hold();
            found = with_operators(records, asked, found, chosen, monitor)?;
        }
        found.operators_tried = operators_tried;
        if found.partial || chosen.1 == before.1 {
            break;
        }
    }
    let trials = operators_as_trials(records, &found, count);
    found.trials.extend(trials);
    Ok(found)
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

/// The same with another number of operators and the weight law under which it was judged: dynamics, creep, loop shift
/// and maps stay, the smoothness is chosen anew, and everything that is searched goes on from where it was.
fn with_operators(
    records: &[Record<'_>],
    asked: &Options,
    found: Found,
    (operators, weights): (usize, WeightLaw),
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let options = Options { thresholds: found.options.thresholds.of(operators), weights, ..found.options.clone() };
    let anew = Options { smoothness: asked.smoothness, ..options.clone() };
    let place = Place {
        space: found.fit.space.with_thresholds(records, &options, &found.fit.fit.point, &found.fit.fit.weights),
        point: found.fit.fit.point,
    };
    let Structure { terms_tried, weights_tried, .. } = found.structure.clone();
    let found = restructured(records, &anew, Found { options, ..found }, place.clone(), monitor)?;
    let found = Found { structure: Structure { terms_tried, weights_tried, ..found.structure }, ..found };
    // The last descent begins on a selection of the samples: what suits that may suit all of them less.
    let start = found.problem(records).at(&place.space, &place.point)?;
    let is_better = start.fit.objective < found.fit.fit.objective;
    let has_the_same = start.space.has_amplifier() == found.fit.space.has_amplifier();
    Ok(if is_better && has_the_same { Found { fit: start, ..found } } else { found })
}

/// By which factor of the mean square error a number must be better than one of fewer. Loops that are all alike say
/// little for more than the usual number, and nothing for fewer.
fn margin_of_operators(records: &[Record<'_>], count: Count) -> f64 {
    match count {
        Count::Auto => MUST_GAIN_IN_AUTO,
        Count::Refined => Variety::of(records).margin().max(MUST_GAIN_OF_OPERATORS),
    }
}

/// The numbers that were tried, as trials of terms: each beside the one before where they are doubled, else beside the
/// fewest.
fn operators_as_trials(records: &[Record<'_>], found: &Found, count: Count) -> Vec<TermTrial> {
    let (tried, margin) = (&found.operators_tried, margin_of_operators(records, count));
    let trial = |place: usize| {
        let (one, fewer) = (&tried[place], &tried[if count == Count::Auto { 0 } else { place - 1 }]);
        let is_chosen = one.operators == found.options.operators();
        let trial = answer(&format!("{} operators", one.operators), one, fewer, margin, is_chosen);
        TermTrial { beside: vec![law_name(one.weights)], ..trial }
    };
    (1..tried.len()).map(trial).collect()
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
    /// What is chosen, if the samples bear any.
    fn choose(&mut self, count: Count, monitor: &mut SearchMonitor<'_>) -> Result<Option<CrossValidation>, Error> {
        let numbers: &[usize] = if count == Count::Auto { &NUMBERS } else { &DOUBLED };
        let margin = margin_of_operators(self.records, count);
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
        Ok(self.tried.get(chosen).cloned())
    }

    /// Judges a number at the weight law and the smoothness that suit it, where everything was fitted; says whether the
    /// samples bear it. A law of few unknowns gains nothing by more operators: so beside it free weights are judged.
    fn try_number(&mut self, operators: usize, fraction: f64, monitor: &mut SearchMonitor<'_>) -> Result<bool, Error> {
        let Found { fit: found, options, smoothness, .. } = self.found;
        let options = &Options { thresholds: options.thresholds.of(operators), ..options.clone() };
        let space = found.space.with_thresholds(self.records, options, &found.fit.point, &found.fit.weights);
        let judges_free_too = self.asked.weights == WeightLaw::Auto && options.weights == WeightLaw::Quadratic;
        let laws = [Some(options.weights), judges_free_too.then_some(WeightLaw::Free)].into_iter().flatten();
        let laws = laws.map(|weights| Options { weights, ..options.clone() });
        let laws: Vec<_> = laws.map(|options| (options.weight_basis(space.sides()), options)).collect();
        let (widest, _) = &laws[laws.len() - 1];
        // Few samples are no reason to believe in a law of few unknowns.
        let open = Options { weights: self.asked.weights, ..options.clone() };
        if let Err(Error::TooFewSamples { .. }) = enough(self.records, &space, &open.weight_basis(space.sides())) {
            return Ok(false);
        }
        let projection = match rough(self.records, &space, widest, *smoothness) {
            Err(Error::TooFewSamples { .. }) => return Ok(false),
            projection => projection?,
        };
        let fit = projection.fit(&found.fit.point, None);
        monitor.counted(fraction)?;
        let stretches = Stretches::spread(&projection, &fit, TURNS);
        let (creep, loop_shift) = (space.creep_amplitudes(), options.loop_shift);
        let terms = Terms { creep, loop_shift, smoothness: *smoothness };
        let at_best =
            |(law, options): &(_, Options)| stretches.under(options, law).at_best(options.smoothnesses(), &terms);
        let mut tried: Vec<_> = laws.iter().map(at_best).collect();
        let good = CrossValidation::good(&tried, Variety::of(self.records).margin()).next().unwrap_or(0);
        self.tried.push(tried.swap_remove(good));
        Ok(true)
    }
}
