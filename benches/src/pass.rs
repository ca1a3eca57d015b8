//! What is measured: some samples in one call.

use std::hint::black_box;

use hysteresis_core::{Process, StreamArray};

use crate::cases::ARRAY;

/// Some samples in one call, so that the call itself does not count.
pub(crate) trait Pass {
    /// How many samples a pass takes.
    fn samples(&self) -> usize;
    /// Takes them.
    fn pass(&mut self);
}

/// A signal, second by second, for ever.
pub(crate) struct Reel {
    seconds: Vec<Vec<f64>>,
    now: usize,
}

impl Reel {
    pub(crate) fn new(seconds: Vec<Vec<f64>>) -> Self {
        Self { seconds, now: 0 }
    }

    pub(crate) fn samples(&self) -> usize {
        self.seconds[0].len()
    }

    pub(crate) fn next(&mut self) -> &[f64] {
        self.now = (self.now + 1) % self.seconds.len();
        &self.seconds[self.now]
    }
}

/// One call per sample.
pub(crate) struct Steps<P> {
    pub(crate) stream: P,
    pub(crate) input: Reel,
}

impl<P: Process> Pass for Steps<P> {
    fn samples(&self) -> usize {
        self.input.samples()
    }

    fn pass(&mut self) {
        for x in self.input.next() {
            black_box(self.stream.step(*x));
        }
    }
}

/// One call for all samples.
pub(crate) struct Run<P> {
    pub(crate) stream: P,
    pub(crate) input: Reel,
    pub(crate) output: Vec<f64>,
}

impl<P: Process> Pass for Run<P> {
    fn samples(&self) -> usize {
        self.input.samples()
    }

    fn pass(&mut self) {
        self.stream.run(black_box(self.input.next()), black_box(&mut self.output)).expect("the same length");
        black_box(&self.output);
    }
}

/// Actuators that take a sample each in one call.
pub(crate) trait Actuators {
    fn step(&mut self, inputs: &[f64], outputs: &mut [f64]);
}

impl<P: Process> Actuators for StreamArray<P> {
    fn step(&mut self, inputs: &[f64], outputs: &mut [f64]) {
        self.step(inputs, outputs).expect("the same length");
    }
}

/// One sample for each actuator in one call. Actuator m is m [`AHEAD`] samples ahead in the signal, so that they do not
/// all leave their segments at once, nor one after the other.
pub(crate) struct Array<A> {
    actuators: A,
    /// The signal in steps of [`AHEAD`], and its beginning once more: the row of every moment is a slice of it.
    input: Vec<f64>,
    /// How many samples there are before the signal repeats.
    period: usize,
    /// How far the row of the next moment lies behind that of this one.
    stride: usize,
    /// Where the next row begins.
    now: usize,
    output: Vec<f64>,
}

/// No divisor of the period, and near its golden section: neighbours are far apart.
const AHEAD: usize = 6_181;

/// How far in a row the same moment lies behind the moment before.
fn stride(period: usize) -> usize {
    (1..period).find(|stride| stride * AHEAD % period == 1).expect("no common divisor")
}

impl<P: Process + Clone> Array<StreamArray<P>> {
    /// Actuators that are all alike: one stream goes through the signal and leaves a copy of itself wherever one is.
    pub(crate) fn alike(mut stream: P, signal: &[f64]) -> Self {
        let (width, period) = (ARRAY as usize, signal.len());
        let stride = stride(period);
        for x in signal {
            stream.step(*x);
        }
        let mut left: Vec<(usize, P)> = Vec::with_capacity(width);
        for (at, x) in signal.iter().enumerate() {
            stream.step(*x);
            let actuator = at * stride % period;
            if actuator < width {
                left.push((actuator, stream.clone()));
            }
        }
        left.sort_by_key(|(actuator, _)| *actuator);
        let streams = left.into_iter().map(|(_, stream)| stream).collect();
        Self { now: stride, ..Self::at_rest(streams, signal) }
    }
}

impl<A: Actuators> Array<A> {
    fn at_rest(actuators: A, signal: &[f64]) -> Self {
        let (width, period) = (ARRAY as usize, signal.len());
        let input = (0..period + width).map(|m| signal[m * AHEAD % period]).collect();
        Self { actuators, input, period, stride: stride(period), now: 0, output: vec![0.0; width] }
    }

    /// Actuators that may differ, after `moments` of the signal.
    pub(crate) fn after(moments: usize, actuators: A, signal: &[f64]) -> Self {
        let mut array = Self::at_rest(actuators, signal);
        (0..moments).for_each(|_| array.pass());
        array
    }
}

impl<A: Actuators> Pass for Array<A> {
    fn samples(&self) -> usize {
        self.output.len()
    }

    fn pass(&mut self) {
        let row = &self.input[self.now..self.now + self.output.len()];
        self.actuators.step(black_box(row), black_box(&mut self.output));
        black_box(&self.output);
        self.now = (self.now + self.stride) % self.period;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Remembers its last sample.
    #[derive(Clone)]
    struct Last(f64);

    impl Process for Last {
        fn step(&mut self, input: f64) -> f64 {
            core::mem::replace(&mut self.0, input)
        }
        fn peek(&self, _: f64) -> f64 {
            self.0
        }
        fn reset(&mut self) {}
    }

    #[test]
    fn every_actuator_of_an_array_gets_one_sample_of_the_signal_after_the_other() {
        let signal: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut array = Array::alike(Last(f64::NAN), &signal);
        for _ in 0..3 {
            let row = array.input[array.now..array.now + array.output.len()].to_vec();
            array.pass();
            let follows = |(before, now): (&f64, &f64)| (before + 1.0) % 10_000.0 == *now;
            assert!(array.output.iter().zip(&row).all(follows));
        }
    }
}
