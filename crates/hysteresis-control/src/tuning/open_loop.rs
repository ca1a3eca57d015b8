//! What is between the error and the position, but for gains and slope.

use hysteresis_core::Sections;
use nalgebra::Complex;

use crate::filters::response;
use crate::linear::PulseTransfer;

/// The filters of the feedback, and the dynamics behind the hysteresis.
#[derive(Clone, Debug)]
pub(super) struct OpenLoop {
    pub(super) filters: Sections,
    pub(super) transfer: PulseTransfer,
}

impl OpenLoop {
    pub(super) fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let plant = self.transfer.at(z);
        // Without filters every bit is that of the plant.
        if self.filters.as_slice().is_empty() { plant } else { plant * response(self.filters.as_slice(), z) }
    }
}
