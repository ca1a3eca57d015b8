//! How many operators there are, and where.

/// The fewest operators where their number follows from the records by doubling.
const FEWEST: usize = 20;

/// The thresholds r_i of the operators, in the unit of the input.
///
/// Where their number is left to cross-validation, it is chosen with everything else in the model: dynamics, dead time, creep,
/// loop shift, maps, ratios and offsets are fitted with 20 operators (with fewer if the samples bear no more). There, every
/// number is judged on stretches of the records, each predicted from weights fitted to the others, at the smoothness that suits this
/// number, the searched parameters linearised about their values. With the number that is chosen the search goes on.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Thresholds {
    /// That many operators at r_i = i X / n, i = 0..n-1, the first of them the identity.
    ///
    /// X is the largest |u - `input_offset`| of all records (skipped samples included) for the modified model; it
    /// moves with an offset that is searched. For the conventional model X is half the peak-to-peak of the input: a
    /// play of threshold r moves both ways only on strokes above 2 r.
    Uniform(usize),
    /// As [`Uniform`](Self::Uniform), 20 of them, or 40 or 80 where these predict stretches of the records better: by a fiftieth of
    /// the error at least, and by more than its standard error. Each number is compared with the one before. A number that the samples
    /// do not bear is not tried.
    Refined,
    /// As [`Uniform`](Self::Uniform), as many of 4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64 and 80 as cross-validation asks for: the
    /// fewest that predict as well as the best, by the same rule as [`WeightLaw::Auto`](crate::WeightLaw::Auto); a hundredth of the
    /// error counts for nothing.
    Auto,
    /// That many operators, the first of them the identity, at quantiles of the amplitudes at which the input turns
    /// round: dense where it does so often. The amplitudes are |u - `input_offset`| at the reversals of all records,
    /// those nearer to each other than a hundredth of the largest counted once; for the conventional model they are
    /// half the distances between successive reversals.
    Quantiles(usize),
    /// As many operators as [`Refined`](Self::Refined) would take, at [`Quantiles`](Self::Quantiles).
    RefinedQuantiles,
    /// As many operators as [`Auto`](Self::Auto) would take, at [`Quantiles`](Self::Quantiles).
    AutoQuantiles,
    /// That many operators, the first of them the identity, the others at growing distances, so that small loops have more of them:
    /// r_0 = 0 and r_i = X / q^(n - i), i = 1..n-1, X as for [`Uniform`](Self::Uniform) and q = min(2, 100^(1 / (n - 1))).
    ///
    /// From 8 operators on the smallest threshold is X / 100: a loop of a hundredth of the range is about the smallest that is told from
    /// noise, and reversals nearer to each other count once for [`Quantiles`](Self::Quantiles), too. Fewer operators lie an octave
    /// apart: thresholds further apart leave loops between them without any.
    Geometric(usize),
    /// As many operators as [`Refined`](Self::Refined) would take, at [`Geometric`](Self::Geometric).
    RefinedGeometric,
    /// As many operators as [`Auto`](Self::Auto) would take, at [`Geometric`](Self::Geometric).
    AutoGeometric,
    /// These, strictly increasing from zero or above.
    Given(Vec<f64>),
}

/// How a number of operators that is left open is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    /// 20, doubled where that predicts better.
    Refined,
    /// The fewest that predict as well as the best.
    Auto,
}

impl Thresholds {
    /// Whether their number is left to cross-validation.
    #[must_use]
    pub fn are_counted_by_validation(&self) -> bool {
        self.count().is_some()
    }

    /// How many there are; while that is left to cross-validation the fewest there may be, or 0 where these may be any.
    pub(crate) fn operators(&self) -> usize {
        match self {
            Self::Uniform(operators) | Self::Quantiles(operators) | Self::Geometric(operators) => *operators,
            Self::Given(thresholds) => thresholds.len(),
            Self::Refined | Self::RefinedQuantiles | Self::RefinedGeometric => FEWEST,
            Self::Auto | Self::AutoQuantiles | Self::AutoGeometric => 0,
        }
    }

    /// How their number is chosen; none if it is known.
    pub(crate) fn count(&self) -> Option<Count> {
        match self {
            Self::Refined | Self::RefinedQuantiles | Self::RefinedGeometric => Some(Count::Refined),
            Self::Auto | Self::AutoQuantiles | Self::AutoGeometric => Some(Count::Auto),
            Self::Uniform(_) | Self::Quantiles(_) | Self::Geometric(_) | Self::Given(_) => None,
        }
    }

    /// That many, placed alike; those that are given stay.
    #[must_use]
    pub fn of(&self, operators: usize) -> Self {
        match self {
            Self::Uniform(_) | Self::Refined | Self::Auto => Self::Uniform(operators),
            Self::Quantiles(_) | Self::RefinedQuantiles | Self::AutoQuantiles => Self::Quantiles(operators),
            Self::Geometric(_) | Self::RefinedGeometric | Self::AutoGeometric => Self::Geometric(operators),
            Self::Given(_) => self.clone(),
        }
    }

    /// 20 where they would be doubled, and all others as they are.
    #[must_use]
    pub fn unrefined(&self) -> Self {
        if self.count() == Some(Count::Refined) { self.of(FEWEST) } else { self.clone() }
    }
}
