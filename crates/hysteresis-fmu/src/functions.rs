//! What a tool calls: the course of a simulation, values of variables, and kept states.

use core::ffi::{c_char, c_int};

use hysteresis_export::{Error, Simulation};

use crate::component::{Component, Phase, Status, guard};

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

    fn expect(&self, call: &str, phases: &[Phase]) -> Result<(), String> {
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

/// Writes what `read` gives for every reference.
///
/// # Safety
/// Both arrays are NULL or have `n` elements.
unsafe fn get<T>(
    component: Option<&mut Component>,
    (references, n, values): (*const u32, usize, *mut T),
    read: impl Fn(&Component, u32) -> Result<T, Error>,
) -> Status {
    guard(component, |component| {
        check(n, references.is_null() || values.is_null())?;
        for k in 0..n {
            // SAFETY: k is below n.
            let reference = unsafe { references.add(k).read() };
            let value = read(component, reference).map_err(|error| error.to_string())?;
            // SAFETY: as above.
            unsafe { values.add(k).write(value) };
        }
        Ok(())
    })
}

fn check(n: usize, is_missing: bool) -> Result<(), String> {
    if n > 0 && is_missing { Err("vr, value: expected arrays, got NULL".into()) } else { Ok(()) }
}

/// Reads real numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetReal(
    component: Option<&mut Component>,
    references: *const u32,
    n: usize,
    values: *mut f64,
) -> Status {
    // SAFETY: as the standard asks of the tool.
    unsafe { get(component, (references, n, values), |component, reference| component.simulation.real(reference)) }
}

/// Reads whole numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetInteger(
    component: Option<&mut Component>,
    references: *const u32,
    n: usize,
    values: *mut c_int,
) -> Status {
    // SAFETY: as the standard asks of the tool.
    unsafe { get(component, (references, n, values), |component, reference| component.simulation.integer(reference)) }
}

/// Reads truth values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetBoolean(
    component: Option<&mut Component>,
    references: *const u32,
    n: usize,
    values: *mut c_int,
) -> Status {
    let read = |component: &Component, reference| component.simulation.boolean(reference).map(c_int::from);
    // SAFETY: as the standard asks of the tool.
    unsafe { get(component, (references, n, values), read) }
}

/// Sets inputs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetReal(
    component: Option<&mut Component>,
    references: *const u32,
    n: usize,
    values: *const f64,
) -> Status {
    guard(component, |component| {
        component.expect("fmi2SetReal", &[Phase::Instantiated, Phase::Initializing, Phase::Running])?;
        check(n, references.is_null() || values.is_null())?;
        for k in 0..n {
            // SAFETY: k is below n.
            let (reference, value) = unsafe { (references.add(k).read(), values.add(k).read()) };
            component.simulation.set_real(reference, value).map_err(|error| error.to_string())?;
        }
        Ok(())
    })
}

/// An error where anything is asked of variables that no unit has.
fn none(component: Option<&mut Component>, n: usize, call: &str) -> Status {
    guard(
        component,
        |_| if n == 0 { Ok(()) } else { Err(format!("{call}: expected no variable of this kind, got {n}")) },
    )
}

/// No unit has texts.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetString(
    component: Option<&mut Component>,
    _references: *const u32,
    n: usize,
    _values: *mut *const c_char,
) -> Status {
    none(component, n, "fmi2GetString")
}

/// No input is a whole number.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetInteger(
    component: Option<&mut Component>,
    _references: *const u32,
    n: usize,
    _values: *const c_int,
) -> Status {
    none(component, n, "fmi2SetInteger")
}

/// No input is a truth value.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetBoolean(
    component: Option<&mut Component>,
    _references: *const u32,
    n: usize,
    _values: *const c_int,
) -> Status {
    none(component, n, "fmi2SetBoolean")
}

/// No unit has texts.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetString(
    component: Option<&mut Component>,
    _references: *const u32,
    n: usize,
    _values: *const *const c_char,
) -> Status {
    none(component, n, "fmi2SetString")
}

/// Inputs are held, so they have no derivatives.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetRealInputDerivatives(
    component: Option<&mut Component>,
    _references: *const u32,
    n: usize,
    _orders: *const c_int,
    _values: *const f64,
) -> Status {
    none(component, n, "fmi2SetRealInputDerivatives")
}

/// Outputs have no derivatives.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetRealOutputDerivatives(
    component: Option<&mut Component>,
    _references: *const u32,
    n: usize,
    _orders: *const c_int,
    _values: *mut f64,
) -> Status {
    none(component, n, "fmi2GetRealOutputDerivatives")
}

/// Hysteresis has no directional derivative.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetDirectionalDerivative(
    component: Option<&mut Component>,
    _unknown: *const u32,
    n: usize,
    _known: *const u32,
    _n_known: usize,
    _dv_known: *const f64,
    _dv_unknown: *mut f64,
) -> Status {
    none(component, n, "fmi2GetDirectionalDerivative")
}

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
