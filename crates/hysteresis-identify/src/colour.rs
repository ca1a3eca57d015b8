//! Whether residuals are white, and if not how slowly they change.

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::numeric::as_f64;

/// Autocorrelations that the test for white residuals looks at (Ljung and Box), and the statistic that white noise
/// exceeds once in ten thousand records: 20 + 5 sqrt(40), five standard deviations beyond its mean.
const TESTED_LAGS: usize = 20;
const WHITE_LIMIT: f64 = 51.6;

/// The longest correlation time that is looked for, in samples.
const MAX_LAGS: usize = 200;

/// Residuals below this share of the output's range are rounding: neither white nor coloured.
const ROUNDING: f64 = 1e-10;

/// How the residuals follow from each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Colour {
    /// The statistic of Ljung and Box; 0 for residuals that are rounding.
    pub(crate) statistic: f64,
    /// 1 + 2 sum of the autocorrelations up to the first that is not positive: by how much the variance of a slow mean
    /// exceeds that for white noise.
    pub(crate) correlation_time: f64,
}

impl Default for Colour {
    /// White.
    fn default() -> Self {
        Self { statistic: 0.0, correlation_time: 1.0 }
    }
}

impl Colour {
    /// Of several records: the largest statistic, and the mean correlation time, each record counting by its weight.
    pub(crate) fn pooled(records: &[(Self, f64)]) -> Self {
        let total: f64 = records.iter().map(|(_, weight)| weight).sum();
        Self {
            statistic: records.iter().map(|(colour, _)| colour.statistic).fold(0.0, f64::max),
            correlation_time: records.iter().map(|(colour, weight)| colour.correlation_time * weight / total).sum(),
        }
    }

    pub(crate) fn is_coloured(&self) -> bool {
        self.statistic > WHITE_LIMIT
    }

    /// The finding, if the residuals are coloured.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let message = format!(
            "the residual is correlated in time, statistic {:.0} of Ljung and Box: the noise is coloured or \
             something is not modelled; the standard errors allow for it",
            self.statistic
        );
        let code = FindingCode::ResidualColoured;
        self.is_coloured().then(|| Finding::new(code, self.statistic, WHITE_LIMIT, message))
    }

    pub(crate) fn new(residuals: &[f64], range: f64) -> Self {
        let n = as_f64(residuals.len());
        let variance = residuals.iter().map(|e| e * e).sum::<f64>() / n;
        if variance.sqrt() <= ROUNDING * range {
            return Self { statistic: 0.0, correlation_time: 1.0 };
        }
        let lags = MAX_LAGS.min(residuals.len() / 4);
        let correlation =
            |lag: usize| residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum::<f64>() / (n * variance);
        let correlations: Vec<f64> = (1..=lags).map(correlation).collect();
        let tested = correlations.iter().take(TESTED_LAGS);
        let statistic: f64 = tested.zip(1_u32..).map(|(r, lag)| n * (n + 2.0) * r * r / (n - f64::from(lag))).sum();
        let positive: f64 = correlations.iter().take_while(|r| **r > 0.0).sum();
        Self { statistic, correlation_time: 1.0 + 2.0 * positive }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::white_noise::white;

    #[test]
    fn white_noise_is_white_and_its_running_mean_is_not() {
        let noise = white(20_000);
        let colour = Colour::new(&noise, 2.0);
        assert!(!colour.is_coloured() && colour.correlation_time < 1.3);
        let mean: Vec<f64> = noise.windows(8).map(|w| w.iter().sum::<f64>() / 8.0).collect();
        let colour = Colour::new(&mean, 2.0);
        // Autocorrelations 7/8, 6/8, ..., 1/8 sum to 3.5.
        assert!(colour.is_coloured() && (colour.correlation_time - 8.0).abs() < 1.0);
        let tiny: Vec<f64> = mean.iter().map(|e| 1e-12 * e).collect();
        assert!(!Colour::new(&tiny, 2.0).is_coloured());
    }
}
