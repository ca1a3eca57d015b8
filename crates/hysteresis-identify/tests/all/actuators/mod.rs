//! Actuators and signals that the tests share.

pub(crate) mod bouc_wen;

use std::f64::consts::PI;
use std::ops::ControlFlow;

use hysteresis_control::linear::{Block, Creep, Dynamics};
use hysteresis_core::{CoupledPlay, Model, ModifiedPrandtlIshlinskii, Offsets, Operator, Ratios};
use hysteresis_identify::{Error, Identification, Options, Record, identify};

/// The paper's actuator: weights (um/V) from four numbers, thresholds every 25 V.
pub(crate) fn paper_actuator(offsets: Offsets) -> ModifiedPrandtlIshlinskii {
    let weight = |i: f64| if i == 0.0 { 4.257_122e-3 } else { 3.820_371e-4 - 5.169_023e-5 * i + 2.519_876e-6 * i * i };
    let index: Vec<f64> = (0..20).map(f64::from).collect();
    let weights: Vec<f64> = index.iter().map(|i| weight(*i)).collect();
    let r: Vec<f64> = index.iter().map(|i| 25.0 * i).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, offsets).unwrap()
}

/// Decaying triangle about `centre`, so that every operator reverses at many places.
pub(crate) fn decaying_triangle(samples: u32, amplitude: f64, periods: f64, centre: f64) -> Vec<f64> {
    let triangle = |phase: f64| (2.0 * PI * phase).sin().asin() * 2.0 / PI;
    (0..samples)
        .map(|k| f64::from(k) / f64::from(samples))
        .map(|share| centre + amplitude * (1.0 - share) * triangle(share * periods))
        .collect()
}

/// The output of the model by the operators of the core, in plain loops: the oracle.
///
/// The whole trace first, then the delay by interpolation of the outputs.
pub(crate) fn output(model: &ModifiedPrandtlIshlinskii, input: &[f64], delay: f64) -> Vec<f64> {
    let mut z = vec![0.0; model.weights().len()];
    let operators: &[CoupledPlay] = model.operators();
    let trace: Vec<f64> = input
        .iter()
        .map(|u| {
            for (z, operator) in z.iter_mut().zip(operators) {
                *z = operator.next(*z, u - model.offsets().input);
            }
            model.offsets().output + z.iter().zip(model.weights()).map(|(z, w)| z * w).sum::<f64>()
        })
        .collect();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small and positive")]
    let whole = delay as usize;
    let held = |k: usize, back: usize| trace[k.saturating_sub(back)];
    (0..input.len()).map(|k| held(k, whole) + delay.fract() * (held(k, whole + 1) - held(k, whole))).collect()
}

/// Deterministic noise, uniform with this root mean square.
pub(crate) fn noise(samples: usize, rms: f64, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).unwrap()) / f64::from(u32::MAX) - 0.5
    };
    (0..samples).map(|_| next() * rms * 12.0_f64.sqrt()).collect()
}

/// Identification without anybody watching.
pub(crate) fn run(records: &[Record<'_>], options: &Options) -> Result<Identification, Error> {
    identify(records, options, &mut |_| ControlFlow::Continue(()))
}

pub(crate) fn weights(found: &Identification) -> &[f64] {
    match &found.model {
        Model::Modified(model) => model.weights(),
        Model::Conventional(model) => model.weights(),
    }
}

pub(crate) fn input_offset(found: &Identification) -> f64 {
    match &found.model {
        Model::Modified(model) => model.offsets().input,
        Model::Conventional(model) => model.offsets().input,
    }
}

/// The dead time of records without a sampling interval.
pub(crate) fn samples(found: &Identification) -> f64 {
    found.dead_time_samples.unwrap()
}

/// The linear part of a stage, behind its hysteresis.
pub(crate) struct Behind {
    pub(crate) creep: Option<Creep>,
    pub(crate) dynamics: Option<Dynamics>,
    /// In samples, to a twentieth.
    pub(crate) dead_time: f64,
}

/// The rows of a stage that was at rest at its first drive since forever, in plain loops: creep at the samples, then
/// the dynamics in twenty steps a sample, of which that of the dead time is read.
pub(crate) fn stage_output(model: &ModifiedPrandtlIshlinskii, behind: &Behind, dt: f64, input: &[f64]) -> Vec<f64> {
    const STEPS: usize = 20;
    let hysteresis = output(model, input, 0.0);
    let mut q = vec![hysteresis[0]; behind.creep.as_ref().map_or(0, |creep| creep.amplitudes().len())];
    let mut crept = hysteresis.clone();
    if let Some(creep) = &behind.creep {
        for (p, h) in crept.iter_mut().zip(&hysteresis) {
            for ((q, c), tau) in q.iter_mut().zip(creep.amplitudes()).zip(creep.time_constants()) {
                *p += c * *q;
                *q += (1.0 - (-dt / tau).exp()) * (h - *q);
            }
        }
    }
    let Some(dynamics) = behind.dynamics else { return crept };
    let mut block = dynamics.block(dt / 20.0).unwrap();
    let mut position = block.settle(crept[0]);
    let mut fine = Vec::with_capacity(STEPS * crept.len());
    for p in &crept {
        for _ in 0..STEPS {
            fine.push(position);
            position = block.advance(*p);
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "a few samples")]
    let back = (behind.dead_time * 20.0).round() as isize;
    let last = fine.len() - 1;
    let at = |k: usize| fine[(k * STEPS).saturating_add_signed(-back).min(last)];
    (0..crept.len()).map(at).collect()
}
