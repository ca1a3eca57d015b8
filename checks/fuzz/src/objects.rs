//! An object of the C interface, in memory of the caller or of the library.

use core::ffi::c_void;
use core::ptr;

use mpi_hyst::Status;

use crate::bytes::Bytes;

/// What ends an object.
type Free<T> = unsafe extern "C" fn(*mut T);

/// An object that may not have been made: then every call gets NULL.
pub(crate) struct Slot<T> {
    pointer: *mut T,
    free: Free<T>,
    /// Where the object lies, unless in memory of the library.
    #[expect(dead_code, reason = "the object lies there")]
    memory: Vec<u128>,
}

impl<T> Slot<T> {
    /// Makes an object in memory that may be too small or not aligned: then there is a status that says so, and no
    /// object.
    pub(crate) fn new(
        bytes: &mut Bytes<'_>,
        (size, align): (usize, usize),
        free: Free<T>,
        new: impl FnOnce(*mut c_void, usize, *mut *mut T) -> Status,
    ) -> Self {
        let mut memory = Vec::new();
        let (mut place, mut room) = (ptr::null_mut(), 0);
        if bytes.coin() {
            memory = vec![0_u128; size / 16 + 2];
            let shift = usize::from(bytes.below(8) == 0);
            room = size - usize::from(bytes.below(8) == 0);
            // SAFETY: the memory has 16 bytes more than the object needs.
            place = unsafe { memory.as_mut_ptr().cast::<u8>().add(shift) };
            assert!(align <= 16, "memory of numbers of 128 bits suffices");
        }
        let mut pointer = ptr::null_mut();
        let status = new(place.cast(), room, &raw mut pointer);
        assert_eq!(status == Status::Ok, !pointer.is_null(), "there is an object exactly if the status says so");
        Self { pointer, free, memory }
    }

    pub(crate) fn shared(&self) -> Option<&T> {
        // SAFETY: NULL, or an object that lives until this slot is dropped.
        unsafe { self.pointer.as_ref() }
    }

    pub(crate) fn unique(&mut self) -> Option<&mut T> {
        // SAFETY: NULL, or an object that lives until this slot is dropped; nobody else has it.
        unsafe { self.pointer.as_mut() }
    }
}

impl<T> Drop for Slot<T> {
    fn drop(&mut self) {
        // SAFETY: NULL, or an object that nobody uses after this.
        unsafe { (self.free)(self.pointer) }
    }
}
