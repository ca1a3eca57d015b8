//! The records of many actuators.

use crate::error::{Error, RecordError};
use crate::record::{Record, check_finite, check_varies};
use crate::signal::bounds;

/// Records of many actuators, equally long: one drive for all of them, or one for each.
///
/// What is wrong with the position of one actuator, or with a drive of its own, is found when it is fitted: the others do not
/// suffer.
///
/// ```
/// use hysteresis_identify::ManyRecords;
/// // Two actuators, one after the other: three samples each.
/// let positions = [0.0, 0.9, 2.1, 0.0, 1.1, 1.9];
/// assert_eq!(ManyRecords::shared(&[0.0, 1.0, 2.0], &positions, 0)?.actuators(), 2);
/// # Ok::<(), hysteresis_identify::RecordError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ManyRecords<'a> {
    inputs: &'a [f64],
    positions: &'a [f64],
    samples: usize,
    skip: usize,
    is_shared: bool,
}

impl<'a> ManyRecords<'a> {
    /// One `input` for all actuators; `positions` has as many samples for each of them, one actuator after the other. The first
    /// `skip` samples set the memory only.
    ///
    /// # Errors
    /// As [`Record::new`] for the input; [`RecordError::Length`] unless `positions` holds whole actuators, and at least one.
    pub fn shared(input: &'a [f64], positions: &'a [f64], skip: usize) -> Result<Self, RecordError> {
        let samples = input.len();
        if skip >= samples {
            return Err(RecordError::Skip { samples, got: skip });
        }
        check_finite("input", input)?;
        check_varies("input", bounds(&input[skip..]))?;
        Self::whole(input, positions, samples, skip, true)
    }

    /// `inputs` and `positions` have `samples` samples for each actuator, one actuator after the other. The first `skip` of each
    /// set the memory only.
    ///
    /// # Errors
    /// [`RecordError::Skip`] if nothing is left to fit; [`RecordError::Length`] unless there are as many inputs as positions,
    /// for whole actuators, and at least one.
    pub fn each(inputs: &'a [f64], positions: &'a [f64], samples: usize, skip: usize) -> Result<Self, RecordError> {
        if skip >= samples {
            return Err(RecordError::Skip { samples, got: skip });
        }
        if inputs.len() != positions.len() {
            return Err(RecordError::Length { argument: "output", expected: inputs.len(), got: positions.len() });
        }
        Self::whole(inputs, positions, samples, skip, false)
    }

    fn whole(
        inputs: &'a [f64],
        positions: &'a [f64],
        samples: usize,
        skip: usize,
        is_shared: bool,
    ) -> Result<Self, RecordError> {
        let expected = positions.len().div_ceil(samples).max(1) * samples;
        if positions.len() != expected {
            return Err(RecordError::Length { argument: "output", expected, got: positions.len() });
        }
        Ok(Self { inputs, positions, samples, skip, is_shared })
    }

    /// How many actuators there are.
    #[must_use]
    pub fn actuators(&self) -> usize {
        self.positions.len() / self.samples
    }

    /// Whether all actuators have one drive.
    pub(super) fn is_shared(&self) -> bool {
        self.is_shared
    }

    /// The record of one actuator.
    ///
    /// # Errors
    /// [`Error::Record`] with the number of the actuator.
    pub(super) fn record(&self, actuator: usize) -> Result<Record<'a>, Error> {
        let of = |signals: &'a [f64]| &signals[actuator * self.samples..(actuator + 1) * self.samples];
        let input = if self.is_shared { self.inputs } else { of(self.inputs) };
        Record::new(input, of(self.positions), self.skip).map_err(|error| error.in_record(actuator))
    }
}
