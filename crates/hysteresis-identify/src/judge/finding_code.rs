//! Which findings there are, and what to do about each.
//!
//! A new finding has a code that says what it means, its place in the order, and a row in the table of names, limits
//! for red and hints.

use std::fmt;

/// What may be wrong with records, or with what was fitted to them.
///
/// A code is a contract: its name stays, and the number behind it may be compared with its limit. `docs/findings.md`
/// lists all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum FindingCode {
    /// The position falls where the drive rises, and with its sign turned the fit is at least twice as good. Value: the
    /// correlation of drive and position; limit -0.5.
    WrongSign,
    /// The loops are traversed backwards: the position leads the drive, as if the two columns were exchanged. Value:
    /// the mean width of the loops, positive if the position leads, over the range of the position; limit 0.01. It is
    /// that between what the drive passes before and after each of its turns, so a bend of the position counts for
    /// nothing.
    LoopBackwards,
    /// The fit leaves more than noise, or very much noise. Value: the rms residual without the noise, which is
    /// estimated from the differences of neighbouring residuals, or 0.15 of it with the noise if that is more, over the
    /// largest range of the position in any record; limit 0.005.
    PoorFit,
    /// The beginning lies on no loop of the model. Value: the residual there over the largest later on, both rms over a
    /// hundredth of the record without its two largest samples; limit 3.
    StartUpTransient,
    /// Samples are missing. Value: the longest gap in sampling intervals, one for neighbours; limit 1.5.
    TimeGap,
    /// Samples are not taken at equal intervals. Value: the rms distance of the times from an even grid, in intervals;
    /// limit 0.1.
    TimeJitter,
    /// Operators whose output never changes in the fitted samples: the input reaches no threshold of theirs, so their
    /// weights are not determined. Value: how many, limit 0. [`identify`](crate::identify()) tells it of given
    /// thresholds only: those that it places itself are where the input is.
    UnreachedThreshold,
    /// Fewer reversals inside the input range than the limit 2: dead time, ratios and loop width are weakly determined,
    /// for on full strokes alone each makes up for the others. Value: the number of such reversals, at least a
    /// twentieth of the range high and a tenth of it away from both ends.
    NoMinorLoops,
    /// Most samples belong to repetitions of one loop, which say little new and weigh down all others. Value: the share
    /// of the samples; limit 0.6, looked for among ten such loops or more.
    IdenticalLoops,
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
    /// What moves the output by less than 1e-4 of its range rms is not told. Beside the operators, which take up a part
    /// of it: the multiple correlation of what they leave with time and a slow exponential; limit 0.5. Where these
    /// explain most, it is told in the place of [`StartUpTransient`](Self::StartUpTransient).
    Drift,
    /// The residual follows the input: a bend of the whole curve that the model lacks. Value: the multiple correlation
    /// with the first three powers of the input; limit as for [`Drift`](Self::Drift), but 0.6, and what moves the
    /// output by less than 2e-3 of its range rms is not told.
    InputEffects,
    /// The residual follows the amplitude of the last swing: gain or centre of the loops change with it. Value: the
    /// multiple correlation with the amplitude and with its product with the input; limit as for
    /// [`Drift`](Self::Drift), but 0.45, and what moves the output by less than 1e-3 of its range rms is not told.
    AmplitudeEffects,
    /// Loops that only decay do not tell a map from a loop shift, and the result has neither: the best map that was
    /// tried predicts better than none, but no better than a loop shift. Value: by which factor the map lowers the mean
    /// square error on stretches that were not fitted; limit 1.2, and what explains less than 2e-3 of the range rms is
    /// not told.
    MapNotTold,
    /// A Duhem operator falls by more than the plays rise right after a reversal: the stage has no inverse. Value: the
    /// flattest slope of their sum; limit 0.
    NoInverse,
    /// A Duhem operator that comes to no loop of its own: it follows the records, and runs away on other drives. Value:
    /// by how much it still moves, over its stroke, in the tenth round over the range; limit 0.05.
    OperatorRunsAway,
    /// Samples far from their neighbours. Value: the largest distance of a residual from the median of the five
    /// around it, in robust standard deviations of all residuals (1.4826 times the median of magnitudes); limit 7,
    /// which noise of normal distribution passes less than once in 10^8 samples. A deviation below 1e-5 of the range
    /// counts as that. A model without the lag of its actuator may leave such peaks at fast reversals too.
    Outliers,
    /// The output stays at its highest or lowest value while the input goes on outwards, by more than three times what
    /// it does while a coarse or slow sensor stays at other values: a flat that begins at a turn is hysteresis. Or the
    /// record begins there, and the input comes back by more than three times as much as any other stay shows. Value:
    /// how far the input moves meanwhile, over its range; limit 0.02, above what eight bits make of a turn.
    ClippedOutput,
    /// The recorded input stays at its highest or lowest value while the output moves on and comes back. Value: how far
    /// the output moves meanwhile, over its range; limit: 0.05 and eight standard deviations of its noise. What goes one
    /// way alone relaxes.
    ClippedInput,
    /// The position stands still while the drive moves on, at any value. Value: how far the drive moves meanwhile, over
    /// its range, if that is more than three times what it does while a coarse or slow sensor stays at its other
    /// values; limit 0.03.
    StuckOutput,
    /// The recorded drive stands still while the position moves on, and then catches up with a jump that the position
    /// does not answer: no rest, and no step of a staircase. Value: how far the position moves meanwhile, over its
    /// range; limit: 0.03 and eight standard deviations of its noise.
    StuckInput,
    /// Samples of the drive that jump far from their neighbours and back, and that the position does not follow. Value:
    /// the largest distance from the median of eleven, or the height of a run of one value, over the range of the
    /// medians; limit 0.03.
    InputOutliers,
    /// The drive has noise that the position does not follow: it is the reading of a monitor, and biases thresholds and
    /// weights. Value: the standard deviation of that noise over the range of the drive; limit 0.003.
    NoisyInput,
    /// The position jumps from one of its ends to the other and back by the same height, though the drive does not: a
    /// counter that wraps. Value: how often; limit 0.
    OutputWraps,
    /// The position of one record moves by another factor of its drive than those of most: another unit, or another
    /// stage. Value: that factor over theirs; limit 3.
    RecordsDiffer,
    /// The position follows the drive without hysteresis: it may be the drive's own monitor. Value: the mean width of
    /// the loops over the range of the position; limit 0.001, below which it is one.
    NoHysteresis,
    /// Rows of one and the same drive and position between rows that are far from them: a reading that failed. Value:
    /// how many of them; limit 1.
    FailedRows,
    /// The position is later than the drive, and no sampling interval is known, so nothing that has a time can be
    /// fitted. Value: the dead time in samples; limit 0.5.
    NoInterval,
    /// Stretches of three samples and more, up to a tenth of the record, that lie far from the model while those about
    /// them do not. Value: how far the furthest residual is, over the range; limit 0.02 and ten robust standard
    /// deviations.
    BadStretch,
    /// The residual goes on at another level from one sample to the next. Value: by how much, over the range; limit
    /// 0.01 and seven robust standard deviations of its steps.
    OutputJump,
    /// The position moves by another factor of the drive from some sample on: another unit, gain or range. Value: the
    /// ratio of the gains of both parts, if with them at most a tenth of the squares is left; limit 1.25.
    GainChange,
    /// The sampling interval changes within the record. Value: the longest over the shortest mean of 25 steps; limit
    /// 1.2.
    RateChange,
    /// The position does what the drive does not tell. Value: the rms residual over the standard deviation of the
    /// position, the largest of all records; limit 0.6.
    Unrelated,
    /// Fewer fitted samples for each unknown (weights, output offsets, and up to three ratios, input offset, dead time)
    /// than the limit 10, a common rule of thumb. Value: samples for each unknown.
    TooFewSamples,
    /// A drive beyond those of the fitted records: the model goes on there with the slope of its last operator. Value:
    /// how far, over the range of the fitted drives; limit 0.01.
    Extrapolation,
    /// The dead time is long beside the period of the drive, so it stands for something else: creep, or loop width.
    /// Value: the dead time over the mean period of the slowest record; limit 0.1.
    ImplausibleDeadTime,
    /// The output leads the drive: rows pair a drive with a position that was read later, at the end of its interval.
    /// Value: the dead time in samples that the records would tell; that of the result is 0. Limit -0.5.
    NegativeDeadTime,
    /// The records do not tell the dead time: from the lag of dynamics, or at all. Value: the standard error of the
    /// dead time in samples, widened for correlated residuals; limit 0.25 beside dynamics, else the dead time itself
    /// where that is longer than half a sample.
    DeadTimeConfounded,
    /// The record does not tell the frequency of the dynamics: its standard error exceeds 5 %, the search ended at the
    /// edge of its domain, or a plain dead time fits as well as the dynamics do, up to what noise may pretend. Value:
    /// the relative standard error, widened for correlated residuals, and limit 0.05; or the decrease of the sum of
    /// squares by the dynamics, in noise variances, and what noise may pretend.
    ResonanceNotExcited,
    /// The records tell fewer modes than were asked for: another one would lower the sum of squares too little, or is
    /// not apart from the others. Value: the decrease, in noise variances, 0 where no such mode was found; limit: what
    /// noise may pretend.
    ModeNotTold,
    /// The record does not tell the damping: its standard error exceeds 25 %, or the search ended at the edge of its
    /// domain. Value: the relative standard error, widened for correlated residuals; limit 0.25.
    DampingUndetermined,
    /// The records do not tell the creep: its standard error exceeds half of it and a thousandth of a move, or it is at
    /// its bound. Value: the relative standard error, widened for correlated residuals; limit 0.5.
    CreepUndetermined,
    /// The gain between the hysteresis model and the output is not 1: the model is not that of this record, or the two
    /// were measured in other units. Value: the distance of the gain from 1; limit 0.05.
    GainNotOne,
    /// The residuals are correlated in time, and what of them is no white noise matters: the noise is coloured, or
    /// something is not modelled. The standard errors allow for it. Value: the root mean square of what is left beside
    /// white noise, over the range of the position; limit 0.001, or 0.3 of the whole residual if that is more. Told
    /// where the statistic of Ljung and Box over 20 lags is above 51.6, five standard deviations beyond its mean for
    /// white noise; without dynamics and creep where nothing is worse.
    ResidualColoured,
    /// All loops have one amplitude and one speed: the records do not tell how the hysteresis depends on the rate.
    /// Value: the largest over the smallest speed of the drive on its way from turn to turn, the slowest and the
    /// fastest twentieth of the time left out, or the same of the frequency if that is more; limit 1.5. Where both the
    /// speed and the frequency vary by less, one speed is all there is.
    RateDependenceNotTold,
    /// The model has three or four of two maps, relaxing plays and a Duhem operator, which follow any loop together, and
    /// loops of one speed or about one middle leave open what they do in other motions. Value: how far the error band
    /// of 95 % reaches at half of the samples, without noise, over the range of the position; limit 0.0045. Told where
    /// nothing else is.
    WideErrorBand,
    /// The position leaks towards its mean: charge that leaks off, or a sensor or an amplifier that passes nothing
    /// slow. Value: the correlation of what operators and slow changes leave of the residual with the falling integral
    /// of the position; limit 0.7, about half of the squares. What moves the position by less than 1 % of its range is
    /// not told.
    Leakage,
    /// The loops on which the pairs of places lie are all of one size: one known length holds the scale of that loop,
    /// but how the gain of other loops differs from it follows from the shape of the model alone. Value: the smallest
    /// over the largest stroke of the drive between turns, on which pairs lie; limit 0.8.
    OneLoopSize,
    /// Pairs of places that contradict the others were left out. Value: their share of all pairs; limit 0.02.
    WrongPairs,
    /// Known lengths that contradict the others were left out. Value: their share of all lengths; limit 0.
    WrongLengths,
    /// Pairs of places that say nothing: every operator has the same output at both instants, as on two passes along
    /// the same branch. Value: their share of all pairs; limit 0.5.
    UninformativePairs,
    /// The model is not at the same place at both instants of a pair. Value: the robust standard deviation of the
    /// distances over the range of the position; limit 0.01.
    PlacesDiffer,
    /// Known lengths without pairs are missed: one of them is wrong, or the stage did not begin virgin. Value: the rms
    /// of what the model misses over that of a straight line through drives and lengths; limit 0.25.
    LengthsMissed,
    /// Pairs and lengths leave positions open. Value: the standard error of the positions along the drives, rms, over
    /// their range, the largest of all drives; limit 0.01.
    PositionsNotTold,
    /// What was recorded does not tell how the position follows the temperature, or how much later. Value: the larger
    /// of the relative standard errors of sensitivity and lag; 1 for a lag as long as the drive; limit 0.25.
    TemperatureNotTold,
    /// The record does not tell hysteresis inside the dynamics: a linear oscillator predicts samples that were not
    /// fitted as well. Value: the rms error there of the oscillator with hysteresis over that of the linear one; limit
    /// 0.9.
    HysteresisInsideNotTold,
    /// Curves without memory in the place of the hysteresis of several axes predict samples that were not fitted as
    /// well. Value: the error there of the model with hysteresis over that of the other; limit 0.9.
    MemoryNotTold,
    /// In reading a file something was taken for granted that the file speaks against. Value: 1, limit 0.
    Assumed,
}

