//! What becomes of a call.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

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
    match catch_unwind(AssertUnwindSafe(|| work(component))) {
        Ok(Ok(())) => Status::Ok,
        Ok(Err(message)) => {
            logger.say(Status::Error, &message);
            Status::Error
        }
        Err(payload) => {
            logger.say(Status::Fatal, &format!("a defect of the library: {}", panic_message(&*payload)));
            Status::Fatal
        }
    }
}

/// What a panic said.
pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> &str {
    let message = payload.downcast_ref::<String>().map(String::as_str);
    message.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message")
}
