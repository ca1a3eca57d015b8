//! Findings: what makes records or a result doubtful, each with its number, its limit and what to do about it.

use std::fmt;

/// What may be wrong with records, or with what was fitted to them.
///
/// A code is a contract: its name stays, and the number behind it may be compared with its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum FindingCode {
    /// Operators whose output never changes in the fitted samples: the input reaches no threshold of theirs, so their
    /// weights are not determined. Value: how many, limit 0.
    UnreachedThreshold,
    /// Fewer reversals inside the input range than the limit 2: dead time, ratios and loop width are weakly determined,
    /// for on full strokes alone each makes up for the others. Value: the number of such reversals, at least a
    /// twentieth of the range high and a tenth of it away from both ends.
    NoMinorLoops,
    /// Operators that this record does not tell apart. Value: the standard error of the least determined combination
    /// of operators over the mean contribution of one operator to the output, limit 1. The error is that of least
    /// squares, sigma / s, with sigma the rms residual, widened where residuals are correlated, and s the smallest
    /// singular value of the operator outputs scaled to unit length (as Belsley, Kuh and Welsch scale them,
    /// "Regression Diagnostics", Wiley 1980).
    CollinearOperators,
    /// The residual follows the speed of the input: a lag, another rate effect, or loop width that the model lacks.
    /// Value and limit as for [`Drift`](Self::Drift).
    RateEffects,
    /// The residual follows time or its logarithm: creep, temperature. Value: the magnitude of the correlation
    /// coefficient; limit: 0.3, about a tenth of the variance of the residual, or what chance gives once in 10^4
    /// records, 4 / sqrt(m), if that is more. m is the number of independent samples, N (1 - a b) / (1 + a b) with a
    /// and b the correlations of neighbouring samples of either signal (Bartlett, J. Roy. Stat. Soc. 98, 536, 1935).
    /// What moves the output by less than 1e-4 of its range rms is not told.
    Drift,
    /// Samples far from their neighbours. Value: the largest distance of a residual from the median of the five
    /// around it, in robust standard deviations of all residuals (1.4826 times the median of magnitudes); limit 7,
    /// which noise of normal distribution passes less than once in 10^8 samples. A deviation below 1e-5 of the range
    /// counts as that. A model without the lag of its actuator may leave such peaks at fast reversals too.
    Outliers,
    /// The output stays at its highest or lowest value while the input moves on. Value: how far the input moves
    /// meanwhile, over its range; limit 0.02, above what eight bits make of a turn.
    ClippedOutput,
    /// The recorded input stays at its highest or lowest value while the output moves on. Value: how far the output
    /// moves meanwhile, over its range; limit: 0.05 and eight standard deviations of its noise, above what creep and
    /// noise do while an input is held.
    ClippedInput,
    /// Fewer fitted samples for each unknown (weights, output offsets, and up to three ratios, input offset, dead time)
    /// than the limit 10, a common rule of thumb. Value: samples for each unknown.
    TooFewSamples,
    /// The record does not tell the frequency of the dynamics: its standard error exceeds 5 %, the search ended at the
    /// edge of its domain, or a plain dead time fits as well as the dynamics do, up to what noise may pretend. Value:
    /// the relative standard error, widened for correlated residuals, and limit 0.05; or the decrease of the sum of
    /// squares by the dynamics, in noise variances, and what noise may pretend.
    ResonanceNotExcited,
    /// The record does not tell the damping: its standard error exceeds 25 %, or the search ended at the edge of its
    /// domain. Value: the relative standard error, widened for correlated residuals; limit 0.25.
    DampingUndetermined,
    /// The output leads the drive: rows pair a drive with a position that was read later, at the end of its interval. Value:
    /// the dead time in samples; limit -0.5.
    NegativeDeadTime,
    /// The record does not tell the dead time from the lag of the dynamics, only their sum. Value: the standard error of the
    /// dead time in samples, widened for correlated residuals; limit 0.25.
    DeadTimeConfounded,
    /// The records do not tell the creep: its standard error exceeds half of it, or it is at a bound. Value: the relative
    /// standard error, widened for correlated residuals; limit 0.5.
    CreepUndetermined,
    /// The gain between the hysteresis model and the output is not 1: the model is not that of this record, or the two
    /// were measured in other units. Value: the distance of the gain from 1; limit 0.05.
    GainNotOne,
    /// The residuals are correlated in time: something is not modelled, and the standard errors, which assume white
    /// noise, are too small. Value: the statistic of Ljung and Box over 20 lags; limit 51.6, five standard deviations
    /// beyond its mean for white noise.
    ResidualColoured,
}

