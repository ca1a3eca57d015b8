//! What runs linear dynamics, sample by sample.

use hysteresis_core::check_all_finite;

use super::discrete::Discrete;
use super::history::History;
use super::{Block, Error};

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
            if got != expected {
                let expected = "as many numbers as these dynamics have";
                return Err(Error::whole(parameter, None, expected, got));
            }
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

#[inline]
fn dot(one: &[f64], other: &[f64]) -> f64 {
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
        self.past.push(input);
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.deviation.fill(0.0);
        self.past.fill(level);
        self.gain * level
    }
}
