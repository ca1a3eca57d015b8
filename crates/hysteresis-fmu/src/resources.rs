//! The folder `resources`, which a tool names by a URI.

use std::fs;
use std::path::{Path, PathBuf};

use hysteresis_control::stage::Stage;
use hysteresis_export::{Settings, Simulation};

/// What the unit of this GUID runs.
pub(crate) fn simulation(location: &str, guid: &str) -> Result<Simulation, String> {
    let folder = folder(location)?;
    let settings = Settings::from_json(&text(&folder, "settings.json")?).map_err(|error| error.to_string())?;
    if guid != settings.guid {
        return Err(format!("fmuGUID: expected {}, that of the resources, got {guid}", settings.guid));
    }
    let stage = Stage::from_json(&text(&folder, "stage.json")?).map_err(|error| format!("stage.json: {error}"))?;
    Simulation::new(&stage, &settings).map_err(|error| error.to_string())
}

fn text(folder: &Path, name: &str) -> Result<String, String> {
    let path = folder.join(name);
    fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))
}

/// The folder of a URI such as file:///tmp/x%20axis/resources.
fn folder(location: &str) -> Result<PathBuf, String> {
    let wrong = || format!("fmuResourceLocation: expected a URI such as file:///folder/resources, got {location:?}");
    let rest = location.strip_prefix("file:").ok_or_else(wrong)?;
    let path = match rest.strip_prefix("//") {
        // Behind the name of a machine, which is this one.
        Some(rest) => rest.find('/').and_then(|begin| rest.get(begin..)).ok_or_else(wrong)?,
        None => rest,
    };
    let path = decoded(path).ok_or_else(wrong)?;
    // file:///C:/folder
    let drive = path.as_bytes().get(2) == Some(&b':') && path.starts_with('/');
    Ok(PathBuf::from(if cfg!(windows) && drive { path.get(1..).unwrap_or_default() } else { &path }))
}

/// The text with its bytes such as %20.
fn decoded(text: &str) -> Option<String> {
    let (mut bytes, mut rest) = (Vec::with_capacity(text.len()), text.as_bytes());
    while let Some((first, behind)) = rest.split_first() {
        rest = behind;
        bytes.push(*first);
        if *first == b'%' {
            let (digits, behind) = rest.split_first_chunk::<2>()?;
            let byte = u8::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()?;
            *bytes.last_mut()? = byte;
            rest = behind;
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_folders() {
        for (location, path) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file://localhost/tmp/r", "/tmp/r"),
            ("file:/tmp/r/", "/tmp/r/"),
            ("file:///tmp/%C3%A4", "/tmp/\u{e4}"),
        ] {
            assert_eq!(folder(location), Ok(path.into()), "{location}");
        }
        for location in ["", "/tmp/r", "http://x/r", "file:///tmp/%2", "file:///tmp/%zz", "file:///%ff", "file://x"] {
            assert!(folder(location).unwrap_err().starts_with("fmuResourceLocation: expected a URI"), "{location}");
        }
    }
}
