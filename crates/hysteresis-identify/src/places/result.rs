//! A stage that was identified from places, and how far it can be trusted.

use hysteresis_control::linear::{Creep, LinearDynamics};
use hysteresis_control::stage;
use hysteresis_control::stage::{Identified, Stage, StageParts, TemperatureTerm};
use hysteresis_core::{Duhem, MAX_KNOTS, Model, ModifiedPrandtlIshlinskii, PiecewiseLinearMap, Ratios};

use crate::choose::cross_validation::CrossValidation;
use crate::error::RecordError;
use crate::fit::response::Chain;
use crate::judge::finding::{Finding, Verdict};
use crate::places::beside::Courses;
use crate::places::rivals::{Rival, distances};
use crate::places::rows::kept;
use crate::records::record::check_finite;
use crate::records::signal::centred;
use crate::result::identification::warning;
use crate::terms::operators::ModelKind;
use crate::uncertainty::standard_errors::Spread;

/// What was tried: a model with or without creep, and how it predicts pairs that it was not fitted to.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlacesCandidate {
    /// Which model.
    pub model: ModelKind,
    /// Whether what is seen drifts.
    pub drift: bool,
    /// Whether a Duhem operator stands beside the plays.
    #[cfg_attr(feature = "serde", serde(default))]
    pub duhem: bool,
    /// Whether there is a map in front of the hysteresis.
    #[cfg_attr(feature = "serde", serde(default))]
    pub input_map: bool,
    /// How it predicts pairs of stretches that it was not fitted to, at the smoothness that suits it.
    pub validation: CrossValidation,
}

impl PlacesCandidate {
    /// Whether it has all terms that another one has.
    pub(crate) fn contains(&self, other: &Self) -> bool {
        let kinds = self.model == other.model || self.model == ModelKind::Modified;
        let terms = self.drift >= other.drift && self.duhem >= other.duhem && self.input_map >= other.input_map;
        kinds && terms && self.validation.creep >= other.validation.creep
    }
}

/// What [`identify_places`](crate::identify_places) found.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlacesIdentification {
    /// The hysteresis, in front of creep and dead time. Pairs do not tell an offset: the position is 0 at the first
    /// sample of the first drive.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::model"))]
    pub model: Model,
    /// The ratios of its thresholds; [`Ratios::PLAY`] for the conventional model.
    pub ratios: Ratios,
    /// What the position lags the drive, in seconds.
    pub dead_time: f64,
    /// The creep, if there is any.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::creep"))]
    pub creep: Option<Creep>,
    /// The searched amplitudes of creep.
    pub creep_amplitudes: Vec<f64>,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The lowest and the highest drive.
    pub drive_range: (f64, f64),
    /// The lowest and the highest position of the model in these drives.
    pub position_range: (f64, f64),
    /// How far apart the model is at the two instants of every pair, in the unit of the position.
    pub mismatches: Vec<f64>,
    /// The robust standard deviation of the mismatches, for a pair of middling uncertainty: of the matching, and of
    /// what the model lacks.
    pub mismatch: f64,
    /// Modelled minus known length, for every length.
    pub length_errors: Vec<f64>,
    /// The pairs that contradict the others; they were left out of the fit.
    pub wrong_pairs: Vec<usize>,
    /// The lengths that contradict the others; they were left out of the fit, too. Empty with fewer than ten
    /// more lengths than unknowns, of which there is one beside pairs, the scale.
    pub wrong_lengths: Vec<usize>,
    /// The pairs that say nothing.
    pub uninformative_pairs: Vec<usize>,
    /// Standard errors of the weights, which allow for mismatches that are alike along the time or along the drive.
    pub weights_std: Vec<f64>,
    /// Standard error of the input offset; 0 if it was given.
    pub input_offset_std: f64,
    /// Standard error of the dead time in seconds; 0 if it was given.
    pub dead_time_std: f64,
    /// Standard errors of the searched amplitudes of creep.
    pub creep_std: Vec<f64>,
    /// The amplitudes of the drift in every drive, see [`PlacesOptions::drift`](crate::PlacesOptions::drift); empty
    /// without.
    pub drift_amplitudes: Vec<Vec<f64>>,
    /// What the temperature adds, if temperatures were given: nothing at the first sample of the first drive.
    pub temperature: Option<TemperatureTerm>,
    /// Standard errors of its sensitivity, and of its time constant; 0 if it was given.
    pub temperature_std: (f64, f64),
    /// How smooth the weights were asked to be.
    pub smoothness: f64,
    /// What was tried, the simplest first.
    pub candidates: Vec<PlacesCandidate>,
    /// What makes the numbers doubtful.
    pub warnings: Vec<Finding>,
    pub(crate) drive_samples: Vec<usize>,
    pub(crate) courses: Courses,
    pub(crate) chain: Chain,
    pub(crate) spread: Spread,
    pub(crate) rivals: Vec<Rival>,
    pub(crate) output_offset: f64,
}

