//! The objects of both models, and the way from any object to a model.

use hysteresis_core::{self as core, CompiledModel, CoupledPlay, Model, Offsets, Ratios};
use hysteresis_python_macros::{methods, py};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::argument::Argument;
use crate::convert::arrays::{OPERATOR, check_room, read_only};
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

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

#[py("Model")]
impl Argument<'_> for Model {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        model_of(name, value)
    }
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

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

#[methods]
impl PrandtlIshlinskii {
    #[new]
    fn new(
        weights: PyReadonlyArray1<'_, f64>,
        thresholds: PyReadonlyArray1<'_, f64>,
        #[py(*, = 0.0)] input_offset: f64,
        #[py(= 0.0)] output_offset: f64,
    ) -> PyResult<Self> {
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

fn split(
    model: core::ModifiedPrandtlIshlinskii,
    weights: Option<PyReadonlyArray1<'_, f64>>,
) -> PyResult<ModifiedPrandtlIshlinskii> {
    let model = match weights {
        None => model,
        Some(weights) => model.with_negative_weights(weights.as_slice()?).map_err(raise)?,
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
        weights: PyReadonlyArray1<'_, f64>,
        r: PyReadonlyArray1<'_, f64>,
        ra: PyReadonlyArray1<'_, f64>,
        rb: PyReadonlyArray1<'_, f64>,
        rc: PyReadonlyArray1<'_, f64>,
        #[py(*, = 0.0)] input_offset: f64,
        #[py(= 0.0)] output_offset: f64,
        #[py(= None)] weights_negative: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Self> {
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
        weights: PyReadonlyArray1<'_, f64>,
        r: PyReadonlyArray1<'_, f64>,
        #[py(*)] ra: f64,
        rb: f64,
        rc: f64,
        #[py(= 0.0)] input_offset: f64,
        #[py(= 0.0)] output_offset: f64,
        #[py(= None)] weights_negative: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Self> {
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
