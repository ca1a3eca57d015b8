//! The free Duhem operator and its inverse beside a slope.

use hysteresis_control::oscillator::tables;
use hysteresis_core::{self as core, MAX_KNOTS, Process};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyType;
use pythonize::pythonize;

use crate::argument::Argument;
use crate::convert::arrays::read_only;
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::stream::single_argument::Stepper;

/// A free Duhem operator: z' = f+(z) x' where x rises, z' = f-(z) x' where x falls.
///
/// f+ and f- are positive and piecewise linear over z, on knots that both share. It does not depend on the rate:
/// along a branch z is a function of x, a chain of exponentials with an exact solution from knot to knot. Beyond the
/// outer knots a line that grows outwards goes on, and f stays as it is where the line falls. z has no memory of
/// turning points, and loops need not close.
///
/// Or f+ and f- are both negative: z falls where x rises. Beside a steeper slope that is the piezo form of Bouc-Wen's
/// model, k x - h. Beyond its outer knots f stays as it is.
///
/// After B. D. Coleman and M. L. Hodgdon, Int. J. Eng. Sci. 24(6), 897-919, 1986.
///
/// Parameters
/// ----------
/// knots : array of 2 to 17 floats
///     z, increasing, in the unit of the output.
/// rising, falling : arrays of as many floats
///     f+ and f- at the knots, all above 0 or all below, in the unit of the output over that of the input.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> duhem = mh.Duhem([-1.0, 0.0, 1.0], [1.5, 1.0, 0.5], [0.5, 1.0, 1.5])
/// >>> round(duhem.step(1.0), 12)  # 2 (1 - exp(-1/2))
/// 0.786938680575
/// >>> inverse = duhem.inverse(gain=0.2)
/// >>> x = inverse.step(0.5)  # the x at which 0.2 x + z is 0.5
/// >>> duhem.reset()
/// >>> round(0.2 * x + duhem.step(x), 12)
/// 0.5
#[pyclass(module = "mpi_hyst")]
pub(crate) struct Duhem(pub(crate) core::DuhemForward<MAX_KNOTS>);

/// The exact inverse of a Duhem operator beside a slope: made by `duhem.inverse(gain)`.
///
/// `step(target)` returns the x at which gain x + z is the target.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> inverse = mh.Duhem.from_bouc_wen(1.0, 1.0, 0.5, 0.25).inverse(gain=0.0)
/// >>> round(inverse.step(0.5), 12), round(inverse.hysteresis, 12)  # -ln(1 - 0.75 / 2) / 0.75
/// (0.626671505661, 0.5)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct DuhemInverse(core::DuhemInverse<MAX_KNOTS>);

impl Stepper for Duhem {
    fn process(&self) -> &impl Process {
        &self.0
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.0
    }

    fn rejected(&self) -> u64 {
        self.0.rejected()
    }
}

impl Stepper for DuhemInverse {
    fn process(&self) -> &impl Process {
        &self.0
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.0
    }

    fn rejected(&self) -> u64 {
        self.0.rejected()
    }
}

type Array<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

// The parameters and the memory of both.
#[methods(Duhem, DuhemInverse)]
impl Each {
    /// z at the knots.
    #[getter]
    fn knots<'py>(&self, py: Python<'py>) -> Array<'py> {
        read_only(py, self.0.duhem().knots())
    }

    /// f+ at the knots.
    #[getter]
    fn rising<'py>(&self, py: Python<'py>) -> Array<'py> {
        read_only(py, self.0.duhem().rising())
    }

    /// f- at the knots.
    #[getter]
    fn falling<'py>(&self, py: Python<'py>) -> Array<'py> {
        read_only(py, self.0.duhem().falling())
    }

    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(slf.py(), &shared(slf)?.0.state())?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.0.set_state(&state).map_err(raise)
    }
}

#[methods]
impl Duhem {
    #[new]
    fn new(knots: Vec<f64>, rising: Vec<f64>, falling: Vec<f64>) -> PyResult<Self> {
        let duhem = core::Duhem::new(&knots, &rising, &falling).map_err(raise)?;
        Ok(Self(core::DuhemForward::new(duhem)))
    }

    /// Bouc-Wen hysteresis of exponent 1: z' = alpha x' - beta (gamma \|x'\| z + delta x' \|z\|).
    ///
    /// Three knots. beta is above 0, gamma at least 0. Where f would fall to zero it stays at 1e-9 alpha. With an alpha
    /// below 0 it is what the piezo form k x - h adds: -h of (\|alpha\|, beta, gamma, -delta). delta is below gamma
    /// then.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> h = mh.Duhem.from_bouc_wen(0.4, 0.03, 0.8, 0.3)
    /// >>> stage = mh.Stage(mh.PrandtlIshlinskii([0.8], [0.0]), duhem=mh.Duhem.from_bouc_wen(-0.4, 0.03, 0.8, -0.3))
    /// >>> round(stage.forward(1e-3).step(30.0), 9) == round(0.8 * 30.0 - h.step(30.0), 9)
    /// True
    /// >>> benchmark = mh.Duhem.from_bouc_wen(5e4, 1e3, 0.8, -1.1)  # N over m
    /// >>> round(benchmark.step(1e-3), 6)  # N; 5e4 / 300 (exp(0.3) - 1)
    /// 58.309801
    #[classmethod]
    fn from_bouc_wen(_: &Bound<'_, PyType>, alpha: f64, beta: f64, gamma: f64, delta: f64) -> PyResult<Self> {
        let duhem = core::Duhem::from_bouc_wen(alpha, beta, gamma, delta).map_err(raise)?;
        Ok(Self(core::DuhemForward::new(duhem)))
    }

    /// The exact inverse of gain x + z, at rest: `gain` is above minus the smallest f.
    fn inverse(&self, #[py(= 0.0)] gain: f64) -> PyResult<DuhemInverse> {
        core::DuhemInverse::new(*self.0.duhem(), gain).map(DuhemInverse).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let py = slf.py();
        let [knots, rising, falling] = tables(shared(slf)?.0.duhem());
        let state = Self::state(slf)?;
        reduce(py.get_type::<Self>().into_any(), (knots, rising, falling), keywords!(py), Some(state))
    }

    fn __repr__(&self) -> String {
        let [knots, rising, falling] = tables(self.0.duhem());
        format!("Duhem(knots={knots:?}, rising={rising:?}, falling={falling:?})")
    }
}

/// The parameters of an operator; its memory does not count.
impl Argument<'_> for Box<core::Duhem<MAX_KNOTS>> {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let duhem = value.cast::<Duhem>().map_err(|_| unexpected(name, "a mh.Duhem", value))?;
        Ok(Self::new(*shared(duhem)?.0.duhem()))
    }
}

#[methods]
impl DuhemInverse {
    /// The slope beside the operator.
    #[getter]
    fn gain(&self) -> f64 {
        self.0.gain()
    }

    /// z at the last x.
    #[getter]
    fn hysteresis(&self) -> f64 {
        self.0.hysteresis()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let operator = Bound::new(py, Duhem(core::DuhemForward::new(*this.0.duhem())))?;
        let (gain, state) = (this.0.gain(), Self::state(slf)?);
        reduce(operator.getattr("inverse")?, (gain,), keywords!(py), Some(state))
    }

    fn __repr__(&self) -> String {
        format!("<DuhemInverse of {} knots, gain {:?}>", self.0.duhem().knots().count(), self.gain())
    }
}
