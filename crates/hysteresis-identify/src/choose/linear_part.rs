//! The linear part, searched from the hysteresis alone: dynamics, an amplifier and more modes if the records tell them,
//! and a dead time that is settled beside them; then what makes them doubtful.

use core::f64::consts::TAU;

use crate::choose::found::{Lead, LinearEvidence, UntoldModes};
use crate::choose::trial::{TermTrial, TrialOutcome, overrule};
use crate::error::Error;
use crate::fit::joint::{Attempts, JointFit, JointProblem, MIN_NEGATIVE_SAMPLES};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::ProjectedFit;
use crate::fit::space::Space;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::options::{Options, Setting};
use crate::records::record::Record;
use crate::records::signal::as_f64;
use crate::terms::dynamics::{AmplifierModel, DynamicsModel, Mode, ModesModel, Order};
use crate::uncertainty::root::{Gradients, Quantity, Root, log_damping, log_frequency};
use crate::uncertainty::standard_errors::StandardErrors;

/// Dynamics must lower the sum of squares by this many noise variances per e-fold of samples: the strongest resonance
/// that white noise looks like, somewhere among N / 2 frequencies, takes about 2 log(N / 2), and this is twice as much.
const MIN_EVIDENCE: f64 = 4.0;

/// A mode that is not asked for must lower the sum of squares to this share, the error by three tenths: what a model of
/// hysteresis or creep leaves may look like a faint mode.
const MOST_LEFT_BY_MODE: f64 = 0.5;

/// By how many noise variances dynamics may fit worse than a dead time alone and still stand for the lag, as they were
/// asked for: two standard deviations.
const SAME_EVIDENCE: f64 = 4.0;

/// How results call these terms.
const AMPLIFIER: &str = "amplifier";
pub(crate) const SECOND_ORDER: &str = "dynamics of second order";
const FIRST_ORDER: &str = "lag of first order";

/// Hysteresis and linear part together, and what the records tell of the latter; and whether the search was stopped and
/// this is the best so far.
pub(crate) struct FoundJoint {
    pub(crate) fit: JointFit,
    pub(crate) linear: LinearEvidence,
    /// Which of its terms were tried.
    pub(crate) trials: Vec<TermTrial>,
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
    let mut joint = JointSearch { problem, plain, is_open, best: None, trials: Vec::new() };
    let searched = monitor.unless_stopped(|monitor| joint.search(&mut linear, monitor))?;
    let partial = searched.is_none();
    let fit = searched.map_or_else(|| joint.best_so_far(monitor.kept().as_ref()), Ok)?;
    Ok(FoundJoint { fit, linear, trials: joint.trials, partial })
}

/// A fit with one parameter for its lag, and by how many variances of the noise dynamics lower the sum of squares below
/// it.
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
    trials: Vec<TermTrial>,
}

