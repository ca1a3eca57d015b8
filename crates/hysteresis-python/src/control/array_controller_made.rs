//! How an array makes its controller.

use hysteresis_core::{self as core, ArrayOptions};
use hysteresis_python_macros::methods;
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix2, IxDyn};
use pyo3::intern;
use pyo3::prelude::*;

use super::array_controller::ArrayController;
use crate::convert::arrays::{array, each, one_or_more};
use crate::convert::errors::{self, raise};
use crate::stream::actuators::{ActuatorArray, Limits};
use crate::stream::stream_arrays::MadeOf;

/// Pairs of actuators, P rows of two whole numbers.
fn pairs(neighbours: &Bound<'_, PyAny>) -> PyResult<Vec<(usize, usize)>> {
    let expected = "an array of shape (pairs, 2) of whole numbers of at least zero";
    let rows = array::<IxDyn>("neighbours", neighbours, format_args!("{expected}"))?;
    if !matches!(rows.shape(), [_, 2]) {
        let shape = rows.getattr(intern!(neighbours.py(), "shape"))?;
        return Err(errors::value("neighbours", format_args!("expected {expected}, got shape {shape}")));
    }
    let whole = |number: f64| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number that is checked")]
        if number >= 0.0 && number.fract() == 0.0 && number <= 1e15 {
            Ok(number as usize)
        } else {
            Err(errors::value("neighbours", format_args!("expected {expected}, got {number:?}")))
        }
    };
    rows.as_slice()?.chunks_exact(2).map(|pair| Ok((whole(pair[0])?, whole(pair[1])?))).collect()
}

#[methods]
impl ActuatorArray {
    /// A controller of all actuators, with the exact inverses at rest.
    ///
    /// Parameters
    /// ----------
    /// dt : float
    ///     The sampling interval in seconds.
    /// limits : (low, high) or array of shape (M, 2)
    ///     Of the drives, in volts.
    /// ki : float
    ///     The integral gain per second. With direct sensors and one sample of delay the loop is stable below ki dt = 1, and calm
    ///     at 0.3.
    /// reconstruction : array of shape (M, S), optional
    ///     What makes errors of the actuators of those of S sensors, such as the pseudo-inverse of the measured response matrix.
    ///     Without it sensor i measures actuator i.
    /// leak : float
    ///     How fast the integral goes to zero by itself, per second: at most 1 / dt.
    /// slew : float or array of shape (M,), optional
    ///     How fast the drives may move, in V/s.
    /// neighbours : array of shape (P, 2), optional
    ///     Pairs of actuators, by their numbers, whose positions must not be too far apart.
    /// max_difference : float or array of shape (P,), optional
    ///     How far the modelled positions of each pair may be apart. Given with `neighbours`.
    /// bumpless_time : float
    ///     How long, in seconds, the difference at a start takes to go to zero. From a start on the integral rests for that time.
    /// start_drive : float or array of shape (M,), optional
    ///     The drives that the amplifiers have at the start: by default zero or the limit nearest to it.
    ///
    /// Returns
    /// -------
    /// ArrayController
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    /// NotInvertibleError
    ///     That names the first actuator whose model may not be invertible.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
    /// >>> controller = mirror.controller(
    /// ...     1e-3, (-10.0, 10.0), slew=2e4, neighbours=[(0, 1), (1, 2)], max_difference=2.0, bumpless_time=0.0
    /// ... )
    /// >>> _ = controller.step([0.0, 0.0, 0.0])  # a motion starts from the drives that are there
    /// >>> _ = controller.step([3.0, 3.0, 9.0])  # the last step is too high
    /// >>> controller.position.round(6)
    /// array([3., 5., 7.])
    fn controller(
        slf: &Bound<'_, Self>,
        dt: f64,
        #[py("ArrayLike")] limits: &Bound<'_, PyAny>,
        #[py(*, = 0.0)] ki: f64,
        #[py("ArrayLike | None" = None)] reconstruction: Option<&Bound<'_, PyAny>>,
        #[py(= 0.0)] leak: f64,
        #[py("ArrayLike | None" = None)] slew: Option<&Bound<'_, PyAny>>,
        #[py("ArrayLike | None" = None)] neighbours: Option<&Bound<'_, PyAny>>,
        #[py("ArrayLike | None" = None)] max_difference: Option<&Bound<'_, PyAny>>,
        #[py(= 0.005)] bumpless_time: f64,
        #[py("ArrayLike | None" = None)] start_drive: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ArrayController> {
        let set = ArrayOptions::new(dt);
        let actuators = slf.get().compiled().len();
        let given = Limits::from_python(Some(limits), actuators)?;
        let matrix = |given: &Bound<'_, PyAny>| {
            let expected = format!("an array of shape ({actuators}, sensors)");
            let rows = array::<Ix2>("reconstruction", given, format_args!("{expected}"))?;
            if rows.shape()[0] == actuators && rows.shape()[1] > 0 {
                return Ok(rows.as_slice()?.to_vec());
            }
            let shape = rows.getattr(intern!(given.py(), "shape"))?;
            Err(errors::value("reconstruction", format_args!("expected {expected}, got shape {shape}")))
        };
        let neighbours = neighbours.map_or(Ok(Vec::new()), pairs)?;
        let differences = |given| {
            one_or_more("max_difference", given, format_args!("a number or an array of shape ({},)", neighbours.len()))
        };
        let max_difference = max_difference.map_or(Ok(Vec::new()), differences)?;
        let options = ArrayOptions {
            ki,
            leak,
            reconstruction: reconstruction.map(matrix).transpose()?,
            slew: slew.map_or(Ok(Vec::new()), |slew| {
                one_or_more("slew", slew, format_args!("a number or an array of shape ({actuators},)"))
            })?,
            neighbours,
            max_difference,
            bumpless_time,
            start_drive: start_drive.map(|drive| each("start_drive", drive, actuators)).transpose()?,
            ..set
        };
        let inverse = slf.get().inverses(&given, None)?;
        let controller = core::ArrayController::new(inverse, &options).map_err(raise)?;
        Ok(ArrayController::new(controller, MadeOf::new(slf.as_any(), Some(limits))))
    }
}
