//! Where measurements come from, and drives go.

mod shared_memory;
mod udp;

pub use shared_memory::{Block, SharedMemoryIo, SharedMemoryPlant};
pub use udp::{PACKET, Packet, UdpIo};

use core::ffi::{c_int, c_void};
use core::fmt;

use hysteresis_simulate::plant::Plant;
use serde::{Deserialize, Serialize};

/// What a loop reads from and writes to.
///
/// Both functions are called once per sample, from the thread of the loop. They must not wait, allocate or lock: what
/// they take is part of the time of a sample. A panic is caught; the loop goes to rest then.
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
    /// Whether [`write`](Self::write) may fail. The loop then plans each sample, and the controller takes it when it
    /// was written.
    const WRITE_MAY_FAIL: bool = true;

    /// The measurement of now; None if there is none that is newer than the last one.
    ///
    /// # Errors
    /// [`Fault`]: there is no fresh measurement then either, and it is counted.
    fn read(&mut self) -> Result<Option<f64>, Fault>;

    /// For how many samples in a row the rest drive is written before the loop ends: more than one where a write may be
    /// lost unseen.
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

/// What became of datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UdpCounts {
    /// Measurements that were received and used, or replaced by a newer one at once.
    pub received: u64,
    /// Sequence numbers that never came, or came after a later one.
    pub lost: u64,
    /// Datagrams that came after a later one, or twice.
    pub late: u64,
    /// Datagrams of another length.
    pub malformed: u64,
    /// How often the other side said that nobody listens.
    pub refused: u64,
}

/// Writes the measurement of now to `measurement` and returns 0; returns a number above 0 if there is none that is
/// newer than the last one, and one below 0 for a fault.
pub type ReadFunction = unsafe extern "C" fn(context: *mut c_void, measurement: *mut f64) -> c_int;

/// Puts out a drive and returns 0; returns another number for a fault.
pub type WriteFunction = unsafe extern "C" fn(context: *mut c_void, drive: f64) -> c_int;

/// Input and output by two functions of C.
///
/// ```
/// use core::ffi::{c_int, c_void};
/// use hysteresis_realtime::io::{FunctionIo, Io};
/// unsafe extern "C" fn read(_: *mut c_void, measurement: *mut f64) -> c_int {
///     // SAFETY: the loop gives a place for one number.
///     unsafe { *measurement = 1.5 };
///     0
/// }
/// unsafe extern "C" fn write(_: *mut c_void, _: f64) -> c_int {
///     -7
/// }
/// // SAFETY: both functions may be called at any time, with any context.
/// let mut io = unsafe { FunctionIo::new(read, write, core::ptr::null_mut()) };
/// assert_eq!(io.read(), Ok(Some(1.5)));
/// assert_eq!(io.write(2.0).unwrap_err().to_string(), "status -7");
/// ```
#[derive(Debug)]
pub struct FunctionIo {
    read: ReadFunction,
    write: WriteFunction,
    context: *mut c_void,
}

// SAFETY: `new` asks for functions and a context that may be used from another thread.
unsafe impl Send for FunctionIo {}

impl FunctionIo {
    /// Input and output by these functions, which get `context` at every call.
    ///
    /// # Safety
    /// Until the last use of this object both functions may be called with `context`, from one thread at a time, which
    /// may be any. They do not unwind.
    #[must_use]
    pub unsafe fn new(read: ReadFunction, write: WriteFunction, context: *mut c_void) -> Self {
        Self { read, write, context }
    }
}

impl Io for FunctionIo {
    #[inline]
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        let mut measurement = f64::NAN;
        // SAFETY: as `new` asks; `measurement` outlives the call.
        let status = unsafe { (self.read)(self.context, &raw mut measurement) };
        match status {
            0 => Ok(Some(measurement)),
            1.. => Ok(None),
            _ => Err(Fault::Status(status)),
        }
    }

    #[inline]
    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        // SAFETY: as `new` asks.
        let status = unsafe { (self.write)(self.context, drive) };
        if status == 0 { Ok(()) } else { Err(Fault::Status(status)) }
    }
}

/// The plant moves on by one interval at each sample, however much time went by.
impl Io for Plant {
    const WRITE_MAY_FAIL: bool = false;

    #[inline]
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        Ok(Some(self.measured()))
    }

    #[inline]
    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.step(drive);
        Ok(())
    }
}
