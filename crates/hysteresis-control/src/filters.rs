//! Filters of a feedback, by frequency and damping ratio: what a
//! [`HybridController`](hysteresis_core::HybridController) takes as sections.
//!
//! All come from their continuous form by the bilinear transform, prewarped: at their own frequency both have the same
//! response. With w = 2 pi f and t = tan(w dt / 2), s / w becomes (1 - 1/z) / (1 + 1/z) / t (Oppenheim and Schafer,
//! Discrete-Time Signal Processing, chapter 7).

use core::f64::consts::PI;

use hysteresis_core::{Biquad, Bound, Sections};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use crate::checks::{check_number, check_positive};
use crate::linear::Error;

/// The largest damping ratio of a filter: a wider one is two lags far apart.
const MAX_DAMPING: f64 = 100.0;

/// A notch, which takes out a resonance and leaves slow signals as they are:
///
/// ```text
/// (s^2 + 2 depth w s + w^2) / (s^2 + 2 width w s + w^2)
/// ```
///
/// At its frequency it passes depth / width. With the damping ratio of a mode for the depth, it cancels that mode and
/// puts one with the damping ratio `width` in its place: a wide notch bears more uncertainty of the frequency, and lags
/// more.
///
/// ```
/// use hysteresis_control::filters::Notch;
/// let notch = Notch::new(800.0, 0.02, 1.0)?;
/// let section = notch.section(1e-4)?;
/// assert!((section.static_gain() - 1.0).abs() < 1e-12);
/// let error = notch.section(1e-3).unwrap_err();
/// assert_eq!(error.to_string(), "frequency: expected a number below half of the sampling rate = 500.0, got 800.0");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Notch {
    frequency: f64,
    depth: f64,
    width: f64,
}

/// A low-pass of unit static gain: w / (s + w), or of second order w^2 / (s^2 + 2 zeta w s + w^2) if it has a damping
/// ratio.
///
/// Behind one a small negative proportional gain damps a mode: that is integral resonant control (Fleming, Aphale and
/// Moheimani, IEEE Transactions on Nanotechnology 9(4), 438-448, 2010), or positive position feedback for one of second
/// order.
///
/// ```
/// use hysteresis_control::filters::LowPass;
/// let slow = LowPass::new(200.0, None)?.section(1e-4)?;
/// assert!((slow.static_gain() - 1.0).abs() < 1e-12);
/// assert_eq!(slow.denominator()[1], 0.0); // of first order
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LowPass {
    frequency: f64,
    damping: Option<f64>,
}

/// A lead, which adds phase between two frequencies: (1 + s / w_zero) / (1 + s / w_pole).
///
/// With the zero above the pole it is a lag.
///
/// ```
/// use hysteresis_control::filters::Lead;
/// let lead = Lead::new(100.0, 900.0)?.section(1e-4)?;
/// assert!((lead.static_gain() - 1.0).abs() < 1e-12 && lead.numerator()[0] > 5.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    zero: f64,
    pole: f64,
}

/// A filter of any of these kinds, or a section of coefficients for one sampling interval.
///
/// ```
/// use hysteresis_control::filters::{FeedbackFilter, Notch, sections};
/// let filters = [FeedbackFilter::from(Notch::new(800.0, 0.02, 1.0)?)];
/// assert_eq!(sections(&filters, 1e-4)?.as_slice().len(), 1);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FeedbackFilter {
    /// See [`Notch`].
    Notch(Notch),
    /// See [`LowPass`].
    LowPass(LowPass),
    /// See [`Lead`].
    Lead(Lead),
    /// See [`Biquad`].
    Biquad(Biquad),
}

impl Notch {
    /// A notch at a frequency in Hz, with the damping ratios of its zeros and of its poles.
    ///
    /// # Errors
    /// [`Error`] for a frequency that is not finite and above 0, a depth that is not 0 to 100, a width that is not
    /// above 0 and at most 100.
    pub fn new(frequency: f64, depth: f64, width: f64) -> Result<Self, Error> {
        let frequency = check_positive("frequency", None, frequency)?;
        check_number("depth", (0.0..=MAX_DAMPING).contains(&depth), "0 to 100, the damping ratio of its zeros", depth)?;
        Ok(Self { frequency, depth, width: check_damping("width", width)? })
    }

    /// Its frequency in Hz.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// The damping ratio of its zeros.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// The damping ratio of its poles.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.width
    }

    /// The section for a sampling interval.
    ///
    /// # Errors
    /// [`Error`] for a `dt` that is not above 0, or for which the frequency is not below half of the sampling rate.
    pub fn section(&self, dt: f64) -> Result<Biquad, Error> {
        let t = warped("frequency", self.frequency, dt)?;
        let zeros = [1.0 + 2.0 * self.depth * t + t * t, 2.0 * (t * t - 1.0), 1.0 - 2.0 * self.depth * t + t * t];
        second_order(zeros, self.width, t)
    }
}

impl LowPass {
    /// A low-pass with the cut-off frequency in Hz, of second order if it has a damping ratio.
    ///
    /// # Errors
    /// [`Error`] for a frequency that is not finite and above 0, a damping ratio that is not above 0 and at most 100.
    pub fn new(frequency: f64, damping: Option<f64>) -> Result<Self, Error> {
        let damping = damping.map(|damping| check_damping("damping", damping)).transpose()?;
        Ok(Self { frequency: check_positive("frequency", None, frequency)?, damping })
    }

