//! Feed-forward from a window of references, sample by sample, and the smoothing of references that are known
//! beforehand.

use core::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use crate::checks::{check_number, check_positive, check_whole};
use crate::linear::{Discrete, Error, LinearDynamics, PulseTransfer};

/// The longest window, in samples.
const MAX_WINDOW: usize = 1000;

/// The highest degree of polynomials that are followed exactly.
const MAX_DEGREE: usize = 12;

/// That degree unless asked otherwise: beyond, noise grows faster than what is gained.
const DEGREE: usize = 5;

/// Up to where errors count unless asked otherwise, in cycles per sample.
const BAND: f64 = 0.4;

/// What the sum of squares of the coefficients, times the static gain squared, costs relative to a mean square error.
const NOISE: f64 = 0.02;

/// How much more an error at low frequencies counts than one at the end of the band, at most.
const MAX_WEIGHT: f64 = 50.0;

/// The window of [`PreviewCoefficients`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreviewOptions {
    /// How many samples ahead the newest reference is.
    pub ahead: usize,
    /// How many references the window has; by default as many before the moment at which the dead time has passed as
    /// after it, and at least 4.
    pub window: Option<usize>,
    /// The degree of the polynomials that are followed exactly; by default 5, or what a window of less than 6 allows.
    pub degree: Option<usize>,
    /// Up to which frequency in Hz errors count; by default 0.4 / T.
    pub band: Option<f64>,
}

impl PreviewOptions {
    /// The defaults for a number of samples ahead.
    #[must_use]
    pub fn new(ahead: usize) -> Self {
        Self { ahead, window: None, degree: None, band: None }
    }
}

/// The inverse of [`LinearDynamics`] as a weighted sum of references: w(k) = sum_j c_j r(k + ahead - j).
///
/// References that are polynomials up to a degree m are followed exactly: y(k) = r(k), y the position read at t_k. What
/// freedom the window leaves minimises, over the frequencies F up to a band B,
///
/// integral of (B / F)^2 |C(F) P(F) - 1|^2 dF / B + 0.02 G^2 sum_j c_j^2,
///
/// P from the input to the position at the samples, C of the window, G the static gain. References fall with their
/// frequency, so relative errors at low ones count more; the last term bounds what noise of the reference becomes.
///
/// Relative errors of the position for sines at T = 1e-4 s, with the defaults ([`error`](Self::error) tells them for
/// any other case), and the sum of |c_j|:
///
/// | dynamics | ahead | window, degree | 1 Hz | 20 Hz | 100 Hz | sum of abs c_j |
/// |---|---|---|---|---|---|---|
/// | 400 Hz, damping 0.95 | 2 | 4, 3 | 6e-13 | 1e-7 | 6e-5 | 35 |
/// | | 4 | 8, 5 | 1e-15 | 2e-11 | 2e-7 | 29 |
/// | | 8 | 16, 5 | 1e-15 | 2e-11 | 3e-7 | 14 |
/// | 2 kHz, damping 0.03, behind a lag of 279 Hz | 2 | 4, 3 | 3e-14 | 5e-9 | 3e-6 | 14 |
/// | | 4 | 8, 5 | 1e-15 | 5e-14 | 1e-9 | 10 |
/// | | 8 | 16, 5 | 1e-15 | 1e-12 | 2e-8 | 7 |
/// | 800 Hz, damping 0.02 | 2 | 4, 3 | 2e-13 | 2e-8 | 2e-5 | 7 |
/// | | 4 | 8, 5 | 1e-15 | 2e-12 | 4e-8 | 8 |
/// | | 8 | 16, 5 | 1e-15 | 5e-13 | 8e-9 | 9 |
///
/// The window must be as long as the inverse remembers, some time constants 1 / (2 pi f zeta) of the zeros of the
/// dynamics. Resonances have none, so a few samples do: 16 follow everything up to 1.2 kHz through a mode of 800 Hz and
/// damping 0.02 within 0.3 %. Through an antiresonance of 600 Hz and damping 0.05 it takes 400 samples for 3 %; a
/// shorter window follows references far below it, best with a `band` that ends there. An `ahead` below the dead time
/// extrapolates, which makes noise and errors larger.
///
/// ```
/// use hysteresis_control::feedforward::{PreviewCoefficients, PreviewOptions};
/// use hysteresis_control::linear::SecondOrder;
/// let stage = SecondOrder::new(400.0, 0.95)?.into();
/// let preview = PreviewCoefficients::new(&stage, 1e-4, &PreviewOptions::new(4))?;
/// assert_eq!(preview.coefficients().len(), 8);
/// assert!((preview.coefficients().iter().sum::<f64>() - 1.0).abs() < 1e-12);
/// assert!(preview.error(20.0) < 1e-10 && preview.error(100.0) < 1e-6);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewCoefficients {
    coefficients: Vec<f64>,
    ahead: usize,
    dynamics: LinearDynamics,
    transfer: PulseTransfer,
    dt: f64,
}

