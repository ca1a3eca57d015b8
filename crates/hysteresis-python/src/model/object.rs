//! The objects of both models, and the way from any object to a model.

use hysteresis_core::{self as core, CompiledModel, Model};
use pyo3::prelude::*;

use crate::convert::errors::unexpected;

/// The conventional Prandtl-Ishlinskii model (CPI), equation (4): y = output_offset + sum_i w_i z_i.
///
/// z_i is the play of threshold r_i at the input x - input_offset.
///
/// Parameters
/// ----------
/// weights : array of n floats
///     w_i, in output unit per input unit.
/// thresholds : array of n floats
///     r_i >= 0, in the unit of the input.
/// input_offset, output_offset : float
///     Where the model's own zero lies.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> model = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])
/// >>> model.forward().run([4.0, 3.0, -4.0])
/// array([ 5.,  4., -5.])
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct PrandtlIshlinskii {
    pub(crate) model: core::PrandtlIshlinskii,
    pub(crate) compiled: CompiledModel,
}

/// The modified Prandtl-Ishlinskii model (MPI), equation (6): y = output_offset + sum_i w_i z_i.
///
/// z_i is the coupled play of thresholds r_i, ra_i, rb_i, rc_i at the input x - input_offset.
///
/// Parameters
/// ----------
/// weights : array of n floats
///     w_i, in output unit per input unit (um/V).
/// r, ra, rb, rc : arrays of n floats
///     Thresholds in the unit of the input (V), r_i >= rc_i >= 0 and ra_i >= rb_i >= 0.
/// input_offset, output_offset : float
///     Where the model's own zero lies.
/// weights_negative : array of n floats, optional
///     v_i: makes a split model, where z_i counts with w_i above zero and with v_i below. By default, or equal to
///     w_i, there is no split.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> model = mh.ModifiedPrandtlIshlinskii.from_ratios(
/// ...     [4.0e-3, 3.0e-4], [0.0, 25.0], ra=0.95, rb=0.30, rc=0.35)
/// >>> round(model.forward().step(100.0), 6)
/// 0.4225
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct ModifiedPrandtlIshlinskii {
    pub(crate) model: core::ModifiedPrandtlIshlinskii,
    pub(crate) compiled: CompiledModel,
}

impl From<core::PrandtlIshlinskii> for PrandtlIshlinskii {
    fn from(model: core::PrandtlIshlinskii) -> Self {
        let compiled = CompiledModel::new(&core::ModifiedPrandtlIshlinskii::from(&model));
        Self { model, compiled }
    }
}

impl From<core::ModifiedPrandtlIshlinskii> for ModifiedPrandtlIshlinskii {
    fn from(model: core::ModifiedPrandtlIshlinskii) -> Self {
        let compiled = CompiledModel::new(&model);
        Self { model, compiled }
    }
}

/// A model of either kind as an object of its class.
pub(crate) fn object(py: Python<'_>, model: Model) -> PyResult<Py<PyAny>> {
    match model {
        Model::Conventional(model) => Ok(Py::new(py, PrandtlIshlinskii::from(model))?.into_any()),
        Model::Modified(model) => Ok(Py::new(py, ModifiedPrandtlIshlinskii::from(model))?.into_any()),
    }
}

const EXPECTED: &str = "a PrandtlIshlinskii or a ModifiedPrandtlIshlinskii";

/// The compiled model, of either kind, if the object is one.
pub(crate) fn compiled_if_model(model: &Bound<'_, PyAny>) -> Option<CompiledModel> {
    if let Ok(model) = model.cast::<ModifiedPrandtlIshlinskii>() {
        Some(model.get().compiled.clone())
    } else {
        model.cast::<PrandtlIshlinskii>().ok().map(|model| model.get().compiled.clone())
    }
}

/// The compiled model, of either kind, or an error that says what came instead.
pub(crate) fn compiled_of(name: &str, model: &Bound<'_, PyAny>) -> PyResult<CompiledModel> {
    compiled_if_model(model).ok_or_else(|| unexpected(name, EXPECTED, model))
}

/// The model that an object is, or an error that says what came instead.
pub(crate) fn model_of(name: &str, model: &Bound<'_, PyAny>) -> PyResult<Model> {
    if let Ok(model) = model.cast::<ModifiedPrandtlIshlinskii>() {
        return Ok(model.get().model.clone().into());
    }
    match model.cast::<PrandtlIshlinskii>() {
        Ok(model) => Ok(model.get().model.clone().into()),
        Err(_) => Err(unexpected(name, EXPECTED, model)),
    }
}
