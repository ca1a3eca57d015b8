//! The position behind a noisy measurement: a Kalman filter on the linear part of the actuator.

use hysteresis_core::{CompiledModel, Forward, Process, is_admissible};
use nalgebra::{Matrix3, Vector3};

use crate::linear::{Block, Delay, DelayBlock, Dynamics, Error, check_positive};

/// The covariance has settled when a step changes no entry by more than this share of the largest.
const SETTLED: f64 = 1e-13;

/// A filter slower than that many samples is not one for a control loop.
const MAX_STEPS: usize = 10_000_000;

/// How much to believe.
///
/// ```
/// use hysteresis_control::ObserverOptions;
/// let options = ObserverOptions { delay: 1.0, ..ObserverOptions::new(0.016, 0.5) };
/// assert_eq!(options.noise, 0.016);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverOptions {
    /// The root mean square of the measurement noise, in the unit of the displacement.
    pub noise: f64,
    /// How fast what the model does not know may wander, in displacement per square root of a second: the root mean
    /// square of its change over one second.
    pub drift: f64,
    /// What the measurement lags besides the dynamics, in samples.
    pub delay: f64,
}

impl ObserverOptions {
    /// Without delay.
    #[must_use]
    pub fn new(noise: f64, drift: f64) -> Self {
        Self { noise, drift, delay: 0.0 }
    }
}

/// A state observer: what the model of the actuator and a noisy measurement say together of the position.
///
/// The applied drive passes through the hysteresis model, w = H\[u\], delayed as the measurement is, and then moves the
/// state x = (p, p' / w_n, d): position, velocity, and d, what the model does not know (creep, drift, its own error) at
/// the input of the dynamics. Over a sampling interval T, with A = exp(T M) of the dynamics,
///
/// ```text
/// (p, p')  <-  (w + d, 0) + A ((p, p') - (w + d, 0)),   d <- d + noise of variance drift^2 T
/// x <- x + g (measurement - p)
/// ```
///
/// with the stationary Kalman gain g, from iterating the Riccati equation at construction. The filter has no lag for
/// what the model knows: noise goes down by the ratio of its bandwidth to that of the sampling, and only what the model
/// does not know is tracked as slowly as `drift` says. Where measurements are missing, the Riccati equation goes on
/// without them, and the gain is that for what it has come to: the stationary one would not be stable then.
///
/// [`step`](Self::step) does not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_core::{CompiledModel, ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::{Observer, ObserverOptions};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let compiled = CompiledModel::new(&model);
/// let dynamics = SecondOrder::new(400.0, 0.95)?.into();
/// let mut observer = Observer::new(&compiled, &dynamics, 1e-4, &ObserverOptions::new(0.016, 0.5))?;
/// let estimate = observer.step(0.0, 0.1); // a first sample that is mostly noise
/// assert!(estimate > 0.0 && estimate < 0.02);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Observer {
    hysteresis: Forward,
    delay: DelayBlock,
    transition: Matrix3<f64>,
    input: Vector3<f64>,
    /// That from one sample to the next of d, for unit measurement noise.
    growth: f64,
    gain: Vector3<f64>,
    /// Before the measurement, for unit measurement noise: the stationary one, and the present one where it differs.
    stationary: Matrix3<f64>,
    present: Option<Matrix3<f64>>,
    state: Vector3<f64>,
    rest: f64,
    rejected: u64,
}

impl Observer {
    /// An observer of an actuator at rest.
    ///
    /// # Errors
    /// [`Error`] for a number outside its domain, or noise and drift so far apart that the gain does not settle.
    pub fn new(
        compiled: &CompiledModel,
        dynamics: &Dynamics,
        dt: f64,
        options: &ObserverOptions,
    ) -> Result<Self, Error> {
        let noise = check_positive("noise", None, options.noise)?;
        let drift = check_positive("drift", None, options.drift)?;
        let a = dynamics.transition(dt)?;
        let input = Vector3::new(1.0 - a.m11, -a.m21, 0.0);
        let transition = Matrix3::new(a.m11, a.m12, input.x, a.m21, a.m22, input.y, 0.0, 0.0, 1.0);
        let hysteresis = Forward::new(compiled);
        let growth = drift * drift * dt / (noise * noise);
        let Some(stationary) = stationary_covariance(&transition, growth) else {
            let expected = "a drift for which the filter settles";
            return Err(Error { parameter: "drift", index: None, expected, got: drift });
        };
        let mut observer = Self {
            growth,
            gain: gain(&stationary),
            stationary,
            present: None,
            rest: hysteresis.output(),
            hysteresis,
            delay: Delay::new(options.delay * dt)?.block(dt)?,
            transition,
            input,
            state: Vector3::zeros(),
            rejected: 0,
        };
        observer.reset();
        Ok(observer)
    }

