//! `step` and `peek` as C functions of one argument: half the time of a method that takes its arguments in general.
//!
//! What a call of a general method costs is mostly not its work: a look at the pool of deferred references behind a
//! lock, the counting of attachments, the parsing of arguments and a guard against panics. These two need none of it:
//! they have one positional argument, give back a new float, keep no references and never panic. The flag that guards
//! against a second borrower stays.

use std::ffi::CStr;

use hysteresis_core::Process;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;
use pyo3::{PyClass, ffi};

use crate::convert::errors::not_converted;
use crate::convert::objects::{exclusive, shared};

/// A class around a process.
pub(crate) trait Stepper: PyClass<Frozen = False> {
    fn process(&self) -> &impl Process;
    fn process_mut(&mut self) -> &mut impl Process;
    /// How many samples were not finite, or beyond 1e100.
    fn rejected(&self) -> u64;
}

type Method = unsafe extern "C" fn(*mut ffi::PyObject, *mut ffi::PyObject) -> *mut ffi::PyObject;

/// Gives the class its `step` and `peek`.
pub(crate) fn add<C: Stepper>(py: Python<'_>) -> PyResult<()> {
    add_method::<C>(py, const { &definition(c"step", step::<C>, STEP) })?;
    add_method::<C>(py, const { &definition(c"peek", peek::<C>, PEEK) })
}

const STEP: &CStr = c"step($self, sample, /)\n--\n\n\
    Takes one sample and returns the output. A sample that is not finite leaves everything as it is.";
const PEEK: &CStr = c"peek($self, sample, /)\n--\n\nWhat `step` would return, without taking the sample.";

const fn definition(name: &'static CStr, method: Method, doc: &'static CStr) -> ffi::PyMethodDef {
    ffi::PyMethodDef {
        ml_name: name.as_ptr(),
        ml_meth: ffi::PyMethodDefPointer { PyCFunction: method },
        ml_flags: ffi::METH_O,
        ml_doc: doc.as_ptr(),
    }
}

fn add_method<C: Stepper>(py: Python<'_>, definition: &'static ffi::PyMethodDef) -> PyResult<()> {
    let class = py.get_type::<C>();
    // SAFETY: the definition and its strings live for ever and Python only reads them; the result is a new reference.
    let (name, method) = unsafe {
        let method = ffi::PyDescr_NewMethod(class.as_type_ptr(), std::ptr::from_ref(definition).cast_mut());
        (CStr::from_ptr(definition.ml_name), Bound::from_owned_ptr_or_err(py, method)?)
    };
    class.setattr(name, method)
}

unsafe extern "C" fn step<C: Stepper>(class: *mut ffi::PyObject, sample: *mut ffi::PyObject) -> *mut ffi::PyObject {
    // SAFETY: Python calls this as a method of C.
    unsafe { call::<C>(class, sample, |class, x| Ok(exclusive(class)?.process_mut().step(x))) }
}

unsafe extern "C" fn peek<C: Stepper>(class: *mut ffi::PyObject, sample: *mut ffi::PyObject) -> *mut ffi::PyObject {
    // SAFETY: Python calls this as a method of C.
    unsafe { call::<C>(class, sample, |class, x| Ok(shared(class)?.process().peek(x))) }
}

/// A float in, a float out.
///
/// # Safety
/// Only for Python to call, as a method of C: it has checked the type of the instance, is attached, and lends both
/// references for as long as the call takes.
#[inline]
#[expect(clippy::float_cmp, reason = "a conversion that failed returns exactly -1.0")]
unsafe fn call<C: Stepper>(
    instance: *mut ffi::PyObject,
    sample: *mut ffi::PyObject,
    method: impl FnOnce(&Bound<'_, C>, f64) -> PyResult<f64>,
) -> *mut ffi::PyObject {
    // SAFETY: both pointers are lent for the call and the thread is attached, which all of these functions need. The
    // type of the instance was checked. An error is matched and fetched only where one is set, and null is returned
    // only with one set. The conversion may run Python code, so it comes before the instance is borrowed.
    unsafe {
        let x = ffi::PyFloat_AsDouble(sample);
        let py = Python::assume_attached();
        if x == -1.0 && !ffi::PyErr_Occurred().is_null() {
            // What else was raised stays set. Only a TypeError is fetched: to fetch a PanicException goes on with its
            // panic, which would end the process here.
            if ffi::PyErr_ExceptionMatches(ffi::PyExc_TypeError) != 0 {
                let error = PyErr::fetch(py);
                not_converted("sample", "a number", &Borrowed::from_ptr(py, sample), error).restore(py);
            }
            return std::ptr::null_mut();
        }
        let instance = Borrowed::from_ptr(py, instance).cast_unchecked::<C>();
        match method(&instance, x) {
            Ok(output) => ffi::PyFloat_FromDouble(output),
            Err(error) => {
                error.restore(py);
                std::ptr::null_mut()
            }
        }
    }
}
