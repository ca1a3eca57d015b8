//! The Duhem operator, its inverse, and a controller over that.

use std::hint::black_box;

use hysteresis_core::{ControllerOptions, Duhem, DuhemForward, DuhemInverse, Error, HybridController, Process};
use no_panic::no_panic;

#[no_panic]
#[inline(never)]
fn forward(stream: &mut DuhemForward<9>, sample: f64) -> (f64, f64) {
    (stream.peek(sample), stream.step(sample))
}

#[no_panic]
#[inline(never)]
fn inverse(stream: &mut DuhemInverse<9>, sample: f64) -> (f64, f64) {
    (stream.peek(sample), stream.step(sample))
}

#[no_panic]
#[inline(never)]
fn block(stream: &mut DuhemForward<9>, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    stream.run(samples, output)
}

#[no_panic]
#[inline(never)]
fn controlled(controller: &mut HybridController<DuhemInverse<9>>, reference: f64, measurement: f64) -> (f64, f64) {
    (controller.peek(reference.into(), measurement), controller.step(reference.into(), measurement))
}

pub(crate) fn run() -> Result<(), Error> {
    let duhem = Duhem::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?;
    let (mut one, mut other) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, 0.5)?);
    for sample in [1.0, -3.0, f64::NAN] {
        black_box((forward(&mut one, black_box(sample)), inverse(&mut other, black_box(sample))));
    }
    let limits = (-5.0, 5.0);
    let inverse = DuhemInverse::new(duhem, 0.5)?.within(limits)?;
    let mut over = HybridController::with_source(inverse, None, &ControllerOptions::new(0.1, 50.0, 1e-4, limits))?;
    for sample in [1.0, -3.0, f64::NAN] {
        black_box(controlled(&mut over, black_box(sample), black_box(0.9 * sample)));
    }
    block(&mut one, &[0.5, 0.1], &mut [0.0; 2])
}
