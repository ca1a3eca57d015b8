//! What can go wrong in a configuration, and the message about it.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;
use std::cell::RefCell;
use std::ffi::CString;

use hysteresis_control::{guarded, stage};
use hysteresis_core as core_;

/// What became of a call. Everything but MPIH_STATUS_OK has a message: mpih_last_error.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A pointer is NULL that must not be.
    Null = 1,
    /// The memory of the caller is too small for the object, or not aligned for it.
    Memory = 2,
    /// An argument, or a number in the file, is outside its domain.
    Argument = 3,
    /// The hysteresis has no inverse: its slope may vanish or turn negative.
    NotInvertible = 4,
    /// A file cannot be read.
    File = 5,
    /// A text, or bytes, are no stage, no model or no saved state.
    Format = 6,
    /// A saved state belongs to another object, or the object cannot be in it.
    State = 7,
    /// The buffer for a text is too small; the size that is needed has been told.
    Buffer = 8,
    /// A defect of the library. Free the object: it may be in any state.
    Internal = 9,
}

/// Why a call fails.
#[derive(Debug)]
pub(crate) struct Failure {
    status: Status,
    message: String,
}

impl Failure {
    pub(crate) fn new(status: Status, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    pub(crate) fn null(name: &str) -> Self {
        Self::new(Status::Null, format!("{name}: expected a pointer, got NULL"))
    }
}

impl From<stage::Error> for Failure {
    fn from(error: stage::Error) -> Self {
        let status = match &error {
            stage::Error::Core(error) => return (*error).into(),
            stage::Error::File { .. } | stage::Error::Bytes { .. } => Status::Format,
            _ => Status::Argument,
        };
        Self::new(status, error.to_string())
    }
}

impl From<core_::Error> for Failure {
    fn from(error: core_::Error) -> Self {
        let status = match error {
            core_::Error::NotInvertible { .. } => Status::NotInvertible,
            _ if error.parameter().is_some_and(is_of_state) => Status::State,
            _ => Status::Argument,
        };
        Self::new(status, error.to_string())
    }
}

/// Whether a parameter is a saved state or a field of it.
fn is_of_state(parameter: &str) -> bool {
    parameter == "state" || parameter.starts_with("state.")
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Runs a configuration: no panic leaves it, and what is wrong is kept for `mpih_last_error`.
pub(crate) fn guard(work: impl FnOnce() -> Result<(), Failure>) -> Status {
    let outcome = guarded(work).unwrap_or_else(|panic| Err(Failure::new(Status::Internal, panic)));
    let Err(Failure { status, message }) = outcome else { return Status::Ok };
    let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
    // A thread that ends has no message any more; the status is told all the same.
    let _ = LAST.try_with(|last| last.replace(message));
    status
}

/// An object that must be there.
pub(crate) fn there<T>(name: &str, object: Option<T>) -> Result<T, Failure> {
    object.ok_or_else(|| Failure::null(name))
}

/// Writes a plain value to where the caller wants it.
pub(crate) fn tell<T>(name: &str, place: Option<&mut MaybeUninit<T>>, value: T) -> Result<(), Failure> {
    there(name, place)?.write(value);
    Ok(())
}

/// The message about the last call of this thread that failed: the argument, what was expected, what came. Empty if none
/// failed. It is valid until the next call of this thread that fails; do not free it.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// The name of a status, such as "MPIH_STATUS_OK"; "unknown status" for any other number.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_status_name(status: i32) -> *const c_char {
    const NAMES: [(Status, &CStr); 10] = [
        (Status::Ok, c"MPIH_STATUS_OK"),
        (Status::Null, c"MPIH_STATUS_NULL"),
        (Status::Memory, c"MPIH_STATUS_MEMORY"),
        (Status::Argument, c"MPIH_STATUS_ARGUMENT"),
        (Status::NotInvertible, c"MPIH_STATUS_NOT_INVERTIBLE"),
        (Status::File, c"MPIH_STATUS_FILE"),
        (Status::Format, c"MPIH_STATUS_FORMAT"),
        (Status::State, c"MPIH_STATUS_STATE"),
        (Status::Buffer, c"MPIH_STATUS_BUFFER"),
        (Status::Internal, c"MPIH_STATUS_INTERNAL"),
    ];
    NAMES.iter().find(|(known, _)| *known as i32 == status).map_or(c"unknown status", |(_, name)| name).as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_status_with_its_message() {
        let status = guard(|| panic!("{} is missing", "something"));
        // SAFETY: the pointer is that of a string of this thread, and nothing fails before it is read.
        let message = unsafe { CStr::from_ptr(mpih_last_error()) };
        assert_eq!((status, message), (Status::Internal, c"a defect of the library: something is missing"));
    }
}
