//! What cannot be made, and what the message says.

use crate::support::models::{actuator, parametric_inverse};
use hysteresis_core::{
    CompiledModel, CoupledPlay, Error, Forward, Inverse, MemoryState, Method, ModifiedPrandtlIshlinskii, Offsets, Play,
    PrandtlIshlinskii, Process, Ratios, StreamArray, Tracked,
};

fn message<T: core::fmt::Debug>(result: Result<T, Error>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn thresholds_out_of_their_domain_are_named() {
    assert_eq!(message(Play::new(-1.0)), "r: expected a finite number >= 0, got -1.0");
    assert_eq!(message(Play::new(f64::NAN)), "r: expected a finite number >= 0, got NaN");
    assert_eq!(message(CoupledPlay::new(1.0, 1.0, 0.0, 2.0)), "rc: expected 0 <= rc <= r = 1.0, got 2.0");
    assert_eq!(message(CoupledPlay::new(1.0, 1.0, 2.0, 0.0)), "rb: expected 0 <= rb <= ra = 1.0, got 2.0");
    assert_eq!(message(CoupledPlay::new(1.0, f64::INFINITY, 0.0, 0.0)), "ra: expected a finite number >= 0, got inf");
    let model = ModifiedPrandtlIshlinskii::new(
        &[1.0, 1.0],
        &[0.0, 1.0],
        &[0.0, 1.0],
        &[0.0, 0.5],
        &[0.0, 1.5],
        Offsets::default(),
    );
    assert_eq!(message(model), "rc[1]: expected 0 <= rc <= r = 1.0, got 1.5");
}

#[test]
fn models_that_are_none_are_named() {
    let conventional =
        |weights: &[f64], thresholds: &[f64]| message(PrandtlIshlinskii::new(weights, thresholds, Offsets::default()));
    assert_eq!(conventional(&[], &[]), "weights: expected at least one element, got none");
    assert_eq!(conventional(&[1.0, 2.0], &[0.0]), "thresholds: expected 2 elements, got 1");
    assert_eq!(conventional(&[1.0], &[-2.0]), "thresholds[0]: expected a finite number >= 0, got -2.0");
    assert_eq!(
        conventional(&[1.0, f64::NAN], &[0.0, 1.0]),
        "weights[1]: expected a finite number (at most 1e100 in magnitude), got NaN"
    );
    let offsets = Offsets { input: 0.0, output: f64::INFINITY };
    assert_eq!(
        message(PrandtlIshlinskii::new(&[1.0], &[0.0], offsets)),
        "output_offset: expected a finite number (at most 1e100 in magnitude), got inf"
    );
    let ratios = |ratios| message(ModifiedPrandtlIshlinskii::from_ratios(&[1.0], &[0.0], ratios, Offsets::default()));
    assert_eq!(ratios(Ratios { rc: 1.5, ..Ratios::PAPER }), "rc: expected a number from 0.0 to 1.0, got 1.5");
    assert_eq!(ratios(Ratios { rb: 1.5, ..Ratios::PAPER }), "rb: expected 0 <= rb <= ra = 0.95, got 1.5");
}

#[test]
fn invertible_means_that_the_identity_outweighs_the_negative_weights() {
    let check = |weights: &[f64], thresholds: &[f64]| {
        PrandtlIshlinskii::new(weights, thresholds, Offsets::default()).unwrap().check_invertible()
    };
    assert_eq!(check(&[1.0, 0.5], &[0.0, 1.0]), Ok(()));
    assert_eq!(check(&[1.0, 0.5, -0.9], &[0.0, 1.0, 2.0]), Ok(()));
    // Partial sums are positive up to the last, and the slope is still -0.5 where all three slide.
    let error = check(&[1.0, 1.0, -1.5], &[0.0, 1.0, 2.0]).unwrap_err();
    assert_eq!(error, Error::NotInvertible { identity_weight: 1.0, negative_sum: -1.5 });
    assert!(error.to_string().contains("not invertible") && error.to_string().contains("1.0 and -1.5"));
    assert!(check(&[0.0, 1.0], &[0.0, 1.0]).is_err());
    assert!(check(&[1.0], &[1.0]).is_err(), "no operator is the identity");
    // Two identity operators count together; a slope lost in rounding is none.
    assert_eq!(check(&[1.0, 1.0, -1.5], &[0.0, 0.0, 2.0]), Ok(()));
    assert!(check(&[1.0, -(1.0 - 1e-14)], &[0.0, 1.0]).is_err());
    // Its reciprocal would not be finite.
    assert!(check(&[1e-310], &[0.0]).is_err());
    let model = PrandtlIshlinskii::new(&[1.0, -2.0], &[0.0, 1.0], Offsets::default()).unwrap();
    assert!(matches!(model.inverse(None), Err(Error::NotInvertible { .. })));
}

#[test]
fn closed_forms_name_the_operator_that_breaks_them() {
    let closed_form = |weights: &[f64], thresholds: &[f64]| {
        let model = PrandtlIshlinskii::new(weights, thresholds, Offsets::default()).unwrap();
        message(model.closed_form_inverse())
    };
    let lead = "no closed-form inverse: operator";
    assert_eq!(closed_form(&[1.0], &[1.0]), format!("{lead} 0: expected the threshold 0, got 1.0"));
    assert_eq!(
        closed_form(&[1.0, 1.0, 1.0], &[0.0, 2.0, 1.0]),
        format!("{lead} 2: expected a threshold not below the one before it, got 1.0")
    );
    assert_eq!(
        closed_form(&[1.0, -1.5], &[0.0, 1.0]),
        format!("{lead} 1: expected a positive sum of the weights up to it, got -0.5")
    );
}

#[test]
fn a_closed_form_inverse_swaps_the_offsets() {
    let offsets = Offsets { input: 3.0, output: -7.0 };
    let model = PrandtlIshlinskii::new(&[2.0, 0.5, 0.25], &[0.0, 1.0, 2.5], offsets).unwrap();
    let mut inverse = model.closed_form_inverse().unwrap().forward();
    let mut forward = model.forward();
    for y in [-7.0, 5.0, 1.0, 9.0, -20.0, -3.0] {
        // A few roundings of 20.
        assert!((forward.step(inverse.step(y)) - y).abs() < 1e-13);
    }
}

#[test]
fn limits_that_are_none_are_named() {
    let actuator = actuator();
    let inverse = |low, high| message(actuator.inverse(Some((low, high))));
    assert_eq!(inverse(5.0, 5.0), "limits[1]: expected a number above the low limit = 5.0, got 5.0");
    assert_eq!(inverse(f64::NAN, 5.0), "limits[0]: expected a finite number (at most 1e100 in magnitude), got NaN");
}

#[test]
fn a_sample_is_judged_as_it_comes_not_relative_to_the_offset() {
    let far = Offsets { input: 9e99, output: -9e99 };
    let model = CompiledModel::new(&(&PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], far).unwrap()).into());
    for method in [Method::TurningPoints, Method::Bank] {
        judges_samples_as_they_come(&model, method);
    }
}