impl JointSearch<'_> {
    fn search(&mut self, linear: &mut LinearEvidence, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        monitor.begin(Span { from: 0.3, to: 0.6 });
        let found = self.problem.search(&self.plain.fit, &self.plain.space, monitor)?;
        self.best = Some(found.fit.point);
        let found = self.with_amplifier_if_told(found, linear, Span { from: 0.6, to: 0.63 }, monitor)?;
        let found = self.with_modes_if_told(found, linear, monitor)?;
        monitor.begin(Span { from: 0.68, to: 0.7 });
        let Settled { fit, error } = self.problem.settle_dead_time(found, monitor)?;
        linear.dead_time_error = error;
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
        &mut self,
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
        if self.tried(AMPLIFIER, &found, &with, !with.has_amplifier_at_bound()) == TrialOutcome::Better {
            return Ok(with);
        }
        linear.amplifier_instead = (with.dead_time_samples() - found.dead_time_samples()).abs();
        Ok(found)
    }

    /// The fit, or that with as many modes as the records tell.
    fn with_modes_if_told(
        &mut self,
        mut found: JointFit,
        linear: &mut LinearEvidence,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let modes = self.problem.options.modes;
        let (first, whole) = (found.space.modes(), Span { from: 0.63, to: 0.66 });
        while (1..modes.most()).contains(&found.space.modes()) {
            let (number, needed) = (found.space.modes(), self.needed_evidence(&found));
            monitor.begin(whole.part(number - 1, modes.most()));
            let wanted = needed * self.noise(&found);
            let with = if found.fit.is_exact() { None } else { self.problem.with_mode(&found, wanted, monitor)? };
            let told = with.as_ref().filter(|with| with.has_distinct_modes());
            let evidence = told.map_or(0.0, |with| self.evidence_for_mode(&found, with));
            let is_told = evidence >= needed;
            let outcome = match (&with, told) {
                (None, _) => TrialOutcome::NotPromising,
                (_, None) => TrialOutcome::StandsForOther,
                (_, Some(with)) if is_told && self.is_worth_a_mode(&found, with) => TrialOutcome::Better,
                _ if is_told => TrialOutcome::TooSmall,
                _ => TrialOutcome::NotBetter,
            };
            let (name, gain) = (format!("mode number {}", number + 1), told.map(|_| evidence));
            self.trials.push(TermTrial::by_evidence(&name, (gain, needed), outcome));
            match with {
                Some(with) if outcome == TrialOutcome::Better => found = with,
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

    /// By how many variances of the noise the last mode lowers the sum of squares: no more than its gain alone tells,
    /// as a longer search lowers it too.
    fn evidence_for_mode(&self, without: &JointFit, with: &JointFit) -> f64 {
        let decrease = (without.fit.squares - with.fit.squares) / self.noise(with);
        let deviations = self.problem.deviations_of_last_gain(with);
        decrease.min(deviations * deviations)
    }

    /// The amplifier judged anew, once there are several modes: it may have stood for one, or one have hidden it.
    fn with_amplifier_if_still_told(
        &mut self,
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
        let is_told = evidence >= self.needed_evidence(&found) && !found.has_amplifier_at_bound();
        if !is_told {
            overrule(&mut self.trials, TrialOutcome::Overruled, |term| term == AMPLIFIER);
        }
        Ok(if is_told { found } else { without })
    }

    /// The fit, or that of a lag of first order if it is overdamped and the records do not tell more, or of a dead time
    /// alone if they do not tell the dynamics: too little evidence, or at the edge of what is searched.
    /// Cross-validation does not judge them: the stretch of a chirp that has the resonance tells it alone.
    fn without_needless_dynamics(
        &mut self,
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
        let outcome = self.tried(SECOND_ORDER, &without, &fit, is_inside(&fit));
        let (is_told, is_kept) = (outcome != TrialOutcome::NotBetter, outcome == TrialOutcome::Better);
        let is_overdamped = fit.fit.point.get(Parameter::LogDamping) > 0.0;
        let lag = if is_told && is_overdamped { self.lag_if_told(&without, monitor)? } else { None };
        match lag {
            Some(lag) if !is_kept || self.evidence(&lag.fit, &fit) < self.needed_evidence(&fit) => {
                (linear.dead_time_error, linear.amplifier_instead) = (lag.error, 0.0);
                overrule(&mut self.trials, TrialOutcome::Beaten, |term| term == SECOND_ORDER);
                self.tried(FIRST_ORDER, &without, &lag.fit, true);
                Ok(lag.fit)
            }
            _ if is_kept => Ok(fit),
            _ => {
                linear.dead_time_error = None;
                Ok(without)
            }
        }
    }

    /// A lag of first order and how the dead time beside it was settled, if the records tell one: a resonance that
    /// stands for it is damped without bound, and what is fast in it must be undone by a dead time.
    fn lag_if_told(&self, without: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<Option<Settled>, Error> {
        monitor.begin(Span { from: 0.8, to: 0.8 });
        let Some(lag) = to_compare(search_lag(&self.problem, &self.plain, monitor))? else { return Ok(None) };
        let is_told = self.evidence(without, &lag.fit) >= self.needed_evidence(&lag.fit);
        Ok((is_told && is_inside(&lag.fit)).then_some(lag))
    }

    /// The better of a fit that is worse than one without its dynamics, a minimum among others, and of what a search
    /// from there finds.
    fn again(&self, fit: JointFit, without: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        monitor.begin(Span { from: 0.8, to: 0.8 });
        let again = self.problem.search(&without.fit, &without.space, monitor)?;
        Ok(if again.fit.objective < fit.fit.objective { again } else { fit })
    }

    /// What comes of a term by the evidence of a fit with it, and whether that lies within its bounds; the list has it.
    fn tried(&mut self, term: &str, without: &JointFit, with: &JointFit, is_inside: bool) -> TrialOutcome {
        let (evidence, needed) = (self.evidence(without, with), self.needed_evidence(with));
        let outcome = match evidence >= needed {
            false => TrialOutcome::NotBetter,
            true if is_inside => TrialOutcome::Better,
            true => TrialOutcome::StandsForOther,
        };
        self.trials.push(TermTrial::by_evidence(term, (Some(evidence), needed), outcome));
        outcome
    }

    fn needed_evidence(&self, fit: &JointFit) -> f64 {
        needed_evidence(self.problem.records, fit)
    }

    /// By how many variances of the noise one fit lowers the sum of squares of another, record by record: in volts of a
    /// small fast record a mode is plain that is nothing beside what slow strokes leave.
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
    /// dynamics critically damped without one; and the evidence against the first, or the second if the dead time is
    /// known. Nothing for a lag of first order behind a known dead time, whose lag is all it has to say.
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
            Some(point) => {
                let space = Space::new(self.problem.records, self.problem.options)?.with_maps_of(&self.plain.space);
                self.problem.at(&space, point)
            }
            None => self.problem.at_hysteresis(&self.plain),
        }
    }
}

/// By how many variances of the noise dynamics must lower the sum of squares.
pub(crate) fn needed_evidence(records: &[Record<'_>], fit: &JointFit) -> f64 {
    MIN_EVIDENCE * as_f64(fit.rows(records)).ln()
}

/// The best lag of first order from a fit on.
fn search_lag(problem: &JointProblem<'_>, from: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<Settled, Error> {
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
    [Parameter::LogFrequency, Parameter::LogDamping, Parameter::DeadTime]
        .into_iter()
        .all(|parameter| space.axis(parameter).is_none_or(|axis| axis.is_inside(&fit.point)))
}

/// Which shares of the dead time and a tenth of a sample the lag of the amplifier is at the starts.
const AMPLIFIER_SHARES: [f64; 3] = [0.2, 0.6, 0.95];

/// How many passes over the records a start may take before the best of them goes on.
const AMPLIFIER_PASSES: usize = 6;

impl JointProblem<'_> {
    /// The best fit with an amplifier in front of the hysteresis, from a point near by.
    pub(crate) fn with_amplifier(&self, near: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        let space = near.space.with_amplifier();
        let starts = amplifier_starts(&space, &near.fit.point, near.fit.point.get(Parameter::DeadTime));
        self.search_starts(space, &starts, Attempts { level: 0, passes: AMPLIFIER_PASSES }, monitor)
    }
}

/// Points whose dead time and amplifier together have a lag; the amplifier alone has parts of it where the dead time is
/// known.
pub(crate) fn amplifier_starts(space: &Space, point: &Point, lag: f64) -> Vec<Point> {
    let within =
        |parameter, value: f64| space.axis(parameter).map_or(value, |axis| value.clamp(axis.lower, axis.upper));
    let most = lag + 0.1 * space.intervals().smallest();
    let start = |share: f64| {
        let part = share * most;
        point
            .with(Parameter::LogBandwidth, within(Parameter::LogBandwidth, -(TAU * part).ln()))
            .with(Parameter::DeadTime, space.nearest(Parameter::DeadTime, lag - part))
    };
    AMPLIFIER_SHARES.into_iter().filter(|_| most > 0.0).map(start).collect()
}

/// A dead time must lower the sum of squares by this many variances of the noise: three standard errors.
const MIN_EVIDENCE_OF_DEAD_TIME: f64 = 9.0;

/// A dead time of so many standard errors is told without a fit that has none.
const SURE: f64 = 20.0;

/// Below this, in samples, a dead time is rounding.
const ROUNDING_SAMPLES: f64 = 1e-6;

/// A fit whose dead time is settled, and how.
struct Settled {
    fit: JointFit,
    /// The standard error of the dead time in samples, widened for correlated residuals, or not a number if it cannot
    /// be told at all. None where none is searched beside dynamics.
    error: Option<f64>,
}

impl JointProblem<'_> {
    /// The best fit with a dead time that is known, from a point near by.
    pub(crate) fn with_dead_time(
        &self,
        near: &JointFit,
        dead_time: f64,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let (space, point) = known_dead_time(near, dead_time);
        self.search_from(space, &point, monitor)
    }

    /// The fit with a dead time that is known and the same lag, without a search.
    pub(crate) fn at_dead_time(&self, near: &JointFit, dead_time: f64) -> Result<JointFit, Error> {
        let (space, point) = known_dead_time(near, dead_time);
        self.at(&space, &point)
    }

    /// The fit with no dead time, unless the records tell one.
    fn settle_dead_time(&self, found: JointFit, monitor: &mut SearchMonitor<'_>) -> Result<Settled, Error> {
        let searched = found.space.order().is_some() && found.space.axis(Parameter::DeadTime).is_some();
        if !searched {
            return Ok(Settled { fit: found, error: None });
        }
        let rows = found.rows(self.records);
        let root = Root::of(&found.fit, &found.linearised, &found.space, rows);
        let spread = self.colour(&found).correlation_time.sqrt();
        let dt = found.space.intervals().smallest();
        let gradients = Gradients { fit: &found.fit, basis: self.basis, space: &found.space };
        let error = root.error_of(&gradients.of(Quantity::DeadTime));
        let samples = found.fit.point.get(Parameter::DeadTime) / dt;
        let deviations = samples * dt / (error * spread);
        let error_in_samples = Some(error * spread / dt);
        if samples > 0.0 && deviations > SURE {
            return Ok(Settled { fit: found, error: error_in_samples });
        }
        let none = self.with_dead_time(&found, 0.0, monitor)?;
        let gained = (none.fit.objective - found.fit.objective) / (root.deviation * spread).powi(2);
        let told = gained > MIN_EVIDENCE_OF_DEAD_TIME
            && samples.abs() > ROUNDING_SAMPLES
            && !(-MIN_NEGATIVE_SAMPLES..0.0).contains(&samples);
        let fit = if told { found } else { none };
        Ok(Settled { fit, error: error_in_samples })
    }
}

