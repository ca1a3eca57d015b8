//! Parts of a stage from Python objects.

use hysteresis_control::stage::{Stage, StageParts, Units};
use hysteresis_core::PiecewiseLinearMap;
use pyo3::prelude::*;

use super::loop_shift::given_loop_shift;
use super::object;
use crate::control::linear::creep::given_creep;
use crate::control::linear::part::{amplifier, linear_dynamics};
use crate::convert::arguments::{Given, pair};
use crate::convert::arrays::vector;
use crate::convert::errors::{raise, unexpected, value, wrong_type};
use crate::model::object::model_of;

/// A strictly monotone map from its points: a pair of arrays (x, y).
fn map(name: &str, points: &Bound<'_, PyAny>) -> PyResult<PiecewiseLinearMap> {
    let Ok((x, y)) = points.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() else {
        return Err(unexpected(name, "a pair of arrays (x, y): the points of a piecewise-linear map", points));
    };
    let (x, y) = (vector(name, &x)?, vector(name, &y)?);
    PiecewiseLinearMap::new(x.as_slice()?, y.as_slice()?).map_err(|error| value(name, error))
}

/// The points of a map, as it is given.
pub(crate) fn points(map: &PiecewiseLinearMap) -> (Vec<f64>, Vec<f64>) {
    map.points().unzip()
}

/// The names of two units.
fn units(units: &Bound<'_, PyAny>) -> PyResult<Units> {
    match units.extract::<(String, String)>() {
        Ok((drive, position)) => Ok(Units { drive, position }),
        Err(_) => {
            Err(unexpected("units", "two names: of the drive and of the position, such as (\"V\", \"um\")", units))
        }
    }
}

/// The keywords of a stage, as they came.
#[derive(Default)]
pub(crate) struct StageKeywords<'a, 'py> {
    pub(crate) limits: Option<&'a Bound<'py, PyAny>>,
    pub(crate) slew: Option<&'a Bound<'py, PyAny>>,
    pub(crate) dead_time: Option<&'a Bound<'py, PyAny>>,
    pub(crate) amplifier_bandwidth: Option<&'a Bound<'py, PyAny>>,
    pub(crate) dynamics: Option<&'a Bound<'py, PyAny>>,
    pub(crate) creep: Option<&'a Bound<'py, PyAny>>,
    pub(crate) loop_shift: Option<&'a Bound<'py, PyAny>>,
    pub(crate) input_map: Option<&'a Bound<'py, PyAny>>,
    pub(crate) output_map: Option<&'a Bound<'py, PyAny>>,
    pub(crate) noise: Option<&'a Bound<'py, PyAny>>,
    pub(crate) units: Option<&'a Bound<'py, PyAny>>,
}

impl StageKeywords<'_, '_> {
    /// The stage around a hysteresis, which is the argument `name`.
    pub(crate) fn stage(&self, name: &str, hysteresis: &Bound<'_, PyAny>) -> PyResult<Stage> {
        let mut parts = StageParts::new(model_of(name, hysteresis)?.into());
        parts.limits = self.limits.map(|limits| pair("limits", limits)).transpose()?;
        parts.slew = self.slew.number("slew")?;
        parts.dead_time = self.dead_time.number("dead_time")?.unwrap_or(parts.dead_time);
        parts.noise = self.noise.number("noise")?;
        parts.amplifier = self.amplifier_bandwidth.number("amplifier_bandwidth")?.map(amplifier).transpose()?;
        if let Some(dynamics) = self.dynamics {
            parts.dynamics = linear_dynamics("dynamics", dynamics)?;
        }
        parts.creep = self.creep.map(given_creep).transpose()?;
        parts.loop_shift = self.loop_shift.map(given_loop_shift).transpose()?;
        parts.input_map = self.input_map.map(|points| map("input_map", points)).transpose()?;
        parts.output_map = self.output_map.map(|points| map("output_map", points)).transpose()?;
        if let Some(names) = self.units {
            parts.units = units(names)?;
        }
        Stage::new(parts).map_err(raise)
    }

    /// Whether none was given.
    pub(crate) fn is_empty(&self) -> bool {
        let Self { limits, slew, dead_time, amplifier_bandwidth, dynamics, noise, units, .. } = self;
        let Self { creep, loop_shift, input_map, output_map, .. } = self;
        [limits, slew, dead_time, amplifier_bandwidth, dynamics, noise, units, creep, loop_shift, input_map, output_map]
            .iter()
            .all(|keyword| keyword.is_none())
    }

    /// The stage that the argument `name` is, or the one around the hysteresis that it is.
    pub(crate) fn stage_or_around(&self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<Stage> {
        match value.cast::<object::Stage>() {
            Err(_) => self.stage(name, value),
            Ok(stage) if self.is_empty() => Ok(stage.get().0.clone()),
            Ok(_) => {
                Err(wrong_type(name, "expected a model beside the parts of a stage, got a Stage, which has its own"))
            }
        }
    }
}
