//! What criterion and gungraun left behind, as rows.

use std::path::Path;

use serde_json::Value;

use crate::cases::{Case, What};
use crate::results::{Outcome, Row, read_json};
use crate::workload::Workload;

/// One row for each case, from the last run of the benches that wrote to `target`.
///
/// # Errors
/// If a case was not timed, or if only some were counted.
pub fn rows(target: &Path) -> Outcome<Vec<Row>> {
    let mut rows = Vec::new();
    for (case, instructions) in instructions(target)? {
        let (nanoseconds, interval) = time(target, case, samples(case)?)?;
        rows.push(Row { case, nanoseconds, interval, instructions, to_plain_loop: None });
    }
    compare_with_yardstick(&mut rows);
    Ok(rows)
}

/// Instructions per sample of each case; none at all where valgrind did not run.
///
/// # Errors
/// If only some cases were counted.
pub fn instructions(target: &Path) -> Outcome<Vec<(Case, Option<f64>)>> {
    let counts = target.join("gungraun/hysteresis-bench/instructions/instructions");
    let counted = counts.is_dir();
    let cases = Case::all().into_iter().enumerate();
    cases.map(|(index, case)| Ok((case, if counted { count(&counts, index, case)? } else { None }))).collect()
}

fn samples(case: Case) -> Outcome<f64> {
    Ok(f64::from(u32::try_from(Workload::new(case, 1).samples())?))
}

/// Median and its confidence interval, in ns per sample.
fn time(target: &Path, case: Case, samples: f64) -> Outcome<(f64, [f64; 2])> {
    let directory = target.join("criterion").join(case.signal.slug()).join(case.kind());
    let path = directory.join(case.operators.to_string()).join("new/estimates.json");
    let estimates: Value = read_json(&path)?;
    let number = |pointer: &str| {
        let found = estimates.pointer(pointer).and_then(Value::as_f64);
        found.map(|x| x / samples).ok_or_else(|| format!("{}: no {pointer}", path.display()))
    };
    let bound = |name| number(&format!("/median/confidence_interval/{name}_bound"));
    Ok((number("/median/point_estimate")?, [bound("lower")?, bound("upper")?]))
}

/// Instructions per sample. None for a copy, which valgrind counts by bytes: one instruction repeats itself.
fn count(directory: &Path, index: usize, case: Case) -> Outcome<Option<f64>> {
    if case.what == What::Copy {
        return Ok(None);
    }
    let path = directory.join(format!("pass.case_{index}/summary.json"));
    let summary: Value = read_json(&path)?;
    let executed = summary.pointer("/profiles/0/data/total/metrics/Ir/values/new").and_then(Value::as_f64);
    let executed = executed.ok_or_else(|| format!("{}: no instructions executed", path.display()))?;
    Ok(Some(executed / samples(case)?))
}

fn compare_with_yardstick(rows: &mut [Row]) {
    let yardsticks: Vec<Row> = rows.iter().filter(|row| row.case.what == What::PlainLoop).copied().collect();
    for row in rows.iter_mut().filter(|row| row.case.what != What::Copy) {
        let yardstick = yardsticks.iter().find(|other| other.case == row.case.yardstick());
        row.to_plain_loop = yardstick.map(|other| row.nanoseconds / other.nanoseconds);
    }
}
