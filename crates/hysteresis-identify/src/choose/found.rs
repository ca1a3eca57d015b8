//! What a search has found, with what was chosen and what the records said of it.

use crate::choose::cross_validation::{CrossValidation, Stretches, Terms};
use crate::choose::trial::{TermTrial, TrialOutcome, overrule};
use crate::error::Error;
use crate::fit::joint::{JointFit, JointProblem};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::SearchMonitor;
use crate::fit::projection::rough;
use crate::fit::space::Space;
use crate::options::Options;
use crate::records::record::Record;
use crate::terms::dynamics::DynamicsModel;
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::weights::{WeightBasis, WeightLaw};
use crate::uncertainty::standard_errors::StandardErrors;

/// The fit, and how it was found.
#[derive(Clone)]
pub(crate) struct Found {
    pub(crate) fit: JointFit,
    /// With everything chosen that was left to cross-validation.
    pub(crate) options: Options,
    pub(crate) smoothness: f64,
    pub(crate) basis: WeightBasis,
    pub(crate) operators_tried: Vec<CrossValidation>,
    pub(crate) structure: Structure,
    /// Where a linear part was fitted.
    pub(crate) linear: Option<LinearEvidence>,
    /// Where one record told the dynamics by itself: a descent to all records would lose them.
    pub(crate) told_alone: Option<ToldAlone>,
    /// Whether coupled plays predict better than these plays: then everything is to be sought with them.
    pub(crate) needs_coupling: bool,
    /// Which terms were tried on the way, and why they were taken or left.
    pub(crate) trials: Vec<TermTrial>,
    /// A map that may be there, though none is chosen.
    pub(crate) untold_map: Option<UntoldMap>,
    pub(crate) partial: bool,
}

impl Found {
    /// The same, marked as the best of a search that was stopped.
    pub(crate) fn stopped(self) -> Self {
        Self { partial: true, ..self }
    }

    /// The sampling interval of records that have none of their own; 1, in samples, if none is known.
    pub(crate) fn interval(&self, records: &[Record<'_>]) -> f64 {
        self.options.dt.or(records.iter().find_map(Record::dt)).unwrap_or(1.0)
    }

    /// Whether dynamics that were not asked for answer before the drive: nothing can run them, and they stand for
    /// something else.
    pub(crate) fn leads(&self, asked: &Options) -> bool {
        asked.dynamics == DynamicsModel::Auto && self.fit.leads()
    }

    /// The same with dynamics that led before their dead time was held at 0.
    pub(crate) fn with_lead(self, lead: Option<Lead>) -> Self {
        let linear = self.linear.map(|linear| LinearEvidence { lead: lead.or(linear.lead), ..linear });
        Self { linear, ..self }
    }

    /// Whether there is an operator of the other family.
    pub(crate) fn has_duhem(&self) -> bool {
        self.fit.space.duhem(&self.fit.fit.point).is_some()
    }

    /// How it predicts stretches that are held out.
    pub(crate) fn validated(&self, records: &[Record<'_>]) -> Result<CrossValidation, Error> {
        let space = &self.fit.space;
        let projection = rough(records, space, &self.basis, self.smoothness)?;
        let fit = projection.fit(&self.fit.fit.point, None);
        let (creep, loop_shift, smoothness) = (space.creep_amplitudes(), self.options.loop_shift, self.smoothness);
        let stretches = Stretches::new(&projection, &fit);
        let terms = Terms { creep, loop_shift, smoothness };
        Ok(stretches.under(&self.options, &self.basis).cross_validate(&terms))
    }

    /// The same after trials that came before all others.
    pub(crate) fn after(mut self, mut before: Vec<TermTrial>) -> Self {
        before.append(&mut self.trials);
        Self { trials: before, ..self }
    }

    /// What was tried, where a search begins anew: the terms for which `is_left` holds are taken no more.
    pub(crate) fn overruled(&self, is_left: impl Fn(&str) -> bool) -> Vec<TermTrial> {
        let mut trials = self.trials.clone();
        overrule(&mut trials, TrialOutcome::Overruled, is_left);
        trials
    }

    /// The same with a trial at a place of the list.
    pub(crate) fn with_trial(mut self, place: usize, trial: TermTrial) -> Self {
        self.trials.insert(place, trial);
        self
    }

    /// What is searched in the records with everything chosen.
    pub(crate) fn problem<'a>(&'a self, records: &'a [Record<'a>]) -> JointProblem<'a> {
        JointProblem { records, options: &self.options, basis: &self.basis, smoothness: self.smoothness }
    }
}

/// A structure, and what cross-validation said of it and of others.
#[derive(Clone, Default)]
pub(crate) struct Structure {
    pub(crate) weights: WeightLaw,
    pub(crate) smoothness: f64,
    /// How many amplitudes of creep.
    pub(crate) creep: usize,
    pub(crate) loop_shift: LoopShiftModel,
    pub(crate) terms_tried: Vec<CrossValidation>,
    pub(crate) weights_tried: Vec<CrossValidation>,
    pub(crate) smoothness_tried: Vec<CrossValidation>,
}

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
    /// Where a dead time below zero was better.
    pub(crate) lead: Option<Lead>,
}

/// A dead time below zero that fits best: the position answers before the drive.
#[derive(Clone, Copy)]
pub(crate) struct Lead {
    /// The dead time in samples of the fastest record.
    pub(crate) samples: f64,
    /// Whether the search for it ended at the edge of its domain.
    pub(crate) is_at_edge: bool,
}

impl Lead {
    /// That of a fit, if it leads.
    pub(crate) fn of(fit: &JointFit) -> Option<Self> {
        let value = fit.fit.point.get(Parameter::DeadTime);
        let is_at_edge = fit.space.axis(Parameter::DeadTime).is_some_and(|axis| value <= axis.lower);
        fit.leads().then(|| Self { samples: fit.dead_time_samples(), is_at_edge })
    }
}

/// Modes that the records do not tell.
#[derive(Clone, Copy)]
pub(crate) struct UntoldModes {
    pub(crate) asked: usize,
    /// The evidence for another one than were found, and what noise alone may pretend; the former is 0 where there is
    /// no such mode.
    pub(crate) evidence: f64,
    pub(crate) needed: f64,
}

/// What stays of the dynamics that one record told by itself, once they are known.
#[derive(Clone)]
pub(crate) struct ToldAlone {
    /// With the axes of the dynamics.
    pub(crate) space: Space,
    pub(crate) errors: StandardErrors,
}

/// Where a fit is, and what is fitted there.
#[derive(Clone)]
pub(crate) struct Place {
    pub(crate) space: Space,
    pub(crate) point: Point,
}

/// Maps that decaying loops do not tell from a loop shift.
#[derive(Clone, Copy)]
pub(crate) struct UntoldMap {
    /// Whether there is one in front of the hysteresis, and one behind it.
    pub(crate) in_front: bool,
    pub(crate) behind: bool,
    /// By which factor they lower the mean square error of prediction.
    pub(crate) gain: f64,
    /// How much of the position they explain, rms, over the range.
    pub(crate) share: f64,
}

/// A search for everything that options ask for, with a number of operators that is known.
pub(crate) type Search = fn(&[Record<'_>], &Options, &mut SearchMonitor<'_>) -> Result<Found, Error>;
