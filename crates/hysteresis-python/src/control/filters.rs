//! Filters of the feedback.

use std::f64::consts::TAU;

use hysteresis_control::filters::{self, FeedbackFilter};
use hysteresis_core::{self as core, Process, Sections};
use hysteresis_python_macros::{methods, py};
use numpy::{Complex64, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use pythonize::pythonize;

use crate::argument::Argument;
use crate::convert::arguments::two;
use crate::convert::arrays;
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{Reduced, exclusive, hash, keywords, reduce, saved, shared};
use crate::stream::single_argument::Stepper;

/// A notch, which takes out a resonance and leaves slow signals as they are.
///
/// (s^2 + 2 depth w s + w^2) / (s^2 + 2 width w s + w^2), w = 2 pi frequency. At its frequency it passes depth / width.
/// With the damping ratio of a mode for the depth it puts a mode of the damping ratio `width` in its place.
///
/// Parameters
/// ----------
/// frequency : float
///     In Hz, below half of the sampling rate.
/// depth : float
///     Damping ratio of its zeros, 0 to 100.
/// width : float
///     Damping ratio of its poles, above 0: a wide notch bears more uncertainty of the frequency, and lags more.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> notch = mh.control.Notch(800.0, 0.02, 1.0)
/// >>> abs(notch.response([0.0, 800.0], dt=1e-4)).round(3)
/// array([1.  , 0.02])
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Notch(filters::Notch);

/// A low-pass of unit static gain: w / (s + w), or w^2 / (s^2 + 2 zeta w s + w^2) with a damping ratio.
///
/// Behind one a small negative `kp` damps a mode: integral resonant control, or positive position feedback for one of
/// second order.
///
/// Parameters
/// ----------
/// frequency : float
///     Cut-off frequency in Hz, below half of the sampling rate.
/// damping : float, optional
///     Damping ratio zeta of one of second order.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> slow = mh.control.LowPass(200.0)
/// >>> abs(slow.response([0.0, 200.0, 5000.0], dt=1e-4)).round(3)
/// array([1.   , 0.707, 0.   ])
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct LowPass(filters::LowPass);

/// A lead, which adds phase between two frequencies: (1 + s / w_zero) / (1 + s / w_pole).
///
/// Parameters
/// ----------
/// zero, pole : float
///     In Hz, below half of the sampling rate. With the zero above the pole it is a lag.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> lead = mh.control.Lead(100.0, 900.0)
/// >>> abs(lead.response([0.0, 300.0], dt=1e-5)).round(2)
/// array([1., 3.])
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Lead(filters::Lead);

/// A second-order section: y(k) = b0 u(k) + b1 u(k-1) + b2 u(k-2) - a1 y(k-1) - a2 y(k-2).
///
/// Parameters
/// ----------
/// b : (b0, b1, b2)
/// a : (a1, a2)
///     Both poles lie inside the unit circle. A row of `scipy.signal` second-order sections has 1 before these.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.control.Biquad([0.5, 0.5, 0.0], [0.0, 0.0]).response([0.0, 2500.0], dt=1e-4).round(3)
/// array([1. +0.j , 0.5-0.5j])
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Biquad(core::Biquad);

// What all filters offer.
#[methods(Notch, LowPass, Lead, Biquad)]
impl Each {
    /// The section for a sampling interval, by the bilinear transform, prewarped at its own frequency.
    fn section(&self, dt: f64) -> PyResult<Biquad> {
        FeedbackFilter::from(self.0).section(dt).map(Biquad).map_err(raise)
    }

    /// The complex response at frequencies in Hz, for a sampling interval.
    fn response<'py>(
        &self,
        #[py("ArrayLike")] frequencies: &Bound<'py, PyAny>,
        dt: f64,
    ) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        let section = FeedbackFilter::from(self.0).section(dt).map_err(raise)?;
        let at = |f: f64| filters::response(&[section], Complex64::cis(TAU * f * dt));
        let values = arrays::numbers("frequencies", frequencies)?.into_iter().map(at);
        Ok(PyArray1::from_iter(frequencies.py(), values))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

#[methods]
impl Notch {
    fn __hash__(&self) -> u64 {
        hash([self.0.frequency(), self.0.depth(), self.0.width()].into_iter())
    }

    #[new]
    fn new(frequency: f64, depth: f64, width: f64) -> PyResult<Self> {
        filters::Notch::new(frequency, depth, width).map(Self).map_err(raise)
    }

    /// In Hz.
    #[getter]
    fn frequency(&self) -> f64 {
        self.0.frequency()
    }

    /// Damping ratio of its zeros.
    #[getter]
    fn depth(&self) -> f64 {
        self.0.depth()
    }

    /// Damping ratio of its poles.
    #[getter]
    fn width(&self) -> f64 {
        self.0.width()
    }

    fn __repr__(&self) -> String {
        let this = &self.0;
        format!("Notch(frequency={:?}, depth={:?}, width={:?})", this.frequency(), this.depth(), this.width())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let values = (self.0.frequency(), self.0.depth(), self.0.width());
        reduce(py.get_type::<Self>().into_any(), values, keywords!(py), None)
    }
}

#[methods]
impl LowPass {
    fn __hash__(&self) -> u64 {
        hash([self.0.frequency(), self.0.damping().unwrap_or(0.0)].into_iter())
    }

    #[new]
    fn new(frequency: f64, #[py(= None)] damping: Option<f64>) -> PyResult<Self> {
        filters::LowPass::new(frequency, damping).map(Self).map_err(raise)
    }

    /// Cut-off frequency in Hz.
    #[getter]
    fn frequency(&self) -> f64 {
        self.0.frequency()
    }

    /// Damping ratio; None for first order.
    #[getter]
    fn damping(&self) -> Option<f64> {
        self.0.damping()
    }

    fn __repr__(&self) -> String {
        match self.0.damping() {
            Some(damping) => format!("LowPass(frequency={:?}, damping={damping:?})", self.0.frequency()),
            None => format!("LowPass(frequency={:?})", self.0.frequency()),
        }
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let values = (self.0.frequency(), self.0.damping());
        reduce(py.get_type::<Self>().into_any(), values, keywords!(py), None)
    }
}

#[methods]
impl Lead {
    fn __hash__(&self) -> u64 {
        hash([self.0.zero(), self.0.pole()].into_iter())
    }

    #[new]
    fn new(zero: f64, pole: f64) -> PyResult<Self> {
        filters::Lead::new(zero, pole).map(Self).map_err(raise)
    }

    /// In Hz.
    #[getter]
    fn zero(&self) -> f64 {
        self.0.zero()
    }

    /// In Hz.
    #[getter]
    fn pole(&self) -> f64 {
        self.0.pole()
    }

    fn __repr__(&self) -> String {
        format!("Lead(zero={:?}, pole={:?})", self.0.zero(), self.0.pole())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.0.zero(), self.0.pole()), keywords!(py), None)
    }
}

