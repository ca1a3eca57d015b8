//! The run: targets through the inverse, its drive through the forward stream, and what both must equal: a bank that is
//! fed what is left of the history after Madelung's deletions.

use core::fmt;

use hysteresis_core::{
    CompiledModel, Error, Forward, Inverse, MAX_MAGNITUDE, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios,
};

use crate::signal::{Mixed, Random};

/// How far streams and bank may be apart, of the range of the output: far above the roundings of one sum over the
/// operators, far below what accumulating them would come to.
pub const TOLERANCE: f64 = 1e-12;

/// The limits of the drive, in V.
const LIMITS: (f64, f64) = (-500.0, 500.0);

/// Moves that are tried at a checkpoint, evenly spaced over the limits.
const PROBES: u32 = 200;

/// An actuator like the paper's with any number of operators, their spacing and weights at random, and with offsets.
///
/// # Errors
/// None for at least one operator: thresholds grow and weights are positive.
pub fn actuator(operators: u32, seed: u64) -> Result<ModifiedPrandtlIshlinskii, Error> {
    let n = f64::from(operators);
    let mut random = Random::new(seed);
    let r: Vec<f64> =
        (0..operators).map(|i| 480.0 * (f64::from(i) + random.unit() * f64::from(i.min(1))) / n).collect();
    let weights: Vec<f64> = (0..operators).map(|i| if i == 0 { 4e-3 } else { 8e-3 * random.unit() / n }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets { input: 12.5, output: -3.0 })
}

/// The plain loop over all operators, at rest.
///
/// # Errors
/// None: there is one initial output per operator.
pub fn bank(compiled: &CompiledModel) -> Result<Forward, Error> {
    Forward::with_initial(compiled, &vec![0.0; compiled.operators()])
}

/// Two numbers that should have been equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure {
    /// How many samples there were before.
    pub sample: u64,
    /// Which numbers.
    pub what: &'static str,
    /// How far apart they were, of the range of the output.
    pub difference: f64,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sample, what, difference } = self;
        write!(f, "sample {sample}: {what}: {difference:e} of the range apart, more than {TOLERANCE:e}")
    }
}

impl std::error::Error for Failure {}

/// An actuator behind its inverse, both under test.
#[derive(Clone, Debug)]
pub struct Soak<F = Forward> {
    compiled: CompiledModel,
    signal: Mixed,
    inverse: Inverse,
    forward: F,
    history: Reduced,
    /// The outputs at the two limits, at rest.
    ends: (f64, f64),
    samples: u64,
    /// The last sample that was no bad number, and what became of it.
    target: f64,
    drive: f64,
    output: f64,
    /// The largest difference so far, of the range of the output.
    largest: f64,
}

impl Soak {
    /// The model's own streams.
    ///
    /// # Errors
    /// As [`Inverse::new`].
    pub fn new(model: &ModifiedPrandtlIshlinskii, seed: u64) -> Result<Self, Error> {
        Self::with_forward(model, seed, Forward::new)
    }
}

impl<F: Process> Soak<F> {
    /// The model's inverse and the given forward stream.
    ///
    /// # Errors
    /// As [`Inverse::new`].
    pub fn with_forward(
        model: &ModifiedPrandtlIshlinskii,
        seed: u64,
        forward: impl FnOnce(&CompiledModel) -> F,
    ) -> Result<Self, Error> {
        let compiled = CompiledModel::new(model);
        let (inverse, forward) = (Inverse::new(&compiled, Some(LIMITS))?, forward(&compiled));
        let ends = (forward.peek(LIMITS.0), forward.peek(LIMITS.1));
        let drive = model.offsets().input;
        let output = forward.peek(drive);
        Ok(Self {
            compiled,
            signal: Mixed::new(seed),
            inverse,
            history: Reduced::from_rest(drive),
            forward,
            ends,
            samples: 0,
            target: output,
            drive,
            output,
            largest: 0.0,
        })
    }

    /// The largest difference so far, of the range of the output.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// The longest reduced history so far.
    #[must_use]
    pub fn longest(&self) -> usize {
        self.history.longest()
    }

    /// Takes that many samples and compares both streams with a fresh bank.
    ///
    /// # Errors
    /// [`Failure`] for the first two numbers that differ.
    pub fn run(&mut self, samples: u64) -> Result<(), Failure> {
        for _ in 0..samples {
            self.step()?;
        }
        self.compare()
    }

    fn step(&mut self) -> Result<(), Failure> {
        let (low, high) = self.ends;
        let sample = 0.5 * (low + high) + 0.5 * (high - low) * self.signal.sample();
        self.samples += 1;
        if sample.is_nan() || sample.abs() > MAX_MAGNITUDE {
            return self.refuse(sample);
        }
        self.target = sample;
        self.drive = self.inverse.step(sample);
        self.output = self.forward.step(self.drive);
        self.history.push(self.drive);
        if self.inverse.saturated() {
            let at_limit = self.drive == LIMITS.0 || self.drive == LIMITS.1;
            return if at_limit { Ok(()) } else { Err(self.failure("saturated drive and limit", f64::INFINITY)) };
        }
        self.check("target and output", self.target - self.output)
    }

