//! Where a loop ran.

use std::thread::available_parallelism;

use serde::{Deserialize, Serialize};

/// What a latency depends on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor by its name, or its architecture.
    pub cpu: String,
    /// How many processors there are for this process.
    pub processors: usize,
    /// The operating system, with the release of its kernel as far as known.
    pub system: String,
}

impl Machine {
    /// This one.
    ///
    /// ```
    /// assert!(hysteresis_realtime::Machine::here().processors >= 1);
    /// ```
    #[must_use]
    pub fn here() -> Self {
        Self {
            cpu: cpu().unwrap_or_else(|| std::env::consts::ARCH.into()),
            processors: available_parallelism().map_or(1, Into::into),
            system: system(),
        }
    }
}

#[cfg(target_os = "linux")]
fn cpu() -> Option<String> {
    let facts = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = facts.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(target_os = "linux")]
fn system() -> String {
    let name = rustix::system::uname();
    [name.sysname(), name.release(), name.version()].map(|part| part.to_string_lossy()).join(" ")
}

#[cfg(not(target_os = "linux"))]
fn cpu() -> Option<String> {
    None
}

#[cfg(not(target_os = "linux"))]
fn system() -> String {
    std::env::consts::OS.into()
}
