//! A full stroke and decaying reversals: the shortest input to identify from, and the demagnetising sequence.

use hysteresis_control::sampling::{Error, check_count, check_finite, check_positive, reserve};

use super::moves::{Moves, ROUNDING, Shape};

/// Limits, sampling and decay of a drive.
///
/// Of 2 `cycles` - 1 decaying reversals number k lies at `center` + (`high` - `center`) (1 - k / (2 `cycles`)) if k
/// is odd, at `center` - (`center` - `low`) (1 - k / (2 `cycles`)) if it is even: on either side no two are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExcitationOptions {
    /// The lowest value of the drive, in its unit (V).
    pub low: f64,
    /// The highest value of the drive.
    pub high: f64,
    /// The largest speed, in the unit of the drive per second.
    pub slew: f64,
    /// Samples per second, in Hz.
    pub rate: f64,
    /// How many cycles the reversals take to decay.
    pub cycles: u32,
    /// How the signal goes from one reversal to the next.
    pub shape: Shape,
    /// What the reversals decay to, between the limits.
    pub center: f64,
    /// Where the drive starts and ends, within the limits.
    pub start: f64,
}

/// An input to identify from.
#[derive(Clone, Debug, PartialEq)]
pub struct Excitation {
    /// The samples.
    pub drive: Vec<f64>,
    /// How many samples come before the memory is known: leave them out of the fit.
    pub initialization_samples: usize,
    /// Where the drive turns, in order.
    pub reversals: Vec<f64>,
}

impl ExcitationOptions {
    /// One stroke to either limit, one cycle at full swing, decaying reversals, and back to the start.
    ///
    /// Once both limits were reached, the memory of an actuator that was never driven beyond them is known:
    /// `initialization_samples` counts the samples before. With as many cycles as a model has operators at uniform
    /// thresholds, two reversals fall between any two neighbouring thresholds, one on the way up and one on the way
    /// down, so the record tells their weights apart.
    ///
    /// # Errors
    /// [`Error`] that names the parameter outside its domain. The rate must allow at least one sample between the
    /// two nearest reversals on one side.
    ///
    /// ```
    /// use hysteresis_simulate::excitation::{ExcitationOptions, Shape};
    /// let options = ExcitationOptions {
    ///     low: -2.0, high: 2.0, slew: 1.0, rate: 1.0, cycles: 1, shape: Shape::Triangle, center: 0.0, start: 0.0,
    /// };
    /// let made = options.excitation()?;
    /// assert_eq!(made.reversals, [2.0, -2.0, 2.0, -2.0, 1.0]);
    /// assert_eq!(made.drive[..8], [0.0, 1.0, 2.0, 1.0, 0.0, -1.0, -2.0, -1.0]);
    /// assert_eq!(made.drive[made.initialization_samples], -2.0);
    /// # Ok::<(), hysteresis_simulate::signals::Error>(())
    /// ```
    pub fn excitation(&self) -> Result<Excitation, Error> {
        self.check()?;
        let mut reversals = vec![self.high, self.low];
        reversals.extend(self.decay());
        let drive = self.through(&reversals)?;
        let initialization_samples =
            self.moves().steps(self.start, self.high) + self.moves().steps(self.high, self.low);
        // `through` has checked that far more than this fits.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2^27")]
        let initialization_samples = initialization_samples as usize;
        Ok(Excitation { drive, initialization_samples, reversals })
    }

    /// A decaying alternation about `center` as wide as the limits allow on both sides, from `start` and back to it.
    ///
    /// Let A be its first amplitude, the smaller distance from `center` to a limit. From any history within
    /// `center` +- A it leaves every play within A / (4 `cycles`) of rest, and every coupled play with r >= rb and
    /// ra >= rc too, if `center` is the input offset of the model. So the output differs from that of the virgin state
    /// by at most A / (4 `cycles`) times the sum of |w_i| over the operators but the identity.
    ///
    /// Why: each half cycle is A / (2 `cycles`) smaller than the one before. A play of threshold r slides for the last
    /// time where two neighbouring amplitudes sum to 2 r, so at one that is r within half of that decrement, and is
    /// left at their difference.
    ///
    /// # Errors
    /// As for [`excitation`](Self::excitation).
    ///
    /// ```
    /// use hysteresis_simulate::excitation::{ExcitationOptions, Shape};
    /// let options = ExcitationOptions {
    ///     low: -2.0, high: 2.0, slew: 8.0, rate: 1e3, cycles: 20, shape: Shape::Sine, center: 0.0, start: 0.0,
    /// };
    /// let (mut play, drive) = (1.7_f64, options.demagnetizing()?);
    /// for x in drive {
    ///     play = play.clamp(x - 0.3, x + 0.3);
    /// }
    /// assert!(play.abs() <= 2.0 / (4.0 * 20.0));
    /// # Ok::<(), hysteresis_simulate::signals::Error>(())
    /// ```
    pub fn demagnetizing(&self) -> Result<Vec<f64>, Error> {
        self.check()?;
        let amplitude = (self.high - self.center).min(self.center - self.low);
        // One of these is the limit itself, but for a rounding that must not leave it.
        let low = (self.center - amplitude).max(self.low);
        let high = (self.center + amplitude).min(self.high);
        let symmetric = Self { low, high, ..*self };
        symmetric.through(&symmetric.decay().collect::<Vec<_>>())
    }

