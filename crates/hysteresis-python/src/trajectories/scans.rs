//! Scans of a plane: `Raster`, `Spiral` and `Lissajous` of `mpi_hyst.trajectories`, and one axis of each.

use std::num::NonZeroUsize;

use hysteresis_control::trajectory::{self, Axis, Motion, RasterOptions, Scan, SpiralRate, Trajectory};
use hysteresis_python_macros::{methods, py};
use numpy::PyArray1;
use pyo3::prelude::*;

use super::one_axis::{Motions, sample};
use crate::argument::Argument;
use crate::convert::arguments::pair_of_axes;
use crate::convert::errors::{raise, value};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

/// A scan of any kind.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum AnyScan {
    Raster(trajectory::Raster),
    Spiral(trajectory::Spiral),
    Lissajous(trajectory::Lissajous),
}

impl AnyScan {
    /// The scan as an object.
    fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(match *self {
            Self::Raster(scan) => Bound::new(py, Raster(scan))?.into_any(),
            Self::Spiral(scan) => Bound::new(py, Spiral(scan))?.into_any(),
            Self::Lissajous(scan) => Bound::new(py, Lissajous(scan))?.into_any(),
        })
    }
}

impl Scan for AnyScan {
    fn motion(&self, axis: Axis, t: f64) -> Motion {
        match self {
            Self::Raster(scan) => scan.motion(axis, t),
            Self::Spiral(scan) => scan.motion(axis, t),
            Self::Lissajous(scan) => scan.motion(axis, t),
        }
    }

    fn duration(&self) -> f64 {
        match self {
            Self::Raster(scan) => scan.duration(),
            Self::Spiral(scan) => scan.duration(),
            Self::Lissajous(scan) => scan.duration(),
        }
    }
}

/// One axis of a scan, with its derivatives: made by `.x` and `.y` of a `Raster`, `Spiral` or `Lissajous`.
///
/// Both axes of a scan take equally long, so their samples belong together.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> raster = mh.trajectories.Raster(10.0, 8.0, 64, line_rate=5.0)  # um, um, lines, Hz
/// >>> position, velocity, acceleration = raster.x.sample(dt=1e-4)
/// >>> position.size == round(raster.x.duration / 1e-4) + 1
/// True
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct ScanAxis(pub(crate) trajectory::ScanAxis<AnyScan>);

#[methods]
impl ScanAxis {
    /// Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
    /// per second, and per second squared.
    ///
    /// For `seconds`; by default until the end has come.
    fn sample<'py>(&self, py: Python<'py>, dt: f64, #[py(= None)] seconds: Option<f64>) -> Motions<'py> {
        sample(py, &self.0, dt, seconds)
    }

    /// The scan to which it belongs.
    #[getter]
    #[py(-> "Raster | Spiral | Lissajous")]
    fn scan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.scan().object(py)
    }

    /// "x" or "y".
    #[getter]
    #[py(-> "Literal['x', 'y']")]
    fn name(&self) -> &'static str {
        match self.0.axis() {
            Axis::X => "x",
            Axis::Y => "y",
        }
    }

    /// Seconds until it rests at the end.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        (self.0.scan().object(py)?, self.name()).into_pyobject(py)?.hash()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("{}.{}", self.0.scan().object(py)?.repr()?, self.name()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let getattr = py.import("builtins")?.getattr("getattr")?;
        reduce(getattr, (self.0.scan().object(py)?, self.name()), keywords!(py), None)
    }
}

// What all scans offer.
#[methods(Raster, Spiral, Lissajous)]
impl Each {
    /// The trajectory of x, the fast axis of a raster.
    #[getter]
    fn x(&self) -> ScanAxis {
        ScanAxis(self.any().x())
    }

    /// The trajectory of y.
    #[getter]
    fn y(&self) -> ScanAxis {
        ScanAxis(self.any().y())
    }

    /// Seconds until both axes rest at the end.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

/// One number for each axis of the plane.
struct OfAxes((f64, f64));

#[py("tuple[float, float]")]
impl Argument<'_> for OfAxes {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        pair_of_axes(name, value).map(Self)
    }
}

impl From<OfAxes> for (f64, f64) {
    fn from(OfAxes(axes): OfAxes) -> Self {
        axes
    }
}

