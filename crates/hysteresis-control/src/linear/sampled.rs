//! Dynamics behind a hold: exactly discretised, run sample by sample, and over frequency; and a dead time alone.

use core::f64::consts::TAU;

use hysteresis_core::{check_all_finite, unless_faded};
use nalgebra::{Complex, DMatrix, DVector};

use super::state_space::{resolvent, rest};
use super::{Block, Error, StateSpace};
use crate::checks::{check_dead_time, check_number, check_positive, check_whole};

/// The most time constants that a sampling interval may last.
const MAX_STIFFNESS: f64 = 1e6;

/// x' = A x + b u, y = c x + d u behind a dead time of (n + f) T, for an input that is held over T.
///
/// What acts over the interval from t_k on is first u(k-n-1), for f T, then u(k-n). The state is the distance from
/// where u(k-n-1) would let it rest, e(k) = x(k) - r u(k-n-1), r = -A^-1 b. With Phi = exp(A T), g = exp(A (1-f) T) r
/// and the static gain G
///
/// e(k+1) = Phi e(k) + g (u(k-n-1) - u(k-n)),
/// y(k) = G u(k-n-1) + c e(k) + d (1-f) (u(k-n) - u(k-n-1)).
///
/// So at rest e = 0 and nothing moves, not even a rounding. Of what passes at once (d) a dead time that is no whole
/// number of samples lets through the mean of its neighbours, as a [`Delay`](super::Delay) does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Discrete {
    pub(crate) phi: DMatrix<f64>,
    pub(crate) g: DVector<f64>,
    pub(crate) c: DVector<f64>,
    pub(crate) d: f64,
    pub(crate) gain: f64,
    pub(crate) dead_time: Split,
}

impl Discrete {
    pub(crate) fn new(dynamics: &StateSpace, dead_time: f64, dt: f64) -> Result<Self, Error> {
        let dead_time = Split::new(dead_time, dt)?;
        let StateSpace { a, b, c, d, gain, .. } = dynamics;
        let (c, d, gain) = (c.clone(), *d, *gain);
        if a.is_empty() {
            return Ok(Self { phi: a.clone(), g: b.clone(), c, d, gain, dead_time });
        }
        // One state alone is a decay, whatever its rate.
        if a.nrows() > 1 && a.amax() * dt > MAX_STIFFNESS {
            let expected = "at most 1e6 time constants of the fastest part of the dynamics";
            return Err(Error::domain("dt", None, expected, dt));
        }
        let phi = (a * dt).exp();
        let rest = rest(a, b);
        let g = if dead_time.share == 0.0 { &phi * rest } else { (a * (dt * (1.0 - dead_time.share))).exp() * rest };
        let expected = "a sampling interval at which the dynamics can be discretised";
        check_number("dt", phi.iter().chain(&g).all(|entry| entry.is_finite()), expected, dt)?;
        Ok(Self { phi, g, c, d, gain, dead_time })
    }
}

/// [`LinearDynamics`](super::LinearDynamics) with their state, sampled: made by
/// [`LinearDynamics::block`](super::LinearDynamics::block).
///
/// ```
/// use hysteresis_control::linear::{Block, SecondOrder};
/// let mut stage = SecondOrder::new(800.0, 0.02)?.block(1e-4)?;
/// stage.settle(2.0);
/// assert!((0..100).all(|_| stage.step(2.0) == 2.0));
/// let saved = stage.state();
/// let next = (stage.step(3.0), stage.step(3.0));
/// stage.restore(&saved)?;
/// assert_eq!((stage.step(3.0), stage.step(3.0)), next);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LinearBlock {
    /// Phi, column by column.
    phi: Box<[f64]>,
    g: Box<[f64]>,
    c: Box<[f64]>,
    /// c Phi, and c g.
    c_phi: Box<[f64]>,
    c_g: f64,
    gain: f64,
    /// d (1 - f) and d f.
    direct: [f64; 2],
    deviation: Box<[f64]>,
    /// Where the next deviation is put together.
    next: Box<[f64]>,
    past: History,
}

/// What a [`LinearBlock`] remembers.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinearState {
    /// How far the dynamics are from rest, one number for each pole.
    pub deviation: Vec<f64>,
    /// The last inputs, the oldest first: as many as the dead time has whole samples, and one more.
    pub past: Vec<f64>,
}

impl LinearBlock {
    pub(crate) fn new(discrete: Discrete) -> Self {
        let Discrete { phi, g, c, d, gain, dead_time } = discrete;
        let zeros = || vec![0.0; g.len()].into();
        Self {
            c_phi: (c.transpose() * &phi).as_slice().into(),
            c_g: c.dot(&g),
            gain,
            direct: [d * (1.0 - dead_time.share), d * dead_time.share],
            deviation: zeros(),
            next: zeros(),
            past: History::new(dead_time.whole),
            phi: phi.as_slice().into(),
            g: g.as_slice().into(),
            c: c.as_slice().into(),
        }
    }

    /// What there is to save.
    #[must_use]
    pub fn state(&self) -> LinearState {
        LinearState { deviation: self.deviation.to_vec(), past: self.past.inputs().collect() }
    }

