//! Parts of a stage from Python objects.

use hysteresis_control::stage::Units;
use hysteresis_core::PiecewiseLinearMap;
use pyo3::prelude::*;

use crate::convert::arrays::vector;
use crate::convert::errors::{raise, unexpected};

/// A strictly monotone map from its points: a pair of arrays (x, y).
pub(crate) fn map(name: &str, points: &Bound<'_, PyAny>) -> PyResult<PiecewiseLinearMap> {
    let Ok((x, y)) = points.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() else {
        return Err(unexpected(name, "a pair of arrays (x, y): the points of a piecewise-linear map", points));
    };
    let (x, y) = (vector(name, &x)?, vector(name, &y)?);
    PiecewiseLinearMap::new(x.as_slice()?, y.as_slice()?).map_err(raise)
}

/// The points of a map, as it is given.
pub(crate) fn points(map: &PiecewiseLinearMap) -> (Vec<f64>, Vec<f64>) {
    map.points().unzip()
}

/// The names of two units.
pub(crate) fn units(units: &Bound<'_, PyAny>) -> PyResult<Units> {
    match units.extract::<(String, String)>() {
        Ok((drive, position)) => Ok(Units { drive, position }),
        Err(_) => {
            Err(unexpected("units", "two names: of the drive and of the position, such as (\"V\", \"um\")", units))
        }
    }
}
