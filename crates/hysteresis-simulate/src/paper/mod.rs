//! The paper: Tables I and II as printed, the digits that Table I lost, and the plants on which one pair of gains gives
//! all the maxima that it publishes.

mod benchmark;
mod tables;

pub use benchmark::{Benchmark, BenchmarkGains};
pub use tables::{table_1, table_1_recovered, table_2};
