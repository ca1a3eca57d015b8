//! A whole stage in one object: what the user has on the bench.
//!
//! ```text
//! limits, D/A -> dead time -> amplifier -> input map -> hysteresis + Duhem -> output map
//!     -> loop shift + relaxing plays -> slow gain -> creep -> modes -> sensor
//! ```
//!
//! Everything that runs is made from a [`Stage`]: its [forward model](Stage::forward), the exact
//! [inverse](Stage::inverse) of its slow part, the [drive for a reference](Stage::precompensate), controllers,
//! observers and learning. So parameters, limits and times are stated once.
//!
//! # Time
//! Times are in seconds, frequencies in Hz. The drive u(k) is put out at t_k = k dt and held until t_(k+1). The
//! position y(k) of the same row is read at t_k. The **dead time** is what the sensor shows later than hysteresis and
//! modes explain:
//!
//! ```text
//! drive     u(0)______u(1)______u(2)______          put out at t_k, held until t_(k+1)
//!           |         |         |
//! time      t_0       t_1       t_2
//!           |         |         |
//! position  y(0)      y(1)      y(2)                read at t_k
//!           |<- dead time ->|
//! hysteresis                H[u(0)]_____H[u(1)]____  acts from t_k + dead time on
//! ```
//!
//! With no dead time and no modes y(k) = H\[u(k)\]. Modes answer to u(k) from y(k+1) on.
//!
//! # Files
//! `parts` says what a stage is made of. Here it becomes a [`Stage`], with its limits and ranges. The rest is made from
//! it: `file`, `forward`, `precompensate` (the drive for a known reference), `band` (by how much it is missed),
//! `knowledge` (what identification still knows of it), `design` (feedback, controllers).

mod band;
mod design;
mod file;
mod forward;
mod knowledge;
#[doc(hidden)]
pub mod number;
mod parts;
mod precompensate;
mod temperature;

pub use band::{Branches, CELLS, ErrorBand, ErrorBounds, Place};
pub use design::{FeedForwardKind, PEAK_SENSITIVITY};
pub(crate) use file::StageBytes;
pub use file::{SCHEMA, read_file};
pub use forward::{StageForward, StageState};
pub use parts::{Identified, LoopShift, RecordSource, RelaxingPlays, SlowGain, StageParts, StageWarning, Units};
pub use precompensate::{PrecompensateOptions, Precompensated};
pub use temperature::TemperatureTerm;

use core::f64::consts::TAU;
use core::fmt;

use hysteresis_core::{
    Bound, Bracket, CompiledModel, CreepTerms, Error as CoreError, MAX_MAGNITUDE, Process, QuasiStatic,
    QuasiStaticInverse, is_admissible,
};

use crate::linear::{Creep, LinearDynamics};

/// A stage: validated, immutable parts, and everything that runs made from them.
///
/// ```
/// use hysteresis_control::linear::{Creep, SecondOrder};
/// use hysteresis_control::stage::{PrecompensateOptions, Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let hysteresis =
///     ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts {
///     creep: Some(Creep::logarithmic(0.012, 0.01, 100.0, 8)?),
///     dynamics: SecondOrder::new(800.0, 0.1)?.into(),
///     dead_time: 1e-4,
///     limits: Some((-30.0, 150.0)),
///     ..StageParts::new(hysteresis)
/// })?;
/// let reference: Vec<f64> = (0..4000).map(|k| 15.0 - 15.0 * (0.00628 * f64::from(k)).cos()).collect(); // um, 10 Hz
/// let found = stage.precompensate(&reference, 1e-4, &PrecompensateOptions::default())?;
/// let mut bench = stage.forward(1e-4)?;
/// let worst = found.drive.iter().zip(&reference).map(|(u, r)| (bench.step(*u) - r).abs()).fold(0.0, f64::max);
/// assert!(worst < 0.01, "{worst} um");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Stage {
    parts: StageParts,
    model: CompiledModel,
    /// gamma, H, z and phi: what follows the drive at once.
    rigid: QuasiStatic,
}

