//! Shared memory: a plant, or a driver, in another process of this computer.
//!
//! The memory is a file of 256 bytes that both processes map; in `/dev/shm` on Linux it never touches a disk. All
//! numbers are 8 bytes in the order of the machine.
//!
//! | offset | what | who writes |
//! |---|---|---|
//! | 0 | the bytes `MPIHYST1` | the loop, last of all when it makes the file |
//! | 64 | lock of the measurement (`u64`): odd while it is being written | the plant |
//! | 72 | number of the measurement (`u64`): another one for each | the plant |
//! | 80 | the measurement (`f64`) | the plant |
//! | 128 | lock of the drive (`u64`) | the loop |
//! | 136 | number of the drive (`u64`) | the loop |
//! | 144 | the drive in volts (`f64`) | the loop |
//!
//! To write: lock + 1, number, value, lock + 2. To read: lock, number, value, lock; what was read is whole if the lock
//! was even and is the same at the end. So nobody waits for the other side. A side that dies while it writes leaves an
//! odd lock: then nothing fresh comes, and the watchdog ends the loop.
//!
//! The loop takes a file that is new, empty, or one of a loop; any other is refused and stays as it is. It keeps an
//! exclusive lock (`flock`) on the file, so a second loop is refused. **Nobody may make the file shorter while it is
//! mapped**: the system then ends whoever looks into it, the loop with its drive where it is, by SIGBUS. To remove the
//! file is harmless.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use memmap2::{MmapOptions, MmapRaw};

use super::{Fault, Io};

const LENGTH: usize = 256;
const MAGIC: u64 = u64::from_ne_bytes(*b"MPIHYST1");
const MEASUREMENT: usize = 64;
const DRIVE: usize = 128;
/// How often a block is looked at that is being written: a write takes some nanoseconds, unless its process was put to
/// sleep.
const LOOKS: usize = 100;

/// A numbered value behind a sequence lock: one side writes, the other reads.
///
/// ```
/// use hysteresis_realtime::io::Block;
/// let block = Block::default();
/// block.write(1, 2.5);
/// assert_eq!(block.read(), Some((1, 2.5)));
/// ```
#[derive(Debug, Default)]
#[repr(C)]
pub struct Block {
    lock: AtomicU64,
    number: AtomicU64,
    value: AtomicU64,
}

impl Block {
    /// Writes both. Only one thread of one process may.
    #[inline]
    pub fn write(&self, number: u64, value: f64) {
        // A side that died while it wrote left an odd lock: the next one goes on from there.
        let lock = self.lock.load(Ordering::Relaxed) | 1;
        self.lock.store(lock, Ordering::Relaxed);
        // The odd lock is seen before what follows.
        fence(Ordering::Release);
        self.number.store(number, Ordering::Relaxed);
        self.value.store(value.to_bits(), Ordering::Relaxed);
        self.lock.store(lock.wrapping_add(1), Ordering::Release);
    }

    /// As if nothing had been written yet.
    fn forget(&self) {
        self.lock.store(0, Ordering::Release);
    }

    /// What was written together; None if nothing was yet, or if it is being written for longer than a write takes.
    #[inline]
    #[must_use]
    pub fn read(&self) -> Option<(u64, f64)> {
        self.read_while(|| {})
    }

    /// Reads while something happens between the number and the value: for a test.
    #[inline]
    fn read_while(&self, mut meanwhile: impl FnMut()) -> Option<(u64, f64)> {
        for _ in 0..LOOKS {
            let before = self.lock.load(Ordering::Acquire);
            let number = self.number.load(Ordering::Relaxed);
            meanwhile();
            let value = self.value.load(Ordering::Relaxed);
            // What was read is read before the lock is looked at again.
            fence(Ordering::Acquire);
            if before == 0 {
                return None;
            }
            if before & 1 == 0 && self.lock.load(Ordering::Relaxed) == before {
                return Some((number, f64::from_bits(value)));
            }
            core::hint::spin_loop();
        }
        None
    }
}

/// The mapped file, which stays open.
#[derive(Debug)]
struct Memory {
    mapped: MmapRaw,
    file: File,
}

impl Memory {
    fn map(file: File) -> io::Result<Self> {
        Ok(Self { mapped: MmapOptions::new().len(LENGTH).map_raw(&file)?, file })
    }

    #[expect(clippy::cast_ptr_alignment, reason = "a mapping begins at a page, and offsets are multiples of 8")]
    fn block(&self, offset: usize) -> &Block {
        debug_assert!(offset.is_multiple_of(8) && offset + size_of::<Block>() <= LENGTH);
        // SAFETY: the mapping is as long as LENGTH, begins at a page, and lives as long as `self`; a block is made of
        // atomic numbers, for which any bytes are valid and which any thread or process may change meanwhile. The file
        // had LENGTH bytes on the disk when it was mapped. Whoever shortens it later against the rule above makes a
        // look end the process (SIGBUS), not go elsewhere.
        unsafe { &*self.mapped.as_mut_ptr().add(offset).cast::<Block>() }
    }

    #[expect(clippy::cast_ptr_alignment, reason = "a mapping begins at a page")]
    fn magic(&self) -> &AtomicU64 {
        // SAFETY: as in `block`, for the first 8 bytes.
        unsafe { &*self.mapped.as_mut_ptr().cast::<AtomicU64>() }
    }
}

