use crate::error::{Error, check_all_finite, check_finite, is_admissible};
use crate::process::Process;

/// A rate-independent operator whose whole memory is its last output.
pub trait Operator {
    /// The new output z(k) from the last output z(k-1) and the new input x(k).
    fn next(&self, last_output: f64, input: f64) -> f64;
}

/// An operator with its state.
///
/// ```
/// use hysteresis_core::{CoupledPlay, Process, Tracked};
/// let mut z = Tracked::new(CoupledPlay::new(10.0, 8.0, 3.0, 4.0)?); // Fig. 5 of the paper
/// let walk = [0.0, 20.0, -20.0, 15.0, 6.0, 25.0, -15.0, -5.0].map(|x| z.step(x));
/// assert_eq!(walk, [0.0, 10.0, -12.0, 5.0, 5.0, 15.0, -7.0, -7.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked<O> {
    operator: O,
    output: f64,
    rejected: u64,
}

impl<O: Operator> Tracked<O> {
    /// The operator at rest: z = 0, projected onto the reachable interval by the first sample.
    pub fn new(operator: O) -> Self {
        Self { operator, output: 0.0, rejected: 0 }
    }

    /// The operator's parameters.
    pub fn operator(&self) -> &O {
        &self.operator
    }

    /// The last output, in the unit of the input: the whole memory of the operator.
    pub fn state(&self) -> f64 {
        self.output
    }

    /// Continues from the output `state`; the next sample projects it onto the reachable interval (erratum 6).
    ///
    /// # Errors
    /// [`Error::Domain`] unless `state` is finite.
    pub fn set_state(&mut self, state: f64) -> Result<(), Error> {
        self.output = check_finite("state", None, state)?;
        Ok(())
    }

    /// Takes over the inputs before, oldest first.
    ///
    /// # Errors
    /// [`Error::Domain`] for an input that is not finite; nothing is taken then.
    pub fn follow(&mut self, inputs: &[f64]) -> Result<(), Error> {
        check_all_finite("inputs", inputs)?;
        for input in inputs {
            self.step(*input);
        }
        Ok(())
    }

    /// How many inputs were not finite (or beyond 1e100) and left output and state as they were.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }
}

impl<O: Operator> Process for Tracked<O> {
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        if is_admissible(input) {
            self.output = self.operator.next(self.output, input);
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.output
    }

    #[inline]
    fn peek(&self, input: f64) -> f64 {
        if is_admissible(input) { self.operator.next(self.output, input) } else { self.output }
    }

    fn reset(&mut self) {
        self.output = 0.0;
        self.rejected = 0;
    }
}