impl PartialEq for Stage {
    fn eq(&self, other: &Self) -> bool {
        self.parts == other.parts
    }
}

impl Stage {
    /// A stage of these parts.
    ///
    /// # Errors
    /// [`Error`] that names the part: dynamics with a dead time of their own, a dead time that is not finite, limits
    /// that are not finite with low < high, a slew that is not above 0, a noise below 0.
    pub fn new(parts: StageParts) -> Result<Self, Error> {
        let domain = |parameter, index, expected, got| CoreError::Domain { parameter, index, expected, got };
        if parts.dynamics.dead_time() != 0.0 {
            let expected = Bound::Between { low: 0.0, high: 0.0 };
            return Err(domain("dynamics.dead_time", None, expected, parts.dynamics.dead_time()).into());
        }
        if !is_admissible(parts.dead_time) {
            return Err(domain("dead_time", None, Bound::Finite, parts.dead_time).into());
        }
        check_limits("limits", parts.limits)?;
        if let Some(slew) = parts.slew.filter(|slew| !(*slew > 0.0 && is_admissible(*slew))) {
            return Err(domain("slew", None, Bound::Positive, slew).into());
        }
        if let Some(noise) = parts.noise.filter(|noise| !(*noise >= 0.0 && is_admissible(*noise))) {
            return Err(domain("noise", None, Bound::NonNegative, noise).into());
        }
        let model = CompiledModel::new(&parts.hysteresis);
        let mut rigid = QuasiStatic::new(&model);
        if let Some(duhem) = &parts.duhem {
            rigid = rigid.with_duhem(**duhem);
        }
        if let Some(map) = &parts.input_map {
            rigid = rigid.with_input_map(map.clone());
        }
        if let Some(map) = &parts.output_map {
            rigid = rigid.with_output_map(map.clone());
        }
        Ok(Self { parts, model, rigid })
    }

    /// The same stage, identified from these records; without effect on a stage that was not identified.
    #[must_use]
    pub fn with_records(mut self, records: Vec<RecordSource>) -> Self {
        if let Some(identified) = &mut self.parts.identified {
            identified.records = records;
        }
        self
    }

    /// The parts of which the stage is made.
    #[must_use]
    pub fn parts(&self) -> &StageParts {
        &self.parts
    }

    /// The hysteresis, compiled.
    #[must_use]
    pub fn model(&self) -> &CompiledModel {
        &self.model
    }

    /// Between which drives what runs stays by default: the limits of the stage within the range that was identified.
    #[must_use]
    pub fn drive_range(&self) -> Option<(f64, f64)> {
        match (self.parts.limits, self.parts.identified.as_ref().map(|identified| identified.drive_range)) {
            (Some((low, high)), Some((from, to))) if low.max(from) < high.min(to) => {
                Some((low.max(from), high.min(to)))
            }
            (limits, range) => limits.or(range),
        }
    }

    /// The range of drives that was identified, if these limits reach beyond it: the model extrapolates there.
    #[must_use]
    pub fn extrapolates(&self, limits: (f64, f64)) -> Option<(f64, f64)> {
        let (low, high) = self.parts.identified.as_ref()?.drive_range;
        // What a converter rounds is no extrapolation.
        let tolerance = 1e-3 * (high - low);
        (limits.0 < low - tolerance || limits.1 > high + tolerance).then_some((low, high))
    }

