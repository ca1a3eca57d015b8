//! How well a stage is known, for what is designed from it.

use super::Stage;
use crate::learning::LoopUncertainty;
use crate::tuning::{DAMPED, ModeUncertainty, modes};

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

    /// How far its lightly damped modes may be from what is known: the usual uncertainty, or three standard errors of the identification
    /// where these are more.
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

    /// How far the loop around this stage may be from [`feedback_loop`](Self::feedback_loop), as far as the stage tells.
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
    use crate::linear::{LinearDynamics, Modes, SecondOrder};
    use crate::stage::{Identified, StageParts};

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
