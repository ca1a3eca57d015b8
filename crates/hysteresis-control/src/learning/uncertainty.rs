//! The loop that learning believes in, and the loops that it may be instead.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::feedback_loop::FeedbackLoop;
use super::spectra::{as_f64, response, transform};
use crate::linear::Error;
use crate::tuning::{ModeUncertainty, family};

/// What no mode explains: the response is never believed better than to this share.
const UNMODELLED: f64 = 0.1;

/// Where the dynamics no longer pass half of what they pass at rest, other modes may be that nobody has seen. In shares of that frequency:
/// up to where the share above holds, and from where on nothing is known.
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
    pub(super) fn members(&self, believed: &FeedbackLoop) -> Result<Vec<FeedbackLoop>, Error> {
        if !(1.0..=100.0).contains(&self.slope) {
            return Err(Error::domain("slope_uncertainty", None, "a factor from 1 to 100", self.slope));
        }
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
