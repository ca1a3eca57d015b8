//! What identification knows of a stage: what still holds with other parts, and how well it is known for what is
//! designed from it.

use core::f64::consts::TAU;

use super::{Error, Identified, Stage, StageParts};
use crate::learning::LoopUncertainty;
use crate::linear::LinearDynamics;
use crate::tuning::{DAMPED, ModeUncertainty, modes};

/// By how much the lag may change before the stage is another one: this share of it, and of the sampling interval.
const SAME_LAG: (f64, f64) = (0.02, 0.25);

/// Where the lag of linear dynamics is read off, in Hz: far below any mode, far above rounding.
const LOW_FREQUENCY: f64 = 1e-6;

impl Stage {
    /// The same stage with other parts; of what identification knows, what still holds.
    ///
    /// The lag of amplifier, dynamics and dead time together was identified: parts that change it are refused, as the
    /// dead time holds the lag of whatever was not fitted. Another hysteresis or map takes all that was identified with
    /// it, another loop shift, relaxing plays, slow gain or other linear parts the errors and warnings. Any of these
    /// takes the error band.
    ///
    /// ```
    /// use hysteresis_control::stage::{Stage, StageParts};
    /// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
    /// let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&[0.5], &[0.0], Ratios::PAPER, Offsets::default())?;
    /// let stage = Stage::new(StageParts::new(hysteresis))?;
    /// let limited = stage.with_parts(StageParts { limits: Some((0.0, 150.0)), ..stage.parts().clone() })?;
    /// assert_eq!(limited.drive_range(), Some((0.0, 150.0)));
    /// # Ok::<(), hysteresis_control::stage::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Lag`], or as [`Stage::new`].
    pub fn with_parts(&self, parts: StageParts) -> Result<Self, Error> {
        let known = self.parts();
        let identified = still_known(known, &parts)?;
        let is_same = same_hysteresis(known, &parts) && same_other_parts(known, &parts);
        let error_band = known.error_band.clone().filter(|_| is_same);
        Self::new(StageParts { error_band, identified, ..parts })
    }
}

/// What identification knows of parts that take the place of those that it found.
fn still_known(known: &StageParts, changed: &StageParts) -> Result<Option<Identified>, Error> {
    let Some(identified) = known.identified.clone().filter(|_| same_hysteresis(known, changed)) else {
        return Ok(None);
    };
    if same_other_parts(known, changed) {
        return Ok(Some(identified));
    }
    check_lag(known, changed, &identified)?;
    Ok(Some(Identified {
        rmse: f64::NAN,
        max_error: f64::NAN,
        parameters: Vec::new(),
        covariance: Vec::new(),
        warnings: Vec::new(),
        ..identified
    }))
}

fn same_hysteresis(one: &StageParts, other: &StageParts) -> bool {
    one.hysteresis == other.hysteresis
        && one.duhem == other.duhem
        && (&one.input_map, &one.output_map) == (&other.input_map, &other.output_map)
}

/// Whether all is the same behind the hysteresis and its maps.
fn same_other_parts(one: &StageParts, other: &StageParts) -> bool {
    one.amplifier == other.amplifier
        && one.dynamics == other.dynamics
        && one.loop_shift == other.loop_shift
        && one.relaxing_plays == other.relaxing_plays
        && one.slow_gain == other.slow_gain
        && one.creep == other.creep
        && one.temperature == other.temperature
        && one.dead_time.to_bits() == other.dead_time.to_bits()
}

/// Refuses parts with another lag than the one that was identified.
fn check_lag(known: &StageParts, changed: &StageParts, identified: &Identified) -> Result<(), Error> {
    // Records without a sampling interval tell no lag.
    let Some(dt) = identified.dt.iter().copied().reduce(f64::min) else { return Ok(()) };
    let (expected, got) = (lag(known), lag(changed));
    if (got - expected).abs() <= SAME_LAG.0 * expected.abs() + SAME_LAG.1 * dt {
        return Ok(());
    }
    let parameter = if known.dynamics != changed.dynamics {
        "dynamics"
    } else if known.amplifier != changed.amplifier {
        "amplifier_bandwidth"
    } else {
        "dead_time"
    };
    Err(Error::Lag { parameter, expected, got })
}

