//! From a record and a hysteresis model to the linear part behind it.

use std::ops::ControlFlow;

use hysteresis_control::linear::{Block, Creep, Delay, Dynamics, FirstOrder};
use hysteresis_core::{CompiledModel, Forward, Process};

use super::findings::findings;
use super::options::{DynamicsOptions, Order};
use super::response::{LinearParameter, ResponseFit, ResponseProblem};
use super::search::{PassCounter, SearchDomain, search};
use super::uncertainty::Uncertainty;
use crate::error::{Error, RecordError};
use crate::finding::Finding;
use crate::options::Setting;
use crate::record::{Record, check_finite};
use crate::result::quality::Quality;

/// Identified dynamics, and how well they fit.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct DynamicsIdentification {
    /// The hysteresis model that was given.
    pub model: CompiledModel,
    /// The sampling interval of the record in seconds.
    pub dt: f64,
    /// The lag or second-order dynamics, of unit static gain.
    pub dynamics: Dynamics,
    /// By how many samples the output lags the input besides, fractions included.
    pub delay: f64,
    /// The creep, if it was asked for.
    pub creep: Option<Creep>,
    /// What multiplies the model's output: 1 if the model is right.
    pub gain: f64,
    /// What is added to gain times the model's output, in the unit of the output.
    pub output_offset: f64,
    /// Standard deviations and covariance.
    pub uncertainty: Uncertainty,
    /// What to know before the numbers are used.
    pub warnings: Vec<Finding>,
    /// The quality over the fitted samples.
    pub fit: Quality,
    /// How many passes over the record the search took.
    pub evaluations: usize,
}

impl DynamicsIdentification {
    /// The output for an input that starts from the virgin state and at rest at its first value:
    /// `output_offset` + `gain` creep(dynamics(delay(model(input)))).
    ///
    /// # Errors
    /// [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100.
    pub fn predict(&self, input: &[f64]) -> Result<Vec<f64>, Error> {
        check_finite("input", input).map_err(|error| error.in_record(0))?;
        let mut output = hysteresis_output(&self.model, input);
        let Some(first) = output.first().copied() else { return Ok(output) };
        let mut delay = Delay::new(self.delay * self.dt)?.block(self.dt)?;
        let mut dynamics = self.dynamics.block(self.dt)?;
        let mut creep = self.creep.as_ref().map(|creep| creep.block(self.dt)).transpose()?;
        delay.settle(first);
        dynamics.settle(first);
        if let Some(creep) = &mut creep {
            creep.settle(first);
        }
        for y in &mut output {
            let position = dynamics.advance(delay.advance(*y));
            let position = creep.as_mut().map_or(position, |creep| creep.advance(position));
            *y = self.output_offset + self.gain * position;
        }
        Ok(output)
    }
}

