//! The oscillator with hysteresis inside.

use std::path::PathBuf;

use hysteresis_control::multi_axis;
use hysteresis_control::oscillator::{self, Hold, Motion, tables};
use hysteresis_core::{DuhemForward, Process};
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;
use pythonize::pythonize;

use crate::argument::{Class, Words};
use crate::convert::arrays::{PASS, check_room};
use crate::convert::errors::{self, raise};
use crate::convert::files;
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::model::duhem::Duhem;
use crate::stage::multi_axis_stage::MultiAxisStage;
use crate::stream::single_argument::Stepper;

impl Words for Hold {
    const WORDS: &'static [(&'static str, Self)] = &[("zero", Self::Zero), ("band_limited", Self::BandLimited)];
}

impl Class for Duhem {
    const CALLED: &'static str = "a mh.Duhem";
}

/// An oscillator with hysteresis inside: y'' + c y' + k y + z\[y\] = b u.
///
/// z is a `Duhem` operator of the motion y itself: friction, cables, bearings, magnetic springs, the Bouc-Wen
/// oscillator. No hysteresis in front of linear dynamics is of this kind. All terms are divided by the mass.
///
/// The drive is either held between samples ("zero", as by a converter) or smooth ("band_limited": samples of a
/// signal without content near half of the sampling rate).
///
/// Parameters
/// ----------
/// gain : float
///     b, other than 0, in the unit of y'' over that of u.
/// damping : float
///     c, at least 0, in 1/s.
/// stiffness : float
///     k in 1/s^2, beside that of the hysteresis; above minus its smallest f.
/// hysteresis : Duhem
///     z over y; f in 1/s^2. Its own memory does not matter.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// The public Bouc-Wen benchmark, divided by its mass of 2 kg:
///
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
/// >>> oscillator = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
/// >>> t = 1e-4 * np.arange(10_000)  # s
/// >>> wanted = 5e-4 * (1 - np.exp(-(t / 0.1)**4)) * np.sin(2 * np.pi * 20 * t)  # m
/// >>> u = oscillator.inverse(wanted, dt=1e-4)  # N
/// >>> y = oscillator.response(u, dt=1e-4)
/// >>> bool(np.abs(y - wanted).max() < 5e-7)  # 0.1 %
/// True
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct HystereticOscillator(pub(crate) oscillator::HystereticOscillator);

/// The position of an oscillator, sample by sample: made by `oscillator.forward(dt)`.
///
/// `step(u)` returns y(k), then holds u(k) for one interval; `advance(u)` holds it and returns y(k+1).
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
/// >>> forward = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis).forward(1e-3)
/// >>> forward.step(100.0), forward.step(100.0) > 0.0
/// (0.0, True)
#[pyclass(module = "mpi_hyst.plant")]
pub(crate) struct OscillatorForward {
    stream: oscillator::OscillatorForward,
    made: (oscillator::HystereticOscillator, f64, Option<usize>),
}

impl Stepper for OscillatorForward {
    fn process(&self) -> &impl Process {
        &self.stream
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.stream
    }

    fn rejected(&self) -> u64 {
        self.stream.rejected()
    }
}

/// The most periods before the one that is returned.
const MOST_SETTLED: usize = 1000;

type Array<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

#[methods]
impl HystereticOscillator {
    #[new]
    fn new(gain: f64, damping: f64, stiffness: f64, hysteresis: Bound<'_, Duhem>) -> PyResult<Self> {
        let operator = *shared(&hysteresis)?.0.duhem();
        oscillator::HystereticOscillator::new(gain, damping, stiffness, operator).map(Self).map_err(raise)
    }

    /// b.
    #[getter]
    fn gain(&self) -> f64 {
        self.0.gain()
    }

    /// c in 1/s.
    #[getter]
    fn damping(&self) -> f64 {
        self.0.damping()
    }

    /// k in 1/s^2.
    #[getter]
    fn stiffness(&self) -> f64 {
        self.0.stiffness()
    }

    /// z over y: a new operator at rest.
    #[getter]
    fn hysteresis(&self) -> Duhem {
        Duhem(DuhemForward::new(*self.0.hysteresis()))
    }

    /// A stage of one axis, sampled every `dt` seconds: for a controller, `oscillator.axes(dt).controller(limits)`.
    ///
    /// What z is beside its middle slope is held over a sub-step, `dt / sub_steps`, at the position in its middle:
    /// errors go with the square of that, and grow with the amplitude. With 20 sub-steps in the shortest period they
    /// are 0.2 % of the motion of the Bouc-Wen benchmark under 50 N rms of noise up to 100 Hz, and 2.3 % under 600 N;
    /// with 80, 0.01 and 0.1 %. To simulate take `forward`, of fourth order.
    ///
    /// Raises ValueError unless the sub-steps are so short beside a period that the sampled oscillator is stable.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> import numpy as np
    /// >>> hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    /// >>> oscillator = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
    /// >>> controller, plant = oscillator.axes(1e-3).controller((-200.0, 200.0)), oscillator.forward(1e-3)
    /// >>> wanted = 5e-4 * np.sin(2 * np.pi * 5.0 * 1e-3 * np.arange(1000))  # m
    /// >>> y, errors = 0.0, []
    /// >>> for k in range(1000 - controller.ahead):
    /// ...     errors.append(y - wanted[k])
    /// ...     y = plant.advance(controller.step([wanted[k + controller.ahead]], [y])[0])
    /// >>> bool(np.std(errors[200:]) < 1e-3 * np.std(wanted))
    /// True
    fn axes(&self, dt: f64, #[py(*, = 1)] sub_steps: usize) -> PyResult<MultiAxisStage> {
        multi_axis::MultiAxisStage::of_oscillator(&self.0, dt, sub_steps).map(MultiAxisStage).map_err(raise)
    }

