//! A thread that writes the rows of a loop to a file.
//!
//! The file is `.npy` of version 1.0: an array of records with the fields [`COLUMNS`], all of them doubles. Libraries
//! for the format write an array whose length they know. This one grows, so the header has room for any length and is
//! written anew at every flush, after the rows that it counts: whatever ends the process, numpy reads the file up to
//! the last flush.
//!
//! It begins under a random name (`.mpi_hyst-<16 digits>.tmp`) and gets its own with the first rows, so a record that
//! is there is only replaced by one that has rows. It is locked meanwhile, as that of a living process: other files of
//! this library are saved so too, and clear away what is not locked.

use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rtrb::{Consumer, Producer, RingBuffer};

/// How often rows are fetched and written.
const PAUSE: Duration = Duration::from_millis(20);
/// Magic number, version, length of the text, text: a multiple of 64 bytes, as the format wants it.
const HEADER: usize = 256;
const TEXT: u16 = 246;
const ROW: usize = COLUMNS.len() * 8;

/// A file of rows that is valid after every [`append`](Self::append), and has its name from the first one on.
#[derive(Debug)]
pub struct NpyFile {
    file: File,
    /// Its random name and the one that it will have; None when it has that.
    unnamed: Option<(PathBuf, PathBuf)>,
    rows: u64,
    bytes: Vec<u8>,
}

impl NpyFile {
    /// A file without rows yet. A regular file of that name is replaced with the first rows; a link stays one.
    ///
    /// # Errors
    /// Those of the file; [`io::ErrorKind::InvalidInput`] for what is no regular file.
    pub fn create(path: &Path) -> io::Result<Self> {
        let replaced = match path.metadata() {
            Ok(found) if found.is_file() => Some(found.permissions()),
            Ok(_) => return Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file")),
            Err(error) if error.kind() == io::ErrorKind::NotFound && !path.is_symlink() => None,
            Err(error) => return Err(error),
        };
        // The program may go to another directory before the first rows come.
        let place = if replaced.is_some() { path.canonicalize()? } else { std::path::absolute(path)? };
        let (file, copy) = new_copy(&place)?;
        let mut made = Self { file, unnamed: Some((copy, place)), rows: 0, bytes: Vec::new() };
        made.file.write_all(&header(0))?;
        if let Some(permissions) = replaced {
            made.file.set_permissions(permissions)?;
        }
        Ok(made)
    }

    /// What was there under its name is replaced.
    fn take_name(&mut self) -> io::Result<()> {
        if let Some((copy, place)) = &self.unnamed {
            let kept =
                |error: io::Error| io::Error::new(error.kind(), format!("{error}: its rows are in {}", copy.display()));
            fs::rename(copy, place).map_err(kept)?;
            self.unnamed = None;
        }
        Ok(())
    }

    /// Writes rows behind those that are there, then the header that counts them.
    ///
    /// # Errors
    /// Those of the file; the header still counts the rows that were there before.
    pub fn append(&mut self, rows: impl IntoIterator<Item = Row>) -> io::Result<()> {
        self.bytes.clear();
        for row in rows {
            row.numbers().iter().for_each(|number| self.bytes.extend_from_slice(&number.to_le_bytes()));
        }
        // A write before may have failed half-way.
        self.file.seek(SeekFrom::Start(HEADER as u64 + self.rows * ROW as u64))?;
        self.file.write_all(&self.bytes)?;
        let rows = self.rows + (self.bytes.len() / ROW) as u64;
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&header(rows))?;
        self.rows = rows;
        if rows > 0 { self.take_name() } else { Ok(()) }
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// How many of them are found under the name of the file: 0 until the file has its name.
    fn found(&self) -> u64 {
        if self.unnamed.is_some() { 0 } else { self.rows }
    }
}

/// A file that never had rows never was there.
impl Drop for NpyFile {
    fn drop(&mut self) {
        if let (Some((copy, _)), 0) = (&self.unnamed, self.rows) {
            // It has a name that nobody looks for.
            let _ = fs::remove_file(copy);
        }
    }
}

/// A locked file beside `place`.
fn new_copy(place: &Path) -> io::Result<(File, PathBuf)> {
    loop {
        let random = RandomState::new().hash_one(place);
        let copy = place.with_file_name(format!(".mpi_hyst-{random:016x}.tmp"));
        let file = OpenOptions::new().write(true).create_new(true).open(&copy)?;
        // Where files cannot be locked nothing is cleared away either.
        let _ = file.lock();
        // Another process may have cleared it away before it was locked.
        if copy.exists() {
            return Ok((file, copy));
        }
    }
}

