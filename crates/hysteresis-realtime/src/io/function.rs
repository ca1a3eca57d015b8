//! Functions with the calling convention of C: any driver of any vendor, from C or through ctypes.

use core::ffi::{c_int, c_void};

use super::{Fault, Io};

/// Writes the measurement of now to `measurement` and returns 0; returns a number above 0 if there is none that is newer than the
/// last one, and one below 0 for a fault.
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
    /// Until the last use of this object both functions may be called with `context`, from one thread at a time, which may be any.
    /// They do not unwind.
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
