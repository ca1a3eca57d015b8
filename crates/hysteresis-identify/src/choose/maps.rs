//! Whether a map in front of the hysteresis or behind it predicts better than none, and whether a lag of first order beside it does.
//!
//! While the curve is not in the model a lag explains little more than a dead time does: a map may hide it.

use std::sync::Arc;

use crate::choose::cross_validation::{CrossValidation, Stretches, Terms};
use crate::choose::found::{Found, LinearEvidence, Place, UntoldMap};
use crate::choose::linear_part::{are_inside, search_lag, to_compare};
use crate::choose::told::Variety;
use crate::error::Error;
use crate::fit::descent::{best_attempt, best_of_starts};
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::{ProjectedFit, Projection, levels, rough};
use crate::fit::response::hysteresis;
use crate::fit::space::Space;
use crate::judge::finding::{Finding, FindingCode};
use crate::options::Options;
use crate::records::record::Record;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::{MapModel, OutputMap};

/// How many passes over the records a map may take to find its shape: what two maps leave is compared.
const PASSES: usize = 30;

/// How the hysteresis and a map are searched by themselves: roughly, as a few passes with everything else follow.
const ROUNDS: [(usize, usize); 2] = [(25, 4), (6, 12)];

/// By which factor a map must lower the mean square error of prediction: a tenth of the error, as three more unknowns and a
/// stage that is harder to read cost something.
pub(crate) const MUST_GAIN: f64 = 1.2;

/// The same for a map on the other side as well: a sixth of the error. What one map lacks of the true one the other takes up.
const OTHER_MUST_GAIN: f64 = 1.4;

/// By which factor a map must lower the objective by the derivatives at the fit without it, before it is searched at all. Where
/// there is a map in truth that is 1.4 at least, elsewhere 1.1 at most: a quarter of what it must gain is asked for.
const MUST_PROMISE: f64 = 1.05;

/// How far the searched parameters may move for that promise, in their scales.
const REACH: f64 = 1.0;

/// The place with the maps that are chosen.
pub(crate) struct Chosen {
    pub(crate) place: Place,
    /// The best map that is not there, as a loop shift would predict as well.
    pub(crate) untold: Option<UntoldMap>,
    /// Whether any map was asked for, or promised something.
    were_searched: bool,
}

/// Records, and what is known before maps are searched.
pub(crate) struct MapProblem<'a> {
    /// What was fitted.
    pub(crate) fitted: JointProblem<'a>,
    /// What was asked for.
    pub(crate) asked: &'a Options,
    /// How smooth the weights are while maps are tried.
    pub(crate) smoothness: f64,
}

/// The maps of one candidate.
struct Maps {
    input: bool,
    output: Option<OutputMap>,
}

impl Maps {
    fn is_none(&self) -> bool {
        !self.input && self.output.is_none()
    }

    /// A space with these maps.
    fn in_front_and_behind(&self, space: &Space) -> Space {
        let space = if self.input { space.with_input_map() } else { space.clone() };
        self.output.iter().fold(space, |space, map| space.with_output_map(map.clone()))
    }
}

