//! What the model puts out at a point, as one number for each row.

use hysteresis_core::{Error, Forward, ModifiedPrandtlIshlinskii, Offsets, Process};

use crate::fit::point::{Parameter, Point};
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;

/// The output of the hysteresis of a record, without the output offset, row by row: what
/// [`Regressor::output`](crate::fit::regressor::Regressor::output) gives, on the engine of the core.
pub(super) struct Signal<'a> {
    stream: Forward,
    input: &'a [f64],
    whole: usize,
    fraction: f64,
    /// The newest sample that the stream saw.
    seen: Option<usize>,
    /// How many of the turns it saw.
    turned: usize,
    now: f64,
    before: f64,
}

impl<'a> Signal<'a> {
    /// Before the record's first sample; `dt` in the unit of the dead time.
    pub(super) fn new(
        point: &Point,
        weights: &[f64],
        space: &Space,
        basis: &WeightBasis,
        input: &'a [f64],
    ) -> Result<Self, Error> {
        let (above, below) = basis.families(weights);
        let offsets = Offsets { input: point.get(Parameter::InputOffset), output: 0.0 };
        let (thresholds, ratios) = (space.thresholds(point), space.ratios(point));
        let model = ModifiedPrandtlIshlinskii::from_ratios(above, &thresholds, ratios, offsets)?;
        let model = if let Some(below) = below { model.with_negative_weights(below)? } else { model };
        let delay = point.get(Parameter::DeadTime) / space.intervals().of_record(0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let fraction = delay - delay.floor();
        Ok(Self { stream: model.forward(), input, whole, fraction, seen: None, turned: 0, now: 0.0, before: 0.0 })
    }

    /// Goes to a sample, not before the last one; `turns` as for a regressor.
    pub(super) fn go_to(&mut self, sample: usize, turns: Option<&[usize]>) {
        let last = sample.saturating_sub(self.whole);
        if self.seen.is_none() {
            self.now = self.stream.step(self.input[0]);
            self.before = self.now;
        }
        let mut seen = self.seen.unwrap_or(0);
        while seen < last {
            seen = match turns {
                None => seen + 1,
                Some(turns) => {
                    while turns.get(self.turned).is_some_and(|turn| *turn <= seen) {
                        self.turned += 1;
                    }
                    let row = (last - 1).max(seen + 1);
                    turns.get(self.turned).map_or(row, |turn| row.min(*turn))
                }
            };
            self.before = self.now;
            self.now = self.stream.step(self.input[seen]);
        }
        self.seen = Some(seen);
    }

    /// The output at the sample.
    pub(super) fn output(&self) -> f64 {
        self.now + self.fraction * (self.before - self.now)
    }

    /// Its derivative by the delay in samples.
    pub(super) fn slope_over_delay(&self) -> f64 {
        self.before - self.now
    }
}
