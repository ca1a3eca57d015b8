//! An identified model, what it predicts, and the stage that it makes.

use faer::Mat;
use hysteresis_control::linear::{Creep, Dynamics, FirstOrder, LinearDynamics, Modes};
use hysteresis_control::stage;
use hysteresis_control::stage::{
    ErrorBand, Identified, LoopShift, RelaxingPlays, SlowGain, Stage, StageParts, StageWarning,
};
use hysteresis_core::{Duhem, MAX_KNOTS, Model, ModifiedPrandtlIshlinskii, PiecewiseLinearMap, Ratios};

use crate::choose::cross_validation::CrossValidation;
use crate::choose::trial::TermTrial;
use crate::error::RecordError;
use crate::fit::own_columns::underway;
use crate::fit::response::Chain;
use crate::judge::finding::{Finding, Severity, Verdict};
use crate::judge::finding_code::FindingCode;
use crate::options::Options;
use crate::records::record::{Record, check_finite};
use crate::records::signal::Line;
use crate::result::quality::Quality;
use crate::terms::weights::WeightLaw;
use crate::uncertainty::standard_errors::{Covariance, Spread, StandardErrors};

/// An identified model, and how well it fits.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Identification {
    /// The hysteresis, with the output offset of the first record: before creep, dynamics and dead time.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::model"))]
    pub model: Model,
    /// The ratios of its thresholds; [`Ratios::PLAY`] for plays and for the conventional model.
    pub ratios: Ratios,
    /// The linear dynamics behind it, if there are any, of unit static gain; none where there are several
    /// [`modes`](Self::modes).
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::dynamics"))]
    pub dynamics: Option<Dynamics>,
    /// Several modes in parallel behind it, from the lowest frequency up; their gains sum to 1. None where there is
    /// one, which the [`dynamics`](Self::dynamics) are.
    #[cfg_attr(feature = "serde", serde(default, with = "crate::saved::modes"))]
    pub modes: Option<Modes>,
    /// The creep, if there is one.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::creep"))]
    pub creep: Option<Creep>,
    /// The searched amplitudes of creep: gamma, the share per decade, of log-type creep; else every c_j.
    pub creep_amplitudes: Vec<f64>,
    /// The loop shift, if there is one.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::loop_shift"))]
    pub loop_shift: Option<LoopShift>,
    /// The plays that relax, if there are any: thresholds and time constants of which none weighs anything are left
    /// out.
    #[cfg_attr(feature = "serde", serde(default, with = "crate::saved::relaxing_plays"))]
    pub relaxing_plays: Option<RelaxingPlays>,
    /// The slow gain, if there is one.
    #[cfg_attr(feature = "serde", serde(default, with = "crate::saved::slow_gain"))]
    pub slow_gain: Option<SlowGain>,
    /// What the output lags the input besides, in seconds; none for records without a sampling interval.
    pub dead_time: Option<f64>,
    /// The same in samples; none for records of several sampling intervals.
    pub dead_time_samples: Option<f64>,
    /// How much later slow motion is seen: the dead time and the lag of the dynamics (2 zeta / w, or the time constant;
    /// of several modes the sum, each times its gain) together, in seconds; in samples for records without a sampling
    /// interval. Records of slow motion tell it better than either.
    pub lag: f64,
    /// The sampling interval of every record in seconds; empty if there is none.
    pub dt: Vec<f64>,
    /// The lowest and the highest input of all records.
    pub drive_range: (f64, f64),
    /// The lowest and the highest output of all fitted samples, ringing and noise included; what the stage reaches is
    /// [`Stage::position_range`](hysteresis_control::stage::Stage::position_range).
    pub position_range: (f64, f64),
    /// The output offset of every record, in the unit of the output.
    pub output_offsets: Vec<f64>,
    /// The quality over the fitted samples of all records, which those that were left out are not.
    pub fit: Quality,
    /// The quality over the fitted samples of every record.
    pub record_fits: Vec<Quality>,
    /// The samples of every record that were taken for glitches and left out of the fit, in order: see
    /// [`Options::loss`](crate::Options::loss). They enter neither [`fit`](Self::fit) nor anything else that is said of
    /// the fit.
    pub left_out_samples: Vec<Vec<usize>>,
    /// The standard deviation of what is left: the root of the sum of their squares over the number of
    /// samples less that of unknowns, in the unit of the output.
    pub noise: f64,
    /// See [`sensor_noise`](Self::sensor_noise); none in results of releases that did not tell it from the misfit.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) sensor_noise: Option<f64>,
    /// How far the next record may be from what the model predicts; none in results of releases that knew no bands.
    #[cfg_attr(feature = "serde", serde(default))]
    pub error_band: Option<ErrorBand>,
    /// By how much the weights miss the conditions of Karush, Kuhn and Tucker for the best ones at these other
    /// parameters: the largest derivative of the sum of squares that a permitted change of a weight would follow
    /// downhill, as a share of the product of the norms of its column and of the data. Rounding: 1e-13 or less.
    pub kkt_residual: f64,
    /// How far the parameters may be from the truth.
    pub standard_errors: StandardErrors,
    /// The covariance of everything that was estimated, by name.
    pub covariance: Covariance,
    /// What the weights might be: as given, or as cross-validation chose.
    pub weights: WeightLaw,
    /// How smooth the weights were asked to be: as given, or as cross-validation chose.
    pub smoothness: f64,
    /// Which terms were tried, or not, and why they are in the model or not, in the order of the search, then what
    /// cross-validation chose; empty in results of releases that did not keep it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub terms_tried: Vec<TermTrial>,
    /// What cross-validation said of every weight law, if it chose; else empty.
    pub weights_validation: Vec<CrossValidation>,
    /// What cross-validation said of every number of operators, if it chose; else empty.
    pub cross_validation: Vec<CrossValidation>,
    /// What cross-validation said of the terms that it might leave out, the best of every kind, the simplest kind
    /// first; empty if there was nothing to choose.
    pub terms_validation: Vec<CrossValidation>,
    /// What cross-validation said of every smoothness with as many operators as the model has, if it chose; else empty.
    pub smoothness_validation: Vec<CrossValidation>,
    /// How many passes over the records, whole or thinned, the search took.
    pub evaluations: usize,
    /// What these records cannot tell and what the model left in them: the findings of [`diagnose`](crate::diagnose),
    /// those about the linear part, and what a fit with the sign of the position turned says.
    pub warnings: Vec<Finding>,
    /// Whether the search was stopped: the model is the best until then, its weights the best for its thresholds.
    pub partial: bool,
    pub(crate) chain: Chain,
    pub(crate) spread: Spread,
    /// As asked for, with the number of operators that was chosen.
    pub(crate) options: Options,
    /// The rows that ask for smooth weights at the thresholds found, one column for each unknown.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::matrix"))]
    pub(crate) penalty: Mat<f64>,
}

