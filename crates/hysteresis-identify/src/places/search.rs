//! The search beside the weights: a look at starts across the drive, then bounded Gauss-Newton steps.

use std::ops::ControlFlow;

use crate::choose::duhem::no_inverse;
use crate::error::Error;
use crate::fit::response::{Chain, OperatorsAt};
use crate::judge::finding::Finding;
use crate::places::doubts::SAYS_NOTHING;
use crate::places::equations::Equations;
use crate::places::rows::Rows;
use crate::places::space::{Axis, PlacePoint, PlaceSpace};
use crate::places::weighing::{Law, RobustLoss, Scales, System, Weighed};
use crate::terms::operators::ModelKind;

/// How many starts are followed: asymmetric loops have several points that no small step leaves.
const FOLLOWED: usize = 4;

/// How many steps one of them takes at most, and how often a step is shortened.
const STEPS: usize = 25;
const SHORTENED: usize = 4;

/// A step that lowers the cost by a smaller share is the last.
const LAST: f64 = 1e-4;

/// So smooth are the weights during the search, where smoothness is left to cross-validation: it keeps what pairs do
/// not tell in place.
pub(crate) const SEARCH_SMOOTHNESS: f64 = 1e-3;

/// The share of the pairs that a look at starts counts: those that match best.
const COUNTED: f64 = 0.9;

/// The best point of a space.
pub(crate) struct FoundPlace {
    pub(crate) space: PlaceSpace,
    pub(crate) point: PlacePoint,
    pub(crate) weighed: Weighed,
    /// The pairs that said nothing to its search.
    pub(crate) uninformative: Vec<usize>,
}

impl FoundPlace {
    /// The operators, with the Duhem operator of the amplitude that was found.
    fn operators(&self) -> OperatorsAt {
        self.space.operators(&self.point, self.space.amplitude(&self.weighed.weights))
    }

    pub(crate) fn chain(&self, dt: f64) -> Chain {
        let operators = self.operators();
        let weights = self.weighed.weights[..operators.bank.len()].to_vec();
        Chain::from_rest(operators, weights, self.space.linear(&self.point), dt)
    }

    /// What there is to say of a Duhem operator that falls more than the plays rise.
    pub(crate) fn without_inverse(&self) -> Option<Finding> {
        let fall = self.operators().duhem?.steepest_fall();
        let has_identity = self.space.thresholds(&self.point).first() == Some(&0.0);
        no_inverse(if has_identity { self.weighed.weights[0] } else { 0.0 }, fall)
    }
}

/// What a search works with.
pub(crate) struct PlaceSearch<'a> {
    pub(crate) system: System<'a>,
    pub(crate) equations: Equations<'a>,
    /// The sum of squares of the drive differences of the equations.
    pub(crate) unit: f64,
    pub(crate) smoothness: f64,
}