/// A raster: the fast axis x goes to and fro at a constant speed, the slow axis y advances.
///
/// On a line x crosses the width at the speed v = width / ((1 - a) T), where T = 0.5 / line_rate, or 1 / line_rate if
/// it is bidirectional, and a = `turnaround`. Behind the line it turns round in c = a T seconds: the velocity goes from
/// v to -v along v (1 - 2 S(s)), S(s) = 10 s^3 - 15 s^4 + 6 s^5. So x reaches `overscan` = 11/32 v c beyond the image,
/// and accelerates by at most `acceleration` = 15/4 v / c. Position, velocity and acceleration are continuous.
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
///     Whether y rests during a line and steps to the next one during the turn. Else it is a ramp, which passes the
///     place of a line in the middle of its time.
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
    #[gather(options: RasterOptions = RasterOptions::new(width, height, 1, line_rate))]
    fn new(
        width: f64,
        height: f64,
        lines: NonZeroUsize,
        #[py(*)] line_rate: f64,
        #[py(field = 0.2)] turnaround: f64,
        #[py(field(is_bidirectional) = false)] bidirectional: bool,
        #[py(field(has_steps) = false)] steps: bool,
        #[py(field = (0.0, 0.0))] center: OfAxes,
    ) -> PyResult<Self> {
        let options = RasterOptions { lines: u32::try_from(lines.get()).unwrap_or(u32::MAX), ..options };
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
    /// With `retrace` it is the line that is retraced, else the one that is traced. A bidirectional raster has no
    /// retrace.
    fn line_index<'py>(
        &self,
        py: Python<'py>,
        dt: f64,
        #[py(*, = false)] retrace: bool,
    ) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let lines = self.0.line_index(dt, retrace).map_err(raise)?;
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

/// An Archimedean spiral from the centre outwards: r = pitch theta / (2 pi), x = r cos theta, y = r sin theta.
///
/// Give it a `frequency` for a constant angular velocity (CAV): both axes are sines of one frequency, whose amplitudes
/// grow. Give it a `speed` for a constant linear velocity (CLV): every part of the image is scanned equally fast
/// (Mahmood and Moheimani, Nanotechnology 20, 365503, 2009). Near the centre a constant speed would take any angular
/// velocity. So a spiral starts there at rest, and its rate is full from `inner_radius` on. The acceleration is at most
/// 1.5 speed^2 / inner_radius, and 1.2 if the inner radius is a pitch or more. It ends at rest on its radius. Position,
/// velocity and acceleration are continuous.
///
/// Parameters
/// ----------
/// radius : float
///     Where it ends, in the unit of the position (um).
/// pitch : float
///     How far its turns are apart, at most the radius.
/// frequency : float
///     Turns per second, in Hz; or
/// speed : float
///     The speed along the path, in the unit of the position per second.
/// inner_radius : float, optional
///     From where on the rate is full, at most half of the radius; by default a tenth of it.
/// center : (x, y)
///     Where it starts.
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
/// >>> spiral = mh.trajectories.Spiral(5.0, 0.1, speed=100.0)
/// >>> (x, vx, ax), (y, vy, ay) = spiral.x.sample(dt=1e-4), spiral.y.sample(dt=1e-4)
/// >>> begin, end = (round(t / 1e-4) for t in spiral.steady)
/// >>> bool(np.allclose(np.hypot(vx, vy)[begin:end], 100.0)), round(float(np.hypot(x, y).max()), 6)
/// (True, 5.0)
/// >>> cav = mh.trajectories.Spiral(5.0, 0.1, frequency=30.0)
/// >>> round(cav.duration, 2)  # 50 turns, those near the centre and the end slower
/// 1.84
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct Spiral(pub(super) trajectory::Spiral);

/// The inner radius of a spiral that has none of its own, as a share of the radius.
const INNER: f64 = 0.1;

impl Spiral {
    /// As a scan of any kind.
    pub(super) fn any(&self) -> AnyScan {
        AnyScan::Spiral(self.0)
    }
}

