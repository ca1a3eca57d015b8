//! The course of a simulation.

use core::ffi::{c_char, c_int};

use crate::component::{Component, Phase};
use crate::status::{Status, guard};

/// "default": the types of `fmi2TypesPlatform.h`.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// "2.0".
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Without effect: messages are those about calls that fail, and there is one category.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(
    component: Option<&mut Component>,
    _logging_on: c_int,
    _count: usize,
    _categories: *const *const c_char,
) -> Status {
    guard(component, |_| Ok(()))
}

impl Component {
    /// From one phase to the next.
    fn go(&mut self, call: &str, from: &[Phase], to: Phase) -> Result<(), String> {
        self.expect(call, from)?;
        self.phase = to;
        Ok(())
    }

    pub(crate) fn expect(&self, call: &str, phases: &[Phase]) -> Result<(), String> {
        if phases.contains(&self.phase) {
            return Ok(());
        }
        let names: Vec<String> = phases.iter().map(|phase| format!("{phase:?}")).collect();
        Err(format!("{call}: expected an instance that is {}, got one that is {:?}", names.join(" or "), self.phase))
    }
}

/// Takes the time at which the simulation begins. Tolerance and stop time are without effect.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    component: Option<&mut Component>,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start_time: f64,
    _stop_time_defined: c_int,
    _stop_time: f64,
) -> Status {
    guard(component, |component| {
        component.expect("fmi2SetupExperiment", &[Phase::Instantiated])?;
        if !start_time.is_finite() {
            return Err(format!("startTime: expected a finite number, got {start_time:?}"));
        }
        component.time = start_time;
        Ok(())
    })
}

/// Begins the initialization.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterInitializationMode(component: Option<&mut Component>) -> Status {
    guard(component, |component| {
        component.go("fmi2EnterInitializationMode", &[Phase::Instantiated], Phase::Initializing)
    })
}

/// Ends the initialization: steps may follow.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2ExitInitializationMode(component: Option<&mut Component>) -> Status {
    guard(component, |component| component.go("fmi2ExitInitializationMode", &[Phase::Initializing], Phase::Running))
}

/// Ends the simulation: values may still be read.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2Terminate(component: Option<&mut Component>) -> Status {
    guard(component, |component| component.go("fmi2Terminate", &[Phase::Running], Phase::Terminated))
}

/// As made.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2Reset(component: Option<&mut Component>) -> Status {
    guard(component, |component| {
        component.simulation = component.fresh.clone();
        (component.phase, component.time) = (Phase::Instantiated, 0.0);
        Ok(())
    })
}

/// Moves on by a step: a whole number of sampling intervals.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(
    component: Option<&mut Component>,
    current_communication_point: f64,
    communication_step_size: f64,
    _no_set_state_before: c_int,
) -> Status {
    guard(component, |component| {
        component.expect("fmi2DoStep", &[Phase::Running])?;
        component.simulation.step(communication_step_size).map_err(|error| error.to_string())?;
        component.time = current_communication_point + communication_step_size;
        Ok(())
    })
}

/// Steps are done when they return, so there is none to cancel: an error.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2CancelStep(component: Option<&mut Component>) -> Status {
    guard(component, |_| Err("fmi2CancelStep: expected a step that is not done, got none".into()))
}

/// Nothing is asked of a step that is done: an error.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetStatus(component: Option<&mut Component>, _kind: c_int, _value: *mut c_int) -> Status {
    guard(component, |_| Err("fmi2GetStatus: expected a step that is not done, got none".into()))
}

/// The time up to which all went well, for `fmi2LastSuccessfulTime` (2).
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetRealStatus(component: Option<&mut Component>, kind: c_int, value: Option<&mut f64>) -> Status {
    guard(component, |component| match (kind, value) {
        (2, Some(value)) => {
            *value = component.time;
            Ok(())
        }
        _ => Err(format!("fmi2GetRealStatus: expected fmi2LastSuccessfulTime (2) and a place, got {kind}")),
    })
}

/// There is no such status: an error.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetIntegerStatus(component: Option<&mut Component>, kind: c_int, _value: *mut c_int) -> Status {
    guard(component, |_| Err(format!("fmi2GetIntegerStatus: expected no call, as there is none, got {kind}")))
}

/// Whether the unit has ended the simulation, for `fmi2Terminated` (3): it never does.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetBooleanStatus(
    component: Option<&mut Component>,
    kind: c_int,
    value: Option<&mut c_int>,
) -> Status {
    guard(component, |_| match (kind, value) {
        (3, Some(value)) => {
            *value = 0;
            Ok(())
        }
        _ => Err(format!("fmi2GetBooleanStatus: expected fmi2Terminated (3) and a place, got {kind}")),
    })
}

/// There is no such status: an error.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetStringStatus(
    component: Option<&mut Component>,
    kind: c_int,
    _value: *mut *const c_char,
) -> Status {
    guard(component, |_| Err(format!("fmi2GetStringStatus: expected no call, as there is none, got {kind}")))
}
