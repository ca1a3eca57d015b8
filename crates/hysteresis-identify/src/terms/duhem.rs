//! A Duhem operator beside the plays: f+ and f- at a few knots.
//!
//! It is shown what the plays are shown, and what it puts out is added to their sum, in front of the output map.

use hysteresis_core::{Duhem, DuhemForward, Process};

use crate::error::Error;

/// The most knots that are searched: of each f as many values.
pub(crate) const MOST_KNOTS: usize = 5;

/// Between which multiples of the scale f is searched, and how far a bold step goes.
pub(crate) const BOUNDS: (f64, f64) = (1e-3, 50.0);
pub(crate) const STEP: f64 = 0.5;

/// The shapes at which a search begins: where z comes to rest, over half of the range of drives, and f on the way back
/// from there.
pub(crate) const RESTS: [f64; 7] = [0.1, 0.17, 0.3, 0.5, 0.85, 1.5, 3.0];
pub(crate) const BACKS: [f64; 3] = [1.0, 1.45, 1.9];

/// All of them: each rest with each f on the way back.
pub(crate) fn shapes() -> impl Iterator<Item = (f64, f64)> {
    RESTS.into_iter().flat_map(|rest| BACKS.map(|back| (rest, back)))
}

/// The least and the largest scale of f.
const SCALES: (f64, f64) = (1e-40, 1e40);

/// The Duhem operator beside the plays, for loops that do not close or that plays do not describe: z' = f+(z) u' where
/// the drive rises, f-(z) u' where it falls, added to the output of the plays. Both f above 0, or both below 0 as for
/// the h of Bouc-Wen's k u - h. See [`Duhem`].
///
/// ```
/// use hysteresis_identify::{DuhemModel, DuhemTable, Options};
/// assert_eq!(Options::default().duhem, DuhemModel::Auto);
/// let table = DuhemTable { knots: vec![-1.0, 1.0], rising: vec![0.3, 0.1], falling: vec![0.1, 0.3] };
/// let options = Options { duhem: DuhemModel::Near(table), ..Options::default() };
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DuhemModel {
    /// One that is searched, if it predicts held-out stretches better than plays alone.
    #[default]
    Auto,
    /// None.
    None,
    /// One that is searched; none where it does not lower the error, leaves no inverse or runs away.
    Fit,
    /// One that is searched, from this one on; its knots move with its amplitude, by a factor of e^1.5 at most.
    Near(DuhemTable),
}

/// The knots z of a Duhem operator, and f+ and f- there.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DuhemTable {
    /// z, increasing, in the unit of the output.
    pub knots: Vec<f64>,
    /// f+, in the unit of the output over that of the input.
    pub rising: Vec<f64>,
    /// f-.
    pub falling: Vec<f64>,
}

/// Where f is searched: the knots, and the unit of f.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DuhemSpace {
    pub(crate) knots: Vec<f64>,
    pub(crate) scale: f64,
}

impl DuhemModel {
    /// Where it begins; none unless one is there.
    pub(crate) fn start(&self) -> Result<Option<&DuhemTable>, Error> {
        let Self::Near(table) = self else { return Ok(None) };
        table.operator::<MOST_KNOTS>()?;
        let (scale, expected) = (table.scale(), "numbers of a mean of magnitude 1e-40 to 1e40");
        if !(SCALES.0..=SCALES.1).contains(&scale.abs()) {
            return Err(Error::domain("rising", None, expected, scale));
        }
        Ok(Some(table))
    }
}

impl DuhemTable {
    /// The operator.
    ///
    /// # Errors
    /// [`hysteresis_core::Error`] as [`Duhem::new`].
    pub fn operator<const N: usize>(&self) -> Result<Duhem<N>, hysteresis_core::Error> {
        Duhem::new(&self.knots, &self.rising, &self.falling)
    }

    /// The mean of f.
    pub(crate) fn scale(&self) -> f64 {
        let all = self.rising.iter().chain(&self.falling);
        all.clone().sum::<f64>() / crate::records::signal::as_f64(all.count().max(1))
    }

    /// A Bouc-Wen operator of exponent 1 and unit f at 0: f falls along a loading branch to a tenth at the outer knots,
    /// and is `back` there along an unloading one. Its knots are in the unit of the drive times f.
    pub(crate) fn bouc_wen(reach: f64, back: f64) -> Self {
        const END: f64 = 0.1;
        Self { knots: vec![-reach, 0.0, reach], rising: vec![back, 1.0, END], falling: vec![END, 1.0, back] }
    }

