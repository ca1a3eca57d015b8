//! From where on each finding is red, and what to try next.

use crate::finding_code::FindingCode;

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
            Self::ClippedInput => (
                "clipped_input",
                From(0.2),
                "record the drive that was sent, or widen the range of the monitor; behind an amplifier at its slew limit, record its output \
                 or drive ramps that it follows",
            ),
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
        }
    }
}
