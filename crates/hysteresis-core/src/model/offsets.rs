use crate::engine::Point;
use crate::error::{Error, check_finite};
use crate::real::Real;

/// Where the model's own zero lies: y = output + sum of w_i H_i\[x - input\].
///
/// `input` in the unit of the input moves the sticky zero of the coupled play (unipolar drives), `output` in the
/// unit of the output is the reading of the sensor at the model's zero.
///
/// ```
/// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
/// let offsets = Offsets { input: 2.0, output: -100.0 };
/// let model = PrandtlIshlinskii::new(&[10.0], &[0.0], offsets)?;
/// assert_eq!(model.forward().step(3.0), -90.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offsets {
    /// Subtracted from the input, in the unit of the input.
    pub input: f64,
    /// Added to the output, in the unit of the output.
    pub output: f64,
}

/// The place of the model's zero, in numbers of another kind.
impl<T: Real> From<Offsets> for Point<T> {
    fn from(offsets: Offsets) -> Self {
        Self { input: T::narrow(offsets.input), output: T::narrow(offsets.output) }
    }
}

impl Offsets {
    pub(crate) fn check(self) -> Result<Self, Error> {
        check_finite("input_offset", None, self.input)?;
        check_finite("output_offset", None, self.output)?;
        Ok(self)
    }
}
