//! An instance of a unit, from [`fmi2Instantiate`] to [`fmi2FreeInstance`]: its resources, its messages to the tool,
//! and what becomes of a call.

use core::ffi::{CStr, c_char, c_int, c_void};
use std::ffi::CString;
use std::fs;
use std::path::{Path, PathBuf};

use hysteresis_control::guarded;
use hysteresis_control::stage::Stage;
use hysteresis_export::{Settings, Simulation};

/// `fmi2CoSimulation` of `fmi2Type`.
const CO_SIMULATION: c_int = 1;

/// What `fmi2Component` points to.
pub struct Component {
    logger: Logger,
    /// As it was made.
    pub(crate) fresh: Simulation,
    pub(crate) simulation: Simulation,
    pub(crate) phase: Phase,
    /// Where the last step ended.
    pub(crate) time: f64,
}

/// What may be called now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    Instantiated,
    Initializing,
    Running,
    Terminated,
}

/// A text of the tool.
///
/// # Safety
/// `text` is NULL or ends with a zero byte, and nothing changes it while the result lives.
unsafe fn text<'a>(name: &str, text: *const c_char) -> Result<&'a str, String> {
    if text.is_null() {
        return Err(format!("{name}: expected a text, got NULL"));
    }
    // SAFETY: it is not NULL, so it ends with a zero byte.
    unsafe { CStr::from_ptr(text) }.to_str().map_err(|error| format!("{name}: expected UTF-8 text: {error}"))
}

/// Makes an instance, at rest. NULL if it cannot be; the logger says why.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2Instantiate(
    instance_name: *const c_char,
    fmu_type: c_int,
    guid: *const c_char,
    resource_location: *const c_char,
    callbacks: Option<&CallbackFunctions>,
    _visible: c_int,
    _logging_on: c_int,
) -> Option<Box<Component>> {
    // SAFETY: a text of the tool, or NULL.
    let name = if instance_name.is_null() { c"" } else { unsafe { CStr::from_ptr(instance_name) } };
    let logger = Logger::new(callbacks, name);
    let made = guarded(|| {
        if fmu_type != CO_SIMULATION {
            return Err(format!("fmuType: expected fmi2CoSimulation (1), got {fmu_type}"));
        }
        // SAFETY: texts of the tool, or NULL.
        let (guid, location) = unsafe { (text("fmuGUID", guid)?, text("fmuResourceLocation", resource_location)?) };
        simulation(location, guid)
    });
    match made {
        Ok(Ok(fresh)) => {
            let simulation = fresh.clone();
            Some(Box::new(Component { logger, fresh, simulation, phase: Phase::Instantiated, time: 0.0 }))
        }
        Ok(Err(message)) => {
            logger.say(Status::Error, &message);
            None
        }
        Err(panic) => {
            logger.say(Status::Fatal, &panic);
            None
        }
    }
}

/// Ends an instance; nothing for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeInstance(component: Option<Box<Component>>) {
    drop(component);
}

/// `fmi2Status`.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, but the tool should know the message.
    Warning = 1,
    /// Not done; the unit is as before.
    Discard = 2,
    /// Not done; the message says why.
    Error = 3,
    /// A defect of the library: no instance can be used any more.
    Fatal = 4,
}

/// Runs what may fail for a component: the message of a failure goes to its logger, and no panic leaves.
pub(crate) fn guard<'a>(
    component: Option<&'a mut Component>,
    work: impl FnOnce(&'a mut Component) -> Result<(), String>,
) -> Status {
    let Some(component) = component else { return Status::Error };
    let logger = component.logger.clone();
    match guarded(|| work(component)) {
        Ok(Ok(())) => Status::Ok,
        Ok(Err(message)) => {
            logger.say(Status::Error, &message);
            Status::Error
        }
        Err(panic) => {
            logger.say(Status::Fatal, &panic);
            Status::Fatal
        }
    }
}

/// `fmi2CallbackLogger`: environment, name of the instance, status, category, format, and what it formats.
type Log = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CallbackFunctions {
    logger: Option<Log>,
    allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

/// The logger of a tool, and the name of the instance that it shows.
#[derive(Clone)]
struct Logger {
    log: Option<Log>,
    environment: *mut c_void,
    name: CString,
}

impl Logger {
    /// The callbacks of a tool, if it gave any. They stay valid as long as the instance, as the standard says.
    fn new(callbacks: Option<&CallbackFunctions>, name: &CStr) -> Self {
        let environment = callbacks.map_or(core::ptr::null_mut(), |callbacks| callbacks.environment);
        Self { log: callbacks.and_then(|callbacks| callbacks.logger), environment, name: name.to_owned() }
    }

    fn say(&self, status: Status, message: &str) {
        let Some(log) = self.log else { return };
        // The message is a format: a percent sign stands for itself only if it is doubled.
        let Ok(message) = CString::new(message.replace('\0', " ").replace('%', "%%")) else { return };
        // SAFETY: the function of the tool, with its environment and texts that live until it returns; nothing is to be
        // formatted.
        unsafe { log(self.environment, self.name.as_ptr(), status, c"logStatusError".as_ptr(), message.as_ptr()) }
    }
}

/// What the unit of this GUID runs.
pub(crate) fn simulation(location: &str, guid: &str) -> Result<Simulation, String> {
    let folder = folder(location)?;
    let settings = Settings::from_json(&resource(&folder, "settings.json")?).map_err(|error| error.to_string())?;
    if guid != settings.guid {
        return Err(format!("fmuGUID: expected {}, that of the resources, got {guid}", settings.guid));
    }
    let stage = Stage::from_json(&resource(&folder, "stage.json")?).map_err(|error| format!("stage.json: {error}"))?;
    Simulation::new(&stage, &settings).map_err(|error| error.to_string())
}

fn resource(folder: &Path, name: &str) -> Result<String, String> {
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
