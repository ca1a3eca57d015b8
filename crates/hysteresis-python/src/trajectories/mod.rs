//! Trajectories that know their derivatives: of one axis, and scans of a plane.

pub(crate) mod one_axis;
pub(crate) mod positions;
pub(crate) mod scans;
