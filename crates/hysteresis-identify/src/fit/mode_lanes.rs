//! The modes beside the first, for many signals at once.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::lanes::{LedInputs, hold, lead};
use super::linear_part::{SampledDynamics, SampledPart};

/// Signals side by side, each through the same modes. See [`DynamicLanes`](super::lanes::DynamicLanes), which has the first mode
/// and the inputs.
#[derive(Clone, Debug)]
pub(crate) struct ModeLanes {
    lanes: usize,
    /// With their shares in the static gain.
    modes: Vec<(f64, SampledDynamics)>,
    /// x - p and v at t_k of every lane, mode by mode, but for what decays with the input behind an amplifier.
    deviation: Vec<f64>,
    v: Vec<f64>,
}

impl ModeLanes {
    pub(crate) fn new(part: &SampledPart, lanes: usize) -> Self {
        let zeros = vec![0.0; part.further.len() * lanes];
        Self { lanes, modes: part.further.clone(), deviation: zeros.clone(), v: zeros }
    }

    /// The modes with their shares in the static gain.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &(f64, SampledDynamics)> {
        self.modes.iter()
    }

    /// See [`hold`].
    #[inline(always)]
    pub(crate) fn hold(&mut self, before: &[f64], p: &[f64]) {
        for (number, (_, mode)) in self.modes.iter().enumerate() {
            let lanes = number * self.lanes..(number + 1) * self.lanes;
            hold(mode, before, p, &mut self.deviation[lanes.clone()], &mut self.v[lanes]);
        }
    }

    /// See [`lead`].
    #[inline(always)]
    pub(super) fn lead(&mut self, inputs: &LedInputs<'_>) {
        for (number, (_, mode)) in self.modes.iter().enumerate() {
            let Some(amplifier) = &mode.amplifier else { continue };
            let lanes = number * self.lanes..(number + 1) * self.lanes;
            lead(mode, amplifier, inputs, &mut self.deviation[lanes.clone()], &mut self.v[lanes]);
        }
    }

    /// A reading of one lane with the same added to it.
    pub(crate) fn added_to(&self, first: f64, lane: usize) -> f64 {
        let add = |sum: f64, ((gain, mode), (deviation, v)): (&(f64, SampledDynamics), (f64, f64))| {
            sum + gain * (mode.reading.xx * deviation + mode.reading.xv * v)
        };
        self.modes.iter().zip(self.states(lane)).fold(first, add)
    }

    /// (x - p, v) of every mode in a lane.
    fn states(&self, lane: usize) -> impl Iterator<Item = (f64, f64)> {
        (0..self.modes.len()).map(move |number| number * self.lanes + lane).map(|i| (self.deviation[i], self.v[i]))
    }
}
