//! Strings from C, and saved states to C, which are JSON or bytes.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;

use hysteresis_control::binary::Sampled;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::status::{Failure, Status, tell};

/// A string from C.
///
/// # Safety
/// `text` is NULL or a string that ends with a zero byte, which nothing changes while the result lives.
pub(crate) unsafe fn read<'a>(name: &str, text: *const c_char) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(Failure::null(name));
    }
    // SAFETY: it is not NULL, so it ends with a zero byte.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|error| Failure::new(Status::Format, format!("{name}: expected UTF-8 text: {error}")))
}

/// A buffer of the caller for a text or bytes.
pub(crate) struct Buffer<'a> {
    pub(crate) to: *mut u8,
    pub(crate) bytes: usize,
    pub(crate) needed: Option<&'a mut MaybeUninit<usize>>,
}

impl Buffer<'_> {
    /// Writes a saved state as text with its closing zero byte, as [`put`](Self::put) does.
    ///
    /// # Safety
    /// As for `put`.
    pub(crate) unsafe fn save(self, state: &impl Serialize) -> Result<(), Failure> {
        let mut json = serde_json::to_vec(state).map_err(|error| Failure::new(Status::Internal, error.to_string()))?;
        json.push(0);
        // SAFETY: as asked of the caller.
        unsafe { self.put("text", &json) }
    }

    /// Copies bytes of ours to the caller. Without a buffer it only tells how many are needed.
    ///
    /// # Safety
    /// `to` is NULL or has `bytes` bytes.
    pub(crate) unsafe fn put(self, name: &str, ours: &[u8]) -> Result<(), Failure> {
        let needed = ours.len();
        if let Some(place) = self.needed {
            tell("needed", Some(place), needed)?;
        } else if self.to.is_null() {
            return Err(Failure::null(name));
        }
        if self.to.is_null() {
            return Ok(());
        }
        if self.bytes < needed {
            let message = format!("bytes: expected at least {needed}, got {}", self.bytes);
            return Err(Failure::new(Status::Buffer, message));
        }
        // SAFETY: there is room, and bytes of ours overlap no memory of the caller.
        unsafe { self.to.copy_from_nonoverlapping(ours.as_ptr(), needed) };
        Ok(())
    }
}

/// A saved state from its text.
pub(crate) fn saved<T: DeserializeOwned>(text: &str) -> Result<T, Failure> {
    serde_json::from_str(text).map_err(|error| {
        Failure::new(Status::Format, format!("state: expected a text that was saved by this kind of object; {error}"))
    })
}

/// The state of a stream, if it belongs to this sampling interval.
pub(crate) fn at<T>(state: Sampled<T>, dt: f64) -> Result<T, Failure> {
    state.at(dt).map_err(|got| Failure::new(Status::State, format!("state.dt: expected {dt:?}, got {got:?}")))
}
