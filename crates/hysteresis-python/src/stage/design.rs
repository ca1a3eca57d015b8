//! What is made from a stage for control and simulation.

use std::num::NonZeroUsize;

use hysteresis_control::feedforward::PreviewOptions;
use hysteresis_control::filters::sections;
use hysteresis_control::learning::{FeedbackLoop, LearningOptions, RepetitiveOptions};
use hysteresis_control::stage::PEAK_SENSITIVITY;
use hysteresis_control::tuning::{self, Structure};
use hysteresis_core::{ControllerOptions, Sections};
use hysteresis_python_macros::methods;
use hysteresis_simulate::closed_loop::{Tracking, TrackingTask};
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::stage::{Stage, checked_limits};
use super::streams::StageInverse;
use crate::argument::{Argument, Callable, SampleCount, Words};
use crate::control::controller::HybridController;
use crate::control::inverse_dynamics::Preview;
use crate::control::learning::{IterativeLearning, RepetitiveControl, told};
use crate::control::observer::Observer;
use crate::control::tuning::{Demands, Tuning};
use crate::convert::errors::{self, raise, unexpected};
use crate::linear::sections::StateSpace;
use crate::plant::plant::{Converters, Plant};
use crate::plant::run::Run;
use crate::plant::simulate::watch;
use crate::trajectories::positions::samples;

impl Stage {
    /// How many samples a preview looks ahead: as given, or as many as this stage needs.
    fn ahead(&self, given: Option<SampleCount>, dt: f64) -> PyResult<usize> {
        given.map_or_else(|| self.0.preview_ahead(dt).map_err(raise), |ahead| Ok(ahead.0))
    }

    fn made_preview(&self, dt: f64, options: &PreviewOptions) -> PyResult<Preview> {
        Preview::made(self.0.preview(dt, options).map_err(raise)?)
    }

    /// Amplifier and modes in matrices.
    fn state_space<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, StateSpace>> {
        Bound::new(py, StateSpace(self.0.linear_part().map_err(raise)?.state_space()))
    }

    /// The loop of gains that were given, without filters, or of tuned ones with theirs.
    fn feedback_loop(&self, dt: f64, gains: (Option<f64>, Option<f64>)) -> PyResult<FeedbackLoop> {
        let (gains, filters) = if let Some(given) = both(gains)? {
            (given, Sections::default())
        } else {
            let tuned = self.0.tune(dt, PEAK_SENSITIVITY).map_err(raise)?;
            ((tuned.kp, tuned.ki), sections(&tuned.filters, dt).map_err(raise)?)
        };
        self.0.feedback_loop(dt, gains, filters).map_err(raise)
    }
}

#[methods]
impl Stage {
    /// Filters and gains of the feedback for every slope of the hysteresis: as `control.tune`.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> stage = mh.Stage(mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
    /// >>> tuning = stage.tune(1e-4, structure="active damping")
    /// >>> tuning.kp < 0.0, tuning.explanation.split(".")[0]
    /// (True, 'A low-pass and a negative proportional gain damp the resonance actively')
    #[gather(demands: Demands)]
    fn tune(
        &self,
        py: Python<'_>,
        dt: f64,
        #[py(field = 1.7)] peak_sensitivity: f64,
        #[py(*, field = None)] frequency_uncertainty: Option<f64>,
        #[py(field = None)] damping_uncertainty: Option<f64>,
        #[py(field, "Structure | None" = None)] structure: Option<Structure>,
    ) -> PyResult<Tuning> {
        demands.tune(py, self.0.clone(), dt)
    }

    /// The window of references that leads through the inverse of amplifier, modes and dead time: as `control.preview`.
    fn preview(
        &self,
        dt: f64,
        #[py(= None)] ahead: Option<SampleCount>,
        #[py(*, = None)] window: Option<SampleCount>,
        #[py(= None)] degree: Option<SampleCount>,
    ) -> PyResult<Preview> {
        let options = PreviewOptions {
            ahead: self.ahead(ahead, dt)?,
            window: window.map(|window| window.0),
            degree: degree.map(|degree| degree.0),
            band: None,
        };
        self.made_preview(dt, &options)
    }