/// The space of a fit with a dead time that is known, and the point in it with the same lag.
fn known_dead_time(near: &JointFit, dead_time: f64) -> (Space, Point) {
    let space = near.space.with_known(Parameter::DeadTime, dead_time);
    let point = space.with_lag_kept(&near.fit.point, dead_time);
    (space, point)
}

/// Relative standard errors beyond which a parameter counts as undetermined; of the dead time, in samples.
const MAX_FREQUENCY_ERROR: f64 = 0.05;
const MAX_DAMPING_ERROR: f64 = 0.25;
const MAX_CREEP_ERROR: f64 = 0.5;
/// A smaller standard error of an amplitude of creep does not matter, as a share of a move.
const CREEP_MATTERS: f64 = 1e-3;
const MAX_DEAD_TIME_ERROR: f64 = 0.1;

/// A lag of the amplifier that is shorter, in samples, is told from a dead time by the fastest motion alone, which
/// errors of the model blur first.
const MIN_AMPLIFIER_LAG: f64 = 3.0;

/// What the records do not tell of dynamics, dead time and creep.
pub(crate) fn joint_findings(
    space: &Space,
    fit: &ProjectedFit,
    errors: &StandardErrors,
    evidence: &LinearEvidence,
) -> Vec<Finding> {
    let doubtful = |code, what: &str, parameter, value: f64, error: f64, limit: f64| {
        let relative = error / value;
        let message = match space.axis(parameter) {
            Some(axis) if !axis.is_inside(&fit.point) => {
                format!("the search for the {what} ended at {value:.4}, the edge of its domain")
            }
            _ if relative.is_nan() => format!("the records do not tell the {what}"),
            _ => format!("the standard error of the {what} is {:.0} % of its value, {value:.4}", 100.0 * relative),
        };
        // A relative error that is not a number is past any limit.
        (space.axis(parameter).is_some() && (relative.is_nan() || relative > limit))
            .then(|| Finding::new(code, relative, limit, message))
    };
    let mut found = vec![
        evidence.untold_modes.map(|untold| untold_modes(space, untold)),
        evidence.too_little.map(|evidence| too_little(space, evidence)),
    ];
    let has_told_dynamics = evidence.too_little.is_none();
    for one in dynamics_of(space, fit, errors) {
        let (code, [frequency, damping]) = (FindingCode::ResonanceNotExcited, one.parameters);
        let (what, value, error) = (format!("frequency{}", one.of), fit.point.get(frequency).exp(), one.errors[0]);
        found.push(doubtful(code, &what, frequency, value, error, MAX_FREQUENCY_ERROR).filter(|_| has_told_dynamics));
        let code = FindingCode::DampingUndetermined;
        let (what, value, error) = (format!("damping{}", one.of), fit.point.get(damping).exp(), one.errors[1]);
        found.push(doubtful(code, &what, damping, value, error, MAX_DAMPING_ERROR));
    }
    found.extend([
        confounded(space, fit, errors, evidence.dead_time_error)
            .or_else(|| with_amplifier(space, fit, errors, evidence)),
        evidence.lead.map(negative),
    ]);
    let is_none = |number| fit.point.get(Parameter::Creep(number)) == 0.0;
    let has_creep = !(0..errors.creep.len()).all(is_none);
    for (number, error) in errors.creep.iter().enumerate() {
        let (parameter, what) = (Parameter::Creep(number), space.name_of_creep(number));
        let amplitude = fit.point.get(parameter);
        // Beside creep of other time constants none is an amplitude, too; what is told to a thousandth of a move is
        // told.
        if !(has_creep && is_none(number)) && (error.is_nan() || *error >= CREEP_MATTERS) {
            found.push(doubtful(FindingCode::CreepUndetermined, &what, parameter, amplitude, *error, MAX_CREEP_ERROR));
        }
    }
    found.into_iter().flatten().collect()
}

