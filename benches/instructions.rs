//! Instructions of one pass of every case, counted by valgrind: the same on a busy machine as on a quiet one.
#![expect(missing_docs, reason = "the macros of gungraun make public items without any")]

use gungraun::{library_benchmark, library_benchmark_group, main};
use hysteresis_bench::cases::Case;
use hysteresis_bench::workload::Workload;

/// Instructions do not depend on what a predictor has learnt: one second of noise will do.
fn one_second(case: Case) -> Workload {
    Workload::new(case, 1)
}

#[library_benchmark]
#[benches::case(iter = Case::counted(), setup = one_second)]
fn pass(mut workload: Workload) -> Workload {
    workload.pass();
    workload
}

library_benchmark_group!(name = instructions, benchmarks = pass);
main!(library_benchmark_groups = instructions);