    /// Goes on from a state of the same dynamics at the same sampling interval.
    ///
    /// # Errors
    /// [`Error`] if it has not as many numbers, or one is not finite; then nothing changes.
    pub fn restore(&mut self, state: &LinearState) -> Result<(), Error> {
        let LinearState { deviation, past } = state;
        for (parameter, got, expected) in
            [("deviation", deviation.len(), self.deviation.len()), ("past", past.len(), self.past.len())]
        {
            check_whole(parameter, got == expected, "as many numbers as these dynamics have", got)?;
        }
        check_all_finite("deviation", deviation)?;
        check_all_finite("past", past)?;
        self.deviation.copy_from_slice(deviation);
        self.past.restore(past);
        Ok(())
    }

    /// How many inputs it remembers: the whole samples of the dead time, and one more.
    pub(crate) fn samples(&self) -> usize {
        self.past.len()
    }
}

impl PartialEq for LinearBlock {
    /// The same dynamics in the same state, wherever in its ring that lies.
    fn eq(&self, other: &Self) -> bool {
        let parameters = |block: &Self| (block.gain, block.direct);
        let same = parameters(self) == parameters(other) && self.phi == other.phi && self.g == other.g;
        same && self.c == other.c && self.state() == other.state()
    }
}

/// The sum of the products.
#[inline]
pub(crate) fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(x, y)| x * y).sum()
}

impl Block for LinearBlock {
    #[inline]
    fn output(&self, input: f64) -> f64 {
        let (younger, older) = self.past.pair(input);
        self.gain * older + dot(&self.c, &self.deviation) + self.direct[0] * (younger - older)
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        let (younger, older) = self.past.pair(input);
        let change = older - younger;
        self.gain * younger + (dot(&self.c_phi, &self.deviation) + (self.c_g + self.direct[1]) * change)
    }

    #[inline]
    fn hold(&mut self, input: f64) {
        let (younger, older) = self.past.pair(input);
        let change = older - younger;
        for (next, g) in self.next.iter_mut().zip(&self.g) {
            *next = g * change;
        }
        // A chunk is a column of Phi; without states there is none.
        for (column, e) in self.phi.chunks_exact(self.g.len().max(1)).zip(&self.deviation) {
            for (next, phi) in self.next.iter_mut().zip(column) {
                *next += phi * e;
            }
        }
        core::mem::swap(&mut self.deviation, &mut self.next);
        if change == 0.0 {
            self.deviation.iter_mut().for_each(|e| *e = unless_faded(*e));
        }
        self.past.push(input);
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.deviation.fill(0.0);
        self.past.fill(level);
        self.gain * level
    }
}

/// From an input that is held from sample to sample to what is read at the samples. Made by
/// [`LinearDynamics::pulse_transfer`](super::LinearDynamics::pulse_transfer) and
/// [`record_transfer`](super::LinearDynamics::record_transfer).
#[derive(Clone, Debug, PartialEq)]
pub struct PulseTransfer {
    phi: DMatrix<Complex<f64>>,
    g: DVector<Complex<f64>>,
    c: DVector<f64>,
    gain: f64,
    /// What multiplies 1, 1/z, 1/z^2 of the direct feed-through.
    direct: [f64; 3],
    whole: usize,
}

impl PulseTransfer {
    /// What is read just before the next input is put out, one sample after the input.
    pub(super) fn before(discrete: &Discrete) -> Self {
        let through = discrete.d * discrete.dead_time.share;
        Self::new(discrete, [0.0, -through, through])
    }

    /// What is read with the input put out.
    pub(super) fn of_record(discrete: &Discrete) -> Self {
        let through = discrete.d * (1.0 - discrete.dead_time.share);
        Self::new(discrete, [through, -through, 0.0])
    }

    fn new(discrete: &Discrete, direct: [f64; 3]) -> Self {
        Self {
            phi: discrete.phi.map(Complex::from),
            g: discrete.g.map(Complex::from),
            c: discrete.c.clone(),
            gain: discrete.gain,
            direct,
            whole: discrete.dead_time.whole,
        }
    }

    /// P(z), for z that is no pole; there it is not a number.
    #[must_use]
    pub fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let back = z.inv();
        let seen = resolvent(&self.phi, &self.g, &self.c, z);
        let direct = (back * self.direct[2] + self.direct[1]) * back + self.direct[0];
        #[expect(clippy::cast_precision_loss, reason = "at most 2^20")]
        let dead_time = z.powf(-(self.whole as f64));
        (back * self.gain + seen * (back - 1.0) + direct) * dead_time
    }

    /// P(1).
    pub(crate) fn static_gain(&self) -> f64 {
        self.gain
    }

    /// P(exp(2 pi i F T)), with F T the frequency in cycles per sample.
    #[must_use]
    pub fn at_cycles(&self, cycles_per_sample: f64) -> Complex<f64> {
        self.at(Complex::cis(TAU * cycles_per_sample))
    }
}

