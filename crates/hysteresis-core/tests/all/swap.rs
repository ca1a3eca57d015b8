//! Laws of a running stream that goes on with the weights of another model.

use crate::support::models::actuator;
use crate::support::{
    REACH, bank, forwards, history, inverses, invertible_model, oscillations, output_range, run, unnested_model,
};
use hysteresis_core::{
    CompiledModel, CoupledPlay, Error, Forward, Inverse, MemoryState, ModifiedPrandtlIshlinskii, Offsets,
    PrandtlIshlinskii, Process, StreamState,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// Engine and bank sum in different orders: n roundings of the whole range each.
const AGREE: f64 = 1e-13;

/// The same operators with other weights, and another output offset.
fn reweighed(model: &ModifiedPrandtlIshlinskii, weights: &[f64], output: f64) -> ModifiedPrandtlIshlinskii {
    let z = model.operators();
    let column = |threshold: fn(&CoupledPlay) -> f64| z.iter().map(threshold).collect::<Vec<_>>();
    let offsets = Offsets { output, ..model.offsets() };
    let weights = &weights[..z.len()];
    let other = ModifiedPrandtlIshlinskii::new(
        weights,
        &column(CoupledPlay::r),
        &column(CoupledPlay::ra),
        &column(CoupledPlay::rb),
        &column(CoupledPlay::rc),
        offsets,
    )
    .unwrap();
    if !model.is_split() {
        return other;
    }
    let below = z.iter().zip(weights.iter().zip(model.weights_negative()));
    let below: Vec<f64> = below.map(|(z, (w, v))| if is_identity(z) { *w } else { *v }).collect();
    other.with_negative_weights(&below).unwrap()
}

fn is_identity(z: &CoupledPlay) -> bool {
    [z.r(), z.ra(), z.rb(), z.rc()] == [0.0; 4]
}

/// Whether all identities weigh the same above and below zero: split otherwise they count as other operators.
fn has_whole_identities(model: &ModifiedPrandtlIshlinskii) -> bool {
    let weights = model.weights().iter().zip(model.weights_negative());
    model.operators().iter().zip(weights).all(|(z, (w, v))| w == v || !is_identity(z))
}

/// An invertible model and another one of the same operators.
fn pairs() -> impl Strategy<Value = (ModifiedPrandtlIshlinskii, ModifiedPrandtlIshlinskii)> {
    let weights = (0.2..2.0, vec(prop_oneof![Just(0.0), 0.0..1.0], 40), prop_oneof![Just(0.0), -50.0..50.0]);
    let model = prop_oneof![4 => invertible_model(40), 1 => unnested_model()];
    let model = model.prop_filter("the identities are split", has_whole_identities);
    (model, weights).prop_map(|(model, (first, rest, output))| {
        let weights: Vec<f64> = core::iter::once(first).chain(rest).collect();
        let other = reweighed(&model, &weights, output);
        (model, other)
    })
}

fn histories() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![history(100), oscillations()]
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Two states are one but for the rounding of outputs: the very counts, turning points and inputs.
fn assert_same_memory(one: &StreamState, other: &StreamState, tolerance: f64) -> Result<(), TestCaseError> {
    match (&one.memory, &other.memory) {
        (MemoryState::TurningPoints(one), MemoryState::TurningPoints(other)) => {
            prop_assert_eq!((one.direction, one.reversals), (other.direction, other.reversals));
            for (one, other) in [(&one.positive, &other.positive), (&one.negative, &other.negative)] {
                prop_assert_eq!((one.moved, one.at_zero), (other.moved, other.at_zero));
                prop_assert_eq!(one.turning_points.len(), other.turning_points.len());
                for (one, other) in one.turning_points.iter().zip(&other.turning_points) {
                    prop_assert!((one.output - other.output).abs() <= tolerance, "{one:?} {other:?}");
                    let mut same = *other;
                    same.output = one.output;
                    prop_assert_eq!(*one, same);
                }
            }
        }
        (one, other) => prop_assert_eq!(one, other),
    }
    Ok(())
}

proptest! {
    #[test]
    fn the_same_model_changes_no_bit((model, _) in pairs(), x in histories(), y in histories()) {
        let again = CompiledModel::new(&model.clone());
        for mut stream in forwards(&model) {
            run(&mut stream, &x);
            let mut other = stream.clone();
            other.set_model(&again).unwrap();
            prop_assert_eq!(other.state(), stream.state());
            prop_assert_eq!(bits(&run(&mut other, &y)), bits(&run(&mut stream, &y)));
        }
        for mut stream in inverses(&model, Some((-REACH, 0.7 * REACH))) {
            run(&mut stream, &x);
            let mut other = stream.clone();
            other.set_model(&again).unwrap();
            prop_assert_eq!(other.state(), stream.state());
            prop_assert_eq!(bits(&run(&mut other, &y)), bits(&run(&mut stream, &y)));
        }
    }

    #[test]
    fn a_forward_stream_goes_on_as_the_new_model(models in pairs(), x in histories(), y in histories()) {
        let (model, other) = models;
        let tolerance = AGREE * output_range(&other);
        for (mut stream, mut fresh) in forwards(&model).into_iter().zip(forwards(&other)) {
            run(&mut stream, &x);
            run(&mut fresh, &x);
            stream.set_model(&CompiledModel::new(&other)).unwrap();
            assert_same_memory(&stream.state(), &fresh.state(), tolerance)?;
            prop_assert!((stream.step(f64::NAN) - fresh.step(f64::NAN)).abs() <= tolerance);
            for x in &y {
                let (one, other) = (stream.step(*x), fresh.step(*x));
                prop_assert!((one - other).abs() <= tolerance, "{one} and {other} at {x}");
            }
            assert_same_memory(&stream.state(), &fresh.state(), tolerance)?;
        }
    }

    #[test]
    fn an_inverse_goes_on_as_the_new_model(models in pairs(), x in histories(), y in histories()) {
        let (model, other) = models;
        for mut inverse in inverses(&model, None) {
            // The actuator has the new model all along and sees the drives.
            let mut actuator = bank(&other);
            for target in run(&mut model.forward(), &x) {
                actuator.step(inverse.step(target));
            }
            inverse.set_model(&CompiledModel::new(&other)).unwrap();
            for x in &y {
                let target = other.offsets().output + *x;
                let reached = actuator.step(inverse.step(target));
                prop_assert!((reached - target).abs() <= 10.0 * AGREE * output_range(&other), "{reached} for {target}");
            }
        }
    }

    #[test]
    fn the_drive_does_not_jump((model, other) in pairs(), x in histories(), limits in (-80.0..-1.0, 1.0..80.0)) {
        for mut inverse in inverses(&model, Some(limits)) {
            let last = run(&mut inverse, &x)[x.len() - 1];
            let saturated = inverse.saturated();
            inverse.set_model(&CompiledModel::new(&other)).unwrap();
            prop_assert_eq!(inverse.step(f64::NAN).to_bits(), last.to_bits());
            prop_assert_eq!(inverse.saturated(), saturated);
            // The output of the new model at the present drive, as a target, asks for the present drive: exactly, but
            // for what an offset rounds of the target.
            let target = inverse.state().last_input + other.offsets().output;
            if other.offsets().output == 0.0 {
                prop_assert_eq!(inverse.peek(target).to_bits(), last.to_bits());
                prop_assert_eq!(inverse.clone().step(target).to_bits(), last.to_bits());
            }
            let slope = other.weights()[0];
            let rounding = AGREE * (output_range(&other) / slope + REACH);
            prop_assert!((inverse.step(target) - last).abs() <= rounding);
            // From there a small step of the target is a small step of the drive.
            let step = 1e-3 * slope;
            prop_assert!((inverse.step(target + step) - last).abs() <= 1e-3 + rounding);
        }
    }

    #[test]
    fn limits_hold_after_a_swap((model, other) in pairs(), x in histories(), y in histories(), limits in (-80.0..-1.0, 1.0..80.0)) {
        for mut inverse in inverses(&model, Some(limits)) {
            run(&mut inverse, &x);
            inverse.set_model(&CompiledModel::new(&other)).unwrap();
            let mut actuator = bank(&other);
            for target in &y {
                let drive = inverse.step(*target);
                prop_assert!(limits.0 <= drive && drive <= limits.1);
                prop_assert!(!inverse.saturated() || drive == limits.0 || drive == limits.1);
                actuator.step(drive);
            }
            inverse.step(1e9);
            prop_assert_eq!((inverse.step(-1e9), inverse.saturated()), (limits.0, true));
        }
    }

    #[test]
    fn there_and_back_is_the_old_model((model, other) in pairs(), x in histories(), y in histories()) {
        let tolerance = AGREE * (output_range(&model) + output_range(&other));
        for mut stream in forwards(&model) {
            run(&mut stream, &x);
            let mut swapped = stream.clone();
            swapped.set_model(&CompiledModel::new(&other)).unwrap();
            swapped.set_model(&CompiledModel::new(&model)).unwrap();
            assert_same_memory(&swapped.state(), &stream.state(), tolerance)?;
            for (one, other) in run(&mut swapped, &y).iter().zip(run(&mut stream, &y)) {
                prop_assert!((one - other).abs() <= tolerance);
            }
        }
    }

    #[test]
    fn a_state_after_a_swap_restores_a_stream_of_the_new_model((model, other) in pairs(), x in histories(), y in histories()) {
        for (mut stream, mut restored) in inverses(&model, None).into_iter().zip(inverses(&other, None)) {
            run(&mut stream, &x);
            stream.set_model(&CompiledModel::new(&other)).unwrap();
            restored.set_state(&stream.state()).unwrap();
            prop_assert_eq!(bits(&run(&mut restored, &y)), bits(&run(&mut stream, &y)));
        }
    }
}

#[test]
fn other_operators_are_refused_by_name_and_change_nothing() {
    let model = |w: &[f64], r: &[f64], input| {
        let offsets = Offsets { input, output: 0.0 };
        CompiledModel::new(&(&PrandtlIshlinskii::new(w, r, offsets).unwrap()).into())
    };
    let running = model(&[1.0, 0.5, 0.5], &[0.0, 1.0, 2.0], 0.0);
    let crossed = ModifiedPrandtlIshlinskii::new(
        &[1.0; 3],
        &[0.0, 1.0, 2.0],
        &[0.0, 1.0, 2.0],
        &[0.0, 1.0, 0.0],
        &[0.0; 3],
        Offsets::default(),
    );
    let cases = [
        (model(&[1.0; 3], &[0.0, 1.0, 2.5], 0.0), "model: expected the r of the running stream, 2, got 2.5"),
        (model(&[1.0; 2], &[0.0, 1.0], 0.0), "model: expected the number of operators of the running stream"),
        (model(&[1.0; 3], &[0.0, 1.0, 2.0], 3.0), "model: expected the input_offset of the running stream, 0, got 3"),
        (CompiledModel::new(&crossed.unwrap()), "model: expected the "),
    ];
    for (compiled, message) in cases {
        for mut stream in [Forward::new(&running), Forward::with_initial(&running, &[0.0; 3]).unwrap()] {
            run(&mut stream, &[4.0, 1.0, 2.0]);
            let before = stream.state();
            let error = stream.set_model(&compiled).unwrap_err();
            assert!(error.to_string().starts_with(message), "{error}");
            assert_eq!(stream.state(), before);
        }
    }
    let mut inverse = Inverse::new(&running, None).unwrap();
    inverse.step(3.0);
    let before = inverse.state();
    let falling = model(&[0.5, 0.5, -0.75], &[0.0, 1.0, 2.0], 0.0);
    assert!(matches!(inverse.set_model(&falling), Err(Error::NotInvertible { .. })));
    assert_eq!(inverse.state(), before);
}

#[test]
fn nothing_of_a_deep_memory_is_lost() {
    let old = actuator();
    let weights: Vec<f64> =
        old.weights().iter().enumerate().map(|(i, w)| w * if i % 2 == 0 { 1.3 } else { 0.6 }).collect();
    let new = reweighed(&old, &weights, 0.0);
    let swings: Vec<f64> = (0..19_i32).map(|k| (500.0 - 25.0 * f64::from(k)) * f64::from(1 - 2 * (k % 2))).collect();
    let mut inverse = old.inverse(None).unwrap();
    let mut actuator = new.forward();
    for y in run(&mut old.forward(), &swings) {
        actuator.step(inverse.step(y));
    }
    let remembered = inverse.turning_points();
    assert!(remembered.len() > 15, "{remembered:?}");
    inverse.set_model(&CompiledModel::new(&new)).unwrap();
    assert_eq!(bits(&inverse.turning_points()), bits(&remembered));
    for k in 0..4000_i32 {
        let target = 3.3 * (f64::from(k) * 0.01).sin() * f64::from(k) / 4000.0;
        let reached = actuator.step(inverse.step(target));
        assert!((reached - target).abs() < 1e-13, "{reached} for {target}");
    }
}

#[test]
fn the_first_target_of_arbitrary_outputs_is_met() {
    let model = PrandtlIshlinskii::new(&[1.0, 1.0], &[0.0, 5.0], Offsets::default()).unwrap();
    let mut inverse = Inverse::with_initial(&CompiledModel::new(&(&model).into()), None, &[3.0, -4.0]).unwrap();
    // The sum of the outputs that were given is -1, but no drive leaves both: at 2 they are 2 and -3.
    assert!((inverse.peek(-1.0) - 2.0).abs() < 1e-14);
    assert!((inverse.step(-1.0) - 2.0).abs() < 1e-14);
}
