//! Smooth changes between two values, and a run from rest to rest.

use super::motion::{Motion, ROUNDING};

/// S(s) = 10 s^3 - 15 s^4 + 6 s^5, which leads from 0 at s = 0 to 1 at s = 1, where its first two derivatives vanish.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smooth {
    /// The integral of S from 0 to s.
    pub(super) integral: f64,
    pub(super) value: f64,
    /// S' of s, and so on.
    pub(super) first: f64,
    pub(super) second: f64,
    pub(super) third: f64,
}

/// The greatest S'.
pub(super) const GREATEST_SLOPE: f64 = 15.0 / 8.0;

impl Smooth {
    /// For s from 0 to 1.
    pub(super) fn at(s: f64) -> Self {
        let rest = 1.0 - s;
        Self {
            integral: s.powi(4) * (2.5 - 3.0 * s + s * s),
            value: s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s),
            first: 30.0 * (s * rest).powi(2),
            second: 60.0 * s * rest * (rest - s),
            third: 60.0 * (1.0 - 6.0 * s * rest),
        }
    }
}

/// A run along a line, from rest at 0 to rest: the rate rises along S, stays, and falls along S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    pub(super) rate: f64,
    /// How many seconds the rate rises, stays, and falls.
    pub(super) lead_in: f64,
    pub(super) steady: f64,
    pub(super) lead_out: f64,
}

impl Run {
    /// A run of a length, with a rate that rises over the first part of it and falls over the last.
    pub(super) fn over(length: f64, rate: f64, (first, last): (f64, f64)) -> Self {
        // The mean of a rate that rises along S is half of it.
        Self { rate, lead_in: 2.0 * first / rate, steady: (length - first - last) / rate, lead_out: 2.0 * last / rate }
    }

    pub(super) fn length(&self) -> f64 {
        self.rate * (0.5 * self.lead_in + self.steady + 0.5 * self.lead_out)
    }

    pub(super) fn duration(&self) -> f64 {
        self.lead_in + self.steady + self.lead_out
    }

    /// When the rate is the stated one, from and to.
    pub(super) fn steady(&self) -> (f64, f64) {
        (self.lead_in, self.lead_in + self.steady)
    }

    pub(super) fn at(&self, t: f64) -> Motion {
        let Self { rate, lead_in, lead_out, .. } = *self;
        // The time of the last sample may be a rounding short of the end.
        let remaining = self.duration() * (1.0 - 2.0 * ROUNDING) - t;
        if t <= 0.0 || remaining <= 0.0 {
            return Motion::rest(if t <= 0.0 { 0.0 } else { self.length() });
        }
        if t < lead_in {
            let smooth = Smooth::at(t / lead_in);
            return Motion {
                position: rate * lead_in * smooth.integral,
                velocity: rate * smooth.value,
                acceleration: rate * smooth.first / lead_in,
                jerk: rate * smooth.second / lead_in / lead_in,
            };
        }
        if remaining < lead_out {
            let smooth = Smooth::at(remaining / lead_out);
            return Motion {
                position: self.length() - rate * lead_out * smooth.integral,
                velocity: rate * smooth.value,
                acceleration: -rate * smooth.first / lead_out,
                jerk: rate * smooth.second / lead_out / lead_out,
            };
        }
        Motion { position: rate * (t - 0.5 * lead_in), velocity: rate, ..Motion::default() }
    }
}