impl PreviewCoefficients {
    /// The coefficients for a sampling interval T in seconds.
    ///
    /// # Errors
    /// [`Error`] unless the window has 1 to 1000 references and reaches from `ahead` to the present at least, the
    /// degree is less than the window and at most 12, and the band is above 0 and at most 1 / (2 T); or as for
    /// [`LinearDynamics::block`].
    pub fn new(dynamics: &LinearDynamics, dt: f64, options: &PreviewOptions) -> Result<Self, Error> {
        check_positive("dt", None, dt)?;
        let sampled = dynamics.sampled(dt)?;
        let PreviewOptions { ahead, window, degree, band } = *options;
        check_whole("ahead", ahead <= MAX_WINDOW, "at most 1000 samples", ahead)?;
        let passed = sampled.dead_time.whole + usize::from(sampled.dead_time.share >= 0.5);
        let window = window.unwrap_or_else(|| (2 * ahead.saturating_sub(passed)).max(ahead + 1).max(4));
        check_whole("window", (1..=MAX_WINDOW).contains(&window), "1 to 1000 samples", window)?;
        check_whole("window", window > ahead, "more references than lie ahead", window)?;
        let degree = degree.unwrap_or(DEGREE.min(window - 1));
        if degree >= window || degree > MAX_DEGREE {
            return Err(Error::whole(
                "degree",
                None,
                "less than the number of references in the window, at most 12",
                degree,
            ));
        }
        let cycles = band.map_or(BAND, |band| band * dt);
        if !(1e-9..=0.5).contains(&cycles) {
            let (expected, got) = ("a frequency above 0 and at most half the sampling rate", band.unwrap_or(f64::NAN));
            return Err(Error::domain("band", None, expected, got));
        }
        let transfer = dynamics.record_transfer(dt)?;
        let exact = Exact::new(&sampled, ahead, window, degree);
        let fit = Fit::new(&transfer, ahead, window, &frequencies(dynamics, dt, cycles, window));
        let coefficients = fit.constrained(&exact).filter(|c| c.iter().all(|c| c.is_finite()));
        let Some(coefficients) = coefficients else {
            let expected = "a sampling interval at which the inverse dynamics have finite coefficients";
            return Err(Error::domain("dt", None, expected, dt));
        };
        Ok(Self { coefficients: coefficients.as_slice().to_vec(), ahead, dynamics: dynamics.clone(), transfer, dt })
    }

    /// Coefficients that were made before, with what they invert: as [`new`](Self::new) made them.
    ///
    /// # Errors
    /// [`Error`] as for [`LinearDynamics::block`].
    pub fn restored(dynamics: &LinearDynamics, dt: f64, coefficients: &[f64], ahead: usize) -> Result<Self, Error> {
        let transfer = dynamics.record_transfer(dt)?;
        Ok(Self { coefficients: coefficients.to_vec(), ahead, dynamics: dynamics.clone(), transfer, dt })
    }

    /// c_j, the newest reference's first.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// The dynamics whose inverse they are.
    #[must_use]
    pub fn dynamics(&self) -> &LinearDynamics {
        &self.dynamics
    }

    /// The sampling interval T in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// How many samples ahead the newest reference is.
    #[must_use]
    pub fn ahead(&self) -> usize {
        self.ahead
    }

    /// The error of the position for a sine of this frequency in Hz, relative to the sine: |C P - 1|.
    #[must_use]
    pub fn error(&self, frequency: f64) -> f64 {
        let cycles = frequency * self.dt;
        let place = places(self.ahead, self.coefficients.len());
        let window = self.coefficients.iter().zip(place).map(|(c, x)| Complex::cis(TAU * cycles * x) * *c);
        (window.sum::<Complex<f64>>() * self.transfer.at_cycles(cycles) - 1.0).norm()
    }
}

/// The samples at which the references of a window lie, counted from the present.
#[expect(clippy::cast_precision_loss, reason = "windows are short")]
fn places(ahead: usize, window: usize) -> impl Iterator<Item = f64> {
    (0..window).map(move |j| ahead as f64 - j as f64)
}