/// Fits the linear part of the cascade hysteresis - delay - dynamics - creep to a record, for a known hysteresis model.
///
/// y(k) = `output_offset` + `gain` (1 + sum_i c_i lag_i) G v(k - delay), v the output of `model` for the record's input
/// from the virgin state. G is second-order (natural frequency, damping) or a first-order lag, discretised exactly for
/// an input held between samples; lag_i are first-order lags of known time constants. v is at rest at its first value
/// before the record: start a step record a sample or more before the step. The position that belongs to a sample is
/// that at the end of its interval (see [`hysteresis_control::linear`]): an output that is measured when the input is
/// put out has a delay of 1.
///
/// The sum of squared output errors over the fitted samples is minimised. Gain, offset and creep enter linearly and are
/// exact at every point (QR, as in [`identify`](crate::identify)); frequency, damping and delay go from the best minima
/// of a grid, ten per cent apart in frequency, to bounded Gauss-Newton steps. Standard deviations assume white noise;
/// the [`Finding`]s in `warnings` tell what makes the numbers doubtful. A record that does not reach the resonance gives a warning, not an
/// error: what the numbers are worth then is in their standard deviations.
///
/// `proceed` is called after every pass over the record; [`ControlFlow::Break`] stops.
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_core::{CompiledModel, Process};
/// use hysteresis_simulate::paper;
/// use hysteresis_identify::{DynamicsOptions, Record, identify_dynamics};
/// use hysteresis_control::linear::{Block, Dynamics, SecondOrder};
///
/// let actuator = paper::table_1_recovered();
/// let (mut hysteresis, mut stage) = (actuator.forward(), SecondOrder::new(800.0, 0.05)?.block(1e-4)?);
/// let input: Vec<f64> = (0..500).map(|k| if k < 10 { 0.0 } else { 400.0 }).collect(); // a step of 400 V
/// let output: Vec<f64> = input.iter().map(|u| stage.advance(hysteresis.step(*u))).collect();
///
/// let record = Record::new(&input, &output, 0)?;
/// let options = DynamicsOptions::new(1e-4);
/// let found = identify_dynamics(&record, &CompiledModel::new(&actuator), &options, &mut || ControlFlow::Continue(()))?;
/// let Dynamics::SecondOrder(found) = found.dynamics else { unreachable!() };
/// assert!((found.frequency() - 800.0).abs() < 1e-3 && (found.damping() - 0.05).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Domain`] for a bad sampling interval, delay or creep, [`Error::Record`] if the model's output does not vary,
/// [`Error::TooFewSamples`] for fewer fitted samples than twice the unknowns, [`Error::Interrupted`] when `proceed` said
/// so.
pub fn identify_dynamics(
    record: &Record<'_>,
    model: &CompiledModel,
    options: &DynamicsOptions,
    proceed: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<DynamicsIdentification, Error> {
    options.check(record)?;
    let hysteresis = hysteresis_output(model, record.input());
    let first = hysteresis[0];
    let time_constants = options.time_constants(record)?;
    let problem = problem(record, options, &hysteresis, &time_constants)?;
    if record.fitted_samples() < 2 * problem.unknowns() {
        return Err(Error::TooFewSamples { expected: 2 * problem.unknowns(), got: record.fitted_samples() });
    }
    if problem.input.iter().all(|v| *v == 0.0) {
        return Err(RecordError::Constant { argument: "output of the model", value: first }.in_record(0));
    }
    let domain = SearchDomain::new(record.input().len(), options.dt, options.delay);
    let mut monitor = PassCounter::new(proceed);
    let (fit, cell) = search(&problem, &domain, &mut monitor)?;
    let uncertainty = Uncertainty::new(&problem, &fit, &problem.linearise(&fit, cell)?, first);
    let (residuals, range) = (problem.residuals(&fit)?, record.output_range());
    let warnings = findings(&problem, &domain, &fit, &uncertainty, &residuals, range)?;
    let steady: f64 = fit.coefficients[1..].iter().sum();
    Ok(DynamicsIdentification {
        model: model.clone(),
        dt: options.dt,
        dynamics: fit.point.dynamics(options.order)?,
        delay: fit.point.get(LinearParameter::Delay),
        creep: creep(&fit, &time_constants)?,
        gain: fit.coefficients[1],
        output_offset: problem.reference + fit.coefficients[0] - steady * first,
        uncertainty,
        warnings,
        fit: Quality::of(&residuals, &vec![0.0; residuals.len()], range),
        evaluations: monitor.evaluations,
    })
}

fn problem<'a>(
    record: &Record<'a>,
    options: &DynamicsOptions,
    hysteresis: &[f64],
    time_constants: &[f64],
) -> Result<ResponseProblem<'a>, Error> {
    let mut axes = vec![LinearParameter::LogFrequency];
    if options.order == Order::Second {
        axes.push(LinearParameter::LogDamping);
    }
    if options.delay == Setting::Fit {
        axes.push(LinearParameter::Delay);
    }
    let lags = time_constants.iter().map(|tau| FirstOrder::from_time_constant(*tau)).collect::<Result<_, _>>()?;
    Ok(ResponseProblem {
        order: options.order,
        dt: options.dt,
        input: hysteresis.iter().map(|v| v - hysteresis[0]).collect(),
        output: record.output(),
        reference: record.output()[0],
        skip: record.skip(),
        lags,
        axes,
    })
}

/// The creep at a fit, if any was asked for.
fn creep(fit: &ResponseFit, time_constants: &[f64]) -> Result<Option<Creep>, Error> {
    if time_constants.is_empty() {
        return Ok(None);
    }
    let amplitudes: Vec<f64> = fit.coefficients[2..].iter().map(|product| product / fit.coefficients[1]).collect();
    Ok(Some(Creep::new(&amplitudes, time_constants)?))
}

/// The output of the model from the virgin state.
fn hysteresis_output(model: &CompiledModel, input: &[f64]) -> Vec<f64> {
    let mut stream = Forward::new(model);
    input.iter().map(|u| stream.step(*u)).collect()
}
