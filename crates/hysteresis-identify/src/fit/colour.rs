//! How residuals follow from each other: whether they are white, and an autoregressive model of those that are not.

use crate::records::signal::{as_f64, noise};

/// Autocorrelations that the test for white residuals looks at (Ljung and Box), and the statistic that white noise
/// exceeds once in ten thousand records: 20 + 5 sqrt(40), five standard deviations beyond its mean.
const TESTED_LAGS: usize = 20;
const WHITE_LIMIT: f64 = 51.6;

/// The longest correlation time that is looked for, in samples.
const MAX_LAGS: usize = 200;

/// Residuals below this share of the output's range are rounding: neither white nor coloured.
pub(crate) const ROUNDING: f64 = 1e-10;

/// How the residuals follow from each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Colour {
    /// The statistic of Ljung and Box; 0 for residuals that are rounding.
    pub(crate) statistic: f64,
    /// 1 + 2 sum of the autocorrelations up to the first that is not positive: by how much the variance of a slow mean
    /// exceeds that for white noise.
    pub(crate) correlation_time: f64,
    /// The root mean squares of all residuals, and of what is left of them beside white noise, in their unit.
    pub(crate) whole: f64,
    pub(crate) correlated: f64,
}

impl Default for Colour {
    /// White.
    fn default() -> Self {
        Self { statistic: 0.0, correlation_time: 1.0, whole: 0.0, correlated: 0.0 }
    }
}

impl Colour {
    /// Of several records: the largest of each number, but the mean correlation time, each record counting by its
    /// weight.
    pub(crate) fn pooled(records: &[(Self, f64)]) -> Self {
        let total: f64 = records.iter().map(|(_, weight)| weight).sum();
        let largest = |of: fn(&Self) -> f64| records.iter().map(|(colour, _)| of(colour)).fold(0.0, f64::max);
        Self {
            statistic: largest(|colour| colour.statistic),
            whole: largest(|colour| colour.whole),
            correlated: largest(|colour| colour.correlated),
            correlation_time: records.iter().map(|(colour, weight)| colour.correlation_time * weight / total).sum(),
        }
    }

    pub(crate) fn is_coloured(&self) -> bool {
        self.statistic > WHITE_LIMIT
    }

    pub(crate) fn new(residuals: &[f64], range: f64) -> Self {
        let n = as_f64(residuals.len());
        let variance = residuals.iter().map(|e| e * e).sum::<f64>() / n;
        if variance.sqrt() <= ROUNDING * range {
            return Self::default();
        }
        let lags = MAX_LAGS.min(residuals.len() / 4);
        let correlation =
            |lag: usize| residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum::<f64>() / (n * variance);
        let correlations: Vec<f64> = (1..=lags).map(correlation).collect();
        let tested = correlations.iter().take(TESTED_LAGS);
        let statistic: f64 = tested.zip(1_u32..).map(|(r, lag)| n * (n + 2.0) * r * r / (n - f64::from(lag))).sum();
        let positive: f64 = correlations.iter().take_while(|r| **r > 0.0).sum();
        let correlated = (variance - noise(residuals).powi(2)).max(0.0).sqrt();
        Self { statistic, correlation_time: 1.0 + 2.0 * positive, whole: variance.sqrt(), correlated }
    }
}

/// The highest order that is tried.
const MAX_ORDER: usize = 40;

/// Samples for each coefficient, at least.
const SAMPLES_PER_COEFFICIENT: usize = 10;

/// e(k) + a_1 e(k-1) + ... + a_p e(k-p) = s v(k), with v white and of unit variance. White residuals have the order 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Autoregression {
    /// a_1 to a_p.
    pub(crate) coefficients: Vec<f64>,
    /// s, in the unit of the residuals.
    pub(crate) deviation: f64,
}

impl Autoregression {
    /// By the recursion of Burg (1967), of the order with the least n ln s^2 + p ln n (Schwarz, 1978).
    ///
    /// All poles are drawn towards zero by the factor 1 - 1/n: no correlation lasts longer than the series that shows
    /// it.
    pub(crate) fn of(series: &[f64]) -> Self {
        let n = as_f64(series.len());
        let mean = series.iter().sum::<f64>() / n;
        let mut forward: Vec<f64> = series.iter().map(|e| e - mean).collect();
        let mut backward = forward.clone();
        let mut variance = forward.iter().map(|e| e * e).sum::<f64>() / n;
        let mut coefficients: Vec<f64> = Vec::new();
        let mut best = (n * variance.ln(), Self { coefficients: Vec::new(), deviation: variance.sqrt() });
        for order in 1..=MAX_ORDER.min(series.len() / SAMPLES_PER_COEFFICIENT) {
            let Some(reflection) = reflection(&forward[order..], &backward[order - 1..]) else { break };
            for k in (order..series.len()).rev() {
                let (f, b) = (forward[k], backward[k - 1]);
                (forward[k], backward[k]) = (f + reflection * b, b + reflection * f);
            }
            let turned: Vec<f64> = coefficients.iter().rev().copied().collect();
            coefficients.iter_mut().zip(turned).for_each(|(a, other)| *a += reflection * other);
            coefficients.push(reflection);
            variance *= 1.0 - reflection * reflection;
            let criterion = n * variance.ln() + as_f64(order) * n.ln();
            if criterion < best.0 {
                best = (criterion, Self { coefficients: coefficients.clone(), deviation: variance.sqrt() });
            }
        }
        best.1.damped(1.0 - 1.0 / n)
    }

