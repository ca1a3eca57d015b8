//! What a stage is made of, where it comes from and how far it can be trusted.

use hysteresis_core::{
    Duhem, Error as CoreError, LoopShiftTerms, MAX_KNOTS, ModifiedPrandtlIshlinskii, PiecewiseLinearMap,
    RelaxingPlayTerms, SlowGainTerms,
};
use serde::{Deserialize, Serialize};

use super::{ErrorBand, TemperatureTerm, number};
use crate::checks::check_positive;
use crate::linear::{Creep, FirstOrder, LinearDynamics, check_time_constants};

/// The parts of a stage, each of which may be missing. Without any the position is the drive.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let hysteresis =
///     ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts {
///     dynamics: SecondOrder::new(800.0, 0.02)?.into(),
///     dead_time: 1e-4,
///     limits: Some((0.0, 150.0)),
///     ..StageParts::new(hysteresis)
/// })?;
/// assert_eq!(stage.rest_drive(), 0.0);
/// assert_eq!(Stage::new(StageParts::default())?.slope_range(), (1.0, 1.0));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageParts {
    /// The hysteresis H; by default none.
    pub hysteresis: ModifiedPrandtlIshlinskii,
    /// A Duhem operator beside the hysteresis, of the same input; both outputs are added, in the unit of the position.
    pub duhem: Option<Box<Duhem<MAX_KNOTS>>>,
    /// The map gamma in front of the hysteresis.
    pub input_map: Option<PiecewiseLinearMap>,
    /// The map phi behind the hysteresis.
    pub output_map: Option<PiecewiseLinearMap>,
    /// The lag of the amplifier, in front of the hysteresis.
    pub amplifier: Option<FirstOrder>,
    /// What motion of the drive adds behind the output map.
    pub loop_shift: Option<LoopShift>,
    /// Plays that relax, beside the loop shift: loops whose width depends on the rate.
    pub relaxing_plays: Option<RelaxingPlays>,
    /// How the size of all loops changes while the drive cycles, behind loop shift and relaxing plays.
    pub slow_gain: Option<SlowGain>,
    /// Creep behind output map, loop shift, relaxing plays and slow gain.
    pub creep: Option<Creep>,
    /// Modes and lags behind the hysteresis; their dead time must be 0.
    pub dynamics: LinearDynamics,
    /// What the sensor shows later than hysteresis and modes explain, in seconds. An identified stage may have a
    /// negative one, if its records pair a drive with a position that was read later.
    pub dead_time: f64,
    /// What a temperature adds behind all of it; what runs is at its reference.
    pub temperature: Option<TemperatureTerm>,
    /// The drive never leaves (low, high).
    pub limits: Option<(f64, f64)>,
    /// How fast the drive may change, per second.
    pub slew: Option<f64>,
    /// Rms noise of the sensor, in the unit of the position.
    pub noise: Option<f64>,
    /// How far positions may be from those that the stage predicts, if identification told it.
    pub error_band: Option<ErrorBand>,
    /// What identification knows of the stage.
    pub identified: Option<Identified>,
    /// The units of drive and position.
    pub units: Units,
}

impl StageParts {
    /// Hysteresis alone.
    #[must_use]
    pub fn new(hysteresis: ModifiedPrandtlIshlinskii) -> Self {
        Self { hysteresis, ..Self::default() }
    }
}

/// The shift of a loop: what motion of the drive adds to the position.
///
/// Measured on piezo stacks: the centre of a loop moves with its amplitude, or rate. No model of Preisach's class has
/// that. With the scaled drive x, the position gains s behind the output map, in front of the creep:
///
/// ```text
/// x = (u - center) / half_range                    u: the drive at the input map
/// e = x - f, within -limit .. limit                f: follows x with the time constant tau / 4
/// s = c_1 m + c_2 n                                m, n: the means of e^2 and of x |e|, with the time constant tau
/// ```
///
/// e is about (tau / 4) x' for a motion that is slow beside tau. c_1 moves the centre of every loop. c_2 moves that of
/// a loop that lies off the centre of the range. At rest s is 0. u is in the unit of the drive, c_1 and c_2 in that of
/// the position, tau in seconds.
///
/// s follows from past drives alone, so the inverse stays exact sample by sample; [`LoopShiftTerms`] has the equations
/// of the samples. m grows with the square of the rate. The limit, the largest e of the records that the shift was
/// identified from, keeps it from growing hundredfold at ten times their rate: a loop shift says nothing of other
/// rates.
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
    /// From the drive in the middle of the range and half of that range, the amplitudes c_1 and c_2, the time constant
    /// tau in seconds, and the limit of e.
    ///
    /// # Errors
    /// [`CoreError::Domain`] that names the number: a centre or amplitude that is not finite; a half range, time
    /// constant or limit that is not finite and above 0.
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