impl FindingCode {
    /// All codes, causes before what follows from them.
    pub const ALL: [Self; 59] = [
        Self::WrongSign,
        Self::RecordsDiffer,
        Self::LoopBackwards,
        Self::NoHysteresis,
        Self::NegativeDeadTime,
        Self::ClippedOutput,
        Self::ClippedInput,
        Self::StuckOutput,
        Self::StuckInput,
        Self::InputOutliers,
        Self::FailedRows,
        Self::OutputWraps,
        Self::GainChange,
        Self::Unrelated,
        Self::NoInterval,
        Self::TimeGap,
        Self::RateChange,
        Self::TimeJitter,
        Self::StartUpTransient,
        Self::NoisyInput,
        Self::TooFewSamples,
        Self::NoMinorLoops,
        Self::IdenticalLoops,
        Self::UnreachedThreshold,
        Self::CollinearOperators,
        Self::PoorFit,
        Self::Drift,
        Self::RateEffects,
        Self::AmplitudeEffects,
        Self::InputEffects,
        Self::MapNotTold,
        Self::NoInverse,
        Self::OperatorRunsAway,
        Self::Outliers,
        Self::BadStretch,
        Self::OutputJump,
        Self::Extrapolation,
        Self::ImplausibleDeadTime,
        Self::DeadTimeConfounded,
        Self::ResonanceNotExcited,
        Self::ModeNotTold,
        Self::DampingUndetermined,
        Self::CreepUndetermined,
        Self::GainNotOne,
        Self::ResidualColoured,
        Self::RateDependenceNotTold,
        Self::WideErrorBand,
        Self::Leakage,
        Self::OneLoopSize,
        Self::WrongPairs,
        Self::WrongLengths,
        Self::UninformativePairs,
        Self::PlacesDiffer,
        Self::LengthsMissed,
        Self::PositionsNotTold,
        Self::TemperatureNotTold,
        Self::HysteresisInsideNotTold,
        Self::MemoryNotTold,
        Self::Assumed,
    ];

