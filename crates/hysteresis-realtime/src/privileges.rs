//! What a thread may ask of the system to be woken in time. What is refused is a warning, never silence.

use serde::{Deserialize, Serialize};

use crate::settings::Settings;

/// What is really in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InForce {
    /// Whether sleeps end at absolute deadlines.
    pub absolute_deadlines: bool,
    /// The processor on which the loop runs.
    pub cpu: Option<usize>,
    /// The priority of `SCHED_FIFO`.
    pub fifo: Option<u8>,
    /// Whether the memory of the process stays in memory.
    pub locked_memory: bool,
}

/// Asks for what the settings want, for the thread that calls.
pub(crate) fn ask(settings: &Settings, warnings: &mut Vec<String>) -> InForce {
    let mut in_force = InForce { absolute_deadlines: crate::clock::ABSOLUTE_DEADLINES, ..InForce::default() };
    if !in_force.absolute_deadlines {
        warnings.push("absolute deadlines: this system has none; the loop sleeps for the time that is left".into());
    }
    let mut granted = |what: &str, answer: std::io::Result<()>| match answer {
        Ok(()) => true,
        Err(error) => {
            warnings.push(format!("{what}: refused, the loop runs without: {error}"));
            false
        }
    };
    if let Some(cpu) = settings.cpu
        && granted(&format!("processor {cpu}"), system::bind_to(cpu))
    {
        in_force.cpu = Some(cpu);
    }
    if let Some(priority) = settings.fifo
        && granted(&format!("SCHED_FIFO with priority {priority}"), system::run_first(priority))
    {
        in_force.fifo = Some(priority);
    }
    if settings.lock_memory {
        in_force.locked_memory = granted("locked memory", locked::one_more());
    }
    granted("exact timers", system::exact_timers());
    in_force
}

/// The end of a loop for which memory was locked.
pub(crate) fn unlock(warnings: &mut Vec<String>) {
    if let Err(error) = locked::one_less() {
        warnings.push(format!("locked memory: stays locked until the process ends: {error}"));
    }
}

/// Memory is locked for the whole process: from the first loop that wants it until the last one has ended, or for ever
/// where the program had locked memory before.
mod locked {
    use std::io::Result;
    use std::sync::{Mutex, PoisonError};

    struct Locked {
        loops: u32,
        by_program: bool,
    }

    static LOCKED: Mutex<Locked> = Mutex::new(Locked { loops: 0, by_program: false });

    pub(crate) fn one_more() -> Result<()> {
        let mut locked = LOCKED.lock().unwrap_or_else(PoisonError::into_inner);
        if locked.loops == 0 {
            locked.by_program = super::system::has_locked_memory();
            super::system::lock_memory()?;
        }
        locked.loops += 1;
        Ok(())
    }

    pub(crate) fn one_less() -> Result<()> {
        let mut locked = LOCKED.lock().unwrap_or_else(PoisonError::into_inner);
        locked.loops = locked.loops.saturating_sub(1);
        if locked.loops == 0 && !locked.by_program { super::system::unlock_memory() } else { Ok(()) }
    }
}

#[cfg(target_os = "linux")]
mod system {
    use std::io::{Error, Result};
    use std::num::NonZeroU64;

    use rustix::mm::{MlockAllFlags, mlockall, munlockall};
    use rustix::thread::{CpuSet, sched_setaffinity, set_current_timer_slack};

    pub(crate) fn bind_to(cpu: usize) -> Result<()> {
        if cpu >= CpuSet::MAX_CPU {
            return Err(Error::from(std::io::ErrorKind::InvalidInput));
        }
        let mut set = CpuSet::new();
        set.set(cpu);
        Ok(sched_setaffinity(None, &set)?)
    }

    pub(crate) fn run_first(priority: u8) -> Result<()> {
        // SAFETY: all-zero bytes are a valid `sched_param`, which on some systems has fields besides the priority.
        let mut parameters: libc::sched_param = unsafe { core::mem::zeroed() };
        parameters.sched_priority = priority.into();
        // SAFETY: the thread is the one that calls, and the parameters outlive the call.
        match unsafe { libc::pthread_setschedparam(libc::pthread_self(), libc::SCHED_FIFO, &raw const parameters) } {
            0 => Ok(()),
            error => Err(Error::from_raw_os_error(error)),
        }
    }

    /// Whether any memory of the process is locked. Where that is not told, none is.
    pub(crate) fn has_locked_memory() -> bool {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let locked = status.lines().find_map(|line| line.strip_prefix("VmLck:"));
        locked.and_then(|size| size.split_whitespace().next()).is_some_and(|kilobytes| kilobytes != "0")
    }

    pub(crate) fn lock_memory() -> Result<()> {
        Ok(mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)?)
    }

    pub(crate) fn unlock_memory() -> Result<()> {
        Ok(munlockall()?)
    }

    /// Without, the system may wake a thread 50 us late to save power. It has no meaning under `SCHED_FIFO`.
    pub(crate) fn exact_timers() -> Result<()> {
        Ok(set_current_timer_slack(NonZeroU64::new(1))?)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::io::{Error, ErrorKind, Result};

    fn missing() -> Result<()> {
        Err(Error::new(ErrorKind::Unsupported, "only Linux has it here"))
    }

    pub(crate) fn bind_to(_: usize) -> Result<()> {
        missing()
    }

    pub(crate) fn run_first(_: u8) -> Result<()> {
        missing()
    }

    pub(crate) fn has_locked_memory() -> bool {
        false
    }

    pub(crate) fn lock_memory() -> Result<()> {
        missing()
    }

    pub(crate) fn unlock_memory() -> Result<()> {
        missing()
    }

    /// Nothing to ask for.
    #[expect(clippy::unnecessary_wraps, reason = "as on Linux")]
    pub(crate) fn exact_timers() -> Result<()> {
        Ok(())
    }
}
