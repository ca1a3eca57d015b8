//! Results, frozen classes of plain values, are pickled by serde.

use hysteresis_python_macros::methods;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;
use pythonize::{depythonize, pythonize};

use crate::control::shared_by_controllers::ControllerTerms;
use crate::control::tuning::Margins;
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::identify::compare::{ComparedModel, Comparison};
use crate::identify::diagnose::Finding;
use crate::identify::identification::Identification;
use crate::identify::many_identifications::ManyIdentifications;
use crate::identify::quality::{LeftOutLoop, Quality};
use crate::plant::run::Metrics;
use crate::realtime::report::{LoopReport, LoopTimes};
use crate::signal::excitation::{Excitation, ExperimentPart, ExperimentSegment};

#[methods(
    ComparedModel,
    Comparison,
    ControllerTerms,
    Excitation,
    ExperimentPart,
    ExperimentSegment,
    Finding,
    Identification,
    LeftOutLoop,
    LoopReport,
    LoopTimes,
    ManyIdentifications,
    Margins,
    Metrics,
    Quality
)]
impl Each {
    #[classmethod]
    fn _restored(_: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(depythonize(values)?)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
        reduce(make, (pythonize(py, self)?,), keywords!(py), None)
    }
}