    /// Both streams hold on what is no admissible number.
    fn refuse(&mut self, sample: f64) -> Result<(), Failure> {
        let held = self.inverse.step(sample) == self.drive && self.forward.step(sample) == self.output;
        if held { Ok(()) } else { Err(self.failure("outputs before and after a refused sample", f64::INFINITY)) }
    }

    /// Everything that the streams remember against a fresh bank that has seen the reduced history.
    fn compare(&mut self) -> Result<(), Failure> {
        let mut fresh =
            bank(&self.compiled).map_err(|_| self.failure("operators and initial outputs", f64::INFINITY))?;
        let mut expected = fresh.peek(f64::NAN);
        for input in self.history.inputs() {
            expected = fresh.step(*input);
        }
        self.check("forward stream and fresh bank", self.output - expected)?;
        if !self.inverse.saturated() {
            self.check("target of the inverse and fresh bank", self.target - expected)?;
        }
        for k in 0..=PROBES {
            let input = LIMITS.0 + (LIMITS.1 - LIMITS.0) * f64::from(k) / f64::from(PROBES);
            let output = fresh.peek(input);
            self.check("next move of the forward stream and fresh bank", self.forward.peek(input) - output)?;
            let back = fresh.peek(self.inverse.peek(output));
            self.check("next move of the inverse and fresh bank", back - output)?;
        }
        Ok(())
    }

    /// Notes a difference of two outputs. NaN fails.
    fn check(&mut self, what: &'static str, difference: f64) -> Result<(), Failure> {
        let relative = difference.abs() / (self.ends.1 - self.ends.0);
        if relative <= TOLERANCE {
            self.largest = self.largest.max(relative);
            Ok(())
        } else {
            Err(self.failure(what, relative))
        }
    }

    fn failure(&self, what: &'static str, difference: f64) -> Failure {
        Failure { sample: self.samples, what, difference }
    }
}

/// The dominant extrema of an input that started at rest, the present input last.
///
/// Three deletions are enough, and each is exact, to the bit, for every operator z = max(lo(x), min(hi(x), z)) whose
/// lo <= hi never fall. Such an operator ends a rise to x at max(lo(x), z) and a fall to x at min(hi(x), z).
///
/// 1. Of a <= b <= c the middle one: max(lo(c), max(lo(b), z)) = max(lo(c), z).
/// 2. Of a <= c <= b <= d, the loop from b to c that closes inside the rise from a to d. From z <= hi(a) <= hi(c), the
///    loop makes min(hi(c), max(lo(b), z)), which is z, or lies between z and lo(b) <= lo(d): d is at max(lo(d), z)
///    with and without it.
/// 3. Of rest <= a, b, c with a <= c, the first extremum a. The operators rest at z = 0, so they reach a at 0 or, if
///    that is more, at lo(a). Where it is 0, a changed nothing. Where it is lo(a), z is at most lo(c) at b with a and
///    without it, so that c takes it to lo(c).
///
/// The same holds with all signs turned. What remains alternates, every swing shorter than the one before it.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// Where the input rested, then the extrema.
    inputs: Vec<f64>,
    longest: usize,
}

impl Reduced {
    /// The history of an input that has rested at `rest` for ever.
    #[must_use]
    pub fn from_rest(rest: f64) -> Self {
        Self { inputs: vec![rest], longest: 0 }
    }

    /// Takes the next input.
    pub fn push(&mut self, input: f64) {
        self.inputs.push(input);
        while self.delete() {}
        self.longest = self.longest.max(self.inputs.len() - 1);
    }

    /// The inputs that a stream at rest must see to remember what it would after the whole history.
    #[must_use]
    pub fn inputs(&self) -> &[f64] {
        &self.inputs[1..]
    }

    /// How many inputs were ever kept at a time.
    #[must_use]
    pub fn longest(&self) -> usize {
        self.longest
    }

    /// One deletion, if any is due.
    fn delete(&mut self) -> bool {
        let last = self.inputs.len() - 1;
        let gone = match self.inputs[..] {
            [.., a, b, c] if is_between(a, b, c) => last - 1..last,
            [.., a, b, c, d] if is_between(a, b, d) && is_between(a, c, d) => last - 2..last,
            [rest, a, _, c] if is_between(rest, a, c) => 1..2,
            _ => return false,
        };
        self.inputs.drain(gone);
        true
    }
}

/// Whether b lies between a and c, or is one of them.
fn is_between(a: f64, b: f64, c: f64) -> bool {
    a <= b && b <= c || a >= b && b >= c
}