    /// The same with an output so many times as large; below 0, it falls where this one rises.
    pub(crate) fn scaled(&self, by: f64) -> Self {
        let times = |values: &[f64]| {
            let mut values: Vec<_> = values.iter().map(|value| by * value).collect();
            // Knots increase.
            if by < 0.0 {
                values.reverse();
            }
            values
        };
        Self { knots: times(&self.knots), rising: times(&self.rising), falling: times(&self.falling) }
    }

    /// By how much it falls at most while the drive rises by one; below 0 where it rises at least by that.
    pub(crate) fn steepest_fall(&self) -> f64 {
        self.rising.iter().chain(&self.falling).fold(f64::NEG_INFINITY, |most, f| most.max(-f))
    }

    /// By how much it rises at most while the drive rises by one.
    pub(crate) fn steepest_rise(&self) -> f64 {
        self.rising.iter().chain(&self.falling).fold(f64::NEG_INFINITY, |most, f| most.max(*f))
    }

    /// The same f on other knots.
    pub(crate) fn on(&self, knots: Vec<f64>) -> Result<Self, Error> {
        let duhem = self.operator::<MOST_KNOTS>()?;
        let at = |rising| knots.iter().map(|z| duhem.slope(*z, rising)).collect();
        Ok(Self { rising: at(true), falling: at(false), knots })
    }

    /// The stream of it, from z = 0 at x = 0.
    pub(crate) fn stream(&self) -> DuhemForward<MOST_KNOTS> {
        let valid = "the bounds of the search hold f within its domain";
        DuhemForward::new(self.operator().expect(valid))
    }

    /// By how much z still moves from one round to the next, over its stroke, once the input has gone from rest over a
    /// range and back ten times: little for an operator that comes to a loop of its own. What is beyond 1000, or beyond
    /// all numbers, counts as that.
    pub(crate) fn drift(&self, (low, high): (f64, f64)) -> f64 {
        const ROUNDS: usize = 10;
        const MOST: f64 = 1e3;
        let mut stream = self.stream();
        let mut drift = MOST;
        let mut now = stream.step(low);
        for _ in 0..ROUNDS {
            let before = now;
            let top = stream.step(high);
            now = stream.step(low);
            drift = ((now - before) / (top - now)).abs().min(MOST);
        }
        drift
    }

    /// The least and the largest z along inputs.
    pub(crate) fn range(&self, inputs: impl Iterator<Item = f64>) -> (f64, f64) {
        let mut stream = self.stream();
        inputs.fold((0.0, 0.0), |(low, high): (f64, f64), x| {
            let z = stream.step(x);
            (low.min(z), high.max(z))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drift(knots: &[f64], rising: &[f64], falling: &[f64]) -> f64 {
        DuhemTable { knots: knots.to_vec(), rising: rising.to_vec(), falling: falling.to_vec() }.drift((0.0, 100.0))
    }

    /// That of a stage whose loops differ by one side stays where it is. One that was fitted to the decaying loops of a
    /// stage that leaks ran away on other drives.
    #[test]
    fn an_operator_comes_to_a_loop_or_drifts() {
        assert!(drift(&[-1.08, 0.0, 1.08], &[0.6020, 0.6062, 0.6125], &[0.6028, 0.6059, 0.6121]) < 0.01);
        let (rising, falling) = ([0.027, 0.212, 0.244, 0.266, 0.279], [0.319, 0.282, 0.268, 0.282, 0.304]);
        assert!(drift(&[-6.0, -3.0, 0.0, 14.7, 29.3], &rising, &falling) > 0.1);
        // Each round leads down by the difference: 30 down, 10 up.
        assert!((drift(&[-1.0, 1.0], &[0.1, 0.1], &[0.3, 0.3]) - 20.0 / 30.0).abs() < 1e-9);
        for (rest, back) in shapes() {
            // With knots that are far out it comes to its loop slowly.
            for (sign, far) in [(1.0, 1.0), (-1.0, 1.0), (1.0, 10.0), (1.0, 100.0)] {
                let drift = DuhemTable::bouc_wen(50.0 * far * rest, back).scaled(sign).drift((0.0, 100.0));
                assert!(drift < 0.03, "{rest} {back} {sign} {far}: {drift}");
            }
        }
    }
}
