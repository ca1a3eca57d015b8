//! What passes between C and here: statuses and messages, places and memory of objects, strings and saved states,
//! arrays.

use core::ffi::{CStr, c_char, c_void};
use core::mem::MaybeUninit;
use std::cell::RefCell;
use std::ffi::CString;

use hysteresis_control::binary::Sampled;
use hysteresis_control::multi_axis::FileError;
use hysteresis_control::{guarded, stage};
use hysteresis_core as core_;
use serde::Serialize;
use serde::de::DeserializeOwned;

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

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        match error {
            FileError::Value(error) => error.into(),
            error => Self::new(Status::Format, error.to_string()),
        }
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

/// A refusal of an argument.
pub(crate) fn wrong(message: String) -> Failure {
    Failure::new(Status::Argument, message)
}

/// A number that may be left open.
pub(crate) fn given(number: f64) -> Option<f64> {
    (!number.is_nan()).then_some(number)
}

/// Two numbers that are given together or not at all.
pub(crate) fn pair(names: [&str; 2], numbers: [f64; 2]) -> Result<Option<(f64, f64)>, Failure> {
    match numbers.map(given) {
        [Some(one), Some(other)] => Ok(Some((one, other))),
        [None, None] => Ok(None),
        [Some(one), None] => {
            Err(wrong(format!("{}: expected a number beside {} = {one:?}, got nan", names[1], names[0])))
        }
        [None, Some(other)] => {
            Err(wrong(format!("{}: expected a number beside {} = {other:?}, got nan", names[0], names[1])))
        }
    }
}

/// Limits of the drive, or those of the stage.
pub(crate) fn limits(low: f64, high: f64) -> Result<Option<(f64, f64)>, Failure> {
    pair(["limit_low", "limit_high"], [low, high])
}

/// A count that may be left open by -1.
pub(crate) fn count(name: &str, got: i32) -> Result<Option<u32>, Failure> {
    match got {
        -1 => Ok(None),
        _ => u32::try_from(got).map(Some).map_err(|_| wrong(format!("{name}: expected 0 or more, or -1, got {got}"))),
    }
}

/// The message about the last call of this thread that failed: the argument, what was expected, what came. Empty if
/// none failed. It is valid until the next call of this thread that fails; do not free it.
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

/// Whose memory an object lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Owner {
    Library,
    Caller,
}

/// What can lie in memory of the caller.
pub(crate) trait Object {
    /// Where the object keeps whose memory it lies in.
    fn owner(&mut self) -> &mut Owner;
}

/// Memory for an object as it comes from C: none for the heap.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) memory: *mut c_void,
    pub(crate) bytes: usize,
}

impl Place {
    /// Puts an object there, and tells C where it is.
    ///
    /// # Safety
    /// `memory` is NULL or memory of `bytes` bytes that nothing else uses; `object` is NULL or may be written.
    pub(crate) unsafe fn put<T: Object>(
        self,
        make: impl FnOnce() -> Result<T, Failure>,
        object: *mut *mut T,
    ) -> Result<(), Failure> {
        if object.is_null() {
            return Err(Failure::null("object"));
        }
        // SAFETY: it is not NULL, so it may be written. What fails leaves no pointer that could be taken for an object.
        unsafe { object.write(core::ptr::null_mut()) };
        let there = self.memory.cast::<T>();
        if !there.is_null() {
            self.check(there)?;
        }
        let mut value = make()?;
        let made = if there.is_null() {
            *value.owner() = Owner::Library;
            Box::into_raw(Box::new(value))
        } else {
            *value.owner() = Owner::Caller;
            // SAFETY: the memory is large enough and aligned, and nothing else uses it.
            unsafe { there.write(value) };
            there
        };
        // SAFETY: as above.
        unsafe { object.write(made) };
        Ok(())
    }

    fn check<T>(self, there: *mut T) -> Result<(), Failure> {
        let (size, align) = (size_of::<T>(), align_of::<T>());
        if self.bytes < size {
            let message = format!("bytes: expected at least {size}, got {}", self.bytes);
            return Err(Failure::new(Status::Memory, message));
        }
        if !there.is_aligned() {
            let message = format!("memory: expected an address that is a multiple of {align}, got {there:p}");
            return Err(Failure::new(Status::Memory, message));
        }
        Ok(())
    }
}

/// Ends an object, wherever it lies.
///
/// # Safety
/// `object` is NULL, or came from [`Place::put`] and was not ended since.
pub(crate) unsafe fn end<T: Object>(object: *mut T) {
    // SAFETY: it is an object, unless it is NULL.
    let Some(owner) = (unsafe { object.as_mut() }).map(|object| *object.owner()) else { return };
    match owner {
        // SAFETY: it came from a box, and nobody uses it after this.
        Owner::Library => drop(unsafe { Box::from_raw(object) }),
        // SAFETY: it is an object that nobody uses after this; its memory goes back to the caller.
        Owner::Caller => unsafe { object.drop_in_place() },
    }
}

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

/// The text of the file of that path.
///
/// # Safety
/// As for [`read`].
pub(crate) unsafe fn read_file(path: *const c_char) -> Result<String, Failure> {
    // SAFETY: as asked of the caller.
    let path = unsafe { read("path", path)? };
    let bytes =
        stage::read_file(path.as_ref()).map_err(|error| Failure::new(Status::File, format!("{path}: {error}")))?;
    String::from_utf8(bytes)
        .map_err(|error| Failure::new(Status::Format, format!("{path}: expected UTF-8 text: {error}")))
}

