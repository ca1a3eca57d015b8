//! What is measured.

/// Some samples in one call, so that the call itself does not count.
pub(crate) trait Pass {
    /// How many samples a pass takes.
    fn samples(&self) -> usize;
    /// Takes them.
    fn pass(&mut self);
}
