//! What a run of the benches found, as it is kept in a file.

use std::error::Error;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::cases::{Case, What};
use crate::signals::Signal;

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
