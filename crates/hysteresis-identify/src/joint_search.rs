//! The search for hysteresis and linear part together, from the hysteresis alone.

use crate::amplifier_model::AmplifierModel;
use crate::colour::Colour;
use crate::error::Error;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::monitor::{SearchMonitor, Span};
use crate::fit::point::{Parameter, Point};
use crate::fit::space::Space;
use crate::modes_model::ModesModel;
use crate::numeric::as_f64;
use crate::options::{DynamicsModel, Options, Order, Setting};
use crate::record::Record;

/// Dynamics must lower the sum of squares by this many noise variances per e-fold of samples: the strongest resonance
/// that white noise looks like, somewhere among N / 2 frequencies, takes about 2 log(N / 2), and this is twice as much.
const MIN_EVIDENCE: f64 = 4.0;

/// A mode that is not asked for must lower the sum of squares to this share, the error by three tenths: what a model of hysteresis or
/// creep leaves may look like a faint mode.
const MOST_LEFT_BY_MODE: f64 = 0.5;

/// By how many noise variances dynamics may fit worse than a dead time alone and still stand for the lag, as they were asked
/// for: two standard deviations.
const SAME_EVIDENCE: f64 = 4.0;

/// What the records tell of the linear part.
#[derive(Clone, Default)]
pub(crate) struct LinearEvidence {
    /// The standard error of a dead time that was searched beside dynamics, in samples.
    pub(crate) dead_time_error: Option<f64>,
    /// By how many samples an amplifier that is not told from a dead time would change the latter.
    pub(crate) amplifier_instead: f64,
    /// The evidence for dynamics, if it is too little, and what noise alone may pretend.
    pub(crate) too_little: Option<(f64, f64)>,
    /// Where fewer modes were found than were asked for.
    pub(crate) untold_modes: Option<UntoldModes>,
    /// How the residuals follow from each other.
    pub(crate) colour: Colour,
}

/// Modes that the records do not tell.
#[derive(Clone, Copy)]
pub(crate) struct UntoldModes {
    pub(crate) asked: usize,
    /// The evidence for another one than were found, and what noise alone may pretend; the former is 0 where there is no such mode.
    pub(crate) evidence: f64,
    pub(crate) needed: f64,
}

/// Hysteresis and linear part together, and what the records tell of the latter; and whether the search was stopped and this is
/// the best so far.
pub(crate) struct FoundJoint {
    pub(crate) fit: JointFit,
    pub(crate) linear: LinearEvidence,
    pub(crate) partial: bool,
}

/// Everything together, from the hysteresis alone; `is_open` is whether dynamics may be left out.
pub(crate) fn search_joint(
    problem: JointProblem<'_>,
    plain: JointFit,
    is_open: bool,
    monitor: &mut SearchMonitor<'_>,
) -> Result<FoundJoint, Error> {
    let mut linear = LinearEvidence::default();
    let mut joint = JointSearch { problem, plain, is_open, best: None };
    let (fit, partial) = match joint.search(&mut linear, monitor) {
        Err(Error::Interrupted) if monitor.keeps_best() => (joint.best_so_far(monitor.kept().as_ref())?, true),
        searched => (searched?, false),
    };
    Ok(FoundJoint { fit, linear, partial })
}

/// A fit with one parameter for its lag, and by how many variances of the noise dynamics lower the sum of squares below it.
struct Simple {
    fit: JointFit,
    evidence: f64,
}

/// The joint problem, and what is known of its solution.
struct JointSearch<'a> {
    problem: JointProblem<'a>,
    /// The fit of hysteresis and dead time.
    plain: JointFit,
    /// Whether dynamics may be left out.
    is_open: bool,
    /// The best joint point, once there is one.
    best: Option<Point>,
}

