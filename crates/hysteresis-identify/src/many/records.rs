//! The records of many actuators, and what is left of their identification: small, and enough to run them.

use hysteresis_core::{Model, Ratios};

use crate::error::{Error, RecordError};
use crate::judge::finding::{Finding, Severity, Verdict};
use crate::judge::finding_code::FindingCode;
use crate::options::Options;
use crate::records::record::{Record, check_finite, check_skip, check_varies};
use crate::records::signal::bounds;

/// Records of many actuators, equally long: one drive for all of them, or one for each.
///
/// What is wrong with the position of one actuator, or with a drive of its own, is found when it is fitted: the others
/// do not suffer.
///
/// ```
/// use hysteresis_identify::ManyRecords;
/// // Two actuators, one after the other: three samples each.
/// let positions = [0.0, 0.9, 2.1, 0.0, 1.1, 1.9];
/// assert_eq!(ManyRecords::shared(&[0.0, 1.0, 2.0], &positions, 0)?.actuators(), 2);
/// # Ok::<(), hysteresis_identify::RecordError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ManyRecords<'a> {
    inputs: &'a [f64],
    positions: &'a [f64],
    samples: usize,
    skip: usize,
    is_shared: bool,
}

impl<'a> ManyRecords<'a> {
    /// One `input` for all actuators; `positions` has as many samples for each of them, one actuator after the other.
    /// The first `skip` samples set the memory only.
    ///
    /// # Errors
    /// As [`Record::new`] for the input; [`RecordError::Length`] unless `positions` holds whole actuators, and at least
    /// one.
    pub fn shared(input: &'a [f64], positions: &'a [f64], skip: usize) -> Result<Self, RecordError> {
        let samples = input.len();
        check_skip("input", samples, skip)?;
        check_finite("input", input)?;
        check_varies("input", bounds(&input[skip..]))?;
        Self::whole(input, positions, samples, skip, true)
    }

    /// `inputs` and `positions` have `samples` samples for each actuator, one actuator after the other. The first
    /// `skip` of each set the memory only.
    ///
    /// # Errors
    /// [`RecordError::Skip`] if nothing is left to fit; [`RecordError::Length`] unless there are as many inputs as
    /// positions, for whole actuators, and at least one.
    pub fn each(inputs: &'a [f64], positions: &'a [f64], samples: usize, skip: usize) -> Result<Self, RecordError> {
        check_skip("inputs", samples, skip)?;
        if inputs.len() != positions.len() {
            return Err(RecordError::Length { argument: "output", expected: inputs.len(), got: positions.len() });
        }
        Self::whole(inputs, positions, samples, skip, false)
    }

    fn whole(
        inputs: &'a [f64],
        positions: &'a [f64],
        samples: usize,
        skip: usize,
        is_shared: bool,
    ) -> Result<Self, RecordError> {
        let expected = positions.len().div_ceil(samples).max(1) * samples;
        if positions.len() != expected {
            return Err(RecordError::Length { argument: "output", expected, got: positions.len() });
        }
        Ok(Self { inputs, positions, samples, skip, is_shared })
    }

    /// How many actuators there are.
    #[must_use]
    pub fn actuators(&self) -> usize {
        self.positions.len() / self.samples
    }

    /// Whether all actuators have one drive.
    pub(crate) fn is_shared(&self) -> bool {
        self.is_shared
    }

    /// The record of one actuator.
    ///
    /// # Errors
    /// [`Error::Record`] with the number of the actuator.
    pub(crate) fn record(&self, actuator: usize) -> Result<Record<'a>, Error> {
        let of = |signals: &'a [f64]| &signals[actuator * self.samples..(actuator + 1) * self.samples];
        let input = if self.is_shared { self.inputs } else { of(self.inputs) };
        Record::new(input, of(self.positions), self.skip).map_err(|error| error.in_record(actuator))
    }
}

/// A finding without its sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct BriefFinding {
    /// Which.
    pub code: FindingCode,
    /// Amber or red.
    pub severity: Severity,
    /// The number that was compared; what it is says [`FindingCode`].
    pub value: f64,
}

impl From<&Finding> for BriefFinding {
    fn from(found: &Finding) -> Self {
        Self { code: found.code, severity: found.severity, value: found.value }
    }
}

/// The model of one of many actuators, and how well it fits.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ActuatorFit {
    /// The hysteresis, with its offsets: before the dead time.
    pub model: Model,
    /// The ratios of its thresholds.
    pub ratios: Ratios,
    /// What the output lags the input, in seconds; in samples where there is no sampling interval.
    pub dead_time: f64,
    /// The root mean square error over the fitted samples, in the unit of the output.
    pub rmse: f64,
    /// The largest error, in the unit of the output.
    pub max_error: f64,
    /// Peak-to-peak of the measured output over the fitted samples.
    pub range: f64,
    /// The standard deviation of the noise, as [`Identification::noise`](crate::Identification::noise) has it.
    pub noise: f64,
    /// What makes record or result doubtful: the codes that [`identify`](crate::identify()) finds without dynamics and
    /// creep.
    pub findings: Vec<BriefFinding>,
}

impl ActuatorFit {
    /// `rmse` / `range`.
    #[must_use]
    pub fn nrmse(&self) -> f64 {
        self.rmse / self.range
    }

    /// Whether the result deserves trust: the worst of its findings.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.findings.iter().map(|found| Verdict::from(found.severity)).max().unwrap_or(Verdict::Green)
    }
}

/// The identified actuators.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ManyIdentifications {
    /// One for each actuator, or why it could not be fitted: [`Error::Record`] with its number.
    pub actuators: Vec<Result<ActuatorFit, Error>>,
    /// As asked for, with what was chosen for all actuators.
    pub options: Options,
}
