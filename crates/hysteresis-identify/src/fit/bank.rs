//! The operators of a fit, as arrays.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use hysteresis_core::{CoupledPlay, Model, Offsets, Ratios};

/// The thresholds of all operators, one array per kind, so that the compiler works on several operators at a time.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct OperatorBank {
    r: Vec<f64>,
    ra: Vec<f64>,
    rb: Vec<f64>,
    rc: Vec<f64>,
}

impl OperatorBank {
    /// The operators of thresholds `r` in these proportions: the same products as in the core.
    pub(crate) fn from_ratios(r: &[f64], ratios: Ratios) -> Self {
        let scaled = |ratio: f64| r.iter().map(|r| ratio * r).collect();
        Self { r: r.to_vec(), ra: scaled(ratios.ra), rb: scaled(ratios.rb), rc: scaled(ratios.rc) }
    }

    pub(crate) fn from_operators(operators: impl Iterator<Item = CoupledPlay> + Clone) -> Self {
        Self {
            r: operators.clone().map(|z| z.r()).collect(),
            ra: operators.clone().map(|z| z.ra()).collect(),
            rb: operators.clone().map(|z| z.rb()).collect(),
            rc: operators.map(|z| z.rc()).collect(),
        }
    }

    /// The operators of a model, its weights as [`Regressor::output`] takes them, and its offsets.
    pub(crate) fn of_model(model: &Model) -> (Self, Vec<f64>, Offsets) {
        match model {
            Model::Conventional(model) => {
                let plays = model.operators().iter().map(|play| CoupledPlay::from(*play));
                (Self::from_operators(plays), model.weights().to_vec(), model.offsets())
            }
            Model::Modified(model) => {
                let below = if model.is_split() { model.weights_negative() } else { &[] };
                let operators = model.operators().iter().copied();
                (Self::from_operators(operators), [model.weights(), below].concat(), model.offsets())
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.r.len()
    }

    /// The threshold r of every operator.
    pub(crate) fn thresholds(&self) -> &[f64] {
        &self.r
    }

    /// The thresholds r, ra, rb and rc of every operator.
    pub(crate) fn all_thresholds(&self) -> [&[f64]; 4] {
        [&self.r, &self.ra, &self.rb, &self.rc].map(Vec::as_slice)
    }

    /// z(k) = max(lo, min(hi, z(k-1))) for every operator: `CoupledPlay` of the core, as a loop over arrays.
    #[inline(always)]
    pub(super) fn next(&self, last: &[f64], x: f64, z: &mut [f64]) {
        let n = z.len();
        let (r, ra, rb, rc, last) = (&self.r[..n], &self.ra[..n], &self.rb[..n], &self.rc[..n], &last[..n]);
        for i in 0..n {
            let lo = max(x - r[i], min(x - rc[i], 0.0));
            let hi = min(x + ra[i], max(x + rb[i], 0.0));
            z[i] = max(lo, min(hi, last[i]));
        }
    }
}

/// `f64::max` without its care for NaN, of which a record has none: one instruction, and it vectorises.
#[inline(always)]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// `f64::min` likewise.
#[inline(always)]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
