//! The loop that learning believes in: its linear model, its response at the harmonics of a period, and what it may be
//! instead.

use std::sync::Arc;

use hysteresis_core::{Sections, is_admissible};
use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use serde::{Deserialize, Serialize};

use crate::as_f64;
use crate::checks::check_number;
use crate::linear::{Block, Error, LinearBlock, LinearDynamics};
use crate::tuning::{ModeUncertainty, family};

/// A response has died away when it stays below this share of its peak.
const DIED_AWAY: f64 = 1e-12;

/// A response that has not died away after that many samples never will.
const MAX_SAMPLES: usize = 20_000_000;

/// Proportional-integral feedback around linear dynamics, seen from the target of the feed-forward.
///
/// w(k) = v(k) + slope (kp e(k) + ki dt sum(e)), e = -F y with the filters F. The output w(k) of the hysteresis is held
/// from t_k on, and y(k + 1) is read at t_(k+1), just before the next one: y is what the dynamics, their dead time
/// included, make of w. `slope` is that of the actuator, in displacement per volt, where the feedback acts on it (its
/// hysteresis has one between `w_0` and the sum of all weights).
///
/// ```
/// use hysteresis_control::learning::FeedbackLoop;
/// use hysteresis_control::linear::{Delay, LinearDynamics, SecondOrder};
/// use hysteresis_core::Sections;
/// let dynamics = LinearDynamics::from(SecondOrder::new(400.0, 0.95)?).then(Delay::new(0.5e-4)?);
/// let filters = Sections::default(); // none
/// let feedback = FeedbackLoop { kp: 60.0, ki: 6e3, filters, slope: 6e-3, dynamics, dt: 1e-4 };
/// let response = feedback.impulse_response(20_000)?;
/// assert!(response[0].abs() < 1e-9); // what is put out now is measured one sample later
/// assert!(response.iter().sum::<f64>().abs() < 1e-9); // the integral leaves no static error
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackLoop {
    /// Proportional gain, volts per unit of displacement (V/um).
    pub kp: f64,
    /// Integral gain, volts per unit of displacement and second (V/um/s).
    pub ki: f64,
    /// The filters before both gains.
    pub filters: Sections,
    /// The slope of the actuator, displacement per volt.
    pub slope: f64,
    /// The linear dynamics behind the hysteresis, with their dead time.
    pub dynamics: LinearDynamics,
    /// The sampling interval in seconds.
    pub dt: f64,
}

impl FeedbackLoop {
    /// The position after a correction of 1 at the first sample of every period of `period` samples.
    ///
    /// # Errors
    /// [`Error`] for a parameter outside its domain, or gains at which the loop is not stable.
    pub fn impulse_response(&self, period: usize) -> Result<Vec<f64>, Error> {
        let (mut path, ki_dt) = (self.path()?, self.ki * self.dt);
        // A dead time alone is silent for as long as it lasts, also between two echoes.
        let lull = period.max(1000) + path.samples();
        let mut folded = vec![0.0; period];
        let (mut y, mut integral, mut peak, mut quiet) = (0.0, 0.0, 0.0_f64, 0);
        let mut filter = self.filters.at_rest(0.0);
        for k in 0..MAX_SAMPLES {
            folded[k % period] += y;
            peak = peak.max(f64::abs(y));
            quiet = if f64::abs(y) <= DIED_AWAY * peak && k > 0 { quiet + 1 } else { 0 };
            if quiet > lull {
                return Ok(folded);
            }
            if !is_admissible(y) {
                break;
            }
            filter = self.filters.next(&filter, -y);
            integral += ki_dt * filter.output;
            let feedback = self.slope * (integral + self.kp * filter.output);
            y = path.advance(feedback + if k == 0 { 1.0 } else { 0.0 });
        }
        Err(Error::domain("kp", None, "gains at which the loop is stable", self.kp))
    }

    fn path(&self) -> Result<LinearBlock, Error> {
        let may_damp = !self.filters.as_slice().is_empty();
        for (parameter, got) in [("kp", self.kp), ("ki", self.ki), ("slope", self.slope)] {
            let holds = is_admissible(got) && (got >= 0.0 || (may_damp && parameter == "kp"));
            check_number(parameter, holds, "a finite number >= 0 (at most 1e100)", got)?;
        }
        self.dynamics.block(self.dt)
    }
}

