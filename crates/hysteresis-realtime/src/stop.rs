//! How a running loop is asked to end, and what it shows of itself.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Asks a loop to go to rest and end. Clones are the same flag.
///
/// ```
/// use hysteresis_realtime::StopFlag;
/// let flag = StopFlag::default();
/// let same = flag.clone();
/// same.request();
/// assert!(flag.is_requested());
/// ```
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// Asks the loop to go to rest. It cannot be taken back.
    pub fn request(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether the loop was asked.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }

    /// The flag itself, for a handler of signals.
    #[must_use]
    pub fn shared(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }
}

/// What a loop shows while it runs. Each number is that of some recent sample; they need not belong to the same one.
#[derive(Debug, Default)]
pub struct Live {
    taken: AtomicU64,
    missed: AtomicU64,
    skipped: AtomicU64,
    stale: AtomicU64,
    measurement: AtomicU64,
    drive: AtomicU64,
}

impl Live {
    /// Samples taken.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// Deadlines missed.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// Deadlines at which no sample was taken.
    #[must_use]
    pub fn skipped(&self) -> u64 {
        self.skipped.load(Ordering::Relaxed)
    }

    /// Samples without a measurement.
    #[must_use]
    pub fn stale(&self) -> u64 {
        self.stale.load(Ordering::Relaxed)
    }

    /// The last measurement.
    #[must_use]
    pub fn measurement(&self) -> f64 {
        f64::from_bits(self.measurement.load(Ordering::Relaxed))
    }

    /// The present drive.
    #[must_use]
    pub fn drive(&self) -> f64 {
        f64::from_bits(self.drive.load(Ordering::Relaxed))
    }

    #[inline]
    pub(crate) fn show_sample(&self, measurement: f64, drive: f64, stale: u64) {
        self.measurement.store(measurement.to_bits(), Ordering::Relaxed);
        self.drive.store(drive.to_bits(), Ordering::Relaxed);
        self.stale.store(stale, Ordering::Relaxed);
    }

    #[inline]
    pub(crate) fn show_deadlines(&self, deadlines: &crate::policy::Deadlines) {
        self.taken.store(deadlines.taken, Ordering::Relaxed);
        self.missed.store(deadlines.missed, Ordering::Relaxed);
        self.skipped.store(deadlines.skipped, Ordering::Relaxed);
    }
}
