//! From reversal to reversal: a full stroke and decaying reversals, the shortest input to identify from, and the
//! demagnetising sequence, of one actuator or of all of an array.

use hysteresis_control::sampling::{Error, check_count, check_finite, check_positive, reserve};

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
    /// The defaults: 20 cycles of triangles about the middle of the limits, at 0 or the limit nearest to it before and
    /// after.
    #[must_use]
    pub fn new(low: f64, high: f64, slew: f64, rate: f64) -> Self {
        let (cycles, shape) = (20, Shape::Triangle);
        // Not clamp, which panics if low is above high: the plan says what is wrong with them.
        let (center, start) = (0.5 * low + 0.5 * high, 0.0_f64.max(low).min(high));
        Self { low, high, slew, rate, cycles, shape, center, start }
    }

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

/// Where the drive of one actuator may go, and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorDrive {
    /// The lowest value of the drive, in its unit (V).
    pub low: f64,
    /// The highest value of the drive.
    pub high: f64,
    /// The largest speed, in the unit of the drive per second.
    pub slew: f64,
    /// What the alternation decays to, between the limits.
    pub center: f64,
    /// Where the drive starts and ends, within the limits.
    pub start: f64,
}

impl ActuatorDrive {
    /// The first amplitude: the smaller distance from the center to a limit.
    fn amplitude(&self) -> f64 {
        (self.high - self.center).min(self.center - self.low)
    }

    fn single(&self, rate: f64, cycles: u32, shape: Shape) -> ExcitationOptions {
        let Self { low, high, slew, center, start } = *self;
        ExcitationOptions { low, high, slew, rate, cycles, shape, center, start }
    }
}

/// A decaying alternation of all actuators at once, in rows of one drive for each: all of them begin, turn and end at
/// the same samples.
///
/// Every drive goes from its start to its center in a straight line, then alternates about the center with a common
/// share of its own amplitude, and goes back to its start. The slowest actuator sets the pace. What
/// [`demagnetizing`](ExcitationOptions::demagnetizing) says of one actuator holds for each.
///
/// # Errors
/// [`Error`] that names the parameter outside its domain, and the actuator.
///
/// ```
/// use hysteresis_simulate::excitation::{ActuatorDrive, Shape, demagnetizing_array};
/// let small = ActuatorDrive { low: -1.0, high: 1.0, slew: 20.0, center: 0.0, start: 0.0 };
/// let large = ActuatorDrive { low: 0.0, high: 10.0, slew: 20.0, center: 5.0, start: 0.0 };
/// let drives = demagnetizing_array(&[small, large], 1e3, 20, Shape::Triangle)?;
/// let last = &drives[drives.len() - 2..];
/// assert_eq!((&drives[..2], last), (&[0.0, 0.0][..], &[0.0, 0.0][..]));
/// assert_eq!(drives.iter().copied().fold(0.0, f64::max), 10.0);
/// # Ok::<(), hysteresis_simulate::signals::Error>(())
/// ```
pub fn demagnetizing_array(
    actuators: &[ActuatorDrive],
    rate: f64,
    cycles: u32,
    shape: Shape,
) -> Result<Vec<f64>, Error> {
    check_positive("rate", rate)?;
    for (actuator, drive) in actuators.iter().enumerate() {
        drive.single(rate, cycles, shape).check_domain().map_err(|error| of_actuator(error, actuator))?;
    }
    let pace = actuators.iter().map(|drive| drive.slew / drive.amplitude()).fold(f64::INFINITY, f64::min);
    if !pace.is_finite() {
        return Ok(Vec::new());
    }
    let unit = ActuatorDrive { low: -1.0, high: 1.0, slew: pace, center: 0.0, start: 0.0 };
    let shares = unit.single(rate, cycles, shape).demagnetizing()?;
    let straight = |drive: &ActuatorDrive| {
        Moves { slew: drive.slew, rate, shape: Shape::Triangle }.steps(drive.start, drive.center)
    };
    let lead = actuators.iter().map(straight).fold(0.0, f64::max);
    let samples = (as_f64(shares.len()) + 2.0 * lead) * as_f64(actuators.len());
    let mut drives = reserve("rate", check_count("rate", samples)?)?;
    let (lead, steps) = (check_count("rate", lead)?, lead.max(1.0));
    let there = (0..lead).map(|k| (f64::from(k) / steps, 0.0));
    let back = (0..lead).rev().map(|k| (f64::from(k) / steps, 0.0));
    for (way, share) in there.chain(shares.iter().map(|share| (1.0, *share))).chain(back) {
        drives.extend(actuators.iter().map(|drive| {
            let at = if way == 0.0 { drive.start } else { drive.start + way * (drive.center - drive.start) };
            let at = if way == 1.0 { drive.center } else { at };
            // The clamp is for roundings, which must not leave the limits.
            (at + share * drive.amplitude()).clamp(drive.low, drive.high)
        }));
    }
    Ok(drives)
}

