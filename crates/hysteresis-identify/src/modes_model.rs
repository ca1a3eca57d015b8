//! How many modes to fit behind the hysteresis.

use crate::error::Error;

/// The most modes that are fitted.
pub(crate) const MAX_MODES: usize = 3;

/// How many modes in parallel the dynamics of second order have:
/// G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1), sum_i g_i = 1.
///
/// ```
/// use hysteresis_identify::{ModesModel, Options};
/// let options = Options { dt: Some(1e-4), modes: ModesModel::Number(2), ..Options::default() };
/// assert_ne!(options.modes, ModesModel::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ModesModel {
    /// One, and a second and a third as far as the records tell them.
    #[default]
    Auto,
    /// So many, 1 to 3, as far as the records tell them: a finding says if there are fewer. More than one ask for dynamics of
    /// second order.
    Number(usize),
}

impl ModesModel {
    /// How many modes there may be.
    pub(crate) fn most(self) -> usize {
        match self {
            Self::Auto => MAX_MODES,
            Self::Number(number) => number,
        }
    }

    /// Whether dynamics of second order are asked for.
    pub(crate) fn asks_for_dynamics(self) -> bool {
        matches!(self, Self::Number(number) if number > 1)
    }

    /// Checks a number, and that several modes have dynamics of second order.
    pub(crate) fn check(self, may_have_modes: bool) -> Result<(), Error> {
        let Self::Number(number) = self else { return Ok(()) };
        if !(1..=MAX_MODES).contains(&number) {
            return Err(Error::whole("modes", "1, 2 or 3", number));
        }
        if number > 1 && !may_have_modes {
            return Err(Error::whole("modes", "1 without second-order dynamics (dynamics 2)", number));
        }
        Ok(())
    }
}