/// How much later than the drive a slow motion is read, in seconds.
fn lag(parts: &StageParts) -> f64 {
    let dynamics = match parts.amplifier {
        Some(amplifier) => LinearDynamics::from(amplifier).then(parts.dynamics.clone()),
        None => parts.dynamics.clone(),
    };
    let slow = dynamics.frequency_response(LOW_FREQUENCY) / dynamics.static_gain();
    parts.dead_time - slow.arg() / (TAU * LOW_FREQUENCY)
}

/// So many standard errors count as what may be.
const STANDARD_ERRORS: f64 = 3.0;

/// The largest uncertainties that a design takes.
const WIDEST: ModeUncertainty = ModeUncertainty { frequency: 0.5, damping: 100.0 };

impl Stage {
    /// By which factor the slope of the hysteresis may be from that of [`feedback_loop`](Self::feedback_loop).
    #[must_use]
    pub fn slope_uncertainty(&self) -> f64 {
        let (low, high) = self.slope_range();
        (high / low).sqrt()
    }

    /// How far its lightly damped modes may be from what is known: the usual uncertainty, or three standard errors of
    /// the identification where these are more.
    #[must_use]
    pub fn mode_uncertainty(&self) -> ModeUncertainty {
        let mut modes = modes(&self.parts().dynamics);
        modes.sort_by(|one, other| one.frequency().total_cmp(&other.frequency()));
        let alone = modes.len() == 1;
        let light = modes.iter().enumerate().filter(|(_, mode)| mode.damping() < DAMPED);
        light.fold(ModeUncertainty::default(), |widest, (place, mode)| {
            let share = |name: &str, value: f64| {
                let name = if alone { name.to_owned() } else { format!("{name}[{place}]") };
                STANDARD_ERRORS * self.standard_error(&name).unwrap_or_default() / value
            };
            let damping = share("damping", mode.damping()).exp();
            ModeUncertainty {
                frequency: widest.frequency.max(share("frequency", mode.frequency())).min(WIDEST.frequency),
                damping: widest.damping.max(damping).min(WIDEST.damping),
            }
        })
    }

    /// How far the loop around this stage may be from [`feedback_loop`](Self::feedback_loop), as far as the stage
    /// tells.
    #[must_use]
    pub fn loop_uncertainty(&self) -> LoopUncertainty {
        LoopUncertainty { modes: self.mode_uncertainty(), slope: self.slope_uncertainty() }
    }

    /// Of a parameter that was identified, if it was determined.
    fn standard_error(&self, name: &str) -> Option<f64> {
        let identified = self.parts().identified.as_ref()?;
        let place = identified.parameters.iter().position(|parameter| parameter == name)?;
        let variance = identified.covariance.get(place)?.get(place)?;
        Some(variance.sqrt()).filter(|error| error.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

    use super::*;
    use crate::linear::{FirstOrder, LinearDynamics, Modes, SecondOrder};
    use crate::stage::{Identified, StageParts, StageWarning};

    fn identified() -> Stage {
        let hysteresis =
            ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 9.0], Ratios::PAPER, Offsets::default());
        let warning = |value| StageWarning {
            code: "creep_undetermined".into(),
            severity: "amber".into(),
            message: String::new(),
            value,
            limit: 0.5,
            hint: String::new(),
        };
        Stage::new(StageParts {
            dead_time: 8e-4,
            identified: Some(Identified {
                drive_range: (0.0, 150.0),
                position_range: (0.0, 75.0),
                dt: vec![1e-4],
                rmse: 0.01,
                max_error: 0.1,
                parameters: vec!["w[0]".into()],
                covariance: vec![vec![1e-6]],
                warnings: vec![warning(f64::NAN)],
                records: Vec::new(),
            }),
            ..StageParts::new(hysteresis.unwrap())
        })
        .unwrap()
    }

    fn a1() -> LinearDynamics {
        SecondOrder::new(400.0, 0.95).unwrap().into()
    }

    #[test]
    fn the_lag_is_that_of_all_parts() {
        let parts = StageParts {
            dynamics: a1(),
            amplifier: Some(FirstOrder::new(200.0).unwrap()),
            ..identified().parts().clone()
        };
        let want = 8e-4 + 2.0 * 0.95 / (TAU * 400.0) + 1.0 / (TAU * 200.0);
        assert!((lag(&parts) - want).abs() < 1e-9, "{} {want}", lag(&parts));
    }

