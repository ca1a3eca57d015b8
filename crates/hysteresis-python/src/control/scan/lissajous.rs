//! `mpi_hyst.trajectories.Lissajous`.

use hysteresis_control::trajectory::{self};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use super::axis::{AnyScan, center_of};
use crate::convert::arguments::pair_of_axes;
use crate::convert::errors::raise;
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

/// A Lissajous figure: a sine on each axis, whose amplitudes grow from rest and fade to rest.
///
/// x = e(t) a_x sin(2 pi f_x (t - t_0) + phase), y = e(t) a_y sin(2 pi f_y (t - t_0)), about the center. The envelope e goes from 0 to
/// 1 along S(s) = 10 s^3 - 15 s^4 + 6 s^5 until the lead-in ends at t_0, and back to 0 behind the figure. Position, velocity and
/// acceleration are continuous, and begin and end at rest. The figure repeats itself 1 / g seconds later, g being the greatest
/// frequency of which both are whole multiples.
///
/// Parameters
/// ----------
/// amplitudes : (x, y)
///     Half of the swing of each axis, in the unit of the position (um).
/// frequencies : (x, y)
///     Cycles per second, in Hz.
/// seconds : float
///     How long the figure takes, without its lead-in and lead-out.
/// phase : float
///     The phase of x in radians where the lead-in ends; that of y is 0 there.
/// lead_in : float, optional
///     How many seconds the amplitudes grow, and fade; by default two periods of the slower sine. Then no velocity is greater than in the
///     figure, and no acceleration by more than 4 %.
/// center : (x, y)
///     Where it starts and ends.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> figure = mh.trajectories.Lissajous((5.0, 4.0), (30.0, 29.0), seconds=1.0)
/// >>> x, velocity, acceleration = figure.x.sample(dt=1e-4)
/// >>> velocity[[0, -1]], round(float(abs(x).max()), 4)
/// (array([0., 0.]), 5.0)
/// >>> begin, end = figure.steady
/// >>> round(end - begin, 12), figure.lead_in == 2.0 / 29.0
/// (1.0, True)
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct Lissajous(pub(super) trajectory::Lissajous);

impl Lissajous {
    /// As a scan of any kind.
    pub(super) fn any(&self) -> AnyScan {
        AnyScan::Lissajous(self.0)
    }
}

#[methods]
impl Lissajous {
    #[new]
    fn new(
        #[py("tuple[float, float]")] amplitudes: &Bound<'_, PyAny>,
        #[py("tuple[float, float]")] frequencies: &Bound<'_, PyAny>,
        #[py(*)] seconds: f64,
        #[py(= 0.0)] phase: f64,
        #[py(= None)] lead_in: Option<f64>,
        #[py("tuple[float, float]" = (0.0, 0.0))] center: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let amplitudes = pair_of_axes("amplitudes", amplitudes)?;
        let frequencies = pair_of_axes("frequencies", frequencies)?;
        let lead_in = lead_in.unwrap_or_else(|| trajectory::Lissajous::default_lead_in(frequencies));
        let center = center_of(center)?;
        trajectory::Lissajous::new(amplitudes, frequencies, phase, seconds, lead_in, center).map(Self).map_err(raise)
    }

    /// Half of the swing of x and of y.
    #[getter]
    fn amplitudes(&self) -> (f64, f64) {
        self.0.amplitudes()
    }

    /// Cycles per second of x and of y, in Hz.
    #[getter]
    fn frequencies(&self) -> (f64, f64) {
        self.0.frequencies()
    }

    /// How many seconds the figure takes, without its lead-in and lead-out.
    #[getter]
    fn seconds(&self) -> f64 {
        self.0.seconds()
    }

    /// The phase of x in radians where the lead-in ends.
    #[getter]
    fn phase(&self) -> f64 {
        self.0.phase()
    }

    /// How many seconds the amplitudes grow, and fade.
    #[getter]
    fn lead_in(&self) -> f64 {
        self.0.lead_in()
    }

    /// Where it starts and ends.
    #[getter]
    fn center(&self) -> (f64, f64) {
        self.0.center()
    }

    /// The times between which the amplitudes are constant, in seconds: (begin, end).
    #[getter]
    fn steady(&self) -> (f64, f64) {
        self.0.steady()
    }

    fn __hash__(&self) -> u64 {
        let (amplitudes, frequencies, center) = (self.amplitudes(), self.frequencies(), self.center());
        let pairs = [amplitudes.0, amplitudes.1, frequencies.0, frequencies.1, center.0, center.1];
        hash(pairs.into_iter().chain([self.seconds(), self.phase(), self.lead_in()]))
    }

    fn __repr__(&self) -> String {
        let (amplitudes, frequencies, center) = (self.amplitudes(), self.frequencies(), self.center());
        let (seconds, phase, lead_in) = (self.seconds(), self.phase(), self.lead_in());
        format!(
            "Lissajous({amplitudes:?}, {frequencies:?}, seconds={seconds:?}, phase={phase:?}, lead_in={lead_in:?}, \
             center={center:?})"
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let keywords = keywords!(
            py,
            seconds = self.seconds(),
            phase = self.phase(),
            lead_in = self.lead_in(),
            center = self.center()
        );
        reduce(py.get_type::<Self>().into_any(), (self.amplitudes(), self.frequencies()), keywords, None)
    }
}
