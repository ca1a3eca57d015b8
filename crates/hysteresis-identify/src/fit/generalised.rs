//! Generalised least squares: the parameters and the lags together, from rows that were whitened.

use faer::Mat;

use super::factor::back_substitute;
use crate::numeric::as_f64;

/// Lags count if they lower the whitened sum of squares by their number and so many of its standard deviations.
const EVIDENCE: f64 = 4.0;

/// The sizes of the amplitudes of dynamics that are tried: four in a decade, from one to a millionth of the output.
const SIZES: i32 = 25;

/// By how many half decades those of creep may be smaller or larger.
const RATIOS: i32 = 8;

/// The solution of generalised least squares, from the triangle of the whitened rows.
pub(super) struct Generalised {
    /// Of the records' own and of what is free.
    pub(super) told: Vec<f64>,
    /// The amplitudes of the lags, and the root of their covariance. None where noise alone may show as much.
    pub(super) lags: Option<Amplitudes>,
}

/// What the rows tell of the amplitudes of the lags, and what they do not tell.
///
/// Many of them go together with each other or with the weights of the operators, and the rows tell them badly. So they are
/// taken for normal before the rows are seen, of one size for dynamics and of another for creep: the sizes at which the rows are
/// the likeliest.
pub(super) struct Amplitudes {
    /// What the rows make most likely.
    pub(super) likely: Vec<f64>,
    /// X with X X' their covariance.
    pub(super) errors: Mat<f64>,
    /// -2 log of how likely the rows are, but for a constant.
    unlikely: f64,
}

impl Generalised {
    /// From the triangle of the whitened rows of what is told, the lags and the residual; whether each lag is creep.
    pub(super) fn of(t: &Mat<f64>, told: usize, creeps: &[bool], rows: usize) -> Self {
        let end = t.ncols() - 1;
        let noise = t[(end, end)].abs() / as_f64(rows.saturating_sub(end).max(1)).sqrt();
        let evidence = (told..end).map(|i| (t[(i, end)] / noise).powi(2)).sum::<f64>();
        let count = as_f64(end - told);
        let is_told = evidence > count + EVIDENCE * (2.0 * count).sqrt();
        let lags = if is_told { Amplitudes::of(t, told, creeps, noise) } else { None };
        let of_lags = |i: usize| {
            lags.iter().flat_map(|lags| lags.likely.iter().enumerate()).map(|(j, c)| t[(i, told + j)] * c).sum::<f64>()
        };
        let mut solution: Vec<f64> = (0..told).map(|i| t[(i, end)] - of_lags(i)).collect();
        back_substitute(t.get(..told, ..told), &mut solution);
        Self { told: solution, lags }
    }
}

impl Amplitudes {
    /// From the part of a triangle beside what is told; none if its singular values cannot be found.
    fn of(t: &Mat<f64>, told: usize, creeps: &[bool], noise: f64) -> Option<Self> {
        let end = t.ncols() - 1;
        let seen: Vec<f64> = (told..end).map(|i| t[(i, end)] / noise).collect();
        let with = |ratio: i32| {
            let creep = 10.0_f64.powf(0.5 * f64::from(ratio));
            let scales: Vec<f64> = creeps.iter().map(|is_creep| if *is_creep { creep } else { 1.0 }).collect();
            let lags = Mat::from_fn(end - told, end - told, |i, j| t[(told + i, told + j)] * scales[j] / noise);
            Self::scaled(&lags, &seen, &scales)
        };
        (-RATIOS..=RATIOS).filter_map(with).min_by(|a, b| a.unlikely.total_cmp(&b.unlikely))
    }