fn of_actuator(error: Error, actuator: usize) -> Error {
    match error {
        Error::Domain { parameter, expected, got } => {
            Error::domain(parameter, format!("{expected} (of actuator {actuator})"), got)
        }
        Error::Whole { parameter, expected, got } => {
            Error::whole(parameter, format!("{expected} (of actuator {actuator})"), got)
        }
        other => other,
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts up to 2^27")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

/// How the signal goes from one reversal to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// In equal steps, at most `slew` / `rate` each.
    #[default]
    Triangle,
    /// Along half a cosine, whose steepest step is at most `slew` / `rate`: pi/2 times as long as the triangle, and
    /// without a jump of speed at the reversals.
    Sine,
}

impl Shape {
    /// How much longer a move takes than along a straight line of the same largest speed.
    pub(super) fn stretch(self) -> f64 {
        match self {
            Self::Triangle => 1.0,
            Self::Sine => core::f64::consts::FRAC_PI_2,
        }
    }
}

/// What the quotients that decide about a further step may be off by.
const ROUNDING: f64 = 1e-12;

/// Moves within a slew limit. Each ends with a sample of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moves {
    /// The largest speed, per second.
    pub(super) slew: f64,
    /// Samples per second.
    pub(super) rate: f64,
    pub(super) shape: Shape,
}

impl Moves {
    /// How many steps a move takes: a whole number.
    pub(super) fn steps(&self, from: f64, to: f64) -> f64 {
        let longest = self.slew / self.rate;
        // A move that fits but for rounding needs no further step.
        ((to - from).abs() * self.shape.stretch() / longest * (1.0 - ROUNDING)).ceil()
    }

    /// Goes on from the last sample; whoever calls has checked that the steps are few enough.
    pub(super) fn extend(&self, drive: &mut Vec<f64>, to: f64) {
        let from = drive.last().copied().unwrap_or(to);
        let steps = self.steps(from, to);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number up to 2^27")]
        let count = steps as u32;
        drive.extend((1..count).map(|k| self.between(from, to, f64::from(k) / steps)));
        if count > 0 {
            drive.push(to);
        }
    }

    /// The point at a share of the steps from one reversal to the next.
    fn between(&self, from: f64, to: f64, share: f64) -> f64 {
        let way = match self.shape {
            Shape::Triangle => share,
            Shape::Sine => (core::f64::consts::FRAC_PI_2 * share).sin().powi(2),
        };
        // The clamp is for roundings, which must not leave the limits.
        (from + (to - from) * way).clamp(from.min(to), from.max(to))
    }
}

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

    fn actuators() -> Vec<ActuatorDrive> {
        let drive = |low, high, slew, center, start| ActuatorDrive { low, high, slew, center, start };
        vec![
            drive(-20.0, 120.0, 900.0, 50.0, 0.0),
            drive(-5.0, 5.0, 300.0, 0.0, 0.0),
            drive(0.0, 60.0, 200.0, 20.0, 60.0),
            drive(10.0, 11.0, 1e4, 10.3, 10.0),
        ]
    }

    #[test]
    fn all_keep_within_their_limits_and_slews_and_come_home() {
        let actuators = actuators();
        for shape in [Shape::Triangle, Shape::Sine] {
            let drives = demagnetizing_array(&actuators, 1e3, 10, shape).unwrap();
            let rows: Vec<&[f64]> = drives.chunks_exact(4).collect();
            for (i, drive) in actuators.iter().enumerate() {
                let column: Vec<f64> = rows.iter().map(|row| row[i]).collect();
                assert!(column.iter().all(|u| (drive.low..=drive.high).contains(u)));
                assert_eq!((column[0], column[column.len() - 1]), (drive.start, drive.start));
                let fastest = column.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
                assert!(fastest <= drive.slew / 1e3 * (1.0 + 1e-9), "{fastest}");
                let (low, high) =
                    column.iter().fold((f64::MAX, f64::MIN), |(low, high), u| (low.min(*u), high.max(*u)));
                let amplitude = drive.amplitude();
                assert!((high - drive.center.max(drive.start).max(drive.center + amplitude)).abs() < 1e-12);
                assert!((low - drive.start.min(drive.center - amplitude)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn one_actuator_has_the_turns_of_the_single_sequence() {
        let one = ActuatorDrive { low: -8.0, high: 8.0, slew: 64.0, center: 0.0, start: 0.0 };
        let single = one.single(1e3, 10, Shape::Triangle).demagnetizing().unwrap();
        let both = demagnetizing_array(&[one], 1e3, 10, Shape::Triangle).unwrap();
        assert_eq!(single.len(), both.len());
        assert!(single.iter().zip(&both).all(|(u, v)| (u - v).abs() < 1e-12));
    }

    #[test]
    fn what_no_drive_of_an_array_can_have_is_named() {
        let mut wrong = actuators();
        wrong[2].center = 60.0;
        let error = demagnetizing_array(&wrong, 1e3, 10, Shape::Triangle).unwrap_err();
        let expected = "center: expected a number between low = 0.0 and high = 60.0 (of actuator 2), got 60.0";
        assert_eq!(error.to_string(), expected);
        let error = demagnetizing_array(&actuators(), 0.0, 10, Shape::Triangle).unwrap_err();
        assert_eq!(error.parameter(), "rate");
        let error = demagnetizing_array(&actuators(), 10.0, 100, Shape::Triangle).unwrap_err();
        assert!(error.to_string().starts_with("rate: expected at least "), "{error}");
        assert!(demagnetizing_array(&[], 1e3, 10, Shape::Triangle).unwrap().is_empty());
    }
}
