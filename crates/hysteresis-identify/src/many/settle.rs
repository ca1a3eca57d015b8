//! From a fit to what is reported of it.

use super::normal::Normal;
use super::result::{ActuatorFit, BriefFinding};
use crate::creep_model::CreepBasis;
use crate::diagnostics::findings;
use crate::error::Error;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::chain::Chain;
use crate::fit::point::Parameter;
use crate::fit::projection::ProjectedFit;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::identify::model;
use crate::joint_findings::untold_dead_time;
use crate::numeric::as_f64;
use crate::options::{Options, Thresholds};
use crate::record::Record;
use crate::result::quality::Quality;
use crate::result::standard_errors::StandardErrors;
use crate::turned_sign::judged;

/// A fit, and what it is a fit of.
pub(super) struct Settled<'a> {
    pub(super) record: &'a Record<'a>,
    pub(super) options: &'a Options,
    pub(super) space: &'a Space,
    pub(super) basis: &'a WeightBasis,
    pub(super) fit: &'a ProjectedFit,
    /// The problem about the fit.
    pub(super) normal: &'a Normal,
}

impl Settled<'_> {
    /// What is reported; `turned` fits the position with its sign turned and says what sum of squares that leaves.
    pub(super) fn report(&self, turned: impl FnOnce() -> Result<f64, Error>) -> Result<ActuatorFit, Error> {
        let Self { options, space, basis, fit, .. } = *self;
        let chain = Chain {
            operators: space.operators(&fit.point),
            weights: fit.weights.clone(),
            linear: space.linear_part(&fit.point),
            underway: Vec::new(),
            creep_underway: CreepBasis::default(),
            dt: space.intervals().of_record(0),
        };
        let (estimated, deviation) = self.deviation();
        let quality = self.quality(&chain);
        let mut found = self.findings(&chain, &estimated, deviation);
        if found.iter().any(|finding| finding.code == FindingCode::WrongSign) {
            let left = (turned()? / as_f64(quality.samples)).sqrt() / quality.range;
            found = judged(found, quality.nrmse, left);
        }
        Ok(ActuatorFit {
            model: model(options, space, basis, fit, &chain)?,
            ratios: space.ratios(&fit.point),
            dead_time: fit.point.get(Parameter::DeadTime),
            rmse: quality.rmse,
            max_error: quality.max_error,
            range: quality.range,
            noise: deviation,
            findings: found.iter().map(BriefFinding::from).collect(),
        })
    }

    /// The columns that are estimated, the dead time left out, and the standard deviation of a sample.
    fn deviation(&self) -> (Vec<usize>, f64) {
        let unknowns = self.fit.unknowns.len();
        let mut free: Vec<usize> = (0..unknowns).filter(|j| self.fit.unknowns[*j] > 0.0).collect();
        let mut count = free.len() + 1;
        for (k, axis) in self.space.axes().iter().enumerate() {
            let value = self.fit.point.get(axis.parameter);
            if axis.lower < value && value < axis.upper {
                count += 1;
                if axis.parameter != Parameter::DeadTime {
                    free.push(unknowns + k);
                }
            }
        }
        let rows = self.normal.rows;
        (free, (self.fit.squares / as_f64(rows.saturating_sub(count).max(1))).sqrt())
    }

    fn quality(&self, chain: &Chain) -> Quality {
        let (record, offset) = (self.record, self.fit.output_offsets[0]);
        let predicted: Vec<f64> = chain.response(record.input(), chain.dt).iter().map(|y| offset + y).collect();
        let fitted = record.skip()..;
        Quality::of(&record.output()[fitted.clone()], &predicted[fitted], record.output_range())
    }

    fn findings(&self, chain: &Chain, estimated: &[usize], deviation: f64) -> Vec<Finding> {
        let mut found = findings(std::slice::from_ref(self.record), chain);
        // Thresholds that the fit places follow the input: where ratios carry one beyond, no number is missing.
        let are_given = matches!(self.options.thresholds, Thresholds::Given(_));
        found.retain(|finding| are_given || finding.code != FindingCode::UnreachedThreshold);
        let place = self.space.axes().iter().position(|axis| axis.parameter == Parameter::DeadTime);
        if let Some(place) = place {
            let dead_time = deviation * self.normal.error_of(self.fit.unknowns.len() + place, estimated);
            let errors = StandardErrors { dead_time, ..StandardErrors::default() };
            found.extend(untold_dead_time(self.space, self.fit, &errors));
        }
        found
    }
}
