//! Panics that must not leave the library.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs work that other languages call. A panic, which is a defect of the library, becomes its message: it must not unwind into
/// them. What the work was changing may be in any state then.
///
/// ```
/// use hysteresis_control::guarded;
/// assert_eq!(guarded(|| 2), Ok(2));
/// assert_eq!(guarded(|| panic!("{} is missing", "something")), Err::<(), _>("a defect of the library: something is missing".into()));
/// ```
///
/// # Errors
/// The message of a panic.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        let message = payload.downcast_ref::<String>().map(String::as_str);
        let message = message.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message");
        format!("a defect of the library: {message}")
    })
}
