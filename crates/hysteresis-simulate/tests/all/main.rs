//! The tests of what the crate promises, in one program: it is linked once.

mod driven;
mod experiment;
mod learning_laws;
mod no_allocation;
mod paper;
mod plant;
mod signals;
