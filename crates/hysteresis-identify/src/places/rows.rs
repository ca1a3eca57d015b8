//! Rows of numbers, one for each equation, and what a signal is between samples.

/// The rows of all equations at a point: pairs first, then lengths.
pub(crate) struct Rows {
    pub(crate) width: usize,
    pub(crate) values: Vec<f64>,
}

impl Rows {
    pub(crate) fn iter(&self) -> std::slice::ChunksExact<'_, f64> {
        self.values.chunks_exact(self.width)
    }

    pub(crate) fn iter_mut(&mut self) -> std::slice::ChunksExactMut<'_, f64> {
        self.values.chunks_exact_mut(self.width)
    }

    /// Row by column of weights: what the model says of every equation.
    pub(crate) fn times(&self, weights: &[f64]) -> Vec<f64> {
        self.iter().map(|row| row.iter().zip(weights).map(|(z, w)| z * w).sum()).collect()
    }
}

/// The sample at or before an instant, and how far it is on the way to the next.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an instant of a drive")]
pub(crate) fn between(instant: f64) -> (usize, f64) {
    (instant.floor() as usize, instant - instant.floor())
}

/// A signal at an instant, straight between samples.
pub(crate) fn value_at(values: &[f64], instant: f64) -> f64 {
    let (sample, share) = between(instant);
    values[sample] + share * (values.get(sample + 1).unwrap_or(&values[sample]) - values[sample])
}

/// All but those at places that are left out.
pub(crate) fn kept(values: &[f64], left_out: &[usize]) -> impl Iterator<Item = f64> {
    let is_kept = |place: &usize| left_out.binary_search(place).is_err();
    values.iter().enumerate().filter(move |(place, _)| is_kept(place)).map(|(_, value)| *value)
}
