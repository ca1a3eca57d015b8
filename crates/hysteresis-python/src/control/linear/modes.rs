//! Antiresonances, and modes in parallel.

use hysteresis_control::linear::{self, LinearDynamics};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::lags::SecondOrder;
use crate::convert::arrays::{read_only, vector};
use crate::convert::errors::{Place, raise, unexpected};
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

/// An antiresonance and the resonance that belongs to it, of unit static gain.
///
/// G(s) = ((s/w_a)^2 + 2 zeta_a s/w_a + 1) / ((s/w)^2 + 2 zeta s/w + 1): at the antiresonance a part of the structure takes up
/// the force that would move the position.
///
/// Parameters
/// ----------
/// zero, pole : SecondOrder
///     Frequency and damping of the antiresonance, and of the resonance.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> pair = mh.plant.Antiresonance(mh.plant.SecondOrder(600.0, 0.01), mh.plant.SecondOrder(650.0, 0.01))
/// >>> bool(abs(pair.frequency_response([600.0])[0]) < 0.2)
/// True
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct Antiresonance(pub(crate) linear::Antiresonance);

fn resonance(place: Place<'_>, value: &Bound<'_, PyAny>) -> PyResult<linear::SecondOrder> {
    match value.cast::<SecondOrder>() {
        Ok(resonance) => Ok(resonance.get().0),
        Err(_) => Err(unexpected(place, "a SecondOrder", value)),
    }
}

impl Antiresonance {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.into()
    }
}

#[methods]
impl Antiresonance {
    #[new]
    fn new(
        #[py("SecondOrder")] zero: &Bound<'_, PyAny>,
        #[py("SecondOrder")] pole: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        Ok(Self(linear::Antiresonance::new(resonance("zero".into(), zero)?, resonance("pole".into(), pole)?)))
    }

    /// The antiresonance.
    #[getter]
    fn zero(&self) -> SecondOrder {
        SecondOrder(self.0.zero())
    }

    /// The resonance.
    #[getter]
    fn pole(&self) -> SecondOrder {
        SecondOrder(self.0.pole())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        hash([self.0.zero(), self.0.pole()].iter().flat_map(|pair| [pair.frequency(), pair.damping()]))
    }

    fn __repr__(&self) -> String {
        format!("Antiresonance(zero={}, pole={})", self.zero().__repr__(), self.pole().__repr__())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.zero(), self.pole()), keywords!(py), None)
    }
}

/// Second-order modes in parallel: G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1).
///
/// The modal form of a mechanical structure. Where neighbours have gains of the same sign there is an antiresonance between
/// them. Dynamics that follow each other are given in a list instead.
///
/// Parameters
/// ----------
/// gains : array of n floats
///     The share of each mode in the static gain; their sum must not be 0.
/// modes : sequence of n SecondOrder
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> modes = mh.plant.Modes([0.8, 0.2], [mh.plant.SecondOrder(800.0, 0.02), mh.plant.SecondOrder(1500.0, 0.01)])
/// >>> modes.static_gain, modes.zeros.size
/// (1.0, 2)
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct Modes(pub(crate) linear::Modes);

impl Modes {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.clone().into()
    }
}

#[methods]
impl Modes {
    #[new]
    fn new(
        #[py("ArrayLike")] gains: &Bound<'_, PyAny>,
        #[py("Iterable[SecondOrder]")] modes: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let Ok(items) = modes.try_iter() else { return Err(unexpected("modes", "a sequence of SecondOrder", modes)) };
        let resonances = items.enumerate().map(|(i, item)| {
            let place = format!("modes[{i}]");
            resonance(Place::part("modes", &place), &item?)
        });
        let resonances = resonances.collect::<PyResult<Vec<_>>>()?;
        let gains = vector("gains", gains)?;
        linear::Modes::new(gains.as_slice()?, &resonances).map(Self).map_err(raise)
    }

    /// The share of each mode in the static gain, read-only.
    #[getter]
    fn gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.gains().iter().copied())
    }

    /// The resonances.
    #[getter]
    #[py(-> "tuple[SecondOrder, ...]")]
    fn modes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0.modes().iter().map(|mode| SecondOrder(*mode)).collect::<Vec<_>>())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        let modes = self.0.modes().iter().flat_map(|mode| [mode.frequency(), mode.damping()]);
        hash(self.0.gains().iter().copied().chain(modes))
    }

    fn __repr__(&self) -> String {
        let modes: Vec<_> = self.0.modes().iter().map(|mode| SecondOrder(*mode).__repr__()).collect();
        format!("Modes(gains={:?}, modes=[{}])", self.0.gains(), modes.join(", "))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.gains(py)?, self.modes(py)?), keywords!(py), None)
    }
}