impl PlacesIdentification {
    /// Whether the result deserves trust: the worst of its [`warnings`](Self::warnings).
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.warnings)
    }

    /// By how much what is seen has drifted at every sample of a drive, in the unit of the position: it adds to the
    /// position of the stage, but for an offset. Zero without a drift, and it goes to zero where it is what goes on of
    /// before the drive.
    ///
    /// # Errors
    /// [`hysteresis_core::Error::Whole`] for a number that no drive has.
    pub fn drift(&self, drive: usize) -> Result<Vec<f64>, hysteresis_core::Error> {
        let expected = "the number of a drive";
        let samples = self.drive_samples.get(drive);
        let samples = *samples.ok_or_else(|| hysteresis_core::Error::whole("drive", None, expected, drive))?;
        Ok(self.courses.of(self.drift_amplitudes.get(drive).map_or(&[], Vec::as_slice), samples))
    }

    /// The position for a drive that starts from the virgin state and at rest at its first value, sampled every
    /// [`dt`](Self::dt), at the temperature of the first sample.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        Ok(self.chain.response(input, self.dt).into_iter().map(|y| self.output_offset + y).collect())
    }

    /// The standard deviation of every sample of [`predict`](Self::predict): the root of the sum of two squares. One is
    /// what errors of the pairs and of the lengths make of it. The other is how far the
    /// [`candidates`](Self::candidates) are from it, root mean square over all of them, the chosen one with distance
    /// zero. Each counts by the square of its trust: the rms error that the chosen one leaves of pairs that were not
    /// fitted over the one that it leaves. Those that have all terms of the chosen one and more count less: the square
    /// of their distance by the share of the mismatches that is alike from pair to pair, and no noise. What all of them
    /// lack comes on top.
    ///
    /// Pairs do not tell an offset. So it is that of the position about its mean over the input; with lengths alone,
    /// from the first sample of the first drive.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict_std(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        let tell_no_offset = !self.mismatches.is_empty();
        let of = |chain: &Chain, offset: f64| {
            let response = chain.response(input, self.dt).into_iter().map(|y| offset + y).collect::<Vec<_>>();
            if tell_no_offset { centred(&response) } else { response }
        };
        let others = self.rivals.iter().map(|rival| (of(&rival.chain, rival.output_offset), &rival.trust));
        let apart = distances(&of(&self.chain, self.output_offset), others);
        let own = if tell_no_offset { self.spread.about_mean(input, self.dt) } else { self.spread.of(input, self.dt) };
        Ok(own.iter().zip(apart).map(|(deviation, apart)| deviation.hypot(apart)).collect())
    }

    /// The stage: [`stage_parts`](Self::stage_parts) as they are.
    ///
    /// # Errors
    /// [`stage::Error`] for parts that no stage may have.
    pub fn stage(&self) -> Result<Stage, stage::Error> {
        Stage::new(self.stage_parts())
    }

    /// The Duhem operator beside the plays, if there is one.
    #[must_use]
    pub fn duhem(&self) -> Option<Duhem<MAX_KNOTS>> {
        self.chain.operators.duhem.as_ref()?.operator().ok()
    }

    /// The map in front of the hysteresis, if there is one: drive in, drive out.
    #[must_use]
    pub fn input_map(&self) -> Option<PiecewiseLinearMap> {
        self.chain.operators.path.map.as_ref()?.map(0.0).ok()
    }

    /// The parts of the stage: hysteresis, creep, dead time, and what is known of them. It has no sensor, so no noise
    /// of one.
    #[must_use]
    pub fn stage_parts(&self) -> StageParts {
        let hysteresis = ModifiedPrandtlIshlinskii::from(self.model.clone());
        let pairs = kept(&self.mismatches, &self.wrong_pairs);
        let lengths = kept(&self.length_errors, &self.wrong_lengths);
        let max_error = pairs.chain(lengths).fold(0.0, |most: f64, error| error.abs().max(most));
        StageParts {
            creep: self.creep.clone(),
            duhem: self.duhem().map(Box::new),
            input_map: self.input_map(),
            dynamics: LinearDynamics::none(),
            dead_time: self.dead_time,
            temperature: self.temperature,
            identified: Some(Identified {
                drive_range: self.drive_range,
                position_range: self.position_range,
                dt: vec![self.dt],
                rmse: self.mismatch,
                max_error,
                parameters: Vec::new(),
                covariance: Vec::new(),
                warnings: self.warnings.iter().map(warning).collect(),
                records: Vec::new(),
            }),
            ..StageParts::new(hysteresis)
        }
    }
}