impl MapProblem<'_> {
    /// The best place with the maps that were asked for, or as cross-validation asks for them: the one without a map unless
    /// others predict better, and then the one of those that predicts best; with both maps if that predicts better still.
    pub(crate) fn choose(&self, found: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<Chosen, Error> {
        let candidates = self.candidates(found);
        if let [Maps { input: false, output: None }] = candidates[..] {
            let place = Place { space: found.space.clone(), point: found.fit.point };
            return Ok(Chosen { place, untold: None, were_searched: false });
        }
        let candidates = self.promising(candidates, found)?;
        let (whole, count) = (Span { from: 0.0, to: 0.6 }, candidates.len() + 1);
        let span = |number| whole.part(number, count);
        if let [only] = &candidates[..] {
            let (place, _) = self.searched(only, found, None, whole, monitor)?;
            return Ok(Chosen { place, untold: None, were_searched: !only.is_none() });
        }
        let mut judged = Vec::with_capacity(candidates.len());
        for (number, maps) in candidates.iter().enumerate() {
            judged.push(self.judged(maps, found, None, span(number), monitor)?);
        }
        let without = &judged[0];
        let Some(best) = best_of(&judged, |one| without.is_beaten_by(one, MUST_GAIN)) else {
            let untold = best_of(&judged, |one| without.is_beaten_alone_by(one, MUST_GAIN));
            let untold = untold.map(|place| self.untold(&candidates[place], &judged[place].alone, &without.alone));
            return Ok(Chosen { place: judged.swap_remove(0).place, untold, were_searched: true });
        };
        let best = judged.swap_remove(best);
        let both = self.both(&best, found, span(count - 1), monitor)?;
        let both = both.filter(|both| best.is_beaten_by(both, OTHER_MUST_GAIN));
        Ok(Chosen { place: both.unwrap_or(best).place, untold: None, were_searched: true })
    }

    /// Whether one place predicts worse than another by a clear margin.
    fn is_beaten_by(&self, one: &Place, other: &Place) -> Result<bool, Error> {
        Ok(self.judged_there(one)?.is_beaten_by(&self.judged_there(other)?, MUST_GAIN))
    }

    /// How a place predicts, without a search.
    fn judged_there(&self, place: &Place) -> Result<Judged, Error> {
        self.judged_at(place.clone(), |projection| projection.fit(&place.point, None))
    }

    /// Both maps, if both are left open; `one` is the better of them.
    fn both(
        &self,
        one: &Judged,
        found: &JointFit,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Option<Judged>, Error> {
        let Options { input_map: MapModel::Auto, output_map: MapModel::Auto, .. } = self.asked else { return Ok(None) };
        let both = Maps { input: true, output: Some(self.output_map(found)) };
        self.judged(&both, found, Some(&one.place.point), span, monitor).map(Some)
    }

    /// The candidates, the one of the fewest maps first.
    fn candidates(&self, found: &JointFit) -> Vec<Maps> {
        let Options { input_map, output_map, .. } = self.asked;
        let with =
            |(input, has_output): (bool, bool)| Maps { input, output: has_output.then(|| self.output_map(found)) };
        let given = (*input_map == MapModel::Smooth, *output_map == MapModel::Smooth);
        let is_open = |map: &MapModel| *map == MapModel::Auto;
        let is_tried = (is_open(output_map) || is_open(input_map)) && self.leaves_something(found);
        let output = (is_open(output_map) && is_tried).then_some((given.0, true));
        let input = (is_open(input_map) && is_tried).then_some((true, given.1));
        [Some(given), output, input].into_iter().flatten().map(with).collect()
    }

    /// The first candidate, and the others that are worth a search.
    fn promising(&self, candidates: Vec<Maps>, found: &JointFit) -> Result<Vec<Maps>, Error> {
        let mut promising = Vec::with_capacity(candidates.len());
        for maps in candidates {
            if promising.is_empty() || self.is_promising(&maps, found)? {
                promising.push(maps);
            }
        }
        Ok(promising)
    }

    /// Whether maps lower the objective by the derivatives at the fit without them.
    fn is_promising(&self, maps: &Maps, found: &JointFit) -> Result<bool, Error> {
        let JointProblem { records, basis, .. } = self.fitted;
        let space = maps.in_front_and_behind(&found.space);
        let (fit, linearised) = rough(records, &space, basis, self.smoothness)?.at(&found.fit.point);
        let step = linearised.step(&space.step_bounds(&fit.point, REACH), basis);
        Ok(step.objective * MUST_PROMISE < fit.objective)
    }

    /// What maps would explain where a loop shift would as well.
    fn untold(&self, maps: &Maps, with: &CrossValidation, without: &CrossValidation) -> UntoldMap {
        let is_input = maps.input && self.asked.input_map == MapModel::Auto;
        let gain = (without.typical_error() / with.typical_error()).powi(2);
        let range = self.fitted.records.iter().map(Record::output_range).fold(0.0, f64::max);
        UntoldMap { is_input, gain, share: (without.rmse.powi(2) - with.rmse.powi(2)).sqrt() / range }
    }

    /// Whether a fit leaves more than rounding or white noise, which no map explains.
    fn leaves_something(&self, found: &JointFit) -> bool {
        !found.fit.is_exact() && self.fitted.colour(found).is_coloured()
    }

    /// Where maps lead, and how that predicts with weights as smooth as suit it: those that are too smooth spoil one more than another.
    fn judged(
        &self,
        maps: &Maps,
        found: &JointFit,
        near: Option<&Point>,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Judged, Error> {
        let (place, fit) = self.searched(maps, found, near, span, monitor)?;
        self.judged_at(place, |_| fit)
    }

    /// How the fit at a place predicts.
    fn judged_at(&self, place: Place, fit: impl FnOnce(&Projection<'_>) -> ProjectedFit) -> Result<Judged, Error> {
        let JointProblem { records, options, basis, .. } = self.fitted;
        let space = &place.space;
        let terms =
            |smoothness| Terms { creep: space.creep_amplitudes(), loop_shift: LoopShiftModel::Auto, smoothness };
        let projection = rough(records, space, basis, self.smoothness)?;
        let fit = fit(&projection);
        let stretches = Stretches::new(&projection, &fit);
        let alone = stretches.under(options, basis).at_best(self.asked.smoothnesses(), &terms(self.smoothness));
        drop(projection);
        let tells_shift = Variety::of(records).apart_from_time;
        let shifted = if tells_shift { None } else { self.shifted(&place, &terms(alone.smoothness))? };
        Ok(Judged { place, alone, shifted })
    }

    /// How a place predicts with the best loop shift beside it.
    fn shifted(&self, Place { space, point }: &Place, terms: &Terms) -> Result<Option<CrossValidation>, Error> {
        let records = self.fitted.records;
        let options = Options { loop_shift: LoopShiftModel::Auto, ..self.fitted.options.clone() };
        let space = space.with_loop_shift(records, options.loop_shift)?;
        let Some(shift) = space.shift() else { return Ok(None) };
        let basis = options.weight_basis(space.shift_len());
        let projection = rough(records, &space, &basis, terms.smoothness)?;
        let fit = projection.fit(point, None);
        let stretches = Stretches::new(&projection, &fit);
        let under = stretches.under(&options, &basis);
        let of_one = shift.filters.iter().map(|filter| LoopShiftModel::Both(filter.time_constant));
        let kinds = of_one.chain([LoopShiftModel::Auto]);
        let tried: Vec<_> = kinds.map(|loop_shift| under.cross_validate(&Terms { loop_shift, ..*terms })).collect();
        Ok(CrossValidation::best(&tried).cloned())
    }

    /// Where maps lead: from the fit without them, and from a point near by, or else from where hysteresis and maps lead by themselves.
    fn searched(
        &self,
        maps: &Maps,
        found: &JointFit,
        near: Option<&Point>,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<(Place, ProjectedFit), Error> {
        let JointProblem { records, basis, .. } = self.fitted;
        let [alone, together] = [0, 1].map(|half| span.part(half, 2));
        let space = maps.in_front_and_behind(&found.space);
        let mut starts = vec![found.fit.point];
        if let Some(near) = near {
            starts.push(*near);
        } else if !maps.is_none() {
            starts.push(self.with_hysteresis_alone(maps, found, alone, monitor)?);
        }
        let projection = rough(records, &space, basis, self.smoothness)?;
        let fit = best_attempt(&projection, &starts, PASSES, together, monitor)?;
        drop(projection);
        Ok((Place { space, point: fit.point }, fit))
    }

    /// A point with the hysteresis and the maps that fit best by themselves: another minimum, maybe, than the one near by.
    fn with_hysteresis_alone(
        &self,
        maps: &Maps,
        found: &JointFit,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Point, Error> {
        let (records, options) = (self.fitted.records, self.fitted.options.hysteresis_alone());
        let space = maps.in_front_and_behind(&Space::new(records, &options)?);
        let basis = options.weight_basis(space.shift_len());
        let levels = levels(records, &space, &basis, self.smoothness, true)?;
        let alone = best_of_starts(&levels[0], &ROUNDS, span, monitor)?.point;
        let with_alone = |point: Point, parameter| point.with(parameter, alone.get(parameter));
        Ok(Parameter::of_hysteresis().fold(found.fit.point, with_alone))
    }

    /// An output map over what the hysteresis puts out.
    fn output_map(&self, found: &JointFit) -> OutputMap {
        let operators = found.space.operators(&found.fit.point);
        let weights = &found.fit.weights;
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        for (place, record) in self.fitted.records.iter().enumerate() {
            let dt = found.space.intervals().of_record(place);
            for h in hysteresis(&operators, weights, record.input(), 0.0, dt) {
                bounds = (bounds.0.min(h), bounds.1.max(h));
            }
        }
        OutputMap { bounds, reference: Arc::from(&weights[..operators.bank.len()]) }
    }
}

/// Where a candidate leads, and how it predicts.
struct Judged {
    place: Place,
    alone: CrossValidation,
    /// With the best loop shift beside it, where loops only decay: they do not tell one from a map.
    shifted: Option<CrossValidation>,
}

impl Judged {
    /// Whether one with a map more predicts better by this factor of the mean square error, whether this one has a loop shift or not.
    fn is_beaten_by(&self, other: &Self, must_gain: f64) -> bool {
        self.is_beaten_alone_by(other, must_gain)
            && self.shifted.as_ref().is_none_or(|shifted| is_better(&other.alone, shifted, must_gain))
    }

    /// The same while this one has no loop shift.
    fn is_beaten_alone_by(&self, other: &Self, must_gain: f64) -> bool {
        is_better(&other.alone, &self.alone, must_gain)
    }
}

/// The place of the one that predicts best, of those that may be taken.
fn best_of(judged: &[Judged], may_be_taken: impl Fn(&Judged) -> bool) -> Option<usize> {
    let typical = |place: &usize| judged[*place].alone.typical_error();
    let taken = (0..judged.len()).filter(|place| may_be_taken(&judged[*place]));
    taken.min_by(|a, b| typical(a).total_cmp(&typical(b)))
}

/// Whether one predicts better than another by this factor of the mean square error, and by more than chance.
fn is_better(one: &CrossValidation, other: &CrossValidation, must_gain: f64) -> bool {
    let pair = [other.clone(), one.clone()];
    one.rmse < other.rmse && CrossValidation::good(&pair, must_gain).all(|place| place != 0)
}

/// A dead time of fewer samples stands for no lag that the records tell from it.
const LEAST_SAMPLES: f64 = 1.0;

/// What the search for maps has done of its part when it ends.
const AFTER_MAPS: f64 = 0.3;

/// The maps that are chosen; with a lag in the place of the dead time, and what the records tell of it, if that with maps of its own
/// predicts better by a clear margin.
pub(crate) fn maps_and_lag(
    maps: &MapProblem<'_>,
    found: &Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Chosen, Option<LinearEvidence>), Error> {
    let chosen = maps.choose(&found.fit, monitor)?;
    let Place { space, point } = &chosen.place;
    if !may_hide_lag(maps, found, &chosen) || !maps.leaves_something(&maps.fitted.at(space, point)?) {
        return Ok((chosen, None));
    }
    // The part of the work before is done: progress does not go back.
    monitor.hold();
    let better = to_compare(better_lag(maps, found, &chosen.place, monitor))?.flatten();
    Ok(better.map_or((chosen, None), |(beside, told)| (beside, Some(told))))
}

/// A lag with maps of its own, if that predicts better than what was chosen.
fn better_lag(
    maps: &MapProblem<'_>,
    found: &Found,
    chosen: &Place,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Option<(Chosen, LinearEvidence)>, Error> {
    let (lag, dead_time_error) = monitor.nested(|monitor| {
        monitor.begin(Span { from: AFTER_MAPS, to: AFTER_MAPS });
        search_lag(&maps.fitted, &found.fit, monitor)
    })?;
    monitor.begin_structure();
    let beside = maps.choose(&lag, monitor)?;
    let Place { space, point } = &beside.place;
    let is_better = are_inside(space, point) && maps.is_beaten_by(chosen, &beside.place)?;
    Ok(is_better.then_some((beside, LinearEvidence { dead_time_error, ..LinearEvidence::default() })))
}

/// Whether dynamics were left open and are not told, there may be a map, and a dead time may stand for a lag: without the map, or with
/// it, as before the hysteresis and creep may stand for the lag instead.
fn may_hide_lag(maps: &MapProblem<'_>, found: &Found, chosen: &Chosen) -> bool {
    let JointFit { space, fit, .. } = &found.fit;
    let is_open = maps.asked.dynamics == DynamicsModel::Auto && found.linear.is_some() && found.told_alone.is_none();
    let [before, beside] = [&fit.point, &chosen.place.point].map(|point| point.get(Parameter::DeadTime));
    let may_be_lag = space.order().is_none() && before.max(beside) > LEAST_SAMPLES * space.intervals().smallest();
    is_open && may_be_lag && chosen.were_searched
}

/// What would explain less of the range than this, rms, is not told.
const MATTERS: f64 = 2e-3;

/// A map that the records do not tell from a loop shift.
pub(crate) fn untold_map(UntoldMap { is_input, gain, share }: UntoldMap) -> Option<Finding> {
    let (name, option, place) = if is_input {
        ("input_map", "--input-map", "in front of the hysteresis")
    } else {
        ("output_map", "--output-map", "behind the hysteresis")
    };
    let message = format!(
        "a map {place} would lower the error of prediction by {:.0} %, and so would a loop shift: loops that only decay do not tell one \
         from the other, and the result has neither",
        100.0 * (1.0 - gain.recip().sqrt())
    );
    let hint = format!(
        "add a record whose loops grow again, as those of mpi-hyst excite; or ask for the map ({option} smooth, {name}=\"smooth\" in \
         Python), and compare on a record that was not fitted"
    );
    (share > MATTERS).then(|| Finding::new(FindingCode::MapNotTold, gain, MUST_GAIN, message).try_next(hint))
}
