//! What a controller has in place of a preview, and of the sources of its feed-forward that allocate, where nothing
//! may.

use super::source::{DriveSource, View};
use crate::error::Error;

/// Feedback alone, or volts that come with every sample. An inverse that needs no allocator is a source by itself:
/// [`with_source`](super::HybridController::with_source).
#[derive(Clone, Copy, Debug)]
pub enum FeedForward {
    /// Feedback alone: 0 V.
    None,
    /// Volts that come with every [`Command`](super::Command); a sample without them is rejected.
    Given,
}

impl DriveSource for FeedForward {
    #[inline]
    fn step(&mut self, _target: f64) -> f64 {
        0.0
    }

    #[inline]
    fn peek(&self, _target: f64) -> f64 {
        0.0
    }

    #[inline]
    fn wait(&mut self) {}

    #[inline]
    fn follow_drive(&mut self, _drive: f64) {}

    fn follow(&mut self, _drives: &[f64]) -> Result<(), Error> {
        Ok(())
    }

    fn check_limits(&self, _expected: (f64, f64)) -> Result<(), Error> {
        Ok(())
    }

    fn is_given(&self) -> bool {
        matches!(self, Self::Given)
    }

    fn reset(&mut self) {}
}

/// A preview needs the feature `alloc`: without it there is none.
#[derive(Clone, Debug)]
pub enum Preview {}

impl Preview {
    pub(super) fn samples_until_full(&self) -> Option<f64> {
        match *self {}
    }

    pub(super) fn look(&self, _newest: f64) -> View {
        match *self {}
    }

    pub(super) fn push(&mut self, _newest: f64) {
        match *self {}
    }

    pub(super) fn restart(&mut self) {
        match *self {}
    }
}
