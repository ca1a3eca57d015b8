//! A model in the form that evaluates it.

use alloc::sync::Arc;

use super::bank::Members;
use super::engine_changes::NestedModel;
use crate::error::Error;
use crate::model::{ModifiedPrandtlIshlinskii, Offsets};

/// Which algorithm evaluates a stream.
///
/// Both give the same outputs, to 1e-12 of the range. Streams of nested thresholds take turning points unless they are asked for
/// the other one by [`Forward::with_method`](crate::Forward::with_method). Either takes the saved states of the other.
///
/// ```
/// use hysteresis_core::{CompiledModel, Forward, Method, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let compiled = CompiledModel::new(&model);
/// assert_eq!(Forward::new(&compiled).method(), Method::TurningPoints);
/// assert_eq!(Forward::with_initial(&compiled, &[0.1; 3])?.method(), Method::Bank);
/// let (mut one, mut other) = (Forward::new(&compiled), Forward::with_method(&compiled, Method::Bank)?);
/// assert!((one.step(400.0) - other.step(400.0)).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Turning points and prefix sums: the cost does not grow with the number of operators, and hardly anything is left of it on a
    /// smooth drive.
    TurningPoints,
    /// All operators at once: thresholds that are not nested, arbitrary initial outputs, or few operators along a drive that jumps. A
    /// sample on the line that is drawn after small moves costs as little as with turning points; any other takes one pass over all
    /// operators, whatever the drive does. The feature `simd` makes it faster on x86-64-v3 and with AVX-512, and changes no bit.
    Bank,
}

/// A model in the form that evaluates it, shared by all streams of the model.
///
/// Made once per model; [`Forward::new`](crate::Forward::new) and [`Inverse::new`](crate::Inverse::new) then only
/// allocate the memory of one stream. Cloning shares.
///
/// ```
/// use hysteresis_core::{CompiledModel, Forward, Inverse, Method, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let compiled = CompiledModel::new(&model);
/// assert_eq!(compiled.method(), Method::TurningPoints);
/// let (mut actuator, mut inverse) = (Forward::new(&compiled), Inverse::new(&compiled, None)?);
/// assert!((actuator.step(inverse.step(1.5)) - 1.5).abs() < 1e-14); // um
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CompiledModel {
    pub(crate) offsets: Offsets,
    pub(crate) invertible: Result<(), Error>,
    slopes: (f64, f64),
    fingerprint: u64,
    min_weight: f64,
    pub(super) nested: Result<Arc<NestedModel>, Error>,
    pub(super) members: Arc<Members>,
}

impl CompiledModel {
    /// Sorts the thresholds and sums the weights: O(n log n).
    #[must_use]
    pub fn new(model: &ModifiedPrandtlIshlinskii) -> Self {
        let members = Arc::new(Members::of(model));
        Self {
            offsets: model.offsets(),
            invertible: model.check_invertible(),
            slopes: model.slope_range(),
            fingerprint: model.fingerprint(),
            min_weight: model.members().fold(f64::INFINITY, |least, (w, v, _)| least.min(w).min(v)),
            nested: NestedModel::of(&members).map(Arc::new),
            members,
        }
    }

    /// Which algorithm evaluates a stream that starts at rest.
    #[must_use]
    pub fn method(&self) -> Method {
        if self.nested.is_ok() { Method::TurningPoints } else { Method::Bank }
    }

    /// The number of operators.
    #[must_use]
    pub fn operators(&self) -> usize {
        self.members.len()
    }

    /// The least and the greatest slope of the model:
    /// [`ModifiedPrandtlIshlinskii::slope_range`].
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        self.slopes
    }

    /// A number that tells this model from others, by the values of its parameters: equal models have equal numbers.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// A negative weight, if there is one.
    pub(crate) fn negative_weight(&self) -> Option<f64> {
        (self.min_weight < 0.0).then_some(self.min_weight)
    }
}
