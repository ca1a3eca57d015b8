//! Dynamics whose modes are not known exactly.

use core::cell::RefCell;

use serde::{Deserialize, Serialize};

use crate::checks::check_number;
use crate::linear::{Antiresonance, Error, LinearDynamics, Modes, SecondOrder, Section};

/// A mode with this damping ratio or more has no resonance that a feedback could miss.
pub(crate) const DAMPED: f64 = 0.5;

/// How far frequency and damping ratio of lightly damped modes may be from what is known: damping ratios below 0.5.
/// Every frequency may be off by itself, so that neighbours come together or move apart; the damping ratios are off by
/// one factor.
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

/// Of more lightly damped modes than these not every combination of higher and lower frequencies is a member.
const ALL_COMBINATIONS: usize = 3;

/// The dynamics as they are known, and with their lightly damped modes at the ends of what they may be: all frequencies
/// off by the same share, and then some higher and others lower.
pub(crate) fn family(dynamics: &LinearDynamics, uncertainty: ModeUncertainty) -> Result<Vec<LinearDynamics>, Error> {
    let ModeUncertainty { frequency, damping } = uncertainty.check()?;
    let mut family = vec![dynamics.clone()];
    let light = light_modes(dynamics);
    if light.is_empty() || uncertainty == ModeUncertainty::NONE {
        return Ok(family);
    }
    let together = [-1.0, 0.0, 1.0].map(|sign| vec![sign; light.len()]);
    let apart = if frequency > 0.0 { apart(&light) } else { Vec::new() };
    for signs in together.into_iter().chain(apart) {
        for d in [1.0 / damping, damping] {
            family.push(varied(dynamics, signs.iter().map(|sign| 1.0 + sign * frequency), d)?);
        }
    }
    Ok(family)
}

/// Which modes have a higher frequency and which a lower one, where not all have the same: every combination of a few
/// modes. Of many, those in which all below a mode go one way and all others the other way, and those in which
/// neighbours take turns.
fn apart(light: &[SecondOrder]) -> Vec<Vec<f64>> {
    let count = light.len();
    let sign = |is_higher: bool| if is_higher { 1.0 } else { -1.0 };
    if count <= ALL_COMBINATIONS {
        let combination = |number: usize| (0..count).map(|place| sign(number >> place & 1 == 1)).collect();
        return (1..(1 << count) - 1).map(combination).collect();
    }
    let rank = |mode: &SecondOrder| light.iter().filter(|other| other.frequency() < mode.frequency()).count();
    let of_ranks = |is_higher: &dyn Fn(usize) -> bool| light.iter().map(|mode| sign(is_higher(rank(mode)))).collect();
    let cuts = (1..count).flat_map(|cut| [of_ranks(&|rank| rank >= cut), of_ranks(&|rank| rank < cut)]);
    let turns = [0, 1].map(|first| of_ranks(&|rank| rank % 2 == first));
    cuts.chain(turns).collect()
}

/// The same with lightly damped modes of other frequencies, each by its own factor, and damping ratios, by one factor.
fn varied(
    dynamics: &LinearDynamics,
    frequencies: impl Iterator<Item = f64>,
    damping: f64,
) -> Result<LinearDynamics, Error> {
    let frequencies = RefCell::new(frequencies);
    let by = |mode: &SecondOrder, factor: f64| {
        if mode.damping() < DAMPED {
            SecondOrder::new(mode.frequency() * factor, mode.damping() * damping)
        } else {
            Ok(*mode)
        }
    };
    // In the order of `light_modes`.
    let next = |mode: &SecondOrder| {
        let is_light = mode.damping() < DAMPED;
        if is_light { frequencies.borrow_mut().next().unwrap_or(1.0) } else { 1.0 }
    };
    let mode = |mode: &SecondOrder| by(mode, next(mode));
    let section = |section: &Section| -> Result<LinearDynamics, Error> {
        Ok(match section {
            Section::SecondOrder(one) => mode(one)?.into(),
            Section::Modes(modes) => {
                let varied = modes.modes().iter().map(mode).collect::<Result<Vec<_>, _>>()?;
                Modes::new(modes.gains(), &varied)?.into()
            }
            Section::Antiresonance(pair) if pair.pole().damping() < DAMPED => {
                let factor = next(&pair.pole());
                Antiresonance::new(by(&pair.zero(), factor)?, by(&pair.pole(), factor)?).into()
            }
            Section::Antiresonance(pair) => (*pair).into(),
            Section::FirstOrder(lag) => (*lag).into(),
            Section::StateSpace(matrices) => matrices.clone().into(),
        })
    };
    let sections = dynamics.sections().iter().map(section).collect::<Result<Vec<_>, _>>()?;
    sections.into_iter().fold(LinearDynamics::none(), LinearDynamics::then).with_dead_time(dynamics.dead_time())
}
