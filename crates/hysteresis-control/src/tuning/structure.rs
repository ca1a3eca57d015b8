//! What may stand before the gains of a feedback.

use serde::{Deserialize, Serialize};

use crate::filters::{FeedbackFilter, LowPass, Notch};
use crate::linear::{Error, SecondOrder};

/// Damping ratios of the poles of a notch.
const WIDTHS: [f64; 6] = [0.35, 0.5, 0.7, 1.0, 1.5, 2.2];

/// Cut-off frequencies of low-passes of first and second order, as shares of the lowest mode.
const FIRST: [f64; 5] = [0.06, 0.1, 0.17, 0.25, 0.4];
const SECOND: [f64; 5] = [0.2, 0.35, 0.5, 0.75, 1.1];

/// The damping ratio of a low-pass of second order.
const LOW_PASS_DAMPING: f64 = 1.0;

/// A notch above this share of the sampling rate would be squeezed against half of it.
const HIGHEST: f64 = 0.45;

/// Up to how many modes every choice of notches is tried.
const MOST_CHOSEN: usize = 3;

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
    /// A low-pass behind which a negative proportional gain damps a resonance: integral resonant control, or positive position
    /// feedback.
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

/// What is tried for dynamics with these lightly damped modes, the simplest first.
pub(super) fn candidates(modes: &[SecondOrder], dt: f64) -> Result<Vec<(Structure, Vec<FeedbackFilter>)>, Error> {
    let mut candidates = vec![(Structure::ProportionalIntegral, Vec::new())];
    let lowest = modes.iter().map(SecondOrder::frequency).fold(f64::INFINITY, f64::min);
    let is_seen = |frequency: f64| frequency * dt < HIGHEST;
    let low_passes =
        FIRST.map(|share| (share, None)).into_iter().chain(SECOND.map(|share| (share, Some(LOW_PASS_DAMPING))));
    for (share, damping) in low_passes.filter(|(share, _)| is_seen(share * lowest)) {
        candidates.push((Structure::LowPass, vec![LowPass::new(share * lowest, damping)?.into()]));
    }
    let seen: Vec<_> = modes.iter().filter(|mode| is_seen(mode.frequency())).collect();
    for notched in choices(&seen) {
        for width in WIDTHS {
            let notch =
                |mode: &&SecondOrder| Notch::new(mode.frequency(), mode.damping(), width).map(FeedbackFilter::from);
            candidates.push((Structure::Notch, notched.iter().map(notch).collect::<Result<Vec<_>, _>>()?));
        }
    }
    Ok(candidates)
}

/// Which modes may have a notch: a weak one may need none, and each notch costs phase. The fewest first; of more than
/// [`MOST_CHOSEN`] modes all have one.
fn choices<'a>(modes: &[&'a SecondOrder]) -> Vec<Vec<&'a SecondOrder>> {
    if modes.len() > MOST_CHOSEN {
        return vec![modes.to_vec()];
    }
    let chosen =
        |mask: u32| (modes.iter().enumerate()).filter(move |(place, _)| mask >> place & 1 == 1).map(|(_, mode)| *mode);
    let mut choices: Vec<Vec<_>> = (1..1_u32 << modes.len()).map(|mask| chosen(mask).collect()).collect();
    choices.sort_by_key(Vec::len);
    choices
}
