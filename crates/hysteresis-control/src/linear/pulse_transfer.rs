//! How dynamics behind a hold answer in the frequency domain.

use core::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::discrete::Discrete;
use super::state_space::resolvent;

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
