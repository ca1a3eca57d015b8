//! Time and instructions per sample over the same cases, beside loops over operators in the same run.
//!
//! `benches/time.rs` (criterion) and `benches/instructions.rs` (gungraun) measure every [`Case`](cases::Case),
//! `bench-latency` the distribution of single steps; `bench-report` gathers all of it into one table and one file and
//! compares that with a reference.

pub mod cases;
pub mod compare;
pub mod fused;
pub mod gather;
pub mod latency;
pub mod machine;
mod pass;
pub mod results;
pub mod signals;
pub mod table;
pub mod workload;
pub mod yardstick;
