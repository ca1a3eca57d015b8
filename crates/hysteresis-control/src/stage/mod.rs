//! A whole stage in one object: what the user has on the bench.
//!
//! ```text
//! limits, D/A -> dead time -> amplifier -> input map -> hysteresis -> output map -> loop shift -> creep -> modes -> sensor
//! ```
//!
//! Everything that runs is made from a [`Stage`]: its [forward model](Stage::forward), the exact
//! [inverse](Stage::inverse) of its slow part, the [drive for a reference](Stage::precompensate), controllers, observers
//! and learning. So parameters, limits and times are stated once.
//!
//! # Time
//! Times are in seconds, frequencies in Hz. The drive u(k) is put out at t_k = k dt and held until t_(k+1). The position
//! y(k) of the same row is read at t_k. The **dead time** is what the sensor shows later than hysteresis and modes
//! explain:
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

mod changed;
mod design;
mod error;
pub(crate) mod file;
mod forward;
mod identified;
mod loop_shift;
mod precompensate;
mod ranges;
mod uncertainty;

pub use design::{FeedForwardKind, PEAK_SENSITIVITY};
pub use error::Error;
pub use file::{SCHEMA, read_file};
pub use forward::{StageForward, StageState};
pub use identified::{Identified, RecordSource, StageWarning, Units};
pub use loop_shift::LoopShift;
pub use precompensate::{PrecompensateOptions, Precompensated};

use hysteresis_core::{
    Bound, Bracket, CompiledModel, CreepTerms, Error as CoreError, MAX_MAGNITUDE, ModifiedPrandtlIshlinskii,
    PiecewiseLinearMap, QuasiStatic, QuasiStaticInverse, is_admissible,
};

use crate::linear::{Creep, FirstOrder, LinearDynamics};

/// The parts of a stage, each of which may be missing but for the hysteresis.
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
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StageParts {
    /// The hysteresis H.
    pub hysteresis: ModifiedPrandtlIshlinskii,
    /// The map gamma in front of the hysteresis.
    pub input_map: Option<PiecewiseLinearMap>,
    /// The map phi behind the hysteresis.
    pub output_map: Option<PiecewiseLinearMap>,
    /// The lag of the amplifier, in front of the hysteresis.
    pub amplifier: Option<FirstOrder>,
    /// What motion of the drive adds behind the output map.
    pub loop_shift: Option<LoopShift>,
    /// Creep behind output map and loop shift.
    pub creep: Option<Creep>,
    /// Modes and lags behind the hysteresis; their dead time must be 0.
    pub dynamics: LinearDynamics,
    /// What the sensor shows later than hysteresis and modes explain, in seconds. An identified stage may have a negative
    /// one, if its records pair a drive with a position that was read later.
    pub dead_time: f64,
    /// The drive never leaves (low, high).
    pub limits: Option<(f64, f64)>,
    /// How fast the drive may change, per second.
    pub slew: Option<f64>,
    /// Rms noise of the sensor, in the unit of the position.
    pub noise: Option<f64>,
    /// What identification knows of the stage.
    pub identified: Option<Identified>,
    /// The units of drive and position.
    pub units: Units,
}

impl StageParts {
    /// Hysteresis alone.
    #[must_use]
    pub fn new(hysteresis: ModifiedPrandtlIshlinskii) -> Self {
        Self {
            hysteresis,
            input_map: None,
            output_map: None,
            amplifier: None,
            loop_shift: None,
            creep: None,
            dynamics: LinearDynamics::none(),
            dead_time: 0.0,
            limits: None,
            slew: None,
            noise: None,
            identified: None,
            units: Units::default(),
        }
    }
}

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
    /// gamma, H and phi, without loop shift and creep.
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
    /// [`Error`] that names the part: dynamics with a dead time of their own, a dead time that is not finite, limits that
    /// are not finite with low < high, a slew that is not above 0, a noise below 0.
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

    /// Whether [`drive_range`](Self::drive_range) is what was identified, as the limits reach beyond it or there are none.
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

    /// gamma, H, phi, loop shift and creep, sampled: the stage without its fast dynamics.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0.
    pub fn quasi_static(&self, dt: f64) -> Result<QuasiStatic, Error> {
        crate::linear::check_positive("dt", None, dt)?;
        let mut sampled = self.rigid.clone();
        if let Some(shift) = &self.parts.loop_shift {
            sampled = sampled.with_loop_shift(shift.terms(dt)?);
        }
        if let Some(creep) = &self.parts.creep {
            let decays: Vec<f64> = creep.time_constants().iter().map(|tau| (-dt / tau).exp()).collect();
            sampled = sampled.with_creep(CreepTerms::new(creep.amplitudes(), &decays)?);
        }
        Ok(sampled)
    }

    /// The whole chain without the converters, sample by sample, at rest at [`rest_drive`](Self::rest_drive).
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0, and no part of the dynamics is too fast or too slow for it.
    pub fn forward(&self, dt: f64) -> Result<StageForward, Error> {
        StageForward::new(self, dt)
    }

    /// The exact inverse of maps, hysteresis, loop shift and creep, sample by sample, at rest at
    /// [`rest_drive`](Self::rest_drive).
    ///
    /// Modes, amplifier and dead time are not part of it: [`precompensate`](Self::precompensate) leads through those.
    ///
    /// # Errors
    /// [`Error`] as for [`limits`](Self::limits), unless `dt` is finite and above 0, and for hysteresis without an inverse.
    pub fn inverse(&self, dt: f64, limits: Option<(f64, f64)>) -> Result<QuasiStaticInverse, Error> {
        let limits = self.limits(limits)?;
        let mut inverse = self.quasi_static(dt)?.inverse(limits)?;
        inverse.settle(rest_drive(limits));
        Ok(inverse)
    }

    /// Where the position must lie when nothing is known of the history but its limits: two streams through maps and hysteresis.
    /// Loop shift, creep and modes are left out.
    ///
    /// # Errors
    /// [`Error`] for a model with a negative weight, or without limits.
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
