//! What is measured: a signal, a number of operators, an algorithm and the way in which it is called.

use std::fmt;

use serde::{Deserialize, Serialize};
use yardsticks::{Instructions, SAMPLES, Signal};

/// The numbers of operators that are compared.
pub const OPERATORS: [u32; 5] = [1, 20, 100, 1_000, 10_000];

/// Up to so many operators the bank is measured: it is there for few.
pub const FEW: u32 = 100;

/// The actuators of an array.
pub const ARRAY: u32 = 4_096;

/// The operators of each actuator of an array.
pub const ARRAY_OPERATORS: u32 = 20;

/// The signals of a Duhem operator: a smooth, a noisy and the worst one.
pub const DUHEM_SIGNALS: [Signal; 3] = [Signal::SlowSine, Signal::NoisySine, Signal::White];

/// The algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// The model.
    Forward,
    /// The same by the bank, which computes all operators.
    Bank,
    /// Its exact inverse, along the outputs of the model.
    Inverse,
    /// The same by the bank.
    BankInverse,
    /// The exact inverse through two maps of three lines and three creep terms, along the outputs of that stage.
    StageInverse,
    /// The hybrid controller with its exact inverse, along the outputs of the model.
    Controller,
    /// The same behind a notch and two more second-order sections, with the observer of a stage with a resonance before
    /// its feedback.
    ObservedController,
    /// A Duhem operator of nine knots.
    Duhem,
    /// The exact inverse of the same beside a slope, along the outputs of both.
    DuhemInverse,
    /// An oscillator of one mode with such an operator inside.
    Oscillator,
    /// The yardstick: all operators evaluated for every sample.
    PlainLoop,
    /// The other yardstick: all operators in one fused loop over vectors, of instructions that any processor has.
    FusedLoop,
    /// The same for x86-64-v3.
    FusedLoopV3,
    /// The same for x86-64-v4.
    FusedLoopV4,
    /// The samples copied from one array to another: what `run` cannot beat.
    Copy,
}

/// How the algorithm is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// One call per sample.
    Step,
    /// One call per signal.
    Run,
    /// One call for one sample of each actuator of an array, all of one model.
    Array,
    /// The same with a model for each actuator.
    Individual,
}

impl What {
    /// What the others are compared with: loops over all operators.
    pub const YARDSTICKS: [Self; 4] = [Self::PlainLoop, Self::FusedLoop, Self::FusedLoopV3, Self::FusedLoopV4];

    /// What has a Duhem operator.
    pub const DUHEM: [Self; 3] = [Self::Duhem, Self::DuhemInverse, Self::Oscillator];

    /// The instructions of a fused loop.
    #[must_use]
    pub fn instructions(self) -> Option<Instructions> {
        match self {
            Self::FusedLoop => Some(Instructions::Portable),
            Self::FusedLoopV3 => Some(Instructions::V3),
            Self::FusedLoopV4 => Some(Instructions::V4),
            _ => None,
        }
    }

    /// Whether this machine can run it.
    #[must_use]
    pub fn is_here(self) -> bool {
        self.instructions().is_none_or(Instructions::are_here)
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// One thing to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Case {
    /// What drives it.
    pub signal: Signal,
    /// How many operators the model has. A Duhem operator is one.
    pub operators: u32,
    /// The algorithm.
    pub what: What,
    /// How it is called.
    pub mode: Mode,
}

impl Case {
    /// Copying an array.
    pub const COPY: Self = Self { signal: Signal::SlowSine, operators: 1, what: What::Copy, mode: Mode::Run };

    /// A sample of the controller.
    pub const CONTROLLER: Self =
        Self { signal: Signal::SlowSine, operators: 20, what: What::Controller, mode: Mode::Step };

    /// A sample of the controller with filters and observer.
    pub const OBSERVED_CONTROLLER: Self = Self { what: What::ObservedController, ..Self::CONTROLLER };

    /// A sample of the inverse of a stage with maps and creep.
    pub const STAGE_INVERSE: Self =
        Self { signal: Signal::SlowSine, operators: 20, what: What::StageInverse, mode: Mode::Step };

