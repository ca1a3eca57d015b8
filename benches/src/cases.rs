//! What is measured: a signal, a number of operators, an algorithm and the way in which it is called.

use std::fmt;

use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
use serde::{Deserialize, Serialize};

use crate::signals::{REACH, Signal};

/// The numbers of operators that are compared.
pub const OPERATORS: [u32; 5] = [1, 20, 100, 1_000, 10_000];

/// The actuators of an array.
pub const ARRAY: u32 = 4_096;

/// The operators of each actuator of an array.
pub const ARRAY_OPERATORS: u32 = 20;

/// An actuator like the paper's with `operators` operators over +-500 V, in um.
///
/// # Panics
/// Never: uniform thresholds and positive weights are valid.
#[must_use]
pub fn actuator(operators: u32) -> ModifiedPrandtlIshlinskii {
    let n = f64::from(operators);
    let r: Vec<f64> = (0..operators).map(|i| REACH * f64::from(i) / n).collect();
    let weights: Vec<f64> = (0..operators).map(|i| if i == 0 { 4.3e-3 } else { 3.2e-3 / n }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default())
        .expect("uniform thresholds and positive weights are valid")
}

/// The algorithm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// The model.
    Forward,
    /// Its exact inverse, along the outputs of the model.
    Inverse,
    /// The exact inverse through two maps of three lines and three creep terms, along the outputs of that stage.
    StageInverse,
    /// The hybrid controller with its exact inverse, along the outputs of the model.
    Controller,
    /// The same behind a notch and two more second-order sections, with the observer of a stage with a resonance before its feedback.
    ObservedController,
    /// The yardstick: all operators evaluated for every sample.
    PlainLoop,
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
    /// One call for one sample of each actuator of an array.
    Array,
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
    /// How many operators the model has.
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

    /// Every case, the plain loop first within each signal and number of operators.
    #[must_use]
    pub fn all() -> Vec<Self> {
        const KINDS: [(What, Mode); 7] = [
            (What::PlainLoop, Mode::Step),
            (What::Forward, Mode::Step),
            (What::Inverse, Mode::Step),
            (What::Forward, Mode::Run),
            (What::Inverse, Mode::Run),
            (What::Forward, Mode::Array),
            (What::Inverse, Mode::Array),
        ];
        let mut cases = vec![Self::COPY];
        for signal in Signal::ALL {
            for operators in OPERATORS {
                let measured = |&(_, mode): &(What, Mode)| mode != Mode::Array || operators == ARRAY_OPERATORS;
                let kinds = KINDS.into_iter().filter(measured);
                cases.extend(kinds.map(|(what, mode)| Self { signal, operators, what, mode }));
            }
        }
        cases.extend([Self::STAGE_INVERSE, Self::CONTROLLER, Self::OBSERVED_CONTROLLER]);
        cases
    }

    /// What this case is compared with: the plain loop over as many operators along the same signal.
    #[must_use]
    pub fn yardstick(self) -> Self {
        Self { what: What::PlainLoop, mode: Mode::Step, ..self }
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
