//! Try.
use std::ops::ControlFlow;
use hysteresis_identify::*;
fn read(path: &str, rows: usize) -> (Vec<f64>, Vec<f64>) {
    let text = std::fs::read_to_string(path).unwrap();
    let (mut u, mut y) = (vec![], vec![]);
    for line in text.lines().skip(1).take(rows) {
        let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        u.push(v[1]); y.push(v[2]);
    }
    (u, y)
}
fn loops(found: &Identification, records: &[Record<'_>]) -> f64 {
    let left = found.leave_one_loop_out(records).unwrap();
    let of: Vec<f64> = left.iter().filter(|l| l.record == records.len() - 1).map(|l| l.left_out.rmse.powi(2)).collect();
    (of.iter().sum::<f64>() / of.len() as f64).sqrt()
}
fn main() {
    let dir = std::env::args().nth(1).unwrap();
    let (u1, y1) = read(&format!("{dir}/major_loops.csv"), 8000);
    let (u2, y2) = read(&format!("{dir}/decaying_loops.csv"), 3850);
    let major = Record::new(&u1, &y1, 1000).unwrap().sampled_every(0.005).unwrap();
    let decay = Record::new(&u2, &y2, 400).unwrap().sampled_every(0.005).unwrap();
    let mut go = |_: &Progress| ControlFlow::Continue(());
    let shift: f64 = std::env::var("TAU").map_or(0.0, |t| t.parse().unwrap());
    for n in [20, 16] {
        let loop_shift = if shift > 0.0 { LoopShiftModel::Both(shift) } else if shift < 0.0 { LoopShiftModel::Square(-shift) } else { LoopShiftModel::Auto };
        let mut options = Options { thresholds: Thresholds::Uniform(n), loop_shift, ..Options::default() };
        if let Ok(l) = std::env::var("LAMBDA") { options.smoothness = Setting::Fixed(l.parse().unwrap()); }
        if let Ok(l) = std::env::var("LAW") { options.weights = match &l[..] { "q" => WeightLaw::Quadratic, "f" => WeightLaw::Free, _ => WeightLaw::Split }; }
        let both = [major.clone(), decay.clone()];
        let t = std::time::Instant::now();
        let found = identify(&both, &options, &mut go).unwrap();
        println!("n {n} fit {:.4} loops cv {:.4} {:?} {} {:?} {:?} dead {:?} {:?} dyn {:?} {:.2?}", found.fit.rmse, loops(&found, &both), found.weights, found.smoothness, found.creep_amplitudes, found.loop_shift, found.dead_time_samples, found.ratios, found.dynamics, t.elapsed());
        for v in found.terms_validation.iter().chain(&found.weights_validation).chain(&found.smoothness_validation) {
            println!("   {:?} {:e} creep {:?} {:?} {:.4}", v.weights, v.smoothness, v.creep, v.loop_shift, v.rmse);
        }
        println!("   {:?}", found.warnings.iter().map(|w| w.code.name()).collect::<Vec<_>>());
        let a = identify(&both[..1], &options, &mut go).unwrap();
        let b = identify(&both[1..], &options, &mut go).unwrap();
        let (ab, ba) = (a.validate(&both[1], None).rmse, b.validate(&both[0], None).rmse);
        println!(" one->other {ab:.4} {ba:.4} mean {:.4}   a: {:?} {} {:?} {:?}  b: {:?} {} {:?} {:?}", 0.5 * (ab + ba), a.weights, a.smoothness, a.creep_amplitudes, a.loop_shift.map(|s| s.time_constant()), b.weights, b.smoothness, b.creep_amplitudes, b.loop_shift.map(|s|s.time_constant()));
    }
}
