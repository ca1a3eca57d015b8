//! Known responses, and laws that every linear stream keeps.

use core::f64::consts::TAU;

use hysteresis_control::linear::{Block, Creep, Delay, FirstOrder, LinearDynamics, SecondOrder, StateSpace, Stream};
use hysteresis_core::Process;

/// Numbers in -1..1 that follow no pattern.
fn noise(samples: u32) -> Vec<f64> {
    (0..samples).map(|k| 2.0 * (f64::from(k) * f64::from(k + 7) * 0.618_033_988_749_895).fract() - 1.0).collect()
}

/// The step response of y'' + 2 zeta w y' + w^2 y = w^2 u at w t, from a textbook.
fn step_response(zeta: f64, wt: f64) -> f64 {
    if zeta < 1.0 {
        let root = (1.0 - zeta * zeta).sqrt();
        1.0 - (-zeta * wt).exp() * ((root * wt).cos() + zeta / root * (root * wt).sin())
    } else if zeta > 1.0 {
        let (slow, fast) = (zeta - (zeta * zeta - 1.0).sqrt(), zeta + (zeta * zeta - 1.0).sqrt());
        1.0 - (fast * (-slow * wt).exp() - slow * (-fast * wt).exp()) / (fast - slow)
    } else {
        1.0 - (1.0 + wt) * (-wt).exp()
    }
}

#[test]
fn step_responses_are_exact_at_every_sample() {
    for (frequency, zeta, dt) in
        [(400.0, 0.95, 1e-4), (2000.0, 0.03, 1e-4), (3.0, 1.0, 1e-3), (50.0, 4.0, 1e-3), (800.0, 0.3, 1e-3)]
    {
        let mut stream = Stream::new(SecondOrder::new(frequency, zeta).unwrap().block(dt).unwrap(), 0.0);
        for k in 0..=400 {
            let expected = step_response(zeta, TAU * frequency * dt * f64::from(k));
            // 400 samples, each a rounding or two; the angle w t of up to 2000 costs as many.
            let got = stream.step(1.0);
            assert!((got - expected).abs() < 1e-12, "{frequency} {zeta} {k}: {got} {expected}");
        }
    }
    let mut lag = Stream::new(FirstOrder::new(279.0).unwrap().block(1e-4).unwrap(), 0.0);
    for k in 0..=100 {
        let expected = -(-TAU * 279.0 * 1e-4 * f64::from(k)).exp_m1();
        assert!((lag.step(1.0) - expected).abs() < 1e-14);
    }
}

#[test]
fn the_response_is_continuous_at_critical_damping() {
    let response = |zeta: f64| {
        let mut stream = Stream::new(SecondOrder::new(300.0, zeta).unwrap().block(1e-4).unwrap(), 0.0);
        noise(200).into_iter().map(move |u| stream.step(u)).collect::<Vec<_>>()
    };
    let critical = response(1.0);
    for gap in [1e-15, 1e-12, 1e-9, 1e-6] {
        for zeta in [1.0 - gap, 1.0 + gap] {
            for (there, here) in response(zeta).iter().zip(&critical) {
                // The derivative in zeta is of the order of the signal, 1.
                assert!((there - here).abs() < gap + 1e-14, "{zeta}: {there} {here}");
            }
        }
    }
}

#[test]
fn an_input_that_is_held_may_be_sampled_at_any_rate() {
    for dynamics in [
        LinearDynamics::from(SecondOrder::new(700.0, 0.1).unwrap()),
        LinearDynamics::from(SecondOrder::new(200.0, 2.0).unwrap()),
        LinearDynamics::from(FirstOrder::new(100.0).unwrap()).then(SecondOrder::new(700.0, 0.1).unwrap()),
    ] {
        let mut coarse = dynamics.block(1e-3).unwrap();
        let mut fine = dynamics.block(1e-3 / 8.0).unwrap();
        for u in noise(100) {
            let at_once = coarse.advance(u);
            let in_parts = (0..8).map(|_| fine.advance(u)).last().unwrap();
            assert!((at_once - in_parts).abs() < 1e-13);
        }
    }
}

