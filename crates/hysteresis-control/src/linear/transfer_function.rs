//! Dynamics from the polynomials of a transfer function, and the zeros of any.

use hysteresis_core::{MAX_MAGNITUDE, check_all_finite};
use nalgebra::{Complex, DMatrix, DVector};

use super::Error;
use super::state_space::{MAX_STATES, StateSpace, eigenvalues, rest, stable_eigenvalues};

/// A Markov parameter below this share of what it is made of is rounding.
const NOTHING: f64 = 1e-12;

impl StateSpace {
    /// From a proper transfer function G(s) = N(s) / D(s), with the coefficients of both from the highest power of s on.
    ///
    /// The states are those of the controllable canonical form in a unit of time in which the poles are of the order
    /// of 1.
    ///
    /// ```
    /// use hysteresis_control::linear::{SecondOrder, StateSpace};
    /// let w = core::f64::consts::TAU * 400.0;
    /// let stage = StateSpace::from_transfer_function(&[w * w], &[1.0, 2.0 * 0.95 * w, w * w])?;
    /// let same = StateSpace::from(SecondOrder::new(400.0, 0.95)?);
    /// assert!((stage.frequency_response(300.0) - same.frequency_response(300.0)).norm() < 1e-14);
    /// let error = StateSpace::from_transfer_function(&[1.0], &[1.0, 0.0]).unwrap_err();
    /// assert_eq!(error.to_string(), "denominator: expected poles with negative real parts, got -0.0");
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`] that names the polynomial: unless all coefficients are finite, the denominator is not 0, its degree is
    /// at most 64 and not below the numerator's, all its roots have negative real parts and G(0) is not 0.
    pub fn from_transfer_function(numerator: &[f64], denominator: &[f64]) -> Result<Self, Error> {
        check_all_finite("numerator", numerator)?;
        check_all_finite("denominator", denominator)?;
        let wrong = |parameter, expected, got| Error::domain(parameter, None, expected, got);
        let (numerator, denominator) = (trimmed(numerator), trimmed(denominator));
        let Some((leading, tail)) = denominator.split_first() else {
            return Err(wrong("denominator", "a polynomial that is not 0", 0.0));
        };
        let n = tail.len();
        #[expect(clippy::cast_precision_loss, reason = "only shown")]
        if n > MAX_STATES {
            return Err(wrong("denominator", "a degree of at most 64", n as f64));
        }
        #[expect(clippy::cast_precision_loss, reason = "only shown")]
        if numerator.len() > n + 1 {
            let expected = "a degree that is not above that of the denominator";
            return Err(wrong("numerator", expected, (numerator.len() - 1) as f64));
        }
        let last = numerator.last().copied().unwrap_or(0.0);
        if last == 0.0 {
            return Err(wrong("numerator", "a last coefficient, and so a static gain, that is not 0", last));
        }
        let Some(constant) = tail.last() else { return Self::from_gain(last / leading) };
        // In the unit of time 1 / rate the constant coefficient is as large as the leading one.
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let rate = if *constant == 0.0 { 1.0 } else { (constant / leading).abs().powf(1.0 / n as f64) };
        let power = |i: usize| (0..i).fold(1.0, |power, _| power * rate);
        // tail[i] belongs to s^(n-1-i).
        let alpha: Vec<f64> = (0..n).map(|i| tail[n - 1 - i] / leading / power(n - i)).collect();
        let padded = |i: usize| numerator.len().checked_sub(i + 1).map_or(0.0, |place| numerator[place]);
        let d = padded(n) / leading;
        let c = DVector::from_fn(n, |i, _| padded(i) / leading / power(n - i) - d * alpha[i]);
        let a = DMatrix::from_fn(n, n, |i, j| {
            let shift = if j == i + 1 { rate } else { 0.0 };
            if i + 1 == n { -rate * alpha[j] } else { shift }
        });
        let b = DVector::from_fn(n, |i, _| if i + 1 == n { rate } else { 0.0 });
        if !a.iter().chain(&c).all(|entry| entry.abs() <= MAX_MAGNITUDE) {
            return Err(wrong("denominator", "coefficients of which the ratios are finite", *leading));
        }
        let poles = stable_eigenvalues("denominator", &a)?;
        Ok(Self { a, b, c, d, gain: last / constant, poles })
    }

    /// The finite zeros in radians per second.
    ///
    /// With p = 1/s the transfer function has the same static gain as direct feed-through, so its zeros are the
    /// eigenvalues of A^-1 + A^-1 b c A^-1 / G(0): those that are not 0, which are the zeros at infinity.
    #[must_use]
    pub fn zeros(&self) -> Vec<Complex<f64>> {
        let Self { a, b, c, .. } = self.balanced();
        let finite = self.order() - relative_degree(&a, &b, &c, self.d);
        if finite == 0 {
            return Vec::new();
        }
        let Some(inverse) = a.clone().try_inverse() else { return Vec::new() };
        let reaches = -rest(&a, &b);
        let seen = c.transpose() * &inverse;
        let mut reciprocals = eigenvalues(&(inverse + reaches * seen / self.gain)).unwrap_or_default();
        reciprocals.sort_by(|one, other| other.norm().total_cmp(&one.norm()));
        reciprocals.truncate(finite);
        reciprocals.into_iter().map(|p| p.inv()).collect()
    }
}

/// By how many the poles outnumber the finite zeros: the first of d, c b, c A b, .. that is not 0.
fn relative_degree(a: &DMatrix<f64>, b: &DVector<f64>, c: &DVector<f64>, d: f64) -> usize {
    let n = b.len();
    let rest = rest(a, b);
    if d.abs() > NOTHING * c.abs().dot(&rest.abs()) {
        return 0;
    }
    let mut reached = b.clone();
    let mut bound = b.abs();
    for degree in 1..n {
        if c.dot(&reached).abs() > NOTHING * c.abs().dot(&bound) {
            return degree;
        }
        reached = a * reached;
        bound = a.abs() * bound;
    }
    n
}

/// Without leading zeros.
fn trimmed(coefficients: &[f64]) -> &[f64] {
    let first = coefficients.iter().position(|coefficient| *coefficient != 0.0);
    first.map_or(&[], |first| &coefficients[first..])
}
