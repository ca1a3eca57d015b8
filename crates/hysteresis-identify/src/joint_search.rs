//! The search for hysteresis and linear part together, from the hysteresis alone.

use crate::colour::Colour;
use crate::creep_model::CreepModel;
use crate::error::Error;
use crate::fit::choice::Choice;
use crate::fit::dead_time::MIN_NEGATIVE_SAMPLES;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::monitor::{SearchMonitor, Span};
use crate::fit::point::Point;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;
use crate::options::Options;
use crate::record::Record;

/// Dynamics must lower the sum of squares by this many noise variances per e-fold of samples: the strongest resonance
/// that white noise feigns somewhere among N / 2 frequencies takes about 2 log(N / 2), and this is twice as much.
const MIN_EVIDENCE: f64 = 4.0;

/// The fit, and how it was found.
pub(crate) struct Found {
    pub(crate) fit: JointFit,
    /// What was chosen, and what cross-validation said.
    pub(crate) choice: Choice,
    pub(crate) basis: WeightBasis,
    pub(crate) linear: LinearEvidence,
    pub(crate) partial: bool,
}

/// What the records tell of the linear part.
#[derive(Default)]
pub(crate) struct LinearEvidence {
    /// The standard error of a dead time that was searched beside dynamics, in samples.
    pub(crate) dead_time_error: Option<f64>,
    /// The evidence for dynamics that were given up, and what noise alone may pretend.
    pub(crate) without_dynamics: Option<(f64, f64)>,
    /// How the residuals follow from each other.
    pub(crate) colour: Colour,
}

/// Everything together, from the hysteresis alone.
pub(crate) fn search_joint(
    records: &[Record<'_>],
    options: &Options,
    plain: Found,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Found, Error> {
    let Found { fit: plain, mut choice, basis, partial, .. } = plain;
    let Options { dynamics, creep, dead_time, .. } = options.clone();
    choice.options = Options { dynamics, creep, dead_time, ..choice.options };
    let (mut linear, mut gave_up) = (LinearEvidence::default(), partial);
    let fit = {
        let problem = JointProblem { records, options: &choice.options, basis: &basis, smoothness: choice.smoothness };
        let mut joint = JointSearch { problem, plain, best: None };
        let searched = if partial { Err(Error::Interrupted) } else { joint.search(&mut linear, monitor) };
        let fit = match searched {
            Err(Error::Interrupted) if partial || monitor.keeps_best() => {
                gave_up = true;
                joint.best_so_far(monitor.kept().filter(|_| !partial))?
            }
            searched => searched?,
        };
        linear.colour = joint.problem.colour(&fit);
        fit
    };
    if linear.without_dynamics.is_some() {
        choice.options.dynamics = None;
    }
    Ok(Found { fit, choice, basis, linear, partial: gave_up })
}

/// The joint problem, and what is known of its solution.
struct JointSearch<'a> {
    problem: JointProblem<'a>,
    /// The fit of hysteresis and dead time.
    plain: JointFit,
    /// The best joint point, once there is one.
    best: Option<Point>,
}

impl JointSearch<'_> {
    fn search(&mut self, linear: &mut LinearEvidence, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        monitor.begin(Span { from: 0.4, to: 0.9 });
        let found = self.problem.search(&self.plain.fit, &self.plain.space, monitor)?;
        self.best = Some(found.fit.point);
        monitor.begin(Span { from: 0.9, to: 1.0 });
        let (fit, dead_time_error) = self.problem.settle_dead_time(found, monitor)?;
        linear.dead_time_error = dead_time_error;
        if fit.dead_time_samples() >= -MIN_NEGATIVE_SAMPLES {
            return Ok(fit);
        }
        let (without, evidence) = self.without_dynamics(&fit, monitor)?;
        let needed = MIN_EVIDENCE * as_f64(fit.rows(self.problem.records)).ln();
        if evidence >= needed {
            return Ok(fit);
        }
        *linear = LinearEvidence { without_dynamics: Some((evidence, needed)), ..LinearEvidence::default() };
        Ok(without)
    }

    /// The fit without dynamics, and by how many variances of the noise those lower the sum of squares.
    ///
    /// Dynamics that are infinitely fast answer within a sample: with a dead time of -1 they are no dynamics at all.
    fn without_dynamics(&self, fit: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<(JointFit, f64), Error> {
        let options = Options { dynamics: None, ..self.problem.options.clone() };
        let problem = JointProblem { options: &options, ..self.problem };
        let without = if options.creep == CreepModel::None {
            problem.at(&Space::new(problem.records, &options)?, &self.plain.fit.point)?
        } else {
            problem.search(&self.plain.fit, &self.plain.space, monitor)?
        };
        let noise = fit.fit.squares / as_f64(fit.rows(problem.records)) * self.problem.colour(fit).correlation_time;
        let evidence = (without.fit.squares - fit.fit.squares) / noise;
        Ok((without, evidence))
    }

    /// The best until a search was stopped: at a joint point, or with the hysteresis of the plain fit.
    fn best_so_far(&self, joint: Option<Point>) -> Result<JointFit, Error> {
        let space = Space::new(self.problem.records, self.problem.options)?;
        let point = self.best.or(joint).unwrap_or_else(|| space.from_hysteresis(&self.plain.fit.point));
        self.problem.at(&space, &point)
    }
}
