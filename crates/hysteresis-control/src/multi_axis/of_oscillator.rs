//! An oscillator with hysteresis inside, sampled: a stage of one axis.

use hysteresis_core::Error;
use nalgebra::{DMatrix, Matrix3};

use super::model::{Matrices, MultiAxisStage, check_sub_steps};
use super::operator::{ScalarOperator, middle};
use crate::as_f64;
use crate::checks::check_positive;
use crate::oscillator::HystereticOscillator;

/// The longest sub-step, times the largest natural frequency in rad/s: four samples in a period.
const LONGEST: f64 = 1.5;

impl MultiAxisStage {
    /// An oscillator y'' + c y' + k y + z\[y\] = b u whose drive is held for intervals of `dt` seconds, with the states
    /// y and y'.
    ///
    /// With the middle slope f of z the rest is linear and sampled exactly. What z is beside f y is held over a
    /// sub-step of `dt / sub_steps`, at the position in its middle: errors of a whole go with the square of that, and
    /// grow with the amplitude. With 20 sub-steps in the shortest period they are 0.2 % of the motion of the public
    /// Bouc-Wen benchmark under 50 N rms of noise up to 100 Hz, and 2.3 % under 600 N; with 80, 0.01 and 0.1 %. To
    /// simulate finely take the [stream](crate::oscillator::OscillatorForward) of the oscillator.
    ///
    /// ```
    /// use hysteresis_control::multi_axis::MultiAxisStage;
    /// use hysteresis_control::oscillator::HystereticOscillator;
    /// use hysteresis_core::Duhem;
    /// let hysteresis = Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)?;
    /// let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, hysteresis)?;
    /// let stage = MultiAxisStage::of_oscillator(&oscillator, 1e-3, 1)?;
    /// assert_eq!((stage.drives(), stage.positions(), stage.states()), (1, 1, 2));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Domain`] unless `dt` is above 0, and its sub-steps so short beside a period that the sampled
    /// oscillator is stable; [`Error::Whole`] unless there are 1 to 1000 of them.
    pub fn of_oscillator(oscillator: &HystereticOscillator, dt: f64, sub_steps: usize) -> Result<Self, Error> {
        check_positive("dt", None, dt)?;
        let refused = || {
            let expected = "sub-steps so short beside a period that the sampled oscillator is stable";
            Error::domain("dt", None, expected, dt)
        };
        let step = dt / as_f64(check_sub_steps(sub_steps)?);
        let operator = ScalarOperator::duhem(*oscillator.hysteresis());
        let slope = middle(&operator);
        if step * (oscillator.stiffness() + oscillator.hysteresis().max_slope()).sqrt() > LONGEST {
            return Err(refused());
        }
        // y, y' and a held acceleration.
        let [stiffness, damping] = [oscillator.stiffness() + slope, oscillator.damping()];
        let rates = Matrix3::new(0.0, 1.0, 0.0, -stiffness, -damping, 1.0, 0.0, 0.0, 0.0);
        let (whole, half) = ((rates * step).exp(), (rates * (0.5 * step)).exp());
        let held = whole.fixed_view::<2, 1>(0, 2).clone_owned();
        let gain = oscillator.gain();
        // What the operator sees: the position in the middle of the interval.
        let cq = DMatrix::from_row_slice(1, 2, &[half[(0, 0)], half[(0, 1)]]);
        let bw = DMatrix::from_column_slice(2, 1, (-held).as_slice());
        let dq = DMatrix::from_element(1, 1, half[(0, 2)] * gain);
        let linear = DMatrix::from_fn(2, 2, |i, j| whole[(i, j)]);
        let pushed = DMatrix::from_column_slice(2, 1, (held * gain).as_slice());
        let matrices = Matrices {
            a: linear - &bw * &cq * slope,
            b: pushed - &bw * &dq * slope,
            bw,
            c: DMatrix::from_row_slice(1, 2, &[1.0, 0.0]),
            d: DMatrix::zeros(1, 1),
            cq,
            dq,
        };
        Self::new(matrices, vec![operator], vec![0.0], dt).map_err(|_| refused())?.with_sub_steps(sub_steps)
    }
}
