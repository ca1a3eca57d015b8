//! The Duhem operator and its inverse.

use std::hint::black_box;

use hysteresis_core::{Duhem, DuhemForward, DuhemInverse, Error, Process};
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

pub(crate) fn run() -> Result<(), Error> {
    let duhem = Duhem::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?;
    let (mut one, mut other) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, 0.5)?);
    for sample in [1.0, -3.0, f64::NAN] {
        black_box((forward(&mut one, black_box(sample)), inverse(&mut other, black_box(sample))));
    }
    block(&mut one, &[0.5, 0.1], &mut [0.0; 2])
}