/// A mode or a lag: which one it is, where frequency and damping are searched, and their standard errors.
struct Doubted {
    of: String,
    parameters: [Parameter; 2],
    errors: [f64; 2],
}

/// The modes, from the lowest frequency up, or the lag.
fn dynamics_of(space: &Space, fit: &ProjectedFit, errors: &StandardErrors) -> Vec<Doubted> {
    let modes = space.linear_part(&fit.point).in_order();
    if modes.len() < 2 {
        let parameters = [Parameter::LogFrequency, Parameter::LogDamping];
        return vec![Doubted { of: String::new(), parameters, errors: [errors.frequency, errors.damping] }];
    }
    let doubted = |((number, mode), errors): (&(usize, Mode), &[f64; 3])| Doubted {
        of: format!(" of the mode at {:.4} Hz", mode.frequency),
        parameters: [log_frequency(*number), log_damping(*number)],
        errors: [errors[0], errors[1]],
    };
    modes.iter().zip(&errors.modes).map(doubted).collect()
}

/// Modes that were asked for and are not there.
fn untold_modes(space: &Space, UntoldModes { asked, evidence, needed }: UntoldModes) -> Finding {
    let message = format!(
        "of {asked} modes that were asked for the records tell {}: another one lowers the sum of squares by {evidence:.1} noise \
         variances, and noise alone may pretend {needed:.1}",
        space.modes()
    );
    Finding::new(FindingCode::ModeNotTold, evidence, needed, message)
}

