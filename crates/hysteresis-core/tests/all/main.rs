//! The tests of what the crate promises, in one program: it is linked once.

mod array_control;
mod array_laws;
mod axes;
mod control;
mod control_laws;
mod control_losses;
mod control_refusals;
mod control_safety;
mod dsp_process;
mod duhem;
mod embedded;
mod embedded_control;
mod filter;
mod laws;
mod long_walk;
mod loop_shift;
mod memory_laws;
mod no_allocation;
mod other_method;
mod quasistatic;
mod scales;
mod slow_gain;
mod split;
mod support;
mod swap;
mod validation;
