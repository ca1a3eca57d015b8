//! The joint fit: hysteresis, dynamics, dead time and creep together.

use super::chain::Chain;
use super::course::Course;
use super::levels::levels;
use super::monitor::{SearchMonitor, Span};
use super::point::{Parameter, Point};
use super::projection::{Linearised, ProjectedFit};
use super::search::{best_attempt, search};
use super::space::Space;
use super::starts::starts;
use super::weight_basis::WeightBasis;
use crate::error::Error;
use crate::options::{DynamicsModel, Options, Setting};
use crate::record::Record;

/// How many passes over the records a start may take before the best of them goes on.
const PASSES: usize = 10;

/// How starts are tried: on the rows of which level, and with how many passes over the records each.
#[derive(Clone, Copy)]
pub(super) struct Attempts {
    pub(super) level: usize,
    pub(super) passes: usize,
}

/// A fit of hysteresis and linear part, and where it was searched.
#[derive(Clone)]
pub(crate) struct JointFit {
    pub(crate) space: Space,
    pub(crate) fit: ProjectedFit,
    pub(crate) linearised: Linearised,
}

impl JointFit {
    /// How many rows were fitted.
    pub(crate) fn rows(&self, records: &[Record<'_>]) -> usize {
        let unread = self.space.unread_samples();
        records.iter().map(|record| Course::new(record, 1, unread).len()).sum()
    }

    /// What it predicts; `dt` for records that have no sampling interval.
    pub(crate) fn chain(&self, dt: f64) -> Chain {
        Chain {
            operators: self.space.operators(&self.fit.point),
            weights: self.fit.weights.clone(),
            linear: self.space.linear_part(&self.fit.point),
            underway: self.fit.underway.clone(),
            creep_underway: self.space.underway().clone(),
            dt,
        }
    }

    /// The dead time in samples of the fastest record.
    pub(crate) fn dead_time_samples(&self) -> f64 {
        self.fit.point.get(Parameter::DeadTime) / self.space.intervals().smallest()
    }
}

/// Records and what is known before the linear part is searched.
#[derive(Clone, Copy)]
pub(crate) struct JointProblem<'a> {
    pub(crate) records: &'a [Record<'a>],
    /// With everything chosen that is left to cross-validation.
    pub(crate) options: &'a Options,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) smoothness: f64,
}

impl JointProblem<'_> {
    /// From the fit of the hysteresis with a dead time alone to the best of everything together.
    ///
    /// The weights stay linear: each operator's output goes through creep, dynamics and dead time before it becomes a
    /// column. Frequency, damping, dead time and creep start from the best minima of a scan behind the hysteresis found,
    /// and are then searched together with ratios and input offset.
    pub(crate) fn search(
        &self,
        plain: &ProjectedFit,
        plain_space: &Space,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let space = Space::new(self.records, self.options)?;
        monitor.forget();
        let starts = starts(self.records, plain, plain_space, &space);
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor)
    }

    /// The best fit with a dead time that is known, from a point near by.
    pub(crate) fn with_dead_time(
        &self,
        near: &JointFit,
        dead_time: f64,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let space = near.space.with_known(Parameter::DeadTime, dead_time);
        let point = space.with_lag_kept(&near.fit.point, dead_time);
        self.search_from(space, &point, monitor)
    }

    /// The best fit with a dead time in place of the dynamics, from a point near by.
    pub(crate) fn without_dynamics(&self, near: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        let space = Space::new(self.records, &Options { dynamics: DynamicsModel::None, ..self.options.clone() })?;
        let lag = near.space.linear_part(&near.fit.point).lag();
        let known = space.origin().get(Parameter::DeadTime);
        let dead_time = space.axis(Parameter::DeadTime).map_or(known, |axis| lag.clamp(axis.lower, axis.upper));
        let point = near.fit.point.with(Parameter::DeadTime, dead_time);
        self.search_from(space, &point, monitor)
    }

    /// The best fit of critically damped dynamics without a dead time, or behind the known one.
    pub(crate) fn critically_damped(
        &self,
        near: &JointFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let known = match self.options.dead_time {
            Setting::Fixed(dead_time) => dead_time,
            Setting::Fit => 0.0,
        };
        let space =
            near.space.with_one_mode().with_known(Parameter::DeadTime, known).with_known(Parameter::LogDamping, 0.0);
        let lag = near.space.linear_part(&near.fit.point).lag() - known;
        let point = space.critically_damped(&near.fit.point, lag).with(Parameter::DeadTime, known);
        self.search_from(space, &point, monitor)
    }

    /// The best fit in a space, from a point in it.
    pub(crate) fn search_from(
        &self,
        space: Space,
        point: &Point,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        self.search_starts(space, &[*point], Attempts { level: 1, passes: PASSES }, monitor)
    }

    /// The best fit in a space, from a point in it and from others with the usual ratios in place of its own.
    pub(crate) fn search_around(
        &self,
        space: Space,
        point: &Point,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let starts = space.with_other_ratios(point);
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor)
    }

    /// The best fit in a space, from the best of what a few passes make of each start.
    pub(super) fn search_starts(
        &self,
        space: Space,
        starts: &[Point],
        Attempts { level, passes }: Attempts,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let levels = levels(self.records, &space, self.basis, self.smoothness, false)?;
        // What is left is the work once the best of them is found.
        let span = Span { from: 0.0, to: 0.6 };
        let start = best_attempt(&levels[level], self.basis, starts, passes, span, monitor)?;
        let (fit, linearised) = search(&levels, self.basis, Some(&start), monitor)?;
        drop(levels);
        Ok(JointFit { space, fit, linearised })
    }

    /// The fit with the hysteresis of a point, and dynamics that are critically damped in place of its dead time.
    pub(crate) fn at_hysteresis(&self, point: &Point) -> Result<JointFit, Error> {
        let space = Space::new(self.records, self.options)?;
        self.at(&space, &space.start_at_hysteresis(point))
    }

    /// The fit at a point, without a search.
    pub(crate) fn at(&self, space: &Space, point: &Point) -> Result<JointFit, Error> {
        let levels = levels(self.records, space, self.basis, self.smoothness, false)?;
        let all = &levels[levels.len() - 1];
        let (fit, linearised) = all.at(point);
        Ok(JointFit { space: space.clone(), fit, linearised })
    }
}