impl JointSearch<'_> {
    fn search(&mut self, linear: &mut LinearEvidence, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        monitor.begin(Span { from: 0.3, to: 0.6 });
        let found = self.problem.search(&self.plain.fit, &self.plain.space, monitor)?;
        self.best = Some(found.fit.point);
        let found = self.with_amplifier_if_told(found, linear, Span { from: 0.6, to: 0.63 }, monitor)?;
        let found = self.with_modes_if_told(found, linear, monitor)?;
        monitor.begin(Span { from: 0.68, to: 0.7 });
        let (fit, dead_time_error) = self.problem.settle_dead_time(found, monitor)?;
        linear.dead_time_error = dead_time_error;
        if self.is_open {
            return self.without_needless_dynamics(fit, linear, monitor);
        }
        let Some(simple) = self.simple(&fit, monitor)? else { return Ok(fit) };
        let needed = self.needed_evidence(&fit);
        if simple.evidence >= needed {
            return Ok(fit);
        }
        linear.too_little = Some((simple.evidence, needed));
        if simple.fit.space.order().is_none() {
            linear.dead_time_error = None;
        }
        Ok(simple.fit)
    }

    /// The fit, or that with an amplifier in front of the hysteresis if the records tell one.
    fn with_amplifier_if_told(
        &self,
        found: JointFit,
        linear: &mut LinearEvidence,
        part: Span,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let is_open = self.problem.options.amplifier == AmplifierModel::Auto && !found.fit.is_exact();
        if !is_open || found.space.order() != Some(Order::Second) || found.dead_time_samples() <= 0.0 {
            return Ok(found);
        }
        monitor.begin(part);
        let with = self.problem.with_amplifier(&found, monitor)?;
        let evidence = self.evidence(&found, &with);
        if evidence >= self.needed_evidence(&with) {
            return Ok(with);
        }
        linear.amplifier_instead = (with.dead_time_samples() - found.dead_time_samples()).abs();
        Ok(found)
    }

    /// The fit, or that with as many modes as the records tell.
    fn with_modes_if_told(
        &self,
        mut found: JointFit,
        linear: &mut LinearEvidence,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let modes = self.problem.options.modes;
        let (first, whole) = (found.space.modes(), Span { from: 0.63, to: 0.66 });
        while (1..modes.most()).contains(&found.space.modes()) {
            let (number, needed) = (found.space.modes(), self.needed_evidence(&found));
            monitor.begin(Span { from: whole.at(number - 1, modes.most()), to: whole.at(number, modes.most()) });
            let wanted = needed * self.noise(&found);
            let with = if found.fit.is_exact() { None } else { self.problem.with_mode(&found, wanted, monitor)? };
            let told = with.as_ref().filter(|with| with.has_distinct_modes());
            let evidence = told.map_or(0.0, |with| self.evidence_for_mode(&found, with));
            match with {
                Some(with) if evidence >= needed && self.is_worth_a_mode(&found, &with) => found = with,
                _ => {
                    let is_asked = matches!(modes, ModesModel::Number(_));
                    linear.untold_modes = is_asked.then_some(UntoldModes { asked: modes.most(), evidence, needed });
                    break;
                }
            }
        }
        if found.space.modes() > first { self.with_amplifier_if_still_told(found, linear, monitor) } else { Ok(found) }
    }

    /// Whether the last mode is asked for, or what it explains is no small part of the error.
    fn is_worth_a_mode(&self, without: &JointFit, with: &JointFit) -> bool {
        let is_asked = matches!(self.problem.options.modes, ModesModel::Number(_));
        is_asked || with.fit.squares <= MOST_LEFT_BY_MODE * without.fit.squares
    }

    /// By how many variances of the noise the last mode lowers the sum of squares: no more than its gain alone tells, as a longer
    /// search lowers it too.
    fn evidence_for_mode(&self, without: &JointFit, with: &JointFit) -> f64 {
        let decrease = (without.fit.squares - with.fit.squares) / self.noise(with);
        let deviations = self.problem.deviations_of_last_gain(with);
        decrease.min(deviations * deviations)
    }

    /// The amplifier judged anew, once there are several modes: it may have stood for one, or one have hidden it.
    fn with_amplifier_if_still_told(
        &self,
        found: JointFit,
        linear: &mut LinearEvidence,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let part = Span { from: 0.66, to: 0.68 };
        if found.space.axis(Parameter::LogBandwidth).is_none() {
            return self.with_amplifier_if_told(found, linear, part, monitor);
        }
        monitor.begin(part);
        let without = self.problem.without_amplifier(&found, monitor)?;
        let evidence = self.evidence(&without, &found);
        Ok(if evidence >= self.needed_evidence(&found) { found } else { without })
    }

    /// The fit, or that of a lag of first order if it is overdamped and the records do not tell more, or of a dead time alone if they
    /// do not tell the dynamics: too little evidence, or at the edge of what is searched. Cross-validation does not judge them: the
    /// stretch of a chirp that has the resonance tells it alone.
    fn without_needless_dynamics(
        &self,
        fit: JointFit,
        linear: &mut LinearEvidence,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        if fit.space.order().is_none() {
            return Ok(fit);
        }
        monitor.begin(Span { from: 0.7, to: 0.8 });
        let without = self.problem.without_dynamics(&fit, monitor)?;
        let fit = if without.fit.objective < fit.fit.objective { self.again(fit, &without, monitor)? } else { fit };
        let is_told = self.evidence(&without, &fit) >= self.needed_evidence(&fit);
        let is_kept = is_told && is_inside(&fit);
        let is_overdamped = fit.fit.point.get(Parameter::LogDamping) > 0.0;
        let lag = if is_told && is_overdamped { self.lag_if_told(&without, monitor)? } else { None };
        match lag {
            Some((lag, error)) if !is_kept || self.evidence(&lag, &fit) < self.needed_evidence(&fit) => {
                (linear.dead_time_error, linear.amplifier_instead) = (error, 0.0);
                Ok(lag)
            }
            _ if is_kept => Ok(fit),
            _ => {
                linear.dead_time_error = None;
                Ok(without)
            }
        }
    }

    /// A lag of first order and the standard error of the dead time beside it, if the records tell one: a resonance that stands for it
    /// is damped without bound, and what is fast in it must be undone by a dead time.
    fn lag_if_told(
        &self,
        without: &JointFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Option<(JointFit, Option<f64>)>, Error> {
        // The part of the work before is done: progress does not go back.
        monitor.begin(Span { from: 0.8, to: 0.8 });
        let Some((lag, error)) = to_compare(search_lag(&self.problem, &self.plain, monitor))? else { return Ok(None) };
        let is_told = self.evidence(without, &lag) >= self.needed_evidence(&lag);
        Ok((is_told && is_inside(&lag)).then_some((lag, error)))
    }

    /// The better of a fit that is worse than one without its dynamics, a minimum among others, and of what a search from there finds.
    fn again(&self, fit: JointFit, without: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        // The part of the work before is done: progress does not go back.
        monitor.begin(Span { from: 0.8, to: 0.8 });
        let again = self.problem.search(&without.fit, &without.space, monitor)?;
        Ok(if again.fit.objective < fit.fit.objective { again } else { fit })
    }

    fn needed_evidence(&self, fit: &JointFit) -> f64 {
        needed_evidence(self.problem.records, fit)
    }

    /// By how many variances of the noise one fit lowers the sum of squares of another, record by record: in volts of a small fast
    /// record a mode is plain that is nothing beside what slow strokes leave.
    fn evidence(&self, without: &JointFit, with: &JointFit) -> f64 {
        if let [_] = self.problem.records {
            return (without.fit.squares - with.fit.squares) / self.noise(with);
        }
        self.problem.evidence(without, with)
    }

    /// The variance of the noise, as if its samples were independent.
    fn noise(&self, fit: &JointFit) -> f64 {
        fit.fit.squares / as_f64(fit.rows(self.problem.records)) * self.problem.colour(fit).correlation_time
    }

    /// What has one parameter for its lag, against dynamics that may be noise alone: a dead time alone, or second-order
    /// dynamics critically damped without one; and the evidence against the first, or the second if the dead time is known.
    /// Nothing for a lag of first order behind a known dead time, whose lag is all it has to say.
    ///
    /// Dynamics that are infinitely fast answer within a sample: with a dead time of -1 they are no dynamics at all.
    fn simple(&self, fit: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<Option<Simple>, Error> {
        let Some(order) = fit.space.order() else { return Ok(None) };
        let evidence = |simple: &JointFit| self.evidence(simple, fit);
        let searches_dead_time = self.problem.options.dead_time == Setting::Fit;
        let damped = |monitor: &mut SearchMonitor<'_>| match order {
            Order::First => Ok(None),
            Order::Second => {
                monitor.begin(Span { from: 0.75, to: 0.8 });
                self.problem.critically_damped(fit, monitor).map(Some)
            }
        };
        if !searches_dead_time {
            return Ok(damped(monitor)?.map(|fit| Simple { evidence: evidence(&fit), fit }));
        }
        monitor.begin(Span { from: 0.7, to: 0.75 });
        let without = self.problem.without_dynamics(fit, monitor)?;
        let beside = |damped: &JointFit| evidence(damped) - evidence(&without);
        let best = match damped(monitor)? {
            Some(damped) if beside(&damped) < SAME_EVIDENCE => damped,
            // Of first order, a lag has as many parameters as a dead time.
            None if evidence(&without) > 0.0 && fit.dead_time_samples() == 0.0 => return Ok(None),
            _ => return Ok(Some(Simple { evidence: evidence(&without), fit: without })),
        };
        Ok(Some(Simple { evidence: evidence(&without), fit: best }))
    }

    /// The best until a search was stopped: at a joint point, or with the hysteresis of the plain fit.
    fn best_so_far(&self, joint: Option<&Point>) -> Result<JointFit, Error> {
        match self.best.as_ref().or(joint) {
            Some(point) => self.problem.at(&Space::new(self.problem.records, self.problem.options)?, point),
            None => self.problem.at_hysteresis(&self.plain.fit.point),
        }
    }
}

