//! A case made ready: streams in the state to which a repeated signal brings them, inputs and outputs at hand.

use std::hint::black_box;

use hysteresis_control::filters::{FeedbackFilter, Lead, LowPass, Notch, sections};
use hysteresis_control::linear::SecondOrder;
use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{
    CompiledModel, ControllerOptions, CreepTerms, Forward, HybridController, Inverse, ModifiedPrandtlIshlinskii,
    PiecewiseLinearMap, Process, QuasiStatic, Sections, StreamArray,
};

use crate::cases::{ARRAY, Case, Mode, What, actuator};
use crate::pass::Pass;
use crate::signals::REACH;
use crate::yardstick::{Copied, plain_loop, thinned};

/// The sampling interval of controllers in seconds.
const DT: f64 = 1e-4;

/// What is measured is one [`pass`](Self::pass); making the workload is not.
pub struct Workload(Box<dyn Pass>);

impl Workload {
    /// The case with memory, caches and predictors as in the long run. Each pass takes one second of the signal; there
    /// are `seconds` different ones, if it is noise: of few, a branch predictor learns each sample by heart.
    ///
    /// # Panics
    /// Never: the actuators are invertible.
    #[must_use]
    pub fn new(case: Case, seconds: u64) -> Self {
        let seconds = if case.signal.is_noise() && case.mode != Mode::Array { seconds } else { 1 };
        let drive: Vec<Vec<f64>> = (0..seconds).map(|second| case.signal.samples(second)).collect();
        let compiled = CompiledModel::new(&actuator(case.operators));
        match case.what {
            What::PlainLoop => {
                Self::stream(Mode::Step, plain_loop(&compiled), drive.iter().map(|x| thinned(x, case)).collect())
            }
            What::Copy => Self::warm(Copied::new(drive.concat())),
            What::Forward => Self::stream(case.mode, Forward::new(&compiled), drive),
            What::Inverse => {
                let mut stream = Inverse::new(&compiled, None).expect("the weights are positive");
                let targets = periodic_targets(&compiled, &drive, |target| _ = stream.step(target));
                Self::stream(case.mode, stream, targets)
            }
            What::StageInverse => {
                let stage = stage(&compiled);
                let mut stream = stage.inverse(Some((-REACH, REACH))).expect("the weights are positive");
                let mut forward = stage.forward();
                let mut periods = (0..2).map(|_| drive.iter().map(|second| through(&mut forward, second)).collect());
                let (before, targets): (Vec<Vec<f64>>, _) = (periods.next().unwrap_or_default(), periods.next());
                before.iter().flatten().for_each(|target| _ = stream.step(*target));
                Self::stream(case.mode, stream, targets.unwrap_or_default())
            }
            What::Controller | What::ObservedController => {
                let mut tracking = match case.what {
                    What::ObservedController => Tracking::observed(&compiled, actuator(case.operators)),
                    _ => Tracking::new(&compiled, Sections::default()),
                };
                let references = periodic_targets(&compiled, &drive, |reference| _ = tracking.step(reference));
                Self::stream(case.mode, tracking, references)
            }
        }
    }

