//! With an allocator: what needs one links without std.

use core::alloc::{GlobalAlloc, Layout};

use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};

struct NoMemory;

// SAFETY: an allocator may refuse every request; nothing is ever handed out, so nothing is ever given back.
unsafe impl GlobalAlloc for NoMemory {
    unsafe fn alloc(&self, _layout: Layout) -> *mut u8 {
        core::ptr::null_mut()
    }

    unsafe fn dealloc(&self, _pointer: *mut u8, _layout: Layout) {}
}

#[global_allocator]
static ALLOCATOR: NoMemory = NoMemory;

/// Uses the core, so that it is linked.
#[unsafe(no_mangle)]
pub extern "C" fn displacement(drive: f64) -> f64 {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[1.0, 0.5], &[0.0, 2.0], Ratios::PAPER, Offsets::default());
    model.map_or(f64::NAN, |model| model.forward().step(drive))
}