    /// Whether [`drive_range`](Self::drive_range) is what was identified, as the limits reach beyond it or there are
    /// none.
    #[must_use]
    pub fn is_narrowed(&self) -> bool {
        self.extrapolates(self.parts.limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY))).is_some()
    }

    /// Limits that something runs with: the given ones, if they lie within those of the stage, or else
    /// [`drive_range`](Self::drive_range).
    ///
    /// # Errors
    /// [`Error`] for limits that are not finite with low < high, or beyond those of the stage.
    pub fn limits(&self, given: Option<(f64, f64)>) -> Result<Option<(f64, f64)>, Error> {
        let Some(given) = check_limits("limits", given)? else { return Ok(self.drive_range()) };
        if let Some((low, high)) = self.parts.limits {
            for (index, got) in [given.0, given.1].into_iter().enumerate() {
                if !(low <= got && got <= high) {
                    let expected = Bound::Between { low, high };
                    return Err(CoreError::Domain { parameter: "limits", index: Some(index), expected, got }.into());
                }
            }
        }
        Ok(Some(given))
    }

    /// The drive at which the stage rests when nothing drives it: 0, or the limit nearest to it.
    #[must_use]
    pub fn rest_drive(&self) -> f64 {
        rest_drive(self.parts.limits)
    }

    /// The linear part from the drive to the sensor: amplifier, modes and dead time, in continuous time.
    ///
    /// # Errors
    /// [`Error::NegativeDeadTime`]: what runs in a loop cannot read a position before it is there.
    pub fn linear_part(&self) -> Result<LinearDynamics, Error> {
        Ok(self.amplifier_and_modes().with_dead_time(self.causal_dead_time()?)?)
    }

    fn amplifier_and_modes(&self) -> LinearDynamics {
        let dynamics = self.parts.dynamics.clone();
        match self.parts.amplifier {
            Some(amplifier) => LinearDynamics::from(amplifier).then(dynamics),
            None => dynamics,
        }
    }

    fn causal_dead_time(&self) -> Result<f64, Error> {
        let got = self.parts.dead_time;
        if got < 0.0 { Err(Error::NegativeDeadTime { got }) } else { Ok(got) }
    }

    /// gamma, H, z, phi, loop shift, relaxing plays, slow gain and creep, sampled: the stage without its fast dynamics.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0.
    pub fn quasi_static(&self, dt: f64) -> Result<QuasiStatic, Error> {
        crate::checks::check_positive("dt", None, dt)?;
        let mut sampled = self.rigid.clone();
        if let Some(shift) = &self.parts.loop_shift {
            sampled = sampled.with_loop_shift(shift.terms(dt)?);
        }
        if let Some(plays) = &self.parts.relaxing_plays {
            sampled = sampled.with_relaxing_plays(plays.terms(dt)?);
        }
        if let Some(gain) = &self.parts.slow_gain {
            sampled = sampled.with_slow_gain(gain.terms(dt)?);
        }
        if let Some(creep) = &self.parts.creep {
            let decays: Vec<f64> = creep.time_constants().iter().map(|tau| (-dt / tau).exp()).collect();
            sampled = sampled.with_creep(CreepTerms::new(creep.amplitudes(), &decays)?);
        }
        Ok(sampled)
    }

    /// The exact inverse of maps, hysteresis, loop shift, relaxing plays, slow gain and creep, sample by sample, at
    /// rest at [`rest_drive`](Self::rest_drive).
    ///
    /// Modes, amplifier and dead time are not part of it: [`precompensate`](Self::precompensate) leads through those.
    /// With the amplifier: [`inverse_behind_amplifier`](Self::inverse_behind_amplifier).
    ///
    /// # Errors
    /// [`Error`] as for [`limits`](Self::limits), unless `dt` is finite and above 0, and for hysteresis without an
    /// inverse.
    pub fn inverse(&self, dt: f64, limits: Option<(f64, f64)>) -> Result<QuasiStaticInverse, Error> {
        let limits = self.limits(limits)?;
        let mut inverse = self.quasi_static(dt)?.inverse(limits)?;
        inverse.settle(rest_drive(limits));
        Ok(inverse)
    }

    /// The same behind the amplifier of the stage, if it has one: a target is what amplifier and modes are to get, and
    /// the lag of the amplifier is inverted last, as it comes first ([`QuasiStaticInverse::behind_amplifier`]).
    ///
    /// # Errors
    /// As for [`inverse`](Self::inverse).
    pub fn inverse_behind_amplifier(&self, dt: f64, limits: Option<(f64, f64)>) -> Result<QuasiStaticInverse, Error> {
        let inverse = self.inverse(dt, limits)?;
        let Some(amplifier) = self.parts.amplifier else { return Ok(inverse) };
        Ok(inverse.behind_amplifier((-TAU * amplifier.frequency() * dt).exp())?)
    }

    /// Where the position must lie when nothing is known of the history but its limits: two streams through maps and
    /// hysteresis. Loop shift, relaxing plays, slow gain, creep and modes are left out.
    ///
    /// # Errors
    /// [`Error`] for a model with a negative weight, with a Duhem operator, or without limits.
    pub fn bracket(&self, limits: Option<(f64, f64)>) -> Result<Bracket, Error> {
        let limits = self.limits(limits)?.unwrap_or((-MAX_MAGNITUDE, MAX_MAGNITUDE));
        Ok(Bracket::of_stage(&self.rigid, limits)?)
    }
}

