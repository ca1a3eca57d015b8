//! The C interface: the stage file in, and from it the forward model, the exact inverse, the controller and the
//! observer.
//!
//! The header `include/mpi_hyst.h` is made from these files, so their documentation is that of C: `docs/c.md` is where
//! to begin. Nothing is computed here. `boundary` has what can go wrong, where objects lie, strings and the loops of
//! `run`; on it stand `stage`, then `controller`, `models` (forward model and inverse) and `observer`, then `bytes`,
//! what all of them are as bytes. Beside them stand `oscillator`, `axes` and `axes_controller`, for hysteresis inside
//! the dynamics and for several axes.
//!
//! # Pointers
//! A pointer to an object is an `Option` of a reference, which C sees as a pointer that may be NULL. So the functions
//! of the loop are safe code. What else C must keep is at the top of the header.

mod axes;
mod axes_controller;
mod bytes;
mod controller;
mod models;
mod observer;
mod oscillator;
mod stage;

// Last, so that its functions come last in the header.
mod boundary;

pub use axes::*;
pub use axes_controller::*;
pub use boundary::{Status, mpih_last_error, mpih_status_name};
pub use bytes::*;
pub use controller::*;
pub use models::*;
pub use observer::*;
pub use oscillator::*;
pub use stage::*;

use core::ffi::{CStr, c_char};

/// The number of this interface. It changes when a function or a struct changes in a way that compiled programs notice.
pub const MPIH_ABI: u32 = 1;

/// The number of the interface that the library has: compare it with MPIH_ABI, that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_abi() -> u32 {
    MPIH_ABI
}

/// The version of the library, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn mpih_version() -> *const c_char {
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!("a version has no zero byte"),
    };
    VERSION.as_ptr()
}
