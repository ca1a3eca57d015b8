//! The parameters of an oscillator, their checks, and its file.

use hysteresis_core::{Duhem, Error, Fingerprint, MAX_KNOTS};
use serde::{Deserialize, Serialize};

use super::equation::Equation;
use crate::checks::check_positive;
use crate::json_file::{self, FileError};

/// The schema of a saved oscillator.
pub const SCHEMA: &str = "mpi_hyst/oscillator/1";

/// The largest product of a sub-step with the natural frequency in rad/s, or with the damping in 1/s: above, the
/// Runge-Kutta method is neither accurate nor, from 2.8 on, stable.
const MAX_SUB_STEP: f64 = 1.0;

/// What the default keeps that product below: errors of a few 1e-4 of the motion on the public benchmark, mostly
/// where f bends.
const USUAL_SUB_STEP: f64 = 0.1;

/// An oscillator with hysteresis inside: y'' + c y' + k y + z\[y\] = b u.
///
/// z' = f+(z) y' where y rises, f-(z) y' where it falls: a [`Duhem`] operator of the motion. All terms are divided by
/// the mass, so z is an acceleration, f and k have the unit 1/s^2, c the unit 1/s, and b that of y'' over u.
///
/// ```
/// use hysteresis_control::oscillator::{Hold, HystereticOscillator};
/// use hysteresis_core::Duhem;
/// // The public Bouc-Wen benchmark, divided by its mass of 2 kg.
/// let hysteresis = Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)?;
/// let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, hysteresis)?;
/// let y = oscillator.response(&[100.0; 2000], 1e-3, Hold::Zero, None)?; // N, m
/// assert!((y[1] / 2.5e-5 - 1.0).abs() < 0.01); // b u dt^2 / 2
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "File", into = "File")]
pub struct HystereticOscillator {
    gain: f64,
    damping: f64,
    stiffness: f64,
    hysteresis: Duhem<MAX_KNOTS>,
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    gain: f64,
    damping: f64,
    stiffness: f64,
    knots: Vec<f64>,
    rising: Vec<f64>,
    falling: Vec<f64>,
}

impl From<HystereticOscillator> for File {
    fn from(oscillator: HystereticOscillator) -> Self {
        let [knots, rising, falling] = tables(oscillator.hysteresis());
        let HystereticOscillator { gain, damping, stiffness, .. } = oscillator;
        Self { schema: SCHEMA.to_owned(), gain, damping, stiffness, knots, rising, falling }
    }
}

impl TryFrom<File> for HystereticOscillator {
    type Error = Error;

    fn try_from(file: File) -> Result<Self, Error> {
        let hysteresis = Duhem::new(&file.knots, &file.rising, &file.falling)?;
        Self::new(file.gain, file.damping, file.stiffness, hysteresis)
    }
}

impl HystereticOscillator {
    /// From b, c, k and the operator.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `gain` is finite and not 0, `damping` at least 0, `stiffness` finite and above minus
    /// the smallest f, so that the position is stable, all at most 1e50 in magnitude.
    pub fn new(gain: f64, damping: f64, stiffness: f64, hysteresis: Duhem<MAX_KNOTS>) -> Result<Self, Error> {
        if gain == 0.0 || !is_moderate(gain) || gain.abs() < 1e-50 {
            let expected = "a finite number other than 0 (1e-50 to 1e50 in magnitude)";
            return Err(Error::domain("gain", None, expected, gain));
        }
        if damping < 0.0 || !is_moderate(damping) {
            return Err(Error::domain("damping", None, "a number from 0 to 1e50", damping));
        }
        if !is_moderate(stiffness) || stiffness + hysteresis.min_slope() <= 0.0 {
            let expected = "a number above minus the smallest f of the hysteresis, at most 1e50";
            return Err(Error::domain("stiffness", None, expected, stiffness));
        }
        Ok(Self { gain, damping, stiffness, hysteresis })
    }

