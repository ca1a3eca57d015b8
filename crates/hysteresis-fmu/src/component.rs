//! An instance of a unit: from [`fmi2Instantiate`] to [`fmi2FreeInstance`].

use core::ffi::{CStr, c_char, c_int};

use hysteresis_control::guarded;
use hysteresis_export::Simulation;

use crate::logger::{CallbackFunctions, Logger};
use crate::resources;
use crate::status::Status;

/// `fmi2CoSimulation` of `fmi2Type`.
const CO_SIMULATION: c_int = 1;

/// What `fmi2Component` points to.
pub struct Component {
    pub(crate) logger: Logger,
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
        resources::simulation(location, guid)
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
