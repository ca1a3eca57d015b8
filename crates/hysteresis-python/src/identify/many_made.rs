//! Results of many actuators, made of what was found and put together.

use hysteresis_core::{self as core, Model, Offsets, Ratios};
use hysteresis_identify::{self as identification, ActuatorFit, Error, ManyIdentifications as Found, Setting};

use super::many_result::ManyIdentifications;
use crate::argument::Words;
use crate::convert::errors::record;

/// The operators of a model, as arrays.
struct Parts {
    weights: Vec<f64>,
    weights_negative: Vec<f64>,
    thresholds: Vec<f64>,
    offsets: Offsets,
}

impl Parts {
    fn of(model: &Model) -> Self {
        match model {
            Model::Conventional(model) => Self {
                weights: model.weights().to_vec(),
                weights_negative: model.weights().to_vec(),
                thresholds: model.operators().iter().map(core::Play::r).collect(),
                offsets: model.offsets(),
            },
            Model::Modified(model) => Self {
                weights: model.weights().to_vec(),
                weights_negative: model.weights_negative().to_vec(),
                thresholds: model.operators().iter().map(core::CoupledPlay::r).collect(),
                offsets: model.offsets(),
            },
        }
    }
}

impl ManyIdentifications {
    /// What was found in one call.
    pub(super) fn new(found: &Found, dt: Option<f64>) -> Self {
        let options = &found.options;
        let smoothness = match options.smoothness {
            Setting::Fixed(smoothness) => smoothness,
            Setting::Fit => 0.0,
        };
        let mut all =
            Self::empty(options.model == identification::ModelKind::Modified, options.weights.word(), smoothness, dt);
        for (place, fit) in found.actuators.iter().enumerate() {
            all.push(place, fit, options.operators());
        }
        all
    }

    fn empty(is_modified: bool, law: &str, smoothness: f64, dt: Option<f64>) -> Self {
        Self {
            is_modified,
            law: law.to_owned(),
            smoothness,
            dt,
            actuators: 0,
            weights: Vec::new(),
            weights_negative: Vec::new(),
            thresholds: Vec::new(),
            ratios: Vec::new(),
            input_offsets: Vec::new(),
            output_offsets: Vec::new(),
            dead_times: Vec::new(),
            rmse: Vec::new(),
            max_errors: Vec::new(),
            ranges: Vec::new(),
            noise: Vec::new(),
            findings: Vec::new(),
            errors: Vec::new(),
        }
    }

    fn push(&mut self, place: usize, fit: &Result<ActuatorFit, Error>, operators: usize) {
        self.actuators += 1;
        let nothing = || vec![f64::NAN; operators];
        let (parts, numbers, findings) = match fit {
            Ok(fit) => {
                let Ratios { ra, rb, rc } = fit.ratios;
                let brief = |found: &identification::BriefFinding| {
                    (found.code.name().to_owned(), found.severity.name().to_owned(), found.value)
                };
                let numbers = [ra, rb, rc, fit.dead_time, fit.rmse, fit.max_error, fit.range, fit.noise];
                (Parts::of(&fit.model), numbers, fit.findings.iter().map(brief).collect())
            }
            Err(error) => {
                self.errors.push((place, reason(place, *error)));
                let offsets = Offsets { input: f64::NAN, output: f64::NAN };
                let parts = Parts { weights: nothing(), weights_negative: nothing(), thresholds: nothing(), offsets };
                (parts, [f64::NAN; 8], Vec::new())
            }
        };
        self.weights.extend(parts.weights);
        self.weights_negative.extend(parts.weights_negative);
        self.thresholds.extend(parts.thresholds);
        self.input_offsets.push(parts.offsets.input);
        self.output_offsets.push(parts.offsets.output);
        let [ra, rb, rc, dead_time, rmse, max_error, range, noise] = numbers;
        self.ratios.extend([ra, rb, rc]);
        self.dead_times.push(dead_time);
        self.rmse.push(rmse);
        self.max_errors.push(max_error);
        self.ranges.push(range);
        self.noise.push(noise);
        self.findings.push(findings);
    }

    /// The same with the actuators of another result behind its own.
    pub(super) fn followed_by(mut self, other: &Self) -> Self {
        self.errors.extend(other.errors.iter().map(|(place, reason)| {
            let there = self.actuators + place;
            (there, reason.replacen(&named(*place), &named(there), 1))
        }));
        self.actuators += other.actuators;
        self.weights.extend(&other.weights);
        self.weights_negative.extend(&other.weights_negative);
        self.thresholds.extend(&other.thresholds);
        self.ratios.extend(&other.ratios);
        self.input_offsets.extend(&other.input_offsets);
        self.output_offsets.extend(&other.output_offsets);
        self.dead_times.extend(&other.dead_times);
        self.rmse.extend(&other.rmse);
        self.max_errors.extend(&other.max_errors);
        self.ranges.extend(&other.ranges);
        self.noise.extend(&other.noise);
        self.findings.extend(other.findings.iter().cloned());
        self
    }
}

fn named(actuator: usize) -> String {
    format!("actuator {actuator}: ")
}

/// Why an actuator could not be fitted, in the words of Python.
fn reason(actuator: usize, error: Error) -> String {
    match error {
        Error::Record { error, .. } => format!("{}{}", named(actuator), record(error)),
        error => format!("{}{error}", named(actuator)),
    }
}
