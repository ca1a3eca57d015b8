//! Links hysteresis-core where there is no std, and without the feature `alloc` no allocator: see Cargo.toml.
#![no_std]

use core::panic::PanicInfo;

use hysteresis_core::embedded::{Forward, Inverse, Model};
use hysteresis_core::{
    ControllerOptions, Duhem, DuhemForward, DuhemInverse, Error, HybridController, Offsets, Process, Ratios, Real,
};

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    loop {}
}

/// Uses streams of fixed size, and a controller, so that they are linked.
fn reached<T: Real>(target: f64) -> Result<f64, Error> {
    let model = Model::<T, 4>::from_ratios(&[1.0, 0.5], &[0.0, 2.0], Ratios::PAPER, Offsets::default())?;
    let options = ControllerOptions::new(1.0, 10.0, 1e-4, (-8.0, 8.0));
    let inverse = Inverse::new(&model, Some((T::narrow(-8.0), T::narrow(8.0))))?;
    let mut controller = HybridController::with_source(inverse.clone(), None, &options)?;
    let (mut inverse, mut forward) = (inverse, Forward::new(&model));
    let drive = inverse.step(T::narrow(controller.step(target.into(), 0.0)));
    let mut outputs = [T::ZERO];
    forward.run(&[drive], &mut outputs)?;
    Ok(forward.peek(drive).wide() + outputs[0].wide())
}

/// With numbers of single precision.
#[unsafe(no_mangle)]
pub extern "C" fn reached_single(target: f64) -> f64 {
    reached::<f32>(target).unwrap_or(f64::NAN)
}

/// With numbers of double precision.
#[unsafe(no_mangle)]
pub extern "C" fn reached_double(target: f64) -> f64 {
    reached::<f64>(target).unwrap_or(f64::NAN)
}

/// A Duhem operator, and a controller over its inverse.
fn followed(target: f64) -> Result<f64, Error> {
    let (duhem, limits) = (Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?, (-8.0, 8.0));
    let inverse = DuhemInverse::new(duhem, 0.3)?.within(limits)?;
    let options = ControllerOptions::new(1.0, 10.0, 1e-4, limits);
    let mut controller = HybridController::with_source(inverse, None, &options)?;
    Ok(DuhemForward::new(duhem).step(controller.step(target.into(), 0.0)))
}

/// With hysteresis that forgets its turning points.
#[unsafe(no_mangle)]
pub extern "C" fn reached_duhem(target: f64) -> f64 {
    followed(target).unwrap_or(f64::NAN)
}

/// With an allocator: what needs one links without std.
#[cfg(feature = "alloc")]
mod heap {
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
}
