use super::motion::{Motion, Trajectory};

/// One of the two axes of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The fast axis of a raster.
    X,
    /// The slow axis of a raster.
    Y,
}

/// A path in the plane from rest to rest: its two axes take equally long, so they have equally many samples.
///
/// ```
/// use hysteresis_control::trajectory::{Lissajous, Motion, Scan, Trajectory};
/// let circle = Lissajous::new((3.0, 3.0), (10.0, 10.0), 0.5 * std::f64::consts::PI, 1.0, 0.2, (0.0, 0.0))?;
/// let (x, y) = (circle.x().sample(1e-3, None)?, circle.y().sample(1e-3, None)?);
/// assert_eq!((x.len(), y.len()), (1401, 1401)); // 1 s, twice 0.2 s, and the sample at the end
/// assert_eq!((x[0], x[1400]), (Motion::rest(0.0), Motion::rest(0.0)));
/// assert!((x[700].position.hypot(y[700].position) - 3.0).abs() < 1e-12);
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
pub trait Scan: Copy {
    /// Position and derivatives of one axis at the time t in seconds; finite for every finite t.
    fn motion(&self, axis: Axis, t: f64) -> Motion;

    /// How many seconds it takes until both axes have come to rest.
    fn duration(&self) -> f64;

    /// Its x axis.
    fn x(self) -> ScanAxis<Self> {
        ScanAxis { scan: self, axis: Axis::X }
    }

    /// Its y axis.
    fn y(self) -> ScanAxis<Self> {
        ScanAxis { scan: self, axis: Axis::Y }
    }
}

/// One axis of a scan, as a trajectory. Made by [`Scan::x`] and [`Scan::y`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanAxis<S> {
    scan: S,
    axis: Axis,
}

impl<S: Scan> ScanAxis<S> {
    /// The scan to which it belongs.
    #[must_use]
    pub fn scan(&self) -> S {
        self.scan
    }

    /// Which one.
    #[must_use]
    pub fn axis(&self) -> Axis {
        self.axis
    }
}

impl<S: Scan> Trajectory for ScanAxis<S> {
    fn at(&self, t: f64) -> Motion {
        self.scan.motion(self.axis, t)
    }

    fn duration(&self) -> f64 {
        self.scan.duration()
    }

    fn is_periodic(&self) -> bool {
        false
    }
}

impl Motion {
    /// The same elsewhere.
    pub(super) fn moved(self, by: f64) -> Self {
        Self { position: self.position + by, ..self }
    }

    /// The same in other units, or the other way round.
    pub(super) fn scaled(self, factor: f64) -> Self {
        // Adding 0 makes 0 of -0.
        let scaled = |value: f64| factor * value + 0.0;
        Self {
            position: scaled(self.position),
            velocity: scaled(self.velocity),
            acceleration: scaled(self.acceleration),
            jerk: scaled(self.jerk),
        }
    }
}
