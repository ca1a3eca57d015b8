//! Whether a map in front of the hysteresis or behind it predicts better than none.

mod judged;

use std::sync::Arc;

use super::curve::OutputMap;
use super::folds::{CrossValidation, Stretches, Terms};
use super::joint::{JointFit, JointProblem};
use super::levels::levels;
use super::monitor::{SearchMonitor, Span};
use super::point::{Parameter, Point};
use super::projection::{ProjectedFit, Projection};
use super::response::hysteresis;
use super::search::{best_attempt, best_of_starts};
use super::space::Space;
use super::variety::Variety;
use super::weight_basis::WeightBasis;
use crate::error::Error;
use crate::loop_shift_model::LoopShiftModel;
use crate::map_model::MapModel;
use crate::options::Options;
use crate::record::Record;
use judged::{Judged, best_of};

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

/// Where a fit is, and what is fitted there.
#[derive(Clone)]
pub(crate) struct Place {
    pub(crate) space: Space,
    pub(crate) point: Point,
}

/// The place with the maps that are chosen.
pub(crate) struct Chosen {
    pub(crate) place: Place,
    /// The best map that is not there, as a loop shift would predict as well.
    pub(crate) untold: Option<UntoldMap>,
    /// Whether any map was asked for, or promised something.
    pub(crate) were_searched: bool,
}

/// A map that decaying loops do not tell from a loop shift.
#[derive(Clone, Copy)]
pub(crate) struct UntoldMap {
    /// Whether it is in front of the hysteresis.
    pub(crate) is_input: bool,
    /// By which factor it lowers the mean square error of prediction.
    pub(crate) gain: f64,
    /// How much of the position it explains, rms, over the range.
    pub(crate) share: f64,
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
        let span = |number| Span { from: whole.at(number, count), to: whole.at(number + 1, count) };
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
    pub(crate) fn is_beaten_by(&self, one: &Place, other: &Place) -> Result<bool, Error> {
        Ok(self.judged_there(one)?.is_beaten_by(&self.judged_there(other)?, MUST_GAIN))
    }

    /// How a place predicts, without a search.
    fn judged_there(&self, place: &Place) -> Result<Judged, Error> {
        self.judged_at(place.clone(), |finest| finest.fit(&place.point, None))
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
        let levels = levels(records, &space, basis, self.smoothness, true)?;
        let (fit, linearised) = levels[levels.len() - 1].at(&found.fit.point);
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
    pub(crate) fn leaves_something(&self, found: &JointFit) -> bool {
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
        let levels = levels(records, space, basis, self.smoothness, true)?;
        let finest = &levels[levels.len() - 1];
        let fit = fit(finest);
        let stretches = Stretches::new(finest, &fit);
        let under = stretches.under(options, basis);
        let tried = self.asked.smoothnesses().iter().map(|smoothness| under.cross_validate(&terms(*smoothness)));
        let tried: Vec<_> = tried.collect();
        let best = CrossValidation::best(&tried).cloned();
        let alone = best.unwrap_or_else(|| under.cross_validate(&terms(self.smoothness)));
        drop(levels);
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
        let basis = WeightBasis::new(&options, space.shift_len());
        let levels = levels(records, &space, &basis, terms.smoothness, true)?;
        let projection = &levels[levels.len() - 1];
        let fit = projection.fit(point, None);
        let stretches = Stretches::new(projection, &fit);
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
        let [alone, together] = [0, 1].map(|half| Span { from: span.at(half, 2), to: span.at(half + 1, 2) });
        let space = maps.in_front_and_behind(&found.space);
        let mut starts = vec![found.fit.point];
        if let Some(near) = near {
            starts.push(*near);
        } else if !maps.is_none() {
            starts.push(self.with_hysteresis_alone(maps, found, alone, monitor)?);
        }
        let levels = levels(records, &space, basis, self.smoothness, true)?;
        let projection = &levels[levels.len() - 1];
        let fit = best_attempt(projection, basis, &starts, PASSES, together, monitor)?;
        drop(levels);
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
        let basis = WeightBasis::new(&options, space.shift_len());
        let levels = levels(records, &space, &basis, self.smoothness, true)?;
        let alone = best_of_starts(&levels[0], &basis, &ROUNDS, span, monitor)?.point;
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