#[test]
fn at_rest_nothing_moves_and_steady_gain_is_exact() {
    let rests = |block: &mut dyn Block, gain: f64| {
        assert_eq!(block.settle(0.375), gain * 0.375);
        assert!((0..1000).all(|_| block.look_ahead(0.375) == gain * 0.375 && block.step(0.375) == gain * 0.375));
    };
    rests(&mut Creep::new(&[0.25, 0.5], &[0.1, 1.0]).unwrap().block(1e-4).unwrap(), 1.75);
    rests(&mut Delay::new(1.5e-4).unwrap().block(1e-4).unwrap(), 1.0);
    let stage = LinearDynamics::from(FirstOrder::new(279.0).unwrap()).then(SecondOrder::new(900.0, 0.2).unwrap());
    let stage = stage.then(StateSpace::from_gain(0.1).unwrap()).then(Delay::new(1.5e-4).unwrap());
    let mut stream = Stream::new(stage.block(1e-4).unwrap(), 0.375);
    rests(&mut stage.block(1e-4).unwrap(), 0.1);
    stream.step(2.0);
    stream.step(1.0);
    stream.reset();
    assert_eq!((stream.output(), stream.peek(0.375)), (0.1 * 0.375, 0.1 * 0.375));
}

#[test]
fn peek_foretells_step_and_run_is_step_in_a_loop() {
    let fast = LinearDynamics::from(StateSpace::from_gain(0.5).unwrap());
    let stage = fast.parallel(&SecondOrder::new(900.0, 0.2).unwrap().into()).unwrap();
    let block = || stage.clone().with_dead_time(3.25e-4).unwrap().block(1e-4).unwrap();
    let mut input = noise(300);
    (input[7], input[8], input[9]) = (f64::NAN, f64::INFINITY, -1e300);
    let (mut stream, mut other) = (Stream::new(block(), 0.0), Stream::new(block(), 0.0));
    let mut output = vec![0.0; input.len()];
    other.run(&input, &mut output).unwrap();
    for (u, y) in input.iter().zip(&output) {
        let before = stream.clone();
        let foretold = stream.peek(*u);
        assert!(stream == before);
        assert_eq!((foretold, stream.step(*u)), (*y, *y));
    }
    assert_eq!((output[6], stream.rejected()), (output[9], 3));
}

/// y(i) = x(i) + sum_k c_k q_k(i), q_k(i+1) = a_k q_k(i) + (1 - a_k) x(i).
#[test]
fn creep_at_the_samples_is_what_its_lags_were_before() {
    let (amplitudes, times) = ([0.02, -0.05, 0.3], [0.5e-3, 0.02, 4.0]);
    let creep = Creep::new(&amplitudes, &times).unwrap();
    let (mut block, mut lags) = (creep.block(1e-3).unwrap(), [0.5; 3]);
    assert!((block.settle(0.5) - 0.5 * 1.27).abs() < 1e-15);
    for x in noise(200) {
        let excess = |lags: [f64; 3]| -> f64 { amplitudes.iter().zip(lags).map(|(c, q)| c * q).sum() };
        let now = excess(lags);
        for (q, tau) in lags.iter_mut().zip(times) {
            let a = (-1e-3_f64 / tau).exp();
            *q = a * *q + (1.0 - a) * x;
        }
        assert!((block.output(x) - x - now).abs() < 1e-14);
        let ahead = block.look_ahead(x);
        assert!((block.clone().advance(x) - x - excess(lags)).abs() < 1e-14 && ahead == block.clone().advance(x));
        assert_eq!(block.output(x), block.step(x));
    }
}

#[test]
fn delays_interpolate_between_samples() {
    let input = noise(50);
    for samples in [0.0, 0.25, 1.0, 1.75, 2.0, 17.5] {
        let mut block = Delay::new(1e-4 * samples).unwrap().block(1e-4).unwrap();
        block.settle(0.5);
        for k in 0..input.len() {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small and positive")]
            let whole = samples as usize;
            let at = |back: usize| k.checked_sub(back).map_or(0.5, |place| input[place]);
            let share = samples.fract();
            let expected = (1.0 - share) * at(whole) + share * at(whole + 1);
            let (ahead, got) = (block.look_ahead(input[k]), block.step(input[k]));
            // The dead time in seconds rounds, by 1e-16 of 17 samples.
            assert!((got - expected).abs() < 1e-14 && ahead == got, "{samples} {k}: {got} {expected}");
        }
    }
}

