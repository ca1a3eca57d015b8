//! Control: the controller, linear dynamics, feed-forward through their inverse, tuning, learning.

pub(crate) mod array_controller;
mod array_controller_changes;
mod array_controller_made;
pub(crate) mod controller;
mod controller_changes;
mod controller_options;
mod controller_parts;
mod controller_steps;
pub(crate) mod feedback_loop;
pub(crate) mod filter_stream;
pub(crate) mod filters;
pub(crate) mod invert_dynamics;
pub(crate) mod iterative;
pub(crate) mod linear;
pub(crate) mod multi_axis;
mod multi_axis_changes;
pub(crate) mod observer;
pub(crate) mod preview;
pub(crate) mod preview_window;
pub(crate) mod reference;
pub(crate) mod repetitive;
pub(crate) mod scan;
pub(crate) mod source;
pub(crate) mod terms;
pub(crate) mod trajectories;
pub(crate) mod tune;
pub(crate) mod tuning;
