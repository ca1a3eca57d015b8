//! What loop shift and slow gain know of the past of the drive.

use crate::real::unless_faded;

/// What loop shift and slow gain see of the scaled drive x: the follower f, how far it stays behind, e, and the mean
/// square m of that. The equations stand at [`LoopShiftTerms`](super::LoopShiftTerms).
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower {
    /// a
    decay: f64,
    /// (a - a^8) / 7
    square_gain: f64,
    /// a^4
    behind_decay: f64,
    limit: f64,
    /// m
    mean_square: f64,
    /// f
    place: f64,
}

impl Follower {
    /// At rest at 0.
    pub(super) fn new(decay: f64, limit: f64) -> Self {
        let a = decay;
        let (a2, a4) = (a * a, a * a * a * a);
        // As a product, so that no digit is lost where a is nearly 1.
        let square_gain = a * (1.0 - a) * (1.0 + a + a2 + a2 * a + a4 + a4 * a + a4 * a2) / 7.0;
        Self { decay, square_gain, behind_decay: a4, limit, mean_square: 0.0, place: 0.0 }
    }

    /// m.
    #[inline]
    pub(super) fn mean_square(&self) -> f64 {
        self.mean_square
    }

    /// f.
    pub(super) fn place(&self) -> f64 {
        self.place
    }

    /// Holds x for one sampling interval; returns e.
    #[inline]
    pub(super) fn hold(&mut self, x: f64) -> f64 {
        let behind = (x - self.place).max(-self.limit).min(self.limit);
        self.mean_square = self.decay * self.mean_square + self.square_gain * (behind * behind);
        self.place = x - self.behind_decay * behind;
        if unless_faded(behind) == 0.0 {
            (self.mean_square, self.place) = (unless_faded(self.mean_square), x);
            return 0.0;
        }
        behind
    }

    /// x has been held since forever.
    pub(super) fn settle(&mut self, x: f64) {
        self.restore(0.0, x);
    }

    /// Continues from a state that was checked.
    pub(super) fn restore(&mut self, mean_square: f64, place: f64) {
        (self.mean_square, self.place) = (mean_square, place);
    }
}
