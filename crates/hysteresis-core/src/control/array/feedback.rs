//! From measurements to errors of actuators.

use alloc::boxed::Box;
use alloc::vec;

use super::controller::ArraySample;
use crate::error::is_admissible;

/// What makes errors of actuators of those of sensors.
#[derive(Clone, Debug)]
pub(super) struct Feedback {
    /// The matrix R, column by column: then the products of a column with one error are independent of each other, and the sum
    /// of every actuator runs over the sensors in their order.
    columns: Option<Box<[f64]>>,
    actuators: usize,
    sensors: usize,
    /// The errors of the sensors.
    errors: Box<[f64]>,
}

impl Feedback {
    /// Of a checked matrix, row by row.
    pub(super) fn new(rows: Option<&[f64]>, actuators: usize, sensors: usize) -> Self {
        let columns = rows.map(|rows| {
            let column = |s: usize| rows.iter().skip(s).step_by(sensors).copied();
            (0..sensors).flat_map(column).collect()
        });
        Self { columns, actuators, sensors, errors: vec![0.0; sensors].into() }
    }

    pub(super) fn sensors(&self) -> usize {
        self.sensors
    }

    /// The errors of the actuators, NaN for those of which nothing is known: whether any measurement is missing.
    #[inline]
    pub(super) fn read(&mut self, sample: &ArraySample<'_>, errors: &mut [f64]) -> bool {
        let Some(measurement) = sample.measurement else {
            errors.fill(f64::NAN);
            return false;
        };
        let missing = !measurement.iter().copied().all(is_admissible);
        match (&self.columns, sample.sensor_reference) {
            (None, reference) => difference(reference.unwrap_or(sample.reference), measurement, errors),
            // Every actuator needs all sensors.
            (Some(_), _) if missing => errors.fill(f64::NAN),
            (Some(columns), reference) => {
                match reference {
                    Some(reference) => difference(reference, measurement, &mut self.errors),
                    None => self.errors.iter_mut().zip(measurement).for_each(|(error, y)| *error = -y),
                }
                errors.fill(0.0);
                for (column, error) in columns.chunks_exact(self.actuators.max(1)).zip(&self.errors) {
                    for (sum, gain) in errors.iter_mut().zip(column) {
                        *sum += gain * error;
                    }
                }
            }
        }
        missing
    }
}

/// Reference minus measurement, NaN for a measurement that is missing.
#[inline]
fn difference(reference: &[f64], measurement: &[f64], errors: &mut [f64]) {
    for ((error, r), y) in errors.iter_mut().zip(reference).zip(measurement) {
        *error = if is_admissible(*y) { r - y } else { f64::NAN };
    }
}
