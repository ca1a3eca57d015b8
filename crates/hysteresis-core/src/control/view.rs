//! What a preview, or its absence, gives a sample.

/// What the window of a preview shows; without one, the newest reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) reference: f64,
    pub(super) target: f64,
    /// Whether the window is full with this reference, for the first time.
    pub(super) filled: bool,
}
