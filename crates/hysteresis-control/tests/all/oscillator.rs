//! The oscillator with hysteresis inside: its steps, its inverse, its file.

use hysteresis_control::oscillator::{
    FileError, Hold, HystereticOscillator, Motion, OscillatorForward, OscillatorState,
};
use hysteresis_core::{Duhem, DuhemForward, Error, Process};

/// The public Bouc-Wen benchmark, divided by its mass of 2 kg.
fn benchmark() -> HystereticOscillator {
    HystereticOscillator::new(0.5, 5.0, 2.5e4, Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1).unwrap()).unwrap()
}

/// 60 N of three sines.
fn drive(n: u32, dt: f64) -> Vec<f64> {
    let sine = |t: f64, hz: f64| (std::f64::consts::TAU * hz * t).sin();
    (0..n).map(|k| f64::from(k) * dt).map(|t| 20.0 * (sine(t, 7.0) + sine(t, 31.0) + sine(t, 83.0))).collect()
}

fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a count")]
    let count = values.clone().count() as f64;
    (values.map(|x| x * x).sum::<f64>() / count).sqrt()
}

fn difference(p: &[f64], q: &[f64]) -> f64 {
    rms(p.iter().zip(q).map(|(p, q)| p - q)) / rms(q.iter().copied())
}

/// Bouc-Wen from its own equation, by steps of a microsecond of second order that know nothing of knots.
fn plainly(u: &[f64], dt: f64) -> Vec<f64> {
    let parts = 400_u32;
    let h = dt / f64::from(parts);
    let rates = |[y, v, z]: [f64; 3], u: f64| {
        [v, 0.5 * u - 5.0 * v - 2.5e4 * y - z, 2.5e4 * v - 1e3 * (0.8 * v.abs() * z - 1.1 * v * z.abs())]
    };
    let mut state = [0.0; 3];
    let mut found = Vec::new();
    for u in u {
        found.push(state[0]);
        for _ in 0..parts {
            let first = rates(state, *u);
            let middle: [f64; 3] = std::array::from_fn(|i| state[i] + 0.5 * h * first[i]);
            let rate = rates(middle, *u);
            state = std::array::from_fn(|i| state[i] + h * rate[i]);
        }
    }
    found
}

#[test]
fn the_response_is_that_of_the_bouc_wen_equations() {
    let (dt, oscillator) = (1e-3, benchmark());
    let u = drive(1500, dt);
    let expected = plainly(&u, dt);
    let by_default = oscillator.response(&u, dt, Hold::Zero, None).unwrap();
    assert!(difference(&by_default, &expected) < 1e-4, "{}", difference(&by_default, &expected));
    let fine = oscillator.response(&u, dt, Hold::Zero, Some(64)).unwrap();
    assert!(difference(&fine, &expected) < 1e-6, "{}", difference(&fine, &expected));
    // Where z passes a knot f bends: of second order there.
    let error = |sub_steps| difference(&oscillator.response(&u, dt, Hold::Zero, Some(sub_steps)).unwrap(), &fine);
    assert!(error(8) < 0.4 * error(4) && error(16) < 0.4 * error(8), "{} {} {}", error(4), error(8), error(16));
}

#[test]
fn a_stream_takes_the_steps_of_a_whole_response() {
    let (dt, oscillator) = (1e-3, benchmark());
    let u = drive(300, dt);
    let mut forward = OscillatorForward::new(&oscillator, dt, None).unwrap();
    let mut y = vec![0.0; 300];
    forward.run(&u, &mut y).unwrap();
    assert_eq!(y, oscillator.response(&u, dt, Hold::Zero, None).unwrap());
    let saved = forward.state();
    let next = forward.advance(5.0);
    forward.reset();
    assert_eq!((forward.output(), forward.step(1.0), forward.rejected()), (0.0, 0.0, 0));
    forward.set_state(&saved).unwrap();
    assert_eq!(forward.advance(5.0), next);
    // A drive that is none counts as the last one.
    let mut other = forward.clone();
    assert_eq!((forward.advance(f64::NAN), forward.rejected()), (other.advance(5.0), 1));
    let wrong = OscillatorState { velocity: f64::NAN, ..saved };
    assert!(forward.set_state(&wrong).is_err());
    let other = HystereticOscillator::new(0.5, 5.0, 2.4e4, *oscillator.hysteresis()).unwrap();
    let mut other = OscillatorForward::new(&other, dt, None).unwrap();
    assert!(matches!(other.set_state(&saved), Err(Error::OtherModel { .. })));
}

#[test]
fn a_drive_that_throws_the_state_out_changes_nothing_and_is_counted() {
    let mut forward = OscillatorForward::new(&benchmark(), 1e-3, None).unwrap();
    forward.advance(5.0);
    let (before, mut other) = (forward.state(), forward.clone());
    // z would grow beyond all bounds.
    assert_eq!((forward.advance(1e100), forward.rejected()), (before.position, 1));
    assert_eq!((forward.state().drive, forward.state().velocity), (5.0, before.velocity));
    assert_eq!((forward.advance(f64::NAN), forward.rejected()), (other.advance(5.0), 2));
    // The velocity alone leaves the bounds: 1e50 1e60 over 1e-9 s.
    let straight = Duhem::from_bouc_wen(1.0, 1.0, 0.0, 0.0).unwrap();
    let oscillator = HystereticOscillator::new(1e50, 0.0, 1.0, straight).unwrap();
    let mut forward = OscillatorForward::new(&oscillator, 1e-9, None).unwrap();
    assert_eq!((forward.advance(1e60), forward.rejected()), (0.0, 1));
    let error = oscillator.response(&[1e60], 1e-9, Hold::Zero, None).unwrap_err();
    assert_eq!(error.parameter(), Some("u"));
}

