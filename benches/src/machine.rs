//! Where and when a run took place.

use std::process::Command;
use std::thread::available_parallelism;

use jiff::Timestamp;
use sysinfo::{CpuRefreshKind, RefreshKind, System};

use crate::results::Machine;

const FLAGS: &str = env!("BENCH_FLAGS");

/// This machine, build and day.
#[must_use]
pub fn here() -> Machine {
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
