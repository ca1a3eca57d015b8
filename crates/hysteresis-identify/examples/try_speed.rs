//! Try.
use std::ops::ControlFlow;
use hysteresis_identify::*;
use hysteresis_control::stage::*;
use hysteresis_control::linear::*;
use hysteresis_core::*;
fn main() {
    let n = 20;
    let r: Vec<f64> = (0..n).map(|i| 25.0 * f64::from(i)).collect();
    let w: Vec<f64> = (0..n).map(|i| if i == 0 { 4.26e-3 } else { 1.9e-4 }).collect();
    let model = ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PAPER, Offsets::default()).unwrap();
    let stage = Stage::new(StageParts { dynamics: SecondOrder::new(400.0, 0.3).unwrap().into(), creep: Some(Creep::logarithmic(0.012, 0.01, 100.0, 8).unwrap()), dead_time: 1e-3, ..StageParts::new(model) }).unwrap();
    let dt = 1e-3;
    let mut f = stage.forward(dt).unwrap();
    let input: Vec<f64> = (0..12000).map(|k| { let t = k as f64 * dt; 500.0 * (1.0 - t / 12.5) * (t * 6.283).sin() + 20.0 * (t * t * 60.0).sin() }).collect();
    let mut state = 1_u64;
    let mut noise = || { state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); ((state >> 33) as f64 / 2f64.powi(31) - 0.5) * 0.01 };
    let output: Vec<f64> = input.iter().map(|u| f.step(*u) + noise()).collect();
    let record = Record::new(&input, &output, 0).unwrap().sampled_every(dt).unwrap();
    let plain = Record::new(&input, &output, 0).unwrap();
    let mut go = |_: &Progress| ControlFlow::Continue(());
    for rec in [plain, record] {
    let t = std::time::Instant::now();
    let found = identify(&[rec], &Options::default(), &mut go).unwrap();
    println!("{:.2?} evaluations {} fit {:.3e} {:?} {:?} {:?} {:?} {} {:?}", t.elapsed(), found.evaluations, found.fit.rmse, found.dynamics, found.creep_amplitudes, found.loop_shift.map(|s| s.time_constant()), found.weights, found.smoothness, found.dead_time);
    for v in found.terms_validation.iter().chain(&found.weights_validation) { println!("   {:?} {:e} creep {} {:?} {:.3e}", v.weights, v.smoothness, v.creep, v.loop_shift, v.rmse); }
    println!("{:?}", found.warnings.iter().map(|w| w.code.name()).collect::<Vec<_>>());
    }
}