    /// For columns that were multiplied by scales, over the noise.
    fn scaled(lags: &Mat<f64>, seen: &[f64], scales: &[f64]) -> Option<Self> {
        let (parts, count) = (lags.svd().ok()?, scales.len());
        // Along each direction: how far an amplitude of one shows above the noise, and what does.
        let rho: Vec<f64> = (0..count).map(|k| parts.S().column_vector()[k]).collect();
        let along = |k: usize| seen.iter().enumerate().map(|(i, seen)| parts.U()[(i, k)] * seen).sum::<f64>();
        let shown: Vec<f64> = (0..count).map(along).collect();
        let unlikely = |size: f64| -> f64 {
            let spread = rho.iter().map(|rho| 1.0 + (size * rho).powi(2));
            spread.zip(&shown).map(|(spread, z)| spread.ln() + z * z / spread).sum()
        };
        let sizes = (0..SIZES).map(|k| 10.0_f64.powf(-f64::from(k) / 4.0));
        let size = sizes.min_by(|a, b| unlikely(*a).total_cmp(&unlikely(*b)))?;
        let spread = |k: usize| 1.0 + (size * rho[k]).powi(2);
        let likely: Vec<f64> = (0..count).map(|k| size * size * rho[k] * shown[k] / spread(k)).collect();
        let v = |j: usize, k: usize| scales[j] * parts.V()[(j, k)];
        Some(Self {
            likely: (0..count).map(|j| (0..count).map(|k| v(j, k) * likely[k]).sum()).collect(),
            errors: Mat::from_fn(count, count, |j, k| v(j, k) * size / spread(k).sqrt()),
            unlikely: unlikely(size),
        })
    }

    /// The root of their mean square: what was found, and then its errors.
    pub(super) fn root(&self, j: usize, column: usize) -> f64 {
        match column.checked_sub(1) {
            None => self.likely[j],
            Some(error) => self.errors[(j, error)],
        }
    }

    /// How many columns that root has.
    pub(super) fn root_columns(&self) -> usize {
        1 + self.errors.ncols()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three lags seen above noise of 0.1: the first well, the second hardly, the third not at all.
    fn triangle(seen: [f64; 3]) -> Mat<f64> {
        let rows = 400_f64;
        let mut t = Mat::zeros(5, 5);
        (t[(0, 0)], t[(0, 1)], t[(0, 4)]) = (10.0, 5.0, 2.0);
        for (k, (size, seen)) in [(100.0, seen[0]), (0.5, seen[1]), (0.0, seen[2])].into_iter().enumerate() {
            (t[(k + 1, k + 1)], t[(k + 1, 4)]) = (size, seen);
        }
        t[(4, 4)] = 0.1 * (rows - 4.0).sqrt();
        t
    }

    #[test]
    fn what_the_rows_do_not_tell_is_as_large_as_what_they_tell() {
        let solution = Generalised::of(&triangle([5.0, 0.05, 0.0]), 1, &[false; 3], 400);
        let lags = solution.lags.unwrap();
        assert!((lags.likely[0] - 0.05).abs() < 1e-4 && lags.likely[2].abs() < 1e-12, "{:?}", lags.likely);
        let error = |j: usize| (0..3).map(|k| lags.errors[(j, k)].powi(2)).sum::<f64>().sqrt();
        assert!((error(0) - 1e-3).abs() < 1e-4, "{}", error(0));
        assert!((0.02..0.2).contains(&error(2)) && (0.02..0.2).contains(&error(1)), "{} {}", error(1), error(2));
        assert!((solution.told[0] - (2.0 - 5.0 * lags.likely[0]) / 10.0).abs() < 1e-12);
    }

    #[test]
    fn noise_alone_has_no_lags() {
        let solution = Generalised::of(&triangle([0.2, 0.1, 0.1]), 1, &[false; 3], 400);
        assert!(solution.lags.is_none());
        assert!((solution.told[0] - 0.2).abs() < 1e-12);
    }

    /// Dynamics of one amplitude that shows a lot, creep that is seen to be small.
    #[test]
    fn creep_has_a_size_of_its_own() {
        let mut t = triangle([90.0, 0.0, 0.0]);
        (t[(2, 2)], t[(2, 4)]) = (100.0, 0.5);
        let error = |creeps: [bool; 3]| {
            let lags = Generalised::of(&t, 1, &creeps, 400).lags.unwrap();
            (0..3).map(|k| lags.errors[(2, k)].powi(2)).sum::<f64>().sqrt()
        };
        let (alike, apart) = (error([false; 3]), error([false, true, true]));
        assert!(alike > 0.3 && apart < 0.03, "{alike} {apart}");
    }
}
