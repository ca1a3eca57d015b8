//! The whole linear part of an actuator.

use core::f64::consts::TAU;

use nalgebra::{Complex, Matrix3, Vector3};

use super::error::check_positive;
use super::{Block, Delay, DelayBlock, Dynamics, Error, FirstOrder};

/// The most time constants that a sampling interval may last where the general matrix exponential is needed.
const MAX_STIFFNESS: f64 = 1e6;

/// Delay, amplifier pole and dynamics in series, of unit static gain, discretised as one.
///
/// Unlike a [`Cascade`](super::Cascade) of blocks, which holds the output of each from sample to sample, only the input
/// is held here: what the amplifier does between samples reaches the dynamics as it is. A missing part passes its input
/// on at once.
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_control::linear::{Chain, Delay, FirstOrder, SecondOrder, Stream};
/// let chain = Chain {
///     amplifier: Some(FirstOrder::new(279.0)?),
///     dynamics: Some(SecondOrder::new(2000.0, 0.03)?.into()),
///     delay: Delay::new(1.0)?,
/// };
/// let mut stage = Stream::new(chain.block(1e-4)?, 0.0);
/// let position: Vec<f64> = (0..4).map(|_| stage.step(1.0)).collect();
/// assert_eq!(position[0], 0.0);
/// assert!((position[1] - 0.041).abs() < 1e-3 && position[1] < position[2]);
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// The pole of the amplifier, if it matters.
    pub amplifier: Option<FirstOrder>,
    /// The dynamics of the stage, if they matter.
    pub dynamics: Option<Dynamics>,
    /// Dead time besides the hold.
    pub delay: Delay,
}

impl Chain {
    /// The block for a sampling interval T in seconds, at rest at zero.
    ///
    /// The state is the distance from rest, e = (y - u, y' / w, v - u), v the output of the amplifier. While u is held,
    /// e(k+1) = exp(T A) e(k).
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0, and with an amplifier before dynamics at most 1e6 time constants.
    pub fn block(&self, dt: f64) -> Result<ChainBlock, Error> {
        let transition = self.transition(check_positive("dt", None, dt)?)?;
        Ok(ChainBlock { delay: self.delay.block(), transition, state: Vector3::zeros() })
    }

    /// The pulse transfer function P(z) for a sampling interval T in seconds: from an input that is held from t_k on
    /// to the position at t_k.
    ///
    /// An input put out at t_k moves the position that is read at t_(k+1), so without any dynamics P = 1/z.
    ///
    /// ```
    /// use hysteresis_control::linear::{Chain, Delay, FirstOrder};
    /// use nalgebra::Complex;
    /// let lag = FirstOrder::new(100.0)?;
    /// let chain = Chain { amplifier: None, dynamics: Some(lag.into()), delay: Delay::new(0.0)? };
    /// let (z, a) = (Complex::new(0.6, 0.8), (-1e-4 / lag.time_constant()).exp());
    /// let textbook = Complex::from(1.0 - a) / (z - a);
    /// assert!((chain.pulse_transfer(1e-4)?.at(z) - textbook).norm() < 1e-15);
    /// # Ok::<(), hysteresis_control::linear::Error>(())
    /// ```
    ///
    /// # Errors
    /// As for [`block`](Self::block).
    pub fn pulse_transfer(&self, dt: f64) -> Result<PulseTransfer, Error> {
        let transition = self.transition(check_positive("dt", None, dt)?)?;
        let gains = rest(1.0) - transition * rest(1.0);
        Ok(PulseTransfer {
            transition: transition.map(Complex::from),
            gains: gains.map(Complex::from),
            delay: self.delay.samples(),
        })
    }

    /// After how many seconds nothing is left of a state but exp(-1), the delay not counted: 1 / the slowest decay.
    #[must_use]
    pub fn settling_time(&self) -> f64 {
        let dynamics = self.dynamics.map_or(0.0, |dynamics| match dynamics {
            Dynamics::FirstOrder(lag) => lag.time_constant(),
            Dynamics::SecondOrder(resonance) => {
                let (w, zeta) = (TAU * resonance.frequency(), resonance.damping());
                if zeta < 1.0 { 1.0 / (zeta * w) } else { (zeta + (zeta * zeta - 1.0).sqrt()) / w }
            }
        });
        dynamics.max(self.amplifier.map_or(0.0, |amplifier| amplifier.time_constant()))
    }

