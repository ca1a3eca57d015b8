//! References with their derivatives: where to be, how fast, and how that changes, at any time.
//!
//! What inverts dynamics needs the derivatives of the reference (see [`feedforward`](crate::feedforward)). These trajectories
//! have them in closed form, and all up to the acceleration are continuous.

mod lissajous;
mod motion;
mod point_to_point;
mod raster;
mod rounded_triangle;
mod scan;
mod sine;
mod smooth;
mod spiral;

pub use lissajous::Lissajous;
pub use motion::{Motion, Trajectory};
pub use point_to_point::{MotionLimits, PointToPoint};
pub use raster::{Raster, RasterOptions};
pub use rounded_triangle::RoundedTriangle;
pub use scan::{Axis, Scan, ScanAxis};
pub use sine::Sine;
pub use spiral::{Spiral, SpiralRate};
