//! The modified model: immutable, comparable, hashable, picklable, and a file each.

use hysteresis_core::{self as core, CoupledPlay, Offsets, Ratios};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::object::ModifiedPrandtlIshlinskii;
use crate::convert::arrays::{OPERATOR, check_room};
use crate::convert::arrays::{read_only, vector};
use crate::convert::errors::raise;
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

fn split(
    model: core::ModifiedPrandtlIshlinskii,
    weights: Option<&Bound<'_, PyAny>>,
) -> PyResult<ModifiedPrandtlIshlinskii> {
    let model = match weights {
        None => model,
        Some(weights) => {
            model.with_negative_weights(vector("weights_negative", weights)?.as_slice()?).map_err(raise)?
        }
    };
    Ok(model.into())
}

impl ModifiedPrandtlIshlinskii {
    fn values(&self, threshold: impl Fn(&CoupledPlay) -> f64) -> impl Iterator<Item = f64> {
        self.model.operators().iter().map(threshold)
    }
}

#[methods]
impl ModifiedPrandtlIshlinskii {
    #[new]
    fn new(
        #[py("ArrayLike")] weights: &Bound<'_, PyAny>,
        #[py("ArrayLike")] r: &Bound<'_, PyAny>,
        #[py("ArrayLike")] ra: &Bound<'_, PyAny>,
        #[py("ArrayLike")] rb: &Bound<'_, PyAny>,
        #[py("ArrayLike")] rc: &Bound<'_, PyAny>,
        #[py(*, = 0.0)] input_offset: f64,
        #[py(= 0.0)] output_offset: f64,
        #[py("ArrayLike | None" = None)] weights_negative: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let weights = vector("weights", weights)?;
        let (r, ra, rb, rc) = (vector("r", r)?, vector("ra", ra)?, vector("rb", rb)?, vector("rc", rc)?);
        check_room("weights", weights.as_slice()?.len(), OPERATOR)?;
        let model = core::ModifiedPrandtlIshlinskii::new(
            weights.as_slice()?,
            r.as_slice()?,
            ra.as_slice()?,
            rb.as_slice()?,
            rc.as_slice()?,
            Offsets { input: input_offset, output: output_offset },
        );
        split(model.map_err(raise)?, weights_negative)
    }

    /// A model whose operators share the proportions of their thresholds: ra_i = ra r_i, rb_i = rb r_i, rc_i = rc r_i.
    ///
    /// The paper's actuator has ra = 0.95, rb = 0.30, rc = 0.35 (Table I).
    ///
    /// Parameters
    /// ----------
    /// weights, r : arrays of n floats
    /// ra, rb, rc : float
    ///     Ratios, ra >= rb >= 0 and 1 >= rc >= 0.
    /// input_offset, output_offset : float
    /// weights_negative : array of n floats, optional
    #[staticmethod]
    fn from_ratios(
        #[py("ArrayLike")] weights: &Bound<'_, PyAny>,
        #[py("ArrayLike")] r: &Bound<'_, PyAny>,
        #[py(*)] ra: f64,
        rb: f64,
        rc: f64,
        #[py(= 0.0)] input_offset: f64,
        #[py(= 0.0)] output_offset: f64,
        #[py("ArrayLike | None" = None)] weights_negative: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (weights, r) = (vector("weights", weights)?, vector("r", r)?);
        let offsets = Offsets { input: input_offset, output: output_offset };
        let ratios = Ratios { ra, rb, rc };
        let model = core::ModifiedPrandtlIshlinskii::from_ratios(weights.as_slice()?, r.as_slice()?, ratios, offsets);
        split(model.map_err(raise)?, weights_negative)
    }

    /// The weights w_i, read-only; in a split model those above zero.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.model.weights().iter().copied())
    }

    /// The weights v_i below zero, read-only: equal to `weights` unless the model is split.
    #[getter]
    fn weights_negative<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.model.weights_negative().iter().copied())
    }

    /// Whether operators have other weights below zero than above.
    #[getter]
    fn split(&self) -> bool {
        self.model.is_split()
    }

    /// The thresholds r_i (rising above zero: z = x - r), read-only.
    #[getter]
    fn r<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.values(CoupledPlay::r))
    }

    /// The thresholds ra_i (falling below zero: z = x + ra), read-only.
    #[getter]
    fn ra<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.values(CoupledPlay::ra))
    }

    /// The thresholds rb_i (falling above zero: z = x + rb), read-only.
    #[getter]
    fn rb<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.values(CoupledPlay::rb))
    }

    /// The thresholds rc_i (rising below zero: z = x - rc), read-only.
    #[getter]
    fn rc<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.values(CoupledPlay::rc))
    }

    /// The parametric inverse of the paper, equation (7) and Table II: another modified model, input um, output V.
    ///
    /// Weights and r' as in the closed form of the conventional model, then ra' = ra r', rb' = rb r', rc' = rc r'.
    /// Only approximately an inverse: it leaves 0.73 % of peak-to-peak on the paper's actuator. `inverse()` is exact.
    ///
    /// Raises ValueError unless r_0 = 0, r never decreases and every partial sum of the weights is positive.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> table_2 = mh.paper.table_1_recovered().parametric_inverse()
    /// >>> bool(abs(table_2.weights - mh.paper.table_2().weights).max() < 5.1e-5)
    /// True
    fn parametric_inverse(&self, #[py(= 0.9)] ra: f64, #[py(= 0.35)] rb: f64, #[py(= 0.35)] rc: f64) -> PyResult<Self> {
        self.model.parametric_inverse(Ratios { ra, rb, rc }).map(Self::from).map_err(raise)
    }

    fn __repr__(&self) -> String {
        let split = if self.split() { ", split" } else { "" };
        format!("<ModifiedPrandtlIshlinskii of {} operators{split}>", self.model.weights().len())
    }

    fn __hash__(&self) -> u64 {
        let offsets = self.model.offsets();
        let thresholds = self.model.operators().iter().flat_map(|z| [z.r(), z.ra(), z.rb(), z.rc()]);
        let weights = self.model.weights().iter().chain(self.model.weights_negative()).copied();
        hash(weights.chain(thresholds).chain([offsets.input, offsets.output]))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let Offsets { input, output } = self.model.offsets();
        let keywords = keywords!(py, input_offset = input, output_offset = output);
        if self.split() {
            keywords.set_item("weights_negative", self.weights_negative(py)?)?;
        }
        let positional = (self.weights(py)?, self.r(py)?, self.ra(py)?, self.rb(py)?, self.rc(py)?);
        reduce(py.get_type::<Self>().into_any(), positional, keywords, None)
    }
}
