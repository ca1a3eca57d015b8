//! The linear part behind a known hysteresis model: the cascade of Remark 1 of the paper.

use std::ops::ControlFlow;

use hysteresis_control::linear::{Creep, Dynamics};
use hysteresis_core::{CompiledModel, Forward, Process};

use crate::error::{Error, RecordError};
use crate::fit::progress::Stop;
use crate::identify::identify;
use crate::judge::finding::{Finding, Verdict};
use crate::judge::finding_code::FindingCode;
use crate::options::{Options, Setting};
use crate::records::record::{Record, check_finite};
use crate::result::identification::Identification;
use crate::result::quality::Quality;
use crate::terms::creep::CreepModel;
use crate::terms::dynamics::{DynamicsModel, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::operators::{ModelKind, Thresholds};
use crate::terms::weights::WeightLaw;
use crate::uncertainty::standard_errors::{Covariance, StandardErrors};

/// The options of [`identify_dynamics`](crate::identify_dynamics).
///
/// ```
/// use hysteresis_identify::{DynamicsOptions, Order, Setting};
/// let options = DynamicsOptions { dead_time: Setting::Fixed(1e-4), ..DynamicsOptions::new(1e-4) };
/// assert_eq!(options.order, Order::Second);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicsOptions {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Which dynamics.
    pub order: Order,
    /// What the output lags the input besides, in seconds: as [`Options::dead_time`].
    pub dead_time: Setting<f64>,
    /// Which creep.
    pub creep: CreepModel,
}

impl DynamicsOptions {
    /// Second-order dynamics and a dead time, both searched, without creep.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self { dt, order: Order::default(), dead_time: Setting::Fit, creep: CreepModel::None }
    }

    /// The options of a joint identification in which the output of the known hysteresis is the input: one operator,
    /// the identity, whose weight is the gain.
    pub(crate) fn joint(&self) -> Options {
        Options {
            model: ModelKind::Conventional,
            weights: WeightLaw::Free,
            thresholds: Thresholds::Given(vec![0.0]),
            input_offset: Setting::Fixed(0.0),
            dt: Some(self.dt),
            dynamics: DynamicsModel::Order(self.order),
            dead_time: self.dead_time,
            creep: self.creep.clone(),
            loop_shift: LoopShiftModel::None,
            smoothness: Setting::Fixed(0.0),
            ..Options::default()
        }
    }
}

/// How far the gain may be from 1.
const MAX_GAIN_ERROR: f64 = 0.05;

/// Identified dynamics, and how well they fit.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DynamicsIdentification {
    /// The hysteresis model that was given.
    #[cfg_attr(feature = "serde", serde(skip, default = "crate::saved::no_model"))]
    pub model: CompiledModel,
    /// The sampling interval of the record in seconds.
    pub dt: f64,
    /// The lag or second-order dynamics, of unit static gain; none if the record shows none.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::dynamics"))]
    pub dynamics: Option<Dynamics>,
    /// What the output lags the input besides, in seconds.
    pub dead_time: f64,
    /// How much later slow motion is seen: dead time and lag of the dynamics together, in seconds. Without
    /// dynamics the dead time makes up for the held input, too: half a sampling interval.
    pub lag: f64,
    /// The creep, if it was asked for.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::creep"))]
    pub creep: Option<Creep>,
    /// The searched amplitudes of creep: gamma, the share per decade, of log-type creep; else every c_j.
    pub creep_amplitudes: Vec<f64>,
    /// What multiplies the model's output: 1 if the model is right.
    pub gain: f64,
    /// What is added to gain times the model's output, in the unit of the output.
    pub output_offset: f64,
    /// The standard deviation of the noise, from the residuals, in the unit of the output.
    pub noise: f64,
    /// Standard errors, also for coloured noise: that of the gain is the one of `weights`.
    pub standard_errors: StandardErrors,
    /// The covariance of everything that was estimated, by name.
    pub covariance: Covariance,
    /// What to know before the numbers are used.
    pub warnings: Vec<Finding>,
    /// The quality over the fitted samples.
    pub fit: Quality,
    /// How many passes over the record the search took.
    pub evaluations: usize,
    found: Identification,
}

impl DynamicsIdentification {
    /// Whether the result deserves trust: the worst of its [`warnings`](Self::warnings).
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.warnings)
    }

    /// The output for an input that starts from the virgin state and at rest at its first value:
    /// `output_offset` + `gain` dynamics(creep(model(input))), `dead_time` later.
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict(&self, input: &[f64]) -> Result<Vec<f64>, RecordError> {
        check_finite("input", input)?;
        self.found.predict(&hysteresis_output(&self.model, input))
    }
}

