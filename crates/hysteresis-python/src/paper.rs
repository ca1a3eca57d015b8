//! `mpi_hyst.paper`.

use hysteresis_core::paper;
use pyo3::prelude::*;

use crate::models::ModifiedPrandtlIshlinskii;

/// Table I as printed: the forward model, input V, output um, for a drive of -500..500 V.
///
/// The printed weights keep one or two digits and are up to 31 % off; `table_1_recovered` is the actuator.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.paper.table_1().operators
/// 20
#[pyfunction]
pub(crate) fn table_1() -> ModifiedPrandtlIshlinskii {
    paper::table_1().into()
}

/// The forward model with the weights that Table II implies: w_i = 1/S'_i - 1/S'_(i-1).
///
/// S'_i is the sum of the first i + 1 weights of Table II. All 20 weights round to those of Table I.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> print(f"{mh.paper.table_1_recovered().forward().step(500.0):+.4f} um")
/// +3.0624 um
#[pyfunction]
pub(crate) fn table_1_recovered() -> ModifiedPrandtlIshlinskii {
    paper::table_1_recovered().into()
}

/// Table II as printed: the parametric inverse, input um, output V.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> float(mh.paper.table_2().weights[0])
/// 234.9005
#[pyfunction]
pub(crate) fn table_2() -> ModifiedPrandtlIshlinskii {
    paper::table_2().into()
}
