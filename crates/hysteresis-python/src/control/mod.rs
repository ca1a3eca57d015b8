//! Control: the controller, linear dynamics, feed-forward through their inverse, tuning, learning.

pub(crate) mod array_controller;
pub(crate) mod controller;
pub(crate) mod filters;
pub(crate) mod inverse_dynamics;
pub(crate) mod learning;
pub(crate) mod multi_axis;
pub(crate) mod observer;
pub(crate) mod shared_by_controllers;
pub(crate) mod tuning;