impl PlaceSearch<'_> {
    pub(crate) fn law(&self, space: &PlaceSpace, point: &PlacePoint, smoothness: f64) -> Law {
        Law::new(space, point, smoothness, self.unit)
    }

    /// A space without the input offset where that says nothing: that of plays is where they were before the drives,
    /// and equations behind a large loop see nothing of it.
    pub(crate) fn told(&self, space: PlaceSpace) -> PlaceSpace {
        if !space.axes.contains(&Axis::InputOffset) || space.model == ModelKind::Modified {
            return space;
        }
        let (low, high) = space.bounds(Axis::InputOffset);
        let start = &space.starts()[0];
        let [below, above] = [low, high].map(|offset| self.rows_at(&space, &start.with(Axis::InputOffset, offset)));
        let tells = |(a, b): (&f64, &f64)| (a - b).abs() > SAYS_NOTHING * (high - low);
        if below.values.iter().zip(&above.values).any(tells) { space } else { space.without(Axis::InputOffset) }
    }

    /// The best point of a space, from the best of some starts.
    pub(crate) fn find(
        &self,
        space: PlaceSpace,
        starts: Vec<PlacePoint>,
        proceed: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<FoundPlace, Error> {
        let mut looked = Vec::new();
        for point in starts {
            go_on(proceed)?;
            let rows = self.rows_at(&space, &point);
            let law = self.law(&space, &point, self.smoothness);
            let weighed = self.system.robust(&rows, &law, (RobustLoss::Huber, None), self.system.first_shares());
            looked.push((self.at_first_sight(&weighed), point, weighed));
        }
        looked.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Those that differ in the dead time alone mostly end at one point.
        let mut seen: Vec<PlacePoint> = Vec::new();
        looked.retain(|(_, point, _)| {
            let is_new = !seen.iter().any(|other| space.differ_in_dead_time(point, other)) && seen.len() < FOLLOWED;
            seen.extend(is_new.then(|| point.clone()));
            is_new
        });
        let scales = looked[0].2.shares.scales;
        let mut descended = |(_, point, weighed): (f64, PlacePoint, Weighed)| {
            let (point, weighed) = self.descend(&space, point, weighed, proceed)?;
            Ok::<_, Error>((self.system.cost(&weighed, (RobustLoss::Bisquare, scales)), point, weighed))
        };
        let mut best = descended(looked.remove(0))?;
        for start in looked {
            let other = descended(start)?;
            best = if other.0 < best.0 { other } else { best };
        }
        let (_, point, weighed) = best;
        Ok(FoundPlace { space, point, weighed, uninformative: self.system.uninformative.clone() })
    }

    /// How well a start suits the pairs that suit it best, whatever the scale of the others.
    fn at_first_sight(&self, weighed: &Weighed) -> f64 {
        let mut squares: Vec<f64> = weighed.mismatches.iter().map(|e| e * e).collect();
        squares.sort_by(f64::total_cmp);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a share"
        )]
        let counted = (COUNTED * squares.len() as f64) as usize;
        let scales = weighed.shares.scales;
        let lengths =
            self.system.cost(&Weighed { mismatches: Vec::new(), ..weighed.clone() }, (RobustLoss::Huber, scales));
        // The cost has half of each square.
        squares[..counted].iter().sum::<f64>() + 2.0 * lengths * scales.pairs * scales.pairs
    }

    /// Steps from a start to the best point near it; then once more without the pairs that are far away there.
    fn descend(
        &self,
        space: &PlaceSpace,
        mut point: PlacePoint,
        mut weighed: Weighed,
        proceed: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<(PlacePoint, Weighed), Error> {
        if space.axes.is_empty() {
            return Ok((point, weighed));
        }
        for loss in [RobustLoss::Huber, RobustLoss::Bisquare] {
            let scales = weighed.shares.scales;
            let mut cost = self.system.cost(&weighed, (loss, scales));
            for _ in 0..STEPS {
                go_on(proceed)?;
                let Some((next, found, lower)) = self.step(space, (&point, &weighed), (loss, scales), cost) else {
                    break;
                };
                let share = (cost - lower) / cost;
                (point, weighed, cost) = (next, found, lower);
                if share < LAST {
                    break;
                }
            }
            let rows = self.rows_at(space, &point);
            let law = self.law(space, &point, self.smoothness);
            weighed = self.system.robust(&rows, &law, (RobustLoss::Bisquare, None), weighed.shares);
        }
        Ok((point, weighed))
    }

    /// A Gauss-Newton step that lowers the cost, shortened as often as that takes; none if nothing does.
    fn step(
        &self,
        space: &PlaceSpace,
        (point, weighed): (&PlacePoint, &Weighed),
        (loss, scales): (RobustLoss, Scales),
        cost: f64,
    ) -> Option<(PlacePoint, Weighed, f64)> {
        let rows = self.tangent_rows(space, point, &weighed.weights);
        let law = self.law(space, point, self.smoothness);
        let bounds: Vec<(f64, f64)> = space
            .axes
            .iter()
            .map(|axis| {
                let ((low, high), value, stride) = (space.bounds(*axis), point.get(*axis), space.stride(*axis));
                ((low - value).max(-stride), (high - value).min(stride))
            })
            .collect();
        let unknowns = law.unknowns(&law.triangle(&self.system, &rows, &weighed.shares), &bounds);
        let step = &unknowns[law.linear..];
        let mut length = 1.0;
        for _ in 0..SHORTENED {
            let next = space.axes.iter().zip(step).fold(point.clone(), |next, (axis, step)| {
                let (low, high) = space.bounds(*axis);
                next.with(*axis, (point.get(*axis) + length * step).clamp(low, high))
            });
            let rows = self.rows_at(space, &next);
            let law = self.law(space, &next, self.smoothness);
            let found = self.system.robust(&rows, &law, (loss, Some(scales)), weighed.shares.clone());
            let lower = self.system.cost(&found, (loss, scales));
            if lower < cost {
                return Some((next, found, lower));
            }
            length *= 0.3;
        }
        None
    }

    pub(crate) fn rows_at(&self, space: &PlaceSpace, point: &PlacePoint) -> Rows {
        self.equations.rows(&space.tangent(point, None), &space.beside(point, None))
    }

    /// The same with derivatives along the axes, at these amplitudes.
    pub(crate) fn tangent_rows(&self, space: &PlaceSpace, point: &PlacePoint, amplitudes: &[f64]) -> Rows {
        self.equations.rows(&space.tangent(point, Some(amplitudes)), &space.beside(point, Some(amplitudes)))
    }
}

fn go_on(proceed: &mut dyn FnMut() -> ControlFlow<()>) -> Result<(), Error> {
    match proceed() {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Error::Interrupted),
    }
}
