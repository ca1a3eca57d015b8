//! A case made ready: streams in the state to which a repeated signal brings them, inputs and outputs at hand.

use std::hint::black_box;

use hysteresis_core::{Forward, Inverse, Kernel, Process, StreamArray};

use crate::cases::{ARRAY, Case, Mode, What, actuator};
use crate::yardstick::{Copied, plain_loop, thinned};

/// What is measured is one [`pass`](Self::pass); making the workload is not.
pub struct Workload(Box<dyn Pass>);

/// Some samples in one call, so that the call itself does not count.
pub(crate) trait Pass {
    /// How many samples a pass takes.
    fn samples(&self) -> usize;
    /// Takes them.
    fn pass(&mut self);
}

impl Workload {
    /// The case with memory, caches and predictors as in the long run.
    ///
    /// # Panics
    /// Never: the actuators are invertible.
    #[must_use]
    pub fn new(case: Case) -> Self {
        let drive = case.signal.samples(1);
        let kernel = Kernel::new(&actuator(case.operators));
        match case.what {
            What::PlainLoop => Self::warm(Steps { stream: plain_loop(&kernel), input: thinned(&drive, case) }),
            What::Copy => Self::warm(Copied::new(drive)),
            What::Forward => Self::stream(case.mode, Forward::new(&kernel), drive),
            What::Inverse => {
                let mut stream = Inverse::new(&kernel, None).expect("the weights are positive");
                let targets = periodic_targets(&kernel, &drive, |target| _ = stream.step(target));
                Self::stream(case.mode, stream, targets)
            }
        }
    }

    fn stream<P: Process + Clone + 'static>(mode: Mode, stream: P, input: Vec<f64>) -> Self {
        match mode {
            Mode::Step => Self::warm(Steps { stream, input }),
            Mode::Run => Self::warm(Run { stream, output: vec![0.0; input.len()], input }),
            Mode::Array => Self::warm(Array::new(stream, &input)),
        }
    }

    fn warm(pass: impl Pass + 'static) -> Self {
        let mut workload = Self(Box::new(pass));
        workload.pass();
        workload
    }

    /// How many samples a pass takes.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.0.samples()
    }

    /// Takes the samples of one pass.
    pub fn pass(&mut self) {
        self.0.pass();
    }
}

/// The outputs of the model along a drive that repeats for ever. What comes before, from rest, goes to `before`.
fn periodic_targets(kernel: &Kernel, drive: &[f64], mut before: impl FnMut(f64)) -> Vec<f64> {
    let mut plant = Forward::new(kernel);
    for x in drive {
        before(plant.step(*x));
    }
    drive.iter().map(|x| plant.step(*x)).collect()
}

/// One call per sample.
struct Steps<P> {
    stream: P,
    input: Vec<f64>,
}

impl<P: Process> Pass for Steps<P> {
    fn samples(&self) -> usize {
        self.input.len()
    }

    fn pass(&mut self) {
        for x in &self.input {
            black_box(self.stream.step(*x));
        }
    }
}

/// One call for all samples.
struct Run<P> {
    stream: P,
    input: Vec<f64>,
    output: Vec<f64>,
}

impl<P: Process> Pass for Run<P> {
    fn samples(&self) -> usize {
        self.input.len()
    }

    fn pass(&mut self) {
        self.stream.run(black_box(&self.input), black_box(&mut self.output)).expect("the same length");
        black_box(&self.output);
    }
}

/// One sample for each actuator in one call. Actuator m is m samples ahead in the signal, so that they do not all leave
/// their segments at once, and the row of every moment is a slice of the signal.
struct Array<P> {
    streams: StreamArray<P>,
    /// The signal and its beginning once more.
    input: Vec<f64>,
    /// How many rows there are before the signal repeats.
    period: usize,
    now: usize,
    output: Vec<f64>,
}

impl<P: Process + Clone> Array<P> {
    /// One stream goes through the signal and leaves a copy of itself at each of the first samples.
    fn new(mut stream: P, signal: &[f64]) -> Self {
        for x in signal {
            stream.step(*x);
        }
        let width = ARRAY as usize;
        let mut left_at = |x: &f64| {
            stream.step(*x);
            stream.clone()
        };
        let streams = signal[..width].iter().map(&mut left_at).collect();
        let input = signal.iter().cycle().take(signal.len() + width).copied().collect();
        Self { streams, input, period: signal.len(), now: 1, output: vec![0.0; width] }
    }
}

impl<P: Process> Pass for Array<P> {
    fn samples(&self) -> usize {
        self.output.len()
    }

    fn pass(&mut self) {
        let row = &self.input[self.now..self.now + self.output.len()];
        self.streams.step(black_box(row), black_box(&mut self.output)).expect("the same length");
        black_box(&self.output);
        self.now = (self.now + 1) % self.period;
    }
}
