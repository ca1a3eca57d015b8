//! Values of variables.

use core::ffi::{c_char, c_int};

use hysteresis_export::Error;

use crate::component::{Component, Phase};
use crate::status::{Status, guard};

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