/// The drive at rest: 0, or the limit nearest to it.
fn rest_drive(limits: Option<(f64, f64)>) -> f64 {
    limits.map_or(0.0, |(low, high)| 0.0_f64.max(low).min(high))
}

fn check_limits(parameter: &'static str, limits: Option<(f64, f64)>) -> Result<Option<(f64, f64)>, Error> {
    let Some((low, high)) = limits else { return Ok(None) };
    for (index, got) in [low, high].into_iter().enumerate() {
        if !is_admissible(got) {
            return Err(CoreError::Domain { parameter, index: Some(index), expected: Bound::Finite, got }.into());
        }
    }
    if low < high {
        Ok(limits)
    } else {
        let expected = Bound::Above { what: "the low limit", limit: low };
        Err(CoreError::Domain { parameter, index: Some(1), expected, got: high }.into())
    }
}

/// Creep takes no more than this share of the loop from either end: creep that may go on for more leaves no range.
const MOST_CREPT: f64 = 0.25;

/// So many loops over the whole range are enough for z to drift to where it stays.
const LOOPS: usize = 32;

impl Stage {
    /// The lowest and the highest slope dy/du, creep and relaxing plays at their end included, and a slow gain wherever
    /// it may be. A loop shift does not change it: the newest drive does not enter it, and at its end it is 0. A Duhem
    /// operator counts between its knots: beyond them its f goes on as it was.
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        let (mut low, mut high) = self.model.slope_range();
        if let Some(duhem) = &self.parts.duhem {
            (low, high) = (low + duhem.min_slope(), high + duhem.max_slope());
        }
        // A slope below 0, of an operator that falls more than the plays rise, is least where it is made steepest.
        let between = |(low, high): (f64, f64), (flat, steep): (f64, f64)| {
            (low * if low < 0.0 { steep } else { flat }, high * if high < 0.0 { flat } else { steep })
        };
        for map in [&self.parts.input_map, &self.parts.output_map].into_iter().flatten() {
            (low, high) = between((low, high), map.slope_range());
        }
        if let Some(plays) = &self.parts.relaxing_plays {
            let (least, most) = plays.slopes();
            (low, high) = (low + least, high + most);
        }
        let crept: f64 = self.parts.creep.iter().flat_map(Creep::amplitudes).sum();
        let gain = self.parts.dynamics.static_gain().abs();
        let (smallest, largest) = self.parts.slow_gain.map_or((1.0, 1.0), |slow| slow.gains());
        let (low, high) = between((low, high), (smallest, largest));
        between((low, high), (gain * (1.0 + crept).min(1.0), gain * (1.0 + crept).max(1.0)))
    }

    /// The positions that the stage reaches whatever happened before: every one between these two has a drive within
    /// [`drive_range`](Self::drive_range), after any history within it. None for a stage without a range of drives.
    ///
    /// They are the ends of the slow loop over that range: maps, hysteresis and the static gain of the modes, at the
    /// low end after a stroke to the high one and the other way round. So the remanence is outside, though a stage that
    /// was never driven begins there. A slow gain counts where it is worst. Creep and relaxing plays do so, too, at
    /// rest at the other end, but take no more than a quarter of the loop from either end. What modes overshoot and
    /// what a loop shift adds in motion do not count.
    ///
    /// With a Duhem operator, whose loops need not close, it is what 32 loops over the range reach; None if they drift
    /// so far that nothing is reached in all of them. Minor loops at an end may take more.
    #[must_use]
    pub fn position_range(&self) -> Option<(f64, f64)> {
        let (first, (from, to)) = (self.first_strokes()?, self.drive_range()?);
        let mut forward = self.rigid.forward();
        forward.step(to);
        let (mut low, mut high) = ordered((forward.step(from), forward.step(to)));
        for _ in 0..self.drifting_loops() {
            let (next_low, next_high) = ordered((forward.step(from), forward.step(to)));
            (low, high) = (low.max(next_low), high.min(next_high));
        }
        if low >= high {
            return None;
        }
        let (least, most) = self.relaxed();
        let relaxed = 0.5 * (least + most);
        let (low, high) = self.behind_slow_gain((low + relaxed, high + relaxed), f64::max, f64::min);
        let (middle, room) = self.crept(first);
        let room = (room + 0.5 * (most - least)).min(MOST_CREPT * (high - low));
        Some(self.behind_modes((low + middle + room, high + middle - room)))
    }

    /// The positions that the stage may come to by itself: where first strokes end, and what creep adds to them.
    fn widest_position_range(&self) -> Option<(f64, f64)> {
        let (low, high) = self.first_strokes()?;
        let (middle, room) = self.crept((low, high));
        Some(self.behind_modes((low + middle - room, high + middle + room)))
    }

    /// In front of creep: no history leads farther, but for minor loops with a Duhem operator.
    fn first_strokes(&self) -> Option<(f64, f64)> {
        let (from, to) = self.drive_range()?;
        let mut forward = self.rigid.forward();
        let (mut low, mut high) = ordered((forward.settle(from), forward.settle(to)));
        for _ in 0..self.drifting_loops() {
            let (next_low, next_high) = ordered((forward.step(from), forward.step(to)));
            (low, high) = (low.min(next_low), high.max(next_high));
        }
        let (least, most) = self.relaxed();
        Some(self.behind_slow_gain((low + least, high + most), f64::min, f64::max))
    }

    /// The least and the most that relaxing plays add within the range of drives.
    fn relaxed(&self) -> (f64, f64) {
        let plays = self.parts.relaxing_plays.as_ref().zip(self.drive_range());
        plays.map_or((0.0, 0.0), |(plays, drives)| plays.range(drives))
    }

    /// How many loops over the whole range are looked at: with a Duhem operator they need not close.
    fn drifting_loops(&self) -> usize {
        if self.parts.duhem.is_some() { LOOPS } else { 0 }
    }

    /// Two positions with the slow gain for which one is lowest or highest, and the other likewise.
    fn behind_slow_gain(
        &self,
        (low, high): (f64, f64),
        of_low: fn(f64, f64) -> f64,
        of_high: fn(f64, f64) -> f64,
    ) -> (f64, f64) {
        let Some(slow) = self.parts.slow_gain else { return (low, high) };
        let (one, other) = slow.gains();
        (of_low(slow.at(one, low), slow.at(other, low)), of_high(slow.at(one, high), slow.at(other, high)))
    }

    /// What creep adds after rest in the middle of these positions, and by how much more or less it may be.
    fn crept(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let amplitudes = || self.parts.creep.iter().flat_map(Creep::amplitudes);
        let (sum, size) = (amplitudes().sum::<f64>(), amplitudes().map(|amplitude| amplitude.abs()).sum::<f64>());
        (0.5 * (low + high) * sum, 0.5 * (high - low) * size)
    }

    fn behind_modes(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let gain = self.parts.dynamics.static_gain();
        ordered((gain * low, gain * high))
    }
}

