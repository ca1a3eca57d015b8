//! Dynamics whose modes are not known exactly.

use serde::{Deserialize, Serialize};

use crate::checks::check_number;
use crate::linear::{Antiresonance, Error, LinearDynamics, Modes, SecondOrder, Section};

/// A mode with this damping ratio or more has no resonance that a feedback could miss.
pub(crate) const DAMPED: f64 = 0.5;

/// How far frequency and damping ratio of lightly damped modes may be from what is known, all of them together: damping ratios below 0.5.
///
/// ```
/// use hysteresis_control::tuning::ModeUncertainty;
/// assert_eq!(ModeUncertainty::default(), ModeUncertainty { frequency: 0.05, damping: 2.0 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeUncertainty {
    /// As a share: 0.05 is 5 % either way.
    pub frequency: f64,
    /// As a factor: at 2 the damping is half to twice of what is known.
    pub damping: f64,
}

impl ModeUncertainty {
    /// Modes that are known exactly.
    pub const NONE: Self = Self { frequency: 0.0, damping: 1.0 };

    fn check(self) -> Result<Self, Error> {
        let holds = (0.0..=0.5).contains(&self.frequency);
        check_number("frequency_uncertainty", holds, "a share from 0 to 0.5", self.frequency)?;
        let holds = (1.0..=100.0).contains(&self.damping);
        check_number("damping_uncertainty", holds, "a factor from 1 to 100", self.damping)?;
        Ok(self)
    }
}

impl Default for ModeUncertainty {
    /// 5 % of the frequency, and a factor of 2 of the damping.
    fn default() -> Self {
        Self { frequency: 0.05, damping: 2.0 }
    }
}

/// The modes, each once.
pub(crate) fn modes(dynamics: &LinearDynamics) -> Vec<SecondOrder> {
    let of_section = |section: &Section| match section {
        Section::SecondOrder(mode) => vec![*mode],
        Section::Modes(modes) => modes.modes().to_vec(),
        Section::Antiresonance(pair) => vec![pair.pole()],
        Section::FirstOrder(_) | Section::StateSpace(_) => Vec::new(),
    };
    dynamics.sections().iter().flat_map(of_section).collect()
}

/// The lightly damped modes, each once.
pub(crate) fn light_modes(dynamics: &LinearDynamics) -> Vec<SecondOrder> {
    modes(dynamics).into_iter().filter(|mode| mode.damping() < DAMPED).collect()
}

/// The dynamics as they are known, and with all their lightly damped modes at the ends of what they may be.
pub(crate) fn family(dynamics: &LinearDynamics, uncertainty: ModeUncertainty) -> Result<Vec<LinearDynamics>, Error> {
    let ModeUncertainty { frequency, damping } = uncertainty.check()?;
    let mut family = vec![dynamics.clone()];
    if light_modes(dynamics).is_empty() || uncertainty == ModeUncertainty::NONE {
        return Ok(family);
    }
    for f in [1.0 - frequency, 1.0, 1.0 + frequency] {
        for d in [1.0 / damping, damping] {
            family.push(varied(dynamics, f, d)?);
        }
    }
    Ok(family)
}

/// The same with lightly damped modes of other frequencies and damping ratios, by these factors.
fn varied(dynamics: &LinearDynamics, frequency: f64, damping: f64) -> Result<LinearDynamics, Error> {
    let mode = |mode: &SecondOrder| {
        if mode.damping() < DAMPED {
            SecondOrder::new(mode.frequency() * frequency, mode.damping() * damping)
        } else {
            Ok(*mode)
        }
    };
    let section = |section: &Section| -> Result<LinearDynamics, Error> {
        Ok(match section {
            Section::SecondOrder(one) => mode(one)?.into(),
            Section::Modes(modes) => {
                let varied = modes.modes().iter().map(mode).collect::<Result<Vec<_>, _>>()?;
                Modes::new(modes.gains(), &varied)?.into()
            }
            Section::Antiresonance(pair) if pair.pole().damping() < DAMPED => {
                Antiresonance::new(mode(&pair.zero())?, mode(&pair.pole())?).into()
            }
            Section::Antiresonance(pair) => (*pair).into(),
            Section::FirstOrder(lag) => (*lag).into(),
            Section::StateSpace(matrices) => matrices.clone().into(),
        })
    };
    let sections = dynamics.sections().iter().map(section).collect::<Result<Vec<_>, _>>()?;
    sections.into_iter().fold(LinearDynamics::none(), LinearDynamics::then).with_dead_time(dynamics.dead_time())
}
