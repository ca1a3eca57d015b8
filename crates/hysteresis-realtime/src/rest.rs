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
}

impl Rest {
    pub(crate) fn new(settings: &Settings) -> Self {
        Self { drive: settings.rest_drive, rate: settings.rest_rate, written: 0, refused_before: 0 }
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

    /// How often the rest drive was written, and how often the other side has said meanwhile that nobody listens, if it has.
    pub(crate) fn refused(&self, io: &impl Io) -> Option<(u32, u64)> {
        let refused = refused(io) - self.refused_before;
        (self.is_reached() && refused > 0).then_some((self.written, refused))
    }
}

fn refused(io: &impl Io) -> u64 {
    io.datagrams().map_or(0, |counts| counts.refused)
}