/// What makes polynomials exact: rows c = wanted, in powers of (x - centre) / half.
struct Exact {
    rows: DMatrix<f64>,
    wanted: DVector<f64>,
}

impl Exact {
    fn new(sampled: &Discrete, ahead: usize, window: usize, degree: usize) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "windows are short")]
        let (half, ahead_of) = (0.5 * (window.max(2) - 1) as f64, ahead as f64);
        let centre = ahead_of - half;
        #[expect(clippy::cast_precision_loss, reason = "a dead time of at most 2^20 samples")]
        let series = inverse_series(sampled, degree, sampled.dead_time.whole as f64 - centre);
        let place: Vec<f64> = places(ahead, window).map(|x| (x - centre) / half).collect();
        let power = |x: f64, m: usize| (0..m).fold(1.0, |power, _| power * x);
        // sum_j c_j exp(s x_j) is the series: of s^m / m! it has sum_j c_j x_j^m.
        #[expect(clippy::cast_precision_loss, reason = "degrees are small")]
        let factorial = |m: usize| (1..=m).fold(1.0, |product, i| product * i as f64 / half);
        Self {
            rows: DMatrix::from_fn(degree + 1, window, |m, j| power(place[j], m)),
            wanted: DVector::from_fn(degree + 1, |m, _| series[m] * factorial(m)),
        }
    }
}

/// A frequency in cycles per sample, and how much its squared error counts.
type Weighted = (f64, f64);

/// The frequencies of a fit: evenly over the band, four for each that a window of this length tells apart, and the
/// resonances, which may lie between.
fn frequencies(dynamics: &LinearDynamics, dt: f64, band: f64, window: usize) -> Vec<Weighted> {
    let count = 256 + 4 * window;
    #[expect(clippy::cast_precision_loss, reason = "some thousand")]
    let even = (0..count).map(|i| band * (i as f64 + 0.5) / count as f64);
    let poles = dynamics.poles();
    let near = poles
        .iter()
        .flat_map(|pole| [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0].map(|widths| (pole.im - widths * pole.re) * dt / TAU));
    #[expect(clippy::cast_precision_loss, reason = "some thousand")]
    let share = 1.0 / count as f64;
    let weighted = |cycles: f64| (cycles, share * (band / cycles).min(MAX_WEIGHT).powi(2));
    even.chain(near.filter(|cycles| *cycles > 0.0 && *cycles < band)).map(weighted).collect()
}

/// The normal equations of the least squares: matrix c = wanted.
struct Fit {
    matrix: DMatrix<f64>,
    wanted: DVector<f64>,
}

impl Fit {
    fn new(transfer: &PulseTransfer, ahead: usize, window: usize, frequencies: &[Weighted]) -> Self {
        // Of the product of two references only their distance matters: the matrix is constant along its diagonals.
        let mut diagonals = vec![0.0; window];
        let mut wanted = DVector::zeros(window);
        for (cycles, weight) in frequencies {
            let answer = transfer.at_cycles(*cycles);
            let turn = Complex::cis(TAU * cycles);
            let mut power = Complex::from(answer.norm_sqr() * weight);
            for diagonal in &mut diagonals {
                *diagonal += power.re;
                power *= turn;
            }
            for (wanted, x) in wanted.iter_mut().zip(places(ahead, window)) {
                *wanted += (answer * Complex::cis(TAU * cycles * x)).re * weight;
            }
        }
        diagonals[0] += NOISE * transfer.static_gain().powi(2);
        Self { matrix: DMatrix::from_fn(window, window, |i, j| diagonals[i.abs_diff(j)]), wanted }
    }

    /// The best coefficients of those that are exact; nothing if rounding leaves none.
    fn constrained(self, exact: &Exact) -> Option<DVector<f64>> {
        let Exact { rows, wanted } = exact;
        let factor = self.matrix.cholesky()?;
        let free = factor.solve(&self.wanted);
        let reach = factor.solve(&rows.transpose());
        let multipliers = (rows * &reach).lu().solve(&(wanted - rows * &free))?;
        let mut coefficients = free + reach * multipliers;
        // What rounding has left of the constraints goes the shortest way.
        let shortest = rows.transpose().qr();
        for _ in 0..2 {
            let missing = wanted - rows * &coefficients;
            let inner = shortest.r().tr_solve_upper_triangular(&missing)?;
            coefficients += shortest.q() * inner;
        }
        Some(coefficients)
    }
}

