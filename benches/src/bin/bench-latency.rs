//! Times single steps and writes their distribution to a file.

use std::path::PathBuf;

use clap::Parser;
use hysteresis_bench::latency::{all, measure};
use hysteresis_bench::results::{Latency, Outcome, write_json};

/// Times single steps, one by one.
#[derive(Parser)]
struct Arguments {
    /// Seconds of each signal, 10 000 steps each.
    #[arg(long, default_value_t = 1_000)]
    seconds: u64,
    /// The file for the distributions.
    #[arg(long, default_value = "target/bench/latency.json")]
    output: PathBuf,
}

fn main() -> Outcome<()> {
    let arguments = Arguments::parse();
    let found: Vec<Latency> = all().into_iter().map(|step| measure(step, arguments.seconds)).collect();
    write_json(&found, &arguments.output)
}
