//! The loops of `run`. Input and output may be the same array, so they are no slices.

use crate::status::{Failure, Status, guard};

/// Whether arrays of `n` numbers are there; if not, that is the last error.
pub(crate) fn check<const N: usize>(n: usize, arrays: [(&str, *const f64); N]) -> Status {
    match arrays.iter().find(|(_, array)| n > 0 && array.is_null()) {
        None => Status::Ok,
        Some((name, _)) => guard(|| Err(Failure::null(name))),
    }
}

/// One output for each row of inputs, in order.
///
/// # Safety
/// All arrays have `n` numbers, or `n` is 0.
pub(crate) unsafe fn each_row<const N: usize>(
    n: usize,
    inputs: [*const f64; N],
    output: *mut f64,
    mut step: impl FnMut([f64; N]) -> f64,
) {
    for k in 0..n {
        // SAFETY: k is below n.
        let row = inputs.map(|input| unsafe { input.add(k).read() });
        // SAFETY: as above.
        unsafe { output.add(k).write(step(row)) };
    }
}

/// What was driven before, or bytes: `n` of them.
///
/// # Safety
/// The array is NULL or has `n` elements, which nothing changes while the slice lives.
pub(crate) unsafe fn slice<'a, T>(name: &str, n: usize, elements: *const T) -> Result<&'a [T], Failure> {
    if n == 0 {
        return Ok(&[]);
    }
    if elements.is_null() {
        return Err(Failure::null(name));
    }
    // SAFETY: it is not NULL, so it has n elements.
    Ok(unsafe { core::slice::from_raw_parts(elements, n) })
}
