//! A notch of idsp in front of the inverse of a stage, as one stage of dsp-process, as it runs on firmware: single
//! precision, no allocation.
//!
//! ```text
//! reference (um) -> notch at the resonance -> inverse of the hysteresis -> drive (V)
//! ```
//!
//! `cargo run -p idsp-chain --features dsp_process`

use dsp_process::{Process, Split};
use hysteresis_core::embedded::{Forward, Inverse, Model};
use hysteresis_core::{Error, Offsets, Process as _, Ratios};
use idsp::iir::{Biquad, DirectForm2Transposed, coefficients::Filter};

/// Samples per second.
const RATE: f32 = 20e3;

/// Of the stage, in Hz.
const RESONANCE: f32 = 800.0;

/// In V.
const LIMITS: (f32, f32) = (-500.0, 500.0);

fn main() -> Result<(), Error> {
    let (weights, r) = ([4.3e-3, 1.7e-3, 1.7e-3], [0.0, 150.0, 300.0]); // um/V, V
    let model = Model::<f32, 3>::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default())?;
    let mut filter = Filter::default();
    filter.frequency(RESONANCE, RATE).q(0.7);
    let notch: Biquad<f32> = filter.notch().into();
    let notch = || Split::new(notch.clone(), DirectForm2Transposed::default());

    let inverse = Inverse::new(&model, Some(LIMITS))?;
    let mut chain = (notch() * Split::stateful(inverse)).minor::<f32>();
    let mut actuator = Split::stateful(Forward::new(&model));
    let mut alone = notch();

    // A slow scan with a disturbance at the resonance on top: the drive must not excite it, and the stage must follow
    // the rest.
    let mut worst = 0.0_f32;
    for k in 0..20_000_u16 {
        let t = f32::from(k) / RATE;
        let wave = |frequency: f32| (core::f32::consts::TAU * (frequency * t).fract()).sin();
        let reference = 1.5 * wave(5.0) + 0.05 * wave(RESONANCE);
        let position = actuator.process(chain.process(reference));
        worst = worst.max((position - alone.process(reference)).abs());
    }
    println!("largest error of the position behind filter and inverse: {worst:e} um of 3 um");
    assert!(worst <= 3e-6, "more than 1e-6 of the range");

    // What no drive may be made of is held, and counted.
    let mut inverse = Inverse::new(&model, Some(LIMITS))?;
    let drive = Process::process(&mut inverse, 1.0);
    assert_eq!(Process::process(&mut inverse, f32::NAN), drive);
    assert_eq!((inverse.step(99.0), inverse.rejected()), (LIMITS.1, 1));
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_example_runs() {
        super::main().unwrap();
    }
}