    /// A controller of this stage: tuned gains, its limits and slew rate, and a gate for measurements that cannot be.
    /// Dead time, creep and modes are in its feed-forward, an observer and learning in its loop, each where it is asked
    /// for.
    ///
    /// Parameters
    /// ----------
    /// dt : float
    ///     Sampling interval in seconds.
    /// limits : (low, high), optional
    ///     Within those of the stage; by default `drive_range`.
    /// feedforward : "inverse", "preview" or "given"
    ///     The exact inverse of the reference of now; of a target made of references that come `preview.ahead` samples
    ///     early, through the inverse of amplifier, modes and dead time too; or drives that come with every sample.
    /// kp, ki : float, optional
    ///     Gains in V/um and V/um/s instead of tuned ones, both or none.
    /// tuning : Tuning, optional
    ///     Gains and filters that `tune` of this stage gave for this dt, in the place of those of `tune(dt)`.
    /// ahead : int, optional
    ///     How many samples early references come, for "preview"; by default as many as the dynamics need: 4 more than
    ///     the dead time; 8, 16 or 32 for a mode far below the sampling rate, where a shorter window makes of a corner
    ///     drives that no slew rate allows; and more for zeros in the right half plane. Smooth references need not come
    ///     early where the stage has no dead time: with 0 the window looks back alone. Then corners and steps make
    ///     large drives.
    /// smoothing : float or "modes", optional
    ///     References with steps and corners, for "preview": they are smoothed over so many seconds, and come half of
    ///     that earlier. "modes" is three periods of the slowest lightly damped mode, which then stays at rest.
    /// drift : float, optional
    ///     Puts an `Observer` of this stage before the feedback: by how much what the model does not know changes in
    ///     one second, um.
    /// period : int, optional
    ///     Learns a reference that repeats after so many samples, by `RepetitiveControl`. Learning that diverges stops
    ///     and fades out: `divergence_count` and `learning_phase` of the controller tell.
    /// frequency_uncertainty, damping_uncertainty : float, optional
    ///     Beside `period`: how far lightly damped modes may be from what is known, as a share of their frequency and a
    ///     factor of their damping. Tuned gains and learning suit all of these; a `tuning` that is given has its own.
    ///     By default 0.05 and 2, or three standard errors of the identification where they are more.
    /// max_measurement_step : float, optional
    ///     A measurement farther from the last one, um, is implausible: it is counted, and not acted upon.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dynamics=mh.plant.SecondOrder(400.0, 0.95))
    /// >>> controller, plant = stage.controller(dt=1e-4), stage.plant(dt=1e-4)
    /// >>> for reference in mh.signals.sine(2.0, 10.0, seconds=0.2, rate=10e3):
    /// ...     drive = controller.step(reference, plant.measured)
    /// ...     _ = plant.step(drive)
    /// >>> abs(controller.terms.error) < 0.05
    /// True
    /// >>> light = stage.replace(dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4)
    /// >>> bold = light.tune(1e-4, peak_sensitivity=2.0)
    /// >>> light.controller(1e-4, tuning=bold).ki == bold.ki > light.controller(1e-4).ki
    /// True
    /// >>> controller = light.controller(1e-4, feedforward="preview", smoothing="modes")
    /// >>> step = [0.0] * 100 + [1.0] * 100  # um
    /// >>> run = mh.plant.simulate(controller, light.plant(dt=1e-4), step)
    /// >>> bool(max(run.position) < 1.005), bool(max(abs(run.position[130:] - 1.0)) < 1e-3)
    /// (True, True)
    /// >>> whole = light.replace(noise=0.002).controller(1e-4, feedforward="preview", drift=0.5, period=500)
    /// >>> wave = mh.signals.sine(1.0, 20.0, seconds=0.5, rate=10e3)  # ten periods
    /// >>> worn = light.replace(dynamics=mh.plant.SecondOrder(780.0, 0.03)).plant(1e-4)
    /// >>> run = mh.plant.simulate(whole, worn, wave)
    /// >>> worst = abs(run.position - wave).reshape(10, 500).max(axis=1)
    /// >>> bool(worst[0] > 2e-3), bool(worst[8] < 1e-4)  # um, in the first and the ninth period
    /// (True, True)
    /// >>> changed = light.replace(dynamics=mh.plant.SecondOrder(620.0, 0.02)).plant(1e-4)  # a heavier load
    /// >>> run = mh.plant.simulate(whole, changed, mh.signals.sine(1.0, 20.0, seconds=1.5, rate=10e3))
    /// >>> whole.divergence_count, whole.learning_phase
    /// (1, 'stopped')
    #[gather(wishes: Wishes)]
    fn controller(
        &self,
        py: Python<'_>,
        dt: f64,
        #[py("Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(= "inverse")] feedforward: Feedforward,
        #[py(*, = None)] kp: Option<f64>,
        #[py(= None)] ki: Option<f64>,
        #[py(= None)] tuning: Option<Bound<'_, Tuning>>,
        #[py(field = None)] ahead: Option<SampleCount>,
        #[py(field, "float | Literal['modes'] | None" = None)] smoothing: Option<Smoothing>,
        #[py(field = None)] drift: Option<f64>,
        #[py(field = None)] period: Option<NonZeroUsize>,
        #[py(field = None)] frequency_uncertainty: Option<f64>,
        #[py(field = None)] damping_uncertainty: Option<f64>,
        #[py(field = None)] max_measurement_step: Option<f64>,
    ) -> PyResult<HybridController> {
        let gains = self.gains((kp, ki), tuning.as_ref(), dt)?;
        let limits = checked_limits(py, &self.0, limits)?;
        self.made_controller(py, dt, limits, feedforward, gains, &wishes)
    }