/// Makes an object that never changes on the heap, and tells C where it is.
///
/// # Safety
/// `place` is NULL or may be written.
pub(crate) unsafe fn hand_over<T>(name: &str, place: *mut *mut T, make: impl FnOnce() -> Result<T, Failure>) -> Status {
    guard(|| {
        if place.is_null() {
            return Err(Failure::null(name));
        }
        // SAFETY: it is not NULL, so it may be written. What fails leaves no pointer that could be taken for an object.
        unsafe { place.write(core::ptr::null_mut()) };
        let made = Box::into_raw(Box::new(make()?));
        // SAFETY: as above.
        unsafe { place.write(made) };
        Ok(())
    })
}

/// Frees what was handed over; nothing for NULL.
///
/// # Safety
/// `object` is NULL, or came from [`hand_over`] and nobody uses it after this.
pub(crate) unsafe fn free<T>(object: *mut T) {
    if !object.is_null() {
        // SAFETY: it came from a box.
        drop(unsafe { Box::from_raw(object) });
    }
}

/// A buffer of the caller for a text or bytes.
pub(crate) struct Buffer<'a> {
    pub(crate) to: *mut u8,
    pub(crate) bytes: usize,
    pub(crate) needed: Option<&'a mut MaybeUninit<usize>>,
}

impl Buffer<'_> {
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

/// Writes the state of an object as text with its closing zero byte.
///
/// # Safety
/// As for [`Buffer::put`].
pub(crate) unsafe fn save<T, S: Serialize>(
    (name, object): (&str, Option<&T>),
    state: impl FnOnce(&T) -> S,
    text: Buffer<'_>,
) -> Status {
    guard(|| {
        let state = state(there(name, object)?);
        let mut json = serde_json::to_vec(&state).map_err(|error| Failure::new(Status::Internal, error.to_string()))?;
        json.push(0);
        // SAFETY: as asked of the caller.
        unsafe { text.put("text", &json) }
    })
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

/// The object of a call that runs, unless it or one of the arrays of `n` rows is NULL.
fn all_there<'a, T, const N: usize>(
    (name, object): (&str, Option<&'a mut T>),
    n: usize,
    inputs: [(&str, *const f64); N],
    output: (&str, *mut f64),
) -> Result<&'a mut T, Failure> {
    let object = there(name, object)?;
    let mut arrays = inputs.into_iter().chain([(output.0, output.1.cast_const())]);
    match arrays.find(|(_, array)| n > 0 && array.is_null()) {
        Some((name, _)) => Err(Failure::null(name)),
        None => Ok(object),
    }
}

/// One output for each row of inputs, in order. Input and output may be the same array, so they are no slices.
///
/// # Safety
/// An array is NULL or has `n` numbers, which nothing else changes until this returns.
pub(crate) unsafe fn run<T, const N: usize>(
    object: (&str, Option<&mut T>),
    n: usize,
    inputs: [(&str, *const f64); N],
    output: (&str, *mut f64),
    mut step: impl FnMut(&mut T, [f64; N]) -> f64,
) -> Status {
    let object = match all_there(object, n, inputs, output) {
        Ok(object) => object,
        Err(failure) => return guard(|| Err(failure)),
    };
    let inputs = inputs.map(|(_, input)| input);
    for k in 0..n {
        // SAFETY: no array is NULL, and k is below n.
        let row = inputs.map(|input| unsafe { input.add(k).read() });
        // SAFETY: as above.
        unsafe { output.1.add(k).write(step(object, row)) };
    }
    Status::Ok
}

/// What takes and gives a number for each axis: it has room for them, as arrays of C may be the same.
pub(crate) trait Rows<const N: usize> {
    /// Room for a row of each input, and of the output.
    fn rows(&mut self) -> ([&mut [f64]; N], &mut [f64]);
}

/// One row of outputs for each row of inputs, in order: a number for each axis.
///
/// # Safety
/// An array is NULL or has `n` rows, which nothing else changes until this returns.
pub(crate) unsafe fn run_rows<T: Rows<N>, const N: usize>(
    object: (&str, Option<&mut T>),
    n: usize,
    inputs: [(&str, *const f64); N],
    output: (&str, *mut f64),
    mut step: impl FnMut(&mut T),
) -> Status {
    let object = match all_there(object, n, inputs, output) {
        Ok(object) => object,
        Err(failure) => return guard(|| Err(failure)),
    };
    for k in 0..n {
        let (rows, _) = object.rows();
        for (row, (_, input)) in rows.into_iter().zip(inputs) {
            // SAFETY: no array is NULL, and k is below n; the row is memory of ours.
            unsafe { row.as_mut_ptr().copy_from_nonoverlapping(input.add(k * row.len()), row.len()) };
        }
        step(object);
        let (_, row) = object.rows();
        // SAFETY: as above.
        unsafe { output.1.add(k * row.len()).copy_from_nonoverlapping(row.as_ptr(), row.len()) };
    }
    Status::Ok
}

/// What was driven before, or bytes: `n` of them.
///
/// # Safety
/// The array is NULL or has `n` elements, which nothing changes while the slice lives.
pub(crate) unsafe fn slice<'a, T>(name: &str, n: usize, elements: *const T) -> Result<&'a [T], Failure> {
    if n == 0 {
        return Ok(&[]);
    }
    if elements.is_null() {
        return Err(Failure::null(name));
    }
    // SAFETY: it is not NULL, so it has n elements.
    Ok(unsafe { core::slice::from_raw_parts(elements, n) })
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
