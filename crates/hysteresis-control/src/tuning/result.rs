//! What a tuning is asked for, and what it found: in numbers, in words, and over frequency.

use core::f64::consts::{PI, TAU};

use hysteresis_core::Bound;
use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::family::{ModeUncertainty, family};
use super::loop_response::{FrequencyPoint, Gains, Margins, OpenLoop, Slopes};
use crate::checks::check_positive;
use crate::filters::{FeedbackFilter, sections};
use crate::linear::{Error, LinearDynamics};

/// What the feedback is to achieve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TuningOptions {
    /// The least and the greatest slope of the hysteresis, in output per input (um/V).
    pub slopes: (f64, f64),
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The greatest peak of the sensitivity, 1.05 to 5; 1.2 is cautious, 2 is bold.
    pub peak_sensitivity: f64,
    /// How well lightly damped modes are known.
    pub uncertainty: ModeUncertainty,
    /// The only structure that is admitted; with none the one that suits the dynamics.
    pub structure: Option<Structure>,
}

impl TuningOptions {
    /// For modes that are known to 5 % of their frequency and a factor of 2 of their damping.
    #[must_use]
    pub fn new(slopes: (f64, f64), dt: f64, peak_sensitivity: f64) -> Self {
        Self { slopes, dt, peak_sensitivity, uncertainty: ModeUncertainty::default(), structure: None }
    }
}

/// Filters and gains of the feedback, and how robust the loop is with them. Made by [`tune`](super::tune).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// What shapes the error.
    pub structure: Structure,
    /// The filters before both gains.
    pub filters: Vec<FeedbackFilter>,
    /// Proportional gain, in input per output (V/um); negative for active damping.
    pub kp: f64,
    /// Integral gain, in input per output and second (V/um/s).
    pub ki: f64,
    /// Where the hysteresis has its least slope, with the dynamics as they are known.
    pub at_min_slope: Margins,
    /// Where it has its greatest slope, likewise.
    pub at_max_slope: Margins,
    /// The peak of the sensitivity over all slopes between and all modes that may be.
    pub peak_sensitivity: f64,
    /// Up to which frequency in Hz disturbances are reduced to 1/sqrt(2) at least, for all slopes and modes that may
    /// be.
    pub rejection_bandwidth: f64,
    /// The bandwidth in Hz of white noise of the sensor that the position follows, with the greatest slope.
    pub noise_bandwidth: f64,
    /// The best of every structure that was tried, and its ki; empty where nothing but gains was sought.
    pub tried: Vec<(Structure, f64)>,
}

/// What shapes the error of a feedback.
///
/// ```
/// use hysteresis_control::tuning::Structure;
/// assert_eq!(Structure::ActiveDamping.name(), "active damping");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Structure {
    /// Nothing: proportional and integral gain alone.
    ProportionalIntegral,
    /// A low-pass, which keeps the loop away from a resonance.
    LowPass,
    /// A low-pass behind which a negative proportional gain damps a resonance: integral resonant control, or positive
    /// position feedback.
    ActiveDamping,
    /// Notches for those lightly damped modes that need one.
    Notch,
}

impl Structure {
    /// All of them, the simplest first.
    pub const ALL: [Self; 4] = [Self::ProportionalIntegral, Self::LowPass, Self::ActiveDamping, Self::Notch];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ProportionalIntegral => "proportional-integral",
            Self::LowPass => "low-pass",
            Self::ActiveDamping => "active damping",
            Self::Notch => "notch",
        }
    }

    /// A low-pass damps if the proportional gain behind it is negative.
    pub(super) fn with_gain(self, kp: f64) -> Self {
        if self == Self::LowPass && kp < 0.0 { Self::ActiveDamping } else { self }
    }
}

impl Tuning {
    /// In a few sentences: which structure was chosen and why, the bound and what reaches it, and what the loop does.
    ///
    /// ```
    /// use hysteresis_control::linear::SecondOrder;
    /// use hysteresis_control::tuning::{TuningOptions, tune};
    /// let (stage, options) = (SecondOrder::new(400.0, 0.95)?.into(), TuningOptions::new((0.7, 1.0), 1e-4, 1.7));
    /// let explanation = tune(&stage, &options)?.explanation(&options);
    /// assert!(explanation.starts_with("Proportional and integral gain alone"), "{explanation}");
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn explanation(&self, options: &TuningOptions) -> String {
        [self.of_structure(options), self.of_bound(options), self.of_loop()].join(" ")
    }