fn judges_samples_as_they_come(model: &CompiledModel, method: Method) {
    let (mut forward, mut inverse) =
        (Forward::with_method(model, method).unwrap(), Inverse::with_method(model, None, method).unwrap());
    for (sample, is_taken) in [
        (9.5e99, true),
        (1e100, true),
        (1.01e100, false), // on the line that the last sample is on, and 1.1e99 from the offset
        (-1e100, true),    // 1.9e100 from the offset
        (-1.01e100, false),
        (5e99, true),
        (f64::NAN, false),
    ] {
        let (before, rejected) = ((forward.output(), inverse.reached()), (forward.rejected(), inverse.rejected()));
        let (peeked, drive) = (forward.peek(sample), inverse.peek(-sample));
        assert_eq!((forward.step(sample), inverse.step(-sample)), (peeked, drive), "{sample}");
        let more = (forward.rejected() - rejected.0, inverse.rejected() - rejected.1);
        assert_eq!(more, if is_taken { (0, 0) } else { (1, 1) }, "{sample}");
        assert_eq!((forward.output(), inverse.reached()) != before, is_taken, "{sample}");
        let mut other = Forward::with_method(model, method).unwrap();
        other.set_state(&forward.state()).unwrap();
        assert_eq!(other.output(), forward.output());
    }
}

#[test]
fn blocks_of_unequal_length_are_refused_whole() {
    let mut stream = actuator().forward();
    let before = stream.state();
    assert_eq!(message(stream.run(&[1.0, 2.0], &mut [0.0])), "output: expected 2 elements, got 1");
    assert_eq!(stream.state(), before);
}

