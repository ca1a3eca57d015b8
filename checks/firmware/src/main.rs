//! Instructions per sample of the streams of fixed size on a Cortex-M4F, in qemu; and the same bits there as on the
//! host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod board;
mod work;

/// Digests only: what has no clock cannot count.
#[cfg(not(target_os = "none"))]
fn main() -> Result<(), hysteresis_core::Error> {
    work::all(|| 0, |case| println!("{case}"))
}