impl Identification {
    /// The output for an input that starts from the virgin state and at rest at its first value: that of the model
    /// through creep, dynamics and dead time, with the output offset of the first record. The input is sampled like
    /// that record.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        self.predict_at(input, self.interval())
    }

    /// [`predict`](Self::predict) for an input sampled every `dt` seconds; in units of the samples of the records where
    /// those have no sampling interval.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100; also for a `dt` that is not
    /// finite and above 0.
    pub fn predict_at(&self, input: &[f64], dt: f64) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        check_finite("dt", if dt > 0.0 { &[] } else { &[f64::NAN] })?;
        let output_offset = self.output_offsets[0];
        Ok(self.chain.response(input, dt).into_iter().map(|y| output_offset + y).collect())
    }

    /// The linear dynamics behind the hysteresis, one mode or several or a lag; their dead time is 0.
    #[must_use]
    pub fn linear_dynamics(&self) -> LinearDynamics {
        let one = || self.dynamics.map_or_else(LinearDynamics::none, LinearDynamics::from);
        self.modes.clone().map_or_else(one, LinearDynamics::from)
    }

    /// Of the first record, in seconds; 1, in samples, if none is known.
    fn interval(&self) -> f64 {
        self.dt.first().copied().unwrap_or(1.0)
    }

    /// How far noise alone may move every sample of [`predict`](Self::predict): no band that holds the next record, as
    /// what the model lacks comes on top, and the noise of a measurement.
    ///
    /// It is a standard deviation in the unit of the output, from the covariance of everything that was fitted,
    /// linearised at the fit. Like the [`standard_errors`](Self::standard_errors) it allows for residuals that are
    /// correlated in time. What was given, and what lies at a bound (a weight of zero, a ratio at its limit), counts as
    /// known. So does what the records do not tell at all: where the input goes further than they did, the truth may be
    /// further away.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict_std(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        Ok(self.spread.of(input, self.interval()))
    }

    /// How far above and below [`predict_at`](Self::predict_at) a sample of another record lies with probability
    /// `level`, the offset of that record apart: what the model lacks and the noise of the sensor together, from the
    /// [`error_band`](Self::error_band).
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use hysteresis_identify::{Options, Record, identify};
    /// let drive: Vec<f64> = (0..800).map(|k| 5.0 * (1.0 - k as f64 / 800.0) * (k as f64 / 20.0).sin()).collect();
    /// let position: Vec<f64> = drive.iter().map(|u| 0.2 * u + 0.001 * u * u).collect();
    /// let found = identify(&[Record::new(&drive, &position, 0)?], &Options::default(), &mut |_| ControlFlow::Continue(()))?;
    /// let half = found.predict_interval(&drive, 1.0, 0.95)?;
    /// assert!(half.len() == 800 && half.iter().all(|half| *half > 0.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`stage::Error`] without a band, for numbers that are not finite, and for a level that is not between 0 and 1.
    pub fn predict_interval(&self, input: &[f64], dt: f64, level: f64) -> Result<Vec<f64>, stage::Error> {
        self.error_band.as_ref().ok_or(stage::Error::NoBand)?.half_widths(input, &[], dt, level)
    }

    /// The noise of the sensor: the white part of the residuals, of the record that has least of it. Where the model
    /// lacks something it is below [`noise`](Self::noise).
    #[must_use]
    pub fn sensor_noise(&self) -> f64 {
        self.sensor_noise.unwrap_or(self.noise)
    }

    /// Whether the result deserves trust: the worst of its [`warnings`](Self::warnings).
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.warnings)
    }

    /// The same result with what reading the records took for granted, a sentence each: findings before all others
    /// ([`FindingCode::Assumed`]), which the verdict counts and the stage keeps.
    #[must_use]
    pub fn assuming(self, sentences: impl IntoIterator<Item = String>) -> Self {
        let assumed = sentences.into_iter().map(Finding::assumed);
        Self { warnings: assumed.chain(self.warnings).collect(), ..self }
    }

    /// The finding about an input that goes beyond those of the fitted records, if it does.
    #[must_use]
    pub fn extrapolation(&self, input: &[f64]) -> Option<Finding> {
        const LIMIT: f64 = 0.01;
        let (low, high) = self.drive_range;
        let beyond = |u: &f64| (u - high).max(low - u) / (high - low);
        let sample = (0..input.len()).max_by(|a, b| beyond(&input[*a]).total_cmp(&beyond(&input[*b])))?;
        let (value, furthest) = (beyond(&input[sample]), input[sample]);
        let message = format!(
            "the drive reaches {furthest} at sample {sample}, {:.1} % of the range beyond the identified {low} to {high}",
            100.0 * value
        );
        (value > LIMIT).then(|| Finding::new(FindingCode::Extrapolation, value, LIMIT, message).at(sample))
    }

    /// How well the model predicts records that it was not fitted to: [`validate`](Self::validate) for each, with its
    /// output offset if that is given. A drive beyond the identified range becomes one of the
    /// [`warnings`](Self::warnings).
    pub fn validate_all(&mut self, records: &[(Record<'_>, Option<f64>)]) -> Vec<Quality> {
        let beyond = |(place, (record, _)): (usize, &(Record<'_>, Option<f64>))| {
            let found = self.extrapolation(record.input())?;
            Some(Finding { message: format!("held-out record {place}: {}", found.message), ..found })
        };
        let furthest = records.iter().enumerate().filter_map(beyond).max_by(|a, b| a.value.total_cmp(&b.value));
        self.warnings.extend(furthest);
        let judged = |(place, (record, offset)): (usize, &(Record<'_>, Option<f64>))| match offset {
            // The rest of a record whose beginning was fitted.
            Some(offset) => judged(record, &self.left_by(record, Some((place, *offset)))),
            None => self.validate(record, None),
        };
        records.iter().enumerate().map(judged).collect()
    }

    /// How well the model predicts a record that it was not fitted to, from the virgin state and after the samples that
    /// the record skips.
    ///
    /// `output_offset` is that of the record; without one, the record has its own like every other: the one that suits
    /// it best, and where samples are skipped also the creep that was under way, if creep of log-type was asked for or
    /// left open. To judge
    /// the rest of a record whose beginning was fitted, skip that and give its offset.
    #[must_use]
    pub fn validate(&self, record: &Record<'_>, output_offset: Option<f64>) -> Quality {
        match output_offset {
            Some(offset) => judged(record, &self.left_by(record, Some((usize::MAX, offset)))),
            None => judged(record, &self.left_by(record, None)),
        }
    }

    /// Measured minus modelled output of a record, all its samples: of the record number `fitted` of those that were
    /// fitted, or the rest of it, with its output offset and the creep that was under way; of any other record with
    /// what suits it best, as [`validate`](Self::validate) has it.
    #[must_use]
    pub fn residuals(&self, record: &Record<'_>, fitted: Option<usize>) -> Vec<f64> {
        let own = fitted.and_then(|place| self.output_offsets.get(place).map(|offset| (place, *offset)));
        self.left_by(record, own)
    }

    /// The residuals with the creep under way and the output offset of a fitted record, or with those that suit it
    /// best.
    fn left_by(&self, record: &Record<'_>, own: Option<(usize, f64)>) -> Vec<f64> {
        let dt = self.interval_of(record);
        let left = |response: Vec<f64>| record.output().iter().zip(response).map(|(y, p)| y - p).collect::<Vec<_>>();
        if let Some((place, offset)) = own {
            return left(self.chain.response_in(place, record.input(), dt)).into_iter().map(|e| e - offset).collect();
        }
        let left = left(self.chain.response(record.input(), dt));
        let mut column = underway(&self.chain.creep_underway, record.input().len(), dt);
        if record.skip() == 0 || column.is_empty() {
            column = vec![0.0; record.input().len()];
        }
        let line = Line::through(&record.fitted_of(&column), &record.fitted_of(&left));
        let offset = line.at(0.0);
        left.iter().zip(column).map(|(e, more)| e - offset - line.slope * more).collect()
    }

    /// The sampling interval of a record, that of the fit for one without.
    pub(crate) fn interval_of(&self, record: &Record<'_>) -> f64 {
        record.dt().unwrap_or(self.chain.dt)
    }

    /// Whether the plays have an inverse. Weights are never negative, and an identity has a weight, so the only
    /// obstacles are given thresholds without zero, and weights that are all zero: the position falls where the drive
    /// rises, or follows a Duhem operator alone, beside which they need none.
    ///
    /// # Errors
    /// [`hysteresis_core::Error::NotInvertible`] with the weight at fault.
    pub fn check_invertible(&self) -> Result<(), hysteresis_core::Error> {
        match &self.model {
            Model::Conventional(model) => model.check_invertible(),
            Model::Modified(model) => model.check_invertible(),
        }
    }
}

/// The errors of a model that leaves these residuals.
pub(crate) fn judged(record: &Record<'_>, residuals: &[f64]) -> Quality {
    let [input, measured, left] = [record.input(), record.output(), residuals].map(|signal| record.fitted_of(signal));
    let predicted: Vec<f64> = measured.iter().zip(&left).map(|(y, e)| y - e).collect();
    Quality::of(&measured, &predicted, record.output_range()).with_loops(&input, &measured, &predicted)
}

impl Identification {
    /// The stage that was identified: [`stage_parts`](Self::stage_parts) as they are. It has no limits of its own: what
    /// is made from it stays within the drives of the records.
    ///
    /// # Errors
    /// [`stage::Error`] for parts that no stage may have.
    pub fn stage(&self) -> Result<Stage, stage::Error> {
        Stage::new(self.stage_parts())
    }

    /// The parts of the stage that was identified: hysteresis, creep, dynamics, dead time, noise, and what is known of
    /// them. Limits, slew, units and the sources of the records are left to the caller. A stage counts in seconds: of
    /// records without a sampling interval the dead time is left out, and a warning of the stage says so.
    ///
    /// The forward model of that stage, settled at the first drive, gives the rows that [`predict`](Self::predict)
    /// gives.
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
        let hysteresis = ModifiedPrandtlIshlinskii::from(self.model.clone());
        StageParts {
            creep: self.creep.clone(),
            loop_shift: self.loop_shift,
            relaxing_plays: self.relaxing_plays.clone(),
            slow_gain: self.slow_gain,
            duhem: self.duhem().map(Box::new),
            dynamics: self.linear_dynamics(),
            input_map: self.input_map(),
            output_map: self.output_map(),
            amplifier: self.amplifier(),
            dead_time: self.causal_dead_time(),
            noise: Some(self.sensor_noise()),
            error_band: self.error_band.clone(),
            identified: Some(self.identified()),
            ..StageParts::new(hysteresis)
        }
    }

    /// The dead time of the stage: less than half a sample early is noise, as no stage is early; more is a finding, and
    /// stays.
    fn causal_dead_time(&self) -> f64 {
        let half = 0.5 * self.dt.iter().copied().fold(f64::INFINITY, f64::min);
        self.dead_time.filter(|time| *time >= 0.0 || *time < -half).unwrap_or(0.0)
    }

    /// The Duhem operator beside the plays, if there is one.
    #[must_use]
    pub fn duhem(&self) -> Option<Duhem<MAX_KNOTS>> {
        self.chain.operators.duhem.as_ref()?.operator().ok()
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

pub(crate) fn warning(finding: &Finding) -> StageWarning {
    let Finding { code, severity, message, value, limit, hint, .. } = finding.clone();
    let (code, severity) = (code.name().to_owned(), severity.name().to_owned());
    StageWarning { code, severity, message, value, limit, hint }
}
