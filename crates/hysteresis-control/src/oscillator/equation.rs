//! The differential equation, integrated by the classical Runge-Kutta method of fourth order, with the moments at
//! which the motion turns round found inside a step.
//!
//! It is written for any [`Scalar`]: plain numbers, or numbers that carry derivatives by the parameters. So the
//! tangents of a fit are those of the very steps that a model takes.

use std::ops::{Add, Mul, Sub};

/// A number, perhaps with derivatives.
pub trait Scalar: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// A constant.
    fn constant(value: f64) -> Self;
    /// The number itself.
    fn value(self) -> f64;
    /// Times a constant.
    #[must_use]
    fn scaled(self, by: f64) -> Self;
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn scaled(self, by: f64) -> Self {
        self * by
    }
}

/// Position, velocity and z, or their rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<S> {
    /// y.
    pub position: S,
    /// y'.
    pub velocity: S,
    /// z.
    pub hysteresis: S,
}

impl<S: Scalar> State<S> {
    /// At rest, at 0.
    #[must_use]
    pub fn rest() -> Self {
        let zero = S::constant(0.0);
        Self { position: zero, velocity: zero, hysteresis: zero }
    }

    #[inline(always)]
    fn ahead(&self, rate: &Self, h: f64) -> Self {
        Self {
            position: self.position + rate.position.scaled(h),
            velocity: self.velocity + rate.velocity.scaled(h),
            hysteresis: self.hysteresis + rate.hysteresis.scaled(h),
        }
    }
}

/// f over z in one direction: what the core calls a chain, for any scalar.
///
/// Straight between the knots; beyond them a line that grows outwards goes on, and f stays where it falls, or is below 0.
#[derive(Clone, Debug, PartialEq)]
struct Slopes<S> {
    /// Where each line ends, and what it is: f at a reference, df/dz, the reference.
    lines: Vec<(f64, S, S, f64)>,
}

impl<S: Scalar> Slopes<S> {
    fn new(knots: &[f64], values: &[S]) -> Self {
        let zero = S::constant(0.0);
        let between = |i: usize| {
            let gradient = (values[i + 1] - values[i]).scaled(1.0 / (knots[i + 1] - knots[i]));
            (knots[i + 1], values[i], gradient, knots[i])
        };
        let inner: Vec<_> = (0..knots.len() - 1).map(between).collect();
        let (first, last) = (inner[0].2, inner[inner.len() - 1].2);
        let falls = values[0].value() < 0.0;
        let below = (knots[0], values[0], if first.value() < 0.0 && !falls { first } else { zero }, knots[0]);
        let (end, value) = (knots[knots.len() - 1], values[values.len() - 1]);
        let above = (f64::INFINITY, value, if last.value() > 0.0 && !falls { last } else { zero }, end);
        Self { lines: std::iter::once(below).chain(inner).chain([above]).collect() }
    }

    #[inline(always)]
    fn at(&self, z: S) -> S {
        // The last line has no end, and NaN is on none.
        let on = self.lines.iter().find(|line| z.value() < line.0);
        on.map_or(z, |(_, value, gradient, reference)| *value + *gradient * (z - S::constant(*reference)))
    }
}

/// y'' = b u - c y' - k y - z and z' = f(z) y', with f+ where y rises and f- where it falls.
#[derive(Clone, Debug, PartialEq)]
pub struct Equation<S> {
    gain: S,
    damping: S,
    stiffness: S,
    rising: Slopes<S>,
    falling: Slopes<S>,
}

/// What the drive is at the beginning, in the middle and at the end of a step.
pub type StepDrive = [f64; 3];

impl<S: Scalar> Equation<S> {
    /// From b, c and k, at least two knots that increase, and f+ and f- there.
    ///
    /// # Panics
    /// For fewer than two knots, or fewer values.
    #[must_use]
    pub fn new([gain, damping, stiffness]: [S; 3], knots: &[f64], rising: &[S], falling: &[S]) -> Self {
        let (rising, falling) = (Slopes::new(knots, rising), Slopes::new(knots, falling));
        Self { gain, damping, stiffness, rising, falling }
    }

    #[inline(always)]
    fn acceleration(&self, at: &State<S>, u: f64) -> S {
        self.gain.scaled(u) - self.damping * at.velocity - self.stiffness * at.position - at.hysteresis
    }

