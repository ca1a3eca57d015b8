//! What the model puts out at a point, as one number for each sample that is looked at, on the engine of the core.

use std::borrow::Cow;

use hysteresis_core::{Error, ModifiedPrandtlIshlinskii, Offsets, Process};

use crate::fit::course::Course;
use crate::fit::point::{Parameter, Point};
use crate::fit::seen_samples::SeenSamples;
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
        if course.turns().is_none() {
            return Self { inputs: Cow::Borrowed(input), places: newest.collect(), fraction };
        }
        let seen: Vec<usize> = SeenSamples::new(input.len(), Some(course), whole).collect();
        let mut place = 0;
        let places = newest.map(|newest| {
            place += seen[place..].iter().take_while(|sample| **sample < newest).count();
            place
        });
        let places = places.collect();
        Self { inputs: seen.into_iter().map(|sample| input[sample]).collect(), places, fraction }
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

    /// What the operators are to see, from rest.
    pub(super) fn inputs(&self) -> &[f64] {
        &self.inputs
    }

    /// Of a row the places of its newest sample and of the one before.
    pub(super) fn places(&self, row: usize) -> (usize, usize) {
        (self.places[row], self.places[row].saturating_sub(1))
    }

    /// The share of the one before.
    pub(super) fn fraction(&self) -> f64 {
        self.fraction
    }
}
