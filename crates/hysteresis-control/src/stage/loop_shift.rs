//! The loop shift of a stage, in continuous time.

use hysteresis_core::{Error as CoreError, LoopShiftTerms};

use crate::linear::check_positive;

/// The shift of a loop: what motion of the drive adds to the position.
///
/// Measured on piezo stacks: the centre of a loop moves with its amplitude, or rate. No model of Preisach's class has that.
/// With the scaled drive x, the position gains s behind the output map, in front of the creep:
///
/// ```text
/// x = (u - center) / half_range                    u: the drive at the input map
/// e = x - f, within -limit .. limit                f: follows x with the time constant tau / 4
/// s = c_1 m + c_2 n                                m, n: the means of e^2 and of x |e|, with the time constant tau
/// ```
///
/// e is about (tau / 4) x' for a motion that is slow beside tau. c_1 moves the centre of every loop. c_2 moves that of a
/// loop that lies off the centre of the range. At rest s is 0. u is in the unit of the drive, c_1 and c_2 in that of the
/// position, tau in seconds.
///
/// s follows from past drives alone, so the inverse stays exact sample by sample; [`LoopShiftTerms`] has the equations of
/// the samples. m grows with the square of the rate. The limit, the largest e of the records that the shift was identified
/// from, keeps it from growing hundredfold at ten times their rate: a loop shift says nothing of other rates.
///
/// ```
/// use hysteresis_control::stage::{LoopShift, Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&[0.3], &[0.0], Ratios::PAPER, Offsets::default())?;
/// let shift = LoopShift::new(75.0, 75.0, [-20.0, 0.0], 0.2, 0.3)?; // V, V, um, s
/// let stage = Stage::new(StageParts { loop_shift: Some(shift), ..StageParts::new(hysteresis) })?;
/// let (dt, mut forward) = (1e-3, stage.forward(1e-3)?);
/// let drive = |k: i32| 75.0 + 37.5 * (f64::from(k) * dt * core::f64::consts::TAU).sin(); // 1 Hz
/// forward.settle(drive(0));
/// let center = (0..3000).map(|k| forward.step(drive(k))).skip(2000).sum::<f64>() / 1000.0;
/// let lag = core::f64::consts::TAU * 0.2 / 4.0;
/// let mean_square = 0.5 * 0.5 / 2.0 * lag * lag / (1.0 + lag * lag); // of e
/// assert!((center - (0.3 * 75.0 - 20.0 * mean_square)).abs() < 0.01); // um
/// # Ok::<(), hysteresis_control::stage::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopShift {
    center: f64,
    half_range: f64,
    amplitudes: [f64; 2],
    time_constant: f64,
    limit: f64,
}

impl LoopShift {
    /// From the drive in the middle of the range and half of that range, the amplitudes c_1 and c_2, the time constant tau
    /// in seconds, and the limit of e.
    ///
    /// # Errors
    /// [`CoreError::Domain`] that names the number: a centre or amplitude that is not finite; a half range, time constant
    /// or limit that is not finite and above 0.
    pub fn new(
        center: f64,
        half_range: f64,
        amplitudes: [f64; 2],
        time_constant: f64,
        limit: f64,
    ) -> Result<Self, CoreError> {
        // All but the time constant is checked where it is used.
        LoopShiftTerms::new(center, half_range, amplitudes, limit, 0.0)?;
        check_positive("time_constant", None, time_constant)?;
        Ok(Self { center, half_range, amplitudes, time_constant, limit })
    }

    /// The drive in the middle of the range.
    #[must_use]
    pub fn center(&self) -> f64 {
        self.center
    }

    /// Half of the range of drives.
    #[must_use]
    pub fn half_range(&self) -> f64 {
        self.half_range
    }

    /// c_1 and c_2, in the unit of the position.
    #[must_use]
    pub fn amplitudes(&self) -> [f64; 2] {
        self.amplitudes
    }

    /// tau, in seconds.
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        self.time_constant
    }

    /// The largest magnitude of e.
    #[must_use]
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// The same, sampled at `dt` seconds.
    ///
    /// # Errors
    /// [`CoreError::Domain`] unless `dt` is finite and above 0.
    pub fn terms(&self, dt: f64) -> Result<LoopShiftTerms, CoreError> {
        check_positive("dt", None, dt)?;
        let decay = (-dt / self.time_constant).exp();
        LoopShiftTerms::new(self.center, self.half_range, self.amplitudes, self.limit, decay)
    }
}
