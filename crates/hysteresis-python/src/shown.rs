//! Methods that show an object: figures, reports, boxes of a notebook. They are drawn and written in Python.

use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::argument::Object;
use crate::control::tuning::Tuning;
use crate::identify::compare::Comparison;
use crate::identify::dynamics::DynamicsIdentification;
use crate::identify::identification::Identification;
use crate::identify::many_identifications::ManyIdentifications;
use crate::model::models::{ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
use crate::plant::run::Run;
use crate::realtime::report::LoopReport;
use crate::stage::stage::Stage;
use crate::stage::streams::StageInverse;
use crate::stream::streams::{Forward, Inverse};

/// An argument that is handed on, if it is given.
type Given<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Calls a function of the package with the object and what is given beside it, so that its own defaults count.
fn show<'py, const N: usize>(
    module: &str,
    function: &str,
    object: &Bound<'py, PyAny>,
    positional: &[&Bound<'py, PyAny>],
    given: [(&str, Given<'_, 'py>); N],
) -> PyResult<Bound<'py, PyAny>> {
    let py = object.py();
    let keywords = PyDict::new(py);
    for (name, value) in given {
        if let Some(value) = value {
            keywords.set_item(name, value)?;
        }
    }
    let positional = PyTuple::new(py, [&[object], positional].concat())?;
    py.import(module)?.call_method(function, positional, Some(&keywords))
}

#[methods(PrandtlIshlinskii, ModifiedPrandtlIshlinskii, Stage, Identification)]
impl Each {
    /// Draw it with `mpi_hyst.plot.loops`, which has the arguments.
    #[py(-> "Figure")]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike | None" = None)] u: Option<&Bound<'py, PyAny>>,
        #[py("ArrayLike | None" = None)] y: Option<&Bound<'py, PyAny>>,
        #[py(*, "int | None" = None)] record: Option<&Bound<'py, PyAny>>,
        #[py("int" = 0)] skip: Object,
        #[py("float | None" = None)] dt: Option<&Bound<'py, PyAny>>,
        #[py("Units" = None)] units: Option<&Bound<'py, PyAny>>,
        #[py("Sequence[Axes] | None" = None)] axes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = [
            ("u", u),
            ("y", y),
            ("record", record),
            ("skip", Some(skip.0.bind(slf.py()))),
            ("dt", dt),
            ("units", units),
            ("axes", axes),
        ];
        show("mpi_hyst.plot", "loops", slf, &[], given)
    }
}

#[methods(Forward, Inverse, StageInverse)]
impl Each {
    /// Draw it with `mpi_hyst.plot.memory`, which has the arguments.
    #[py(-> "Figure")]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        #[py(*, "Units" = None)] units: Option<&Bound<'py, PyAny>>,
        #[py("Sequence[Axes] | None" = None)] axes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        show("mpi_hyst.plot", "memory", slf, &[], [("units", units), ("axes", axes)])
    }
}

#[methods]
impl Tuning {
    /// Draw it with `mpi_hyst.plot.tuning`, which has the arguments.
    #[py(-> "Figure")]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        #[py("Sequence[Axes] | None" = None)] axes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        show("mpi_hyst.plot", "tuning", slf, &[], [("axes", axes)])
    }
}

#[methods]
impl LoopReport {
    /// Draw it with `mpi_hyst.plot.realtime`, which has the arguments.
    #[py(-> "Figure")]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        #[py("Sequence[Axes] | None" = None)] axes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        show("mpi_hyst.plot", "realtime", slf, &[], [("axes", axes)])
    }
}

#[methods]
impl Run {
    /// Draw it with `mpi_hyst.plot.run`, which has the arguments.
    #[py(-> "Figure")]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        #[py(*, "float | None" = None)] dt: Option<&Bound<'py, PyAny>>,
        #[py("Units" = None)] units: Option<&Bound<'py, PyAny>>,
        #[py("Sequence[Axes] | None" = None)] axes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        show("mpi_hyst.plot", "run", slf, &[], [("dt", dt), ("units", units), ("axes", axes)])
    }

    /// Write a report as one HTML file: `mpi_hyst.reports.run`, which has the arguments.
    #[py(-> "None")]
    fn report<'py>(
        slf: &Bound<'py, Self>,
        #[py("str | PathLike[str]")] path: &Bound<'py, PyAny>,
        #[py(*, "float")] dt: &Bound<'py, PyAny>,
        #[py("str" = "closed loop")] name: Object,
        #[py("Units" = None)] units: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        show(
            "mpi_hyst.reports",
            "run",
            slf,
            &[path],
            [("dt", Some(dt)), ("name", Some(name.0.bind(slf.py()))), ("units", units)],
        )
    }
}

#[methods]
impl Identification {
    /// Write a report as one HTML file: `mpi_hyst.reports.identification`, which has the arguments.
    #[py(-> "None")]
    fn report<'py>(
        slf: &Bound<'py, Self>,
        #[py("str | PathLike[str]")] path: &Bound<'py, PyAny>,
        #[py("Records | None" = None)] u: Option<&Bound<'py, PyAny>>,
        #[py("ArrayLike | None" = None)] y: Option<&Bound<'py, PyAny>>,
        #[py(*, "int | Sequence[int]" = 0)] skip: Object,
        #[py("Sequence[str] | None" = None)] names: Option<&Bound<'py, PyAny>>,
        #[py("Units" = None)] units: Option<&Bound<'py, PyAny>>,
        #[py("Identification | None" = None)] beside: Option<&Bound<'py, PyAny>>,
        #[py("Counted | Sequence[Counted] | None" = None)] validate: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = [
            ("u", u),
            ("y", y),
            ("skip", Some(skip.0.bind(slf.py()))),
            ("names", names),
            ("units", units),
            ("beside", beside),
            ("validate", validate),
        ];
        show("mpi_hyst.reports", "identification", slf, &[path], given)
    }
}

// What a notebook shows.
#[methods(
    Comparison,
    DynamicsIdentification,
    Identification,
    LoopReport,
    ManyIdentifications,
    ModifiedPrandtlIshlinskii,
    PrandtlIshlinskii,
    Run,
    Stage,
    Tuning
)]
impl Each {
    #[py(-> "str")]
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        show("mpi_hyst._report.notebook", "html", slf, &[], [])
    }
}
