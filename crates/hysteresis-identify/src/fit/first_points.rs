//! Where a search looks first.

use hysteresis_core::Ratios;

use super::point::{Parameter, Point};
use super::space::Space;

/// Where ratios are searched first.
const USUAL_RATIOS: [Ratios; 5] = [
    Ratios::PAPER,
    Ratios { ra: 0.95, rb: 0.65, rc: 0.65 },
    Ratios { ra: 0.6, rb: 0.3, rc: 0.35 },
    Ratios { ra: 1.6, rb: 0.6, rc: 0.35 },
    Ratios::PLAY,
];

impl Space {
    /// Where to look first: all combinations of a few ratios and input offsets, as far as they are searched.
    pub(crate) fn starts(&self) -> Vec<Point> {
        let mut starts = vec![*self.origin()];
        if self.searches(Parameter::Ra) {
            starts = USUAL_RATIOS.iter().map(|ratios| self.origin().with_ratios(*ratios)).collect();
        }
        if self.searches(Parameter::InputOffset) {
            let (low, high) = self.input_bounds();
            let places = [0.5, 0.25, 0.75, 0.0, 1.0].map(|share| low + share * (high - low));
            let at = |start: &Point| places.map(|place| start.with(Parameter::InputOffset, place));
            starts = starts.iter().flat_map(at).collect();
        }
        starts
    }

    /// A point, and the same with each of the usual ratios, if they are searched.
    pub(crate) fn with_other_ratios(&self, point: &Point) -> Vec<Point> {
        let others =
            USUAL_RATIOS.iter().filter(|_| self.searches(Parameter::Ra)).map(|ratios| point.with_ratios(*ratios));
        std::iter::once(*point).chain(others).collect()
    }

    /// Dead times worth a look: doubling from one sample, if it is searched.
    pub(crate) fn dead_times(&self) -> Vec<f64> {
        let upper = self.axis(Parameter::DeadTime).map_or(0.0, |axis| axis.upper);
        let first = Some(self.intervals().smallest());
        std::iter::successors(first, |dead_time| Some(2.0 * dead_time)).take_while(|d| *d <= upper).collect()
    }
}
