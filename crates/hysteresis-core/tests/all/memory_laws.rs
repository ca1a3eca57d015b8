//! Laws of what a stream remembers, keeps as a state and takes from one.

use crate::support::{
    REACH, any_nested_model, bank, bank_inverse, forwards, history, inverses, invertible_model, oscillations, run,
};
use hysteresis_core::{
    BankState, CompiledModel, CoupledPlay, Direction, Inverse, MemoryState, ModifiedPrandtlIshlinskii, Offsets,
    PrandtlIshlinskii, Process, Ratios, StreamState,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// The model, not split, with so much larger thresholds r and ra but for the identity.
fn with_gaps_of_at_least(gap: f64, model: &ModifiedPrandtlIshlinskii) -> ModifiedPrandtlIshlinskii {
    let z = model.operators();
    let wider = |threshold: f64, z: &CoupledPlay| if z.is_identity() { threshold } else { threshold + gap };
    let (r, ra): (Vec<f64>, Vec<f64>) = z.iter().map(|z| (wider(z.r(), z), wider(z.ra(), z))).unzip();
    let (rb, rc): (Vec<f64>, Vec<f64>) = z.iter().map(|z| (z.rb(), z.rc())).unzip();
    ModifiedPrandtlIshlinskii::new(model.weights(), &r, &ra, &rb, &rc, model.offsets()).unwrap()
}

proptest! {
    #[test]
    fn steps_where_nothing_slides_are_not_remembered(model in invertible_model(20), x in history(60), walk in vec(0.01..0.99, 1..40)) {
        // Between a reversal and 1 V behind it, less than any operator needs to slide again.
        let model = with_gaps_of_at_least(1.0, &model);
        let turn = x[x.len() - 1] + 4.0 * REACH;
        let walk: Vec<f64> = walk.into_iter().map(|part| turn - part).collect();
        let mut forward = model.forward();
        run(&mut forward, &x);
        run(&mut forward, &[turn, turn - 0.5]);
        let (before, outputs) = (forward.state(), run(&mut forward, &walk));
        forward.step(turn - 0.5);
        prop_assert_eq!(forward.state(), before);

        let mut inverse = model.inverse(None).unwrap();
        inverse.follow(&x).unwrap();
        inverse.follow(&[turn, turn - 0.995]).unwrap();
        inverse.step(outputs[0]);
        let (before, drives) = (inverse.state(), run(&mut inverse, &outputs));
        for (x, back) in walk.iter().zip(drives) {
            prop_assert!((back - x).abs() <= 1e-11 * 4.0 * REACH, "{x} came back as {back}");
        }
        inverse.step(outputs[0]);
        prop_assert_eq!(inverse.state(), before);
    }

    #[test]
    fn restored_state_continues_bit_for_bit(model in invertible_model(20), x in history(60), y in history(60)) {
        let limits = Some((model.offsets().input - 60.0, model.offsets().input + 60.0));
        for mut stream in forwards(&model) {
            let mut other = stream.clone();
            run(&mut stream, &x);
            run(&mut other, &y);
            other.set_state(&stream.state()).unwrap();
            prop_assert_eq!(stream.state(), other.state());
            for y in &y {
                prop_assert_eq!(stream.step(*y), other.step(*y));
                prop_assert_eq!(stream.state(), other.state());
            }
        }
        for mut stream in inverses(&model, limits) {
            let mut other = stream.clone();
            run(&mut stream, &x);
            run(&mut other, &y);
            other.set_state(&stream.state()).unwrap();
            prop_assert_eq!(stream.saturated(), other.saturated());
            prop_assert_eq!(stream.state(), other.state());
            for y in &y {
                prop_assert_eq!(stream.step(*y), other.step(*y));
                prop_assert_eq!(stream.state(), other.state());
            }
        }
    }

    #[test]
    fn reset_is_a_new_stream(model in invertible_model(20), x in history(60), y in history(60)) {
        let limits = Some((5.0, 60.0));
        for (mut forward, mut new) in forwards(&model).into_iter().zip(forwards(&model)) {
            run(&mut forward, &x);
            forward.reset();
            prop_assert_eq!(forward.state(), new.state());
            prop_assert_eq!(run(&mut forward, &y), run(&mut new, &y));
            prop_assert_eq!(forward.state(), new.state());
        }
        for (mut inverse, mut new) in inverses(&model, limits).into_iter().zip(inverses(&model, limits)) {
            run(&mut inverse, &x);
            inverse.reset();
            prop_assert_eq!(inverse.state(), new.state());
            prop_assert_eq!(run(&mut inverse, &y), run(&mut new, &y));
            prop_assert_eq!(inverse.state(), new.state());
        }
    }

    #[test]
    fn memory_is_bounded_by_the_operators(model in invertible_model(8), x in prop_oneof![history(200), oscillations()]) {
        let mut forward = model.forward();
        let mut streams = [model.inverse(None).unwrap(), model.inverse(Some((-60.0, 80.0))).unwrap()];
        for x in x {
            let y = forward.step(x);
            check_stacks(&model, &forward.state())?;
            for inverse in &mut streams {
                inverse.step(y);
                check_stacks(&model, &inverse.state())?;
            }
        }
    }

    #[test]
    fn memory_of_any_weights_is_bounded_by_the_operators(model in any_nested_model(8), x in prop_oneof![history(200), oscillations()]) {
        let mut stream = model.forward();
        for x in x {
            stream.step(x);
            check_stacks(&model, &stream.state())?;
        }
    }
}

/// Above the virgin state at most n turning points in each family, each with fewer operators than the one below it: on
/// a stack of n + 1 there is always room.
fn check_stacks(model: &ModifiedPrandtlIshlinskii, state: &StreamState) -> Result<(), TestCaseError> {
    // The part of an identity that one side has alone is a play of no width.
    let weights = model.weights().iter().zip(model.weights_negative());
    let counts = |(z, (w, v)): &(&CoupledPlay, (&f64, &f64))| !z.is_identity() || w != v;
    let operators = model.operators().iter().zip(weights).filter(counts).count();
    let MemoryState::TurningPoints(memory) = &state.memory else {
        return Err(TestCaseError::fail("nested thresholds went to the bank"));
    };
    for family in [&memory.positive, &memory.negative] {
        let moved: Vec<usize> = family.turning_points.iter().map(|point| point.moved).collect();
        prop_assert!(moved.len() <= operators, "{moved:?} of {operators}");
        prop_assert!(moved.is_sorted_by(|below, above| below > above), "{moved:?}");
        prop_assert!(moved.iter().all(|moved| (1..=operators).contains(moved)), "{moved:?} of {operators}");
        prop_assert!(family.moved < *moved.last().unwrap_or(&(operators + 1)), "{} on {moved:?}", family.moved);
    }
    Ok(())
}

#[test]
fn memory_can_need_every_turning_point() {
    // Ever smaller swings that each leave one operator more behind.
    let thresholds: Vec<f64> = (0..=10).map(f64::from).collect();
    let mut stream = PrandtlIshlinskii::new(&[1.0; 11], &thresholds, Offsets::default()).unwrap().forward();
    for k in (0..=10_i32).rev() {
        stream.step((f64::from(k) + 0.25) * f64::from(1 - 2 * (k % 2)));
    }
    let MemoryState::TurningPoints(memory) = stream.state().memory else { panic!("nested thresholds") };
    assert_eq!((memory.positive.turning_points.len(), memory.negative.turning_points.len()), (10, 9));
}

#[test]
fn a_state_whose_output_is_off_by_roundings_is_restored() {
    // Nearly all of the output is that of the play.
    let model = PrandtlIshlinskii::new(&[1e-9, 1.0], &[0.0, 2.0], Offsets::default()).unwrap();
    for swing in [90.0, -90.0] {
        let mut stream = model.forward();
        stream.step(swing);
        let mut state = stream.state();
        state.last_output *= 1.0 + 1e-14;
        model.forward().set_state(&state).unwrap();
        state.last_output *= 1.0 + 1e-6;
        assert!(model.forward().set_state(&state).is_err());
    }
}

#[test]
fn a_state_is_judged_at_the_scale_of_its_model() {
    for scale in [1e-12, 1.0, 1e12] {
        let model = PrandtlIshlinskii::new(&[scale, scale], &[0.0, 2.0], Offsets::default()).unwrap();
        let mut stream = model.forward();
        stream.step(90.0);
        let state = stream.state();
        let off_by = |share: f64| StreamState { last_output: state.last_output * (1.0 + share), ..state.clone() };
        model.forward().set_state(&off_by(1e-14)).unwrap();
        assert!(model.forward().set_state(&off_by(1e-6)).is_err(), "{scale}");
    }
}

#[test]
fn a_state_may_lie_a_rounding_before_the_reversal_it_came_from() {
    let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    for turn in [90.0_f64, -90.0] {
        let mut stream = model.forward();
        let output = stream.step(turn);
        stream.step(turn - turn.signum());
        let state = StreamState { last_output: output, ..stream.state() };
        for (share, is_taken) in [(1e-15, true), (1e-7, false)] {
            let state = StreamState { last_input: turn * (1.0 + share), ..state.clone() };
            assert_eq!(model.forward().set_state(&state).is_ok(), is_taken, "{turn} {share}");
        }
    }
}

#[test]
fn the_numbers_of_reversals_are_far_from_their_end() {
    let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    let mut state = model.forward().state();
    let mut take = |number| {
        let MemoryState::TurningPoints(memory) = &mut state.memory else { panic!("nested thresholds") };
        memory.reversals = number;
        model.forward().set_state(&state)
    };
    take(1 << 63).unwrap();
    assert!(take((1 << 63) + 1).unwrap_err().to_string().contains("at most 2^63 reversals"));
}

#[test]
fn a_bank_at_its_very_limit_is_not_saturated() {
    let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    for (limit, beyond) in [(8.0, 1e-9), (-8.0, -1e-9)] {
        let mut stream = bank(&(&model).into());
        let target = stream.step(limit);
        let compiled = CompiledModel::new(&(&model).into());
        let mut inverse = Inverse::with_initial(&compiled, Some((-8.0, 8.0)), &[0.0; 2]).unwrap();
        assert_eq!((inverse.step(target), inverse.saturated()), (limit, false));
        assert_eq!((inverse.step(target + beyond), inverse.saturated()), (limit, true));
    }
}

#[test]
fn a_bank_of_split_weights_is_restored_within_the_roundings_of_its_sum() {
    let split = |weights: &[f64]| {
        let model = PrandtlIshlinskii::new(weights, &[0.0, 2.0], Offsets::default()).unwrap();
        ModifiedPrandtlIshlinskii::from(&model).with_negative_weights(&[weights[0], 0.5 * weights[1]]).unwrap()
    };
    for (model, swing) in [(split(&[1e6, 3e6]), 77.7), (split(&[1e-6, 3e-6]), -77.7)] {
        let mut stream = bank(&model);
        stream.step(swing);
        let state = stream.state();
        let off_by = |share: f64| StreamState { last_output: state.last_output * (1.0 + share), ..state.clone() };
        stream.set_state(&off_by(1e-14)).unwrap();
        assert!(stream.set_state(&off_by(1e-8)).is_err());
    }
}

/// On a line outputs may have other last bits than their sum, and after eight small moves one is drawn.
#[test]
fn a_bank_goes_on_bit_for_bit_between_small_moves() {
    let weights: Vec<f64> = (0..20).map(|i| 1.0 / f64::from(3 + i)).collect();
    let r: Vec<f64> = (0..20).map(|i| 5.0 * f64::from(i)).collect();
    let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap();
    let drive: Vec<f64> = (0..40).map(|k| f64::from(10 * (k % 20)) + 0.1 * f64::sin(f64::from(k))).collect();
    for jump in drive {
        let small: Vec<f64> = (0..20).map(|k| jump + 0.03 * f64::from(k)).collect();
        let mut stream = bank(&model);
        stream.step(jump - 80.0);
        for k in 0..small.len() {
            stream.step(small[k]);
            let (mut one, mut other) = (stream.clone(), bank(&model));
            other.set_state(&stream.state()).unwrap();
            assert_eq!(run(&mut one, &small[k..]), run(&mut other, &small[k..]), "after {k} small moves to {jump}");
            assert_eq!(one.state(), other.state());
        }
    }
}

/// Where an operator comes to stick at zero, the line ahead holds behind too.
#[test]
fn an_inverse_by_a_bank_remembers_the_same_after_its_state_was_restored() {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[1.0, 0.5], &[0.0, 20.0], Ratios::PAPER, Offsets::default());
    let model = model.unwrap();
    let targets = run(&mut bank(&model), &[50.0, 30.0, -10.0, -9.0, -11.0, -8.0]);
    let mut stream = bank_inverse(&model, None);
    run(&mut stream, &targets[..3]);
    let mut other = bank_inverse(&model, None);
    other.set_state(&stream.state()).unwrap();
    for target in &targets[3..] {
        assert_eq!(stream.step(*target), other.step(*target));
        assert_eq!(stream.state(), other.state());
    }
}