    fn of_structure(&self, options: &TuningOptions) -> String {
        let made = match self.structure {
            Structure::ProportionalIntegral => "Proportional and integral gain alone, without filters.".into(),
            Structure::LowPass => "A low-pass before both gains keeps the loop away from the resonance.".into(),
            Structure::ActiveDamping => {
                "A low-pass and a negative proportional gain damp the resonance actively.".into()
            }
            Structure::Notch => self.of_notches(),
        };
        if self.tried.is_empty() {
            let untold = "A mode that no record told can make this loop oscillate: record a chirp that reaches it.";
            return format!("{made} No mode has a damping ratio below 0.5, so nothing else was tried. {untold}");
        }
        let reached = Structure::ALL.iter().filter_map(|structure| {
            let (_, ki) = self.tried.iter().find(|(one, _)| one == structure)?;
            Some(format!("{} with {}", short(*ki), structure.in_use()))
        });
        let reached = reached.collect::<Vec<_>>().join(", ");
        let why = match options.structure {
            Some(_) => "This structure was asked for.",
            None => "Of those within 5 % of the greatest this is the simplest.",
        };
        format!("{made} Roughly, ki reaches {reached}. {why}")
    }

    fn of_notches(&self) -> String {
        let frequency = |filter: &FeedbackFilter| match filter {
            FeedbackFilter::Notch(notch) => Some(short(notch.frequency())),
            _ => None,
        };
        let at = self.filters.iter().filter_map(frequency).collect::<Vec<_>>().join(" and ");
        if self.filters.len() == 1 {
            format!("A notch before both gains takes out the resonance at {at} Hz.")
        } else {
            format!("Notches before both gains take out the resonances at {at} Hz.")
        }
    }

    fn of_bound(&self, options: &TuningOptions) -> String {
        let ((low, high), ModeUncertainty { frequency, damping }) = (options.slopes, options.uncertainty);
        let modes = if self.tried.is_empty() || options.uncertainty == ModeUncertainty::NONE {
            String::new()
        } else {
            let (percent, factor) = (short(100.0 * frequency), short(damping));
            format!(", with mode frequencies {percent} % either way and damping by a factor of {factor} either way")
        };
        let (peak, limit, low, high) =
            (short(self.peak_sensitivity), short(options.peak_sensitivity), short(low), short(high));
        format!(
            "The sensitivity peaks at {peak}, of {limit} allowed, over all slopes of the hysteresis from {low} to {high}{modes}."
        )
    }

    fn of_loop(&self) -> String {
        let (a, b) = (&self.at_min_slope, &self.at_max_slope);
        let (low, high) = (a.crossover.min(b.crossover), a.crossover.max(b.crossover));
        let crossover = match (low, high) {
            (_, 0.0) => "nowhere".into(),
            (low, high) => format!("at {} to {} Hz", short(low), short(high)),
        };
        let margin = |a: f64, b: f64, unit: &str| match a.min(b) {
            least if least.is_finite() => format!("of at least {}{unit}", short(least)),
            _ => "without end".into(),
        };
        let gain = margin(a.gain_margin, b.gain_margin, "");
        let phase = margin(a.phase_margin, b.phase_margin, " degrees");
        let (rejection, noise) = (short(self.rejection_bandwidth), short(self.noise_bandwidth));
        format!(
            "With the dynamics as they are known, |L| crosses 1 {crossover}, with a gain margin {gain} and a phase margin {phase}. \
             Disturbances are reduced up to {rejection} Hz. The position follows white noise of the sensor with a bandwidth of \
             {noise} Hz."
        )
    }
}

/// With four digits, without an exponent.
fn short(number: f64) -> String {
    format!("{number:.3e}").parse().map_or_else(|_| number.to_string(), |rounded: f64| rounded.to_string())
}

impl Structure {
    /// Behind "with".
    fn in_use(self) -> &'static str {
        match self {
            Self::ProportionalIntegral => "gains alone",
            Self::LowPass => "a low-pass",
            Self::ActiveDamping => "active damping",
            Self::Notch => "a notch",
        }
    }
}

