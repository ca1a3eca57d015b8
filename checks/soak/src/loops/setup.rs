//! Stages, filters, previews and options at random.

use core::error::Error;

use hysteresis_control::feedforward::smoothing_kernel;
use hysteresis_control::filters::{FeedbackFilter, Lead, LowPass, Notch, sections};
use hysteresis_control::linear::{Creep, FirstOrder, LinearDynamics, Modes, SecondOrder};
use hysteresis_control::stage::{LoopShift, SlowGain, Stage, StageParts};
use hysteresis_core::{
    AntiWindup, ControllerOptions, FeedForward, HybridController, Law, ModifiedPrandtlIshlinskii, Offsets, Preview,
    Ratios, Sections,
};

use crate::signal::Random;

/// The sampling interval of all loops, in seconds.
pub(super) const DT: f64 = 1e-4;

/// The largest drive, in V.
const REACH: f64 = 500.0;

/// A hysteresis of some 6 um over the reach.
fn hysteresis(random: &mut Random) -> Result<ModifiedPrandtlIshlinskii, hysteresis_core::Error> {
    let operators = 1 + random.below(12);
    let mut r: Vec<f64> = (0..operators).map(|_| random.between(0.0, 450.0)).collect();
    r[0] = 0.0;
    r.sort_by(f64::total_cmp);
    let weights: Vec<f64> = (0..operators).map(|i| if i == 0 { 4e-3 } else { 1e-3 * random.unit() }).collect();
    let input = 50.0 * random.signed();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets { input, output: random.signed() })
}

fn dynamics(random: &mut Random) -> Result<LinearDynamics, hysteresis_core::Error> {
    let mut mode = || SecondOrder::new(random.between(100.0, 3000.0), 10_f64.powf(random.between(-2.0, 0.3)));
    let modes = [mode()?, mode()?];
    Ok(match random.below(4) {
        0 => LinearDynamics::none(),
        1 => FirstOrder::new(random.between(50.0, 2000.0))?.into(),
        2 => modes[0].into(),
        _ => Modes::new(&[0.8, 0.2], &modes)?.into(),
    })
}

/// Limits that any reference of [`crate::Mixed`] comes to, often.
pub(super) fn limits(random: &mut Random) -> (f64, f64) {
    let (one, other) = (random.between(-REACH, 0.0), random.between(20.0, REACH));
    if random.once_in(4.0) { (one + 520.0, other + 540.0) } else { (one, other) }
}

/// A stage with any of its parts.
pub(super) fn stage(random: &mut Random) -> Result<Stage, Box<dyn Error>> {
    let set = StageParts::new(hysteresis(random)?);
    let some = |random: &mut Random| random.once_in(3.0);
    let creep = some(random).then(|| Creep::new(&[0.02, 0.03], &[0.05, 2.0])).transpose()?;
    let shift = some(random).then(|| LoopShift::new(0.0, REACH, [-0.3, 0.2], 0.01, 0.5)).transpose()?;
    let slow_gain = some(random).then(|| SlowGain::new(REACH, -0.02, 0.0, 1.0)).transpose()?;
    let frequency = random.between(100.0, 3000.0);
    let amplifier = some(random).then(|| FirstOrder::new(frequency)).transpose()?;
    let parts = StageParts { dynamics: dynamics(random)?, creep, loop_shift: shift, slow_gain, amplifier, ..set };
    Ok(Stage::new(StageParts { dead_time: 6.0 * DT * random.unit() * random.unit(), ..parts })?)
}

/// Up to three sections before the gains.
pub(super) fn filters(random: &mut Random) -> Result<Sections, hysteresis_core::Error> {
    let frequency = random.between(50.0, 1600.0);
    let damping = 10_f64.powf(random.between(-1.5, 0.5));
    let all: [FeedbackFilter; 3] = [
        Notch::new(frequency, 0.1 * damping, damping)?.into(),
        LowPass::new(frequency, random.once_in(2.0).then_some(damping))?.into(),
        Lead::new(frequency, 3.0 * frequency)?.into(),
    ];
    let first = random.below(4);
    sections(&all[first.min(3)..], DT)
}

/// Options that need not suit the stage: gains from none to far beyond where the loop is stable.
pub(super) fn options(random: &mut Random) -> Result<ControllerOptions, hysteresis_core::Error> {
    let filters = filters(random)?;
    let sign = if filters.as_slice().is_empty() || !random.once_in(4.0) { 1.0 } else { -1.0 };
    let kp = if random.once_in(3.0) { 0.0 } else { sign * 10_f64.powf(random.between(-1.0, 4.0)) };
    let ki = if random.once_in(4.0) { 0.0 } else { 10_f64.powf(random.between(1.0, 7.0)) };
    let back = AntiWindup::BackCalculation { tracking_time: random.once_in(2.0).then_some(3e-3) };
    Ok(ControllerOptions {
        slew: (!random.once_in(5.0)).then(|| 10_f64.powf(random.between(3.0, 7.0))),
        law: if random.once_in(4.0) { Law::Incremental } else { Law::Positional },
        anti_windup: if random.once_in(3.0) { back } else { AntiWindup::Conditional },
        bumpless_time: if random.once_in(3.0) { 0.0 } else { 5e-3 },
        max_missing: [0, 1, 10, 1000][random.below(4)],
        measurement_range: random.once_in(2.0).then_some((-20.0, 20.0)),
        max_measurement_step: random.once_in(3.0).then_some(1.0),
        filters,
        ..ControllerOptions::new(kp, ki, DT, limits(random))
    })
}

/// None, a window, or a window of smoothed references.
pub(super) fn preview(random: &mut Random) -> Result<Option<Preview>, hysteresis_core::Error> {
    if random.once_in(2.0) {
        return Ok(None);
    }
    let size = 1 + random.below(6);
    let coefficients: Vec<f64> = (0..size).map(|_| 3.0 * random.signed()).collect();
    let preview = Preview::new(&coefficients, size / 2)?;
    if random.once_in(3.0) {
        return Ok(Some(preview));
    }
    Ok(Some(preview.smoothed(&smoothing_kernel(random.between(3e-4, 5e-3), DT)?)?))
}

/// A controller of a stage, at rest: the same one again for the same arguments.
pub(super) fn controller(
    stage: &Stage,
    preview: Option<&Preview>,
    options: &ControllerOptions,
) -> Result<HybridController, Box<dyn Error>> {
    let source: FeedForward = stage.inverse(options.dt, Some(options.limits))?.into();
    Ok(HybridController::new(source, preview.cloned(), options)?)
}
