//! The same problem on ever more rows, if there are enough of them.

use crate::error::Error;
use crate::fit::folds::SMOOTHNESS;
use crate::fit::projection::Projection;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::options::{Options, Setting};
use crate::record::Record;

/// The scan uses about this many samples per unknown, however long the records are.
const SCAN_SAMPLES_PER_UNKNOWN: usize = 40;

/// Before the descent on all samples, others on about so many: most steps of a long record cost little.
const REFINE_SAMPLES: [usize; 2] = [20_000, 160_000];

impl Options {
    /// The smoothness that was given; none while it is left to cross-validation.
    pub(crate) fn given_smoothness(&self) -> f64 {
        match self.smoothness {
            Setting::Fixed(smoothness) => smoothness,
            Setting::Fit => 0.0,
        }
    }

    /// What cross-validation tries for the smoothness.
    pub(crate) fn smoothnesses(&self) -> &[f64] {
        match &self.smoothness {
            Setting::Fixed(smoothness) => std::slice::from_ref(smoothness),
            Setting::Fit => &SMOOTHNESS,
        }
    }
}

/// How many samples there are, if there are enough for so many unknowns, and the latter.
pub(crate) fn enough(records: &[Record<'_>], space: &Space, basis: &WeightBasis) -> Result<(usize, usize), Error> {
    let unknowns = basis.freedom() + space.own().len() + space.axes().len();
    let samples: usize = records.iter().map(Record::fitted_samples).sum();
    if samples < 2 * unknowns {
        return Err(Error::TooFewSamples { expected: 2 * unknowns, got: samples });
    }
    Ok((samples, unknowns))
}

/// The same problem on ever more rows; `roughly` without the last of them.
pub(crate) fn levels<'a>(
    records: &'a [Record<'a>],
    space: &'a Space,
    basis: &'a WeightBasis,
    smoothness: f64,
    roughly: bool,
) -> Result<Vec<Projection<'a>>, Error> {
    let (samples, unknowns) = enough(records, space, basis)?;
    let mut strides = vec![(samples / (SCAN_SAMPLES_PER_UNKNOWN * unknowns)).max(1)];
    strides.extend(REFINE_SAMPLES.map(|rows| samples / rows).into_iter().filter(|stride| *stride > 1));
    strides.truncate(if roughly { 2 } else { strides.len() });
    if !roughly || strides.len() == 1 {
        strides.push(1);
    }
    Ok(strides.iter().map(|stride| Projection::new(records, space, basis, smoothness, *stride)).collect())
}
