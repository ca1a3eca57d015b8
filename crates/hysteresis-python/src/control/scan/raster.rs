//! `mpi_hyst.trajectories.Raster`.

use hysteresis_control::trajectory::{self, RasterOptions};
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::axis::{AnyScan, center_of};
use crate::convert::arguments::{OrDefault, count, numbers};
use crate::convert::errors::raise;
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

/// A raster: the fast axis x goes to and fro at a constant speed, the slow axis y advances.
///
/// On a line x crosses the width at the speed v = width / ((1 - a) T), where T = 0.5 / line_rate, or 1 / line_rate if it is
/// bidirectional, and a = `turnaround`. Behind the line it turns round in c = a T seconds: the velocity goes from v to -v along
/// v (1 - 2 S(s)), S(s) = 10 s^3 - 15 s^4 + 6 s^5. So x reaches `overscan` = 11/32 v c beyond the image, and accelerates by at most
/// `acceleration` = 15/4 v / c. Position, velocity and acceleration are continuous.
///
/// Both axes begin and end at rest. `Stage.precompensate` leads to where they begin with `lead_in`.
///
/// Parameters
/// ----------
/// width : float
///     How long the lines are, without the overscan, in the unit of the position (um).
/// height : float
///     What the lines cover: they are height / lines apart, each in the middle of its strip. 0 repeats one line.
/// lines : int
/// line_rate : float
///     Lines per second, in Hz.
/// turnaround : float
///     The share of the time that goes into turning round, above 0 and below 1.
/// bidirectional : bool
///     Whether the way back is the next line. Else every line is traced, from -width / 2 to width / 2, and retraced.
/// steps : bool
///     Whether y rests during a line and steps to the next one during the turn. Else it is a ramp, which passes the place of a line
///     in the middle of its time.
/// center : (x, y)
///     Of the image.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import mpi_hyst as mh
/// >>> raster = mh.trajectories.Raster(10.0, 8.0, 64, line_rate=5.0)
/// >>> raster.speed, round(raster.overscan, 3), round(raster.acceleration, 3)  # um/s, um, um/s^2
/// (125.0, 0.859, 23437.5)
/// >>> x, velocity, acceleration = raster.x.sample(dt=1e-4)
/// >>> line = raster.line_index(dt=1e-4)  # -1 in turns and while a line is retraced
/// >>> trace = x[line == 7]
/// >>> trace.size, bool(np.allclose(np.diff(trace), 125.0 * 1e-4))
/// (800, True)
/// >>> bool(abs(velocity).max() <= raster.speed), velocity[[0, -1]]
/// (True, array([0., 0.]))
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct Raster(pub(super) trajectory::Raster);

impl Raster {
    /// As a scan of any kind.
    pub(super) fn any(&self) -> AnyScan {
        AnyScan::Raster(self.0)
    }
}

#[methods]
impl Raster {
    #[new]
    fn new(
        width: f64,
        height: f64,
        #[py("int")] lines: &Bound<'_, PyAny>,
        #[py(*)] line_rate: f64,
        #[py("float" = 0.2)] turnaround: Option<&Bound<'_, PyAny>>,
        #[py("bool" = false)] bidirectional: OrDefault<'_>,
        #[py("bool" = false)] steps: OrDefault<'_>,
        #[py("tuple[float, float]" = (0.0, 0.0))] center: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        numbers!(turnaround);
        let lines = u32::try_from(count("lines", lines)?).unwrap_or(u32::MAX);
        let plain = RasterOptions::new(width, height, lines, line_rate);
        let turnaround = turnaround.unwrap_or(plain.turnaround);
        let (is_bidirectional, has_steps) = (bidirectional.flag("bidirectional")?, steps.flag("steps")?);
        let center = center_of(center)?;
        let options = RasterOptions { turnaround, is_bidirectional, has_steps, center, ..plain };
        trajectory::Raster::new(options).map(Self).map_err(raise)
    }

    /// How long the lines are, without the overscan.
    #[getter]
    fn width(&self) -> f64 {
        self.0.options().width
    }

    /// What the lines cover.
    #[getter]
    fn height(&self) -> f64 {
        self.0.options().height
    }

    /// How many.
    #[getter]
    fn lines(&self) -> u32 {
        self.0.options().lines
    }

    /// Lines per second, in Hz.
    #[getter]
    fn line_rate(&self) -> f64 {
        self.0.options().line_rate
    }

    /// The share of the time that goes into turning round.
    #[getter]
    fn turnaround(&self) -> f64 {
        self.0.options().turnaround
    }

    /// Whether the way back is the next line.
    #[getter]
    fn bidirectional(&self) -> bool {
        self.0.options().is_bidirectional
    }

    /// Whether y rests during a line.
    #[getter]
    fn steps(&self) -> bool {
        self.0.options().has_steps
    }

    /// The centre of the image.
    #[getter]
    fn center(&self) -> (f64, f64) {
        self.0.options().center
    }

    /// The speed of x on the lines, per second.
    #[getter]
    fn speed(&self) -> f64 {
        self.0.speed()
    }

    /// The greatest acceleration of x, in the middle of a turn, per second squared.
    #[getter]
    fn acceleration(&self) -> f64 {
        self.0.acceleration()
    }

    /// How far x reaches beyond the image on either side.
    #[getter]
    fn overscan(&self) -> f64 {
        self.0.overscan()
    }

    /// How many seconds x takes for the width.
    #[getter]
    fn line_duration(&self) -> f64 {
        self.0.line_duration()
    }

    /// The line on which each sample of `x.sample(dt)` lies, counted from 0, and -1 for none: an array of integers.
    ///
    /// With `retrace` it is the line that is retraced, else the one that is traced. A bidirectional raster has no retrace.
    fn line_index<'py>(
        &self,
        py: Python<'py>,
        dt: f64,
        #[py(*, "bool" = false)] retrace: OrDefault<'_>,
    ) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let lines = self.0.line_index(dt, retrace.flag("retrace")?).map_err(raise)?;
        Ok(PyArray1::from_iter(py, lines.into_iter().map(|line| line.map_or(-1, i64::from))))
    }

    fn __hash__(&self) -> u64 {
        let RasterOptions { width, height, lines, line_rate, turnaround, is_bidirectional, has_steps, center } =
            self.0.options();
        let flags = f64::from(u8::from(is_bidirectional) + 2 * u8::from(has_steps));
        hash([width, height, f64::from(lines), line_rate, turnaround, flags, center.0, center.1].into_iter())
    }

    fn __repr__(&self) -> String {
        let RasterOptions { width, height, lines, line_rate, turnaround, is_bidirectional, has_steps, center } =
            self.0.options();
        let word = |flag: bool| if flag { "True" } else { "False" };
        let (to_and_fro, steps) = (word(is_bidirectional), word(has_steps));
        format!(
            "Raster({width:?}, {height:?}, {lines}, line_rate={line_rate:?}, turnaround={turnaround:?}, \
             bidirectional={to_and_fro}, steps={steps}, center={center:?})"
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let RasterOptions { width, height, lines, line_rate, turnaround, is_bidirectional, has_steps, center } =
            self.0.options();
        let keywords = keywords!(
            py,
            line_rate = line_rate,
            turnaround = turnaround,
            bidirectional = is_bidirectional,
            steps = has_steps,
            center = center
        );
        reduce(py.get_type::<Self>().into_any(), (width, height, lines), keywords, None)
    }
}
