//! The record of a process that is killed.

use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::{env, fs, thread, time::Duration};

use hysteresis_realtime::{NpyFile, Row};

/// Set for the child alone: where it writes.
const PATH: &str = "HYSTERESIS_RECORD_OF_CHILD";

/// No test of its own: what the child does that is killed.
#[test]
fn writes_until_it_is_killed() {
    let Some(path) = env::var_os(PATH) else { return };
    let mut file = NpyFile::create(path.as_ref()).unwrap();
    for k in 0.. {
        let row = |i| Row { time: f64::from(k * 1000 + i), drive: 2.0, ..Row::default() };
        file.append((0..1000).map(row)).unwrap();
    }
}

/// What there is in a folder, with its content.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> = entries.map(|path| (path.display().to_string(), fs::read(path).unwrap())).collect();
    found.sort();
    found
}

#[test]
fn a_record_that_is_there_is_replaced_by_one_that_has_rows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.npy");
    fs::write(&path, "old").unwrap();
    let before = files(folder.path());
    drop(NpyFile::create(&path).unwrap());
    assert_eq!(files(folder.path()), before, "a loop that did not start");
    let mut file = NpyFile::create(&path).unwrap();
    file.append([]).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    file.append([Row::default()]).unwrap();
    assert_eq!(fs::read(&path).unwrap().len(), 256 + 40);
    file.append([Row::default()]).unwrap();
    drop(file);
    assert_eq!((fs::read(&path).unwrap().len(), files(folder.path()).len()), (256 + 80, 1));
}

#[cfg(unix)]
#[test]
fn permissions_and_links_stay_what_they_are() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let [path, link] = ["record.npy", "link.npy"].map(|name| folder.path().join(name));
    fs::write(&path, "old").unwrap();
    symlink(&path, &link).unwrap();
    for mode in [0o600, 0o644, 0o660] {
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        NpyFile::create(&link).unwrap().append([Row::default()]).unwrap();
        let found = fs::symlink_metadata(&path).unwrap();
        assert_eq!((found.permissions().mode() & 0o777, found.len()), (mode, 296));
        assert!(link.is_symlink());
    }
    fs::remove_file(&path).unwrap();
    assert!(NpyFile::create(&link).is_err(), "a link to nowhere");
}

/// A pipe would wait for somebody who reads it.
#[cfg(target_os = "linux")]
#[test]
fn only_a_regular_file_can_be_a_record() {
    for path in ["/dev/null", "/proc/self/fd"] {
        assert_eq!(NpyFile::create(path.as_ref()).unwrap_err().to_string(), "is not a regular file");
    }
}

struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The number of rows in the header, the rows in the file, and the column of times.
fn read(path: &PathBuf) -> (usize, Vec<f64>) {
    let bytes = fs::read(path).unwrap();
    let header = core::str::from_utf8(&bytes[10..256]).unwrap();
    let (_, shape) = header.split_once("'shape': (").unwrap();
    let rows: usize = shape.split_once(',').unwrap().0.parse().unwrap();
    let times = bytes[256..].chunks_exact(40).map(|row| f64::from_le_bytes(row[..8].try_into().unwrap()));
    (rows, times.collect())
}

#[test]
fn a_record_is_valid_whenever_its_process_is_killed() {
    let folder = tempfile::tempdir().unwrap();
    for round in 0..5 {
        let path = folder.path().join(format!("{round}.npy"));
        let mut child = Command::new(env::current_exe().unwrap());
        child.args(["--exact", "record::writes_until_it_is_killed"]).env(PATH, &path);
        let child = Killed(child.stdout(std::process::Stdio::null()).spawn().unwrap());
        // Killed at some moment after the first rows.
        while !path.exists() || fs::metadata(&path).unwrap().len() < 50_000 {
            thread::sleep(Duration::from_millis(1));
        }
        drop(child);
        let (rows, times) = read(&path);
        assert!(rows > 0 && rows % 1000 == 0 && rows <= times.len(), "{rows} of {}", times.len());
        assert!(times.iter().take(rows).zip(0_u32..).all(|(time, k)| *time == f64::from(k)));
    }
}