impl FindingCode {
    /// The name, in snake case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::UnreachedThreshold => "unreached_threshold",
            Self::NoMinorLoops => "no_minor_loops",
            Self::CollinearOperators => "collinear_operators",
            Self::RateEffects => "rate_effects",
            Self::Drift => "drift",
            Self::Outliers => "outliers",
            Self::ClippedOutput => "clipped_output",
            Self::ClippedInput => "clipped_input",
            Self::TooFewSamples => "too_few_samples",
            Self::ResonanceNotExcited => "resonance_not_excited",
            Self::DampingUndetermined => "damping_undetermined",
            Self::NegativeDeadTime => "negative_dead_time",
            Self::DeadTimeConfounded => "dead_time_confounded",
            Self::CreepUndetermined => "creep_undetermined",
            Self::GainNotOne => "gain_not_one",
            Self::ResidualColoured => "residual_coloured",
        }
    }

    /// Whether it is about creep, dynamics and dead time.
    pub(crate) fn is_of_linear_part(self) -> bool {
        matches!(
            self,
            Self::ResonanceNotExcited
                | Self::DampingUndetermined
                | Self::NegativeDeadTime
                | Self::DeadTimeConfounded
                | Self::CreepUndetermined
                | Self::GainNotOne
                | Self::ResidualColoured
        )
    }

    /// What to do about it.
    #[must_use]
    pub fn hint(self) -> &'static str {
        match self {
            Self::UnreachedThreshold => "drive further, or fit smaller thresholds",
            Self::NoMinorLoops => "add a decaying sweep to the record",
            Self::CollinearOperators => "fit fewer operators, ask for smooth weights, or record less noise",
            Self::RateEffects => "identify the dynamics as well, or record more slowly",
            Self::Drift => "identify creep as well, or let the stage settle before the record",
            Self::Outliers => "look at these samples, and record again or skip them",
            Self::ClippedOutput => "drive less far, or widen the range of the sensor or its converter",
            Self::ClippedInput => "record the drive that was sent, or widen the range of the monitor",
            Self::TooFewSamples => "record longer, or fit fewer operators",
            Self::ResonanceNotExcited => "drive with a chirp or a step that reaches the resonance",
            Self::DampingUndetermined => "drive with a chirp or a step that lets the resonance ring out",
            Self::NegativeDeadTime => {
                "row k seems to hold the position read at the end of the interval: shift the position column down by one row"
            }
            Self::DeadTimeConfounded => "add a record with a chirp or a step, or give the dead time",
            Self::CreepUndetermined => {
                "add a record that holds a position for long after a large move, or fit no creep"
            }
            Self::GainNotOne => "identify the hysteresis from records of this stage, in the same units",
            Self::ResidualColoured => "fit creep or another order, and look at the residual over time",
        }
    }
}

impl fmt::Display for FindingCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Something found: which, what it means here, and how far its number is past its limit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// Which.
    pub code: FindingCode,
    /// One sentence with the numbers in it.
    pub message: String,
    /// The number that was compared; what it is says [`FindingCode`].
    pub value: f64,
    /// What it was compared with.
    pub limit: f64,
    /// What to do about it.
    pub hint: &'static str,
    /// The record that shows it most, where records are looked at one by one.
    pub record: Option<usize>,
}

impl Finding {
    /// A finding about all records together.
    pub(crate) fn new(code: FindingCode, value: f64, limit: f64, message: String) -> Self {
        Self { code, message, value, limit, hint: code.hint(), record: None }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.code, self.message, self.hint)
    }
}