    fn stream<P: Process + Clone + 'static>(mode: Mode, stream: P, seconds: Vec<Vec<f64>>) -> Self {
        match mode {
            Mode::Step => Self::warm(Steps { stream, input: Reel { seconds, now: 0 } }),
            Mode::Run => {
                let output = vec![0.0; seconds[0].len()];
                Self::warm(Run { stream, output, input: Reel { seconds, now: 0 } })
            }
            Mode::Array => Self::warm(Array::new(stream, &seconds[0])),
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

/// The outputs of a stream.
fn through(stream: &mut impl Process, input: &[f64]) -> Vec<f64> {
    input.iter().map(|x| stream.step(*x)).collect()
}

/// Hysteresis between two maps, with creep of 1.2 % per decade over 10 ms to 10 s at 10 kHz.
fn stage(compiled: &CompiledModel) -> QuasiStatic {
    let input_map = PiecewiseLinearMap::new(&[-REACH, -150.0, 150.0, REACH], &[-REACH, -160.0, 155.0, REACH]);
    let output_map = PiecewiseLinearMap::new(&[-3.0, -1.0, 1.0, 3.0], &[-3.0, -1.05, 1.1, 3.0]);
    let creep = CreepTerms::new(&[0.012; 3], &[0.9944, 0.999_44, 0.999_944]);
    QuasiStatic::new(compiled)
        .with_input_map(input_map.expect("the points rise"))
        .with_output_map(output_map.expect("the points rise"))
        .with_creep(creep.expect("the decays are between 0 and 1"))
}

/// A controller whose measurement lags by a sample: the error never rests. An observer may stand before its feedback.
#[derive(Clone)]
struct Tracking {
    controller: StageController,
    last: f64,
}

impl Tracking {
    fn new(compiled: &CompiledModel, filters: Sections) -> Self {
        let limits = (-1.1 * REACH, 1.1 * REACH);
        let inverse = Inverse::new(compiled, Some(limits)).expect("the weights are positive");
        let set = ControllerOptions::new(5.0, 6e3, DT, limits);
        let options = ControllerOptions { slew: Some(1e7), filters, ..set };
        let controller = HybridController::new(inverse.into(), None, &options).expect("the options are valid");
        Self { controller: controller.into(), last: 0.0 }
    }

    /// With a notch, two more sections, and the observer of a stage with a mode of 800 Hz and a sample of dead time.
    fn observed(compiled: &CompiledModel, hysteresis: ModifiedPrandtlIshlinskii) -> Self {
        let filters: [FeedbackFilter; 3] = [
            Notch::new(800.0, 0.0, 2.2).expect("a frequency").into(),
            LowPass::new(1500.0, Some(0.7)).expect("a frequency").into(),
            Lead::new(900.0, 2500.0).expect("two frequencies").into(),
        ];
        let mode = SecondOrder::new(800.0, 0.02).expect("a mode");
        let parts = StageParts { dynamics: mode.into(), dead_time: DT, ..StageParts::new(hysteresis) };
        let stage = Stage::new(parts).expect("the parts are valid");
        let observer = Observer::new(&stage, DT, &ObserverOptions { noise: 0.01, drift: 0.5 }).expect("it settles");
        let filters = sections(&filters, DT).expect("below half the sampling rate");
        let Self { controller, last } = Self::new(compiled, filters);
        Self { controller: controller.with_observer(observer).expect("the same interval"), last }
    }
}

impl Process for Tracking {
    fn step(&mut self, reference: f64) -> f64 {
        let measurement = core::mem::replace(&mut self.last, reference);
        self.controller.step(reference.into(), measurement)
    }

    fn peek(&self, reference: f64) -> f64 {
        self.controller.peek(reference.into(), self.last)
    }

    fn reset(&mut self) {
        self.controller.reset(None).expect("a start at the present drive");
    }
}

/// The outputs of the model along a drive that repeats for ever. What comes before, from rest, goes to `before`.
fn periodic_targets(compiled: &CompiledModel, drive: &[Vec<f64>], mut before: impl FnMut(f64)) -> Vec<Vec<f64>> {
    let mut plant = Forward::new(compiled);
    for x in drive.iter().flatten() {
        before(plant.step(*x));
    }
    drive.iter().map(|second| second.iter().map(|x| plant.step(*x)).collect()).collect()
}

/// A signal, second by second, for ever.
struct Reel {
    seconds: Vec<Vec<f64>>,
    now: usize,
}

impl Reel {
    fn samples(&self) -> usize {
        self.seconds[0].len()
    }

    fn next(&mut self) -> &[f64] {
        self.now = (self.now + 1) % self.seconds.len();
        &self.seconds[self.now]
    }
}

/// One call per sample.
struct Steps<P> {
    stream: P,
    input: Reel,
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
struct Run<P> {
    stream: P,
    input: Reel,
    output: Vec<f64>,
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

/// One sample for each actuator in one call. Actuator m is m [`AHEAD`] samples ahead in the signal, so that they do not
/// all leave their segments at once, nor one after the other.
struct Array<P> {
    streams: StreamArray<P>,
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

impl<P: Process + Clone> Array<P> {
    /// One stream goes through the signal and leaves a copy of itself wherever an actuator is.
    fn new(mut stream: P, signal: &[f64]) -> Self {
        let (width, period) = (ARRAY as usize, signal.len());
        let stride = (1..period).find(|stride| stride * AHEAD % period == 1).expect("no common divisor");
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
        let input = (0..period + width).map(|m| signal[m * AHEAD % period]).collect();
        Self { streams, input, period, stride, now: stride, output: vec![0.0; width] }
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
        let mut array = Array::new(Last(f64::NAN), &signal);
        for _ in 0..3 {
            let row = array.input[array.now..array.now + array.output.len()].to_vec();
            array.pass();
            let follows = |(before, now): (&f64, &f64)| (before + 1.0) % 10_000.0 == *now;
            assert!(array.output.iter().zip(&row).all(follows));
        }
    }
}