#[methods]
impl Spiral {
    #[new]
    fn new(
        radius: f64,
        pitch: f64,
        #[py(*, = None)] frequency: Option<f64>,
        #[py(= None)] speed: Option<f64>,
        #[py(= None)] inner_radius: Option<f64>,
        #[py(= (0.0, 0.0))] center: OfAxes,
    ) -> PyResult<Self> {
        let rate = match (frequency, speed) {
            (Some(frequency), None) => SpiralRate::Angular { frequency },
            (None, Some(speed)) => SpiralRate::Linear { speed },
            (None, None) => return Err(value("frequency", "expected a frequency or a speed, got neither")),
            (Some(frequency), Some(speed)) => {
                let got = format_args!("expected a frequency or a speed, got {frequency:?} and {speed:?}");
                return Err(value("frequency", got));
            }
        };
        let inner_radius = inner_radius.unwrap_or(INNER * radius);
        trajectory::Spiral::new(radius, pitch, rate, inner_radius, center.0).map(Self).map_err(raise)
    }

    /// Where it ends.
    #[getter]
    fn radius(&self) -> f64 {
        self.0.radius()
    }

    /// How far its turns are apart.
    #[getter]
    fn pitch(&self) -> f64 {
        self.0.pitch()
    }

    /// Turns per second, in Hz, if the angular velocity is constant, else None.
    #[getter]
    fn frequency(&self) -> Option<f64> {
        match self.0.rate() {
            SpiralRate::Angular { frequency } => Some(frequency),
            SpiralRate::Linear { .. } => None,
        }
    }

    /// The speed along the path, if it is constant, else None.
    #[getter]
    fn speed(&self) -> Option<f64> {
        match self.0.rate() {
            SpiralRate::Angular { .. } => None,
            SpiralRate::Linear { speed } => Some(speed),
        }
    }

    /// From where on the rate is full.
    #[getter]
    fn inner_radius(&self) -> f64 {
        self.0.inner_radius()
    }

    /// Where it starts.
    #[getter]
    fn center(&self) -> (f64, f64) {
        self.0.center()
    }

    /// The times between which the rate is full, in seconds: (begin, end).
    #[getter]
    fn steady(&self) -> (f64, f64) {
        self.0.steady()
    }

    fn __hash__(&self) -> u64 {
        let (frequency, speed) = (self.frequency().unwrap_or(0.0), self.speed().unwrap_or(0.0));
        let (radius, pitch, inner, center) = (self.radius(), self.pitch(), self.inner_radius(), self.center());
        hash([radius, pitch, frequency, speed, inner, center.0, center.1].into_iter())
    }

    fn __repr__(&self) -> String {
        let rate = match self.0.rate() {
            SpiralRate::Angular { frequency } => format!("frequency={frequency:?}"),
            SpiralRate::Linear { speed } => format!("speed={speed:?}"),
        };
        let (radius, pitch, inner, center) = (self.radius(), self.pitch(), self.inner_radius(), self.center());
        format!("Spiral({radius:?}, {pitch:?}, {rate}, inner_radius={inner:?}, center={center:?})")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let keywords = keywords!(
            py,
            frequency = self.frequency(),
            speed = self.speed(),
            inner_radius = self.inner_radius(),
            center = self.center()
        );
        reduce(py.get_type::<Self>().into_any(), (self.radius(), self.pitch()), keywords, None)
    }
}

/// A Lissajous figure: a sine on each axis, whose amplitudes grow from rest and fade to rest.
///
/// x = e(t) a_x sin(2 pi f_x (t - t_0) + phase), y = e(t) a_y sin(2 pi f_y (t - t_0)), about the center. The envelope e
/// goes from 0 to 1 along S(s) = 10 s^3 - 15 s^4 + 6 s^5 until the lead-in ends at t_0, and back to 0 behind the
/// figure. Position, velocity and acceleration are continuous, and begin and end at rest. The figure repeats itself 1 /
/// g seconds later, g being the greatest frequency of which both are whole multiples.
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
///     How many seconds the amplitudes grow, and fade; by default two periods of the slower sine. Then no velocity is
///     greater than in the figure, and no acceleration by more than 4 %.
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
        amplitudes: OfAxes,
        frequencies: OfAxes,
        #[py(*)] seconds: f64,
        #[py(= 0.0)] phase: f64,
        #[py(= None)] lead_in: Option<f64>,
        #[py(= (0.0, 0.0))] center: OfAxes,
    ) -> PyResult<Self> {
        let lead_in = lead_in.unwrap_or_else(|| trajectory::Lissajous::default_lead_in(frequencies.0));
        trajectory::Lissajous::new(amplitudes.0, frequencies.0, phase, seconds, lead_in, center.0)
            .map(Self)
            .map_err(raise)
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