#[methods]
impl Biquad {
    fn __hash__(&self) -> u64 {
        hash(self.0.numerator().into_iter().chain(self.0.denominator()))
    }

    #[new]
    fn new(
        #[py("Sequence[float]")] b: &Bound<'_, PyAny>,
        #[py("Sequence[float]")] a: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let b: [f64; 3] = b.extract().map_err(|_| unexpected("b", "three numbers (b0, b1, b2)", b))?;
        let a: [f64; 2] = two("a", "(a1, a2)", a)?.into();
        core::Biquad::new(b, a).map(Self).map_err(raise)
    }

    /// b0, b1 and b2.
    #[getter]
    fn b(&self) -> (f64, f64, f64) {
        self.0.numerator().into()
    }

    /// a1 and a2.
    #[getter]
    fn a(&self) -> (f64, f64) {
        self.0.denominator().into()
    }

    fn __repr__(&self) -> String {
        format!("Biquad(b={:?}, a={:?})", self.b(), self.a())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.b(), self.a()), keywords!(py), None)
    }
}

/// Filters as they are given, one or several.
pub(crate) struct Filters(Vec<FeedbackFilter>);

#[py("AnyFilter | Sequence[AnyFilter]")]
impl Argument<'_> for Filters {
    fn from_argument(_: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !value.is_instance_of::<PyList>() && !value.is_instance_of::<PyTuple>() {
            return Ok(Self(vec![filter(value)?]));
        }
        value.try_iter()?.map(|one| filter(&one?)).collect::<PyResult<_>>().map(Self)
    }
}

