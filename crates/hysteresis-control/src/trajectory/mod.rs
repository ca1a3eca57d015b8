//! References with their derivatives: where to be, how fast, and how that changes, at any time.
//!
//! What inverts dynamics needs the derivatives of the reference (see [`feedforward`](crate::feedforward)). These trajectories
//! have them in closed form, and all up to the acceleration are continuous.

mod motion;
mod point_to_point;
mod rounded_triangle;
mod sine;

pub use motion::{Motion, Trajectory};
pub use point_to_point::{MotionLimits, PointToPoint};
pub use rounded_triangle::RoundedTriangle;
pub use sine::Sine;