/// A dead time that is not told from the lag of the dynamics; `error` is its standard error, in samples, when it was
/// settled.
fn confounded(space: &Space, fit: &ProjectedFit, errors: &StandardErrors, error: Option<f64>) -> Option<Finding> {
    // The one of the result knows what the model lacks, but is not a number where the dead time settled at 0.
    let (settled, of_result) = (error?, errors.dead_time / space.intervals().smallest());
    let error = if settled.is_nan() { settled } else { settled.max(of_result) };
    let sum = with_error_of_lag(space.linear_part(&fit.point).lag(), errors.lag);
    let alone = if error.is_nan() { "not at all".to_owned() } else { format!("to {error:.2} samples") };
    let message = format!(
        "dead time is confounded with the lag of the dynamics: the records tell their sum, {sum}, and the dead time alone {alone}"
    );
    let code = FindingCode::DeadTimeConfounded;
    (error.is_nan() || error > MAX_DEAD_TIME_ERROR).then(|| Finding::new(code, error, MAX_DEAD_TIME_ERROR, message))
}

/// A sum of lags, and to how much it is told: that is not a number where a part of it lies at the edge of its domain or
/// is not told.
fn with_error_of_lag(lag: f64, error: f64) -> String {
    if error.is_nan() {
        return format!(
            "{:.4} ms but not how exactly, as a part of it ended at the edge of its domain or is not told",
            1e3 * lag
        );
    }
    format!("{:.4} ms to {:.4} ms", 1e3 * lag, 1e3 * error)
}

