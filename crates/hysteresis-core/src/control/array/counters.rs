//! What was unusual.

/// How many samples, or drives, of an [`ArrayController`](super::ArrayController) were unusual.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayCounters, ArrayOptions, ArraySample, CompiledModel, Offsets};
/// use hysteresis_core::{PrandtlIshlinskii, StreamArray};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let models = [CompiledModel::new(&(&model).into()), CompiledModel::new(&(&model).into())];
/// let inverse = StreamArray::inverse(&models, Some((-10.0, 10.0))).map_err(|wrong| wrong.error)?;
/// let mut controller = ArrayController::new(inverse, &ArrayOptions::new(1e-3))?;
/// controller.step(&ArraySample::of(&[f64::NAN, 1.0]), &mut [0.0; 2])?;
/// assert_eq!(controller.counters(), ArrayCounters { rejected_count: 1, ..ArrayCounters::default() });
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ArrayCounters {
    /// Samples with a reference that is not finite (or beyond 1e100): all drives were held.
    pub rejected_count: u64,
    /// Samples with a measurement that is not finite (or beyond 1e100).
    pub missing_count: u64,
    /// Drives that a target out of reach brought to a limit.
    pub saturated_count: u64,
    /// Drives that the slew held back.
    pub slewing_count: u64,
    /// Samples in which the limits of differences moved at least one target.
    pub pair_limited_count: u64,
}

/// Counts events, never past the largest number.
#[inline]
pub(super) fn count(counter: &mut u64, events: u64) {
    *counter = counter.saturating_add(events);
}