    /// All poles nearer to zero by a factor.
    fn damped(mut self, factor: f64) -> Self {
        let powers = std::iter::successors(Some(factor), |power| Some(power * factor));
        self.coefficients.iter_mut().zip(powers).for_each(|(a, power)| *a *= power);
        self
    }

    /// The order p.
    pub(crate) fn order(&self) -> usize {
        self.coefficients.len()
    }
}

/// What part of each error the one before it tells, with the sign turned; none if there is nothing left.
fn reflection(forward: &[f64], backward: &[f64]) -> Option<f64> {
    let (mut product, mut squares) = (0.0, 0.0);
    for (f, b) in forward.iter().zip(backward) {
        product += f * b;
        squares += f * f + b * b;
    }
    let reflection = -2.0 * product / squares;
    (reflection.abs() < 1.0).then_some(reflection)
}

/// Rows of one record, filtered in time, column by column.
pub(crate) struct RowFilter<'a> {
    model: &'a Autoregression,
    /// The last rows, as many as the order, one after the other.
    past: Vec<f64>,
    /// How many rows have passed.
    taken: usize,
    out: Vec<f64>,
}

impl<'a> RowFilter<'a> {
    pub(crate) fn new(model: &'a Autoregression, columns: usize) -> Self {
        Self { model, past: vec![0.0; model.order() * columns], taken: 0, out: vec![0.0; columns] }
    }

    /// A(z) / s times the rows: white where they are coloured like the model. Nothing while rows before the first are
    /// missing.
    pub(crate) fn whitened(&mut self, row: &[f64]) -> Option<&[f64]> {
        self.out.copy_from_slice(row);
        self.add_past(1.0);
        self.keep(row);
        let scale = self.model.deviation.recip();
        self.out.iter_mut().for_each(|value| *value *= scale);
        (self.taken > self.model.order()).then_some(&self.out)
    }

    /// s / A(z) times the rows, with zeros before the first.
    pub(crate) fn coloured(&mut self, row: &[f64]) -> &[f64] {
        for (out, value) in self.out.iter_mut().zip(row) {
            *out = self.model.deviation * value;
        }
        self.add_past(-1.0);
        let out = std::mem::take(&mut self.out);
        self.keep(&out);
        self.out = out;
        &self.out
    }

    fn add_past(&mut self, sign: f64) {
        let (columns, order) = (self.out.len(), self.model.order());
        for (k, a) in self.model.coefficients.iter().enumerate() {
            // The row k + 1 before this one.
            let Some(number) = self.taken.checked_sub(k + 1) else { break };
            let past = &self.past[number % order * columns..][..columns];
            self.out.iter_mut().zip(past).for_each(|(out, past)| *out += sign * a * past);
        }
    }

    fn keep(&mut self, row: &[f64]) {
        if let Some(place) = self.taken.checked_rem(self.model.order()) {
            self.past[place * row.len()..][..row.len()].copy_from_slice(row);
        }
        self.taken += 1;
    }
}

#[cfg(test)]
mod tests_of_colour {
    use crate::records::signal::white;

    use super::*;

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

#[cfg(test)]
mod tests_of_autoregression {
    use crate::records::signal::white;

    use super::*;

    #[test]
    fn filters_undo_each_other() {
        let model = Autoregression { coefficients: vec![-1.2, 0.5, 0.1], deviation: 0.3 };
        let noise = white(200);
        let (mut there, mut back) = (RowFilter::new(&model, 2), RowFilter::new(&model, 2));
        for (k, pair) in noise.chunks_exact(2).enumerate() {
            let coloured = there.coloured(pair).to_vec();
            match back.whitened(&coloured) {
                Some(white) => assert!(white.iter().zip(pair).all(|(a, b)| (a - b).abs() < 1e-12)),
                None => assert!(k < 3),
            }
        }
    }

    #[test]
    fn white_noise_has_no_order_and_a_resonance_has_two() {
        let noise = white(20_000);
        assert_eq!(Autoregression::of(&noise).order(), 0);
        let model = Autoregression { coefficients: vec![-1.8, 0.9], deviation: 0.1 };
        let mut filter = RowFilter::new(&model, 1);
        let series: Vec<f64> = noise.iter().map(|v| filter.coloured(&[v * 3.0_f64.sqrt()])[0] + 5.0).collect();
        let found = Autoregression::of(&series);
        assert!((2..=4).contains(&found.order()), "{found:?}");
        assert!((found.coefficients[0] + 1.8).abs() < 0.05 && (found.deviation - 0.1).abs() < 0.005, "{found:?}");
    }
}
