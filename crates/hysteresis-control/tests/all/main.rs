//! The tests of what the crate promises, in one program: it is linked once.

mod binary;
mod duhem_beside;
mod dynamics;
mod error_band;
mod feedforward;
mod filters;
mod learning;
mod learning_modes;
mod linear;
mod loop_shift;
mod multi_axis;
mod multi_axis_controller;
mod no_allocation;
mod observer;
mod oscillator;
mod scan;
mod slow_gain;
mod stage;
mod stage_controller;
mod stage_ranges;
mod supervision;
mod support;
mod trajectory;
mod tuning;
