//! A thread that writes the rows of a loop to a file.
//!
//! The file is `.npy` of version 1.0: an array of records with the fields [`COLUMNS`], all of them doubles. Libraries for the format write
//! an array whose length they know. This one grows, so the header has room for any length and is written anew at every flush, after
//! the rows that it counts: whatever ends the process, numpy reads the file up to the last flush.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rtrb::Consumer;

use crate::ring::{COLUMNS, Row};

/// How often rows are fetched and written.
const PAUSE: Duration = Duration::from_millis(20);
/// Magic number, version, length of the text, text: a multiple of 64 bytes, as the format wants it.
const HEADER: usize = 256;
const TEXT: u16 = 246;
const ROW: usize = COLUMNS.len() * 8;

/// A file of rows that is valid after every [`append`](Self::append).
#[derive(Debug)]
pub struct NpyFile {
    file: File,
    rows: u64,
    bytes: Vec<u8>,
}

impl NpyFile {
    /// A new file without rows; one of that name is replaced.
    ///
    /// # Errors
    /// Those of the file.
    pub fn create(path: &Path) -> io::Result<Self> {
        let mut file = File::create(path)?;
        file.write_all(&header(0))?;
        Ok(Self { file, rows: 0, bytes: Vec::new() })
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
        Ok(())
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
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
pub(crate) struct Recorder(JoinHandle<io::Result<u64>>);

impl Recorder {
    /// # Errors
    /// Those of the file and of the thread.
    pub(crate) fn start(path: &Path, ring: Consumer<Row>) -> io::Result<Self> {
        let mut file = NpyFile::create(path)?;
        let record = move || drain(&mut file, ring);
        Ok(Self(thread::Builder::new().name("hysteresis-recorder".into()).spawn(record)?))
    }

    /// Waits for the last row, and returns how many were written.
    ///
    /// # Errors
    /// Those of the file. Rows after such an error were not written.
    pub(crate) fn finish(self) -> io::Result<u64> {
        self.0.join().unwrap_or_else(|_| Err(io::Error::other("the thread of the recorder panicked")))
    }
}

fn drain(file: &mut NpyFile, mut ring: Consumer<Row>) -> io::Result<u64> {
    loop {
        // Asked before the last look: what came until then is written.
        let last = ring.is_abandoned();
        let waiting = ring.slots();
        if waiting > 0 {
            file.append((0..waiting).map_while(|_| ring.pop().ok()))?;
        }
        if last {
            return Ok(file.rows());
        }
        thread::sleep(PAUSE);
    }
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
}
