//! One second-order section.

use crate::error::{Error, check_all_finite};

/// The largest coefficient: so the terms of a feedback stay finite for all admissible numbers, whatever the filter.
const MAX_COEFFICIENT: f64 = 1e12;

/// A second-order section, b before inputs and a before outputs:
///
/// ```text
/// y(k) = b0 u(k) + b1 u(k-1) + b2 u(k-2) - a1 y(k-1) - a2 y(k-2)
/// ```
///
/// A section of first order has b2 = a2 = 0. It is evaluated in the transposed direct form II, which has the fewest states and the
/// least rounding of the direct forms (Oppenheim and Schafer, Discrete-Time Signal Processing, chapter 6).
///
/// ```
/// use hysteresis_core::Biquad;
/// let mean = Biquad::new([0.5, 0.5, 0.0], [0.0, 0.0])?;
/// assert_eq!(mean.static_gain(), 1.0);
/// let error = Biquad::new([1.0, 0.0, 0.0], [0.0, 1.0]).unwrap_err();
/// assert_eq!(error.to_string(), "a[1]: expected a stable section, |a2| < 1 and |a1| < 1 + a2, got 1.0");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
}

impl Biquad {
    /// What goes through unchanged.
    pub const IDENTITY: Self = Self { b: [1.0, 0.0, 0.0], a: [0.0, 0.0] };

    /// A section of these coefficients, that before y(k) being 1.
    ///
    /// # Errors
    /// [`Error::Domain`] for a coefficient that is not finite or beyond 1e12, or unless both poles lie inside the unit circle.
    pub fn new(b: [f64; 3], a: [f64; 2]) -> Result<Self, Error> {
        for (parameter, values) in [("b", &b[..]), ("a", &a[..])] {
            check_all_finite(parameter, values)?;
            if let Some((index, got)) = values.iter().enumerate().find(|(_, value)| value.abs() > MAX_COEFFICIENT) {
                return Err(Error::domain(parameter, Some(index), "at most 1e12 in magnitude", *got));
            }
        }
        let expected = "a stable section, |a2| < 1 and |a1| < 1 + a2";
        if a[1].abs() >= 1.0 {
            return Err(Error::domain("a", Some(1), expected, a[1]));
        }
        if a[0].abs() >= 1.0 + a[1] {
            return Err(Error::domain("a", Some(0), expected, a[0]));
        }
        Ok(Self { b, a })
    }

    /// b0, b1 and b2.
    #[must_use]
    pub fn numerator(&self) -> [f64; 3] {
        self.b
    }

    /// a1 and a2.
    #[must_use]
    pub fn denominator(&self) -> [f64; 2] {
        self.a
    }

    /// What a constant input is multiplied by in the end.
    #[must_use]
    pub fn static_gain(&self) -> f64 {
        (self.b[0] + self.b[1] + self.b[2]) / (1.0 + self.a[0] + self.a[1])
    }

    /// By how much the largest input may be amplified at most, or more: the sum of |b| over what the poles lack to the unit circle.
    pub(super) fn largest_gain(&self) -> f64 {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        // (1 - |p|) (1 - |q|) of the poles p and q, or less.
        let margin = if a1 * a1 < 4.0 * a2 {
            0.25 * (1.0 - a2) * (1.0 - a2)
        } else if a2 >= 0.0 {
            1.0 + a2 - a1.abs()
        } else {
            0.25 * (1.0 + a2 + a1) * (1.0 + a2 - a1)
        };
        (b0.abs() + b1.abs() + b2.abs()) / margin
    }

    /// The output for an input, and the states after it.
    #[inline]
    pub(super) fn next(&self, [s, t]: [f64; 2], input: f64) -> (f64, [f64; 2]) {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        let output = b0 * input + s;
        (output, [b1 * input - a1 * output + t, b2 * input - a2 * output])
    }

    /// The states in which the same input gives the same output again: exactly at rest if the output is the input times the static
    /// gain.
    pub(super) fn going_on(&self, input: f64, output: f64) -> [f64; 2] {
        [output - self.b[0] * input, self.b[2] * input - self.a[1] * output]
    }
}

#[cfg(test)]
mod tests {
    use super::Biquad;

    #[test]
    fn poles_of_either_sign_have_a_gain_as_large_as_is_stated() {
        // A quarter of what both poles together lack to the unit circle, each to its nearer end.
        let section = Biquad::new([1.0, -2.0, 0.5], [0.1, -0.25]).unwrap();
        let expected = 3.5 / (0.25 * (1.0 - 0.25 + 0.1) * (1.0 - 0.25 - 0.1));
        assert!((section.largest_gain() / expected - 1.0).abs() < 1e-14);
    }

    /// The sum of the magnitudes of the impulse response is by how much the worst input is amplified.
    fn worst_input(section: &Biquad) -> f64 {
        let mut state = [0.0; 2];
        let mut sum = 0.0;
        for k in 0..40_000 {
            let (output, next) = section.next(state, if k == 0 { 1.0 } else { 0.0 });
            (sum, state) = (sum + output.abs(), next);
        }
        sum
    }

    /// From far inside the unit circle to near it, where a bound that is a little wrong is wrong by much.
    #[test]
    fn no_input_is_amplified_by_more_than_the_largest_gain() {
        let sizes = [0.0, 0.3, 0.9, 0.99, 0.999];
        for one in sizes {
            for other in sizes {
                let real = [(one, other), (-one, other), (-one, -other)].map(|(p, q)| [-(p + q), p * q]);
                let pair = [0.01, 1.0, 3.1].map(|angle: f64| [-2.0 * one * angle.cos(), one * one]);
                for a in real.into_iter().chain(pair) {
                    let section = Biquad::new([1.0, 0.0, 0.0], a).unwrap();
                    let (worst, bound) = (worst_input(&section), section.largest_gain());
                    assert!(worst <= bound * (1.0 + 1e-9), "{a:?}: {worst} > {bound}");
                    assert!(
                        bound <= 4.0 * worst.max(1.0) / (1.0 - one.max(other)),
                        "{a:?}: {bound} says nothing, {worst}"
                    );
                }
            }
        }
    }
}
