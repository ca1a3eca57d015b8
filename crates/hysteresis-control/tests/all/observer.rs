//! Laws of the observer.

use crate::support::models::actuator;
use crate::support::{DT, Loop, Noise, a1, reference_and_target};
use hysteresis_control::linear::{Block, Creep, Delay, FirstOrder, LinearDynamics, Modes, SecondOrder};
use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_control::{Observer, ObserverOptions};
use hysteresis_core::{Duhem, Process};

fn stage(dynamics: impl Into<LinearDynamics>, dead_time: f64) -> Stage {
    Stage::new(StageParts { dynamics: dynamics.into(), dead_time, ..StageParts::new(actuator()) }).unwrap()
}

fn observer(dynamics: impl Into<LinearDynamics>, options: ObserverOptions) -> Observer {
    Observer::new(&stage(dynamics, 0.0), DT, &options).unwrap()
}

const USUAL: ObserverOptions = ObserverOptions { noise: 0.016, drift: 0.5 };

/// Without noise and with the right model, the estimate is the position, with a delay and behind a lag too.
#[test]
fn what_the_model_knows_needs_no_measurement() {
    for dynamics in [LinearDynamics::from(a1()), FirstOrder::new(279.0).unwrap().into()] {
        let mut observer = Observer::new(&stage(dynamics.clone(), 2.5 * DT), DT, &USUAL).unwrap();
        let mut plant = actuator().forward();
        let mut path = dynamics.then(Delay::new(2.5 * DT).unwrap()).block(DT).unwrap();
        for k in 0..5000 {
            let drive = 400.0 * (2e-3 * f64::from(k)).sin() * (1.0 - 1e-4 * f64::from(k));
            let position = path.advance(plant.step(drive));
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
    let mut observer = observer(a1(), ObserverOptions { noise, drift });
    let (mut unknown, mut dynamics, mut random) = (0.0, a1().block(DT).unwrap(), Noise::new(3));
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 0..400_000 {
        // What the model does not know changes when a drive is put out, as in the filter.
        unknown += drift * DT.sqrt() * random.next();
        let position = dynamics.advance(unknown);
        let estimate = observer.step(0.0, position + noise * random.next());
        if k > 1000 {
            sum += (estimate - position).powi(2);
            count += 1.0;
        }
    }
    let variance = sum / count / (noise * noise);
    // 400 000 samples correlated over some tens: 1 % of statistical error.
    assert!((variance / observer.position_gain() - 1.0).abs() < 0.05, "{variance} {}", observer.position_gain());
}

/// A constant that the model does not know is found entirely.
#[test]
fn a_disturbance_leaves_no_static_error() {
    let mut observer = observer(a1(), USUAL);
    let mut estimate = 0.0;
    for _ in 0..200_000 {
        estimate = observer.step(0.0, 0.25);
    }
    assert!((estimate - 0.25).abs() < 1e-9 && (observer.disturbance() - 0.25).abs() < 1e-9);
    observer.reset();
    assert!(observer.step(0.0, 0.0) == 0.0 && observer.disturbance() == 0.0);
}

/// Measurements that come and go: with the gain of the full rate the estimate would grow by a factor every other
/// sample.
#[test]
fn missing_measurements_do_not_make_it_unstable() {
    for (dynamics, noise) in [(a1(), 1e-3), (SecondOrder::new(2000.0, 0.03).unwrap().into(), 0.016)] {
        for every in [2, 3, 5, 20] {
            let (mut observer, mut random) =
                (observer(dynamics, ObserverOptions { noise, drift: 50.0 }), Noise::new(every));
            let stationary = (observer.position_gain(), observer.disturbance_gain());
            let mut worst = 0.0_f64;
            for k in 0..20_000 {
                let measurement = noise * random.next();
                let estimate = observer.step(0.0, if k % every == 0 { measurement } else { f64::NAN });
                worst = worst.max(estimate.abs());
            }
            // Up to 19 samples of an unknown input, 50 um per root of a second, twice integrated: far below a
            // micrometre.
            assert!(worst < 1.0, "{noise} {every}: {worst}");
            assert!((observer.position_gain(), observer.disturbance_gain()) != stationary);
            for _ in 0..2000 {
                observer.step(0.0, noise * random.next());
            }
            assert_eq!((observer.position_gain(), observer.disturbance_gain()), stationary);
        }
    }
}

/// Once measurements have come for a while, nothing is left of a gap: the same gain, the same estimate.
#[test]
fn after_a_gap_the_filter_settles_again() {
    let options = USUAL;
    let [mut whole, mut gap] = [(); 2].map(|()| observer(a1(), options));
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
        let made = Observer::new(&stage(a1(), 0.0), DT, &ObserverOptions { noise, drift });
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
        let mut observer = observer(a1(), USUAL);
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
    let refused = |options| Observer::new(&stage(a1(), 0.0), DT, &options).unwrap_err().parameter();
    assert_eq!(refused(ObserverOptions { noise: 0.0, drift: 1.0 }), Some("noise"));
    assert_eq!(refused(ObserverOptions { noise: 1.0, drift: f64::NAN }), Some("drift"));
    let early = Observer::new(&stage(a1(), -DT), DT, &USUAL).unwrap_err();
    assert_eq!(early.parameter(), Some("dead_time"));
}

/// A stage with an amplifier, several modes, creep and a dead time.
fn everything() -> Stage {
    let modes = [SecondOrder::new(400.0, 0.3).unwrap(), SecondOrder::new(1500.0, 0.02).unwrap()];
    Stage::new(StageParts {
        amplifier: Some(FirstOrder::new(1000.0).unwrap()),
        creep: Some(Creep::logarithmic(0.01, 0.01, 10.0, 4).unwrap()),
        dynamics: Modes::new(&[0.9, 0.1], &modes).unwrap().into(),
        dead_time: 1.5 * DT,
        limits: Some((-10.0, 500.0)),
        ..StageParts::new(actuator())
    })
    .unwrap()
}

/// Noise does not reach the disturbance of a whole stage by more than the filter lets it, and a constant is found; also
/// where a Duhem operator moves it by a third as much as its plays.
#[test]
fn a_whole_stage_is_observed() {
    let duhem = Duhem::new(&[-1.0, 0.0, 1.0], &[4e-3, 2e-3, 1e-3], &[1e-3, 2e-3, 4e-3]).unwrap();
    let beside = StageParts { duhem: Some(Box::new(duhem)), ..everything().parts().clone() };
    let beside = Stage::new(beside).unwrap();
    for (stage, seed) in [(everything(), 5), (beside, 6)] {
        let mut random = Noise::new(seed);
        let (mut plant, mut observer) = (stage.forward(DT).unwrap(), Observer::new(&stage, DT, &USUAL).unwrap());
        let (mut squares, mut count) = (0.0, 0.0);
        for k in 0..40_000 {
            let drive = 200.0 - 200.0 * (2e-3 * f64::from(k)).cos();
            let position = plant.advance(drive) + 0.1;
            let estimate = observer.step(drive, position + 0.016 * random.next());
            if k > 20_000 {
                squares += (estimate - position).powi(2);
                count += 1.0;
            }
        }
        let rms: f64 = f64::sqrt(squares / count);
        let expected = 0.016 * observer.position_gain().sqrt();
        assert!(rms < 1.1 * expected && expected < 0.01, "{rms} {expected}");
        assert!((observer.disturbance() - 0.1).abs() < 0.01, "{}", observer.disturbance());
    }
}

/// Saved in a gap and restored into another observer it goes on bit for bit; what belongs to another is named.
#[test]
fn a_state_is_taken_over_bit_for_bit_or_refused_by_name() {
    let stage = everything();
    let made = |stage: &Stage, dt, options| Observer::new(stage, dt, &options).unwrap();
    let mut one = made(&stage, DT, USUAL);
    for k in 0..100 {
        one.step(f64::from(k % 17) * 20.0, if k > 90 { f64::NAN } else { 0.1 });
    }
    let saved = one.state();
    let mut other = made(&stage, DT, USUAL);
    other.set_state(&saved).unwrap();
    assert!((0..300).all(|k| one.step(f64::from(k % 7), 0.2) == other.step(f64::from(k % 7), 0.2)));
    assert_eq!(one.state(), other.state());
    let refused = |mut observer: Observer| {
        let before = observer.state();
        let error = observer.set_state(&saved).unwrap_err();
        assert_eq!(observer.state(), before);
        error.to_string().split(':').next().unwrap().to_string()
    };
    assert_eq!(refused(made(&stage, 2.0 * DT, USUAL)), "state.dt");
    assert_eq!(refused(made(&stage, DT, ObserverOptions { noise: 0.02, ..USUAL })), "state.noise");
    assert_eq!(refused(made(&stage, DT, ObserverOptions { drift: 0.1, ..USUAL })), "state.drift");
    let parts = StageParts { dead_time: 1.6 * DT, ..stage.parts().clone() };
    assert_eq!(refused(made(&Stage::new(parts).unwrap(), DT, USUAL)), "state.model");
    let parts = StageParts { creep: None, ..stage.parts().clone() };
    assert_eq!(refused(made(&Stage::new(parts).unwrap(), DT, USUAL)), "state.model");
}

#[test]
fn a_state_is_taken_back_whatever_the_sensor_has_shown() {
    let dynamics = SecondOrder::new(800.0, 0.02).unwrap();
    let mut observer = observer(dynamics, ObserverOptions { noise: 1e-3, drift: 5.0 });
    for k in 0..1000 {
        let y = if k % 50 < 20 { 1e100 } else { -1e100 };
        assert!(observer.step(0.0, if k % 7 == 0 { f64::NAN } else { y }).is_finite());
        let state = observer.state();
        observer.set_state(&state).unwrap();
        assert_eq!(observer.state(), state);
    }
}