    fn check(&self) -> Result<(), Error> {
        self.check_domain()?;
        self.check_steps()
    }

    /// Checks each number by itself.
    pub(super) fn check_domain(&self) -> Result<(), Error> {
        check_finite("low", self.low)?;
        check_finite("high", self.high)?;
        if self.high <= self.low {
            return Err(Error::domain("high", format!("a number above low = {:?}", self.low), self.high));
        }
        if !(self.low < self.center && self.center < self.high) {
            let expected = format!("a number between low = {:?} and high = {:?}", self.low, self.high);
            return Err(Error::domain("center", expected, self.center));
        }
        if !(self.low <= self.start && self.start <= self.high) {
            let expected = format!("a number from low = {:?} to high = {:?}", self.low, self.high);
            return Err(Error::domain("start", expected, self.start));
        }
        check_positive("slew", self.slew)?;
        check_positive("rate", self.rate)?;
        if !(1..=MAX_CYCLES).contains(&self.cycles) {
            let expected = format!("a whole number from 1 to {MAX_CYCLES}");
            return Err(Error::whole("cycles", expected, self.cycles));
        }
        Ok(())
    }

    /// Checks that the sampling tells neighbouring reversals apart at this slew.
    pub(super) fn check_steps(&self) -> Result<(), Error> {
        let decrement = (self.high - self.center).min(self.center - self.low) / (2.0 * f64::from(self.cycles));
        if self.slew > self.rate * decrement * (1.0 + ROUNDING) {
            let slowest = self.slew / decrement;
            let expected = format!(
                "at least {slowest:.6} Hz: at this slew one sample must not go further than {decrement:.6}, by which \
                 neighbouring reversals differ"
            );
            return Err(Error::domain("rate", expected, self.rate));
        }
        Ok(())
    }

    /// The reversals from full swing down to the smallest.
    pub(super) fn decay(&self) -> impl Iterator<Item = f64> + '_ {
        let halves = 2 * self.cycles;
        [self.high, self.low].into_iter().chain((1..halves).map(move |k| {
            let side = if k % 2 == 1 { self.high } else { self.low };
            self.center + (side - self.center) * (1.0 - f64::from(k) / f64::from(halves))
        }))
    }

    /// The samples from the start through these reversals to `center` and back to the start.
    fn through(&self, reversals: &[f64]) -> Result<Vec<f64>, Error> {
        let (moves, mut samples, mut from) = (self.moves(), 1.0, self.start);
        let ends = || reversals.iter().copied().chain([self.center, self.start]);
        for to in ends() {
            samples += moves.steps(from, to);
            from = to;
        }
        let mut drive = reserve("rate", check_count("rate", samples)?)?;
        drive.push(self.start);
        for to in ends() {
            moves.extend(&mut drive, to);
        }
        Ok(drive)
    }

    fn moves(&self) -> Moves {
        Moves { slew: self.slew, rate: self.rate, shape: self.shape }
    }
}

