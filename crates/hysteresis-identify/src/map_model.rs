//! Which map to fit in front of the hysteresis or behind it.

/// A map of the drive in front of the hysteresis, or of the position behind it.
///
/// A map that is fitted is smooth and rises: the logarithm of its slope is a cubic over the range of the records.
///
/// ```
/// use hysteresis_identify::{MapModel, Options};
/// let options = Options { output_map: MapModel::Smooth, ..Options::default() };
/// assert_ne!(options.output_map, options.input_map);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MapModel {
    /// None.
    None,
    /// A smooth one if cross-validation over stretches of the records asks for it; none without a sampling interval or for the
    /// conventional model. Where both maps are left open, the second one must lower the error further. Loops that only decay must
    /// say more for a map than for a loop shift, which is told as [`MapNotTold`](crate::FindingCode::MapNotTold) if they do not.
    #[default]
    Auto,
    /// A smooth one.
    Smooth,
}