/// Plays that relax: what makes loops wider or narrower at other rates.
///
/// Loops of plays alone are as wide at any speed. Where a part of the hysteresis follows within a time of its own, as
/// in soft ferroelectrics, polymers and bearings, they are not. Behind the output map, beside the loop shift, the
/// position gains r:
///
/// ```text
/// z_i = P_ri\[u - origin\]                   P: a play, virgin at the origin
/// tau_j s_j' = sum_i v_ij z_i - s_j          a lag for every time constant
/// r = sum_j s_j
/// ```
///
/// One threshold of 0 is creep of the drive itself. The creep operators of P. Krejci and K. Kuhnen, IEE Proc. Control
/// Theory Appl. 148 (2001) 185-192, are kin: their thresholds lie within the lag. u, r_i and the origin are in the unit
/// of the drive, v_ij in that of the position per unit of the drive, tau_j in seconds.
///
/// r follows from past drives alone, so the inverse stays exact sample by sample; [`RelaxingPlayTerms`] has the
/// equations of the samples.
///
/// ```
/// use hysteresis_control::stage::{RelaxingPlays, Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&[0.3], &[0.0], Ratios::PLAY, Offsets::default())?;
/// let plays = RelaxingPlays::new(&[10.0], 0.0, &[0.05], &[vec![0.1]])?; // V, V, s, um / V
/// let stage = Stage::new(StageParts { relaxing_plays: Some(plays), ..StageParts::new(hysteresis) })?;
/// let (dt, mut forward) = (1e-3, stage.forward(1e-3)?);
/// let at_once = forward.step(50.0);
/// let after_a_time_constant = (1..=50).map(|_| forward.step(50.0)).last().unwrap();
/// assert_eq!(at_once, 15.0);
/// assert!((after_a_time_constant - (15.0 + 4.0 * (1.0 - f64::exp(-1.0)))).abs() < 1e-12); // um
/// # Ok::<(), hysteresis_control::stage::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxingPlays {
    thresholds: Vec<f64>,
    origin: f64,
    time_constants: Vec<f64>,
    weights: Vec<Vec<f64>>,
}

impl RelaxingPlays {
    /// From the thresholds r_i, the drive at which all plays are virgin, the time constants tau_j in seconds, and for
    /// each of these the weights v_ij of all plays.
    ///
    /// # Errors
    /// [`CoreError`] that names the argument: thresholds that are not finite, below 0 or not strictly rising; time
    /// constants that are not finite, above 0 and strictly rising; an origin or a weight that is not finite; other than
    /// a row of weights for every time constant with a weight for every threshold; nothing at all.
    pub fn new(
        thresholds: &[f64],
        origin: f64,
        time_constants: &[f64],
        weights: &[Vec<f64>],
    ) -> Result<Self, CoreError> {
        if time_constants.is_empty() {
            return Err(CoreError::whole("time_constants", None, "at least one number", 0));
        }
        check_time_constants(time_constants)?;
        // All but the time constants is checked where it is used.
        RelaxingPlayTerms::new(thresholds, origin, &vec![0.0; time_constants.len()], weights)?;
        let (thresholds, time_constants) = (thresholds.to_vec(), time_constants.to_vec());
        Ok(Self { thresholds, origin, time_constants, weights: weights.to_vec() })
    }

    /// r_i, in the unit of the drive.
    #[must_use]
    pub fn thresholds(&self) -> &[f64] {
        &self.thresholds
    }

    /// The drive at which all plays are virgin.
    #[must_use]
    pub fn origin(&self) -> f64 {
        self.origin
    }

