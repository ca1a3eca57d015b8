//! The parameters of a stage without its fast dynamics.

use alloc::sync::Arc;

use super::creep::CreepTerms;
use super::loop_shift::LoopShiftTerms;
use super::map::PiecewiseLinearMap;
use super::relaxing_plays::RelaxingPlayTerms;
use super::slow_gain::SlowGainTerms;
use crate::duhem::Duhem;
use crate::engine::CompiledModel;
use crate::fingerprint::Fingerprint;

/// The most knots of a Duhem operator that stands beside the hysteresis of a stage.
pub const MAX_KNOTS: usize = 17;

/// The parameters of a stage without its fast dynamics, ready to run: y = creep(g(phi(H\[x\] + z\[x\]) + s)), x =
/// gamma(u).
///
/// Drives u are in the unit of gamma's input, positions y in the unit of phi's output. Cloning shares the large parts.
///
/// ```
/// use hysteresis_core::{CreepTerms, CompiledModel, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap};
/// use hysteresis_core::{Process, QuasiStatic, Ratios};
/// let (w, r) = ([0.5, 0.1, 0.05], [0.0, 20.0, 60.0]);
/// let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PLAY, Offsets::default())?;
/// let stage = QuasiStatic::new(&CompiledModel::new(&hysteresis))
///     .with_output_map(PiecewiseLinearMap::new(&[0.0, 40.0, 80.0], &[0.0, 42.0, 80.0])?)
///     .with_creep(CreepTerms::new(&[0.004; 3], &[0.9, 0.99, 0.999])?);
/// let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((-20.0, 150.0)))?);
/// for k in 0..1000 {
///     let target = f64::from((k * 7) % 60);
///     assert!((forward.step(inverse.step(target)) - target).abs() < 1e-11);
/// }
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct QuasiStatic {
    pub(super) hysteresis: CompiledModel,
    pub(super) duhem: Option<Arc<Duhem<MAX_KNOTS>>>,
    pub(super) input_map: Option<Arc<PiecewiseLinearMap>>,
    pub(super) output_map: Option<Arc<PiecewiseLinearMap>>,
    pub(super) loop_shift: Option<LoopShiftTerms>,
    pub(super) relaxing_plays: Option<Arc<RelaxingPlayTerms>>,
    pub(super) slow_gain: Option<SlowGainTerms>,
    pub(super) creep: Option<Arc<CreepTerms>>,
}

impl QuasiStatic {
    /// Hysteresis alone.
    #[must_use]
    pub fn new(hysteresis: &CompiledModel) -> Self {
        Self {
            hysteresis: hysteresis.clone(),
            duhem: None,
            input_map: None,
            output_map: None,
            loop_shift: None,
            relaxing_plays: None,
            slow_gain: None,
            creep: None,
        }
    }

    /// The same with a Duhem operator beside the hysteresis: what it puts out is added, in front of the output map.
    ///
    /// Its x is what the hysteresis is shown; z is 0 where the hysteresis has its input offset.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Duhem, Offsets, PrandtlIshlinskii, Process, QuasiStatic};
    /// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
    /// let duhem = Duhem::from_bouc_wen(1.0, 0.5, 0.5, 0.5)?;
    /// let stage = QuasiStatic::new(&CompiledModel::new(&(&linear).into())).with_duhem(duhem);
    /// let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((-20.0, 20.0)))?);
    /// let up = forward.step(2.0);
    /// assert!((up - (4.0 + 2.0 * (1.0 - f64::exp(-1.0)))).abs() < 1e-14);
    /// forward.reset();
    /// for target in [10.0, 4.0, 12.0] {
    ///     assert!((forward.step(inverse.step(target)) - target).abs() < 1e-13);
    /// }
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn with_duhem(mut self, duhem: Duhem<MAX_KNOTS>) -> Self {
        self.duhem = Some(Arc::new(duhem));
        self
    }

    /// The same with the map gamma in front of the hysteresis.
    #[must_use]
    pub fn with_input_map(mut self, map: PiecewiseLinearMap) -> Self {
        self.input_map = Some(Arc::new(map));
        self
    }

    /// The same with the map phi behind the hysteresis.
    #[must_use]
    pub fn with_output_map(mut self, map: PiecewiseLinearMap) -> Self {
        self.output_map = Some(Arc::new(map));
        self
    }

