//! From an identification to a stage.

use hysteresis_control::linear::FirstOrder;
use hysteresis_control::stage::{self, Identified, Stage, StageParts, StageWarning};
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, PiecewiseLinearMap};

use super::identification::Identification;
use crate::finding::{Finding, Severity};

impl Identification {
    /// The stage that was identified: [`stage_parts`](Self::stage_parts) as they are. It has no limits of its own: what is made
    /// from it stays within the drives of the records.
    ///
    /// # Errors
    /// [`stage::Error`] for parts that no stage may have.
    pub fn stage(&self) -> Result<Stage, stage::Error> {
        Stage::new(self.stage_parts())
    }

    /// The parts of the stage that was identified: hysteresis, creep, dynamics, dead time, noise, and what is known of them.
    /// Limits, slew, units and the sources of the records are left to the caller. A stage counts in seconds: of records without
    /// a sampling interval the dead time is left out, and a warning of the stage says so.
    ///
    /// The forward model of that stage, settled at the first drive, gives the rows that [`predict`](Self::predict) gives.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use hysteresis_control::stage::Stage;
    /// use hysteresis_core::Process;
    /// use hysteresis_identify::{Options, Record, Setting, identify};
    /// let drive: Vec<f64> = (0..800).map(|k| 5.0 * (1.0 - k as f64 / 800.0) * (k as f64 / 20.0).sin()).collect();
    /// let position: Vec<f64> = drive.iter().map(|u| 0.2 * u).collect();
    /// let options = Options { dt: Some(1e-3), dead_time: Setting::Fixed(0.0), ..Options::default() };
    /// let found = identify(&[Record::new(&drive, &position, 0)?], &options, &mut |_| ControlFlow::Continue(()))?;
    /// let stage = Stage::new(found.stage_parts())?;
    /// assert!((stage.forward(1e-3)?.step(drive[0]) - position[0]).abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn stage_parts(&self) -> StageParts {
        let hysteresis = match &self.model {
            Model::Conventional(model) => ModifiedPrandtlIshlinskii::from(model),
            Model::Modified(model) => model.clone(),
        };
        StageParts {
            creep: self.creep.clone(),
            loop_shift: self.loop_shift,
            dynamics: self.linear_dynamics(),
            input_map: self.input_map(),
            output_map: self.output_map(),
            amplifier: self.amplifier(),
            dead_time: self.causal_dead_time(),
            noise: Some(self.noise),
            identified: Some(self.identified()),
            ..StageParts::new(hysteresis)
        }
    }

    /// The dead time of the stage: less than half a sample early is noise, as no stage is early; more is a finding, and stays.
    fn causal_dead_time(&self) -> f64 {
        let half = 0.5 * self.dt.iter().copied().fold(f64::INFINITY, f64::min);
        self.dead_time.filter(|time| *time >= 0.0 || *time < -half).unwrap_or(0.0)
    }

    /// The amplifier in front of the hysteresis, if one was found.
    #[must_use]
    pub fn amplifier(&self) -> Option<FirstOrder> {
        FirstOrder::new(self.chain.operators.path.bandwidth?).ok()
    }

    /// The map gamma in front of the hysteresis, if one was found: drive in, drive out.
    #[must_use]
    pub fn input_map(&self) -> Option<PiecewiseLinearMap> {
        self.chain.operators.path.map.as_ref()?.map(0.0).ok()
    }

    /// The map phi behind the hysteresis, if one was found: position in, position out, with the output offset.
    #[must_use]
    pub fn output_map(&self) -> Option<PiecewiseLinearMap> {
        self.chain.operators.output_map.as_ref()?.map(self.chain.rest_of(self.output_offsets[0])).ok()
    }

    fn identified(&self) -> Identified {
        Identified {
            drive_range: self.drive_range,
            position_range: self.position_range,
            dt: self.dt.clone(),
            rmse: self.fit.rmse,
            max_error: self.fit.max_error,
            parameters: self.covariance.parameters.clone(),
            covariance: self.covariance.matrix.clone(),
            warnings: self.warnings.iter().map(warning).chain(self.left_out_warning()).collect(),
            records: Vec::new(),
        }
    }
}

/// A dead time of less than that many samples is none that a stage would miss.
const MIN_LEFT_OUT: f64 = 0.05;

impl Identification {
    /// The dead time in samples that the stage lacks, as its records have no sampling interval.
    #[must_use]
    pub fn left_out_dead_time(&self) -> Option<f64> {
        self.dead_time_samples.filter(|samples| self.dead_time.is_none() && samples.abs() >= MIN_LEFT_OUT)
    }

    fn left_out_warning(&self) -> Option<StageWarning> {
        let samples = self.left_out_dead_time()?;
        Some(StageWarning {
            code: "dead_time_left_out".to_owned(),
            severity: Severity::Amber.name().to_owned(),
            message: format!(
                "the dead time of {samples:.3} samples is not part of the stage: the sampling interval is not known"
            ),
            value: samples,
            limit: 0.0,
            hint: "identify with the sampling interval".to_owned(),
        })
    }
}

fn warning(finding: &Finding) -> StageWarning {
    let Finding { code, severity, message, value, limit, hint, .. } = finding.clone();
    let (code, severity) = (code.name().to_owned(), severity.name().to_owned());
    StageWarning { code, severity, message, value, limit, hint }
}