#[test]
fn a_bank_makes_fewer_small_moves_than_lead_to_a_line() {
    let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    let mut stream = bank(&(&model).into());
    stream.step(7.0);
    let state = stream.state();
    let with = |line, small_moves| {
        let memory = MemoryState::Bank(BankState { outputs: [7.0, 5.0].into(), line, small_moves });
        StreamState { memory, ..state.clone() }
    };
    stream.set_state(&with(None, 7)).unwrap();
    for (line, small_moves) in [(None, 8), (None, 255), (Some(Direction::Rising), 1)] {
        let error = stream.set_state(&with(line, small_moves)).unwrap_err();
        assert!(error.to_string().contains("fewer small moves than lead to a line"), "{error}");
        assert_eq!(stream.state(), with(None, 7));
    }
}

#[test]
fn a_bank_takes_only_finite_outputs_of_all_its_operators() {
    let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    let mut stream = bank(&(&model).into());
    stream.step(7.0);
    let state = stream.state();
    for outputs in [&[7.0, 5.0, 0.0][..], &[7.0], &[7.0, f64::NAN], &[f64::INFINITY, 5.0]] {
        let memory = MemoryState::Bank(BankState { outputs: outputs.into(), line: None, small_moves: 0 });
        let error = stream.set_state(&StreamState { memory, ..state.clone() }).unwrap_err();
        assert!(error.to_string().contains("one finite output for each operator"), "{error}");
    }
    stream.set_state(&state).unwrap();
}

/// States in files carry it: it may never change.
#[test]
fn the_fingerprint_of_a_model_stays() {
    let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    assert_eq!(CompiledModel::new(&(&model).into()).fingerprint(), 8_482_977_391_365_109);
}
