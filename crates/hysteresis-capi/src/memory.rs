//! Where objects lie: in memory of the caller, or on the heap.

use core::ffi::c_void;

use crate::status::{Failure, Status};

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
