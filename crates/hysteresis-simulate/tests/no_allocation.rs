//! A plant never allocates while it runs.

use hysteresis_control::linear::{Creep, Delay, FirstOrder, SecondOrder};
use hysteresis_core::CompiledModel;
use hysteresis_simulate::paper;
use hysteresis_simulate::plant::{Plant, PlantOptions};

#[test]
fn plants_never_allocate() {
    let options = PlantOptions {
        amplifier: Some(FirstOrder::new(279.0).unwrap()),
        dynamics: Some(SecondOrder::new(2000.0, 0.03).unwrap().into()),
        creep: Some(Creep::new(&[0.01, 0.02], &[0.1, 1.0]).unwrap()),
        delay: Delay::new(2.4e-4).unwrap(),
        noise: 0.016,
        limits: Some((-500.0, 500.0)),
        dac_bits: Some(16),
        adc: Some((24, (-4.0, 4.0))),
        ..PlantOptions::default()
    };
    let mut plant = Plant::new(&CompiledModel::new(&paper::table_1_recovered()), &options).unwrap();
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
