//! What a wrong sample of the position may do to a fit.

/// How far the errors of single samples count.
///
/// A glitch is a wrong sample of the position, or a run of a few: a drop-out to zero, a spike. It lies far from the model and from
/// the samples about it, and it begins and ends abruptly. What lasts more than 25 samples is an error of the model, and so is what
/// comes and goes smoothly, or what comes with most jumps of the drive.
///
/// ```
/// use hysteresis_identify::{Loss, Options};
/// assert_eq!(Options::default().loss, Loss::Auto);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Loss {
    /// Squares of the errors of all samples but glitches that lie more than seven standard deviations of the residual from the
    /// samples about them. Records without any give the same bits as [`Squares`](Self::Squares).
    #[default]
    Auto,
    /// Squares of the errors of all samples.
    Squares,
    /// As [`Auto`](Self::Auto) from 4.5 standard deviations on, for records that are known to have glitches. Of good samples with
    /// normal noise one in 150 000 lies that far.
    Robust,
}

impl Loss {
    /// How many standard deviations of the residual a glitch lies away at least; none where all samples count.
    pub(crate) fn limit(self) -> Option<f64> {
        match self {
            Self::Auto => Some(7.0),
            Self::Squares => None,
            Self::Robust => Some(4.5),
        }
    }
}