impl Filters {
    /// Their sections for a sampling interval.
    pub(super) fn sections(&self, dt: f64) -> PyResult<Sections> {
        filters::sections(&self.0, dt).map_err(raise)
    }
}

/// One of the filters above.
fn filter(value: &Bound<'_, PyAny>) -> PyResult<FeedbackFilter> {
    if let Ok(notch) = value.cast::<Notch>() {
        Ok(notch.get().0.into())
    } else if let Ok(slow) = value.cast::<LowPass>() {
        Ok(slow.get().0.into())
    } else if let Ok(lead) = value.cast::<Lead>() {
        Ok(lead.get().0.into())
    } else if let Ok(section) = value.cast::<Biquad>() {
        Ok(section.get().0.into())
    } else {
        Err(unexpected("filters", "Notch, LowPass, Lead, Biquad, or a list of them", value))
    }
}

/// Filters as a tuple of objects.
pub(super) fn as_objects<'py>(py: Python<'py>, filters: &[FeedbackFilter]) -> PyResult<Bound<'py, PyTuple>> {
    let made = filters.iter().map(|filter| {
        Ok(match *filter {
            FeedbackFilter::Notch(notch) => Bound::new(py, Notch(notch))?.into_any(),
            FeedbackFilter::LowPass(slow) => Bound::new(py, LowPass(slow))?.into_any(),
            FeedbackFilter::Lead(lead) => Bound::new(py, Lead(lead))?.into_any(),
            FeedbackFilter::Biquad(section) => Bound::new(py, Biquad(section))?.into_any(),
        })
    });
    PyTuple::new(py, made.collect::<PyResult<Vec<_>>>()?)
}

/// Sections as a tuple of objects.
pub(super) fn as_tuple<'py>(py: Python<'py>, sections: &Sections) -> PyResult<Bound<'py, PyTuple>> {
    let made = sections.as_slice().iter().map(|section| Bound::new(py, Biquad(*section)));
    PyTuple::new(py, made.collect::<PyResult<Vec<_>>>()?)
}

/// Filters that run, sample by sample, from rest at zero: of a measurement, say, before anything else sees it.
///
/// Parameters
/// ----------
/// filters : Notch, LowPass, Lead, Biquad, or a list of them
///     At most 6.
/// dt : float
///     Sampling interval in seconds.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> slow = mh.control.Filter(mh.control.LowPass(500.0), dt=1e-4)
/// >>> slow.run([1.0, 1.0, 1.0]).round(4)
/// array([0.1367, 0.3728, 0.5443])
/// >>> slow.settle(1.0)
/// >>> round(slow.step(1.0), 12)
/// 1.0
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct Filter {
    filter: core::Filter,
    dt: f64,
}

impl Stepper for Filter {
    fn process(&self) -> &impl Process {
        &self.filter
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.filter
    }

    fn rejected(&self) -> u64 {
        self.filter.rejected()
    }
}

impl Filter {
    /// A filter that is there already, for one sampling interval.
    pub(crate) fn of(filter: core::Filter, dt: f64) -> Self {
        Self { filter, dt }
    }
}

#[methods]
impl Filter {
    #[new]
    fn new(filters: Filters, dt: f64) -> PyResult<Self> {
        let filter = core::Filter::new(filters.sections(dt)?.as_slice()).map_err(raise)?;
        Ok(Self { filter, dt })
    }

    /// The filters, as sections.
    #[getter]
    #[py(-> "tuple[Biquad, ...]")]
    fn filters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        as_tuple(py, self.filter.sections())
    }

    /// Changes the filters without a jump: with the same input the output stays as it was, and goes on from there.
    fn set_filters(slf: &Bound<'_, Self>, filters: Filters) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let sections = filters.sections(this.dt)?;
        this.filter.set_sections(sections.as_slice()).map_err(raise)
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.dt
    }

    /// Comes to rest at an input, as if it had always been the same.
    fn settle(slf: &Bound<'_, Self>, input: f64) -> PyResult<()> {
        exclusive(slf)?.filter.settle(input).map_err(raise)
    }

    /// Everything that the filters remember, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.filter.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.filter.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let made = (as_tuple(py, this.filter.sections())?, this.dt);
        reduce(py.get_type::<Self>().into_any(), made, keywords!(py), Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        format!("<Filter: {} sections, dt {:?} s>", self.filter.sections().as_slice().len(), self.dt)
    }
}
