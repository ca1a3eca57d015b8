mod common;
use std::f64::consts::PI;
use std::time::Instant;
use common::noise;
use hysteresis_control::linear::{Block, Creep, Dynamics, SecondOrder};
use hysteresis_core::{CoupledPlay, ModifiedPrandtlIshlinskii, Operator, Offsets};
use hysteresis_identify::*;
use hysteresis_simulate::paper;

fn stage(model: &ModifiedPrandtlIshlinskii, dynamics: Option<Dynamics>, creep: Option<&Creep>, dead_samples: f64, dt: f64, input: &[f64]) -> Vec<f64> {
    let operators: &[CoupledPlay] = model.operators();
    let mut z = vec![0.0; operators.len()];
    let mut q: Option<Vec<f64>> = None;
    let p: Vec<f64> = input.iter().map(|u| {
        for (z, o) in z.iter_mut().zip(operators) { *z = o.next(*z, u - model.offsets().input); }
        let h = model.offsets().output + z.iter().zip(model.weights()).map(|(z, w)| z * w).sum::<f64>();
        let mut p = h;
        if let Some(c) = creep {
            let q = q.get_or_insert_with(|| vec![h; c.amplitudes().len()]);
            for ((q, c), tau) in q.iter_mut().zip(c.amplitudes()).zip(c.time_constants()) {
                p += c * *q;
                let a = (-dt / tau).exp();
                *q = a * *q + (1.0 - a) * h;
            }
        }
        p
    }).collect();
    let Some(dynamics) = dynamics else { return p };
    let sub = 20usize;
    let back = (dead_samples * sub as f64).round() as isize;
    let mut block = dynamics.block(dt / sub as f64).unwrap();
    block.settle(p[0]);
    let mut fine = Vec::new();
    for p in &p { for _ in 0..sub { fine.push(block.state()[0]); block.advance(*p); } }
    (0..p.len()).map(|k| { let i = (k * sub) as isize - back; fine[i.clamp(0, fine.len() as isize - 1) as usize] }).collect()
}
fn tri(samples: usize, amplitude: f64, cycles: f64, centre: f64) -> Vec<f64> {
    (0..samples).map(|k| k as f64 / samples as f64).map(|s| centre + amplitude * (1.0 - s) * ((2.0 * PI * s * cycles).sin().asin() * 2.0 / PI)).collect()
}
fn go(name: &str, records: &[Record<'_>], options: &Options) -> Identification {
    let t = Instant::now();
    let found = identify(records, options, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
    println!("{name}: {:.2} s, {} evaluations, rmse {:.5} noise {:.5}, f/z {:?} dead {:?} samples {:?} lag {:.6} ms creep {:?} weights {:?}", t.elapsed().as_secs_f64(), found.evaluations, found.fit.rmse, found.noise, found.dynamics, found.dead_time, found.dead_time_samples, 1e3*found.lag, found.creep_amplitudes, found.weights);
    let e = &found.standard_errors;
    println!("   se f {:.3} z {:.4} dead {:.2e} lag {:.3e} ms creep {:?}  ratios {:?} {:?}", e.frequency, e.damping, e.dead_time, 1e3*e.lag, e.creep, found.ratios, e.ratios);
    for w in &found.warnings { println!("   {w}"); }
    found
}

#[test]
fn a1() {
    let model = paper::table_1_recovered();
    let d: Dynamics = SecondOrder::new(400.0, 0.95).unwrap().into();
    let dt = 1e-4;
    for (samples, rate) in [(12_000usize, 10.0), (120_000, 1.0), (24_000, 5.0)] {
        let cycles = samples as f64 * dt * rate;
        let input = tri(samples, 500.0, cycles, 0.0);
        let mut y = stage(&model, Some(d), None, 0.0, dt, &input);
        for (y, e) in y.iter_mut().zip(noise(samples, 0.016, 3)) { *y += e; }
        let record = Record::new(&input, &y, 0).unwrap();
        go(&format!("A1 plain {rate} Hz"), &[record], &Options { dt: Some(dt), ..Options::default() });
        go(&format!("A1 joint {rate} Hz"), &[record], &Options { dt: Some(dt), dynamics: Some(Order::Second), ..Options::default() });
        go(&format!("A1 joint creep {rate} Hz"), &[record], &Options { dt: Some(dt), dynamics: Some(Order::Second), creep: CreepModel::Logarithmic { terms: None }, ..Options::default() });
    }
}
#[test]
fn light() {
    let model = paper::table_1_recovered();
    let d: Dynamics = SecondOrder::new(800.0, 0.02).unwrap().into();
    let dt = 1e-4;
    let creep = Creep::logarithmic(0.012, 0.01, 100.0, 8).unwrap();
    let n = 24_000;
    let mut input = tri(n, 500.0, 24.0, 0.0);
    let mut step = vec![0.0; 12_000];
    for k in 200..12_000 { step[k] = 200.0; }
    let mut y = stage(&model, Some(d), Some(&creep), 1.0, dt, &input);
    let mut ys = stage(&model, Some(d), Some(&creep), 1.0, dt, &step);
    for (y, e) in y.iter_mut().zip(noise(n, 0.01, 3)) { *y += e; }
    for (y, e) in ys.iter_mut().zip(noise(12_000, 0.01, 5)) { *y += e; }
    let records = [Record::new(&input, &y, 0).unwrap(), Record::new(&step, &ys, 0).unwrap()];
    let options = Options { dt: Some(dt), dynamics: Some(Order::Second), creep: CreepModel::Logarithmic { terms: None }, ..Options::default() };
    go("light tri+step", &records, &options);
    go("light tri", &records[..1], &options);
    go("light step", &records[1..], &options);
    input.truncate(10);
}
