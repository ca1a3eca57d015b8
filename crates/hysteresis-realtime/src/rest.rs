//! How far a loop is with its rest drive.

use crate::io::Io;
use crate::settings::Settings;

/// The rest drive, and how often it was written.
#[derive(Debug)]
pub(crate) struct Rest {
    pub(crate) drive: f64,
    /// How fast the drive goes there.
    pub(crate) rate: f64,
    /// For how many samples in a row.
    written: u32,
    /// How many datagrams had been refused when it was written first.
    refused_before: u64,
    /// How many datagrams had been refused before the last measurement came.
    refused_before_measurement: u64,
}

impl Rest {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            drive: settings.rest_drive,
            rate: settings.rest_rate,
            written: 0,
            refused_before: 0,
            refused_before_measurement: 0,
        }
    }

    /// Takes what a sample wrote, if its write succeeded. True if that is enough.
    pub(crate) fn is_over(&mut self, written: Option<f64>, io: &impl Io) -> bool {
        self.written = if written == Some(self.drive) { self.written.saturating_add(1) } else { 0 };
        if self.written == 1 {
            self.refused_before = refused(io);
        }
        self.written >= io.rest_writes()
    }

    /// Whether the drive written last is the rest drive.
    pub(crate) fn is_reached(&self) -> bool {
        self.written > 0
    }

    /// For how many samples in a row the rest drive was written.
    pub(crate) fn written(&self) -> u32 {
        self.written
    }

    /// A measurement came, and so many datagrams had been refused before it was read.
    #[inline]
    pub(crate) fn take_measurement(&mut self, refused_before: u64) {
        self.refused_before_measurement = refused_before;
    }

    /// How often the other side has said that nobody listens: since the last measurement came or since the rest drive was written
    /// first, whichever is longer ago. Computers bound how often they say so, so the rest drive alone may not be answered. 0 if the rest
    /// drive was not written.
    pub(crate) fn refused(&self, io: &impl Io) -> u64 {
        let before = self.refused_before.min(self.refused_before_measurement);
        if self.is_reached() { refused(io).saturating_sub(before) } else { 0 }
    }
}

/// How many datagrams have been refused.
#[inline]
pub(crate) fn refused(io: &impl Io) -> u64 {
    io.datagrams().map_or(0, |counts| counts.refused)
}
