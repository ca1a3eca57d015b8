//! Files: written whole or not at all.

use std::fs::{self, File, Metadata, Permissions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use hysteresis_core::JsonError;
use pyo3::prelude::*;

use super::errors;

/// Writes text to a file that appears only when it is complete: to a neighbour with a random name first, which is flushed to
/// the disk and renamed. A replaced file passes on its permissions; what is no regular file is refused.
#[pyfunction]
pub(crate) fn write_file(path: PathBuf, text: &str) -> PyResult<()> {
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
    let written = write_copy(&copy, text, permissions).and_then(|()| fs::rename(&copy, &path));
    written.map_err(|error| {
        // Nothing is left behind; that the copy may not even exist is no second error.
        let _ = fs::remove_file(&copy);
        errors::io(&shown, &error)
    })?;
    sync_folder(&path);
    Ok(())
}

/// A new file of that name, on the disk: no link or file that is already there is written to.
fn write_copy(copy: &Path, text: &str, permissions: Option<Permissions>) -> io::Result<()> {
    let mut file = File::options().write(true).create_new(true).open(copy)?;
    if let Some(permissions) = permissions {
        file.set_permissions(permissions)?;
    }
    file.write_all(text.as_bytes())?;
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
