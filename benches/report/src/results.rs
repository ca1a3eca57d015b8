//! What a run of the benches found: gathered from the files of criterion and gungraun, and kept in one of its own.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::available_parallelism;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sysinfo::{CpuRefreshKind, RefreshKind, System};
use yardsticks::Signal;

use crate::cases::{Case, What};

/// The version of the file.
pub const SCHEMA: u32 = 1;

/// A value, or why there is none, for a person to read.
pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Where and when.
    pub machine: Machine,
    /// One row for each case.
    pub cases: Vec<Row>,
    /// Single steps.
    pub latency: Vec<Latency>,
}

/// Where, when and of what the numbers are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// The processor's own name.
    pub cpu: String,
    /// How many cores this process may use.
    pub cores: usize,
    /// The compiler.
    pub rustc: String,
    /// The platform for which it compiled.
    pub target: String,
    /// Its flags beside those of the release profile; none is the portable build.
    pub flags: String,
    /// The commit, with a `+` if the working tree differs from it.
    pub commit: String,
    /// The day, in UTC.
    pub date: String,
}

/// The measurements of one case, per sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What was measured.
    #[serde(flatten)]
    pub case: Case,
    /// The median in ns.
    pub nanoseconds: f64,
    /// The 95 % confidence interval of the median in ns.
    pub interval: [f64; 2],
    /// Instructions. None where they were not counted.
    pub instructions: Option<f64>,
    /// Its time in units of the plain loop over as many operators along the same signal. None for copying.
    pub to_plain_loop: Option<f64>,
    /// The same in units of the fused loop for x86-64-v3. None for copying, and where the processor has no such
    /// instructions.
    #[serde(default)]
    pub to_fused_loop_v3: Option<f64>,
}

/// The distribution of the time of single steps, in ns, the reading of the clock included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Latency {
    /// What was stepped. None for an empty step: the clock, and what the machine does in between.
    pub step: Option<Steps>,
    /// How many steps.
    pub count: u64,
    /// Half of the steps took no longer.
    pub median: u64,
    /// 99 % took no longer.
    pub p99: u64,
    /// 99.9 % took no longer.
    pub p999: u64,
    /// The longest.
    pub max: u64,
}

/// What single steps are timed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Steps {
    /// What drives the stream.
    pub signal: Signal,
    /// How many operators it has.
    pub operators: u32,
    /// Forward or inverse.
    pub what: What,
}

impl Results {
    /// The row of a case.
    #[must_use]
    pub fn row(&self, case: Case) -> Option<&Row> {
        find(&self.cases, case)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// With the path, if it cannot be read or is no such file.
    pub fn read(path: &Path) -> Outcome<Self> {
        let results: Self = read_json(path)?;
        if results.schema == SCHEMA {
            Ok(results)
        } else {
            Err(format!("{}: schema {} where {SCHEMA} is expected", path.display(), results.schema).into())
        }
    }

    /// Writes a file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Outcome<()> {
        write_json(self, path)
    }
}

/// The row of a case among others.
#[must_use]
pub fn find(rows: &[Row], case: Case) -> Option<&Row> {
    rows.iter().find(|row| row.case == case)
}

/// Reads anything from a JSON file.
///
/// # Errors
/// With the path, if it cannot be read or is of another form.
pub fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Outcome<T> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))?)
}

/// Writes anything to a JSON file, its directory included.
///
/// # Errors
/// If it cannot be written.
pub fn write_json<T: Serialize>(value: &T, path: &Path) -> Outcome<()> {
    if let Some(directory) = path.parent() {
        fs::create_dir_all(directory)?;
    }
    Ok(fs::write(path, serde_json::to_string_pretty(value)? + "\n")?)
}

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

const FLAGS: &str = env!("BENCH_FLAGS");

/// This machine, build and day.
#[must_use]
pub fn machine() -> Machine {
    let cpus = System::new_with_specifics(RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing()));
    Machine {
        cpu: cpus.cpus().first().map_or("unknown", |cpu| cpu.brand()).trim().to_owned(),
        cores: available_parallelism().map_or(1, Into::into),
        rustc: env!("BENCH_RUSTC").to_owned(),
        target: env!("BENCH_TARGET").to_owned(),
        flags: FLAGS.to_owned(),
        commit: commit().unwrap_or_else(|| "unknown".to_owned()),
        date: Timestamp::now().strftime("%Y-%m-%d").to_string(),
    }
}

fn commit() -> Option<String> {
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changes = git(&["status", "--porcelain", "--untracked-files=no"])?;
    Some(if changes.is_empty() { commit } else { commit + "+" })
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