/// Fits the linear part of the cascade hysteresis - creep - dynamics - dead time to a record, for a known hysteresis
/// model.
///
/// It is the joint fit of [`identify`](crate::identify()) with the output of the known model in place of the operators'
/// and one weight, the gain: the equations are those. The record starts at rest at its first value: start a step record
/// a sample or more before the step.
///
/// The sum of squared output errors over the fitted samples is minimised. Gain and offset enter linearly and are exact
/// at every point; frequency, damping, dead time and creep go from the best minima of a grid, ten per cent apart in
/// frequency, to bounded Gauss-Newton steps. Standard errors allow for coloured noise; the [`Finding`]s in `warnings`
/// tell what makes the numbers doubtful. A record that does not reach the resonance gives a finding, not an error: what
/// the numbers are worth then is in their standard errors.
///
/// `proceed` is called after every pass over the record; [`ControlFlow::Break`] stops.
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_control::linear::{Block, Dynamics, SecondOrder};
/// use hysteresis_core::{CompiledModel, Process};
/// use hysteresis_identify::{DynamicsOptions, Record, identify_dynamics};
/// use hysteresis_simulate::paper;
///
/// let actuator = paper::table_1_recovered();
/// let (mut hysteresis, mut stage) = (actuator.forward(), SecondOrder::new(800.0, 0.05)?.block(1e-4)?);
/// let input: Vec<f64> = (0..500).map(|k| if k < 10 { 0.0 } else { 400.0 }).collect(); // a step of 400 V
/// let mut position = stage.settle(0.0);
/// let output: Vec<f64> = input
///     .iter()
///     .map(|u| std::mem::replace(&mut position, stage.advance(hysteresis.step(*u)))) // read as u is put out
///     .collect();
///
/// let record = Record::new(&input, &output, 0)?;
/// let options = DynamicsOptions::new(1e-4);
/// let model = CompiledModel::new(&actuator);
/// let found = identify_dynamics(&record, &model, &options, &mut || ControlFlow::Continue(()))?;
/// let Some(Dynamics::SecondOrder(resonance)) = found.dynamics else { unreachable!() };
/// assert!((resonance.frequency() - 800.0).abs() < 1e-3 && (resonance.damping() - 0.05).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Core`] for a bad sampling interval, dead time or creep, [`Error::Record`] if the model's output does not
/// vary, [`Error::TooFewSamples`] for fewer fitted samples than twice the unknowns, [`Error::Interrupted`] when
/// `proceed` said so.
pub fn identify_dynamics(
    record: &Record<'_>,
    model: &CompiledModel,
    options: &DynamicsOptions,
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<DynamicsIdentification, Error> {
    let hysteresis = hysteresis_output(model, record.input());
    let cascade = Record::new(&hysteresis, record.output(), record.skip()).map_err(|error| {
        let named = match error {
            RecordError::Constant { .. } | RecordError::SmallRange { .. } => error.renamed(|_| "output of the model"),
            error => error,
        };
        named.in_record(0)
    })?;
    let mut progress = |_: &_| match proceed() {
        ControlFlow::Continue(()) => ControlFlow::Continue(()),
        ControlFlow::Break(()) => ControlFlow::Break(Stop::Discard),
    };
    let found = identify(&[cascade], &options.joint(), &mut progress)?;
    let gain = found.chain.weights[0];
    let mut covariance = found.covariance.clone();
    for name in covariance.parameters.iter_mut().filter(|name| *name == "weights[0]") {
        "gain".clone_into(name);
    }
    Ok(DynamicsIdentification {
        model: model.clone(),
        dt: options.dt,
        dynamics: found.dynamics,
        dead_time: found.chain.linear.dead_time,
        lag: found.lag,
        creep: found.creep.clone(),
        creep_amplitudes: found.creep_amplitudes.clone(),
        gain,
        output_offset: found.output_offsets[0],
        noise: found.noise,
        standard_errors: found.standard_errors.clone(),
        covariance,
        warnings: warnings(&found, gain),
        fit: found.fit,
        evaluations: found.evaluations,
        found,
    })
}

/// Of the findings those about the linear part: there is one operator, and its weight is the gain.
fn warnings(found: &Identification, gain: f64) -> Vec<Finding> {
    let value = (gain - 1.0).abs();
    let message = format!("the output is {gain:.3} times what the hysteresis model predicts");
    let gain = (value > MAX_GAIN_ERROR).then(|| Finding::new(FindingCode::GainNotOne, value, MAX_GAIN_ERROR, message));
    found.warnings.iter().filter(|finding| finding.code.is_of_linear_part()).cloned().chain(gain).collect()
}

/// The output of the model from the virgin state.
fn hysteresis_output(model: &CompiledModel, input: &[f64]) -> Vec<f64> {
    let mut stream = Forward::new(model);
    input.iter().map(|u| stream.step(*u)).collect()
}