/// By how many variances of the noise dynamics must lower the sum of squares.
pub(crate) fn needed_evidence(records: &[Record<'_>], fit: &JointFit) -> f64 {
    MIN_EVIDENCE * as_f64(fit.rows(records)).ln()
}

/// The best lag of first order from a fit on, and the standard error of the dead time beside it.
pub(crate) fn search_lag(
    problem: &JointProblem<'_>,
    from: &JointFit,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(JointFit, Option<f64>), Error> {
    let options = Options { dynamics: DynamicsModel::Order(Order::First), ..problem.options.clone() };
    let problem = JointProblem { options: &options, ..*problem };
    let lag = problem.search(&from.fit, &from.space, monitor)?;
    problem.settle_dead_time(lag, monitor)
}

/// What a search found that is only compared with a fit at hand: nothing where it failed, unless it was stopped.
pub(crate) fn to_compare<T>(found: Result<T, Error>) -> Result<Option<T>, Error> {
    match found {
        Err(Error::Interrupted) => Err(Error::Interrupted),
        found => Ok(found.ok()),
    }
}

/// Whether frequency, damping and dead time lie within the bounds of their search.
fn is_inside(JointFit { space, fit, .. }: &JointFit) -> bool {
    are_inside(space, &fit.point)
}

/// The same at a point of a space.
pub(crate) fn are_inside(space: &Space, point: &Point) -> bool {
    [Parameter::LogFrequency, Parameter::LogDamping, Parameter::DeadTime].into_iter().all(|parameter| {
        let value = point.get(parameter);
        space.axis(parameter).is_none_or(|axis| axis.lower < value && value < axis.upper)
    })
}
