//! Time and instructions per sample over the same cases, beside loops over operators in the same run.
//!
//! `benches/time.rs` (criterion) and `benches/instructions.rs` (gungraun) measure every [`Case`](cases::Case). The
//! program of this crate times single steps, gathers all of it into one table and one file, and compares that with a
//! reference. The loops and the signals are those of the crate `yardsticks`; the bench of hysteresis-core has them too.

pub mod cases;
pub mod compare;
pub mod latency;
pub mod results;
pub mod table;
pub mod workload;
