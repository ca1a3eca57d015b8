//! Writes `python/mpi_hyst/_core.pyi`, which tells editors and type checkers what the module offers.
//!
//! All of it is read from the sources: names, parameters, defaults and docstrings from what `#[function]`, `#[methods]`
//! and `#[pyclass]` stand at, types from those of Rust ([`types`]) or, where these do not tell, from what
//! `#[py("...")]` says.
//!
//! pyo3 describes itself too (`experimental-inspect`), but not well enough yet: a type that is said in `signature`
//! comes out as quoted text whose names nobody imports, a default that is no literal of the Rust type as `...`, an
//! array of numpy as nothing, and a getter cannot say its type at all.

#[path = "../hysteresis-python-macros/src/signature.rs"]
mod signature;
#[path = "stub/types.rs"]
mod types;
#[path = "stub/writer.rs"]
mod writer;

use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let crate_root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let package = crate_root.join("../../python/mpi_hyst");
    let (sources, shared) = (crate_root.join("src"), package.join("_types.py"));
    for read in ["src", "stub", "../hysteresis-python-macros/src", "../../python/mpi_hyst/_types.py"] {
        println!("cargo::rerun-if-changed={read}");
    }
    let mut files = Vec::new();
    rust_files(&sources, &mut files)?;
    files.sort();
    let texts = files.iter().map(fs::read_to_string).collect::<io::Result<Vec<_>>>()?;
    let parsed = texts.iter().map(|text| syn::parse_file(text)).collect::<syn::Result<Vec<_>>>();
    // What cannot be parsed is for the compiler to say.
    let Ok(mut parsed) = parsed else { return Ok(()) };
    for item in parsed.iter_mut().flat_map(|file| &mut file.items) {
        if let syn::Item::Impl(block) = item {
            // What is wrong here, too.
            let _ = signature::fill_alike(block);
        }
    }
    let stub = match writer::stub(&parsed, &fs::read_to_string(shared)?) {
        Ok(stub) => stub,
        Err(problems) => {
            for problem in problems {
                println!("cargo::error={problem}");
            }
            return Ok(());
        }
    };
    let path = package.join("_core.pyi");
    if fs::read_to_string(&path).is_ok_and(|old| old == stub) {
        return Ok(());
    }
    Ok(fs::write(path, stub)?)
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            rust_files(&path, found)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    Ok(())
}
