//! Memory that a request will need, asked for before the work begins.
//!
//! Where memory ends in the middle of Rust code, the process ends with it. So what takes gigabytes for a long array asks for as
//! much first and gives it back; what is refused then is a MemoryError.

use pyo3::prelude::*;

use super::errors::{Place, no_memory};

/// Bytes for each sample that a fit needs beside the samples themselves: residuals, thinned courses, columns of the linear parts.
pub(crate) const FIT: usize = 160;

/// Bytes for each sample of a simulation or an inversion: what goes in, what comes out, and what lies between.
pub(crate) const PASS: usize = 64;

/// Bytes for each sample of a Fourier transform: spectrum, result, and what a length without small factors needs.
pub(crate) const SPECTRUM: usize = 96;

/// Bytes for each operator of a model: its parameters, its entry and tables in the engine, its place in the memory of a stream.
pub(crate) const OPERATOR: usize = 1024;

/// Checks that there is memory for so many samples, each of so many bytes.
pub(crate) fn check_room<'a>(place: impl Into<Place<'a>>, samples: usize, bytes: usize) -> PyResult<()> {
    reserve::<u8>(place, samples.saturating_mul(bytes), samples).map(drop)
}

/// A copy of samples.
pub(crate) fn copy<'a>(place: impl Into<Place<'a>>, samples: &[f64]) -> PyResult<Vec<f64>> {
    let mut room = reserve(place, samples.len(), samples.len())?;
    room.extend_from_slice(samples);
    Ok(room)
}

fn reserve<'a, T>(place: impl Into<Place<'a>>, elements: usize, samples: usize) -> PyResult<Vec<T>> {
    let mut room = Vec::new();
    match room.try_reserve_exact(elements) {
        Ok(()) => Ok(room),
        Err(_) => Err(no_memory(place, samples)),
    }
}