    /// An observer of this stage: as `control.Observer`.
    fn observer(&self, dt: f64, #[py(*)] drift: f64, #[py(= None)] noise: Option<f64>) -> PyResult<Observer> {
        Observer::of(self.0.clone(), dt, drift, noise)
    }

    /// Learning from period to period around this stage: as `control.IterativeLearning`, tuned gains unless given. The
    /// slope may be any of the hysteresis.
    #[gather(options: LearningOptions)]
    fn iterative_learning(
        &self,
        #[py("ArrayLike")] target: &Bound<'_, PyAny>,
        dt: f64,
        #[py(*, field = None)] bandwidth: Option<f64>,
        #[py(= None)] kp: Option<f64>,
        #[py(= None)] ki: Option<f64>,
        #[py(field = 0.15)] min_gain: f64,
        #[py(field, "Sequence[float] | None" = None)] target_limits: Option<(f64, f64)>,
        #[py(field = None)] noise: Option<f64>,
        #[py(= None)] frequency_uncertainty: Option<f64>,
        #[py(= None)] damping_uncertainty: Option<f64>,
        #[py(= None)] settle: Option<u32>,
        #[py(field = false)] on_demand: bool,
    ) -> PyResult<IterativeLearning> {
        let options = LearningOptions {
            uncertainty: told(self.0.loop_uncertainty(), frequency_uncertainty, damping_uncertainty),
            // From rest to rest nothing rings on.
            settle: settle.unwrap_or_else(|| if options.on_demand { 0 } else { self.0.periods_to_settle() }),
            ..options
        };
        IterativeLearning::of(self.feedback_loop(dt, (kp, ki))?, target, options)
    }

    /// Learning in the running loop around this stage: as `control.RepetitiveControl`, tuned gains unless given. The
    /// slope may be any of the hysteresis.
    #[gather(options: RepetitiveOptions)]
    fn repetitive_control(
        &self,
        period: NonZeroUsize,
        dt: f64,
        #[py(*, field = None)] bandwidth: Option<f64>,
        #[py(= None)] kp: Option<f64>,
        #[py(= None)] ki: Option<f64>,
        #[py(field = 0.3)] gain: f64,
        #[py(field = 1)] settle: u32,
        #[py(field = None)] limit: Option<f64>,
        #[py(= None)] frequency_uncertainty: Option<f64>,
        #[py(= None)] damping_uncertainty: Option<f64>,
    ) -> PyResult<RepetitiveControl> {
        let uncertainty = told(self.0.loop_uncertainty(), frequency_uncertainty, damping_uncertainty);
        let options = RepetitiveOptions { uncertainty, ..options };
        RepetitiveControl::of(self.feedback_loop(dt, (kp, ki))?, period.get(), options)
    }