/// The first coefficients, q(0) to q(degree), of exp(s lead) / P(exp(s)) = sum_m q(m) s^m, with s in radians per sample
/// and P of the rows of a record without the whole samples of dead time.
///
/// P(z) = G/z + c (z - Phi)^-1 g (1/z - 1) + d (1-f) (1 - 1/z), see [`Discrete`]. A record of samples of a polynomial
/// is answered by one: these numbers say by which.
fn inverse_series(sampled: &Discrete, degree: usize, lead: f64) -> Vec<f64> {
    let later = exponential(-1.0, degree);
    let through = sampled.d * (1.0 - sampled.dead_time.share);
    let states = state_series(sampled, &later, degree);
    let transfer: Vec<f64> = (0..=degree)
        .map(|m| {
            let change = later[m] - if m == 0 { 1.0 } else { 0.0 };
            sampled.gain * later[m] + sampled.c.dot(&states[m]) - through * change
        })
        .collect();
    // The quotient of two series.
    let mut quotient = exponential(lead, degree);
    for m in 0..=degree {
        let known: f64 = (1..=m).map(|i| transfer[i] * quotient[m - i]).sum();
        quotient[m] = (quotient[m] - known) / transfer[0];
    }
    quotient
}

/// x of (exp(s) - Phi) x = g (exp(-s) - 1).
fn state_series(sampled: &Discrete, later: &[f64], degree: usize) -> Vec<DVector<f64>> {
    let n = sampled.g.len();
    if n == 0 {
        return vec![DVector::zeros(0); degree + 1];
    }
    let rest = (DMatrix::identity(n, n) - &sampled.phi).lu();
    let sooner = exponential(1.0, degree);
    let mut states: Vec<DVector<f64>> = vec![DVector::zeros(n)];
    for m in 1..=degree {
        let before: DVector<f64> = (1..=m).map(|i| &states[m - i] * sooner[i]).sum();
        let driven = &sampled.g * later[m] - before;
        states.push(rest.solve(&driven).unwrap_or_else(|| DVector::from_element(n, f64::NAN)));
    }
    states
}

/// x^m / m!
fn exponential(x: f64, degree: usize) -> Vec<f64> {
    let mut series = vec![1.0];
    for m in 1..=degree {
        #[expect(clippy::cast_precision_loss, reason = "degrees are small")]
        series.push(series[m - 1] * x / m as f64);
    }
    series
}

/// The longest kernel, in samples.
const MOST_SAMPLES: f64 = 1000.0;

/// Weights that smooth a reference over so many seconds: three means of a third of it, one behind the other.
///
/// A mean over one period of a resonance passes nothing of its frequency, and three of them little of what is near: for
/// one 5 % off, 1.3e-4 of it. So a step of a reference becomes a motion within `seconds` that leaves three periods long
/// resonances at rest. The number of weights is odd, they sum to 1, and they have no phase.
///
/// ```
/// use hysteresis_control::feedforward::smoothing_kernel;
/// let kernel = smoothing_kernel(3.7e-3, 1e-4)?; // three periods of a resonance of 800 Hz
/// assert_eq!(kernel.len(), 35);
/// let at = |frequency: f64| -> f64 {
///     let wave = |(i, s): (usize, &f64)| s * (core::f64::consts::TAU * frequency * 1e-4 * (i as f64 - 17.0)).cos();
///     kernel.iter().enumerate().map(wave).sum()
/// };
/// assert!((at(0.0) - 1.0).abs() < 1e-12 && at(800.0).abs() < 1e-4 && at(840.0).abs() < 1e-3);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for numbers that are not above 0, or more than 1000 samples.
pub fn smoothing_kernel(seconds: f64, dt: f64) -> Result<Vec<f64>, Error> {
    check_positive("dt", None, dt)?;
    let third = check_positive("smoothing", None, seconds)? / (3.0 * dt);
    check_number("smoothing", 3.0 * third <= MOST_SAMPLES, "at most 1000 samples", seconds)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 334, and not negative")]
    let (nearest, half) = (third.round().max(1.0) as usize, (0.5 * third) as usize);
    let kernel = mean(&mean(&[1.0], nearest), nearest);
    // With an odd third mean the whole is odd.
    Ok(mean(&kernel, 2 * half + 1))
}

/// The running mean over so many samples.
fn mean(kernel: &[f64], samples: usize) -> Vec<f64> {
    let mut next = vec![0.0; kernel.len() + samples - 1];
    for (i, weight) in kernel.iter().enumerate() {
        for sum in &mut next[i..i + samples] {
            *sum += weight;
        }
    }
    let all: f64 = next.iter().sum();
    for weight in &mut next {
        *weight /= all;
    }
    next
}
