//! What the model puts out at a point, as one number for each sample that is looked at, on the engine of the core.

use std::borrow::Cow;

use hysteresis_core::{Error, ModifiedPrandtlIshlinskii, Offsets, Process};

use crate::fit::course::Course;
use crate::fit::point::{Parameter, Point};
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;

/// The inputs that operators need to see for the rows of a course, behind one dead time.
///
/// A row reads the outputs `whole` samples before it and one sample earlier still, as
/// [`Regressor`](crate::fit::regressor::Regressor) does.
pub(super) struct Visits<'a> {
    inputs: Cow<'a, [f64]>,
    /// For each row the place of its newest sample among the inputs.
    places: Vec<usize>,
    fraction: f64,
}

impl<'a> Visits<'a> {
    /// `delay` in samples, not negative.
    pub(super) fn new(input: &'a [f64], course: &Course, delay: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let fraction = delay - delay.floor();
        let newest = (0..course.len()).map(|row| course.sample(row).saturating_sub(whole));
        let Some(turns) = course.turns() else {
            return Self { inputs: Cow::Borrowed(input), places: newest.collect(), fraction };
        };
        let (mut inputs, mut seen, mut turned) = (vec![input[0]], 0, 0);
        let mut place = |last: usize| {
            while seen < last {
                while turns.get(turned).is_some_and(|turn| *turn <= seen) {
                    turned += 1;
                }
                let row = (last - 1).max(seen + 1);
                seen = turns.get(turned).map_or(row, |turn| row.min(*turn));
                inputs.push(input[seen]);
            }
            inputs.len() - 1
        };
        let places = newest.map(&mut place).collect();
        Self { inputs: Cow::Owned(inputs), places, fraction }
    }

    /// The output of the hysteresis at a point, without the output offset, for all inputs.
    pub(super) fn outputs(
        &self,
        point: &Point,
        weights: &[f64],
        space: &Space,
        basis: &WeightBasis,
    ) -> Result<Vec<f64>, Error> {
        let (above, below) = basis.families(weights);
        let offsets = Offsets { input: point.get(Parameter::InputOffset), output: 0.0 };
        let (thresholds, ratios) = (space.thresholds(point), space.ratios(point));
        let model = ModifiedPrandtlIshlinskii::from_ratios(above, &thresholds, ratios, offsets)?;
        let model = if let Some(below) = below { model.with_negative_weights(below)? } else { model };
        let mut outputs = vec![0.0; self.inputs.len()];
        model.forward().run(&self.inputs, &mut outputs)?;
        Ok(outputs)
    }

    /// The value of a row, behind the dead time, and its derivative by the delay in samples.
    pub(super) fn at(&self, row: usize, outputs: &[f64]) -> (f64, f64) {
        let place = self.places[row];
        let (now, before) = (outputs[place], outputs[place.saturating_sub(1)]);
        (now + self.fraction * (before - now), before - now)
    }
}
