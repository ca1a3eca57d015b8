//! The dynamics beside a gain of every record's own.
//!
//! Hysteresis that is not quite that of the model answers small movements with another gain than large ones: a sweep of 1 % of the
//! range with 16 % more or less. With one gain for all records, damping, bandwidth and dead time stand in for the difference, as
//! the height of a resonance is gain / (2 damping). Beside a gain of each record's own they are told by the shape of its answer.

use faer::Mat;

use super::bounded::solve;
use super::factor::TriangularFactor;
use super::joint::{JointFit, JointProblem};
use super::monitor::SearchMonitor;
use super::own_columns::below_own;
use super::point::Point;
use super::projection::Projection;
use crate::error::Error;
use crate::numeric::as_f64;

/// How many passes over the records the steps may take.
const PASSES: usize = 12;

/// A step that promises a smaller share of the sum of squares is not worth a pass.
const MIN_GAIN: f64 = 1e-7;

/// The trust region of the first step, in scales of the axes.
const FIRST_RADIUS: f64 = 0.25;

/// A record is never taken for less noisy than this share of the noisiest.
const MIN_NOISE_SHARE: f64 = 1e-3;

impl JointProblem<'_> {
    /// The fit with the dynamics that are told beside a gain of every record's own, and everything else as it suits them.
    ///
    /// A single record has the gain of the model anyway, and what leaves white noise has one gain: there it is the same fit.
    pub(crate) fn with_own_gains(&self, found: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        let is_open = self.records.len() > 1 && found.space.order().is_some() && !found.fit.is_exact();
        if !is_open || !self.colour(found).is_coloured() {
            return Ok(found.clone());
        }
        let point = self.dynamics_beside_gains(found);
        let dynamics = found.space.searching_dynamics_alone(&point);
        let known = dynamics.axes().iter().fold(found.space.clone(), |space, axis| {
            let value = point.get(axis.parameter);
            space.with_known(axis.parameter, value)
        });
        let rest = self.search_from(known, &point, monitor)?;
        self.at(&found.space, &rest.fit.point)
    }

    /// The point of a fit with the dynamics that leave least beside the gains, at its hysteresis and its weights.
    fn dynamics_beside_gains(&self, found: &JointFit) -> Point {
        let space = found.space.searching_dynamics_alone(&found.fit.point);
        let gains = RecordGains {
            projection: Projection::new(self.records, &space, self.basis, self.smoothness, 1),
            weights: &found.fit.weights,
            noises: self.noises(found),
        };
        let all: Vec<usize> = (0..space.axes().len()).collect();
        let (mut here, mut radius) = (gains.at(found.fit.point), FIRST_RADIUS);
        for _ in 0..PASSES {
            let step = solve(here.a.as_ref(), &here.b, &space.step_bounds(&here.point, radius), &all);
            if here.squares - step.squares <= MIN_GAIN * here.squares {
                break;
            }
            let there = gains.at(space.moved(&here.point, &step.x));
            if there.squares < here.squares {
                here = there;
            } else {
                radius *= 0.25;
            }
        }
        here.point
    }

    /// The root mean square of what a fit leaves of every record.
    fn noises(&self, found: &JointFit) -> Vec<f64> {
        let rms = |residual: Vec<f64>| (residual.iter().map(|e| e * e).sum::<f64>() / as_f64(residual.len())).sqrt();
        let noises: Vec<f64> = self.residuals(found).map(rms).collect();
        let most = noises.iter().copied().fold(0.0, f64::max);
        noises.into_iter().map(|noise| noise.max(MIN_NOISE_SHARE * most)).collect()
    }
}

/// Records that each have a gain of their own, and count by their noise.
struct RecordGains<'a> {
    projection: Projection<'a>,
    weights: &'a [f64],
    noises: Vec<f64>,
}

/// What the dynamics of a point leave beside the best gains: the derivatives along the axes, and the residual.
struct Left {
    point: Point,
    a: Mat<f64>,
    b: Vec<f64>,
    squares: f64,
}

impl RecordGains<'_> {
    fn at(&self, point: Point) -> Left {
        let (projection, weights) = (&self.projection, self.weights);
        let tangent = projection.space().tangent(&point, weights.len(), Some(weights));
        let (own, slopes) = (projection.own(), tangent.slopes.len());
        // [the records' own | their gains | derivatives | residual]
        let told = own + self.noises.len();
        let mut factor = TriangularFactor::new(told + slopes + 1);
        let mut row = vec![0.0; told + slopes + 1];
        for (place, noise) in self.noises.iter().enumerate() {
            projection.rows_of(place, &tangent, |_, values| {
                let (of_record, values) = values.split_at(own);
                let (columns, values) = values.split_at(weights.len());
                let output: f64 = columns.iter().zip(weights).map(|(column, weight)| column * weight).sum();
                row[..own].copy_from_slice(of_record);
                row[own..told].fill(0.0);
                row[own + place] = output;
                row[told..].copy_from_slice(values);
                row[told + slopes] -= output;
                for value in &mut row {
                    *value /= noise;
                }
                factor.push(&row);
            });
        }
        let (a, b) = below_own(&factor.finish(), told);
        Left { point, squares: b.iter().map(|e| e * e).sum(), a, b }
    }
}
