//! The general form of linear dynamics: from matrices or from the polynomials of a transfer function.

use core::f64::consts::TAU;

use hysteresis_core::{MAX_MAGNITUDE, check_all_finite};
use nalgebra::linalg::Schur;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};

use super::Error;
use crate::checks::{check_number, check_positive};

/// The most states: what is larger is a model of a structure, to be reduced first.
pub(super) const MAX_STATES: usize = 64;

/// A static gain below this share of what it is the sum of is none.
pub(super) const NO_GAIN: f64 = 1e-12;

/// A pole whose real part is not below this share of the fastest one's magnitude is not stable.
const STABLE: f64 = 1e-14;

/// Stable linear dynamics of one input and one output in continuous time: x' = A x + b u, y = c x + d u.
///
/// Time is in seconds. The static gain d - c A^-1 b is not 0, as positions follow their drive.
///
/// ```
/// use hysteresis_control::linear::StateSpace;
/// use nalgebra::{DMatrix, DVector};
/// let (a, b, c) = (DMatrix::from_vec(1, 1, vec![-500.0]), DVector::from_vec(vec![2.0]), DVector::from_vec(vec![250.0]));
/// let lag = StateSpace::new(a, b, c, 0.0)?;
/// let same = StateSpace::from_transfer_function(&[1.0], &[0.002, 1.0])?;
/// assert_eq!(lag.static_gain(), 1.0);
/// assert!((lag.frequency_response(80.0) - same.frequency_response(80.0)).norm() < 1e-15);
/// assert!((same.poles()[0].re + 500.0).abs() < 1e-12);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DVector<f64>,
    pub(super) c: DVector<f64>,
    pub(super) d: f64,
    /// Known without rounding where the dynamics come from parameters.
    pub(super) gain: f64,
    pub(super) poles: Vec<Complex<f64>>,
}

impl StateSpace {
    /// From the matrices, b and c as columns.
    ///
    /// # Errors
    /// [`Error`] that names the matrix: unless A is square of at most 64 rows, b and c have as many entries, all are
    /// finite, every eigenvalue of A has a negative real part and the static gain is not 0.
    pub fn new(a: DMatrix<f64>, b: DVector<f64>, c: DVector<f64>, d: f64) -> Result<Self, Error> {
        let n = a.nrows();
        for (parameter, fits, expected, got) in [
            ("a", a.is_square() && n <= MAX_STATES, "a square matrix of at most 64 rows", a.ncols().max(n)),
            ("b", b.len() == n, "as many entries as a has rows", b.len()),
            ("c", c.len() == n, "as many entries as a has rows", c.len()),
        ] {
            if !fits {
                return Err(Error::whole(parameter, None, expected, got));
            }
        }
        check_all_finite("a", a.as_slice())?;
        check_all_finite("b", b.as_slice())?;
        check_all_finite("c", c.as_slice())?;
        check_all_finite("d", &[d])?;
        let poles = stable_eigenvalues("a", &a)?;
        let rest = rest(&a, &b);
        let (gain, size) = (d + c.dot(&rest), d.abs() + c.abs().dot(&rest.abs()));
        check_number("c", gain.abs() > NO_GAIN * size, "a static gain d - c a^-1 b that is not 0", gain)?;
        Ok(Self { a, b, c, d, gain, poles })
    }

    /// A gain without dynamics.
    ///
    /// # Errors
    /// [`Error`] unless it is finite and not 0.
    pub fn from_gain(gain: f64) -> Result<Self, Error> {
        let expected = "a finite number other than 0 (1e-100 to 1e100 in magnitude)";
        match check_positive("gain", None, gain.abs()) {
            Ok(_) => Ok(Self::constant(gain)),
            Err(_) => Err(Error::domain("gain", None, expected, gain)),
        }
    }

    pub(super) fn constant(gain: f64) -> Self {
        let (a, none) = (DMatrix::zeros(0, 0), DVector::zeros(0));
        Self { a, b: none.clone(), c: none, d: gain, gain, poles: Vec::new() }
    }

    /// A, in 1/s.
    #[must_use]
    pub fn a(&self) -> &DMatrix<f64> {
        &self.a
    }

    /// b.
    #[must_use]
    pub fn b(&self) -> &DVector<f64> {
        &self.b
    }

    /// c, as a column.
    #[must_use]
    pub fn c(&self) -> &DVector<f64> {
        &self.c
    }

    /// d: what passes at once.
    #[must_use]
    pub fn d(&self) -> f64 {
        self.d
    }

    /// The number of states.
    #[must_use]
    pub fn order(&self) -> usize {
        self.b.len()
    }

    /// d - c A^-1 b.
    #[must_use]
    pub fn static_gain(&self) -> f64 {
        self.gain
    }

    /// The poles in radians per second, as many as there are states.
    #[must_use]
    pub fn poles(&self) -> &[Complex<f64>] {
        &self.poles
    }

