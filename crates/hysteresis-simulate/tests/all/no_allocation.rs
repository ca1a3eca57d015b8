//! A plant never allocates while it runs.

use hysteresis_control::linear::{Creep, FirstOrder, SecondOrder};
use hysteresis_control::stage::{LoopShift, Stage, StageParts};
use hysteresis_simulate::paper;
use hysteresis_simulate::plant::{Plant, PlantOptions};

#[test]
fn plants_never_allocate() {
    let stage = Stage::new(StageParts {
        amplifier: Some(FirstOrder::new(279.0).unwrap()),
        dynamics: SecondOrder::new(2000.0, 0.03).unwrap().into(),
        loop_shift: Some(LoopShift::new(0.0, 500.0, [-0.2, 0.1], 0.01, 0.5).unwrap()),
        creep: Some(Creep::new(&[0.01, 0.02], &[0.1, 1.0]).unwrap()),
        dead_time: 2.4e-4,
        noise: Some(0.016),
        limits: Some((-500.0, 500.0)),
        ..StageParts::new(paper::table_1_recovered())
    });
    let options = PlantOptions { dac_bits: Some(16), adc: Some((24, (-4.0, 4.0))), ..PlantOptions::new(1e-4) };
    let mut plant = Plant::new(&stage.unwrap(), &options).unwrap();
    let drives: Vec<f64> =
        (0..1000_u32).map(|k| if k % 97 == 0 { f64::NAN } else { f64::from(k * k % 1201) - 600.0 }).collect();
    let (mut measured, mut position) = (vec![0.0; drives.len()], vec![0.0; drives.len()]);
    let count = allocations::count(|| {
        for u in &drives {
            std::hint::black_box(plant.step(*u));
        }
        plant.reset();
        plant.run(&drives, &mut measured, &mut position).unwrap();
    });
    assert_eq!(count, 0);
    assert_eq!(plant.events().rejected, 11);
}
