//! Kept states: to go back to, and as bytes.

use hysteresis_export::Simulation;

use crate::component::{Component, Phase};
use crate::status::{Status, guard};

/// What `fmi2FMUstate` points to.
pub struct KeptState {
    simulation: Simulation,
    phase: Phase,
    time: f64,
}

type Kept = Option<Box<KeptState>>;

impl KeptState {
    fn of(component: &Component) -> Self {
        Self { simulation: component.simulation.clone(), phase: component.phase, time: component.time }
    }
}

fn missing() -> String {
    "FMUstate: expected a state, got NULL".into()
}

/// Keeps a copy; one that is there already is replaced.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetFMUstate(component: Option<&mut Component>, state: Option<&mut Kept>) -> Status {
    guard(component, |component| {
        *state.ok_or_else(missing)? = Some(Box::new(KeptState::of(component)));
        Ok(())
    })
}

/// Goes back to a copy.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetFMUstate(component: Option<&mut Component>, state: Option<&KeptState>) -> Status {
    guard(component, |component| {
        let KeptState { simulation, phase, time } = state.ok_or_else(missing)?;
        (component.simulation, component.phase, component.time) = (simulation.clone(), *phase, *time);
        Ok(())
    })
}

/// Frees a copy; nothing for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeFMUstate(component: Option<&mut Component>, state: Option<&mut Kept>) -> Status {
    guard(component, |_| {
        *state.ok_or_else(missing)? = None;
        Ok(())
    })
}

/// How many bytes a copy takes.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SerializedFMUstateSize(
    component: Option<&mut Component>,
    state: Option<&KeptState>,
    size: Option<&mut usize>,
) -> Status {
    guard(component, |_| {
        *size.ok_or("size: expected a place, got NULL")? = state.ok_or_else(missing)?.simulation.state().len();
        Ok(())
    })
}

/// A copy as bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SerializeFMUstate(
    component: Option<&mut Component>,
    state: Option<&KeptState>,
    bytes: *mut u8,
    n: usize,
) -> Status {
    guard(component, |_| {
        let ours = state.ok_or_else(missing)?.simulation.state();
        if bytes.is_null() || n < ours.len() {
            return Err(format!("serializedState: expected room for {} bytes, got {n}", ours.len()));
        }
        // SAFETY: there is room for them, and ours are no memory of the tool.
        unsafe { bytes.copy_from_nonoverlapping(ours.as_ptr(), ours.len()) };
        Ok(())
    })
}

/// A copy from its bytes: of a unit that runs the same, in its steps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    component: Option<&mut Component>,
    bytes: *const u8,
    n: usize,
    state: Option<&mut Kept>,
) -> Status {
    guard(component, |component| {
        if bytes.is_null() {
            return Err("serializedState: expected bytes, got NULL".into());
        }
        // SAFETY: it is not NULL, so it has n bytes, which nothing changes meanwhile.
        let bytes = unsafe { core::slice::from_raw_parts(bytes, n) };
        let mut simulation = component.fresh.clone();
        simulation.set_state(bytes).map_err(|error| error.to_string())?;
        *state.ok_or_else(missing)? =
            Some(Box::new(KeptState { simulation, phase: component.phase, time: component.time }));
        Ok(())
    })
}
