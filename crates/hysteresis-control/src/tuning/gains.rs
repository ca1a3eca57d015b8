//! The gains with the greatest ki that a bound on the sensitivity admits.

use super::feedback::{Gains, Slopes, is_admissible};
use super::response::FrequencyPoint;
use super::search::{TINY, golden_section, greatest, greatest_near};

/// How many proportional gains are tried before the best is looked at more closely.
const TRIALS: u32 = 48;

/// The same behind filters, for each sign: roughly, to compare filters, and for those that are chosen.
const ROUGH_TRIALS: u32 = 8;
const FINE_TRIALS: u32 = 24;

/// A loop at the frequencies that are looked at, for all dynamics that may be.
pub(super) struct GainSearch<'a> {
    pub(super) slopes: Slopes,
    pub(super) static_gain: f64,
    pub(super) members: &'a [Vec<FrequencyPoint>],
    /// Of the peak of the sensitivity.
    pub(super) limit: f64,
}

impl GainSearch<'_> {
    /// Both gains are sought in units of 1 / (slope times static gain), where 1 is of the order of what is sought.
    fn gains(&self, kp: f64, ki_dt: f64) -> Gains {
        let unit = 1.0 / (self.slopes.max * self.static_gain);
        Gains { kp: kp * unit, ki_dt: ki_dt * unit }
    }

    fn admits(&self, kp: f64, ki_dt: f64) -> bool {
        let gains = self.gains(kp, ki_dt);
        self.members.iter().all(|points| is_admissible(gains, self.slopes, points, self.limit))
    }

    /// The best gains that are not negative.
    pub(super) fn fastest(&self) -> Gains {
        let integral = |kp: f64| greatest(|ki_dt| self.admits(kp, ki_dt));
        let highest = greatest(|kp| self.admits(kp, TINY));
        let trial = |i: u32| highest * (f64::from(i) / f64::from(TRIALS)).powi(2);
        let integrals: Vec<f64> = (0..=TRIALS).map(|i| integral(trial(i))).collect();
        let best = (0..=TRIALS).zip(&integrals).max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        let between = golden_section(trial(best.saturating_sub(1)), trial((best + 1).min(TRIALS)), integral);
        let on_grid = (trial(best), integrals[best as usize]);
        let (kp, ki_dt) = if between.1 >= on_grid.1 { between } else { on_grid };
        self.gains(kp, ki_dt)
    }

    /// Roughly the best gains, the proportional one of either sign.
    pub(super) fn roughly(&self) -> Gains {
        let (above, below) = (self.on_grid(1.0, ROUGH_TRIALS), self.on_grid(-1.0, ROUGH_TRIALS));
        let (kp, ki_dt, _) = if below.1 > above.1 { below } else { above };
        self.gains(kp, ki_dt)
    }

    /// Roughly the best gains whose proportional one has this sign.
    pub(super) fn roughly_with_sign(&self, sign: f64) -> Gains {
        let (kp, ki_dt, _) = self.on_grid(sign, ROUGH_TRIALS);
        self.gains(kp, ki_dt)
    }

    /// The best gains whose proportional one has this sign.
    pub(super) fn with_sign(&self, sign: f64) -> Gains {
        let (kp, ki_dt, step) = self.on_grid(sign, FINE_TRIALS);
        let integral = |kp: f64| greatest_near(ki_dt, |ki_dt| self.admits(sign * kp, ki_dt));
        let found = golden_section((kp.abs() - step).max(0.0), kp.abs() + step, integral);
        if found.1 > ki_dt { self.gains(sign * found.0, found.1) } else { self.gains(kp, ki_dt) }
    }

    /// The best of some gains kp of a sign, ki dt there, and how far kp is from the next one.
    fn on_grid(&self, sign: f64, trials: u32) -> (f64, f64, f64) {
        let highest = greatest_near(0.1, |kp| self.admits(sign * kp, TINY));
        let trial = |i: u32| highest * (f64::from(i) / f64::from(trials)).powi(2);
        let (mut best, mut last) = ((0.0, 0.0, 0.0), 0.1);
        for i in 0..=trials {
            let integral = greatest_near(last, |ki_dt| self.admits(sign * trial(i), ki_dt));
            if integral > best.1 {
                best = (sign * trial(i), integral, trial(i + 1) - trial(i));
            }
            last = integral;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Sections;

    use super::*;
    use crate::filters::{FeedbackFilter, LowPass, sections};
    use crate::linear::{LinearDynamics, SecondOrder};
    use crate::tuning::open_loop::OpenLoop;
    use crate::tuning::response::response;

    const DT: f64 = 1e-4;

    fn members(mode: (f64, f64), filters: &[FeedbackFilter]) -> Vec<Vec<FrequencyPoint>> {
        let dynamics = LinearDynamics::from(SecondOrder::new(mode.0, mode.1).unwrap());
        let filters = if filters.is_empty() { Sections::default() } else { sections(filters, DT).unwrap() };
        vec![response(&OpenLoop { filters, transfer: dynamics.pulse_transfer(DT).unwrap() }, 1.0)]
    }

    /// Of 200 proportional gains, evenly, none admits a greater integral gain than the one that is found.
    #[test]
    fn the_gains_of_a_sign_are_those_with_the_greatest_integral_gain() {
        let low_pass = FeedbackFilter::from(LowPass::new(320.0, None).unwrap());
        let slopes = Slopes { min: 0.7, max: 1.0 };
        for (members, sign) in [(members((400.0, 0.95), &[]), 1.0), (members((800.0, 0.02), &[low_pass]), -1.0)] {
            let search = GainSearch { slopes, static_gain: 1.0, members: &members, limit: 1.7 };
            let highest = greatest_near(0.1, |kp| search.admits(sign * kp, TINY));
            let integral = |i: u32| greatest(|ki_dt| search.admits(sign * highest * f64::from(i) / 200.0, ki_dt));
            let best = (0..=200).map(integral).fold(0.0, f64::max);
            let found = search.with_sign(sign);
            assert!(found.ki_dt > best * (1.0 - 1e-3), "{sign}: {} {best}", found.ki_dt);
            assert!(search.admits(found.kp, found.ki_dt * (1.0 - 1e-9)));
            assert!(found.kp * sign > 0.0);
        }
    }
}