/// Steps of the law L(t) = 1 + gamma log10(t / t0) at the times between t0 and the end.
#[test]
fn logarithmic_creep_follows_the_law() {
    let (gamma, start, end) = (0.015, 0.02, 200.0);
    for terms in [8, 16, 40] {
        let creep = Creep::logarithmic(gamma, start, end, terms).unwrap();
        let mut stream = Stream::new(creep.block(0.01).unwrap(), 0.0);
        for k in 0..=2000 {
            let (position, time) = (stream.step(2.0), 0.01 * f64::from(k));
            // A decade from either end the tails of the sum are 1/10 of a term per e-fold: a few per cent of gamma.
            if (10.0 * start..0.1 * end).contains(&time) {
                let law = 2.0 * (1.0 + gamma * (time / start).log10());
                assert!((position - law).abs() < 2.0 * 0.05 * gamma, "{terms} {time}: {position} {law}");
            }
        }
    }
}

#[test]
fn what_no_block_can_have_is_named() {
    let above = "expected a finite number above 0 (1e-100 to 1e100)";
    for bad in [0.0, -1.0, f64::INFINITY, 1e300] {
        let message = |parameter: &str| format!("{parameter}: {above}, got {bad:?}");
        assert_eq!(SecondOrder::new(bad, 0.5).unwrap_err().to_string(), message("frequency"));
        assert_eq!(SecondOrder::new(1.0, bad).unwrap_err().to_string(), message("damping"));
        assert_eq!(FirstOrder::new(bad).unwrap_err().to_string(), message("frequency"));
        assert_eq!(FirstOrder::from_time_constant(bad).unwrap_err().to_string(), message("time_constant"));
        assert_eq!(FirstOrder::new(1.0).unwrap().block(bad).unwrap_err().to_string(), message("dt"));
        assert_eq!(SecondOrder::new(1.0, 1.0).unwrap().block(bad).unwrap_err().to_string(), message("dt"));
    }
    assert!(SecondOrder::new(f64::NAN, 0.5).unwrap_err().to_string().ends_with("got NaN"));
    let delay = |seconds| Delay::new(seconds).unwrap_err().to_string();
    assert_eq!(delay(-0.5), "dead_time: expected a finite number of seconds, 0 or more, got -0.5");
    assert_eq!(delay(f64::NAN), "dead_time: expected a finite number of seconds, 0 or more, got NaN");
    let long = Delay::new(106.0).unwrap();
    let expected = "dead_time: expected at most 2^20 sampling intervals, got 106.0";
    assert_eq!(long.block(1e-4).unwrap_err().to_string(), expected);
    assert_eq!(LinearDynamics::from(long).block(1e-4).unwrap_err().to_string(), expected);
    let creep = |amplitudes: &[f64], times: &[f64]| Creep::new(amplitudes, times).unwrap_err().to_string();
    assert_eq!(creep(&[0.1], &[]), "time_constants: expected as many as there are amplitudes, and at least one, got 0");
    assert!(creep(&[], &[]).starts_with("time_constants: expected as many"));
    assert!(creep(&[0.1, f64::NAN], &[0.1, 1.0]).starts_with("amplitudes[1]: expected a finite number"));
    assert!(creep(&[0.1, 0.1], &[0.1, 0.1]).starts_with("time_constants[1]: expected time constants that strictly"));
    assert!(creep(&[0.1], &[-0.1]).starts_with("time_constants[0]: expected a finite number above 0"));
    let logarithmic = |gamma, start, end, terms| Creep::logarithmic(gamma, start, end, terms).unwrap_err().to_string();
    assert_eq!(logarithmic(0.01, 0.1, 0.1, 3), "end: expected a time after start, got 0.1");
    assert_eq!(logarithmic(0.01, 0.0, 0.1, 3), format!("start: {above}, got 0.0"));
    assert_eq!(logarithmic(0.01, 0.1, 1.0, 0), "terms: expected at least one, got 0");
    assert!(logarithmic(f64::NAN, 0.1, 1.0, 2).starts_with("gamma: expected a finite number"));
}
