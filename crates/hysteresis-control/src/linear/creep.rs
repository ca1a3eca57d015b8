//! Creep.

use hysteresis_core::{check_all_finite, unless_faded};

use super::{Block, Error};
use crate::checks::{check_number, check_positive, check_whole};

/// Euler's constant (0.5772...), to the precision of a double.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Log-type creep as a sum of first-order lags: y = x + sum_k c_k x_k, tau_k x_k' + x_k = x.
///
/// x is the position without creep, c_k the amplitude of the k-th term as a share of x, tau_k its time constant. After
/// a step of x the output reaches it at once and then creeps on to (1 + sum_k c_k) x. At the samples of a record, for
/// an x that is held, y(i) = x(i) + sum_k c_k q_k(i), q_k(i+1) = a_k q_k(i) + (1 - a_k) x(i), a_k = exp(-T / tau_k).
/// Linear and with fading memory, so unlike the logarithm itself it works for any signal, not for steps alone. Sums of
/// lags are the usual linear model of creep (Croft, Shed and Devasia, J. Dyn. Sys. Meas. Control 123(1), 35-43, 2001).
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_control::linear::{Creep, Stream};
/// let creep = Creep::new(&[0.01, 0.02], &[0.1, 1.0])?;
/// let mut stream = Stream::new(creep.block(1e-3)?, 0.0);
/// let last = (0..20_000).map(|_| stream.step(1.0)).last();
/// assert!((last.unwrap() - 1.03).abs() < 1e-9);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Creep {
    amplitudes: Box<[f64]>,
    time_constants: Box<[f64]>,
}

impl Creep {
    /// From the amplitudes c_k and time constants tau_k (s) of its terms.
    ///
    /// # Errors
    /// [`Error`] unless there is a time constant for every amplitude and at least one of each, amplitudes are finite,
    /// and time constants are finite, above 0 and strictly increase.
    pub fn new(amplitudes: &[f64], time_constants: &[f64]) -> Result<Self, Error> {
        let expected = "as many as there are amplitudes, and at least one";
        let holds = time_constants.len() == amplitudes.len() && !amplitudes.is_empty();
        check_whole("time_constants", holds, expected, time_constants.len())?;
        check_all_finite("amplitudes", amplitudes)?;
        check_time_constants(time_constants)?;
        Ok(Self { amplitudes: amplitudes.into(), time_constants: time_constants.into() })
    }

