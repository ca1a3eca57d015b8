//! What makes maps doubtful.

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::maps::{MUST_GAIN, UntoldMap};

/// What would explain less of the range than this, rms, is not told.
const MATTERS: f64 = 2e-3;

/// A map that the records do not tell from a loop shift.
pub(crate) fn untold_map(UntoldMap { is_input, gain, share }: UntoldMap) -> Option<Finding> {
    let (name, option, place) = if is_input {
        ("input_map", "--input-map", "in front of the hysteresis")
    } else {
        ("output_map", "--output-map", "behind the hysteresis")
    };
    let message = format!(
        "a map {place} would lower the error of prediction by {:.0} %, and so would a loop shift: loops that only decay do not tell one \
         from the other, and the result has neither",
        100.0 * (1.0 - gain.recip().sqrt())
    );
    let hint = format!(
        "add a record whose loops grow again, as those of mpi-hyst excite; or ask for the map ({option} smooth, {name}=\"smooth\" in \
         Python), and compare on a record that was not fitted"
    );
    (share > MATTERS).then(|| Finding::new(FindingCode::MapNotTold, gain, MUST_GAIN, message).try_next(hint))
}
