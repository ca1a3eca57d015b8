//! What the observer knows, and what it buys.

mod support;

use hysteresis_core::{CompiledModel, Process};

use hysteresis_control::linear::{Block, Delay, Dynamics, FirstOrder, SecondOrder};
use hysteresis_control::{Observer, ObserverOptions};
use support::models::actuator;
use support::{DT, Loop, Noise, a1, reference_and_target};

fn observer(dynamics: &Dynamics, options: ObserverOptions) -> Observer {
    Observer::new(&CompiledModel::new(&actuator()), dynamics, DT, &options).unwrap()
}

/// Without noise and with the right model, the estimate is the position, with a delay and behind a lag too.
#[test]
fn what_the_model_knows_needs_no_measurement() {
    for dynamics in [a1(), FirstOrder::new(279.0).unwrap().into()] {
        let mut observer = observer(&dynamics, ObserverOptions { delay: 2.5, ..ObserverOptions::new(0.016, 0.5) });
        let mut plant = actuator().forward();
        let (mut delay, mut path) = (Delay::new(2.5 * DT).unwrap().block(DT).unwrap(), dynamics.block(DT).unwrap());
        for k in 0..5000 {
            let drive = 400.0 * (2e-3 * f64::from(k)).sin() * (1.0 - 1e-4 * f64::from(k));
            let position = path.advance(delay.step(plant.step(drive)));
            let measurement = if k % 3 == 0 { position } else { f64::NAN };
            // Rounding only: both are the same recursion.
            assert!((observer.step(drive, measurement) - position).abs() < 1e-12, "{k}");
        }
        assert_eq!(observer.rejected(), 3333);
    }
}

/// The variance of the estimate in a long run is the one for which the gain is the best: P(1,1) of the Riccati equation
/// is g1 / (1 - g1) before the measurement and g1 after it, in units of the noise variance.
#[test]
fn the_estimate_is_as_good_as_the_gain_says() {
    let (noise, drift) = (0.016, 2.0);
    let mut observer = observer(&a1(), ObserverOptions::new(noise, drift));
    let (mut unknown, mut dynamics, mut random) = (0.0, a1().block(DT).unwrap(), Noise::new(3));
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 0..400_000 {
        // What the model does not know wanders during the interval before it acts, as in the filter.
        let position = dynamics.advance(unknown);
        unknown += drift * DT.sqrt() * random.next();
        let estimate = observer.step(0.0, position + noise * random.next());
        if k > 1000 {
            sum += (estimate - position).powi(2);
            count += 1.0;
        }
    }
    let variance = sum / count / (noise * noise);
    // 400 000 samples correlated over some tens: 1 % of statistical error.
    assert!((variance / observer.gain()[0] - 1.0).abs() < 0.05, "{variance} {:?}", observer.gain());
}

/// A constant that the model does not know is found entirely.
#[test]
fn a_disturbance_leaves_no_static_error() {
    let mut observer = observer(&a1(), ObserverOptions::new(0.016, 0.5));
    let mut estimate = 0.0;
    for _ in 0..200_000 {
        estimate = observer.step(0.0, 0.25);
    }
    assert!((estimate - 0.25).abs() < 1e-9 && (observer.disturbance() - 0.25).abs() < 1e-9);
    observer.reset();
    assert!(observer.step(0.0, 0.0) == 0.0 && observer.disturbance() == 0.0);
}

/// Measurements that come and go: with the gain of the full rate the estimate would grow by a factor every other sample.
#[test]
fn missing_measurements_do_not_make_it_unstable() {
    for (dynamics, noise) in [(a1(), 1e-3), (SecondOrder::new(2000.0, 0.03).unwrap().into(), 0.016)] {
        for every in [2, 3, 5, 20] {
            let (mut observer, mut random) =
                (observer(&dynamics, ObserverOptions::new(noise, 50.0)), Noise::new(every));
            let stationary = observer.gain();
            let mut worst = 0.0_f64;
            for k in 0..20_000 {
                let measurement = noise * random.next();
                let estimate = observer.step(0.0, if k % every == 0 { measurement } else { f64::NAN });
                worst = worst.max(estimate.abs());
            }
            // Up to 19 samples of an unknown input, 50 um per root of a second, twice integrated: far below a micrometre.
            assert!(worst < 1.0, "{noise} {every}: {worst}");
            assert!(observer.gain() == stationary);
        }
    }
}

/// Once measurements have come for a while, nothing is left of a gap: the same gain, the same estimate.
#[test]
fn after_a_gap_the_filter_settles_again() {
    let options = ObserverOptions::new(0.016, 0.5);
    let [mut whole, mut gap] = [(); 2].map(|()| observer(&a1(), options));
    for k in 0..3000 {
        let position = 0.1 * (1e-2 * f64::from(k)).sin();
        let one = whole.step(0.0, position);
        let other = gap.step(0.0, if (100..150).contains(&k) { f64::NAN } else { position });
        assert!(k < 2000 || (one - other).abs() < 1e-12, "{k}");
    }
}

/// Noise and drift of which the ratio is no number: refused with the number that came.
#[test]
fn a_gain_that_is_none_is_refused() {
    for (noise, drift) in [(1e-100, 1e100), (1e-40, 1e40), (1e100, 1e-100)] {
        let made = Observer::new(&CompiledModel::new(&actuator()), &a1(), DT, &ObserverOptions::new(noise, drift));
        let expected = format!("drift: expected a drift for which the filter settles, got {drift:?}");
        assert_eq!(made.unwrap_err().to_string(), expected);
    }
}

/// What it buys: feedback of the estimate puts less noise on the true position than feedback of the measurement.
#[test]
fn feedback_of_the_estimate_is_quieter() {
    let (reference, target) = reference_and_target(400.0, 0.95);
    let model = actuator().into();
    let rms = |observed: bool| {
        let mut plant = Loop::new(&model, 0.016, 11);
        let mut observer = observer(&a1(), ObserverOptions::new(0.016, 0.5));
        let mut sum = 0.0;
        for (r, target) in reference.iter().zip(&target).cycle().take(50_000) {
            sum += (r - plant.position).powi(2);
            let measured = plant.measure();
            let estimate = observer.step(plant.drive, measured);
            plant.advance(*target, r - if observed { estimate } else { measured });
        }
        (sum / 50_000.0).sqrt()
    };
    let (with, without) = (rms(true), rms(false));
    assert!(with < 0.8 * without, "{with} {without}");
}

#[test]
fn what_cannot_settle_is_refused() {
    let compiled = CompiledModel::new(&actuator());
    let refused = |options| Observer::new(&compiled, &a1(), DT, &options).unwrap_err().parameter;
    assert_eq!(refused(ObserverOptions::new(0.0, 1.0)), "noise");
    assert_eq!(refused(ObserverOptions::new(1.0, f64::NAN)), "drift");
    assert_eq!(refused(ObserverOptions { delay: -1.0, ..ObserverOptions::new(1.0, 1.0) }), "dead_time");
}
