//! Links hysteresis-core where there is no std, and without the feature `alloc` no allocator: see Cargo.toml.
#![no_std]

#[cfg(feature = "alloc")]
mod heap;

use core::panic::PanicInfo;

use hysteresis_core::embedded::{Forward, Inverse, Model};
use hysteresis_core::{ControllerOptions, Error, HybridController, Offsets, Process, Ratios, Real};

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
