//! Whether a map in front of the hysteresis or behind it predicts better than none.

use std::sync::Arc;

use super::curve::OutputMap;
use super::folds::{CrossValidation, Stretches, Terms};
use super::joint::{JointFit, JointProblem};
use super::levels::levels;
use super::monitor::{SearchMonitor, Span};
use super::point::{Parameter, Point};
use super::response::hysteresis;
use super::search::{best_attempt, best_of_starts};
use super::space::Space;
use super::variety::Variety;
use super::weight_basis::WeightBasis;
use crate::error::Error;
use crate::loop_shift_model::LoopShiftModel;
use crate::map_model::MapModel;
use crate::options::Options;

/// How many passes over the records a map may take to find its shape: what two maps leave is compared.
const PASSES: usize = 30;

/// How the hysteresis and a map are searched by themselves: roughly, as a few passes with everything else follow.
const ROUNDS: [(usize, usize); 2] = [(25, 4), (6, 12)];

/// By which factor a map must lower the mean square error of prediction: a tenth of the error, as three more unknowns and a
/// stage that is harder to read cost something.
const MUST_GAIN: f64 = 1.2;

/// The same where loops only decay: a loop shift that they do not tell looks like a map.
const MUST_GAIN_IN_DECAY: f64 = 3.0;

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
    /// others predict better, and then the one of those that fits best. All maps have as many unknowns.
    pub(crate) fn choose(&self, found: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<Place, Error> {
        let candidates = self.candidates(found);
        if let [Maps { input: false, output: None }] = candidates[..] {
            return Ok(Place { space: found.space.clone(), point: found.fit.point });
        }
        let candidates = self.promising(candidates, found)?;
        let (mut places, mut tried, mut objectives) = (Vec::new(), Vec::new(), Vec::new());
        let (whole, count) = (Span { from: 0.0, to: 0.6 }, candidates.len());
        for (number, maps) in candidates.iter().enumerate() {
            let span = Span { from: whole.at(number, count), to: whole.at(number + 1, count) };
            let (place, validation, objective) = self.candidate(maps, found, span, monitor)?;
            tried.push(validation);
            places.push(place);
            objectives.push(objective);
        }
        let must_gain = if Variety::of(self.fitted.records).apart_from_time { MUST_GAIN } else { MUST_GAIN_IN_DECAY };
        let is_needless = CrossValidation::good(&tried, must_gain).any(|place| place == 0);
        let is_better = |place: &usize| !is_needless && tried[*place].rmse < tried[0].rmse;
        let least = |a: &usize, b: &usize| objectives[*a].total_cmp(&objectives[*b]);
        let best = (1..count).filter(is_better).min_by(least);
        Ok(places.swap_remove(best.unwrap_or(0)))
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

    /// Whether a fit leaves more than rounding or white noise, which no map explains.
    fn leaves_something(&self, found: &JointFit) -> bool {
        !found.fit.is_exact() && self.fitted.colour(found).is_coloured()
    }

    /// Where maps lead from a point, how that predicts, and what is left.
    fn candidate(
        &self,
        maps: &Maps,
        found: &JointFit,
        span: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<(Place, CrossValidation, f64), Error> {
        let JointProblem { records, options, basis, .. } = self.fitted;
        let [alone, together] = [0, 1].map(|half| Span { from: span.at(half, 2), to: span.at(half + 1, 2) });
        let space = maps.in_front_and_behind(&found.space);
        let mut starts = vec![found.fit.point];
        if !maps.is_none() {
            starts.push(self.with_hysteresis_alone(maps, found, alone, monitor)?);
        }
        let levels = levels(records, &space, basis, self.smoothness, true)?;
        let projection = &levels[levels.len() - 1];
        let fit = best_attempt(projection, basis, &starts, PASSES, together, monitor)?;
        let creep = space.creep_amplitudes();
        let terms = Terms { creep, loop_shift: LoopShiftModel::Auto, smoothness: self.smoothness };
        let validation = Stretches::new(projection, &fit).under(options, basis).cross_validate(&terms);
        drop(levels);
        Ok((Place { space, point: fit.point }, validation, fit.objective))
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