/// The loops of a tuning over frequency, with the dynamics as they are known and with all that may be.
///
/// L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z) at z = exp(2 pi i f dt), as [`tune`](super::tune) has it: P is the
/// pulse transfer function, dead time included. S = 1 / (1 + L) is what the loop leaves of a disturbance, T = L / (1 +
/// L) what it follows of a reference and of the noise of the sensor.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::tuning::{LoopFamily, TuningOptions, tune};
/// let (stage, options) = (SecondOrder::new(800.0, 0.02)?.into(), TuningOptions::new((0.7, 1.0), 1e-4, 1.7));
/// let tuning = tune(&stage, &options)?;
/// let family = LoopFamily::new(&stage, &options, &tuning)?;
/// let margins = tuning.at_max_slope;
/// let l = family.open_loop(&[margins.crossover], margins.slope)?[0];
/// assert!((l.norm() - 1.0).abs() < 1e-9);
/// let (s, t) = (family.sensitivity(&[50.0], 1.0)?[0], family.complementary_sensitivity(&[50.0], 1.0)?[0]);
/// assert!((s + t - 1.0).norm() < 1e-12 && s.norm() <= family.worst_sensitivity(&[50.0])?[0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LoopFamily {
    gains: Gains,
    slopes: Slopes,
    dt: f64,
    /// With the dynamics as they are known, and with all that may be.
    members: Vec<OpenLoop>,
}

impl LoopFamily {
    /// The loops of a tuning that [`tune`](super::tune) made of the same dynamics and options.
    ///
    /// # Errors
    /// As for [`tune`](super::tune).
    pub fn new(dynamics: &LinearDynamics, options: &TuningOptions, tuning: &Tuning) -> Result<Self, Error> {
        let dt = options.dt;
        let filters = sections(&tuning.filters, dt)?;
        let members = family(dynamics, options.uncertainty)?
            .iter()
            .map(|member| Ok(OpenLoop { filters, transfer: member.pulse_transfer(dt)? }))
            .collect::<Result<_, Error>>()?;
        let (min, max) = options.slopes;
        let gains = Gains { kp: tuning.kp, ki_dt: tuning.ki * dt };
        Ok(Self { gains, slopes: Slopes { min, max }, dt, members })
    }

    /// L at frequencies in Hz for a slope of the hysteresis, with the dynamics as they are known.
    ///
    /// # Errors
    /// [`Error`] for a frequency that is not above 0 and at most half of the sampling rate, or a slope that is not
    /// above 0.
    pub fn open_loop(&self, frequencies: &[f64], slope: f64) -> Result<Vec<Complex<f64>>, Error> {
        check_positive("slope", None, slope)?;
        let at = |point| self.gains.at(&point) * slope;
        Ok(self.points(&self.members[0], frequencies)?.into_iter().map(at).collect())
    }

    /// S = 1 / (1 + L) likewise.
    ///
    /// # Errors
    /// As for [`open_loop`](Self::open_loop).
    pub fn sensitivity(&self, frequencies: &[f64], slope: f64) -> Result<Vec<Complex<f64>>, Error> {
        Ok(self.open_loop(frequencies, slope)?.into_iter().map(|l| (1.0 + l).inv()).collect())
    }

    /// T = L / (1 + L) likewise.
    ///
    /// # Errors
    /// As for [`open_loop`](Self::open_loop).
    pub fn complementary_sensitivity(&self, frequencies: &[f64], slope: f64) -> Result<Vec<Complex<f64>>, Error> {
        Ok(self.open_loop(frequencies, slope)?.into_iter().map(|l| l / (1.0 + l)).collect())
    }

    /// The greatest |S| over all slopes between the least and the greatest, and all dynamics that may be.
    ///
    /// # Errors
    /// As for [`open_loop`](Self::open_loop).
    pub fn worst_sensitivity(&self, frequencies: &[f64]) -> Result<Vec<f64>, Error> {
        let mut worst = vec![0.0; frequencies.len()];
        for member in &self.members {
            for (worst, point) in worst.iter_mut().zip(self.points(member, frequencies)?) {
                *worst = f64::max(*worst, 1.0 / self.slopes.min_distance(self.gains.at(&point)));
            }
        }
        Ok(worst)
    }

    fn points(&self, open: &OpenLoop, frequencies: &[f64]) -> Result<Vec<FrequencyPoint>, Error> {
        let highest = 0.5 / self.dt;
        let point = |(i, f): (usize, &f64)| {
            check_positive("frequencies", Some(i), *f)?;
            // Half of the sampling rate itself may come a rounding higher.
            if *f <= highest * (1.0 + 1e-12) {
                return Ok(FrequencyPoint::new(open, (TAU * f * self.dt).min(PI)));
            }
            let expected = Bound::Between { low: 0.0, high: highest };
            Err(Error::Domain { parameter: "frequencies", index: Some(i), expected, got: *f })
        };
        frequencies.iter().enumerate().map(point).collect()
    }
}
