//! Times single steps, gathers what the benches measured, shows it and compares it with a reference.

use std::path::PathBuf;
use std::process::ExitCode;

use bench_report::compare::compare;
use bench_report::latency;
use bench_report::results::{self, Latency, Outcome, Results, SCHEMA, read_json, write_json};
use bench_report::table;
use clap::{Parser, Subcommand};

/// Times single steps, gathers what the benches measured, shows it and compares it with a reference.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Times single steps, one by one, and writes their distribution to a file.
    Latency {
        /// Seconds of each signal, 10 000 steps each.
        #[arg(long, default_value_t = 1_000)]
        seconds: u64,
        /// The file.
        #[arg(long, default_value = "target/bench/latency.json")]
        output: PathBuf,
    },
    /// Writes one file of all that the last run measured.
    Gather {
        /// Where criterion, gungraun and `latency` wrote to.
        #[arg(long, default_value = "target")]
        target: PathBuf,
        /// The file.
        #[arg(long, default_value = "target/bench/results.json")]
        output: PathBuf,
    },
    /// Prints such a file as markdown.
    Show {
        /// The file.
        #[arg(default_value = "target/bench/results.json")]
        results: PathBuf,
        /// Only what the README of the benches shows.
        #[arg(long, conflicts_with = "readme")]
        brief: bool,
        /// Only what the README of the project shows.
        #[arg(long)]
        readme: bool,
    },
    /// Prints the times that the last run measured, though it be of few cases.
    Times {
        /// Where criterion wrote to.
        #[arg(long, default_value = "target")]
        target: PathBuf,
    },
    /// Prints the instructions that the last run counted.
    Instructions {
        /// Where gungraun wrote to.
        #[arg(long, default_value = "target")]
        target: PathBuf,
    },
    /// Names what is worse than in a reference, and fails if anything is.
    Check {
        /// The file to compare with.
        #[arg(default_value = "benches/reference.json")]
        reference: PathBuf,
        /// The file to judge.
        #[arg(default_value = "target/bench/results.json")]
        results: PathBuf,
    },
}

fn main() -> Outcome<ExitCode> {
    match Arguments::parse().command {
        Command::Latency { seconds, output } => {
            let found: Vec<Latency> = latency::all().into_iter().map(|step| latency::measure(step, seconds)).collect();
            write_json(&found, &output)?;
        }
        Command::Gather { target, output } => {
            let latency = read_json(&target.join("bench/latency.json"))?;
            let (machine, cases) = (results::machine(), results::rows(&target)?);
            let results = Results { schema: SCHEMA, machine, cases, latency };
            if results.cases.iter().all(|row| row.instructions.is_none()) {
                eprintln!("warning: no instruction counts; they are null in {}", output.display());
            }
            results.write(&output)?;
        }
        Command::Show { results, brief, readme } => {
            let results = Results::read(&results)?;
            let shown = match (readme, brief) {
                (true, _) => table::readme(&results),
                (_, true) => table::brief(&results),
                _ => table::full(&results),
            };
            println!("{shown}");
        }
        Command::Times { target } => println!("{}", table::times(&results::times(&target)?)),
        Command::Instructions { target } => println!("{}", table::instructions(&results::instructions(&target)?)),
        Command::Check { reference, results } => return check(&Results::read(&reference)?, &Results::read(&results)?),
    }
    Ok(ExitCode::SUCCESS)
}

fn check(reference: &Results, results: &Results) -> Outcome<ExitCode> {
    let outcome = compare(reference, results);
    if outcome.compared == 0 {
        return Err("nothing could be compared".into());
    }
    for note in &outcome.notes {
        eprintln!("note: {note}");
    }
    for worse in &outcome.worse {
        eprintln!("warning: worse than the reference: {worse}");
    }
    let (compared, commit, date) = (outcome.compared, &reference.machine.commit, &reference.machine.date);
    println!("{} of {compared} numbers are worse than those of commit {commit}, {date}", outcome.worse.len());
    Ok(if outcome.worse.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
