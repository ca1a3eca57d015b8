//! The Python face of the workspace: `mpi_hyst._core`. Conversion and error mapping only, no numerics.
//!
//! | Python | Rust |
//! |---|---|
//! | `float64` array, C-contiguous | `&[f64]`, read in place |
//! | any other real array or sequence | converted once |
//! | `state` | a dictionary of plain numbers and lists, by serde |
//! | `ValueError`, `TypeError`, `NotInvertibleError`, `OSError` | the `Error` of each crate, mapped in [`convert::errors`] |
//!
//! A signature stands in one place, at the parameters of the Rust function: `#[function]` and `#[methods]` of
//! `hysteresis_python_macros` read its names, defaults and types there, [`argument`] converts what comes, and the build
//! script writes the stub from the same lines. A new option is one line where the options of a call are gathered. Other
//! ways were tried:
//!
//! - Public functions in Python that hand on to a bare module: the names stand three times (signature, call, Rust), a
//!   class needs each of its methods again, and `step` costs twice as much (52 ns in place of 26).
//! - What pyo3 offers by itself: a default must be of the Rust type, so "auto" of an option that may also be 1, 2 or
//!   None cannot be said, and an error of its conversion does not begin with the name of the argument. Its description
//!   of the module (`experimental-inspect`) imports no name of a type that is said as text, shows such defaults as
//!   `...`, knows no array of numpy and asks for a flag of the linker on macOS.
//!
//! The interpreter stays attached while a stream runs, so that nothing can change an array under it; blocks are short
//! (a million samples take milliseconds) and signals are looked at between them. The threads of an array of streams are
//! Rust's own and end before the call does. So the module needs the lock of the interpreter: a free-threaded one takes
//! it up when it imports the module. Identification works on its own copy and lets the interpreter go, as does a loop
//! in real time.

mod argument;
mod control;
mod convert;
mod identify;
mod linear;
mod model;
mod pickled;
mod plant;
mod realtime;
mod rows;
mod shown;
mod signal;
mod stage;
mod stream;
mod trajectories;

use pyo3::prelude::*;

/// The compiled core of `mpi_hyst`.
#[pymodule(gil_used = true)]
mod _core {
    use pyo3::prelude::*;

    use crate::stream::single_argument;

