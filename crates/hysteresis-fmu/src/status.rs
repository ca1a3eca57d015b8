//! What becomes of a call.

use hysteresis_control::guarded;

use crate::component::Component;

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
