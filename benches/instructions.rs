//! Instructions of one pass of every case, counted by valgrind: the same on a busy machine as on a quiet one.
#![expect(missing_docs, reason = "the macros of gungraun make public items without any")]

use std::process::{Command, exit};

use bench_report::cases::Case;
use bench_report::workload::Workload;
use gungraun::{LibraryBenchmarkConfig, library_benchmark, library_benchmark_group, main};

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

/// Ends the program, without a failure, where there is nothing to count with. As `config` is asked for first, it is the
/// place for that.
fn with_runner() -> LibraryBenchmarkConfig {
    let runner = option_env!("GUNGRAUN_RUNNER").unwrap_or("gungraun-runner");
    for program in ["valgrind", runner] {
        if Command::new(program).arg("--version").output().is_err() {
            eprintln!("instructions are NOT counted: there is no {program}");
            eprintln!("`make bench-instructions` installs the runner and counts them, if valgrind is installed");
            exit(0);
        }
    }
    LibraryBenchmarkConfig::default()
}

library_benchmark_group!(name = instructions, benchmarks = pass);
main!(config = with_runner(); library_benchmark_groups = instructions);