/// A dead time that an amplifier may have a part of.
fn with_amplifier(
    space: &Space,
    fit: &ProjectedFit,
    errors: &StandardErrors,
    evidence: &LinearEvidence,
) -> Option<Finding> {
    space.axis(Parameter::DeadTime)?;
    let part = space.linear_part(&fit.point);
    let lag = part.amplifier_lag() / space.intervals().smallest();
    let (value, limit, is_doubtful) = match part.bandwidth {
        Some(_) if space.axis(Parameter::LogBandwidth).is_some() => (lag, MIN_AMPLIFIER_LAG, lag < MIN_AMPLIFIER_LAG),
        Some(_) => return None,
        None => {
            let instead = evidence.amplifier_instead;
            (instead, MAX_DEAD_TIME_ERROR, instead > MAX_DEAD_TIME_ERROR)
        }
    };
    let message = format!(
        "dead time is confounded with the lag of an amplifier: the records tell the sum of all lags, {}, and hardly a lag of \
         {value:.2} samples in front of the hysteresis from a dead time",
        with_error_of_lag(part.lag(), errors.lag)
    );
    is_doubtful.then(|| Finding::new(FindingCode::DeadTimeConfounded, value, limit, message))
}

/// A dead time without dynamics that the records do not tell.
pub(crate) fn untold_dead_time(space: &Space, fit: &ProjectedFit, errors: &StandardErrors) -> Option<Finding> {
    /// A dead time counts from so many samples on.
    const MIN_SAMPLES: f64 = 0.5;
    let axis = space.axis(Parameter::DeadTime)?;
    let (value, dt) = (fit.point.get(Parameter::DeadTime), space.intervals().smallest());
    let (samples, error) = (value / dt, errors.dead_time / dt);
    let message = if error.is_nan() {
        format!("the records do not tell the dead time, {samples:.2} samples")
    } else {
        format!("the standard error of the dead time, {samples:.2} samples, is {error:.2} samples")
    };
    let untold = samples > MIN_SAMPLES && (error > samples || (error.is_nan() && axis.is_inside(&fit.point)));
    untold.then(|| Finding::new(FindingCode::DeadTimeConfounded, error, samples, message))
}

/// The evidence for dynamics, and what noise alone may pretend.
fn too_little(space: &Space, (evidence, needed): (f64, f64)) -> Finding {
    let instead = match (space.order(), space.has_amplifier()) {
        (Some(_), _) => "critically damped ones",
        (None, true) => "the amplifier and a dead time",
        (None, false) => "a dead time alone",
    };
    let message = format!(
        "the dynamics lower the sum of squares by {evidence:.1} noise variances, and noise alone may pretend {needed:.1}: the \
         result has {instead} with the same lag"
    );
    Finding::new(FindingCode::ResonanceNotExcited, evidence, needed, message)
}

/// A dead time of rows that pair a drive with a later position.
fn negative(Lead { samples, is_at_edge }: Lead) -> Finding {
    let or_more = if is_at_edge { " or more" } else { "" };
    let message = format!(
        "the position leads the drive by {:.2} samples{or_more}: nothing can run that, so the result has a dead time of 0 \
         and fits worse",
        -samples
    );
    Finding::new(FindingCode::NegativeDeadTime, samples, -MIN_NEGATIVE_SAMPLES, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An error of the lag that is not a number is told in words.
    #[test]
    fn a_lag_is_told_with_its_error() {
        assert_eq!(with_error_of_lag(0.0205, 0.003), "20.5000 ms to 3.0000 ms");
        let at_edge = with_error_of_lag(0.0205, f64::NAN);
        assert!(at_edge.starts_with("20.5000 ms but not how exactly") && !at_edge.contains("NaN"), "{at_edge}");
    }
}
