//! The tests of what the crate promises, in one program: it is linked once.

mod actuators;
mod adaptation;
mod compare;
mod coverage;
mod diagnostics;
mod dynamics;
mod errors;
mod geometric;
mod joint;
mod many;
mod modes;
mod no_allocation;
mod operators;
mod own_experiment;
mod own_gains;
mod quiet_record;
mod recovery;
mod recursive;
mod rests;
mod robust;
mod smoothness;
mod surroundings;
mod validation;
mod verdict;
mod weight_laws;