    /// Takes the drive that was held since the last sample, and the measurement of now; returns the position.
    ///
    /// Without a finite measurement the model goes on alone, without a finite drive it stays at the last one; either is
    /// counted.
    pub fn step(&mut self, drive: f64, measurement: f64) -> f64 {
        if !is_admissible(drive) || !is_admissible(measurement) {
            self.rejected = self.rejected.saturating_add(1);
        }
        let w = self.delay.advance(self.hysteresis.step(drive));
        self.state = self.transition * self.state + self.input * w;
        let measured = is_admissible(measurement);
        if measured {
            let gain = self.present.as_ref().map_or(self.gain, gain);
            self.state += gain * (measurement - self.state.x);
        }
        if self.present.is_some() || !measured {
            let present = self.present.unwrap_or(self.stationary);
            let next = advance(&self.transition, &present, self.growth, measured);
            self.present = (!same(&next, &self.stationary, SETTLED)).then_some(next);
        }
        self.state.x
    }

    /// What the model does not know, at the input of the dynamics, in the unit of the displacement.
    #[must_use]
    pub fn disturbance(&self) -> f64 {
        self.state.z
    }

    /// The velocity, in displacement per second divided by 2 pi f of the dynamics; 0 behind a first-order lag.
    #[must_use]
    pub fn scaled_velocity(&self) -> f64 {
        self.state.y
    }

    /// The stationary gain for position, scaled velocity and disturbance.
    #[must_use]
    pub fn gain(&self) -> [f64; 3] {
        self.gain.into()
    }

    /// How many drives or measurements were not finite.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.hysteresis.reset();
        self.delay.settle(self.rest);
        self.state = Vector3::new(self.rest, 0.0, 0.0);
        self.present = None;
        self.rejected = 0;
    }
}

/// The covariance that has settled, before the measurement, for unit measurement noise and a disturbance whose variance
/// grows by `growth` a sample; nothing if it does not settle.
fn stationary_covariance(transition: &Matrix3<f64>, growth: f64) -> Option<Matrix3<f64>> {
    if !is_admissible(growth) {
        return None;
    }
    let mut covariance = Matrix3::identity();
    for _ in 0..MAX_STEPS {
        let next = advance(transition, &covariance, growth, true);
        if same(&next, &covariance, SETTLED) {
            return Some(next);
        }
        covariance = next;
    }
    None
}

/// From one covariance P before the measurement to the next: P <- A (P - g c'P) A' + Q, without a measurement A P A' + Q.
#[inline]
fn advance(transition: &Matrix3<f64>, covariance: &Matrix3<f64>, growth: f64, measured: bool) -> Matrix3<f64> {
    let mut known = *covariance;
    if measured {
        known -= gain(covariance) * covariance.column(0).transpose();
    }
    let mut next = transition * known * transition.transpose();
    next.m33 += growth;
    // Rounding must not make it lean to one side.
    (next + next.transpose()) * 0.5
}

/// g = P c / (1 + c'P c).
#[inline]
fn gain(covariance: &Matrix3<f64>) -> Vector3<f64> {
    covariance.column(0) / (1.0 + covariance.m11)
}

/// Whether two covariances differ by no more than a share of the largest entry.
#[inline]
fn same(one: &Matrix3<f64>, other: &Matrix3<f64>, share: f64) -> bool {
    (one - other).abs().max() <= share * one.abs().max()
}