    /// G(2 pi i f) for a frequency in Hz.
    #[must_use]
    pub fn frequency_response(&self, frequency: f64) -> Complex<f64> {
        self.at(Complex::new(0.0, TAU * frequency))
    }

    /// G(s) = c (s - A)^-1 b + d; not a number at a pole.
    pub(super) fn at(&self, s: Complex<f64>) -> Complex<f64> {
        resolvent(&self.a.map(Complex::from), &self.b.map(Complex::from), &self.c, s) + self.d
    }

    /// These dynamics and `next` behind them: the output of these is the input of `next`.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        let mut both = self.joined(next);
        let n = self.order();
        both.a.view_mut((n, 0), (next.order(), n)).copy_from(&(&next.b * self.c.transpose()));
        both.b.rows_mut(n, next.order()).scale_mut(self.d);
        both.c.rows_mut(0, n).scale_mut(next.d);
        Self { d: self.d * next.d, gain: self.gain * next.gain, ..both }
    }

    /// These dynamics beside `other`: both have the same input, and their outputs add up.
    ///
    /// # Errors
    /// [`Error`] if the static gains cancel.
    pub fn parallel(&self, other: &Self) -> Result<Self, Error> {
        let sum = self.beside(other);
        if sum.gain.abs() <= NO_GAIN * (self.gain.abs() + other.gain.abs()) {
            let expected = "dynamics whose static gain does not cancel the other's";
            return Err(Error::domain("other", None, expected, other.gain));
        }
        Ok(sum)
    }

    pub(super) fn beside(&self, other: &Self) -> Self {
        Self { d: self.d + other.d, gain: self.gain + other.gain, ..self.joined(other) }
    }

    pub(super) fn scaled(mut self, gain: f64) -> Self {
        self.c *= gain;
        self.d *= gain;
        self.gain *= gain;
        self
    }

    /// The states of both, one after the other.
    fn joined(&self, other: &Self) -> Self {
        let (n, m) = (self.order(), other.order());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, n), (m, m)).copy_from(&other.a);
        let stack = |one: &DVector<f64>, two: &DVector<f64>| {
            DVector::from_iterator(n + m, one.iter().chain(two.iter()).copied())
        };
        let poles = self.poles.iter().chain(&other.poles).copied().collect();
        Self { a, b: stack(&self.b, &other.b), c: stack(&self.c, &other.c), d: 0.0, gain: 0.0, poles }
    }

    /// The same dynamics with states scaled by powers of two, so that no entry of A dwarfs the others.
    pub(super) fn balanced(&self) -> Self {
        let mut balanced = self.clone();
        if self.order() > 1 {
            let scale = balance_parlett_reinsch(&mut balanced.a);
            balanced.b.component_div_assign(&scale);
            balanced.c.component_mul_assign(&scale);
        }
        balanced
    }
}

/// c (s - A)^-1 b; not a number at an eigenvalue.
pub(super) fn resolvent(
    a: &DMatrix<Complex<f64>>,
    b: &DVector<Complex<f64>>,
    c: &DVector<f64>,
    s: Complex<f64>,
) -> Complex<f64> {
    if b.is_empty() {
        return Complex::from(0.0);
    }
    let states = (DMatrix::from_diagonal_element(b.len(), b.len(), s) - a).lu().solve(b);
    states.map_or(Complex::from(f64::NAN), |states| states.iter().zip(c).map(|(x, c)| x * *c).sum())
}

/// -A^-1 b: the state at rest for the input 1. What is not a number shows where it is used.
pub(super) fn rest(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    if b.is_empty() {
        return b.clone();
    }
    (-a).lu().solve(b).unwrap_or_else(|| DVector::from_element(b.len(), f64::NAN))
}

/// The eigenvalues, if they can be found.
fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    const ITERATIONS: usize = 10_000;
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    let mut balanced = matrix.clone();
    balance_parlett_reinsch(&mut balanced);
    let schur = Schur::try_new(balanced, f64::EPSILON, ITERATIONS)?;
    Some(schur.complex_eigenvalues().as_slice().to_vec())
}

/// The eigenvalues of a finite matrix, if all are stable.
fn stable_eigenvalues(parameter: &'static str, a: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, Error> {
    let wrong = |expected, got| Error::domain(parameter, None, expected, got);
    let poles = eigenvalues(a).ok_or_else(|| wrong("numbers whose poles can be found", f64::NAN))?;
    let fastest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    match poles.iter().map(|pole| pole.re).max_by(f64::total_cmp) {
        Some(slowest) if slowest >= -STABLE * fastest => Err(wrong("poles with negative real parts", slowest)),
        _ => Ok(poles),
    }
}

/// A Markov parameter below this share of what it is made of is rounding.
const NOTHING: f64 = 1e-12;

impl StateSpace {
    /// From a proper transfer function G(s) = N(s) / D(s), with the coefficients of both from the highest power of s
    /// on.
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