/// To and from the frequencies j / (period dt), j = 0..=period/2.
#[derive(Clone)]
pub(super) struct Spectra {
    forward: Arc<dyn RealToComplex<f64>>,
    back: Arc<dyn ComplexToReal<f64>>,
}

impl Spectra {
    pub(super) fn new(period: usize) -> Self {
        let mut planner = RealFftPlanner::new();
        Self { forward: planner.plan_fft_forward(period), back: planner.plan_fft_inverse(period) }
    }

    /// The number of samples.
    pub(super) fn period(&self) -> usize {
        self.forward.len()
    }

    pub(super) fn transform(&self, samples: &[f64]) -> Vec<Complex64> {
        transform(&*self.forward, samples.to_vec())
    }

    /// Back to samples.
    pub(super) fn samples(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let mut samples = self.back.make_output_vec();
        // A real signal has real ends of its spectrum; what rounding added to them would be refused.
        if let Some(first) = spectrum.first_mut() {
            first.im = 0.0;
        }
        if let (0, Some(last)) = (samples.len() % 2, spectrum.last_mut()) {
            last.im = 0.0;
        }
        self.back.process(&mut spectrum, &mut samples).expect("a spectrum of its own length");
        let scale = as_f64(samples.len()).recip();
        for x in &mut samples {
            *x *= scale;
        }
        samples
    }
}

pub(super) fn transform(forward: &dyn RealToComplex<f64>, mut samples: Vec<f64>) -> Vec<Complex64> {
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut samples, &mut spectrum).expect("samples of its own length");
    spectrum
}

/// The frequency response of a loop at the harmonics of a period.
pub(super) fn response(feedback: &FeedbackLoop, period: usize) -> Result<Vec<Complex64>, Error> {
    Ok(transform(&*RealFftPlanner::new().plan_fft_forward(period), feedback.impulse_response(period)?))
}

/// Q at the frequencies j / (period dt) for a bandwidth, or 1 without one.
pub(super) fn low_pass(bandwidth: Option<f64>, period: usize, dt: f64) -> Vec<f64> {
    let ratio = |j: usize| bandwidth.map_or(0.0, |bandwidth| as_f64(j) / (as_f64(period) * dt * bandwidth));
    (0..=period / 2).map(|j| 1.0 / (1.0 + ratio(j).powi(4))).collect()
}

/// What no mode explains: the response is never believed better than to this share.
const UNMODELLED: f64 = 0.1;

/// Where the dynamics no longer pass half of what they pass at rest, other modes may be that nobody has seen. In shares
/// of that frequency: up to where the share above holds, and from where on nothing is known.
const KNOWN: f64 = 0.3;
const UNKNOWN: f64 = 0.7;

/// How far the true loop may be from the one that learning believes in.
///
/// ```
/// use hysteresis_control::learning::LoopUncertainty;
/// use hysteresis_control::tuning::ModeUncertainty;
/// let usual = LoopUncertainty::default();
/// assert_eq!(usual, LoopUncertainty { modes: ModeUncertainty { frequency: 0.05, damping: 2.0 }, slope: 1.0 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopUncertainty {
    /// Of lightly damped modes.
    pub modes: ModeUncertainty,
    /// As a factor: at 1.2 the slope of the actuator is between the believed one over 1.2 and 1.2 times it.
    pub slope: f64,
}

impl Default for LoopUncertainty {
    /// The usual uncertainty of modes, a slope that is known.
    fn default() -> Self {
        Self { modes: ModeUncertainty::default(), slope: 1.0 }
    }
}

impl LoopUncertainty {
    /// The believed loop, and it at the ends of what it may be.
    fn members(&self, believed: &FeedbackLoop) -> Result<Vec<FeedbackLoop>, Error> {
        check_number("slope_uncertainty", (1.0..=100.0).contains(&self.slope), "a factor from 1 to 100", self.slope)?;
        let of_modes = family(&believed.dynamics, self.modes)?;
        let mut members: Vec<FeedbackLoop> =
            of_modes.into_iter().map(|dynamics| FeedbackLoop { dynamics, ..believed.clone() }).collect();
        if self.slope > 1.0 {
            for slope in [believed.slope / self.slope, believed.slope * self.slope] {
                members.push(FeedbackLoop { slope, ..believed.clone() });
            }
        }
        Ok(members)
    }

