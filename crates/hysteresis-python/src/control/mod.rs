//! Control: the controller, linear dynamics, feed-forward through their inverse, tuning, learning.

pub(crate) mod controller;
mod feedback_loop;
pub(crate) mod iterative;
pub(crate) mod linear;
mod linear_part;
pub(crate) mod observer;
pub(crate) mod precompensate;
pub(crate) mod preview;
pub(crate) mod preview_window;
pub(crate) mod repetitive;
pub(crate) mod terms;
pub(crate) mod trajectories;
pub(crate) mod tuning;
