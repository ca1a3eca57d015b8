//! An amplifier in front of the hysteresis, searched from dynamics whose dead time has its lag.

use core::f64::consts::TAU;

use super::joint::{Attempts, JointFit, JointProblem};
use super::monitor::SearchMonitor;
use super::point::{Parameter, Point};
use super::space::Space;
use crate::error::Error;

/// Which shares of the dead time and a tenth of a sample the lag of the amplifier is at the starts.
const SHARES: [f64; 3] = [0.2, 0.6, 0.95];

/// How many passes over the records a start may take before the best of them goes on.
const PASSES: usize = 6;

impl JointProblem<'_> {
    /// The best fit with an amplifier in front of the hysteresis, from a point near by.
    pub(crate) fn with_amplifier(&self, near: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        let space = near.space.with_amplifier();
        let starts = starts(&space, &near.fit.point);
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor)
    }
}

/// Points whose dead time and amplifier together have the dead time of a point.
fn starts(space: &Space, point: &Point) -> Vec<Point> {
    let within =
        |parameter, value: f64| space.axis(parameter).map_or(value, |axis| value.clamp(axis.lower, axis.upper));
    let dead_time = point.get(Parameter::DeadTime);
    let most = dead_time + 0.1 * space.intervals().smallest();
    let start = |share: f64| {
        let lag = share * most;
        let rest = if space.axis(Parameter::DeadTime).is_some() { dead_time - lag } else { dead_time };
        point
            .with(Parameter::LogBandwidth, within(Parameter::LogBandwidth, -(TAU * lag).ln()))
            .with(Parameter::DeadTime, within(Parameter::DeadTime, rest))
    };
    SHARES.into_iter().filter(|_| most > 0.0).map(start).collect()
}
