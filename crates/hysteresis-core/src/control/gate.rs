//! Which measurements are believed.

use super::loop_state::LoopState;
use super::options::{ControllerOptions, check_range};
use crate::error::{Error, check_positive, is_admissible};

/// What a measurement is taken for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reading {
    /// A measurement to work with.
    Plausible(f64),
    /// Not finite, or beyond 1e100.
    Missing,
    /// Finite, but out of range or too far from the last one.
    Implausible,
}

impl Reading {
    pub(super) fn is_plausible(self) -> bool {
        matches!(self, Self::Plausible(_))
    }
}

/// The bounds of plausible measurements, infinite where there are none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    range: (f64, f64),
    /// The largest change in one sample.
    step: f64,
    /// After so many unusable measurements in a row the change is not looked at.
    patience: u32,
}

impl Gate {
    pub(super) fn new(options: &ControllerOptions) -> Result<Self, Error> {
        if let Some(range) = options.measurement_range {
            check_range("measurement_range", range, "the lowest measurement")?;
        }
        let step = match options.max_measurement_step {
            Some(step) => check_positive("max_measurement_step", step)?,
            None => f64::INFINITY,
        };
        let range = options.measurement_range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        // A single spike is never taken, even where no measurement may be missing.
        Ok(Self { range, step, patience: options.max_missing.max(1) })
    }

    /// Judges a measurement. It may have moved by a step for every sample since the last plausible one.
    #[inline]
    pub(super) fn read(&self, measurement: f64, now: &LoopState) -> Reading {
        if !is_admissible(measurement) {
            return Reading::Missing;
        }
        if measurement < self.range.0 || measurement > self.range.1 {
            return Reading::Implausible;
        }
        let allowed = self.step * (f64::from(now.missing_in_a_row) + 1.0);
        let far = now.last_measurement.is_some_and(|last| (measurement - last).abs() > allowed);
        if far && now.missing_in_a_row < self.patience { Reading::Implausible } else { Reading::Plausible(measurement) }
    }
}

impl LoopState {
    /// Remembers a reading, and counts one that is not plausible.
    #[inline]
    pub(super) fn take_reading(&mut self, reading: Reading) {
        let count = match reading {
            Reading::Plausible(measurement) => {
                (self.last_measurement, self.missing_in_a_row) = (Some(measurement), 0);
                return;
            }
            Reading::Missing => &mut self.counters.missing_count,
            Reading::Implausible => &mut self.counters.implausible_count,
        };
        *count = count.saturating_add(1);
        self.missing_in_a_row = self.missing_in_a_row.saturating_add(1);
    }
}
