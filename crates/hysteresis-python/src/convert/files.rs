//! Files: written whole or not at all.

use std::fs::{self, File, Metadata, Permissions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hysteresis_core::JsonError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::errors;

/// Writes text or bytes to a file that appears only when it is complete: to a neighbour with a random name first, which is
/// flushed to the disk and renamed. A replaced file passes on its permissions; what is no regular file is refused.
#[pyfunction(name = "write_file")]
pub(crate) fn write_content(path: PathBuf, content: &Bound<'_, PyAny>) -> PyResult<()> {
    match content.cast::<PyBytes>() {
        Ok(bytes) => write_bytes(path, bytes.as_bytes()),
        Err(_) => write_file(path, content.extract()?),
    }
}

/// Writes text as [`write_content`] does.
pub(crate) fn write_file(path: PathBuf, text: &str) -> PyResult<()> {
    write_bytes(path, text.as_bytes())
}

fn write_bytes(path: PathBuf, bytes: &[u8]) -> PyResult<()> {
    let shown = path.display().to_string();
    // A link stays a link: what it points to is replaced.
    let path = fs::canonicalize(&path).unwrap_or(path);
    let permissions = match fs::metadata(&path) {
        // A folder is refused by the system when the copy is renamed.
        Ok(there) if !(there.is_file() || there.is_dir()) => {
            return Err(errors::io(&shown, &io::Error::other("is not a regular file")));
        }
        there => there.ok().filter(Metadata::is_file).map(|there| there.permissions()),
    };
    let copy = path.with_file_name(format!(".{:016x}.tmp", RandomState::new().hash_one(&path)));
    let written = write_copy(&copy, bytes, permissions).and_then(|()| fs::rename(&copy, &path));
    written.map_err(|error| {
        // Nothing is left behind; that the copy may not even exist is no second error.
        let _ = fs::remove_file(&copy);
        errors::io(&shown, &error)
    })?;
    sync_folder(&path);
    Ok(())
}

/// A new file of that name, on the disk: no link or file that is already there is written to.
fn write_copy(copy: &Path, bytes: &[u8], permissions: Option<Permissions>) -> io::Result<()> {
    let mut file = File::options().write(true).create_new(true).open(copy)?;
    if let Some(permissions) = permissions {
        file.set_permissions(permissions)?;
    }
    file.write_all(bytes)?;
    file.sync_all()
}

/// Flushes the new name, too. Some file systems and Windows refuse that; the content is on the disk anyway.
fn sync_folder(path: &Path) {
    if let Some(folder) = path.parent() {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let _ = File::open(folder).and_then(|folder| folder.sync_all());
    }
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> PyResult<String> {
    let shown = path.display().to_string();
    let bytes = fs::read(path).map_err(|error| errors::io(&shown, &error))?;
    String::from_utf8(bytes).map_err(|_| errors::file(path, &JsonError::Syntax("no UTF-8 text".to_owned())))
}