    /// The responses of all members at the frequencies j / (samples dt), the believed one first.
    pub(super) fn responses(&self, believed: &FeedbackLoop, samples: usize) -> Result<Vec<Vec<Complex64>>, Error> {
        let plan = RealFftPlanner::new().plan_fft_forward(samples);
        let of_member = |(place, member): (usize, FeedbackLoop)| match member.impulse_response(samples) {
            Ok(response) => Ok(transform(&*plan, response)),
            Err(error) if place == 0 => Err(error),
            Err(_) => {
                let expected = "gains at which the loop is stable also where its modes and its slope are others";
                Err(Error::domain("kp", None, expected, believed.kp))
            }
        };
        self.members(believed)?.into_iter().enumerate().map(of_member).collect()
    }

    /// What is believed of the response at the frequencies j / (samples dt).
    pub(super) fn priors(&self, believed: &FeedbackLoop, samples: usize) -> Result<Vec<Prior>, Error> {
        priors(&self.responses(believed, samples)?, believed, samples)
    }
}

/// What is believed of a response of which these are the members.
pub(super) fn priors(
    responses: &[Vec<Complex64>],
    believed: &FeedbackLoop,
    samples: usize,
) -> Result<Vec<Prior>, Error> {
    let open = FeedbackLoop { kp: 0.0, ki: 0.0, ..believed.clone() };
    Ok(mean_and_variance(responses, &response(&open, samples)?))
}

/// What is believed of the response of the loop at one frequency, before anything was learned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    pub(super) response: Complex64,
    pub(super) variance: f64,
}

/// The mean and the variance of what the response may be, at every frequency; the believed dynamics alone pass `open`.
fn mean_and_variance(responses: &[Vec<Complex64>], open: &[Complex64]) -> Vec<Prior> {
    let members = as_f64(responses.len());
    let half = 0.5 * open[0].norm();
    let corner = as_f64(open.iter().rposition(|passed| passed.norm() >= half).unwrap_or(open.len()).max(1));
    (0..open.len())
        .map(|j| {
            let response = responses.iter().map(|member| member[j]).sum::<Complex64>() / members;
            let spread = responses.iter().map(|member| (member[j] - response).norm_sqr()).sum::<f64>() / members;
            // From the known share to 1 in a straight line of the logarithm.
            let place = ((as_f64(j) / corner - KNOWN) / (UNKNOWN - KNOWN)).clamp(0.0, 1.0);
            let unmodelled = UNMODELLED.powf(1.0 - place);
            Prior { response, variance: spread + unmodelled * unmodelled * response.norm_sqr() }
        })
        .collect()
}

/// Where the loop passes less than this of a correction, it is learned in small steps: the feedback does most of it.
pub(super) const MIN_RESPONSE: f64 = 0.05;

/// The correction that belongs to an error of a linear loop: conj(M) / (|M|^2 + its variance + 0.05^2).
pub(super) fn learning_filter(Prior { response, variance }: Prior) -> Complex64 {
    response.conj() / (response.norm_sqr() + variance + MIN_RESPONSE * MIN_RESPONSE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of what passes at rest passes up to 10: known to a share of 0.1 up to 3, not at all from 7 on.
    #[test]
    fn the_unmodelled_share_grows_beyond_what_the_dynamics_pass() {
        let open: Vec<Complex64> = (0..=20).map(|j| Complex64::new(0.0, if j <= 10 { 4.0 } else { 1.9 })).collect();
        let found = mean_and_variance(&[vec![Complex64::new(2.0, 0.0); 21]], &open);
        let expected = [
            (0, 0.01),
            (1, 0.01),
            (3, 0.01),
            (4, 0.1_f64.powf(1.5)),
            (5, 0.1),
            (6, 0.1_f64.powf(0.5)),
            (7, 1.0),
            (20, 1.0),
        ];
        for (j, share) in expected {
            assert_eq!(found[j].response, Complex64::new(2.0, 0.0));
            assert!((found[j].variance - 4.0 * share).abs() < 1e-12, "{j}: {}", found[j].variance);
        }
    }

    /// Members 1 apart from their mean, and what no mode explains.
    #[test]
    fn the_spread_of_the_members_is_variance() {
        let member = |re, im| vec![Complex64::new(re, im); 3];
        let found = mean_and_variance(&[member(3.0, 2.0), member(1.0, 2.0), member(2.0, 2.0)], &member(1.0, 0.0));
        assert_eq!(found[0].response, Complex64::new(2.0, 2.0));
        assert!((found[0].variance - (2.0 / 3.0 + 0.01 * 8.0)).abs() < 1e-12, "{}", found[0].variance);
    }
}
