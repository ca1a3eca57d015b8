//! The targets of coverage-guided fuzzing. Each takes bytes, makes of them what a user or an attacker may hand over,
//! and panics where something does not hold that must. `make fuzz` runs them under libFuzzer with the address
//! sanitizer; `tests/replay.rs` runs the seeds, what was found, and some thousands of mutations on any machine.

mod bytes;
mod c_interface;
mod objects;
mod saved_bytes;
mod stage_file;
mod stages;
mod steps;

pub use c_interface::c_interface;
pub use saved_bytes::saved_bytes;
pub use stage_file::stage_file;
pub use steps::steps;

/// A function that takes the bytes of an input.
pub type Target = fn(&[u8]);

/// All targets, by the name of their folder in `seeds`.
pub const TARGETS: [(&str, Target); 4] =
    [("stage_file", stage_file), ("saved_bytes", saved_bytes), ("steps", steps), ("c_interface", c_interface)];