    /// The name, in snake case.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.about().0
    }

    /// Whether it is about creep, dynamics and dead time.
    pub(crate) fn is_of_linear_part(self) -> bool {
        matches!(
            self,
            Self::ResonanceNotExcited
                | Self::ModeNotTold
                | Self::DampingUndetermined
                | Self::NegativeDeadTime
                | Self::DeadTimeConfounded
                | Self::CreepUndetermined
                | Self::GainNotOne
                | Self::ResidualColoured
        )
    }

    /// Whether it is about what a fit made of the records, so that it says nothing where a defect of the record spoils
    /// the fit.
    pub(crate) fn is_of_fit(self) -> bool {
        let of_residual = matches!(
            self,
            Self::StartUpTransient
                | Self::Drift
                | Self::RateEffects
                | Self::AmplitudeEffects
                | Self::InputEffects
                | Self::MapNotTold
                | Self::Outliers
                | Self::BadStretch
                | Self::OutputJump
                | Self::Unrelated
                | Self::Leakage
        );
        let of_model = matches!(self, Self::UnreachedThreshold | Self::CollinearOperators | Self::ImplausibleDeadTime);
        of_residual || of_model || self.is_of_linear_part()
    }

    /// Whether it compares what the drive does with what the position does, so that it says nothing where the sign is
    /// wrong.
    pub(crate) fn compares_drive_and_position(self) -> bool {
        matches!(
            self,
            Self::LoopBackwards
                | Self::NegativeDeadTime
                | Self::ClippedInput
                | Self::StuckInput
                | Self::StuckOutput
                | Self::InputOutliers
                | Self::NoInterval
        )
    }

    /// Whether no fit to such a record says anything about the stage.
    pub(crate) fn spoils_a_fit(self) -> bool {
        matches!(self, Self::RecordsDiffer | Self::GainChange | Self::OutputWraps | Self::FailedRows)
    }

    /// What to try next, whatever the record; a finding may say it more exactly.
    #[must_use]
    pub fn hint(self) -> &'static str {
        self.about().2
    }

    /// From where on it is red.
    pub(crate) fn red(self) -> Red {
        self.about().1
    }
}

