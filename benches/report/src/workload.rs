//! A case made ready: streams in the state to which a repeated signal brings them, inputs and outputs at hand.

use std::hint::black_box;

use hysteresis_control::filters::{FeedbackFilter, Lead, LowPass, Notch, sections};
use hysteresis_control::linear::SecondOrder;
use hysteresis_control::oscillator::{HystereticOscillator, OscillatorForward};
use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{
    CompiledModel, ControllerOptions, CreepTerms, DuhemForward, DuhemInverse, Forward, HybridController, Inverse,
    Method, ModifiedPrandtlIshlinskii, PiecewiseLinearMap, Process, QuasiStatic, Sections, StreamArray,
};

use yardsticks::{BESIDE, FusedLoop, PlainLoop, REACH, actuator, duhem, duhem_inside, individual};

use crate::cases::{ARRAY, Case, Mode, What};

/// The sampling interval of controllers and oscillators in seconds.
const DT: f64 = 1e-4;

/// The periods of a second of [`Signal::Stroke`].
const STROKES: usize = 5;

/// What is measured is one [`pass`](Self::pass); making the workload is not.
pub struct Workload(Box<dyn Pass>);

impl Workload {
    /// The case with memory, caches and predictors as in the long run. Each pass takes one second of the signal; there
    /// are `seconds` different ones, if it is noise: of few, a branch predictor learns each sample by heart.
    ///
    /// # Panics
    /// If this processor does not have the instructions of the case.
    #[must_use]
    pub fn new(case: Case, seconds: u64) -> Self {
        let seconds = if case.signal.is_noise() && case.mode != Mode::Array { seconds } else { 1 };
        let drive: Vec<Vec<f64>> = (0..seconds).map(|second| case.signal.samples(second)).collect();
        if case.mode == Mode::Individual {
            return Self::individual(case, &drive[0]);
        }
        let compiled = CompiledModel::new(&actuator(case.operators));
        match case.what {
            What::FusedLoop | What::FusedLoopV3 | What::FusedLoopV4 => {
                let operators = fused(&[actuator(case.operators)], case.what);
                let input = Reel::new(drive.iter().map(|x| case.thinned(x)).collect());
                Self::warm(FusedSteps { operators, input })
            }
            What::PlainLoop => {
                let plain = PlainLoop::new(&actuator(case.operators));
                Self::stream(Mode::Step, plain, drive.iter().map(|x| case.thinned(x)).collect())
            }
            What::Copy => Self::warm(Copied::new(drive.concat())),
            What::Forward => Self::stream(case.mode, Forward::new(&compiled), drive),
            What::Bank => {
                let stream = Forward::with_method(&compiled, Method::Bank).expect("any model has a bank");
                Self::stream(case.mode, stream, drive)
            }
            What::Inverse | What::BankInverse => {
                let method = if case.what == What::Inverse { Method::TurningPoints } else { Method::Bank };
                let stream = Inverse::with_method(&compiled, None, method);
                let mut stream = stream.expect("positive weights and nested thresholds");
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
            What::Duhem => Self::stream(case.mode, DuhemForward::new(duhem()), drive),
            What::DuhemInverse => {
                let mut stream = DuhemInverse::new(duhem(), BESIDE).expect("both slopes are above 0");
                let mut plant = DuhemForward::new(duhem());
                let sum = |x: f64| BESIDE * x + plant.step(x);
                let targets = periodic_outputs(sum, &drive, |target| _ = stream.step(target));
                Self::stream(case.mode, stream, targets)
            }
            What::Oscillator => Self::stream(case.mode, oscillator(), drive),
        }
    }

    /// Actuators with individual models after a period of the signal, from which on their states repeat themselves. The
    /// inverses go along the outputs of the actuator in their middle.
    fn individual(case: Case, drive: &[f64]) -> Self {
        let models: Vec<_> = (0..ARRAY).map(|m| individual(case.operators, m.into())).collect();
        let compiled: Vec<_> = models.iter().map(CompiledModel::new).collect();
        let moments = drive.len() / STROKES;
        match case.what {
            What::Forward => Self::warm(Array::after(moments, StreamArray::forward(&compiled), drive)),
            What::Inverse => {
                let middle = CompiledModel::new(&actuator(case.operators));
                let targets = periodic_targets(&middle, &[drive.to_vec()], |_| ()).concat();
                let streams = StreamArray::inverse(&compiled, None).expect("the weights are positive");
                Self::warm(Array::after(moments, streams, &targets))
            }
            What::PlainLoop => {
                let streams: StreamArray<PlainLoop> = models.iter().map(PlainLoop::new).collect();
                Self::warm(Array::after(moments, streams, drive))
            }
            what => Self::warm(Array::after(moments, fused(&models, what), drive)),
        }
    }

    fn stream<P: Process + Clone + 'static>(mode: Mode, stream: P, seconds: Vec<Vec<f64>>) -> Self {
        match mode {
            Mode::Step => Self::warm(Steps { stream, input: Reel::new(seconds) }),
            Mode::Run => {
                let output = vec![0.0; seconds[0].len()];
                Self::warm(Run { stream, output, input: Reel::new(seconds) })
            }
            Mode::Array | Mode::Individual => Self::warm(Array::alike(stream, &seconds[0])),
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

/// The fused loop of a case, which [`Case::all`] has only where the processor can run it.
fn fused(models: &[ModifiedPrandtlIshlinskii], what: What) -> FusedLoop {
    let instructions = what.instructions().expect("a fused loop");
    FusedLoop::new(models, instructions).unwrap_or_else(|| panic!("this processor has no {}", instructions.name()))
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
fn periodic_targets(compiled: &CompiledModel, drive: &[Vec<f64>], before: impl FnMut(f64)) -> Vec<Vec<f64>> {
    let mut plant = Forward::new(compiled);
    periodic_outputs(|x| plant.step(x), drive, before)
}

/// The same of anything that steps.
fn periodic_outputs(
    mut step: impl FnMut(f64) -> f64,
    drive: &[Vec<f64>],
    mut before: impl FnMut(f64),
) -> Vec<Vec<f64>> {
    for x in drive.iter().flatten() {
        before(step(*x));
    }
    drive.iter().map(|second| second.iter().map(|x| step(*x)).collect()).collect()
}

/// The public Bouc-Wen benchmark with another operator inside, at the sampling rate of the signals: four sub-steps a
/// sample.
fn oscillator() -> OscillatorForward {
    let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, duhem_inside()).expect("the parameters are valid");
    OscillatorForward::new(&oscillator, DT, None).expect("the interval resolves a period")
}

/// Some samples in one call, so that the call itself does not count.
trait Pass {
    /// How many samples a pass takes.
    fn samples(&self) -> usize;
    /// Takes them.
    fn pass(&mut self);
}

/// A signal, second by second, for ever.
struct Reel {
    seconds: Vec<Vec<f64>>,
    now: usize,
}

impl Reel {
    fn new(seconds: Vec<Vec<f64>>) -> Self {
        Self { seconds, now: 0 }
    }

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

/// The loop along a signal: one sample after the other, as a control loop takes them.
struct FusedSteps {
    operators: FusedLoop,
    input: Reel,
}

impl Pass for FusedSteps {
    fn samples(&self) -> usize {
        self.input.samples()
    }

    fn pass(&mut self) {
        self.operators.steps(self.input.next(), |y| _ = black_box(y));
    }
}

/// Copying the samples: what no `run` into an output can undercut.
struct Copied {
    input: Vec<f64>,
    output: Vec<f64>,
}

impl Copied {
    fn new(input: Vec<f64>) -> Self {
        Self { output: vec![0.0; input.len()], input }
    }
}

impl Pass for Copied {
    fn samples(&self) -> usize {
        self.input.len()
    }

    fn pass(&mut self) {
        black_box(&mut self.output).copy_from_slice(black_box(&self.input));
        black_box(&self.output);
    }
}

/// Actuators that take a sample each in one call.
trait Actuators {
    fn step(&mut self, inputs: &[f64], outputs: &mut [f64]);
}

impl<P: Process> Actuators for StreamArray<P> {
    fn step(&mut self, inputs: &[f64], outputs: &mut [f64]) {
        self.step(inputs, outputs).expect("the same length");
    }
}

impl Actuators for FusedLoop {
    fn step(&mut self, inputs: &[f64], outputs: &mut [f64]) {
        self.step_each(inputs, outputs);
    }
}

/// One sample for each actuator in one call. Actuator m is m [`AHEAD`] samples ahead in the signal, so that they do not
/// all leave their segments at once, nor one after the other.
struct Array<A> {
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
    fn alike(mut stream: P, signal: &[f64]) -> Self {
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
    fn after(moments: usize, actuators: A, signal: &[f64]) -> Self {
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
    use yardsticks::Signal;

    use super::*;

    #[test]
    fn a_pass_takes_as_many_samples_as_its_case_says() {
        for case in Case::all() {
            let small = case.signal == Signal::SlowSine && case.operators <= 1_000;
            if small && case.mode != Mode::Array {
                assert_eq!(Workload::new(case, 1).samples(), case.samples() as usize, "{case}");
            }
        }
        let individual = Case { operators: 2, ..Case::INDIVIDUAL };
        for what in What::YARDSTICKS.into_iter().filter(|what| what.is_here()).chain([What::Inverse]) {
            assert_eq!(Workload::new(Case { what, ..individual }, 1).samples(), individual.samples() as usize);
        }
    }

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
