//! A stage without its fast dynamics: y = creep(phi(H\[gamma(u)\]) + s), sample by sample, and its exact inverse.
//!
//! gamma and phi are strictly monotone piecewise-linear maps, H is the hysteresis, s is the loop shift that past drives
//! have caused, and creep adds slow first-order lags. Each part may be missing.

mod bracket;
mod bracket_array;
mod creep;
mod forward;
mod inverse;
mod loop_shift;
mod map;

pub use bracket::{Bracket, BracketState};
pub use bracket_array::BracketArray;
pub use creep::CreepTerms;
pub use forward::QuasiStaticForward;
pub use inverse::QuasiStaticInverse;
pub use loop_shift::LoopShiftTerms;
use map::MapPiece;
pub use map::PiecewiseLinearMap;

use alloc::sync::Arc;
use alloc::vec::Vec;

use crate::engine::CompiledModel;
use crate::error::Error;
use crate::fingerprint::Fingerprint;
use crate::stream::StreamState;

/// The parameters of a stage without its fast dynamics, ready to run: y = creep(phi(H\[gamma(u)\]) + s).
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
    hysteresis: CompiledModel,
    input_map: Option<Arc<PiecewiseLinearMap>>,
    output_map: Option<Arc<PiecewiseLinearMap>>,
    loop_shift: Option<LoopShiftTerms>,
    creep: Option<Arc<CreepTerms>>,
}

impl QuasiStatic {
    /// Hysteresis alone.
    #[must_use]
    pub fn new(hysteresis: &CompiledModel) -> Self {
        Self { hysteresis: hysteresis.clone(), input_map: None, output_map: None, loop_shift: None, creep: None }
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

    /// The same with creep behind output map and loop shift.
    #[must_use]
    pub fn with_creep(mut self, creep: CreepTerms) -> Self {
        self.creep = Some(Arc::new(creep));
        self
    }

    /// The same without creep.
    #[must_use]
    pub fn without_creep(&self) -> Self {
        Self { creep: None, ..self.clone() }
    }

    /// The same without loop shift.
    #[must_use]
    pub fn without_loop_shift(&self) -> Self {
        Self { loop_shift: None, ..self.clone() }
    }

    /// A stream from drives to positions, at rest at the input offset of the hysteresis.
    #[must_use]
    pub fn forward(&self) -> QuasiStaticForward {
        QuasiStaticForward::new(self)
    }

    /// A stream from positions to drives, at rest at the input offset of the hysteresis, or at the limit nearest to it.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the hysteresis may not be, [`Error::Domain`] unless limits are finite and low < high.
    pub fn inverse(&self, limits: Option<(f64, f64)>) -> Result<QuasiStaticInverse, Error> {
        QuasiStaticInverse::new(self, limits)
    }

    /// The compiled hysteresis.
    #[must_use]
    pub fn hysteresis(&self) -> &CompiledModel {
        &self.hysteresis
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
        hash.finish()
    }
}

/// Everything that a [`QuasiStaticForward`] or [`QuasiStaticInverse`] remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct QuasiStaticState {
    /// The fingerprint of maps, hysteresis, loop shift and creep: [`QuasiStatic::fingerprint`].
    pub model: u64,
    /// What the hysteresis remembers.
    pub hysteresis: StreamState,
    /// What each creep term has crept, c_j q_j, in the unit of the position.
    pub creep: Vec<f64>,
    /// What the loop shift remembers, m, n and f of [`LoopShiftTerms`]; empty without one, and in older states.
    #[cfg_attr(feature = "serde", serde(default))]
    pub loop_shift: Vec<f64>,
    /// The last output: position (forward) or drive (inverse).
    pub last_output: f64,
    /// How many inputs were rejected.
    pub rejected: u64,
}

/// What a map makes of x, from the line on which the stream was; without a map x itself.
#[inline]
fn mapped(map: Option<&Arc<PiecewiseLinearMap>>, x: f64, on: &mut MapPiece) -> f64 {
    if !on.holds(x) {
        change_piece(map, on, |map| map.piece_at(x));
    }
    on.at(x)
}

/// What a map makes y of, from the line on which the stream was; without a map y itself.
#[inline]
fn unmapped(map: Option<&Arc<PiecewiseLinearMap>>, y: f64, on: &mut MapPiece) -> f64 {
    if !on.holds(y) {
        change_piece(map, on, |map| map.inverse_piece_at(y));
    }
    on.at(y)
}

#[cold]
#[inline(never)]
fn change_piece(
    map: Option<&Arc<PiecewiseLinearMap>>,
    on: &mut MapPiece,
    found: impl FnOnce(&PiecewiseLinearMap) -> MapPiece,
) {
    if let Some(map) = map {
        *on = found(map);
    }
}

/// The line of a map at a point, to start from.
fn first_piece(map: Option<&Arc<PiecewiseLinearMap>>) -> MapPiece {
    map.map_or_else(MapPiece::identity, |map| map.piece_at(0.0))
}

fn first_inverse_piece(map: Option<&Arc<PiecewiseLinearMap>>) -> MapPiece {
    map.map_or_else(MapPiece::identity, |map| map.inverse_piece_at(0.0))
}