    /// Its cut-off frequency in Hz.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// Its damping ratio; none of first order.
    #[must_use]
    pub fn damping(&self) -> Option<f64> {
        self.damping
    }

    /// The section for a sampling interval.
    ///
    /// # Errors
    /// As [`Notch::section`].
    pub fn section(&self, dt: f64) -> Result<Biquad, Error> {
        let t = warped("frequency", self.frequency, dt)?;
        match self.damping {
            None => first_order([t, t], t),
            Some(damping) => second_order([t * t, 2.0 * t * t, t * t], damping, t),
        }
    }
}

impl Lead {
    /// A lead with its zero and its pole in Hz.
    ///
    /// # Errors
    /// [`Error`] for frequencies that are not finite and above 0.
    pub fn new(zero: f64, pole: f64) -> Result<Self, Error> {
        Ok(Self { zero: check_positive("zero", None, zero)?, pole: check_positive("pole", None, pole)? })
    }

    /// Its zero in Hz.
    #[must_use]
    pub fn zero(&self) -> f64 {
        self.zero
    }

    /// Its pole in Hz.
    #[must_use]
    pub fn pole(&self) -> f64 {
        self.pole
    }

    /// The section for a sampling interval.
    ///
    /// # Errors
    /// As [`Notch::section`].
    pub fn section(&self, dt: f64) -> Result<Biquad, Error> {
        let (zero, pole) = (warped("zero", self.zero, dt)?, warped("pole", self.pole, dt)?);
        let gain = pole / zero;
        first_order([gain * (zero + 1.0), gain * (zero - 1.0)], pole)
    }
}

impl FeedbackFilter {
    /// The section for a sampling interval.
    ///
    /// # Errors
    /// As [`Notch::section`].
    pub fn section(&self, dt: f64) -> Result<Biquad, Error> {
        match self {
            Self::Notch(filter) => filter.section(dt),
            Self::LowPass(filter) => filter.section(dt),
            Self::Lead(filter) => filter.section(dt),
            Self::Biquad(section) => Ok(*section),
        }
    }
}

impl From<Notch> for FeedbackFilter {
    fn from(filter: Notch) -> Self {
        Self::Notch(filter)
    }
}

impl From<LowPass> for FeedbackFilter {
    fn from(filter: LowPass) -> Self {
        Self::LowPass(filter)
    }
}

impl From<Lead> for FeedbackFilter {
    fn from(filter: Lead) -> Self {
        Self::Lead(filter)
    }
}

impl From<Biquad> for FeedbackFilter {
    fn from(section: Biquad) -> Self {
        Self::Biquad(section)
    }
}

/// The sections of filters, one behind the other, for a sampling interval.
///
/// # Errors
/// As [`Notch::section`] and [`Sections::new`].
pub fn sections(filters: &[FeedbackFilter], dt: f64) -> Result<Sections, Error> {
    let sections = filters.iter().map(|filter| filter.section(dt)).collect::<Result<Vec<_>, _>>()?;
    Sections::new(&sections)
}

/// What sections make of z^k: b(z) / a(z), one after the other.
#[must_use]
pub fn response(sections: &[Biquad], z: Complex<f64>) -> Complex<f64> {
    let delay = z.inv();
    sections.iter().fold(Complex::from(1.0), |product, section| {
        let ([b0, b1, b2], [a1, a2]) = (section.numerator(), section.denominator());
        product * (b0 + delay * (b1 + delay * b2)) / (1.0 + delay * (a1 + delay * a2))
    })
}

/// tan(w dt / 2).
fn warped(parameter: &'static str, frequency: f64, dt: f64) -> Result<f64, Error> {
    let half_rate = 0.5 / check_positive("dt", None, dt)?;
    if frequency < half_rate {
        return Ok((PI * frequency * dt).tan());
    }
    let expected = Bound::Below { what: "half of the sampling rate", limit: half_rate };
    Err(Error::Domain { parameter, index: None, expected, got: frequency })
}

fn check_damping(parameter: &'static str, damping: f64) -> Result<f64, Error> {
    if damping > 0.0 && damping <= MAX_DAMPING {
        return Ok(damping);
    }
    Err(Error::domain(parameter, None, "a damping ratio above 0, at most 100", damping))
}

/// A numerator over the poles of t and a damping ratio.
fn second_order(numerator: [f64; 3], damping: f64, t: f64) -> Result<Biquad, Error> {
    let scale = 1.0 + 2.0 * damping * t + t * t;
    let poles = [2.0 * (t * t - 1.0) / scale, (1.0 - 2.0 * damping * t + t * t) / scale];
    Biquad::new(numerator.map(|b| b / scale), poles)
}

/// A numerator over the pole of t.
fn first_order([b0, b1]: [f64; 2], t: f64) -> Result<Biquad, Error> {
    Biquad::new([b0 / (t + 1.0), b1 / (t + 1.0), 0.0], [(t - 1.0) / (t + 1.0), 0.0])
}
