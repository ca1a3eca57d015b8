//! Messages to the tool.

use core::ffi::{CStr, c_char, c_void};
use std::ffi::CString;

use crate::status::Status;

/// `fmi2CallbackLogger`: environment, name of the instance, status, category, format, and what it formats.
type Log = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CallbackFunctions {
    logger: Option<Log>,
    allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

/// The logger of a tool, and the name of the instance that it shows.
#[derive(Clone)]
pub(crate) struct Logger {
    log: Option<Log>,
    environment: *mut c_void,
    name: CString,
}

impl Logger {
    /// The callbacks of a tool, if it gave any. They stay valid as long as the instance, as the standard says.
    pub(crate) fn new(callbacks: Option<&CallbackFunctions>, name: &CStr) -> Self {
        let environment = callbacks.map_or(core::ptr::null_mut(), |callbacks| callbacks.environment);
        Self { log: callbacks.and_then(|callbacks| callbacks.logger), environment, name: name.to_owned() }
    }

    pub(crate) fn say(&self, status: Status, message: &str) {
        let Some(log) = self.log else { return };
        // The message is a format: a percent sign stands for itself only if it is doubled.
        let Ok(message) = CString::new(message.replace('\0', " ").replace('%', "%%")) else { return };
        // SAFETY: the function of the tool, with its environment and texts that live until it returns; nothing is to be
        // formatted.
        unsafe { log(self.environment, self.name.as_ptr(), status, c"logStatusError".as_ptr(), message.as_ptr()) }
    }
}
