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
fn main() {
    let dir = std::env::args().nth(1).unwrap();
    let (u1, y1) = read(&format!("{dir}/major_loops.csv"), 8000);
    let (u2, y2) = read(&format!("{dir}/decaying_loops.csv"), 3850);
    let major = Record::new(&u1, &y1, 1000).unwrap().sampled_every(0.005).unwrap();
    let decay = Record::new(&u2, &y2, 400).unwrap().sampled_every(0.005).unwrap();
    let both = [major, decay];
    let mut go = |_: &Progress| ControlFlow::Continue(());
    for weights in [WeightLaw::Quadratic, WeightLaw::Split] {
        for smoothness in [0.0, 1e-6, 1e-3, 1e-2] { for creep in [CreepModel::None, CreepModel::Auto] {
            let options = Options { thresholds: Thresholds::Uniform(20), weights, smoothness: Setting::Fixed(smoothness), dynamics: DynamicsModel::None, creep, loop_shift: LoopShiftModel::None, ..Options::default() };
            let a = identify(&both[..1], &options, &mut go).unwrap();
            let b = identify(&both[1..], &options, &mut go).unwrap();
            let (ab, ba) = (a.validate(&both[1], None).rmse, b.validate(&both[0], None).rmse);
            println!("{weights:?} {smoothness} a->b {ab:.4} b->a {ba:.4} mean {:.4} fits {:.4} {:.4} dead {:?} {:?} {:?} {:?}", 0.5 * (ab + ba), a.fit.rmse, b.fit.rmse, a.dead_time_samples, b.dead_time_samples, a.ratios, b.ratios);
        }}
    }
}
