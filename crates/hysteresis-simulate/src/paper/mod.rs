//! What belongs to the paper alone: Tables I and II as printed, the digits that Table I lost, the plants on which one pair of
//! gains gives all the maxima that it publishes, and its control law as printed.

mod benchmark;
mod printed_law;
mod tables;

pub use benchmark::{Benchmark, BenchmarkGains};
pub use printed_law::PrintedLaw;
pub use tables::{table_1, table_1_recovered, table_2};
