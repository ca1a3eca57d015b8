//! The control law of the paper as printed.

use hysteresis_core::{Bound, Error, Process, is_admissible};

/// Equation (8) as printed, which adds the whole feed-forward at every sample (erratum 10):
///
/// ```text
/// u(k) = u(k-1) + H^-1[r(k)] + kp (e(k) - e(k-1)) + ki dt e(k),   e = reference - measurement
/// ```
///
/// from u = 0 and e = 0, kept within limits. It runs into a limit within some 23 samples, so it controls nothing: it is here
/// to show that. [`HybridController`](hysteresis_core::HybridController) has the law that must be meant.
///
/// A sample that is not finite (or beyond 1e100) repeats the last drive.
///
/// ```
/// use hysteresis_simulate::paper::{Benchmark, PrintedLaw, table_2};
/// let (gains, mut plant) = (Benchmark::A1.gains(), Benchmark::A1.plant(0));
/// let mut law = PrintedLaw::new(table_2().forward(), gains.kp, gains.ki, 1e-4, (-560.0, 560.0))?;
/// let reference = |k: i32| 3.3 * (1e-4 * f64::from(k) * 5.0 * core::f64::consts::TAU).sin(); // Fig. 14
/// let first = (0..200).find(|k| {
///     plant.step(law.step(reference(*k), plant.measured()));
///     law.drive() >= 560.0
/// });
/// assert_eq!(first, Some(23));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct PrintedLaw<F> {
    feedforward: F,
    kp: f64,
    ki_dt: f64,
    limits: (f64, f64),
    drive: f64,
    error: f64,
}

impl<F: Process> PrintedLaw<F> {
    /// The law with a feed-forward that takes um and gives volts, gains in V/um and V/um/s, and limits in volts.
    ///
    /// # Errors
    /// [`Error::Domain`] unless the gains are finite and not negative, dt is above 0, and the limits are finite, low < high.
    pub fn new(feedforward: F, kp: f64, ki: f64, dt: f64, limits: (f64, f64)) -> Result<Self, Error> {
        let check = |parameter, index, good: bool, expected, got| {
            if good && is_admissible(got) { Ok(()) } else { Err(Error::Domain { parameter, index, expected, got }) }
        };
        check("kp", None, kp >= 0.0, Bound::NonNegative, kp)?;
        check("ki", None, ki >= 0.0, Bound::NonNegative, ki)?;
        check("dt", None, dt > 0.0, Bound::Positive, dt)?;
        let (low, high) = limits;
        check("limits", Some(0), true, Bound::Finite, low)?;
        check("limits", Some(1), true, Bound::Finite, high)?;
        check("limits", Some(1), low < high, Bound::Above { what: "the low limit", limit: low }, high)?;
        Ok(Self { feedforward, kp, ki_dt: ki * dt, limits, drive: 0.0_f64.clamp(low, high), error: 0.0 })
    }

    /// Takes a sample and returns the drive.
    pub fn step(&mut self, reference: f64, measurement: f64) -> f64 {
        if is_admissible(reference) && is_admissible(measurement) {
            let error = reference - measurement;
            let change = self.feedforward.step(reference) + self.kp * (error - self.error) + self.ki_dt * error;
            self.drive = (self.drive + change).clamp(self.limits.0, self.limits.1);
            self.error = error;
        }
        self.drive
    }

    /// Back to the start, the feed-forward at rest.
    pub fn reset(&mut self) {
        self.feedforward.reset();
        (self.drive, self.error) = (0.0_f64.clamp(self.limits.0, self.limits.1), 0.0);
    }

    /// The present drive.
    #[must_use]
    pub fn drive(&self) -> f64 {
        self.drive
    }

    /// The limits of the drive.
    #[must_use]
    pub fn limits(&self) -> (f64, f64) {
        self.limits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::{table_1_recovered, table_2};
    use hysteresis_core::{ControllerOptions, HybridController, Law};

    const LIMITS: (f64, f64) = (-560.0, 560.0);

    /// At which of 200 samples the drive is at the upper limit, on the paper's actuator without dynamics: 5 Hz and 3.3 um,
    /// as in Fig. 14.
    fn samples_to_the_limit(mut law: impl FnMut(f64, f64) -> f64) -> Option<i32> {
        let mut actuator = table_1_recovered().forward();
        let mut position = 0.0;
        (0..200).find(|k| {
            let reference = 3.3 * (1e-4 * f64::from(*k) * 5.0 * core::f64::consts::TAU).sin();
            let drive = law(reference, position);
            position = actuator.step(drive);
            drive >= LIMITS.1
        })
    }

    #[test]
    fn the_printed_law_runs_into_the_limit_and_the_others_do_not() {
        let feedforward = || table_2().forward();
        let mut printed = PrintedLaw::new(feedforward(), 60.0, 6e3, 1e-4, LIMITS).unwrap();
        assert_eq!(samples_to_the_limit(|r, y| printed.step(r, y)), Some(25));
        printed.reset();
        assert_eq!(samples_to_the_limit(|r, y| printed.step(r, y)), Some(25));
        for law in [Law::Positional, Law::Incremental] {
            let options = ControllerOptions { law, ..ControllerOptions::new(60.0, 6e3, 1e-4, LIMITS) };
            let mut controller = HybridController::new(feedforward().into(), None, &options).unwrap();
            assert_eq!(samples_to_the_limit(|r, y| controller.step(r.into(), y)), None);
        }
    }

    #[test]
    fn it_is_the_printed_equation() {
        let mut law = PrintedLaw::new(table_2().forward(), 2.0, 300.0, 1e-2, LIMITS).unwrap();
        let mut feedforward = table_2().forward();
        assert_eq!(law.step(0.1, 0.25), feedforward.step(0.1) + 2.0 * -0.15 + 3.0 * -0.15);
        let before = law.drive();
        assert_eq!(law.step(f64::NAN, 0.0), before);
        assert_eq!(law.step(0.0, f64::INFINITY), before);
        let expected = before + (feedforward.step(0.2) + 2.0 * (0.2 - -0.15) + 3.0 * 0.2);
        assert!((law.step(0.2, 0.0) - expected).abs() < 1e-12);
    }

    #[test]
    fn arguments_out_of_their_domain_are_named() {
        let error =
            |kp, ki, dt, limits| PrintedLaw::new(table_2().forward(), kp, ki, dt, limits).unwrap_err().to_string();
        assert_eq!(error(-1.0, 0.0, 1.0, LIMITS), "kp: expected a finite number >= 0, got -1.0");
        assert_eq!(error(0.0, f64::NAN, 1.0, LIMITS), "ki: expected a finite number >= 0, got NaN");
        assert_eq!(error(0.0, 0.0, 0.0, LIMITS), "dt: expected a finite number > 0, got 0.0");
        assert!(error(0.0, 0.0, 1.0, (f64::NAN, 0.0)).starts_with("limits[0]: expected a finite number"));
        assert_eq!(error(0.0, 0.0, 1.0, (1.0, 1.0)), "limits[1]: expected a number above the low limit = 1.0, got 1.0");
    }
}