    #[inline(always)]
    fn rates(&self, at: &State<S>, u: f64, slopes: &Slopes<S>) -> State<S> {
        State {
            position: at.velocity,
            velocity: self.acceleration(at, u),
            hysteresis: slopes.at(at.hysteresis) * at.velocity,
        }
    }

    /// One step in one direction.
    #[inline(always)]
    fn straight(&self, from: &State<S>, h: f64, [u0, middle, u1]: StepDrive, rising: bool) -> State<S> {
        let slopes = if rising { &self.rising } else { &self.falling };
        let k1 = self.rates(from, u0, slopes);
        let k2 = self.rates(&from.ahead(&k1, 0.5 * h), middle, slopes);
        let k3 = self.rates(&from.ahead(&k2, 0.5 * h), middle, slopes);
        let k4 = self.rates(&from.ahead(&k3, h), u1, slopes);
        from.ahead(&k1, h / 6.0).ahead(&k2, h / 3.0).ahead(&k3, h / 3.0).ahead(&k4, h / 6.0)
    }

    /// One step of h seconds. Where y turns round within it there are two, with the turning point between them.
    #[inline]
    #[must_use]
    pub fn step(&self, from: &State<S>, h: f64, drive: StepDrive) -> State<S> {
        let (velocity, push) = (from.velocity.value(), self.acceleration(from, drive[0]).value());
        let rising = velocity > 0.0 || (velocity == 0.0 && push > 0.0);
        let there = self.straight(from, h, drive, rising);
        let last = there.velocity.value();
        if velocity == 0.0 || velocity * last >= 0.0 || last.is_nan() {
            return there;
        }
        let share = zero_of_parabola(velocity, push * h, last);
        let at = |s: f64| parabola(drive, s);
        let turned = self.straight(from, share * h, [at(0.0), at(0.5 * share), at(share)], rising);
        let rest = 1.0 - share;
        self.straight(&turned, rest * h, [at(share), at(share + 0.5 * rest), at(1.0)], !rising)
    }
}

/// The drive at a share of a step, by the parabola through what it is at three places.
fn parabola([u0, middle, u1]: StepDrive, s: f64) -> f64 {
    let (bend, rise) = (2.0 * (u0 - 2.0 * middle + u1), u1 - u0);
    u0 + s * (rise - bend * (1.0 - s))
}

/// Where between 0 and 1 the parabola that begins at `first` with the slope `slope` and ends at `last`, of the other
/// sign, is zero.
fn zero_of_parabola(first: f64, slope: f64, last: f64) -> f64 {
    let bend = last - first - slope;
    let root = (slope * slope - 4.0 * bend * first).max(0.0).sqrt();
    let half = -0.5 * (slope + root.copysign(slope));
    let straight = first / (first - last);
    [first / half, half / bend].into_iter().find(|s| (0.0..=1.0).contains(s)).unwrap_or(straight)
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Duhem;

    use super::*;

    #[test]
    fn slopes_are_those_of_the_core() {
        let knots = [-1.0, 0.0, 2.0];
        for sign in [1.0, -1.0] {
            let [rising, falling] = [[1.0, 2.0, 3.0], [4.0, 5.0, 0.5]].map(|values| values.map(|f| sign * f));
            let duhem = Duhem::<3>::new(&knots, &rising, &falling).unwrap();
            for (values, is_rising) in [(rising, true), (falling, false)] {
                let slopes = Slopes::new(&knots, &values);
                for z in [-3.0, -1.0, -0.3, 0.0, 1.2, 2.0, 7.0] {
                    assert!((slopes.at(z) - duhem.slope(z, is_rising)).abs() < 1e-15, "{sign} {z}");
                }
            }
        }
    }

    #[test]
    fn zeros_of_parabolas_are_found() {
        for (first, slope, bend) in [(1.0, -2.0, 0.0), (1.0, 0.0, -3.0), (-1.0, 0.5, 1.0), (1.0, 1.0, -4.0)] {
            let s = zero_of_parabola(first, slope, first + slope + bend);
            assert!((first + slope * s + bend * s * s).abs() < 1e-15 && (0.0..=1.0).contains(&s), "{s}");
        }
        assert_eq!([0.0, 0.5, 1.0].map(|s| parabola([1.0, 5.0, 3.0], s)), [1.0, 5.0, 3.0]);
    }
}