#[test]
fn the_drive_of_a_motion_brings_it_about() {
    let oscillator = benchmark();
    for (dt, hold, most) in [(1e-4, Hold::Zero, 1e-3), (1e-4, Hold::BandLimited, 1e-4), (5e-5, Hold::Zero, 3e-4)] {
        let t: Vec<f64> = (0..10_000_u32).map(|k| f64::from(k) * dt).collect();
        let sine = |t: f64, hz: f64| (std::f64::consts::TAU * hz * t).sin();
        let soft = |t: f64| 1.0 - (-(t / 0.05).powi(4)).exp();
        let wanted: Vec<f64> =
            t.iter().map(|t| 3e-4 * soft(*t) * (sine(*t, 9.0) + sine(*t, 43.0) + 0.3 * sine(*t, 127.0))).collect();
        let u = oscillator.inverse(&Motion::from_positions(wanted.clone(), dt).unwrap(), hold);
        let y = oscillator.response(&u, dt, hold, None).unwrap();
        assert!(difference(&y, &wanted) < most, "{dt} {hold:?} {}", difference(&y, &wanted));
    }
}

#[test]
fn a_periodic_response_settles() {
    let (dt, oscillator) = (1e-3, benchmark());
    let u = drive(1000, dt);
    let period = oscillator.periodic_response(&u, dt, Hold::BandLimited, None, 2).unwrap();
    let next = oscillator.periodic_response(&u, dt, Hold::BandLimited, None, 3).unwrap();
    assert!(difference(&period, &next) < 1e-6, "{}", difference(&period, &next));
    let twice: Vec<f64> = u.iter().chain(&u).chain(&u).copied().collect();
    let held = oscillator.periodic_response(&u, dt, Hold::Zero, None, 2).unwrap();
    assert_eq!(held, oscillator.response(&twice, dt, Hold::Zero, None).unwrap()[2000..]);
}

#[test]
fn a_file_gives_back_every_bit() {
    let knots = [-1.0, 0.1, 2.0];
    let hysteresis = Duhem::new(&knots, &[1.0, 0.3, 3.0], &[0.7, 1.0 / 3.0, 0.1]).unwrap();
    let oscillator = HystereticOscillator::new(-0.1, 0.0, 1.0 / 7.0, hysteresis).unwrap();
    let text = oscillator.to_json().unwrap();
    assert_eq!(HystereticOscillator::from_json(&text).unwrap(), oscillator);
    let refused = |from: &str, to: &str| HystereticOscillator::from_json(&text.replace(from, to)).unwrap_err();
    assert!(matches!(refused("oscillator/1", "oscillator/2"), FileError::Schema { got: Some(_), .. }));
    assert!(matches!(refused("\"damping\"", "\"friction\""), FileError::Json(_)));
    assert!(matches!(refused("\"damping\": 0.0", "\"damping\": -1.0"), FileError::Value(_)));
    assert!(matches!(HystereticOscillator::from_json("{}").unwrap_err(), FileError::Schema { got: None, .. }));
}

#[test]
fn refusals_name_what_is_wrong() {
    let hysteresis = || Duhem::from_bouc_wen(1.0, 1.0, 0.0, 0.0).unwrap();
    let refused = |b, c, k| HystereticOscillator::new(b, c, k, hysteresis()).unwrap_err().parameter();
    assert_eq!(refused(0.0, 1.0, 1.0), Some("gain"));
    assert_eq!(refused(1.0, -1.0, 1.0), Some("damping"));
    assert_eq!(refused(1.0, f64::NAN, 1.0), Some("damping"));
    assert_eq!(refused(1.0, 1.0, -1.0), Some("stiffness"));
    let oscillator = benchmark();
    let sub_steps = |dt, asked| oscillator.sub_steps(dt, asked).unwrap_err().parameter();
    assert_eq!(sub_steps(0.0, None), Some("dt"));
    assert_eq!(sub_steps(1e3, None), Some("dt"));
    assert_eq!(sub_steps(1e-3, Some(0)), Some("sub_steps"));
    assert_eq!(sub_steps(1e-2, Some(1)), Some("sub_steps"));
    assert_eq!(oscillator.sub_steps(1e-3, None).unwrap(), 4);
    let motion = |y: &[f64], v: &[f64], dt| Motion::new(y.into(), v.into(), vec![0.0; y.len()], dt).unwrap_err();
    assert_eq!(motion(&[0.0], &[], 1.0).parameter(), Some("velocity"));
    assert_eq!(motion(&[0.0], &[f64::NAN], 1.0).parameter(), Some("velocity"));
    assert_eq!(motion(&[0.0], &[0.0], -1.0).parameter(), Some("dt"));
    let nan = oscillator.response(&[0.0, f64::NAN], 1e-3, Hold::Zero, None).unwrap_err();
    assert_eq!(nan.parameter(), Some("u"));
}

#[test]
fn forward_inside_and_operator_alone_agree() {
    let (dt, oscillator) = (1e-4, benchmark());
    let u = drive(3000, dt);
    let mut forward = OscillatorForward::new(&oscillator, dt, None).unwrap();
    let mut operator = DuhemForward::new(*oscillator.hysteresis());
    let mut worst = 0.0_f64;
    let mut largest = 0.0_f64;
    for u in u {
        let z = operator.step(forward.advance(u));
        worst = worst.max((z - forward.state().hysteresis).abs());
        largest = largest.max(z.abs());
    }
    // The operator alone misses what lies between samples where y turns round.
    assert!(worst < 1e-3 * largest, "{worst} {largest}");
}