    /// tau_j, in seconds.
    #[must_use]
    pub fn time_constants(&self) -> &[f64] {
        &self.time_constants
    }

    /// v_ij, a row for every time constant.
    #[must_use]
    pub fn weights(&self) -> &[Vec<f64>] {
        &self.weights
    }

    /// The lowest and the highest slope dr/du, before anything has relaxed and once all has: the plays of the smallest
    /// thresholds slide first.
    pub(super) fn slopes(&self) -> (f64, f64) {
        let of_play = |i: usize| self.weights.iter().map(|row| row[i]).sum::<f64>();
        let sums = (0..self.thresholds.len()).scan(0.0, |sum, i| {
            *sum += of_play(i);
            Some(*sum)
        });
        sums.fold((0.0, 0.0), |(low, high), sum| (f64::min(low, sum), f64::max(high, sum)))
    }

    /// The lowest and the highest r that drives within a range can lead to.
    pub(super) fn range(&self, (from, to): (f64, f64)) -> (f64, f64) {
        let outputs = |threshold: f64| {
            let lowest = (from - self.origin + threshold).min(0.0);
            (lowest, (to - self.origin - threshold).max(0.0))
        };
        let products =
            self.weights.iter().flat_map(|row| row.iter().zip(&self.thresholds)).map(|(weight, threshold)| {
                let (low, high) = outputs(*threshold);
                (weight * low, weight * high)
            });
        products.fold((0.0, 0.0), |(low, high), (one, other)| (low + one.min(other), high + one.max(other)))
    }

    /// The same, sampled at `dt` seconds.
    ///
    /// # Errors
    /// [`CoreError::Domain`] unless `dt` is finite and above 0.
    pub fn terms(&self, dt: f64) -> Result<RelaxingPlayTerms, CoreError> {
        check_positive("dt", None, dt)?;
        let decays: Vec<f64> = self.time_constants.iter().map(|tau| (-dt / tau).exp()).collect();
        RelaxingPlayTerms::new(&self.thresholds, self.origin, &decays, &self.weights)
    }
}

/// The slow gain: how the size of all loops changes while the drive cycles, and comes back at rest.
///
/// Measured on piezo stacks: within a minute of cycling all loops become smaller by a few parts in a thousand. No model
/// of Preisach's class has that. Behind output map, loop shift and relaxing plays, in front of the creep, the position
/// h becomes v:
///
/// ```text
/// x = u / half_range                       u: the drive at the input map
/// e = x - f, within -1 .. 1                f: follows x with the time constant tau / 4
/// v = zero + (1 + kappa m) (h - zero)      m: the mean of e^2, with the time constant tau
/// ```
///
/// At rest m is 0. A sine over the whole range has m = 1/2 once it has lasted, one of half that amplitude an eighth,
/// and no drive more than 1. `zero` is the position that the gain leaves where it is. u is in the unit of the drive,
/// zero in that of the position, tau in seconds; kappa has no unit.
///
/// m follows from past drives alone, so the inverse stays exact sample by sample; [`SlowGainTerms`] has the equations
/// of the samples.
///
/// ```
/// use hysteresis_control::stage::{SlowGain, Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&[0.3], &[0.0], Ratios::PAPER, Offsets::default())?;
/// let gain = SlowGain::new(75.0, -0.01, 22.5, 5.0)?; // V, 1, um, s
/// let stage = Stage::new(StageParts { slow_gain: Some(gain), ..StageParts::new(hysteresis) })?;
/// let (dt, mut forward) = (1e-2, stage.forward(1e-2)?);
/// let drive = |k: i32| 75.0 + 75.0 * (f64::from(k) * dt * core::f64::consts::TAU).sin(); // 1 Hz
/// forward.settle(drive(0));
/// let positions: Vec<f64> = (0..6000).map(|k| forward.step(drive(k))).collect();
/// assert!((positions[5925] - positions[5975] - 45.0 * (1.0 - 0.01 / 2.0)).abs() < 5e-3); // um from end to end
/// # Ok::<(), hysteresis_control::stage::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlowGain {
    half_range: f64,
    amplitude: f64,
    zero: f64,
    time_constant: f64,
}