    /// Tells oscillators of other parameters apart.
    pub(super) fn fingerprint(&self) -> u64 {
        let mut hash = Fingerprint::continued(self.hysteresis.fingerprint());
        hash.numbers(&[self.gain, self.damping, self.stiffness]);
        hash.finish()
    }

    /// b.
    #[must_use]
    pub fn gain(&self) -> f64 {
        self.gain
    }

    /// c in 1/s.
    #[must_use]
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// k in 1/s^2, beside that of the hysteresis.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// z over y.
    #[must_use]
    pub fn hysteresis(&self) -> &Duhem<MAX_KNOTS> {
        &self.hysteresis
    }

    /// The equation of motion.
    #[must_use]
    pub fn equation(&self) -> Equation<f64> {
        let [knots, rising, falling] = tables(&self.hysteresis);
        Equation::new([self.gain, self.damping, self.stiffness], &knots, &rising, &falling)
    }

    /// The number of sub-steps for an interval `dt` in seconds: `asked` for, or as many as keep integration errors at
    /// a few 1e-4 of the motion, four at least: twice as many have a third of that.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `dt` is above 0, [`Error::Whole`] for a number of sub-steps that is 0, above 1000, or
    /// too small for the frequency and the damping of the oscillator.
    pub fn sub_steps(&self, dt: f64, asked: Option<usize>) -> Result<usize, Error> {
        check_positive("dt", None, dt)?;
        let steepest = self.hysteresis.rising().chain(self.hysteresis.falling()).fold(0.0, f64::max);
        let fastest = fastest(self.damping, self.stiffness + steepest) * dt;
        let least = whole(fastest / MAX_SUB_STEP).max(1);
        if least > MOST_SUB_STEPS {
            let expected = "an interval that 1000 sub-steps resolve: shorter beside a period of the oscillator";
            return Err(Error::domain("dt", None, expected, dt));
        }
        let Some(asked) = asked else {
            return Ok(usual_sub_steps(self.damping, self.stiffness + steepest, dt));
        };
        if (least..=MOST_SUB_STEPS).contains(&asked) {
            return Ok(asked);
        }
        let expected = "a number that resolves a period of the oscillator by six sub-steps at least, and at most 1000";
        Err(Error::whole("sub_steps", None, expected, asked))
    }

    /// As JSON, every number exactly.
    ///
    /// # Errors
    /// [`FileError::Json`], which no oscillator gives.
    pub fn to_json(&self) -> Result<String, FileError> {
        Ok(serde_json::to_string_pretty(self)?)
    }

    /// From what [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    /// [`FileError`] for another schema, an unknown or missing field, or a number that no oscillator may have.
    pub fn from_json(text: &str) -> Result<Self, FileError> {
        json_file::read::<File, Self>(text, SCHEMA)
    }
}

/// The arrays with which an operator is made: its knots, and f+ and f- there.
#[must_use]
pub fn tables<const N: usize>(operator: &Duhem<N>) -> [Vec<f64>; 3] {
    [operator.knots().collect(), operator.rising().collect(), operator.falling().collect()]
}

/// The usual number of sub-steps in an interval `dt`, in seconds, for a damping c in 1/s and the largest k + f in
/// 1/s^2: see [`HystereticOscillator::sub_steps`].
#[must_use]
pub fn usual_sub_steps(damping: f64, stiffness: f64, dt: f64) -> usize {
    whole(fastest(damping, stiffness) * dt / USUAL_SUB_STEP).clamp(FEWEST_SUB_STEPS, MOST_SUB_STEPS)
}

/// The natural frequency in rad/s, or the damping in 1/s if that is larger.
fn fastest(damping: f64, stiffness: f64) -> f64 {
    stiffness.sqrt().max(damping)
}

/// As few as the fastest drive that a record can hold needs.
const FEWEST_SUB_STEPS: usize = 4;
const MOST_SUB_STEPS: usize = 1000;

fn is_moderate(x: f64) -> bool {
    x.abs() <= 1e50
}

/// The next whole number above.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn whole(x: f64) -> usize {
    x.ceil() as usize
}