fn ordered((one, other): (f64, f64)) -> (f64, f64) {
    (one.min(other), one.max(other))
}

/// What is wrong: the parameter, what was expected, what came.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Core(CoreError),
    /// A reference that begins elsewhere than the stage is, without a lead-in.
    Start {
        /// Where the stage is at the drive from which it starts, in the unit of the position.
        position: f64,
        /// That drive.
        drive: f64,
        /// Where the reference begins.
        got: f64,
    },
    /// A negative dead time, where something is to run sample by sample.
    NegativeDeadTime {
        /// The dead time in seconds.
        got: f64,
    },
    /// Parts with another lag than the one that was identified.
    Lag {
        /// The part that changes it.
        parameter: &'static str,
        /// The identified lag of amplifier, dynamics and dead time, in seconds.
        expected: f64,
        /// Their lag with this part.
        got: f64,
    },
    /// A stage whose position falls where the drive rises, under feedback.
    Falling,
    /// A stage without limits, where something would drive it.
    NoLimits,
    /// A stage without a noise of the sensor, where one is needed.
    NoNoise,
    /// A stage of which no error band is known, where one is asked for.
    NoBand,
    /// A file that is no stage.
    File {
        /// What is wrong with it.
        message: String,
    },
    /// Bytes that are not what they should be.
    Bytes {
        /// What was expected.
        expected: &'static str,
        /// What came.
        got: String,
    },
}

