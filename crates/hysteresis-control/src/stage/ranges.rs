//! Between which positions and slopes a stage lies.

use hysteresis_core::Process;

use super::Stage;
use crate::linear::Creep;

/// Creep takes no more than this share of the loop from either end: creep that may go on for more leaves no range.
const MOST_CREPT: f64 = 0.25;

impl Stage {
    /// The lowest and the highest slope dy/du, creep at its end included. A loop shift does not change it: the newest
    /// drive does not enter it, and at its end it is 0.
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        let (mut low, mut high) = self.model.slope_range();
        for map in [&self.parts.input_map, &self.parts.output_map].into_iter().flatten() {
            let (flat, steep) = map.slope_range();
            (low, high) = (low * flat, high * steep);
        }
        let crept: f64 = self.parts.creep.iter().flat_map(Creep::amplitudes).sum();
        let gain = self.parts.dynamics.static_gain().abs();
        (low * gain * (1.0 + crept).min(1.0), high * gain * (1.0 + crept).max(1.0))
    }

    /// The positions that the stage reaches whatever happened before: every one between these two has a drive within
    /// [`drive_range`](Self::drive_range), after any history within it. None for a stage without a range of drives.
    ///
    /// They are the ends of the slow loop over that range: maps, hysteresis and the static gain of the modes, at the low
    /// end after a stroke to the high one and the other way round. So the remanence is outside, though a stage that was
    /// never driven begins there. Creep counts where it is worst, at rest at the other end, but takes no more than a
    /// quarter of the loop from either end. What modes overshoot and what a loop shift adds in motion do not count.
    #[must_use]
    pub fn position_range(&self) -> Option<(f64, f64)> {
        let (first, (from, to)) = (self.first_strokes()?, self.drive_range()?);
        let mut forward = self.rigid.forward();
        forward.step(to);
        let (low, high) = ordered((forward.step(from), forward.step(to)));
        let (middle, room) = self.crept(first);
        let room = room.min(MOST_CREPT * (high - low));
        Some(self.behind_modes((low + middle + room, high + middle - room)))
    }

    /// The positions that the stage may come to by itself: where first strokes end, and what creep adds to them.
    pub(super) fn widest_position_range(&self) -> Option<(f64, f64)> {
        let (low, high) = self.first_strokes()?;
        let (middle, room) = self.crept((low, high));
        Some(self.behind_modes((low + middle - room, high + middle + room)))
    }

    /// In front of creep: no history leads farther.
    fn first_strokes(&self) -> Option<(f64, f64)> {
        let (from, to) = self.drive_range()?;
        let mut forward = self.rigid.forward();
        Some(ordered((forward.settle(from), forward.settle(to))))
    }

    /// What creep adds after rest in the middle of these positions, and by how much more or less it may be.
    fn crept(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let amplitudes = || self.parts.creep.iter().flat_map(Creep::amplitudes);
        let (sum, size) = (amplitudes().sum::<f64>(), amplitudes().map(|amplitude| amplitude.abs()).sum::<f64>());
        (0.5 * (low + high) * sum, 0.5 * (high - low) * size)
    }

    fn behind_modes(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let gain = self.parts.dynamics.static_gain();
        ordered((gain * low, gain * high))
    }
}

fn ordered((one, other): (f64, f64)) -> (f64, f64) {
    (one.min(other), one.max(other))
}