fn header(rows: u64) -> [u8; HEADER] {
    let fields = COLUMNS.map(|name| format!("('{name}', '<f8')")).join(", ");
    let text = format!("{{'descr': [{fields}], 'fortran_order': False, 'shape': ({rows},), }}");
    let mut bytes = [b' '; HEADER];
    bytes[..8].copy_from_slice(b"\x93NUMPY\x01\x00");
    bytes[8..10].copy_from_slice(&TEXT.to_le_bytes());
    bytes[10..10 + text.len()].copy_from_slice(text.as_bytes());
    bytes[HEADER - 1] = b'\n';
    bytes
}

/// A recorder that runs until the loop has let go of its end of the ring and all rows are written.
#[derive(Debug)]
pub(crate) struct Recorder(JoinHandle<Recorded>);

/// What a recorder did.
#[derive(Debug)]
pub(crate) struct Recorded {
    /// Rows in the file; None if nobody knows.
    pub(crate) rows: Option<u64>,
    /// Why the others could not be written.
    pub(crate) error: Option<io::Error>,
}

impl Recorder {
    /// # Errors
    /// Those of the file and of the thread.
    pub(crate) fn start(path: &Path, ring: Consumer<Row>) -> io::Result<Self> {
        let mut file = NpyFile::create(path)?;
        let record = move || {
            let error = drain(&mut file, ring).err();
            Recorded { rows: Some(file.found()), error }
        };
        Ok(Self(thread::Builder::new().name("hysteresis-recorder".into()).spawn(record)?))
    }

    /// Waits for the last row. Rows after an error were not written.
    pub(crate) fn finish(self) -> Recorded {
        let panicked = || io::Error::other("the thread of the recorder panicked");
        self.0.join().unwrap_or_else(|_| Recorded { rows: None, error: Some(panicked()) })
    }
}

fn drain(file: &mut NpyFile, mut ring: Consumer<Row>) -> io::Result<()> {
    loop {
        // Asked before the last look: what came until then is written.
        let last = ring.is_abandoned();
        let waiting = ring.slots();
        if waiting > 0 {
            file.append((0..waiting).map_while(|_| ring.pop().ok()))?;
        }
        if last {
            return Ok(());
        }
        thread::sleep(PAUSE);
    }
}

/// A row of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// When the sample began, in seconds from the first deadline.
    pub time: f64,
    /// The reference of now.
    pub reference: f64,
    /// What the controller was given: NaN for nothing.
    pub measurement: f64,
    /// The drive that the amplifier has after this sample, in volts.
    pub drive: f64,
    /// How late the sample began, in seconds.
    pub lateness: f64,
}

/// The names of the columns of a record, in their order.
pub const COLUMNS: [&str; 5] = ["time", "reference", "measurement", "drive", "lateness"];

impl Row {
    fn numbers(&self) -> [f64; COLUMNS.len()] {
        [self.time, self.reference, self.measurement, self.drive, self.lateness]
    }
}

/// The end at the loop: it never waits.
#[derive(Debug)]
pub(crate) struct Sender {
    ring: Producer<Row>,
    lost: u64,
}

impl Sender {
    /// Counts a row for which there is no room.
    #[inline]
    pub(crate) fn send(&mut self, row: Row) {
        self.lost += u64::from(self.ring.push(row).is_err());
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }
}

/// A ring of so many rows, all memory of which is touched: later no page has to be found.
pub(crate) fn ring(rows: usize) -> (Sender, Consumer<Row>) {
    let (mut producer, mut consumer) = RingBuffer::new(rows);
    while producer.push(Row::default()).is_ok() {}
    while consumer.pop().is_ok() {}
    (Sender { ring: producer, lost: 0 }, consumer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_one_of_the_format() {
        for rows in [0, 12, u64::MAX] {
            let bytes = header(rows);
            assert_eq!(usize::from(TEXT) + 10, bytes.len());
            assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\xf6\x00");
            let text = core::str::from_utf8(&bytes[10..]).unwrap();
            assert!(text.contains(&format!("'shape': ({rows},), }} ")) && text.ends_with('\n'));
            assert!(text.starts_with("{'descr': [('time', '<f8'), ('reference', '<f8'), ('measurement', '<f8'), "));
        }
    }

    #[test]
    fn rows_come_in_order_and_lost_ones_are_counted() {
        let (mut sender, mut receiver) = ring(3);
        let row = |time| Row { time, ..Row::default() };
        for time in [1.0, 2.0, 3.0, 4.0, 5.0] {
            sender.send(row(time));
        }
        assert_eq!(sender.lost(), 2);
        assert_eq!([1.0, 2.0, 3.0].map(|_| receiver.pop().unwrap().time), [1.0, 2.0, 3.0]);
        sender.send(row(6.0));
        assert_eq!((receiver.pop().unwrap(), sender.lost()), (row(6.0), 2));
    }
}
