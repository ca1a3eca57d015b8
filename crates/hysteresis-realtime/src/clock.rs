//! The clock of a loop: the real one, and a simulated one for tests.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A clock that counts nanoseconds from a moment of its own, and never goes back.
pub trait Clock {
    /// Now, in nanoseconds.
    fn now(&self) -> u64;

    /// Returns at `deadline` or later; at once if it has passed.
    fn sleep_until(&mut self, deadline: u64);

    /// As [`sleep_until`](Self::sleep_until), awake: nothing has to be woken, but a processor is kept busy.
    fn spin_until(&mut self, deadline: u64);
}

/// The monotonic clock of the machine.
///
/// On Linux it sleeps by `clock_nanosleep` with an absolute deadline, so the time between reading the clock and going
/// to sleep is no error. Elsewhere it sleeps for the time that is left.
///
/// ```
/// use hysteresis_realtime::clock::{Clock, RealClock};
/// let mut clock = RealClock;
/// let deadline = clock.now() + 1_000_000;
/// clock.sleep_until(deadline);
/// assert!(clock.now() >= deadline);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct RealClock;

/// Whether this platform can sleep until an absolute deadline.
pub const ABSOLUTE_DEADLINES: bool = cfg!(target_os = "linux");

impl Clock for RealClock {
    #[inline]
    fn now(&self) -> u64 {
        system::now()
    }

    fn sleep_until(&mut self, deadline: u64) {
        system::sleep(deadline);
        // A sleep that was refused, or whose clock is coarser.
        self.spin_until(deadline);
    }

    fn spin_until(&mut self, deadline: u64) {
        while self.now() < deadline {
            core::hint::spin_loop();
        }
    }
}

#[cfg(target_os = "linux")]
mod system {
    use rustix::thread::{ClockId, Timespec, clock_nanosleep_absolute};
    use rustix::time::clock_gettime;

    /// Nanoseconds since the machine started.
    #[expect(clippy::cast_sign_loss, reason = "the time since the start is not negative")]
    pub(crate) fn now() -> u64 {
        let now = clock_gettime(ClockId::Monotonic);
        now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
    }

    #[expect(clippy::cast_possible_wrap, reason = "292 years since the start")]
    pub(crate) fn sleep(until: u64) {
        let request = Timespec { tv_sec: (until / 1_000_000_000) as _, tv_nsec: (until % 1_000_000_000) as _ };
        while now() < until {
            // A signal only interrupts it.
            if clock_nanosleep_absolute(ClockId::Monotonic, &request) != Err(rustix::io::Errno::INTR) {
                break;
            }
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::sync::OnceLock;
    use std::time::{Duration, Instant};

    /// Nanoseconds since the first call.
    pub(crate) fn now() -> u64 {
        static START: OnceLock<Instant> = OnceLock::new();
        u64::try_from(START.get_or_init(Instant::now).elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    pub(crate) fn sleep(until: u64) {
        std::thread::sleep(Duration::from_nanos(until.saturating_sub(now())));
    }
}

/// A clock that moves only when it is told to, or when it is asked to sleep. Its clones are the same clock.
///
/// ```
/// use hysteresis_realtime::clock::{Clock, SimulatedClock};
/// let mut clock = SimulatedClock::waking_late(|deadline| if deadline == 300 { 50 } else { 0 });
/// clock.sleep_until(100);
/// clock.pass(20);
/// assert_eq!(clock.now(), 120);
/// clock.sleep_until(300);
/// assert_eq!(clock.now(), 350);
/// ```
#[derive(Clone)]
pub struct SimulatedClock {
    now: Arc<AtomicU64>,
    late: Arc<dyn Fn(u64) -> u64 + Send + Sync>,
}

impl SimulatedClock {
    /// A clock on which every sleep ends when it should.
    #[must_use]
    pub fn new() -> Self {
        Self::waking_late(|_| 0)
    }

    /// A clock on which the sleep until a deadline ends `late(deadline)` nanoseconds after it.
    pub fn waking_late(late: impl Fn(u64) -> u64 + Send + Sync + 'static) -> Self {
        Self { now: Arc::default(), late: Arc::new(late) }
    }

    /// Lets time pass, in nanoseconds: what an input, an output or a computation takes.
    pub fn pass(&self, time: u64) {
        self.now.fetch_add(time, Ordering::Relaxed);
    }
}

impl Default for SimulatedClock {
    fn default() -> Self {
        Self::new()
    }
}

impl core::fmt::Debug for SimulatedClock {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SimulatedClock").field("now", &self.now).finish_non_exhaustive()
    }
}

impl Clock for SimulatedClock {
    fn now(&self) -> u64 {
        self.now.load(Ordering::Relaxed)
    }

    fn sleep_until(&mut self, deadline: u64) {
        if deadline > self.now() {
            self.now.store(deadline + (self.late)(deadline), Ordering::Relaxed);
        }
    }

    fn spin_until(&mut self, deadline: u64) {
        self.now.fetch_max(deadline, Ordering::Relaxed);
    }
}
