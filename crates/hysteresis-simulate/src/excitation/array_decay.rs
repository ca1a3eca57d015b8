//! One demagnetising sequence for all actuators of an array.

use hysteresis_control::sampling::{Error, check_count, check_positive, reserve};

use super::decay::ExcitationOptions;
use super::moves::{Moves, Shape};

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

/// A decaying alternation of all actuators at once, in rows of one drive for each: all of them begin, turn and end at the same
/// samples.
///
/// Every drive goes from its start to its center in a straight line, then alternates about the center with a common share of
/// its own amplitude, and goes back to its start. The slowest actuator sets the pace. What
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn what_no_drive_can_have_is_named() {
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
