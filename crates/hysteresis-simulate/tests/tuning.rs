use hysteresis_core::paper;
use hysteresis_simulate::linear::*;
use hysteresis_simulate::tuning::*;
#[test]
fn show() {
    let slopes = paper::table_1_recovered().slope_range();
    let a1 = Chain {
        amplifier: None,
        dynamics: Some(SecondOrder::new(400.0, 0.95).unwrap().into()),
        delay: Delay::new(0.0).unwrap(),
    };
    let p3 = Chain {
        amplifier: Some(FirstOrder::new(279.0).unwrap()),
        dynamics: Some(SecondOrder::new(2000.0, 0.03).unwrap().into()),
        delay: Delay::new(0.0).unwrap(),
    };
    for c in [a1, p3] {
        for m in [1.3, 1.7, 2.0] {
            let t = std::time::Instant::now();
            let tuning = tune(&c, &TuningOptions { slopes, dt: 1e-4, peak_sensitivity: m }).unwrap();
            println!("{m} {tuning:#?} {:?}", t.elapsed());
        }
    }
    println!("{:#?}", loop_margins(&a1, 1e-4, 60.0, 0.6, slopes.1));
    println!("{:#?}", loop_margins(&p3, 1e-4, 5.0, 0.657, slopes.1));
}
