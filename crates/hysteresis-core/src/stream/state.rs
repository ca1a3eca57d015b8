use crate::engine::MemoryState;
use crate::error::{Bound, Error, is_admissible};

/// Everything that a stream remembers: restored, it continues bit for bit; by a bank, on a processor of the same kind.
///
/// A stream of the other [`Method`](crate::Method) takes the state too, and goes on with the same outputs to 1e-12 of the range.
/// Operator outputs that no drive leads to, as arbitrary initial ones may be, are known to a bank alone.
///
/// ```
/// use hysteresis_core::{CompiledModel, Forward, Method, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let actuator = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let mut stream = actuator.forward();
/// stream.step(300.0);
/// let saved = stream.state();
/// let next = stream.step(-100.0);
/// let mut other = actuator.forward();
/// other.set_state(&saved)?;
/// assert_eq!(other.step(-100.0), next);
///
/// let mut bank = Forward::with_method(&CompiledModel::new(&actuator), Method::Bank)?;
/// bank.set_state(&saved)?;
/// assert!((bank.step(-100.0) - next).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct StreamState {
    /// The fingerprint of the model: a state is restored into a stream of the same model only.
    pub model: u64,
    /// The last accepted sample, relative to the offset of the model on that side (for an inverse at a limit: the
    /// output that the limit allows).
    pub last_input: f64,
    /// The last output, relative to the offset of the model on that side.
    pub last_output: f64,
    /// Whether the last target was out of reach (inverse only).
    pub saturated: bool,
    /// How many inputs were rejected.
    pub rejected: u64,
    /// What the operators remember.
    #[cfg_attr(feature = "serde", serde(with = "super::memory_form"))]
    pub memory: MemoryState,
}

impl StreamState {
    pub(super) fn check_model(&self, expected: u64) -> Result<(), Error> {
        check_model(expected, self.model)
    }
}

/// Whether a saved state belongs to the model with the fingerprint `expected`.
pub(crate) fn check_model(expected: u64, got: u64) -> Result<(), Error> {
    if expected == got { Ok(()) } else { Err(Error::OtherModel { expected, got }) }
}

/// An admissible input in a saved state, relative to an offset that is admissible too.
pub(super) fn check_input(parameter: &'static str, got: f64) -> Result<(), Error> {
    if is_admissible(0.5 * got) {
        Ok(())
    } else {
        Err(Error::Domain { parameter, index: None, expected: Bound::Finite, got })
    }
}

/// An output of the model in a saved state: inputs and weights of any admissible size may have made it larger than they.
pub(super) fn check_output(parameter: &'static str, got: f64) -> Result<(), Error> {
    if got.is_finite() { Ok(()) } else { Err(Error::Domain { parameter, index: None, expected: Bound::Finite, got }) }
}