    /// exp(T A); what there is not has no state.
    fn transition(&self, dt: f64) -> Result<Matrix3<f64>, Error> {
        let mut transition = Matrix3::zeros();
        match (self.dynamics, self.amplifier) {
            (None, None) => {}
            (Some(Dynamics::FirstOrder(lag)), None) | (None, Some(lag)) => transition.m11 = (-dt * rate(lag)).exp(),
            (Some(Dynamics::SecondOrder(resonance)), None) => {
                transition.fixed_view_mut::<2, 2>(0, 0).copy_from(&resonance.transition(dt)?);
            }
            (Some(dynamics), Some(amplifier)) => transition = exponential(dynamics, amplifier, dt)?,
        }
        Ok(transition)
    }
}

/// 1 / tau.
fn rate(lag: FirstOrder) -> f64 {
    TAU * lag.frequency()
}

/// The state at rest at a level.
fn rest(level: f64) -> Vector3<f64> {
    Vector3::new(level, 0.0, level)
}

/// exp(T A) of an amplifier before dynamics.
fn exponential(dynamics: Dynamics, amplifier: FirstOrder, dt: f64) -> Result<Matrix3<f64>, Error> {
    let a = rate(amplifier);
    let (system, has_velocity) = match dynamics {
        Dynamics::FirstOrder(lag) => {
            let b = rate(lag);
            (Matrix3::new(-b, 0.0, b, 0.0, 0.0, 0.0, 0.0, 0.0, -a), false)
        }
        Dynamics::SecondOrder(resonance) => {
            let (w, zeta) = (TAU * resonance.frequency(), resonance.damping());
            (Matrix3::new(0.0, w, 0.0, -w, -2.0 * zeta * w, w, 0.0, 0.0, -a), true)
        }
    };
    let exponent = system * dt;
    if exponent.amax().partial_cmp(&MAX_STIFFNESS).is_none_or(core::cmp::Ordering::is_gt) {
        let expected = "at most 1e6 time constants of amplifier and dynamics";
        return Err(Error { parameter: "dt", index: None, expected, got: dt });
    }
    let mut transition = exponent.exp();
    if !has_velocity {
        transition.m22 = 0.0;
    }
    Ok(transition)
}

/// The block of a [`Chain`].
#[derive(Clone, Debug, PartialEq)]
pub struct ChainBlock {
    delay: DelayBlock,
    transition: Matrix3<f64>,
    /// Position, velocity / w, output of the amplifier.
    state: Vector3<f64>,
}

impl ChainBlock {
    /// The state at the end of the interval.
    #[inline]
    fn next(&self, delayed: f64) -> Vector3<f64> {
        rest(delayed) + self.transition * (self.state - rest(delayed))
    }
}

impl Block for ChainBlock {
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        let delayed = self.delay.advance(input);
        self.state = self.next(delayed);
        self.state.x
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.next(self.delay.look_ahead(input)).x
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.state = rest(self.delay.settle(level));
        level
    }
}

/// How a [`Chain`] answers at the sampling instants: made by [`Chain::pulse_transfer`].
#[derive(Clone, Debug, PartialEq)]
pub struct PulseTransfer {
    transition: Matrix3<Complex<f64>>,
    gains: Vector3<Complex<f64>>,
    delay: f64,
}

impl PulseTransfer {
    /// P(z), for z that is no pole; there it is not a number.
    #[must_use]
    pub fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let state = (Matrix3::from_diagonal_element(z) - self.transition).lu().solve(&self.gains);
        let share = self.delay.fract();
        let between = if share == 0.0 { Complex::from(1.0) } else { (1.0 - share) + share / z };
        state.map_or(Complex::from(f64::NAN), |state| state.x * between * z.powf(-self.delay.floor()))
    }

    /// P(exp(2 pi i F T)), with F T the frequency in cycles per sample.
    #[must_use]
    pub fn at_cycles(&self, cycles_per_sample: f64) -> Complex<f64> {
        self.at(Complex::cis(TAU * cycles_per_sample))
    }
}
