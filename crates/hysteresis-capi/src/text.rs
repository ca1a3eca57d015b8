//! Strings from C and to C, and saved states, which are JSON.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;

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

/// A buffer of the caller for a text.
pub(crate) struct Buffer<'a> {
    pub(crate) text: *mut c_char,
    pub(crate) bytes: usize,
    pub(crate) needed: Option<&'a mut MaybeUninit<usize>>,
}

impl Buffer<'_> {
    /// Writes a saved state with its closing zero byte. Without a buffer it only tells how many bytes are needed.
    ///
    /// # Safety
    /// `text` is NULL or has `bytes` bytes.
    pub(crate) unsafe fn save(self, state: &impl Serialize) -> Result<(), Failure> {
        let json = serde_json::to_string(state).map_err(|error| Failure::new(Status::Internal, error.to_string()))?;
        let needed = json.len() + 1;
        if let Some(place) = self.needed {
            tell("needed", Some(place), needed)?;
        } else if self.text.is_null() {
            return Err(Failure::null("text"));
        }
        if self.text.is_null() {
            return Ok(());
        }
        if self.bytes < needed {
            let message = format!("bytes: expected at least {needed}, got {}", self.bytes);
            return Err(Failure::new(Status::Buffer, message));
        }
        let to = self.text.cast::<u8>();
        // SAFETY: there is room for the text and the zero byte, and JSON of ours overlaps no memory of the caller.
        unsafe {
            to.copy_from_nonoverlapping(json.as_ptr(), json.len());
            to.add(json.len()).write(0);
        }
        Ok(())
    }
}

/// A saved state from its text.
pub(crate) fn saved<T: DeserializeOwned>(text: &str) -> Result<T, Failure> {
    serde_json::from_str(text).map_err(|error| {
        Failure::new(Status::Format, format!("state: expected a text that was saved by this kind of object; {error}"))
    })
}

/// The state of a stream, and the sampling interval that it belongs to: as Python's `state` of the same stream.
#[derive(Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sampled<T> {
    pub(crate) dt: f64,
    pub(crate) stream: T,
}

impl<T> Sampled<T> {
    /// The state, if it belongs to this sampling interval.
    pub(crate) fn at(self, dt: f64) -> Result<T, Failure> {
        if self.dt.to_bits() == dt.to_bits() {
            return Ok(self.stream);
        }
        Err(Failure::new(Status::State, format!("state.dt: expected {dt:?}, got {:?}", self.dt)))
    }
}