    /// A sample of a Duhem operator.
    pub const DUHEM: Self = Self { signal: Signal::SlowSine, operators: 1, what: What::Duhem, mode: Mode::Step };

    /// One sample of each of many actuators with individual models.
    pub const INDIVIDUAL: Self =
        Self { signal: Signal::Stroke, operators: ARRAY_OPERATORS, what: What::Forward, mode: Mode::Individual };

    /// Every case that this machine can run, the yardsticks first within each signal and number of operators.
    #[must_use]
    pub fn all() -> Vec<Self> {
        const KINDS: [(What, Mode); 11] = [
            (What::Forward, Mode::Step),
            (What::Bank, Mode::Step),
            (What::Bank, Mode::Run),
            (What::Inverse, Mode::Step),
            (What::BankInverse, Mode::Step),
            (What::BankInverse, Mode::Run),
            (What::Forward, Mode::Run),
            (What::Inverse, Mode::Run),
            (What::Forward, Mode::Array),
            (What::Inverse, Mode::Array),
            (What::Bank, Mode::Array),
        ];
        let mut cases = vec![Self::COPY];
        for signal in Signal::ALL {
            for operators in OPERATORS {
                let measured = |&(what, mode): &(What, Mode)| {
                    let by_bank = matches!(what, What::Bank | What::BankInverse);
                    (mode != Mode::Array || operators == ARRAY_OPERATORS) && (!by_bank || operators <= FEW)
                };
                let kinds = What::YARDSTICKS.map(|what| (what, Mode::Step)).into_iter().chain(KINDS);
                cases.extend(kinds.filter(measured).map(|(what, mode)| Self { signal, operators, what, mode }));
            }
        }
        let individual = What::YARDSTICKS.into_iter().chain([What::Forward, What::Inverse]);
        cases.extend(individual.map(|what| Self { what, ..Self::INDIVIDUAL }));
        cases.extend([Self::STAGE_INVERSE, Self::CONTROLLER, Self::OBSERVED_CONTROLLER]);
        for signal in DUHEM_SIGNALS {
            cases.extend(What::DUHEM.map(|what| Self { signal, what, ..Self::DUHEM }));
        }
        cases.retain(|case| case.what.is_here());
        cases
    }

    /// The cases whose instructions are counted. Valgrind knows no AVX-512, and counts a copy by bytes: one
    /// instruction repeats itself.
    #[must_use]
    pub fn counted() -> Vec<Self> {
        let all = Self::all().into_iter();
        all.filter(|case| !matches!(case.what, What::Copy | What::FusedLoopV4)).collect()
    }

    /// What this case is compared with: a loop over as many operators along the same signal. It takes sample by sample
    /// what the case may take in one call; only where every actuator has parameters of its own the loop has them too.
    #[must_use]
    pub fn beside(self, yardstick: What) -> Self {
        let mode = if self.mode == Mode::Individual { Mode::Individual } else { Mode::Step };
        Self { what: yardstick, mode, ..self }
    }

    /// How many samples a pass takes.
    #[must_use]
    pub fn samples(self) -> u32 {
        match self.mode {
            Mode::Array | Mode::Individual => ARRAY,
            Mode::Step | Mode::Run => SAMPLES.div_ceil(self.thinning()),
        }
    }

    /// Every how manieth sample of the signal a loop takes: what a sample costs there does not depend on the sample,
    /// and over many operators a whole second would take minutes.
    fn thinning(self) -> u32 {
        let loops = self.mode == Mode::Step && What::YARDSTICKS.contains(&self.what);
        if loops { (self.operators / 100).max(1) } else { 1 }
    }

    /// The samples of a second that this case takes.
    pub(crate) fn thinned(self, drive: &[f64]) -> Vec<f64> {
        drive.iter().step_by(self.thinning() as usize).copied().collect()
    }

    /// The algorithm and the way it is called, as one word.
    #[must_use]
    pub fn kind(self) -> String {
        format!("{}-{}", self.what, self.mode)
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, n = {}, {} {}", self.signal, self.operators, self.what, self.mode)
    }
}
