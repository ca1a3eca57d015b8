//! Modes beside the first, searched one after the other from what the fit without them leaves.

use super::gradients::{Gradients, Quantity};
use super::joint::{Attempts, JointFit, JointProblem};
use super::linear_part::Mode;
use super::mode_scan::{are_near, candidates};
use super::monitor::SearchMonitor;
use super::point::{Axis, Parameter, Point};
use super::root::Root;
use super::space::Space;
use crate::error::Error;

/// Which share of the wanted decrease a candidate must promise: the descent sharpens it.
const PROMISED: f64 = 0.7;

/// How many passes over the records a start may take before the best of them goes on.
const PASSES: usize = 8;

impl JointProblem<'_> {
    /// The best fit with a mode more, from a point near by; none if none promises to lower the sum of squares by `wanted`.
    pub(crate) fn with_mode(
        &self,
        near: &JointFit,
        wanted: f64,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Option<JointFit>, Error> {
        let candidates = candidates(self.records, near, PROMISED * wanted);
        if candidates.is_empty() {
            return Ok(None);
        }
        let space = near.space.with_mode();
        let starts: Vec<Point> = candidates.iter().map(|one| start(&space, &near.fit.point, one.mode)).collect();
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor).map(Some)
    }

    /// How many standard errors the gain of the last mode is from 0, widened for correlated residuals; 0 where the records do not
    /// tell it.
    pub(crate) fn deviations_of_last_gain(&self, found: &JointFit) -> f64 {
        let last = found.space.modes() - 1;
        let root = Root::of(&found.fit, &found.linearised, &found.space, found.rows(self.records));
        let gradients = Gradients { fit: &found.fit, basis: self.basis, space: &found.space };
        let error = root.error_of(&gradients.of(Quantity::Gain(last))) * self.colour(found).correlation_time.sqrt();
        let gain = found.space.linear_part(&found.fit.point).modes()[last].gain;
        if error > 0.0 { gain.abs() / error } else { 0.0 }
    }

    /// The best fit with the same modes and no amplifier, from a point near by: the dead time takes over its lag.
    pub(crate) fn without_amplifier(
        &self,
        near: &JointFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let (space, point) = (near.space.without_amplifier(), near.fit.point);
        let lag = near.space.linear_part(&point).amplifier_lag();
        let point = space.axis(Parameter::DeadTime).map_or(point, |axis| {
            let dead_time = point.get(Parameter::DeadTime) + lag;
            point.with(Parameter::DeadTime, dead_time.clamp(axis.lower, axis.upper))
        });
        self.search_from(space, &point, monitor)
    }
}

/// A point with this mode as the last one, within the bounds of the search: a scan may have found it just beyond.
fn start(space: &Space, point: &Point, mode: Mode) -> Point {
    let number = space.modes() - 2;
    let values = [
        (Parameter::ModeLogFrequency(number), mode.frequency.ln()),
        (Parameter::ModeLogDamping(number), mode.damping.ln()),
        (Parameter::ModeGain(number), mode.gain),
    ];
    let within =
        |parameter, value: f64| space.axis(parameter).map_or(value, |axis| value.clamp(axis.lower, axis.upper));
    values.into_iter().fold(*point, |point, (parameter, value)| point.with(parameter, within(parameter, value)))
}

impl JointFit {
    /// Whether every mode is one of its own: apart from the others, and the further ones within the bounds of their search.
    pub(crate) fn has_distinct_modes(&self) -> bool {
        let modes = self.space.linear_part(&self.fit.point).modes();
        let is_apart = |(number, one): (usize, &Mode)| {
            modes[..number].iter().all(|other| !are_near(one.frequency, other.frequency))
        };
        let is_inside = |axis: &Axis| {
            let value = self.fit.point.get(axis.parameter);
            !axis.parameter.is_of_further_mode() || (axis.lower < value && value < axis.upper)
        };
        modes.iter().enumerate().all(is_apart) && self.space.axes().iter().all(is_inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{DynamicsModel, Options, Order};
    use crate::record::Record;

    #[test]
    fn starts_lie_within_the_bounds_of_their_search() {
        let input: Vec<f64> = (0..400).map(|k| (f64::from(k) / 9.0).sin()).collect();
        let record = Record::new(&input, &input, 0).unwrap();
        let dynamics = DynamicsModel::Order(Order::Second);
        let options = Options { dt: Some(1e-3), dynamics, ..Options::default() };
        let space = Space::new(&[record], &options).unwrap().with_mode();
        let beyond = Mode { frequency: 1.0, damping: 0.9, gain: -7.0 };
        let start = start(&space, space.origin(), beyond);
        for axis in space.axes().iter().filter(|axis| axis.parameter.is_of_further_mode()) {
            let value = start.get(axis.parameter);
            assert!((axis.lower..=axis.upper).contains(&value), "{:?} {value}", axis.parameter);
        }
    }
}