/// A dead time d in seconds: y(t) = u(t - d).
///
/// Sampled every T seconds it is d = (n + f) T with 0 <= f < 1, and between samples the input is taken as straight:
/// y(k) = (1 - f) u(k - n) + f u(k - n - 1). A whole number of samples is exact; half a sample passes cos(pi F T) of a
/// sine of the frequency F, 0.98 at 600 Hz and 10 kHz. [`LinearDynamics`](super::LinearDynamics) behind a dead time
/// need no such line: how they answer to an input that is held is known exactly at any time.
///
/// ```
/// use hysteresis_control::linear::{Block, Delay};
/// let mut delay = Delay::new(1.25e-4)?.block(1e-4)?;
/// assert_eq!([4.0, 8.0, 8.0].map(|u| delay.step(u)), [0.0, 3.0, 7.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    seconds: f64,
}

impl Delay {
    /// A dead time in seconds.
    ///
    /// # Errors
    /// [`Error`] unless it is finite and 0 or more.
    pub fn new(seconds: f64) -> Result<Self, Error> {
        Ok(Self { seconds: check_dead_time(seconds)? })
    }

    /// No dead time.
    #[must_use]
    pub const fn none() -> Self {
        Self { seconds: 0.0 }
    }

    /// d, in seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The block for a sampling interval in seconds, at rest at zero; all its memory is taken here.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0 and the dead time at most 2^20 of it.
    pub fn block(&self, dt: f64) -> Result<DelayBlock, Error> {
        let Split { whole, share } = Split::new(self.seconds, check_positive("dt", None, dt)?)?;
        Ok(DelayBlock { past: History::new(whole), share })
    }
}

/// The block of a [`Delay`].
#[derive(Clone, Debug, PartialEq)]
pub struct DelayBlock {
    past: History,
    share: f64,
}

impl Block for DelayBlock {
    #[inline]
    fn output(&self, input: f64) -> f64 {
        let (younger, older) = self.past.pair(input);
        if self.share == 0.0 { younger } else { younger + self.share * (older - younger) }
    }

    /// A straight line does not jump at a sample: just before the next one it is where [`output`](Self::output) is.
    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.output(input)
    }

    #[inline]
    fn hold(&mut self, input: f64) {
        self.past.push(input);
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.past.fill(level);
        level
    }
}

/// The longest dead time, in samples: 8 MiB of numbers.
const MAX_SAMPLES: f64 = 1_048_576.0;

/// How far from a whole number of samples a dead time counts as whole: seconds over seconds round.
const WHOLE: f64 = 1e-9;

/// A dead time in samples: d = (n + f) T, 0 <= f < 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Split {
    pub(crate) whole: usize,
    pub(crate) share: f64,
}

impl Split {
    /// Of a dead time that is not negative; both in seconds.
    pub(crate) fn new(dead_time: f64, dt: f64) -> Result<Self, Error> {
        let samples = dead_time / dt;
        let holds = (0.0..=MAX_SAMPLES).contains(&samples);
        check_number("dead_time", holds, "at most 2^20 sampling intervals", dead_time)?;
        let nearest = samples.round();
        let samples = if (samples - nearest).abs() <= WHOLE * nearest.max(1.0) { nearest } else { samples };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked above")]
        Ok(Self { whole: samples.floor() as usize, share: samples.fract() })
    }
}

/// The last n + 1 inputs, a ring: what was put out but has not come to act.
#[derive(Clone, Debug, PartialEq)]
struct History {
    past: Box<[f64]>,
    oldest: usize,
}

impl History {
    /// All inputs were zero.
    pub(crate) fn new(whole: usize) -> Self {
        Self { past: vec![0.0; whole + 1].into(), oldest: 0 }
    }

    /// u(k - n) and u(k - n - 1), with `input` as u(k).
    #[inline]
    fn pair(&self, input: f64) -> (f64, f64) {
        let older = self.past.get(self.oldest).copied().unwrap_or(input);
        // With one place in the ring, the input itself is the younger neighbour.
        let after = self.past.get(self.after_oldest()).filter(|_| self.past.len() > 1);
        (after.copied().unwrap_or(input), older)
    }

    /// Takes u(k).
    #[inline]
    pub(crate) fn push(&mut self, input: f64) {
        if let Some(oldest) = self.past.get_mut(self.oldest) {
            *oldest = input;
        }
        self.oldest = self.after_oldest();
    }

    #[inline]
    fn after_oldest(&self) -> usize {
        if self.oldest + 1 < self.past.len() { self.oldest + 1 } else { 0 }
    }

    /// All inputs were `level`.
    fn fill(&mut self, level: f64) {
        self.past.fill(level);
        self.oldest = 0;
    }

    /// How many inputs are remembered.
    pub(crate) fn len(&self) -> usize {
        self.past.len()
    }

    /// The inputs, the oldest first.
    fn inputs(&self) -> impl Iterator<Item = f64> + '_ {
        self.past[self.oldest..].iter().chain(&self.past[..self.oldest]).copied()
    }

    /// Goes on from as many inputs, the oldest first.
    pub(crate) fn restore(&mut self, inputs: &[f64]) {
        self.past.copy_from_slice(inputs);
        self.oldest = 0;
    }
}