impl Error {
    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Core(error) => error.parameter(),
            Self::Start { .. } => Some("reference"),
            Self::Lag { parameter, .. } => Some(parameter),
            Self::NegativeDeadTime { .. } => Some("dead_time"),
            Self::Falling => Some("output_map"),
            Self::NoLimits => Some("limits"),
            Self::NoNoise => Some("noise"),
            Self::NoBand => Some("error_band"),
            Self::Bytes { .. } => Some("bytes"),
            Self::File { .. } => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Core(error) => error.fmt(f),
            Self::Start { position, drive, got } => write!(
                f,
                "reference[0]: expected the position of the stage at its start drive {drive:?}, which is {position:?}, got \
                 {got:?}: give `lead_in`, the seconds of a smooth way there, or `start`, the drive at which the stage rests"
            ),
            Self::NegativeDeadTime { got } => write!(
                f,
                "dead_time: expected 0 s or more, got {got:?}: the records pair each drive with a position that was read \
                 later; shift the positions down by one row and identify again"
            ),
            Self::Lag { parameter, expected, got } => write!(
                f,
                "{parameter}: expected amplifier, dynamics and dead time with the lag that was identified, {expected:.6} s in \
                 all, got {got:.6} s: the dead time of an identified stage holds the lag of all that was not fitted; change \
                 the dead time by as much the other way, or identify again with these dynamics"
            ),
            Self::Falling => write!(
                f,
                "output_map: expected a position that rises with the drive, got one that falls: the gains of a feedback are \
                 positive; reverse the sign of the drive or of the position"
            ),
            Self::NoLimits => write!(f, "limits: expected (low, high), got None, and the stage has none"),
            Self::NoNoise => write!(f, "noise: expected the rms noise of the sensor, got none: the stage states none"),
            Self::Bytes { expected, got } => write!(f, "bytes: expected {expected} as bytes, got {got}"),
            Self::NoBand => write!(
                f,
                "error_band: expected a stage that knows one, got none: it was not identified, or from places, or by a release that \
                 knew no bands, or parts were changed since; identify it from records of a sensor"
            ),
            Self::File { message } => write!(f, "not a stage file: {message}"),
        }
    }
}

impl core::error::Error for Error {}

impl From<CoreError> for Error {
    fn from(error: CoreError) -> Self {
        Self::Core(error)
    }
}
