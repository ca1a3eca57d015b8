//! The conventional model: immutable, comparable, hashable, picklable, and a file each.

use hysteresis_core::{self as core, Offsets};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::object::PrandtlIshlinskii;
use crate::convert::arrays::{OPERATOR, check_room};
use crate::convert::arrays::{read_only, vector};
use crate::convert::errors::raise;
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

#[methods]
impl PrandtlIshlinskii {
    #[new]
    fn new(
        #[py("ArrayLike")] weights: &Bound<'_, PyAny>,
        #[py("ArrayLike")] thresholds: &Bound<'_, PyAny>,
        #[py(*, = 0.0)] input_offset: f64,
        #[py(= 0.0)] output_offset: f64,
    ) -> PyResult<Self> {
        let (weights, thresholds) = (vector("weights", weights)?, vector("thresholds", thresholds)?);
        let offsets = Offsets { input: input_offset, output: output_offset };
        check_room("weights", weights.as_slice()?.len(), OPERATOR)?;
        core::PrandtlIshlinskii::new(weights.as_slice()?, thresholds.as_slice()?, offsets)
            .map(Self::from)
            .map_err(raise)
    }

    /// The weights w_i, read-only.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.model.weights().iter().copied())
    }

    /// The thresholds r_i, read-only.
    #[getter]
    fn thresholds<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.model.operators().iter().map(core::Play::r))
    }

    /// The inverse as another conventional model, in closed form.
    ///
    /// w'_0 = 1 / w_0, w'_i = -w_i / (S_i S_(i-1)), r'_i = sum_(j<=i) w_j (r_i - r_j), S_i = sum_(j<=i) w_j.
    ///
    /// Raises ValueError unless r_0 = 0, thresholds never decrease and every S_i > 0.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> model = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])
    /// >>> model.closed_form_inverse().thresholds
    /// array([0., 2.])
    fn closed_form_inverse(&self) -> PyResult<Self> {
        self.model.closed_form_inverse().map(Self::from).map_err(raise)
    }

    fn __repr__(&self) -> String {
        format!("<PrandtlIshlinskii of {} operators>", self.model.weights().len())
    }

    fn __hash__(&self) -> u64 {
        let offsets = self.model.offsets();
        let thresholds = self.model.operators().iter().map(core::Play::r);
        hash(self.model.weights().iter().copied().chain(thresholds).chain([offsets.input, offsets.output]))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let Offsets { input, output } = self.model.offsets();
        let keywords = keywords!(py, input_offset = input, output_offset = output);
        let positional = (self.weights(py)?, self.thresholds(py)?);
        reduce(py.get_type::<Self>().into_any(), positional, keywords, None)
    }
}
