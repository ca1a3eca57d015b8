//! From one drive to the next, as fast as a slew limit and the sampling allow.

/// How the signal goes from one reversal to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// In equal steps, at most `slew` / `rate` each.
    #[default]
    Triangle,
    /// Along half a cosine, whose steepest step is at most `slew` / `rate`: pi/2 times as long as the triangle, and
    /// without a jump of speed at the reversals.
    Sine,
}

impl Shape {
    /// How much longer a move takes than along a straight line of the same largest speed.
    pub(super) fn stretch(self) -> f64 {
        match self {
            Self::Triangle => 1.0,
            Self::Sine => core::f64::consts::FRAC_PI_2,
        }
    }
}

/// What the quotients that decide about a further step may be off by.
pub(super) const ROUNDING: f64 = 1e-12;

/// Moves within a slew limit. Each ends with a sample of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moves {
    /// The largest speed, per second.
    pub(super) slew: f64,
    /// Samples per second.
    pub(super) rate: f64,
    pub(super) shape: Shape,
}

impl Moves {
    /// How many steps a move takes: a whole number.
    pub(super) fn steps(&self, from: f64, to: f64) -> f64 {
        let longest = self.slew / self.rate;
        // A move that fits but for rounding needs no further step.
        ((to - from).abs() * self.shape.stretch() / longest * (1.0 - ROUNDING)).ceil()
    }

    /// Goes on from the last sample; whoever calls has checked that the steps are few enough.
    pub(super) fn extend(&self, drive: &mut Vec<f64>, to: f64) {
        let from = drive.last().copied().unwrap_or(to);
        let steps = self.steps(from, to);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number up to 2^27")]
        let count = steps as u32;
        drive.extend((1..count).map(|k| self.between(from, to, f64::from(k) / steps)));
        if count > 0 {
            drive.push(to);
        }
    }

    /// The point at a share of the steps from one reversal to the next.
    fn between(&self, from: f64, to: f64, share: f64) -> f64 {
        let way = match self.shape {
            Shape::Triangle => share,
            Shape::Sine => (core::f64::consts::FRAC_PI_2 * share).sin().powi(2),
        };
        // The clamp is for roundings, which must not leave the limits.
        (from + (to - from) * way).clamp(from.min(to), from.max(to))
    }
}