    /// The usual law of creep, y(t) = x (1 + gamma log10(t / t0)) after a step to x, from `start` t0 to `end` (s).
    ///
    /// The law holds for times after the step from some t0 on; gamma is the share by which the position grows per
    /// decade, 0.01 to 0.02 for stacks of PZT. Each of the n terms has the amplitude gamma log10 q, and their time
    /// constants are tau_k = t0 exp(0.5772) q^(k + 1/2), k = 0..n-1, q = (`end` / `start`)^(1/n). With those, the sum
    /// of 1 - exp(-t / tau_k) is log(t / t0) / log q between a few t0 and `end`, but for a ripple that two terms per
    /// decade keep below 1e-3 gamma. Before t0 there is less creep than the law's (which diverges there), after `end`
    /// it stops.
    ///
    /// ```
    /// use hysteresis_core::Process;
    /// use hysteresis_control::linear::{Creep, Stream};
    /// let creep = Creep::logarithmic(0.02, 0.01, 1000.0, 10)?;
    /// let mut stream = Stream::new(creep.block(0.01)?, 0.0);
    /// let position: Vec<f64> = (0..2000).map(|_| stream.step(1.0)).collect();
    /// let after = |seconds: usize| position[100 * seconds];
    /// assert!((after(10) - after(1) - 0.02).abs() < 1e-4); // gamma per decade
    /// assert!((after(1) - (1.0 + 0.02 * 2.0)).abs() < 2e-4); // two decades after t0
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`] unless `gamma` is finite, 0 < `start` < `end`, and there is at least one term.
    pub fn logarithmic(gamma: f64, start: f64, end: f64, terms: u16) -> Result<Self, Error> {
        check_positive("start", None, start)?;
        check_number("end", check_positive("end", None, end)? > start, "a time after start", end)?;
        check_whole("terms", terms != 0, "at least one", 0)?;
        check_number("gamma", gamma.abs() <= 1e90, "a finite number (at most 1e90 in magnitude)", gamma)?;
        let decades = (end / start).log10() / f64::from(terms);
        let time_constant = |k: u16| start * EULER.exp() * 10.0_f64.powf(decades * (f64::from(k) + 0.5));
        let time_constants: Vec<f64> = (0..terms).map(time_constant).collect();
        Self::new(&vec![gamma * decades; time_constants.len()], &time_constants)
    }

    /// c_k.
    #[must_use]
    pub fn amplitudes(&self) -> &[f64] {
        &self.amplitudes
    }

    /// tau_k, in seconds.
    #[must_use]
    pub fn time_constants(&self) -> &[f64] {
        &self.time_constants
    }

    /// The block for a sampling interval in seconds, at rest at zero; all its memory is taken here.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0.
    pub fn block(&self, dt: f64) -> Result<CreepBlock, Error> {
        check_positive("dt", None, dt)?;
        let decays: Vec<f64> = self.time_constants.iter().map(|tau| (-dt / tau).exp()).collect();
        Ok(CreepBlock::of_decays(&self.amplitudes, &decays))
    }
}

/// Checks the time constants of creep, or names the first that cannot be one.
pub(crate) fn check_time_constants(time_constants: &[f64]) -> Result<(), Error> {
    let mut last = 0.0;
    for (index, tau) in time_constants.iter().enumerate() {
        if check_positive("time_constants", Some(index), *tau)? <= last {
            let expected = "time constants that strictly increase";
            return Err(Error::domain("time_constants", Some(index), expected, *tau));
        }
        last = *tau;
    }
    Ok(())
}

/// One lag of creep.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Term {
    amplitude: f64,
    decay: f64,
    /// q_k.
    lag: f64,
}

impl Term {
    /// q_k at the end of the interval: the distance from rest decays, so at rest nothing moves, not even a rounding.
    #[inline]
    fn next(&self, input: f64) -> f64 {
        input + self.decay * (self.lag - input)
    }
}

/// The block of [`Creep`].
#[derive(Clone, Debug, PartialEq)]
pub struct CreepBlock {
    terms: Box<[Term]>,
}

impl CreepBlock {
    /// From the amplitudes c_j and what a distance from rest decays to in a sample, a_j; at rest at zero.
    ///
    /// ```
    /// use hysteresis_control::linear::{Block, CreepBlock};
    /// let mut creep = CreepBlock::of_decays(&[0.1], &[0.5]);
    /// assert_eq!(creep.settle(1.0), 1.1);
    /// assert_eq!([2.0, 2.0].map(|h| creep.step(h)), [2.0 + 0.1, 2.0 + 0.1 * 1.5]);
    /// ```
    #[must_use]
    pub fn of_decays(amplitudes: &[f64], decays: &[f64]) -> Self {
        let both = amplitudes.iter().zip(decays);
        Self { terms: both.map(|(amplitude, decay)| Term { amplitude: *amplitude, decay: *decay, lag: 0.0 }).collect() }
    }
}

impl CreepBlock {
    /// Behind an input that has faded.
    #[cold]
    fn fade(&mut self) {
        self.terms.iter_mut().for_each(|term| term.lag = unless_faded(term.lag));
    }
}

impl Block for CreepBlock {
    #[inline]
    fn output(&self, input: f64) -> f64 {
        self.terms.iter().fold(input, |sum, term| sum + term.amplitude * term.lag)
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.terms.iter().fold(input, |sum, term| sum + term.amplitude * term.next(input))
    }

    #[inline]
    fn hold(&mut self, input: f64) {
        for term in &mut self.terms {
            term.lag = term.next(input);
        }
        if unless_faded(input) == 0.0 {
            self.fade();
        }
    }

    fn settle(&mut self, level: f64) -> f64 {
        for term in &mut self.terms {
            term.lag = level;
        }
        self.output(level)
    }
}