impl SlowGain {
    /// From half of the range of drives, the amplitude kappa, the position that stays where it is, and the time
    /// constant tau in seconds.
    ///
    /// # Errors
    /// [`CoreError::Domain`] that names the number: a half range or time constant that is not finite and above 0, an
    /// amplitude outside -0.5 to 0.5, a position that is not finite.
    pub fn new(half_range: f64, amplitude: f64, zero: f64, time_constant: f64) -> Result<Self, CoreError> {
        // All but the time constant is checked where it is used.
        SlowGainTerms::new(half_range, amplitude, zero, 0.0)?;
        check_positive("time_constant", None, time_constant)?;
        Ok(Self { half_range, amplitude, zero, time_constant })
    }

    /// Half of the range of drives.
    #[must_use]
    pub fn half_range(&self) -> f64 {
        self.half_range
    }

    /// kappa.
    #[must_use]
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// The position that the gain leaves where it is, in the unit of the position.
    #[must_use]
    pub fn zero(&self) -> f64 {
        self.zero
    }

    /// tau, in seconds.
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        self.time_constant
    }

    /// The lowest and the highest gain that there can be.
    #[must_use]
    pub fn gains(&self) -> (f64, f64) {
        (1.0 + self.amplitude.min(0.0), 1.0 + self.amplitude.max(0.0))
    }

    /// What a gain makes of a position.
    pub(super) fn at(&self, gain: f64, position: f64) -> f64 {
        self.zero + gain * (position - self.zero)
    }

    /// The same, sampled at `dt` seconds.
    ///
    /// # Errors
    /// [`CoreError::Domain`] unless `dt` is finite and above 0.
    pub fn terms(&self, dt: f64) -> Result<SlowGainTerms, CoreError> {
        check_positive("dt", None, dt)?;
        SlowGainTerms::new(self.half_range, self.amplitude, self.zero, (-dt / self.time_constant).exp())
    }
}

/// The units in which a stage counts. Nothing is converted: they are names, shown wherever a number is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Units {
    /// Of drives.
    pub drive: String,
    /// Of positions.
    pub position: String,
}

impl Default for Units {
    fn default() -> Self {
        Self { drive: "V".into(), position: "um".into() }
    }
}

/// A record that the stage was identified from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordSource {
    /// The name of the file, or of the record.
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal digits; nothing for what was no file.
    pub sha256: Option<String>,
}

/// A finding of the identification that makes some number doubtful.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageWarning {
    /// The name of the finding.
    pub code: String,
    /// "amber", or "red" where the stage is not to be used; files that do not say it have "amber".
    #[serde(default = "amber")]
    pub severity: String,
    /// What it says, in one sentence.
    pub message: String,
    /// The number on which it rests.
    #[serde(with = "number")]
    pub value: f64,
    /// The limit that the number broke.
    #[serde(with = "number")]
    pub limit: f64,
    /// What to try next.
    pub hint: String,
}

fn amber() -> String {
    "amber".into()
}

/// What identification knows of a stage besides its parts. Two are equal if they are written to files alike: then a
/// number that was not determined is equal to itself.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identified {
    /// The lowest and the highest drive of the records.
    pub drive_range: (f64, f64),
    /// The lowest and the highest position of the records, which may hold ringing and noise; what the stage reaches is
    /// [`Stage::position_range`](super::Stage::position_range).
    pub position_range: (f64, f64),
    /// The sampling intervals of the records, in seconds; empty if they are not known.
    pub dt: Vec<f64>,
    /// Root mean square of the residual, in the unit of the position.
    #[serde(with = "number")]
    pub rmse: f64,
    /// The largest residual, in the unit of the position.
    #[serde(with = "number")]
    pub max_error: f64,
    /// The names of the parameters that the covariance counts.
    pub parameters: Vec<String>,
    /// The covariance of the parameters, row by row.
    #[serde(with = "number")]
    pub covariance: Vec<Vec<f64>>,
    /// What makes numbers doubtful.
    pub warnings: Vec<StageWarning>,
    /// The records.
    pub records: Vec<RecordSource>,
}

impl PartialEq for Identified {
    fn eq(&self, other: &Self) -> bool {
        // Serialising plain numbers and strings into memory has no way to fail.
        serde_json::to_string(self).ok() == serde_json::to_string(other).ok()
    }
}
