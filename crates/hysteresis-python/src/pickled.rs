//! How objects are pickled: results, frozen classes of plain values, by serde; what runs by its attribute `state`.

use hysteresis_python_macros::methods;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;
use pythonize::{depythonize, pythonize};

use crate::control::array_controller::ArrayController;
use crate::control::controller::HybridController;
use crate::control::filters::Filter;
use crate::control::learning::{IterativeLearning, RepetitiveControl};
use crate::control::multi_axis::MultiAxisController;
use crate::control::observer::Observer;
use crate::control::shared_by_controllers::ControllerTerms;
use crate::control::tuning::Margins;
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::identify::axes::AxesIdentification;
use crate::identify::compare::{ComparedModel, Comparison};
use crate::identify::diagnose::Finding;
use crate::identify::identification::Identification;
use crate::identify::many_identifications::ManyIdentifications;
use crate::identify::oscillator::OscillatorIdentification;
use crate::identify::places::PlacesIdentification;
use crate::identify::quality::{LeftOutLoop, Quality};
use crate::identify::recursive::RecursiveIdentifier;
use crate::model::duhem::{Duhem, DuhemInverse};
use crate::model::operators::{CoupledPlay, Play};
use crate::plant::oscillator::OscillatorForward;
use crate::plant::plant::Plant;
use crate::plant::run::Metrics;
use crate::realtime::report::{LoopReport, LoopTimes};
use crate::signal::excitation::{Excitation, ExperimentPart, ExperimentSegment};
use crate::stage::error_bounds::ErrorBounds;
use crate::stage::multi_axis_stage::{MultiAxisForward, MultiAxisStage};
use crate::stage::streams::{StageForward, StageInverse};
use crate::stream::array_bracket::BracketArray;
use crate::stream::bracket::Bracket;
use crate::stream::stream_arrays::{ForwardArray, InverseArray};
use crate::stream::streams::{Forward, Inverse};

#[methods(
    AxesIdentification,
    ComparedModel,
    Comparison,
    ControllerTerms,
    ErrorBounds,
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
    MultiAxisStage,
    OscillatorIdentification,
    PlacesIdentification,
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

#[methods(
    ArrayController,
    Bracket,
    BracketArray,
    CoupledPlay,
    Duhem,
    DuhemInverse,
    Filter,
    Forward,
    ForwardArray,
    HybridController,
    Inverse,
    InverseArray,
    IterativeLearning,
    MultiAxisController,
    MultiAxisForward,
    Observer,
    OscillatorForward,
    Plant,
    Play,
    RecursiveIdentifier,
    RepetitiveControl,
    StageForward,
    StageInverse
)]
impl Each {
    fn __setstate__(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        slf.setattr(intern!(slf.py(), "state"), state)
    }
}