    /// The same with a loop shift behind the output map, in front of the creep.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, LoopShiftTerms, Offsets, PrandtlIshlinskii, Process, QuasiStatic};
    /// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
    /// let shift = LoopShiftTerms::new(0.0, 10.0, [-3.0, 0.0], 0.5, 0.9)?;
    /// let stage = QuasiStatic::new(&CompiledModel::new(&(&linear).into())).with_loop_shift(shift);
    /// let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((-20.0, 20.0)))?);
    /// assert_eq!(forward.step(5.0), 10.0);
    /// assert!(forward.step(5.0) < 10.0); // the move to 5 V has shifted the loop
    /// forward.reset();
    /// for target in [10.0, 4.0, 12.0] {
    ///     assert!((forward.step(inverse.step(target)) - target).abs() < 1e-13);
    /// }
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn with_loop_shift(mut self, shift: LoopShiftTerms) -> Self {
        self.loop_shift = Some(shift);
        self
    }

    /// The same with plays that relax, behind the output map, beside the loop shift.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Offsets, PrandtlIshlinskii, Process, QuasiStatic, RelaxingPlayTerms};
    /// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
    /// let plays = RelaxingPlayTerms::new(&[1.0], 0.0, &[0.5], &[vec![0.5]])?;
    /// let stage = QuasiStatic::new(&CompiledModel::new(&(&linear).into())).with_relaxing_plays(plays);
    /// let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((-20.0, 20.0)))?);
    /// assert_eq!(forward.step(5.0), 10.0);
    /// assert_eq!(forward.step(5.0), 11.0); // half of 0.5 (5 - 1) has relaxed
    /// forward.reset();
    /// for target in [10.0, 4.0, 12.0] {
    ///     assert!((forward.step(inverse.step(target)) - target).abs() < 1e-13);
    /// }
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn with_relaxing_plays(mut self, plays: RelaxingPlayTerms) -> Self {
        self.relaxing_plays = Some(Arc::new(plays));
        self
    }

    /// The same with a slow gain behind output map, loop shift and relaxing plays, in front of the creep.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Offsets, PrandtlIshlinskii, Process, QuasiStatic, SlowGainTerms};
    /// let linear = PrandtlIshlinskii::new(&[2.0], &[0.0], Offsets::default())?;
    /// let gain = SlowGainTerms::new(5.0, -0.1, 0.0, 0.9)?;
    /// let stage = QuasiStatic::new(&CompiledModel::new(&(&linear).into())).with_slow_gain(gain);
    /// let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((-20.0, 20.0)))?);
    /// assert_eq!(forward.step(5.0), 10.0);
    /// assert!(forward.step(5.0) < 10.0); // the move to 5 V has made the gain smaller
    /// forward.reset();
    /// for target in [10.0, 4.0, 12.0] {
    ///     assert!((forward.step(inverse.step(target)) - target).abs() < 1e-13);
    /// }
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn with_slow_gain(mut self, gain: SlowGainTerms) -> Self {
        self.slow_gain = Some(gain);
        self
    }

    /// The same with creep behind output map, loop shift and slow gain.
    #[must_use]
    pub fn with_creep(mut self, creep: CreepTerms) -> Self {
        self.creep = Some(Arc::new(creep));
        self
    }

    /// The same with maps, hysteresis and Duhem operator alone: what follows the drive at once.
    #[must_use]
    pub fn at_once(&self) -> Self {
        Self { loop_shift: None, relaxing_plays: None, slow_gain: None, creep: None, ..self.clone() }
    }

    /// The compiled hysteresis.
    #[must_use]
    pub fn hysteresis(&self) -> &CompiledModel {
        &self.hysteresis
    }

    /// The Duhem operator beside the hysteresis, if there is one.
    #[must_use]
    pub fn duhem(&self) -> Option<&Duhem<MAX_KNOTS>> {
        self.duhem.as_deref()
    }

    /// A number that tells this model from others: equal parameters give equal numbers.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let mut hash = Fingerprint::continued(self.hysteresis.fingerprint());
        for map in [&self.input_map, &self.output_map] {
            hash.count(map.as_ref().map_or(0, |map| map.points().count()));
            map.iter().flat_map(|map| map.points()).for_each(|(x, y)| hash.numbers(&[x, y]));
        }
        if let Some(creep) = &self.creep {
            hash.numbers(creep.amplitudes());
            hash.numbers(creep.decays());
        }
        if let Some(shift) = &self.loop_shift {
            hash.numbers(&shift.numbers());
        }
        if let Some(plays) = &self.relaxing_plays {
            hash.count(plays.thresholds().len());
            plays.numbers().for_each(|number| hash.numbers(&[number]));
        }
        if let Some(gain) = &self.slow_gain {
            hash.numbers(&gain.numbers());
        }
        if let Some(duhem) = &self.duhem {
            duhem.take_in(&mut hash);
        }
        hash.finish()
    }
}