    /// The stream for an interval `dt` in seconds, at rest. It integrates `sub_steps` steps of fourth order in an
    /// interval; by default as many as keep their errors at a few 1e-4 of the motion, four at least.
    fn forward(&self, dt: f64, #[py(= None)] sub_steps: Option<usize>) -> PyResult<OscillatorForward> {
        let stream = oscillator::OscillatorForward::new(&self.0, dt, sub_steps).map_err(raise)?;
        Ok(OscillatorForward { stream, made: (self.0.clone(), dt, sub_steps) })
    }

    /// The positions y(k) under a whole drive u(k), at rest before it. With `settle` the drive is a period that
    /// repeats for ever: the positions are those after so many periods, 1000 at most.
    fn response<'py>(
        &self,
        u: PyReadonlyArray1<'py, f64>,
        #[py(*)] dt: f64,
        #[py(= "zero")] hold: Hold,
        #[py(= None)] settle: Option<usize>,
        #[py(= None)] sub_steps: Option<usize>,
    ) -> Array<'py> {
        let (py, samples) = (u.py(), u.as_slice()?);
        if let Some(got) = settle.filter(|settle| *settle > MOST_SETTLED) {
            return Err(errors::value("settle", format_args!("expected at most {MOST_SETTLED} periods, got {got}")));
        }
        let steps = self.0.sub_steps(dt, sub_steps).map_err(raise)?;
        check_room("u", samples.len(), PASS + 2 * steps * size_of::<f64>())?;
        let response = match settle {
            None => self.0.response(samples, dt, hold, sub_steps),
            Some(periods) => self.0.periodic_response(samples, dt, hold, sub_steps, periods),
        };
        response.map(|y| PyArray1::from_vec(py, y)).map_err(raise)
    }

    /// The drive that makes the oscillator follow a wanted motion y: u = (y'' + c y' + k y + z\[y\]) / b, in one
    /// pass.
    ///
    /// Give `velocity` and `acceleration` where they are known. Without them they are central differences of eighth
    /// order, still before the beginning: with 20 samples in the shortest period of the motion they miss less than
    /// 1e-6, with 10 about 1e-4. z is followed between samples too; turning points are found to second order. A drive
    /// that is held is the mean over its interval.
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        y: Vec<f64>,
        #[py(*)] dt: f64,
        #[py(= None)] velocity: Option<Vec<f64>>,
        #[py(= None)] acceleration: Option<Vec<f64>>,
        #[py(= "zero")] hold: Hold,
    ) -> Array<'py> {
        check_room("y", y.len(), 2 * PASS)?;
        let motion = match (velocity, acceleration) {
            (None, None) => Motion::from_positions(y, dt),
            (Some(velocity), Some(acceleration)) => Motion::new(y, velocity, acceleration, dt),
            (None, Some(_)) => {
                return Err(errors::value("velocity", "expected an array beside acceleration, got None"));
            }
            (Some(_), None) => {
                return Err(errors::value("acceleration", "expected an array beside velocity, got None"));
            }
        };
        Ok(PyArray1::from_vec(py, self.0.inverse(&motion.map_err(raise)?, hold)))
    }

    /// Writes the oscillator to a JSON file; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let json = self.0.to_json().map_err(|error| errors::file(&path, &error))?;
        files::write_json(py, path, json)
    }

    /// The oscillator that `save` wrote, bit for bit.
    ///
    /// Raises OSError if the file cannot be read, ValueError if it holds no oscillator.
    #[classmethod]
    fn load(_: &Bound<'_, PyType>, path: PathBuf) -> PyResult<Self> {
        files::load(&path, oscillator::HystereticOscillator::from_json).map(Self)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        let numbers = [self.gain(), self.damping(), self.stiffness()];
        crate::convert::objects::hash(numbers.into_iter().chain(tables(self.0.hysteresis()).concat()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arguments = (self.gain(), self.damping(), self.stiffness(), self.hysteresis());
        reduce(py.get_type::<Self>().into_any(), arguments, keywords!(py), None)
    }

    fn __repr__(&self) -> String {
        let knots = self.0.hysteresis().knots().count();
        format!(
            "<HystereticOscillator: b {:?}, c {:?} 1/s, k {:?} 1/s^2, {} knots>",
            self.gain(),
            self.damping(),
            self.stiffness(),
            knots
        )
    }
}

#[methods]
impl OscillatorForward {
    /// Holds a drive for one interval and returns the position at its end.
    fn advance(slf: &Bound<'_, Self>, drive: f64) -> PyResult<f64> {
        Ok(exclusive(slf)?.stream.advance(drive))
    }

    /// The number of integration steps in an interval.
    #[getter]
    fn sub_steps(&self) -> usize {
        self.stream.sub_steps()
    }

    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(slf.py(), &shared(slf)?.stream.state())?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.stream.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let (oscillator, dt, sub_steps) = &this.made;
        let oscillator = Bound::new(py, HystereticOscillator(oscillator.clone()))?;
        let state = Self::state(slf)?;
        reduce(oscillator.getattr(intern!(py, "forward"))?, (dt, sub_steps), keywords!(py), Some(state))
    }

    fn __repr__(&self) -> String {
        format!("<OscillatorForward, {} sub-steps>", self.sub_steps())
    }
}