    /// Whatever part is given, the lag that the records told is counted once.
    #[test]
    fn parts_that_count_a_lag_twice_are_refused() {
        let stage = identified();
        let parts = stage.parts().clone();
        let amplifier = Some(FirstOrder::new(1000.0).unwrap());
        for (changed, name) in [
            (StageParts { dynamics: a1(), ..parts.clone() }, "dynamics"),
            (StageParts { amplifier, ..parts.clone() }, "amplifier_bandwidth"),
            (StageParts { dead_time: 1.5e-3, ..parts.clone() }, "dead_time"),
        ] {
            let error = stage.with_parts(changed).unwrap_err();
            assert_eq!(error.parameter(), Some(name));
            assert!(error.to_string().contains("0.000800 s"), "{error}");
        }
        let left = 8e-4 - 2.0 * 0.95 / (TAU * 400.0);
        let split = stage.with_parts(StageParts { dynamics: a1(), dead_time: left, ..parts }).unwrap();
        let known = split.parts().identified.as_ref().unwrap();
        assert_eq!(known.drive_range, (0.0, 150.0));
        assert!(known.covariance.is_empty() && known.warnings.is_empty() && known.rmse.is_nan());
    }

    #[test]
    fn what_was_identified_goes_with_the_hysteresis() {
        let stage = identified();
        let limited = stage.with_parts(StageParts { slew: Some(100.0), ..stage.parts().clone() }).unwrap();
        assert_eq!(limited.parts().identified, stage.parts().identified);
        let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&[0.4], &[0.0], Ratios::PLAY, Offsets::default());
        let other = StageParts { hysteresis: hysteresis.unwrap(), ..stage.parts().clone() };
        assert!(stage.with_parts(other).unwrap().parts().identified.is_none());
    }

    /// Numbers that a record cannot tell are none; a stage that has them is still equal to itself.
    #[test]
    fn a_stage_is_equal_to_itself_and_to_its_file() {
        let stage = identified();
        assert_eq!(stage, stage.clone());
        assert_eq!(stage, Stage::from_json(&stage.to_json()).unwrap());
        let other = Identified { rmse: 0.02, ..stage.parts().identified.clone().unwrap() };
        assert_ne!(Some(other), stage.parts().identified);
    }

    /// A stage whose parameters have these standard errors.
    fn stage(dynamics: impl Into<LinearDynamics>, errors: &[(&str, f64)]) -> Stage {
        let hysteresis =
            ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 9.0], Ratios::PAPER, Offsets::default());
        let row = |i: usize| (0..errors.len()).map(|j| if i == j { errors[i].1 * errors[i].1 } else { 0.0 }).collect();
        let identified = Identified {
            drive_range: (0.0, 100.0),
            position_range: (0.0, 60.0),
            dt: vec![1e-4],
            rmse: 0.01,
            max_error: 0.05,
            parameters: errors.iter().map(|(name, _)| (*name).to_owned()).collect(),
            covariance: (0..errors.len()).map(row).collect(),
            warnings: vec![],
            records: vec![],
        };
        let parts = StageParts {
            dynamics: dynamics.into(),
            identified: Some(identified),
            ..StageParts::new(hysteresis.unwrap())
        };
        Stage::new(parts).unwrap()
    }

    fn mode(frequency: f64, damping: f64) -> SecondOrder {
        SecondOrder::new(frequency, damping).unwrap()
    }

    #[test]
    fn standard_errors_count_where_they_are_more_than_the_usual_uncertainty() {
        let found = |f, d| stage(mode(400.0, 0.02), &[("frequency", f), ("damping", d)]).mode_uncertainty();
        assert_eq!(found(4.0, 0.002), ModeUncertainty::default());
        assert_eq!(found(20.0, 0.002), ModeUncertainty { frequency: 0.15, damping: 2.0 });
        assert_eq!(found(4.0, 0.02).damping.to_bits(), 3_f64.exp().to_bits());
        assert_eq!(found(1e3, 1.0), WIDEST);
        assert_eq!(found(f64::NAN, f64::INFINITY), ModeUncertainty::default());
    }

    /// From the lowest frequency up, and those that no feedback could miss do not count.
    #[test]
    fn every_mode_has_its_own_standard_errors() {
        let errors = [("frequency[0]", 2.0), ("frequency[1]", 80.0), ("frequency[2]", 1e3)];
        let modes = [mode(800.0, 0.02), mode(200.0, 0.02), mode(2000.0, 0.9)];
        let found = stage(Modes::new(&[0.3, 0.6, 0.1], &modes).unwrap(), &errors).mode_uncertainty();
        assert!((found.frequency - 0.3).abs() < 1e-12, "{found:?}");
    }
}