    #[pymodule_export]
    use crate::control::array_controller::ArrayController;
    #[pymodule_export]
    use crate::control::controller::HybridController;
    #[pymodule_export]
    use crate::control::filters::{Biquad, Filter, Lead, LowPass, Notch};
    #[pymodule_export]
    use crate::control::inverse_dynamics::{Preview, invert_dynamics, precompensate, preview};
    #[pymodule_export]
    use crate::control::learning::{IterativeLearning, RepetitiveControl};
    #[pymodule_export]
    use crate::control::multi_axis::MultiAxisController;
    #[pymodule_export]
    use crate::control::observer::Observer;
    #[pymodule_export]
    use crate::control::shared_by_controllers::ControllerTerms;
    #[pymodule_export]
    use crate::control::tuning::{Margins, Tuning, tune};
    #[pymodule_export]
    use crate::convert::errors::{HeldBackWarning, NotInvertibleError, StartError};
    #[pymodule_export]
    use crate::identify::axes::{AxesIdentification, identify_axes};
    #[pymodule_export]
    use crate::identify::compare::{ComparedModel, Comparison, compare};
    #[pymodule_export]
    use crate::identify::diagnose::{Finding, diagnose, loop_width, verdict};
    #[pymodule_export]
    use crate::identify::dynamics::{DynamicsIdentification, identify_dynamics};
    #[pymodule_export]
    use crate::identify::identification::Identification;
    #[pymodule_export]
    use crate::identify::identify::identify;
    #[pymodule_export]
    use crate::identify::many::identify_many;
    #[pymodule_export]
    use crate::identify::many_identifications::ManyIdentifications;
    #[pymodule_export]
    use crate::identify::oscillator::{OscillatorIdentification, identify_oscillator};
    #[pymodule_export]
    use crate::identify::places::{PlacesIdentification, identify_places};
    #[pymodule_export]
    use crate::identify::quality::{LeftOutLoop, Quality};
    #[pymodule_export]
    use crate::identify::recursive::RecursiveIdentifier;
    #[pymodule_export]
    use crate::linear::creep::Creep;
    #[pymodule_export]
    use crate::linear::sections::{Antiresonance, FirstOrder, Modes, SecondOrder, StateSpace};
    #[pymodule_export]
    use crate::model::duhem::{Duhem, DuhemInverse};
    #[pymodule_export]
    use crate::model::models::{ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
    #[pymodule_export]
    use crate::model::operators::{CoupledPlay, Play};
    #[pymodule_export]
    use crate::plant::oscillator::{HystereticOscillator, OscillatorForward};
    #[pymodule_export]
    use crate::plant::paper::{gains, plant, table_1, table_1_recovered, table_2};
    #[pymodule_export]
    use crate::plant::plant::{MultiAxisPlant, Plant};
    #[pymodule_export]
    use crate::plant::run::{Metrics, Run};
    #[pymodule_export]
    use crate::plant::simulate::simulate;
    #[pymodule_export]
    use crate::realtime::other_side::{Functions, SharedMemory, Udp};
    #[pymodule_export]
    use crate::realtime::report::{LoopReport, LoopTimes};
    #[pymodule_export]
    use crate::realtime::run::run;
    #[pymodule_export]
    use crate::realtime::stop::Stop;
    #[pymodule_export]
    use crate::rows::plain_rows;
    #[pymodule_export]
    use crate::signal::excitation::{
        Excitation, ExperimentPart, ExperimentSegment, demagnetize, excitation, experiment,
    };
    #[pymodule_export]
    use crate::signal::signals::{chirp, decaying_triangle, multisine, sine, triangle};
    #[pymodule_export]
    use crate::stage::error_bounds::ErrorBounds;
    #[pymodule_export]
    use crate::stage::files::{c_header_text, c_name, fmu_texts, load, load_from, read_bytes};
    #[pymodule_export]
    use crate::stage::loop_shift::LoopShift;
    #[pymodule_export]
    use crate::stage::multi_axis_stage::{MultiAxisForward, MultiAxisStage};
    #[pymodule_export]
    use crate::stage::relaxing_plays::RelaxingPlays;
    #[pymodule_export]
    use crate::stage::slow_gain::SlowGain;
    #[pymodule_export]
    use crate::stage::stage::Stage;
    #[pymodule_export]
    use crate::stage::streams::{StageForward, StageInverse};
    #[pymodule_export]
    use crate::stage::temperature::TemperatureTerm;
    #[pymodule_export]
    use crate::stream::actuators::ActuatorArray;
    #[pymodule_export]
    use crate::stream::array_bracket::BracketArray;
    #[pymodule_export]
    use crate::stream::bracket::Bracket;
    #[pymodule_export]
    use crate::stream::stream_arrays::{ForwardArray, InverseArray};
    #[pymodule_export]
    use crate::stream::streams::{Forward, Inverse};
    #[pymodule_export]
    use crate::trajectories::one_axis::{PointToPoint, RoundedTriangle, Sine};
    #[pymodule_export]
    use crate::trajectories::scans::{Lissajous, Raster, ScanAxis, Spiral};

    #[pymodule_init]
    fn fill(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        // For a test, and so in no list of names.
        module.setattr("_defaults", wrap_pyfunction!(crate::argument::shown_defaults, module)?)?;
        let py = module.py();
        single_argument::add::<CoupledPlay>(py)?;
        single_argument::add::<Duhem>(py)?;
        single_argument::add::<DuhemInverse>(py)?;
        single_argument::add::<OscillatorForward>(py)?;
        single_argument::add::<Play>(py)?;
        single_argument::add::<Filter>(py)?;
        single_argument::add::<Forward>(py)?;
        single_argument::add::<Inverse>(py)?;
        single_argument::add::<StageForward>(py)?;
        single_argument::add::<StageInverse>(py)
    }
}
