//! The search over a table of terms that are judged by stretches of the records.
//!
//! From what was found the search goes to the neighbour that predicts best: a model with a term more, a term less, or
//! another variant of one, each fitted roughly from where it starts. Where two predict alike it follows both. It ends
//! where no neighbour predicts better than chance and its cost let expect. So a term that was tried before another one
//! was there is tried again.

use std::ops::Range;
use std::sync::Arc;

use crate::choose::cross_validation::{CrossValidation, Stretches, Terms};
use crate::choose::found::{Found, LinearEvidence, Place, UntoldMap};
use crate::choose::linear_part::to_compare;
use crate::choose::must_gain::{MUST_GAIN, MUST_GAIN_OF_LIKE_LOOPS, OfLikeLoops, is_better};
use crate::choose::told::Variety;
use crate::choose::trial::{TermTrial, TrialOutcome, overrule};
use crate::error::Error;
use crate::fit::descent::{best_attempt, best_of_starts};
use crate::fit::joint::JointProblem;
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::{ProjectedFit, levels, rough};
use crate::fit::response::hysteresis;
use crate::fit::space::Space;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::options::Options;
use crate::records::record::{Record, largest_range};
use crate::records::signal::as_f64;
use crate::terms::dynamics::{DynamicsModel, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::{MapModel, OutputMap};
use crate::terms::weights::WeightBasis;

/// A term, and what it costs.
pub(crate) struct Row {
    /// For how many terms a variant of it must lower the error of prediction.
    pub(crate) terms: i32,
    /// Whether its variants are searches of their own, or may stand for a term that another row has: then they are
    /// tried where no other term is better.
    pub(crate) is_costly: bool,
    pub(crate) of_like_loops: OfLikeLoops,
    pub(crate) term: &'static dyn Term,
}

/// A term of the table. The search itself names maps, coupled plays, the loop shift and the order of dynamics besides:
/// these stand for one another.
pub(crate) trait Term: Sync {
    /// How results call it.
    fn name(&self) -> &'static str;

    /// Whether it is open by what was asked for, where options were taken: then a search is worth while.
    fn is_open(&self, asked: &Options, options: &Options) -> bool;

    /// Whether a model has it.
    fn is_in(&self, one: &Candidate) -> bool;

    /// Whether it is more than what the search begins with, so that a model with it is kept.
    fn is_more(&self) -> bool {
        true
    }

    /// The model without it, where dynamics that were sought behind it may have made it needless.
    fn left_out(&self, _asked: &Options, _from: &Candidate) -> Option<Variant> {
        None
    }

    /// Whether it stands for itself in a model, if it is there. At the bounds of its search it stands for something
    /// else.
    fn stands_for_itself(&self, _: &Candidate) -> bool {
        true
    }

    /// The variants that may be tried from a candidate; none where nothing is left open, or the term is there.
    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error>;
}

/// By which factor a term must lower the objective by the derivatives at the fit without it, before it is searched at
/// all. Where there is a map in truth that is 1.4 at least, elsewhere 1.1 at most: a quarter of what it must gain is
/// asked for.
const MUST_PROMISE: f64 = 1.05;

/// How far the searched parameters may move for that promise, in their scales.
const REACH: f64 = 1.0;

/// How many passes over the records a variant may take, and the model that they are all compared with.
pub(crate) const PASSES: usize = 12;
const PASSES_OF_FIRST: usize = 30;

/// How the hysteresis and a map are searched by themselves: roughly, as a few passes with everything else follow.
const ROUNDS: [(usize, usize); 2] = [(25, 4), (6, 12)];

/// So many terms are changed one after the other at most.
const MOST_CHANGES: usize = 6;

/// A model with a variant of a term, and where its search begins.
pub(crate) struct Variant {
    pub(crate) options: Options,
    pub(crate) space: Space,
    pub(crate) starts: Vec<Point>,
    /// Whether it begins with the hysteresis that fits best by itself, too.
    pub(crate) starts_alone: bool,
    pub(crate) linear: Option<LinearEvidence>,
    /// Whether it has more than the candidate that it comes from.
    pub(crate) adds: bool,
    /// Whether its dynamics were sought behind its maps.
    pub(crate) was_sought: bool,
}

/// A model that was fitted roughly, and how it predicts.
pub(crate) struct Candidate {
    pub(crate) options: Options,
    pub(crate) place: Place,
    pub(crate) linear: Option<LinearEvidence>,
    basis: WeightBasis,
    pub(crate) fit: ProjectedFit,
    pub(crate) was_sought: bool,
    alone: CrossValidation,
    /// With the best loop shift beside it, where loops only decay or only grow: these do not tell one from another
    /// term.
    shifted: Option<CrossValidation>,
}

/// What tells models apart in the search: which rows of the table are in them, the order of their dynamics, and whether
/// there is an amplifier.
type Signature = (Vec<bool>, Option<Order>, bool);

/// What a search has seen on its way.
struct Way<'a, 'b> {
    tries: usize,
    /// The models that were followed: several ways lead to each.
    followed: Vec<Signature>,
    /// The best maps that are not there, as a loop shift would predict as well.
    untold: Option<UntoldMap>,
    trials: Vec<TermTrial>,
    monitor: &'a mut SearchMonitor<'b>,
}

/// What the search over the table ends with.
pub(crate) struct Chosen {
    pub(crate) candidate: Candidate,
    /// The best map that is not there, as a loop shift would predict as well.
    pub(crate) untold: Option<UntoldMap>,
    /// What was tried on the way.
    pub(crate) trials: Vec<TermTrial>,
}

/// What a variant must do for its place.
struct Cost {
    /// By which factor it must lower the mean square error of the candidate that it comes from.
    must_gain: f64,
    /// By which factor it must be better than another variant to be taken alone.
    must_beat: f64,
}

/// A neighbour that is better than a candidate.
struct Neighbour {
    one: Candidate,
    must_beat: f64,
    /// Where its trial stands in the list.
    trial: usize,
}

/// Where one of several ways ends.
struct End {
    one: Candidate,
    /// Where the trials of its first step and of all further ones stand in the list.
    trial: usize,
    further: Range<usize>,
}

/// Records, and what is known before terms are changed.
pub(crate) struct TermSearch<'a> {
    pub(crate) table: &'static [Row],
    pub(crate) records: &'a [Record<'a>],
    /// What was asked for.
    pub(crate) asked: &'a Options,
    /// How smooth the weights are while terms are tried.
    pub(crate) smoothness: f64,
    /// Where the hysteresis alone was fitted.
    pub(crate) plain: Point,
    pub(crate) variety: Variety,
}