    /// This stage between converters, with the noise of its sensor: as `plant.Plant`.
    #[gather(converters: Converters)]
    fn plant(
        &self,
        dt: f64,
        #[py(field = 0)] seed: u64,
        #[py(*, field = None)] dac_bits: Option<NonZeroUsize>,
        #[py(field = None)] adc_bits: Option<NonZeroUsize>,
        #[py(field, "Sequence[float] | None" = None)] adc_range: Option<(f64, f64)>,
    ) -> PyResult<Plant> {
        Plant::of(&self.0, dt, &converters)
    }

    /// Lets this stage follow a reference under its own controller: `plant(dt, seed)` and
    /// `controller(dt, limits, feedforward)`.
    ///
    /// `period` of the reference in samples makes `settled` of the run leave out the first.
    #[gather(converters: Converters)]
    fn simulate(
        &self,
        py: Python<'_>,
        #[py("ArrayLike | Trajectory")] reference: &Bound<'_, PyAny>,
        dt: f64,
        #[py(*, "Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(= "preview")] feedforward: OfRecord,
        #[py(= None)] kp: Option<f64>,
        #[py(= None)] ki: Option<f64>,
        #[py(field = 0)] seed: u64,
        #[py(= None)] period: Option<f64>,
        #[py("Callable[[float], object] | None" = None)] progress: Option<Callable>,
    ) -> PyResult<Run> {
        let limits = checked_limits(py, &self.0, limits)?;
        let reference = samples("reference", reference, dt)?;
        let task = TrackingTask::new(&reference, period).map_err(raise)?;
        let gains = self.gains((kp, ki), None, dt)?;
        let mut controller = self.made_controller(py, dt, limits, feedforward.0, gains, &Wishes::default())?;
        let mut plant = Plant::of(&self.0, dt, &converters)?;
        let tracking = Tracking::of(&mut controller.stage_controller);
        tracking.run(&task, &mut plant.plant, watch(py, reference.len(), progress)).map(Run)
    }

    /// The linear part (amplifier, modes) as a `control.StateSpace` of the package control; its dead time is not part
    /// of it.
    #[py(-> "Any")]
    fn to_control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.state_space(py)?.get().to_control(py)
    }

    /// The linear part (amplifier, modes) as a `scipy.signal.StateSpace`; its dead time is not part of it.
    #[py(-> "Any")]
    fn to_scipy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.state_space(py)?.get().to_scipy(py)
    }
}

/// The feed-forward of a controller.
#[derive(Clone, Copy, PartialEq)]
enum Feedforward {
    Inverse,
    Preview,
    Given,
}

impl Words for Feedforward {
    const WORDS: &'static [(&'static str, Self)] =
        &[("inverse", Self::Inverse), ("preview", Self::Preview), ("given", Self::Given)];
    const REFUSES_NONE: bool = true;
}

/// The feed-forward of a controller that follows a record: nothing gives drives beside it.
#[derive(Clone, Copy, PartialEq)]
struct OfRecord(Feedforward);

impl Words for OfRecord {
    const WORDS: &'static [(&'static str, Self)] =
        &[("inverse", Self(Feedforward::Inverse)), ("preview", Self(Feedforward::Preview))];
    const REFUSES_NONE: bool = true;
}

/// Over which time references are smoothed.
#[derive(Clone, Copy, PartialEq)]
enum Smoothing {
    Seconds(f64),
    /// What the modes of the stage need.
    Modes,
}

impl Argument<'_> for Smoothing {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match value.extract::<&str>() {
            Ok("modes") => Ok(Self::Modes),
            Ok(_) => Err(unexpected(name, "seconds or \"modes\"", value)),
            Err(_) => f64::from_argument(name, value).map(Self::Seconds),
        }
    }
}

impl Stage {
    /// The gains that were asked for.
    fn gains(&self, given: (Option<f64>, Option<f64>), tuning: Option<&Bound<'_, Tuning>>, dt: f64) -> PyResult<Gains> {
        match (both(given)?, tuning.map(Bound::get)) {
            (None, None) => Ok(Gains::Tuned),
            (Some(gains), None) => Ok(Gains::Given(gains)),
            (Some(_), Some(_)) => Err(errors::value("tuning", "expected None beside kp and ki")),
            (None, Some(tuning)) => tuning.of_stage(&self.0, dt).map(Gains::Of),
        }
    }