/// A move k reversals before the end takes 2 k steps or more, so this many cycles take more samples than any rate may
/// make.
const MAX_CYCLES: u32 = 1 << 14;

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: ExcitationOptions = ExcitationOptions {
        low: -20.0,
        high: 120.0,
        slew: 100.0,
        rate: 1000.0,
        cycles: 20,
        shape: Shape::Triangle,
        center: 40.0,
        start: 0.0,
    };

    #[test]
    fn a_drive_keeps_within_its_limits_and_its_slew_and_comes_home() {
        for shape in [Shape::Triangle, Shape::Sine] {
            let options = ExcitationOptions { shape, ..OPTIONS };
            for drive in [options.excitation().unwrap().drive, options.demagnetizing().unwrap()] {
                assert_eq!((drive[0], drive[drive.len() - 1]), (0.0, 0.0));
                assert!(drive.iter().all(|u| (-20.0..=120.0).contains(u)));
                let fastest = drive.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
                // a step is a difference of numbers up to 120
                assert!(fastest <= 0.1 * (1.0 + 2.0 * ROUNDING) + 1e-13, "{fastest}");
                assert!(fastest > 0.099);
            }
        }
    }

    #[test]
    fn reversals_are_met_in_order_and_are_all_the_turns() {
        let made = OPTIONS.excitation().unwrap();
        let turns: Vec<f64> = (1..made.drive.len() - 1)
            .filter(|k| (made.drive[*k] - made.drive[k - 1]) * (made.drive[k + 1] - made.drive[*k]) < 0.0)
            .map(|k| made.drive[k])
            .collect();
        // the last move goes on downwards through `center`
        assert_eq!(turns, made.reversals);
        assert_eq!(made.reversals.len(), 2 + 2 + 39);
        assert_eq!(made.drive[made.initialization_samples], -20.0);
        assert!(made.drive[..made.initialization_samples].iter().all(|u| *u > -20.0));
        let swings: Vec<f64> = made.reversals[3..].iter().map(|x| (x - 40.0).abs()).collect();
        assert!(swings.iter().step_by(2).is_sorted_by(|a, b| a > b));
        assert!(swings.iter().skip(1).step_by(2).is_sorted_by(|a, b| a > b));
    }

    #[test]
    fn a_move_takes_no_more_steps_than_it_needs() {
        let made = ExcitationOptions { low: -70.0, high: 70.0, center: 0.0, ..OPTIONS }.excitation().unwrap();
        // 70 + 140 + 140 + 140 + ... V at 0.1 V a sample
        let path: f64 = made.reversals.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
        let steps = (70.0 + path + made.reversals[made.reversals.len() - 1].abs()) / 0.1;
        // the reversals lie at multiples of 1.75 V, so a move may take half a step more
        assert!((f64::from(u32::try_from(made.drive.len()).unwrap()) - 1.0 - steps).abs() <= 0.5 * 42.0 + 1e-6);
    }

    #[test]
    fn what_no_drive_can_have_is_named() {
        let named = |options: ExcitationOptions| {
            let error = options.excitation().unwrap_err();
            assert_eq!(options.demagnetizing().unwrap_err().parameter(), error.parameter());
            error.to_string()
        };
        assert_eq!(named(ExcitationOptions { low: f64::NAN, ..OPTIONS }), "low: expected a finite number, got NaN");
        assert_eq!(
            named(ExcitationOptions { high: -20.0, ..OPTIONS }),
            "high: expected a number above low = -20.0, got -20.0"
        );
        assert_eq!(
            named(ExcitationOptions { center: 120.0, ..OPTIONS }),
            "center: expected a number between low = -20.0 and high = 120.0, got 120.0"
        );
        assert_eq!(
            named(ExcitationOptions { start: f64::NAN, ..OPTIONS }),
            "start: expected a number from low = -20.0 to high = 120.0, got NaN"
        );
        assert_eq!(
            named(ExcitationOptions { slew: 0.0, ..OPTIONS }),
            "slew: expected a finite number above 0, got 0.0"
        );
        assert_eq!(
            named(ExcitationOptions { rate: -1.0, ..OPTIONS }),
            "rate: expected a finite number above 0, got -1.0"
        );
        assert_eq!(
            named(ExcitationOptions { cycles: 0, ..OPTIONS }),
            "cycles: expected a whole number from 1 to 16384, got 0"
        );
        assert!(named(ExcitationOptions { cycles: u32::MAX, ..OPTIONS }).starts_with("cycles: expected "));
        // 60 V in 40 half cycles: 1.5 V between neighbours, 100 V/s
        assert!(
            named(ExcitationOptions { rate: 66.0, ..OPTIONS }).starts_with("rate: expected at least 66.666667 Hz: ")
        );
        ExcitationOptions { rate: 66.67, ..OPTIONS }.excitation().unwrap();
        let endless = named(ExcitationOptions { slew: 1e-9, ..OPTIONS });
        assert!(endless.starts_with("rate: expected at most 134217728 samples (2^27), got "), "{endless}");
    }
}