#[test]
fn rows_of_an_array_that_are_none_are_refused_whole() {
    let compiled = vec![CompiledModel::new(&actuator()); 3];
    let mut mirror = StreamArray::forward(&compiled);
    let rest: Vec<_> = mirror.streams().iter().map(Forward::state).collect();
    assert_eq!((mirror.len(), mirror.is_empty()), (3, false));
    assert_eq!(message(mirror.step(&[1.0; 2], &mut [0.0; 3])), "input: expected 3 elements, got 2");
    assert_eq!(message(mirror.step(&[1.0; 3], &mut [0.0; 4])), "output: expected 3 elements, got 4");
    assert_eq!(message(mirror.peek(&[1.0; 4], &mut [0.0; 3])), "input: expected 3 elements, got 4");
    assert_eq!(message(mirror.peek(&[1.0; 3], &mut [0.0; 2])), "output: expected 3 elements, got 2");
    assert_eq!(
        message(mirror.run(&[1.0; 8], &mut [0.0; 8])),
        "input: expected whole rows of 3 elements, got 8 elements"
    );
    assert_eq!(message(mirror.run(&[1.0; 6], &mut [0.0; 3])), "output: expected 6 elements, got 3");
    assert_eq!(mirror.streams().iter().map(Forward::state).collect::<Vec<_>>(), rest);
    let mut none = StreamArray::forward(&[]);
    assert!(none.is_empty() && none.step(&[], &mut []).is_ok() && none.run(&[], &mut []).is_ok());
    assert_eq!(message(none.run(&[1.0], &mut [0.0])), "input: expected whole rows of 0 elements, got 1 elements");
}

#[test]
fn the_actuator_that_cannot_be_made_is_named() {
    let bad = PrandtlIshlinskii::new(&[1.0, -2.0], &[0.0, 1.0], Offsets::default()).unwrap();
    let compiled = [CompiledModel::new(&actuator()), CompiledModel::new(&(&bad).into())];
    let error = StreamArray::inverse(&compiled, None).unwrap_err();
    assert!(error.actuator == 1 && matches!(error.error, Error::NotInvertible { .. }));
    assert!(error.to_string().starts_with("actuator 1: the model is not invertible"));
}

#[test]
fn an_array_resets_every_actuator() {
    let mut mirror =
        StreamArray::forward(&[CompiledModel::new(&actuator()), CompiledModel::new(&parametric_inverse())]);
    let rest: Vec<_> = mirror.streams().iter().map(Forward::state).collect();
    mirror.run(&[100.0, 1.0, -50.0, f64::NAN], &mut [0.0; 4]).unwrap();
    assert_eq!(mirror.streams()[1].rejected(), 1);
    mirror.reset();
    assert_eq!(mirror.streams().iter().map(Forward::state).collect::<Vec<_>>(), rest);
}

#[test]
fn initial_outputs_are_checked_and_projected() {
    let compiled = CompiledModel::new(&actuator());
    assert_eq!(message(Forward::with_initial(&compiled, &[0.0])), "initial: expected 20 elements, got 1");
    let mut initial = vec![0.0; 20];
    initial[3] = f64::NAN;
    assert!(message(Forward::with_initial(&compiled, &initial)).starts_with("initial[3]: expected a finite number"));
    // The first sample projects any outputs onto what the operators can reach: a full stroke forgets them.
    let mut odd = Forward::with_initial(&compiled, &[400.0; 20]).unwrap();
    assert!((odd.step(-500.0) - actuator().forward().step(-500.0)).abs() < 1e-14);
    let mut z = Tracked::new(Play::new(10.0).unwrap());
    z.set_state(99.0).unwrap();
    assert_eq!(z.step(5.0), 15.0);
    assert!(message(z.set_state(f64::NAN)).starts_with("state: expected a finite number"));
}

#[test]
fn a_method_that_cannot_be_is_refused_with_the_threshold_that_is_not_nested() {
    let (ra, rb) = ([0.0, 10.0, 20.0], [0.0, 10.0, 5.0]);
    let model = ModifiedPrandtlIshlinskii::new(&[1.0; 3], &ra, &ra, &rb, &[0.0; 3], Offsets::default()).unwrap();
    let compiled = CompiledModel::new(&model);
    for refused in [
        message(Forward::with_method(&compiled, Method::TurningPoints)),
        message(Inverse::with_method(&compiled, None, Method::TurningPoints)),
    ] {
        assert!(refused.starts_with("rb[2]: expected nested thresholds"), "{refused}");
    }
    let nested = CompiledModel::new(&actuator());
    for method in [Method::TurningPoints, Method::Bank] {
        assert_eq!(Forward::with_method(&nested, method).unwrap().method(), method);
        assert_eq!(Inverse::with_method(&nested, None, method).unwrap().method(), method);
    }
}

/// Everything about a state that can be wrong, each refused with the stream left as it was.
/// Another compiler may round the sums in another way: a state of there is restored here.
#[test]
fn a_state_that_differs_by_rounding_is_restored_and_a_wrong_one_refused() {
    let model = actuator();
    let mut forward = model.forward();
    forward.run(&[30.0, -10.0, 20.0], &mut [0.0; 3]).unwrap();
    for part in [1e-13, -1e-13, 1e-6, -1e-6] {
        let mut state = forward.state();
        state.last_output *= 1.0 + part;
        assert_eq!(model.forward().set_state(&state).is_ok(), part.abs() < 1e-9, "{part}");
    }
}

