//! The loop of a stage in real time: a sample at every deadline of a clock, in a thread of its own.
//!
//! ```text
//! deadline k: sleep until it -> read -> controller -> write -> row into a ring -> deadline k+1
//! ```
//!
//! [`Session::start`] starts it with a [`StageController`](hysteresis_control::StageController), an [`Io`](io::Io), a
//! [`Reference`] and [`Settings`]; [`Session::wait`] returns the [`Report`]. Once started, the loop does not allocate,
//! lock or log. Another thread writes the record. [`run_on`] runs the same loop on any [`Clock`](clock::Clock).
//!
//! Files know only those above them: `clock`, `io`; `settings` (what is asked), `schedule` (when samples are due);
//! `privileges`, `report` (how a loop ends, and what it tells), `recorder`; `runner`, the loop itself; `session`, its
//! thread.
//!
//! # Safety of the stage
//!
//! | state | what happens | counted as |
//! |---|---|---|
//! | running | a fresh measurement, the controller's drive | `fresh` |
//! | no fresh measurement for less than `stale_after` | the last one stands in | `stood_in` |
//! | none for `stale_after` | the controller is told so: for `max_missing` samples it holds the drive, or, coming back from the last loss, lets the last error stand in | `stale` |
//! | none for more than `max_missing` samples besides | the loop holds the drive | `stale`, `held` |
//! | none for `rest_after` | to rest, for good | [`EndReason::Watchdog`] |
//! | a measurement that is not finite, or that the controller does not believe | as none | as above |
//! | a read that fails | as none | `read_faults` |
//! | a write that fails | the controller does not take the sample; the next one tries again | `write_faults` |
//! | `write_faults` of them in a row | the end, wherever the drive is | [`EndReason::WriteFailed`] |
//! | a deadline is missed | as [`MissPolicy`] says | [`Deadlines`], [`EndReason::DeadlineMissed`] |
//! | input or output panics | caught; to rest | [`EndReason::Panicked`] |
//! | Ctrl-C, [`StopFlag`]; time or reference over | to rest | [`EndReason`] |
//! | a read or a write that does not return | nothing, until it does: the drive stays, and no request to end is seen | [`Live::taken`] stands still |
//! | datagrams: some are lost, or nobody listens | a drive counts as written, as nobody confirms it; measurements are missing | [`Report::datagrams`], [`Report::rest_refused`]; a warning if the other computer says that nobody listens |
//! | shared memory: another process makes the file shorter | the system ends this process, the drive stays | nothing |
//!
//! A controller with an [`Observer`](hysteresis_control::Observer) does not hold the drive during these `max_missing`
//! samples: it goes on. After a held drive a fresh measurement lets the motion go on without a jump.
//!
//! *To rest* is a ramp to `rest_drive` at `rest_rate`, or at the slew of the controller if that is slower. It needs no
//! measurement, and nothing interrupts it but writes that fail. While it runs, missed deadlines are skipped. The drive
//! written last is the rest drive, unless writing itself fails: [`Report::at_rest`] says so, and [`Report::last_drive`]
//! is the drive that the amplifier then has. A process that is killed leaves the drive where it is: a driver or an
//! amplifier with a watchdog of its own is for that.
//!
//! No drive is farther from the one before than the slew allows, in any of these states: all of them pass through the
//! controller. In any time T the drive moves by at most slew (T + dt), by writes that succeed, as a sample that is late
//! may have the next one right behind it. Samples that are caught up come closer together still: each moves the drive
//! by no more than the slew gives for the time since the last one. After skipped samples the drive has had more time
//! than it used.

pub mod clock;
pub mod io;
mod privileges;
mod recorder;
mod report;
mod runner;
mod schedule;
mod session;
mod settings;

pub use privileges::InForce;
pub use recorder::{COLUMNS, NpyFile, Row};
pub use report::{Counts, EndReason, Learning, Live, Machine, Report, StopFlag, Summary};
pub use schedule::Deadlines;
pub use session::{Outcome, Session, run_on};
pub use settings::{Error, MissPolicy, Reference, Settings, WatchdogTimes};

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