    fn made_controller(
        &self,
        py: Python<'_>,
        dt: f64,
        limits: Option<(f64, f64)>,
        feedforward: Feedforward,
        gains: Gains,
        wishes: &Wishes,
    ) -> PyResult<HybridController> {
        let smoothing = match wishes.smoothing {
            None => 0.0,
            Some(Smoothing::Seconds(seconds)) => seconds,
            Some(Smoothing::Modes) => self.0.smoothing(),
        };
        let (frequency, damping) = (wishes.frequency_uncertainty, wishes.damping_uncertainty);
        if feedforward != Feedforward::Preview {
            let expected = "expected None without feedforward=\"preview\"";
            if wishes.ahead.is_some() {
                return Err(errors::value("ahead", expected));
            }
            if smoothing != 0.0 {
                return Err(errors::value("smoothing", expected));
            }
        }
        for (name, given) in [("frequency_uncertainty", frequency), ("damping_uncertainty", damping)] {
            if wishes.period.is_none() && given.is_some() {
                return Err(errors::value(name, "expected None without period; for gains alone ask stage.tune"));
            }
        }
        let uncertainty = told(self.0.loop_uncertainty(), frequency, damping);
        let options = match gains {
            Gains::Given(gains) => self.0.controller_options_with_gains(dt, limits, gains),
            Gains::Of(tuning) => self.0.controller_options_of(&tuning, dt, limits),
            Gains::Tuned => self.0.tuning_options(dt, PEAK_SENSITIVITY).and_then(|mut asked| {
                asked.uncertainty = uncertainty.modes;
                self.0.controller_options_tuned(&asked, limits)
            }),
        };
        let options =
            ControllerOptions { max_measurement_step: wishes.max_measurement_step, ..options.map_err(raise)? };
        let source = match feedforward {
            Feedforward::Inverse | Feedforward::Preview => {
                let amplifier = feedforward == Feedforward::Preview;
                let inverse = StageInverse::made(&self.0, dt, Some(options.limits), amplifier)?;
                Bound::new(py, inverse)?.into_any()
            }
            Feedforward::Given => PyString::new(py, feedforward.word()).into_any(),
        };
        let preview = match feedforward {
            Feedforward::Preview => {
                let preview = self.made_preview(dt, &PreviewOptions::new(self.ahead(wishes.ahead, dt)?))?;
                Some(Py::new(py, if smoothing == 0.0 { preview } else { preview.behind_smoothing(smoothing)? })?)
            }
            _ => None,
        };
        let observer =
            wishes.drift.map(|drift| Py::new(py, Observer::of(self.0.clone(), dt, drift, None)?)).transpose()?;
        let repetitive = wishes.period.map(|period| {
            let feedback = self.0.feedback_loop(dt, (options.kp, options.ki), options.filters).map_err(raise)?;
            let learning = RepetitiveOptions { uncertainty, ..RepetitiveOptions::default() };
            Py::new(py, RepetitiveControl::of(feedback, period.get(), learning)?)
        });
        HybridController::of(Some(&source), preview, &options)?.with_parts(py, observer, repetitive.transpose()?)
    }
}

/// What is asked of a controller besides, as it was given.
#[derive(Default)]
struct Wishes {
    ahead: Option<SampleCount>,
    smoothing: Option<Smoothing>,
    drift: Option<f64>,
    period: Option<NonZeroUsize>,
    frequency_uncertainty: Option<f64>,
    damping_uncertainty: Option<f64>,
    max_measurement_step: Option<f64>,
}

/// The gains of a controller.
enum Gains {
    Tuned,
    /// kp and ki, without filters.
    Given((f64, f64)),
    Of(tuning::Tuning),
}

/// Gains are found together: one of them beside a tuned other one may make the loop unstable.
fn both(gains: (Option<f64>, Option<f64>)) -> PyResult<Option<(f64, f64)>> {
    match gains {
        (Some(kp), Some(ki)) => Ok(Some((kp, ki))),
        (None, None) => Ok(None),
        (Some(kp), None) => Err(errors::value("ki", format_args!("expected a number beside kp = {kp:?}, got None"))),
        (None, Some(ki)) => Err(errors::value("kp", format_args!("expected a number beside ki = {ki:?}, got None"))),
    }
}