impl fmt::Display for FindingCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// From where on a finding is red.
#[derive(Clone, Copy)]
pub(crate) enum Red {
    Never,
    Always,
    From(f64),
    Below(f64),
    /// From so many times its limit on.
    Factor(f64),
}

impl FindingCode {
    /// Its name, from where on it is red, and what to try.
    #[expect(clippy::too_many_lines, reason = "a table with a row for every code")]
    pub(crate) fn about(self) -> (&'static str, Red, &'static str) {
        use Red::{Always, Below, Factor, From, Never};
        match self {
            Self::WrongSign => {
                ("wrong_sign", Always, "turn the sign of the position: --negate-output, or -y in Python")
            }
            Self::LoopBackwards => (
                "loop_backwards",
                Always,
                "exchange drive and position if their columns are swapped; reverse the rows if they run from the last to the \
                 first; if each row holds a position that was read after the drive had moved on, shift the position column down",
            ),
            Self::RecordsDiffer => {
                ("records_differ", Always, "bring all records to the same units, and leave those of another stage out")
            }
            Self::NoHysteresis => (
                "no_hysteresis",
                Never,
                "check that the position is neither the monitor of the drive nor the sensor of a closed loop: those have no hysteresis",
            ),
            Self::PoorFit => (
                "poor_fit",
                Factor(10.0),
                "follow the other hints first; if it is noise, look at the sensor and whether the rows are in the order of time; else try more \
                 operators, split weights, --dynamics, --creep or maps (--output-map smooth, --input-map smooth)",
            ),
            Self::StartUpTransient => ("start_up_transient", Never, "skip the beginning (--skip)"),
            Self::TimeGap => ("time_gap", Never, "record without gaps, or fit the part before or after the gap"),
            Self::TimeJitter => ("time_jitter", Factor(5.0), "let a timer take the samples, or record more slowly"),
            Self::UnreachedThreshold => ("unreached_threshold", Never, "drive further, or fit smaller thresholds"),
            Self::NoMinorLoops => ("no_minor_loops", Never, "add a decaying sweep to the record"),
            Self::IdenticalLoops => ("identical_loops", Never, "keep about five of these loops (--skip, --rows)"),
            Self::CollinearOperators => {
                ("collinear_operators", Never, "fit fewer operators, ask for smooth weights, or record less noise")
            }
            Self::RateEffects => ("rate_effects", Never, "identify the dynamics as well, or record more slowly"),
            Self::Drift => ("drift", Never, "identify creep as well, or let the stage settle before the record"),
            Self::InputEffects => (
                "input_effects",
                Never,
                "fit a map (--output-map smooth), more operators, or split weights (--weights split)",
            ),
            Self::MapNotTold => (
                "map_not_told",
                Never,
                "add a record whose loops grow again; or ask for the map (--output-map smooth, --input-map smooth), and compare on a \
                 record that was not fitted",
            ),
            Self::NoInverse => (
                "no_inverse",
                Always,
                "leave the Duhem operator to the search (duhem=\"auto\"), or leave it out (duhem=None)",
            ),
            Self::OperatorRunsAway => (
                "operator_runs_away",
                Always,
                "leave the Duhem operator out (duhem=None), or to the search (duhem=\"auto\")",
            ),
            Self::AmplitudeEffects => (
                "amplitude_effects",
                Never,
                "split weights (--weights split), or loops of the amplitudes that you will use",
            ),
            Self::Outliers => ("outliers", Never, "leave these samples out of the fit (--leave-out)"),
            Self::BadStretch => ("bad_stretch", From(0.2), "leave these samples out of the fit (--leave-out)"),
            Self::OutputJump => (
                "output_jump",
                From(0.1),
                "give both parts a zero of their own (--leave-out), or fit one of them (--rows, --skip)",
            ),
            Self::StuckOutput => ("stuck_output", From(0.2), "leave these samples out of the fit (--leave-out)"),
            Self::StuckInput => {
                ("stuck_input", From(0.2), "put a straight line in the place of this part of the drive (--mend)")
            }
            Self::InputOutliers => {
                ("input_outliers", From(0.5), "put straight lines in the place of these samples of the drive (--mend)")
            }
            Self::FailedRows => {
                ("failed_rows", Always, "put straight lines in the place of these samples of the drive (--mend)")
            }
            Self::OutputWraps => {
                ("output_wraps", Always, "add the height of the jumps up from each on: numpy.unwrap with that period")
            }
            Self::NoisyInput => (
                "noisy_input",
                Never,
                "take the drive that was sent instead of one that was read; or average the drive over some samples before the fit",
            ),
            Self::NoInterval => (
                "no_interval",
                Never,
                "say how fast the samples were taken: --rate HZ, or dt in Python; then dead time, dynamics and creep are fitted",
            ),
            Self::GainChange => ("gain_change", Always, "fit the part before or after the change (--rows, --skip)"),
            Self::RateChange => ("rate_change", Never, "fit the part before or after the change (--rows, --skip)"),
            Self::Unrelated => (
                "unrelated",
                From(0.8),
                "check that these are the columns of one drive and its position, or record less noise",
            ),
            Self::ClippedOutput => {
                ("clipped_output", From(0.1), "drive less far, or widen the range of the sensor or its converter")
            }
            Self::ClippedInput => {
                ("clipped_input", From(0.2), "record the drive that was sent, or widen the range of the monitor")
            }
            Self::TooFewSamples => ("too_few_samples", Below(3.0), "record longer, or fit fewer operators"),
            Self::Extrapolation => {
                ("extrapolation", From(0.1), "identify from records that reach these drives, or drive less far")
            }
            Self::ImplausibleDeadTime => (
                "implausible_dead_time",
                Factor(2.5),
                "check that drive and position are of the same time, and add minor loops or a faster record",
            ),
            Self::NegativeDeadTime => (
                "negative_dead_time",
                Always,
                "row k seems to hold the position read at the end of the interval: shift the position column down by one row; or, if the \
                 damping is above 1, fit a lag of first order (--dynamics 1)",
            ),
            Self::DeadTimeConfounded => {
                ("dead_time_confounded", Never, "add a record with a chirp or a step, or give the dead time")
            }
            Self::ResonanceNotExcited => {
                ("resonance_not_excited", Never, "drive with a chirp or a step that reaches the resonance")
            }
            Self::ModeNotTold => {
                ("mode_not_told", Never, "drive with a chirp or a step that reaches this mode, or ask for fewer modes")
            }
            Self::DampingUndetermined => {
                ("damping_undetermined", Never, "drive with a chirp or a step that lets the resonance ring out")
            }
            Self::CreepUndetermined => (
                "creep_undetermined",
                Never,
                "add a record that holds a position for long after a large move, or fit no creep; at its bound it may stand for heat or \
                 another lag: compare with --dynamics 1 --creep none",
            ),
            Self::GainNotOne => {
                ("gain_not_one", From(0.5), "identify the hysteresis from records of this stage, in the same units")
            }
            Self::ResidualColoured => (
                "residual_coloured",
                Never,
                "fit creep or another order, let the stage settle before the record, and look at the residual over time",
            ),
            Self::WideErrorBand => (
                "wide_error_band",
                Never,
                "add a record of other speeds and of loops about several middles, as those of mpi-hyst excite; or ask for the band of a \
                 motion before it is driven",
            ),
            Self::RateDependenceNotTold => (
                "rate_dependence_not_told",
                Never,
                "add a record of these loops at another speed, ten times as fast or as slow as those that you will use, or of a chirp",
            ),
            Self::Leakage => (
                "leakage",
                Never,
                "couple sensor and amplifier to direct current, and let an amplifier of voltage hold the drive; no term of a stage stands for \
                 a leak, so use the result at the rates of the records alone",
            ),
            Self::OneLoopSize => {
                ("one_loop_size", Never, "add scans of another size, or a known length in one; or use this size alone")
            }
            Self::WrongPairs => {
                ("wrong_pairs", From(0.3), "match lines with more structure, or give each pair its uncertainty")
            }
            Self::WrongLengths => {
                ("wrong_lengths", From(0.1), "look at the rows that are named: measure them again, or leave them out")
            }
            Self::UninformativePairs => {
                ("uninformative_pairs", Never, "pair instants of opposite branches: trace with retrace, up with down")
            }
            Self::PlacesDiffer => (
                "places_differ",
                From(0.05),
                "match more exactly; where that does not help, the stage has what the model lacks: dynamics, or a map",
            ),
            Self::LengthsMissed => (
                "lengths_missed",
                Never,
                "look at that row; for a stage that was driven before leave input_offset open: then it is searched",
            ),
            Self::PositionsNotTold => (
                "positions_not_told",
                Never,
                "add pairs on loops of other sizes, or lengths; or give what is known: input_offset, dead_time, a smoothness",
            ),
            Self::TemperatureNotTold => (
                "temperature_not_told",
                Never,
                "let it change by more, and in another way than the drive; or leave it out",
            ),
            Self::HysteresisInsideNotTold => (
                "hysteresis_inside_not_told",
                Never,
                "drive further; if that does not help, hysteresis stands in front of the dynamics: `identify` is for that",
            ),
            Self::MemoryNotTold => {
                ("memory_not_told", Never, "drive slower and further, so that loops stand out of what the dynamics do")
            }
            Self::Assumed => {
                ("assumed", Never, "say what it is with the option that is named, or mend the file; `look` shows it")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = include_str!("../../../../docs/findings.md");

    /// The rows of the table in the documentation: code, meaning, number, limit, red, what to try.
    fn rows() -> Vec<Vec<&'static str>> {
        let lines = PAGE.lines().filter(|line| line.starts_with("| `"));
        lines.map(|line| line.trim_matches('|').split(" | ").map(str::trim).collect()).collect()
    }

    #[test]
    fn the_list_has_every_code_once() {
        let places: std::collections::BTreeSet<usize> = FindingCode::ALL.iter().map(|code| *code as usize).collect();
        assert_eq!((places.len(), places.last()), (FindingCode::ALL.len(), Some(&(FindingCode::Assumed as usize))));
        assert_eq!(places.len(), FindingCode::Assumed as usize + 1);
    }

    #[test]
    fn the_documentation_has_a_complete_row_for_every_code() {
        let listed: Vec<&str> = rows().iter().map(|row| row[0].trim_matches('`')).collect();
        assert_eq!(listed, FindingCode::ALL.map(FindingCode::name));
        for (row, code) in rows().iter().zip(FindingCode::ALL) {
            assert!(row.len() == 6 && row.iter().all(|cell| !cell.is_empty()), "{row:?}");
            let is_red = match code.red() {
                Red::Never => "-".to_owned(),
                Red::Always => "always".to_owned(),
                Red::From(bound) => bound.to_string(),
                Red::Below(bound) => format!("below {bound}"),
                Red::Factor(factor) => (factor * row[3].parse::<f64>().unwrap()).to_string(),
            };
            assert_eq!(row[4], is_red, "{code}");
        }
    }
}