#[test]
fn states_of_another_stream_are_refused() {
    let actuator = actuator();
    let mut stream = actuator.forward();
    for x in [300.0, -200.0, 100.0, -50.0, 20.0] {
        stream.step(x);
    }
    let good = stream.state();
    let refused = |spoil: &dyn Fn(&mut hysteresis_core::TurningPointState)| {
        let mut state = good.clone();
        let MemoryState::TurningPoints(memory) = &mut state.memory else { unreachable!("the engine runs") };
        spoil(memory);
        let mut other = actuator.forward();
        let before = other.state();
        let error = other.set_state(&state).expect_err("a spoilt state");
        assert_eq!(other.state(), before);
        error.to_string()
    };
    assert!(refused(&|m| m.positive.moved = 99).contains("fewer sliding operators"));
    assert!(refused(&|m| m.positive.at_zero = m.positive.moved + 1).contains("fewer sliding operators"));
    assert!(refused(&|m| m.positive.turning_points[0].moved = 20).contains("fewer operators"));
    assert!(refused(&|m| m.negative.turning_points[0].moved = 0).contains("fewer operators"));
    assert!(refused(&|m| m.positive.turning_points[0].at_zero = 77).contains("fewer operators"));
    assert!(refused(&|m| m.positive.turning_points[0].input = f64::NAN).contains("finite inputs"));
    assert!(refused(&|m| m.positive.turning_points[0].output = f64::NAN).contains("finite inputs"));
    assert!(refused(&|m| m.positive.turning_points[0].output += 1e-3).contains("outputs that the model has"));
    assert!(refused(&|m| m.negative.turning_points[0].input -= 1.0).contains("outputs that the model has"));
    assert!(refused(&|m| m.reversals = 0).contains("numbered"));
    assert!(refused(&|m| m.positive.turning_points[0].reversal = 0).contains("numbered"));

    assert!(refused(&|m| m.reversals = u64::MAX).contains("2^63"));
    assert!(refused(&|m| m.positive.moved = 1).contains("output that the model has"));
    assert!(refused(&|m| m.negative.at_zero += 1).contains("expected"));

    let spoilt = |spoil: &dyn Fn(&mut hysteresis_core::StreamState)| {
        let mut state = good.clone();
        spoil(&mut state);
        message(actuator.forward().set_state(&state))
    };
    assert!(spoilt(&|s| s.last_output += 1e-3).contains("output that the model has"));
    assert!(spoilt(&|s| s.last_input += 1.0).contains("output that the model has"));
    assert!(spoilt(&|s| (s.last_input, s.last_output) = (f64::NAN, 0.0)).contains("finite"));

    let compiled = CompiledModel::new(&actuator);
    let mut sum = Forward::with_initial(&compiled, &[0.0; 20]).unwrap();
    sum.step(100.0);
    let mut state = sum.state();
    state.last_output += 1e-3;
    assert!(message(sum.set_state(&state)).contains("sum to the output"));
    let mut narrow = Inverse::new(&compiled, Some((-1.0, 1.0))).unwrap();
    let mut wide = Inverse::new(&compiled, None).unwrap();
    wide.step(2.0);
    assert!(message(narrow.set_state(&wide.state())).contains("within the limits"));
}

#[cfg(feature = "json")]
mod files {
    use hysteresis_core::{JsonError, Model, SCHEMA};

    use super::{actuator, parametric_inverse};

    #[test]
    fn every_truncation_is_refused() {
        let text = Model::from(parametric_inverse()).to_json();
        assert_eq!(Model::from_json(&text).unwrap(), Model::from(parametric_inverse()));
        for cut in 0..text.trim_end().len() {
            assert!(matches!(Model::from_json(&text[..cut]), Err(JsonError::Syntax(_))), "cut at {cut}");
        }
    }

    #[test]
    fn other_schemas_fields_and_numbers_are_refused() {
        let text = Model::from(actuator()).to_json();
        let refused = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            Model::from_json(&text.replacen(from, to, 1)).unwrap_err().to_string()
        };
        assert!(
            refused(SCHEMA, "mpi_hyst/model/9")
                .contains("schema: expected \"mpi_hyst/model/1\" or \"mpi_hyst/model/2\", got")
        );
        assert!(refused("\"schema\"", "\"scheme\"").contains("got none"));
        assert!(refused("\"r\"", "\"q\"").contains("not a model file: unknown field `q`"));
        assert!(refused("25.0", "-25.0e999").contains("not a model file"));
        assert!(refused("25.0", "\"25.0\"").contains("not a model file"));
        assert!(refused("23.75", "-23.75").contains("ra[1]: expected a finite number >= 0, got -23.75"));
        assert!(refused("modified", "conventional").contains("not a model file"));
    }
}
