//! Where measurements come from, and drives go.

mod function;
mod shared_memory;
mod simulated;
mod udp;

use core::fmt;

pub use function::{FunctionIo, ReadFunction, WriteFunction};
pub use shared_memory::{Block, SharedMemoryIo, SharedMemoryPlant};
pub use udp::{PACKET, Packet, UdpCounts, UdpIo};

/// What a loop reads from and writes to.
///
/// Both functions are called once per sample, from the thread of the loop. They must not wait, allocate or lock: what they take is
/// part of the time of a sample. A panic is caught; the loop goes to rest then.
///
/// ```
/// use hysteresis_realtime::io::{Fault, Io};
/// struct Lag(f64); // um
/// impl Io for Lag {
///     const WRITE_MAY_FAIL: bool = false;
///     fn read(&mut self) -> Result<Option<f64>, Fault> {
///         Ok(Some(self.0))
///     }
///     fn write(&mut self, drive: f64) -> Result<(), Fault> {
///         self.0 += 0.5 * (0.01 * drive - self.0);
///         Ok(())
///     }
/// }
/// assert_eq!(Lag(1.0).read(), Ok(Some(1.0)));
/// ```
pub trait Io: Send {
    /// Whether [`write`](Self::write) may fail. The loop then plans each sample, and the controller takes it when it was written.
    const WRITE_MAY_FAIL: bool = true;

    /// The measurement of now; None if there is none that is newer than the last one.
    ///
    /// # Errors
    /// [`Fault`]: there is no fresh measurement then either, and it is counted.
    fn read(&mut self) -> Result<Option<f64>, Fault>;

    /// For how many samples in a row the rest drive is written before the loop ends: more than one where a write may be lost unseen.
    fn rest_writes(&self) -> u32 {
        1
    }

    /// What became of the datagrams until now, where these are what is read and written.
    fn datagrams(&self) -> Option<UdpCounts> {
        None
    }

    /// Holds a drive, in volts, until the next one.
    ///
    /// # Errors
    /// [`Fault`]: the amplifier still has the drive before. The next sample tries again.
    fn write(&mut self, drive: f64) -> Result<(), Fault>;
}

/// Why a measurement or a drive did not pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// The status that a driver returned.
    Status(i32),
    /// What the operating system said.
    System(std::io::ErrorKind),
    /// The function panicked.
    Panicked,
    /// The function raised an exception.
    Raised,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Status(status) => write!(f, "status {status}"),
            Self::System(kind) => kind.fmt(f),
            Self::Panicked => f.write_str("panicked"),
            Self::Raised => f.write_str("raised an exception"),
        }
    }
}

impl core::error::Error for Fault {}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        Self::System(error.kind())
    }
}
