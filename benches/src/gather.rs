//! What criterion and gungraun left behind, as rows.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::cases::{Case, What};
use crate::results::{Outcome, Row, find, read_json};

/// One row for each case, from the last run of the benches that wrote to `target`.
///
/// # Errors
/// If a case was not timed, or if only some were counted.
pub fn rows(target: &Path) -> Outcome<Vec<Row>> {
    let mut rows = Vec::new();
    for (case, instructions) in instructions(target)? {
        rows.push(row(target, case, instructions)?);
    }
    compare_with_yardsticks(&mut rows);
    Ok(rows)
}

/// Instructions per sample of each case that is counted; none at all where valgrind did not run.
///
/// # Errors
/// If only some cases were counted.
pub fn instructions(target: &Path) -> Outcome<Vec<(Case, Option<f64>)>> {
    let counts = target.join("gungraun/hysteresis-bench/instructions/instructions");
    let measured = counts.is_dir();
    let counted = Case::counted();
    let of = |case| match counted.iter().position(|other| *other == case) {
        Some(index) if measured => count(&counts, index, case).map(Some),
        _ => Ok(None),
    };
    Case::all().into_iter().map(|case| Ok((case, of(case)?))).collect()
}

/// One row for each case that the last run timed, without instructions.
///
/// # Errors
/// If a file of criterion cannot be read.
pub fn times(target: &Path) -> Outcome<Vec<Row>> {
    let mut rows = Vec::new();
    for case in Case::all().into_iter().filter(|case| estimates(target, *case).is_file()) {
        rows.push(row(target, case, None)?);
    }
    compare_with_yardsticks(&mut rows);
    Ok(rows)
}

fn row(target: &Path, case: Case, instructions: Option<f64>) -> Outcome<Row> {
    let (nanoseconds, interval) = time(&estimates(target, case), f64::from(case.samples()))?;
    Ok(Row { case, nanoseconds, interval, instructions, to_plain_loop: None, to_fused_loop_v3: None })
}

/// Where criterion writes what it made of a case.
fn estimates(target: &Path, case: Case) -> PathBuf {
    let directory = target.join("criterion").join(case.signal.slug()).join(case.kind());
    directory.join(case.operators.to_string()).join("new/estimates.json")
}

/// Median and its confidence interval, in ns per sample.
fn time(path: &Path, samples: f64) -> Outcome<(f64, [f64; 2])> {
    let estimates: Value = read_json(path)?;
    let number = |pointer: &str| {
        let found = estimates.pointer(pointer).and_then(Value::as_f64);
        found.map(|x| x / samples).ok_or_else(|| format!("{}: no {pointer}", path.display()))
    };
    let bound = |name| number(&format!("/median/confidence_interval/{name}_bound"));
    Ok((number("/median/point_estimate")?, [bound("lower")?, bound("upper")?]))
}

/// Instructions per sample.
fn count(directory: &Path, index: usize, case: Case) -> Outcome<f64> {
    let path = directory.join(format!("pass.case_{index}/summary.json"));
    let summary: Value = read_json(&path)?;
    let executed = summary.pointer("/profiles/0/data/total/metrics/Ir/values/new").and_then(Value::as_f64);
    let executed = executed.ok_or_else(|| format!("{}: no instructions executed", path.display()))?;
    Ok(executed / f64::from(case.samples()))
}

fn compare_with_yardsticks(rows: &mut [Row]) {
    let yardsticks: Vec<Row> = rows.iter().filter(|row| What::YARDSTICKS.contains(&row.case.what)).copied().collect();
    for row in rows.iter_mut().filter(|row| row.case.what != What::Copy) {
        let to = |what| {
            let yardstick = find(&yardsticks, row.case.beside(what));
            yardstick.map(|other| row.nanoseconds / other.nanoseconds)
        };
        (row.to_plain_loop, row.to_fused_loop_v3) = (to(What::PlainLoop), to(What::FusedLoopV3));
    }
}