/// A lock that a child process inherited would outlive the file that is closed here.
impl Drop for Memory {
    fn drop(&mut self) {
        // The plant's end has none, and a file system may have none.
        let _ = self.file.unlock();
    }
}

/// The loop's end of the shared memory.
///
/// ```
/// use hysteresis_realtime::io::{Io, SharedMemoryIo, SharedMemoryPlant};
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("stage");
/// let mut io = SharedMemoryIo::create(&path)?; // /dev/shm/stage, say
/// let mut plant = SharedMemoryPlant::open(&path)?;
/// plant.write(1.5);
/// assert_eq!(io.read(), Ok(Some(1.5)));
/// assert_eq!(io.read(), Ok(None), "nothing newer");
/// io.write(20.0)?;
/// assert_eq!(plant.read(), Some((0, 20.0)));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SharedMemoryIo {
    memory: Memory,
    last: Option<u64>,
    written: u64,
}

impl SharedMemoryIo {
    /// Makes the file, or takes over that of a loop which has ended, without a measurement or a drive in it.
    ///
    /// # Errors
    /// Those of the file; [`io::ErrorKind::InvalidData`] for one that is neither empty nor of a loop, which stays as it
    /// is; [`io::ErrorKind::ResourceBusy`] for one that another loop uses.
    pub fn create(path: &Path) -> io::Result<Self> {
        let is_new = !is_there(path)?;
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                return Err(io::Error::new(io::ErrorKind::ResourceBusy, "another loop uses it"));
            }
            // A file system without locks has nothing to tell.
            Err(TryLockError::Error(error)) if error.kind() != io::ErrorKind::Unsupported => return Err(error),
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let mut begin = Vec::new();
        Read::by_ref(&mut file).take(size_of_val(&MAGIC) as u64).read_to_end(&mut begin)?;
        if !begin.is_empty() && begin != MAGIC.to_ne_bytes() {
            return Err(io::Error::new(io::ErrorKind::InvalidData, OTHER_FILE));
        }
        lengthen(&mut file).inspect_err(|_| {
            // The error is that of the disk, whether or not this is possible there.
            let _ = if is_new { std::fs::remove_file(path) } else { Ok(()) };
        })?;
        let memory = Memory::map(file)?;
        memory.block(MEASUREMENT).forget();
        memory.block(DRIVE).forget();
        memory.magic().store(MAGIC, Ordering::Release);
        Ok(Self { memory, last: None, written: 0 })
    }
}

/// What stands in the error for a file that is none of a loop.
const OTHER_FILE: &str = "expected a new or empty file, or one that begins with MPIHYST1";

/// Whether there is a file; a device or a pipe is not even opened.
fn is_there(path: &Path) -> io::Result<bool> {
    match path.metadata() {
        Ok(found) if found.is_file() => Ok(true),
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// To LENGTH by bytes that are written: what is mapped must be there, also on a disk that is full.
fn lengthen(file: &mut File) -> io::Result<()> {
    let length = file.seek(SeekFrom::End(0))?;
    let there = usize::try_from(length).unwrap_or(LENGTH).min(LENGTH);
    file.write_all(&[0; LENGTH][there..]).or_else(|error| file.set_len(length).and(Err(error)))
}

impl Io for SharedMemoryIo {
    #[inline]
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        let Some((number, value)) = self.memory.block(MEASUREMENT).read() else { return Ok(None) };
        let fresh = self.last != Some(number);
        self.last = Some(number);
        Ok(fresh.then_some(value))
    }

    #[inline]
    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.memory.block(DRIVE).write(self.written, drive);
        self.written += 1;
        Ok(())
    }
}

/// The plant's end of the shared memory.
#[derive(Debug)]
pub struct SharedMemoryPlant {
    memory: Memory,
    written: u64,
}

impl SharedMemoryPlant {
    /// Opens what the loop made.
    ///
    /// # Errors
    /// Those of the file, and [`io::ErrorKind::InvalidData`] for one that is none of a loop, or not yet ready.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        let length = file.metadata()?.len();
        let other = |what| io::Error::new(io::ErrorKind::InvalidData, what);
        if length < LENGTH as u64 {
            return Err(other(format!("{}: expected {LENGTH} bytes, got {length}", path.display())));
        }
        let memory = Memory::map(file)?;
        if memory.magic().load(Ordering::Acquire) != MAGIC {
            return Err(other(format!("{}: expected a file that begins with MPIHYST1", path.display())));
        }
        Ok(Self { memory, written: 0 })
    }

    /// The newest drive and its number; None before the first one.
    #[must_use]
    pub fn read(&self) -> Option<(u64, f64)> {
        self.memory.block(DRIVE).read()
    }

    /// Hands over a measurement.
    pub fn write(&mut self, measurement: f64) {
        self.memory.block(MEASUREMENT).write(self.written, measurement);
        self.written += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_while_it_is_read_is_read_again() {
        let block = Block::default();
        block.write(1, 1.5);
        let mut writes = 0;
        let found = block.read_while(|| {
            if writes < 3 {
                writes += 1;
                block.write(1 + writes, 2.5);
            }
        });
        assert_eq!((found, writes), (Some((4, 2.5)), 3));
        let mut number = 10;
        let never_still = block.read_while(|| {
            number += 1;
            block.write(number, 3.5);
        });
        assert_eq!(never_still, None);
    }
}