impl Way<'_, '_> {
    /// The part of the work that the next try is: how many will follow is not known.
    fn next_try(&mut self) -> Span {
        let share = |tries: usize| 0.6 * (1.0 - 1.0 / (1.0 + as_f64(tries) / 4.0));
        self.tries += 1;
        Span { from: share(self.tries - 1), to: share(self.tries) }
    }
}

impl TermSearch<'_> {
    /// The model that no neighbour predicts better than, from what was found; none where no term may be added.
    pub(crate) fn choose(&self, found: &Found, monitor: &mut SearchMonitor<'_>) -> Result<Option<Chosen>, Error> {
        let Some(given) = self.with_given_maps(found) else { return Ok(None) };
        let mut way = Way { tries: 0, followed: Vec::new(), untold: None, trials: Vec::new(), monitor };
        let span = way.next_try();
        let first = self.tried(given, PASSES_OF_FIRST, span, way.monitor)?;
        let outcome = if self.leaves_something(&first) { TrialOutcome::LittleLeft } else { TrialOutcome::NothingLeft };
        way.trials = self.left_untried(&first, outcome);
        let end = self.end_of(&first, MOST_CHANGES, &mut way)?;
        // With nothing more the dynamics are those that `linear_part` weighed, unless it was told too little of those
        // that were asked for.
        let is_kept =
            |end: &Candidate| self.has_more(end) || self.needs_coupling(&end.options) || first.has_too_little();
        let kept = end.filter(is_kept);
        if kept.is_none() {
            overrule(&mut way.trials, TrialOutcome::Overruled, |_| true);
        }
        let candidate = kept.unwrap_or(first);
        let untold = way.untold.filter(|_| !candidate.place.space.has_map());
        Ok(Some(Chosen { candidate, untold, trials: way.trials }))
    }

    /// The terms that are not tried, as the first model leaves nothing, or little of loops that are all alike.
    fn left_untried(&self, first: &Candidate, outcome: TrialOutcome) -> Vec<TermTrial> {
        let is_left = |row: &&Row| {
            let is_open = row.term.is_open(self.asked, &first.options) && !row.term.is_in(first);
            is_open && (outcome == TrialOutcome::NothingLeft || self.leaves_little(first, row))
        };
        let untried = |row: &Row| TermTrial::not_tried(row.term.name(), outcome);
        self.table.iter().filter(is_left).map(untried).collect()
    }

    /// The terms that are open where a fit leaves nothing for them.
    pub(crate) fn nothing_left(&self, found: &Found) -> Vec<TermTrial> {
        let open = self.table.iter().filter(|row| row.term.is_open(self.asked, &found.options));
        open.map(|row| TermTrial::not_tried(row.term.name(), TrialOutcome::NothingLeft)).collect()
    }

    /// A trial of a term beside those of a candidate, better until it is judged.
    fn trial(&self, row: &Row, from: &Candidate, must_gain: f64) -> TermTrial {
        // What stands for two terms is told by these.
        let is_there = |other: &&Row| other.terms < 2 && other.term.is_more() && other.term.is_in(from);
        let beside = self.table.iter().filter(is_there).map(|other| other.term.name().to_owned()).collect();
        TermTrial { beside, ..TermTrial::by_stretches(row.term.name(), must_gain, TrialOutcome::Better) }
    }

    /// Whether a candidate leaves too little for a term to be tried.
    fn leaves_little(&self, from: &Candidate, row: &Row) -> bool {
        !self.variety.amplitudes && row.of_like_loops.leaves_little(self.left(from))
    }

    /// Where the search ends from a candidate, if not there: of several neighbours that are better than it, and none of
    /// them than another, each is followed that another way did not lead to, and of where they lead the best is taken;
    /// of two that are alike, the one of fewer maps or of the earlier row.
    fn end_of(&self, from: &Candidate, changes: usize, way: &mut Way<'_, '_>) -> Result<Option<Candidate>, Error> {
        if changes == 0 || self.needs_coupling(&from.options) {
            return Ok(None);
        }
        let mut ends = Vec::new();
        for (trial, next) in self.better_neighbours(from, way)? {
            let signature = self.signature(&next);
            if !way.followed.contains(&signature) {
                way.followed.push(signature);
                let first = way.trials.len();
                let end = self.end_of(&next, changes - 1, way)?.unwrap_or(next);
                ends.push(End { one: end, trial, further: first..way.trials.len() });
            }
        }
        ends.sort_by_key(|end| end.one.place.space.maps());
        let better = |best: End, end: End| {
            let is_best = is_better(&end.one.alone, &best.one.alone, self.must_gain());
            let (best, beaten) = if is_best { (end, best) } else { (best, end) };
            way.trials[beaten.trial].outcome = TrialOutcome::Beaten;
            overrule(&mut way.trials[beaten.further], TrialOutcome::Beaten, |_| true);
            best
        };
        Ok(ends.into_iter().reduce(better).map(|end| end.one))
    }

    /// Whether options have coupled plays in place of the plays that were asked for first: everything is sought with
    /// them anew.
    pub(crate) fn needs_coupling(&self, options: &Options) -> bool {
        self.asked.chooses_coupling() && !options.chooses_coupling()
    }

    /// The neighbours that are better than a candidate, those of them left out that another is better than, each with
    /// where its trial stands: what is quick to try comes first, then what is costly, then what is simpler.
    fn better_neighbours(&self, from: &Candidate, way: &mut Way<'_, '_>) -> Result<Vec<(usize, Candidate)>, Error> {
        if self.leaves_something(from) {
            for costly in [false, true] {
                let rows = self.table.iter().filter(|row| row.is_costly == costly && !self.leaves_little(from, row));
                let better = self.better_of_rows(rows, from, way)?;
                if !better.is_empty() {
                    return Ok(better);
                }
            }
        }
        Ok(self.simpler(from, way)?.into_iter().collect())
    }

    /// The same of some rows of the table.
    fn better_of_rows<'r>(
        &self,
        rows: impl Iterator<Item = &'r Row>,
        from: &Candidate,
        way: &mut Way<'_, '_>,
    ) -> Result<Vec<(usize, Candidate)>, Error> {
        let mut variants = Vec::new();
        for row in rows {
            for variant in row.term.variants(self, from, way.monitor)? {
                let cost = self.cost(row, from, variant.adds);
                let trial = way.trials.len();
                way.trials.push(self.trial(row, from, cost.must_gain));
                variants.push(((cost, trial, variant), way.next_try()));
            }
        }
        let tried = way.monitor.side_by_side(variants, |(cost, trial, variant), span, monitor| {
            Ok((cost, trial, self.tried_if_promising(variant, from, span, monitor)?))
        })?;
        let mut better: Vec<Neighbour> = Vec::new();
        for (Cost { must_gain, must_beat }, trial, one) in tried {
            let judged = one.and_then(|one| {
                way.trials[trial].gain = Some(from.typical() / one.typical());
                self.judged(one, from, must_gain, &mut way.untold)
            });
            match judged {
                Ok(one) => better.push(Neighbour { one, must_beat, trial }),
                Err(outcome) => way.trials[trial].outcome = outcome,
            }
        }
        let is_beaten =
            |one: &Neighbour| better.iter().any(|other| is_better(&other.one.alone, &one.one.alone, other.must_beat));
        let beaten: Vec<bool> = better.iter().map(is_beaten).collect();
        let mut best = Vec::new();
        for (Neighbour { one, trial, .. }, is_beaten) in better.into_iter().zip(beaten) {
            if is_beaten { way.trials[trial].outcome = TrialOutcome::Beaten } else { best.push((trial, one)) }
        }
        Ok(best)
    }

    /// A model that was tried from a candidate, or why it is no better; `untold` keeps the best map that is not told.
    fn judged(
        &self,
        one: Candidate,
        from: &Candidate,
        must_gain: f64,
        untold: &mut Option<UntoldMap>,
    ) -> Result<Candidate, TrialOutcome> {
        if !self.table.iter().all(|row| row.term.stands_for_itself(&one)) {
            return Err(TrialOutcome::StandsForOther);
        }
        // What costs something fits better, too: else it is better on stretches by chance.
        let fits = must_gain <= 1.0 || one.fit.squares < from.fit.squares;
        if !fits || !is_better(&one.alone, &from.alone, must_gain) {
            return Err(TrialOutcome::NotBetter);
        }
        let is_told = self.needs_coupling(&one.options)
            || from.shifted.as_ref().is_none_or(|shifted| is_better(&one.alone, shifted, must_gain));
        if is_told {
            return Ok(one);
        }
        if one.place.space.has_map() && !from.place.space.has_map() {
            let here = self.untold(&one, from);
            *untold = untold.filter(|best| best.gain >= here.gain).or(Some(here));
        }
        Err(TrialOutcome::NotTold)
    }

    /// Where a variant of a candidate leads, if it promises something; else why not.
    fn tried_if_promising(
        &self,
        variant: Variant,
        from: &Candidate,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Result<Candidate, TrialOutcome>, Error> {
        if variant.adds && !self.is_promising(&variant, from, span.from, monitor)? {
            return Ok(Err(TrialOutcome::NotPromising));
        }
        Ok(to_compare(self.tried(variant, PASSES, span, monitor))?.ok_or(TrialOutcome::NotFitted))
    }

    fn signature(&self, one: &Candidate) -> Signature {
        let space = &one.place.space;
        (self.table.iter().map(|row| row.term.is_in(one)).collect(), space.order(), space.has_amplifier())
    }

    /// Whether a model has a term that is sought here alone.
    fn has_more(&self, one: &Candidate) -> bool {
        self.table.iter().any(|row| row.term.is_more() && row.term.is_in(one))
    }

    /// By which factor a model must lower the mean square error of one with a term less, or with others.
    fn must_gain(&self) -> f64 {
        if self.variety.amplitudes { MUST_GAIN } else { MUST_GAIN_OF_LIKE_LOOPS }
    }

    /// What a variant of a term costs beside those of a candidate.
    fn cost(&self, row: &Row, from: &Candidate, adds: bool) -> Cost {
        let must_beat = if adds { self.must_gain() } else { MUST_GAIN }.powi(row.terms);
        let is_usual = !adds || self.variety.amplitudes;
        let of_like = || row.of_like_loops.must_gain(self.left(from), row.terms, self.has_more(from));
        Cost { must_gain: if is_usual { must_beat } else { of_like() }, must_beat }
    }

    /// The same without a map that the dynamics behind it made needless: with it the model does not predict better by
    /// its cost.
    fn simpler(&self, from: &Candidate, way: &mut Way<'_, '_>) -> Result<Option<(usize, Candidate)>, Error> {
        if !from.was_sought {
            return Ok(None);
        }
        for row in self.table {
            let Some(variant) = row.term.left_out(self.asked, from) else { continue };
            let span = way.next_try();
            let Some(one) = to_compare(self.tried(variant, PASSES, span, way.monitor))? else { continue };
            let must_gain = self.must_gain();
            if !is_better(&from.alone, &one.alone, must_gain) {
                let trial = TermTrial::by_stretches(row.term.name(), must_gain, TrialOutcome::Needless);
                way.trials.push(trial.with_gain(one.typical() / from.typical()));
                return Ok(Some((way.trials.len() - 1, one)));
            }
        }
        Ok(None)
    }

    /// What was found, with the maps that were asked for; none where there is no map and there can be none.
    fn with_given_maps(&self, found: &Found) -> Option<Variant> {
        let Found { fit, options, linear, .. } = found;
        let mut space = fit.space.clone();
        if self.asked.input_map == MapModel::Smooth {
            space = space.with_input_map();
        }
        if self.asked.output_map == MapModel::Smooth {
            space = space.with_output_map(self.output_range(&fit.space, &fit.fit));
        }
        let (options, linear, starts_alone) = (options.clone(), linear.clone(), space.has_map());
        let starts = vec![fit.fit.point];
        (starts_alone || self.is_open(found)).then_some(Variant {
            options,
            space,
            starts,
            starts_alone,
            linear,
            adds: true,
            was_sought: false,
        })
    }

    /// Whether a term may be added, and there is anything left that it may explain.
    fn is_open(&self, found: &Found) -> bool {
        self.table.iter().any(|row| row.term.is_open(self.asked, &found.options))
            && !found.fit.fit.is_exact()
            && found.problem(self.records).colour(&found.fit).is_coloured()
    }

    /// Where a variant leads, and how that predicts, with weights as smooth as suit it: those that are too smooth spoil
    /// one more than another.
    fn tried(
        &self,
        variant: Variant,
        passes: usize,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Candidate, Error> {
        let Variant { options, space, mut starts, starts_alone, linear, was_sought, .. } = variant;
        if starts_alone {
            starts.push(self.with_hysteresis_alone(&space, &options, &starts[0], monitor)?);
        }
        let basis = options.weight_basis(space.sides());
        let projection = rough(self.records, &space, &basis, self.smoothness)?;
        let fit = best_attempt(&projection, &starts, passes, span, monitor)?;
        let terms =
            |smoothness| Terms { creep: space.creep_amplitudes(), loop_shift: LoopShiftModel::Auto, smoothness };
        let stretches = Stretches::new(&projection, &fit);
        let alone = stretches.under(&options, &basis).at_best(self.asked.smoothnesses(), &terms(self.smoothness));
        drop(stretches);
        drop(projection);
        let terms = terms(alone.smoothness);
        let place = Place { space: space.about(&fit.weights), point: fit.point };
        let shifted = if self.variety.apart_from_time || !self.variety.amplitudes {
            None
        } else {
            self.shifted(&options, &place, &terms)?
        };
        Ok(Candidate { options, place, linear, basis, fit, was_sought, alone, shifted })
    }

    /// How a place predicts with the best loop shift beside it.
    fn shifted(
        &self,
        options: &Options,
        Place { space, point }: &Place,
        terms: &Terms,
    ) -> Result<Option<CrossValidation>, Error> {
        let options = Options { loop_shift: LoopShiftModel::Auto, ..options.clone() };
        let space = space.with_loop_shift(self.records, options.loop_shift)?;
        let Some(side) = space.side() else { return Ok(None) };
        let basis = options.weight_basis(space.sides());
        let projection = rough(self.records, &space, &basis, terms.smoothness)?;
        let fit = projection.fit(point, None);
        let stretches = Stretches::new(&projection, &fit);
        let under = stretches.under(&options, &basis);
        let of_one = side.filters.iter().map(|filter| LoopShiftModel::Both(filter.time_constant));
        let kinds = of_one.chain([LoopShiftModel::Auto]);
        let tried: Vec<_> = kinds.map(|loop_shift| under.cross_validate(&Terms { loop_shift, ..*terms })).collect();
        Ok(CrossValidation::best(&tried).cloned())
    }

    /// Whether a variant lowers the objective by the derivatives where it starts.
    fn is_promising(
        &self,
        variant: &Variant,
        from: &Candidate,
        fraction: f64,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<bool, Error> {
        let basis = variant.options.weight_basis(variant.space.sides());
        let Ok(projection) = rough(self.records, &variant.space, &basis, self.smoothness) else { return Ok(false) };
        for start in &variant.starts {
            let (fit, linearised) = projection.at(start);
            monitor.counted(fraction)?;
            let step = linearised.step(&variant.space.step_bounds(&fit.point, REACH), &basis);
            if step.objective * MUST_PROMISE < from.fit.objective {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Whether a fit leaves more than rounding or white noise, which no term explains.
    fn leaves_something(&self, one: &Candidate) -> bool {
        let problem = self.problem(&one.options, &one.basis);
        !one.fit.is_exact() && problem.colour_in(&one.place.space, &one.fit).is_coloured()
    }

    /// The root mean square of what a candidate leaves, as a share of the range.
    fn left(&self, one: &Candidate) -> f64 {
        one.alone.rmse / self.range()
    }

    fn range(&self) -> f64 {
        largest_range(self.records)
    }

    fn problem<'a>(&'a self, options: &'a Options, basis: &'a WeightBasis) -> JointProblem<'a> {
        JointProblem { records: self.records, options, basis, smoothness: self.smoothness }
    }

    /// The options and the space of a candidate without dynamics, and without an amplifier that was found beside them.
    pub(crate) fn without_dynamics(&self, from: &Candidate) -> Result<(Options, Space), Error> {
        let options = Options { dynamics: DynamicsModel::None, ..from.options.clone() };
        let space = Space::new(self.records, &options)?.with_maps_of(&from.place.space);
        Ok((options, space))
    }

    /// What maps would explain where a loop shift would as well.
    fn untold(&self, with: &Candidate, without: &Candidate) -> UntoldMap {
        let space = &with.place.space;
        let (in_front, behind) = (space.has_input_map(), space.has_output_map());
        let gain = (without.typical() / with.typical()).powi(2);
        let share = (without.alone.rmse.powi(2) - with.alone.rmse.powi(2)).sqrt() / self.range();
        UntoldMap { in_front, behind, gain, share }
    }

    /// A point with the hysteresis and the maps that fit best by themselves: another minimum, maybe, than the one near
    /// by.
    fn with_hysteresis_alone(
        &self,
        space: &Space,
        options: &Options,
        point: &Point,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Point, Error> {
        monitor.hold();
        let alone = options.hysteresis_alone();
        let mut of_maps = Space::new(self.records, &alone)?.with_maps_of(space);
        if !space.searches(Parameter::InputOffset) {
            of_maps = of_maps.with_known(Parameter::InputOffset, point.get(Parameter::InputOffset));
        }
        let space = of_maps;
        let basis = alone.weight_basis(space.sides());
        let levels = levels(self.records, &space, &basis, self.smoothness, true)?;
        let alone = best_of_starts(&levels[0], &ROUNDS, Span { from: 0.0, to: 0.0 }, monitor)?.point;
        Ok(Parameter::of_hysteresis().fold(*point, |point, one| point.with(one, alone.get(one))))
    }

    /// An output map over what the hysteresis puts out.
    pub(crate) fn output_range(&self, space: &Space, fit: &ProjectedFit) -> OutputMap {
        let operators = space.operators(&fit.point);
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        for (place, record) in self.records.iter().enumerate() {
            let dt = space.intervals().of_record(place);
            for h in hysteresis(&operators, &fit.weights, record.input(), 0.0, dt) {
                bounds = (bounds.0.min(h), bounds.1.max(h));
            }
        }
        OutputMap { bounds, reference: Arc::from(space.weights_of_operators(&fit.weights)) }
    }
}

impl Candidate {
    /// Whether the records told too little of the dynamics that were asked for.
    pub(crate) fn has_too_little(&self) -> bool {
        self.linear.as_ref().is_some_and(|linear| linear.too_little.is_some())
    }

    fn typical(&self) -> f64 {
        self.alone.typical_error()
    }

    /// A variant of this model in another space.
    pub(crate) fn with(&self, space: Space, starts: Vec<Point>) -> Variant {
        let (options, linear) = (self.options.clone(), self.linear.clone());
        let was_sought = self.was_sought;
        Variant { options, space, starts, starts_alone: false, linear, adds: true, was_sought }
    }

    /// This model in a space with a map more: dynamics may then be sought anew.
    pub(crate) fn with_curve(&self, space: Space) -> Variant {
        let starts_alone = !self.place.space.has_map();
        Variant { starts_alone, was_sought: false, ..self.with(space, vec![self.place.point]) }
    }
}

/// What would explain less of the range than this, rms, is not told.
const MATTERS: f64 = 2e-3;

/// Maps that the records do not tell from a loop shift.
pub(crate) fn untold_map(UntoldMap { in_front, behind, gain, share }: UntoldMap) -> Option<Finding> {
    let (maps, options, settings) = match (in_front, behind) {
        (true, true) => (
            "a map in front of the hysteresis and one behind it",
            "--input-map smooth --output-map smooth",
            "input_map=\"smooth\", output_map=\"smooth\"",
        ),
        (true, false) => ("a map in front of the hysteresis", "--input-map smooth", "input_map=\"smooth\""),
        _ => ("a map behind the hysteresis", "--output-map smooth", "output_map=\"smooth\""),
    };
    let message = format!(
        "{maps} would lower the error of prediction by {:.0} %, and so would a loop shift: loops that only decay do not tell one from the \
         other, and the result has neither",
        100.0 * (1.0 - gain.recip().sqrt())
    );
    let hint = format!(
        "add a record whose loops grow again, as those of mpi-hyst excite; or ask for it ({options}, {settings} in Python), and compare \
         on a record that was not fitted"
    );
    (share > MATTERS).then(|| Finding::new(FindingCode::MapNotTold, gain, MUST_GAIN, message).try_next(hint))
}
