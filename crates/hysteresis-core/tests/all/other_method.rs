//! A state of one method in a stream of the other.

use crate::support::{REACH, any_nested_model, history, invertible_model, oscillations, output_range, run, slopes};
use hysteresis_core::{
    BankState, CompiledModel, Error, Forward, Inverse, MemoryState, Method, ModifiedPrandtlIshlinskii, Offsets,
    PrandtlIshlinskii, Process, Ratios, StreamState,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// What both kinds of streams have.
trait Stream: Process + Clone {
    fn state(&self) -> StreamState;
    fn set_state(&mut self, state: &StreamState) -> Result<(), Error>;
}

macro_rules! stream {
    ($stream:ty) => {
        impl Stream for $stream {
            fn state(&self) -> StreamState {
                self.state()
            }

            fn set_state(&mut self, state: &StreamState) -> Result<(), Error> {
                self.set_state(state)
            }
        }
    };
}

stream!(Forward);
stream!(Inverse);

/// Streams by turning points and by the bank.
fn forwards(model: &ModifiedPrandtlIshlinskii) -> [Forward; 2] {
    let compiled = CompiledModel::new(model);
    [Method::TurningPoints, Method::Bank].map(|method| Forward::with_method(&compiled, method).unwrap())
}

fn inverses(model: &ModifiedPrandtlIshlinskii, limits: Option<(f64, f64)>) -> [Inverse; 2] {
    let compiled = CompiledModel::new(model);
    [Method::TurningPoints, Method::Bank].map(|method| Inverse::with_method(&compiled, limits, method).unwrap())
}

/// Both go on with the same samples to within `tolerance`.
fn go_on_alike<S: Stream>(one: &mut S, other: &mut S, samples: &[f64], tolerance: f64) -> Result<(), TestCaseError> {
    for (k, sample) in samples.iter().enumerate() {
        let (peeked, expected, got) = (other.peek(*sample), one.step(*sample), other.step(*sample));
        prop_assert!((got - expected).abs() <= tolerance, "{got} instead of {expected} at sample {k}, {sample}");
        prop_assert_eq!(peeked.to_bits(), got.to_bits());
    }
    Ok(())
}

/// A stream that has seen `x` saves its state; one of the other method takes it, goes on, and hands it back.
fn hand_over<S: Stream>(
    [mut one, mut other]: [S; 2],
    [x, y, z]: [&[f64]; 3],
    tolerance: f64,
) -> Result<(), TestCaseError> {
    run(&mut one, x);
    run(&mut other, z); // what the taker remembers before makes no difference
    other.set_state(&one.state()).unwrap();
    restored_goes_on(&other, y)?;
    go_on_alike(&mut one, &mut other, y, tolerance)?;
    restored_goes_on(&other, z)?;
    one.set_state(&other.state()).unwrap();
    go_on_alike(&mut one, &mut other, z, tolerance)
}

/// The state is one that the stream itself takes: so what its turning points say of outputs is right.
fn restored_goes_on<S: Stream>(stream: &S, samples: &[f64]) -> Result<(), TestCaseError> {
    let (mut stream, mut same) = (stream.clone(), stream.clone());
    same.reset();
    same.set_state(&stream.state()).unwrap();
    prop_assert_eq!(run(&mut same, samples), run(&mut stream, samples));
    Ok(())
}

fn reversed<S>([one, other]: [S; 2]) -> [S; 2] {
    [other, one]
}

fn samples() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![history(60), oscillations()]
}

/// How far drives of inverses may be apart: as far as outputs, over the least slope.
fn drive_tolerance(model: &ModifiedPrandtlIshlinskii) -> f64 {
    1e-12 * (output_range(model) + 2.0 * REACH) / slopes(model).0
}

fn limits(model: &ModifiedPrandtlIshlinskii) -> (f64, f64) {
    (model.offsets().input - 60.0, model.offsets().input + 60.0)
}

proptest! {
    #[test]
    fn a_state_goes_on_by_either_method(model in any_nested_model(20), x in samples(), y in samples(), z in history(60)) {
        let tolerance = 1e-12 * output_range(&model);
        hand_over(forwards(&model), [&x, &y, &z], tolerance)?;
        hand_over(reversed(forwards(&model)), [&x, &y, &z], tolerance)?;
    }

    #[test]
    fn a_state_of_an_inverse_goes_on_by_either_method(model in invertible_model(20), x in samples(), y in samples(), z in history(60)) {
        let tolerance = drive_tolerance(&model);
        for limits in [None, Some(limits(&model))] {
            hand_over(inverses(&model, limits), [&x, &y, &z], tolerance)?;
            hand_over(reversed(inverses(&model, limits)), [&x, &y, &z], tolerance)?;
        }
    }

    /// Those above zero are of one drive, those below of another.
    #[test]
    fn a_state_of_mixed_outputs_is_refused_or_goes_on(
        model in invertible_model(8),
        x in samples(),
        y in samples(),
        at in -0.5 * REACH..0.5 * REACH,
        z in samples(),
    ) {
        let above = outputs(&driven(forwards(&model)[1].clone(), &[&x[..], &[at]].concat()));
        let below = outputs(&driven(forwards(&model)[1].clone(), &[&y[..], &[at]].concat()));
        let mixed: Vec<f64> = above.iter().zip(below).map(|(above, below)| if *above > 0.0 { *above } else { below }).collect();
        let mut started = Inverse::with_initial(&CompiledModel::new(&model), None, &mixed).unwrap();
        started.follow(&[at]).unwrap();
        let mut other = model.inverse(None).unwrap();
        if other.set_state(&started.state()).is_ok() {
            for sample in &z {
                go_on_alike(&mut started, &mut other, &[*sample], drive_tolerance(&model))?;
                restored_goes_on(&other, &[])?;
            }
        }
    }

    /// Initial outputs may be such that no drive leads to them.
    #[test]
    fn a_state_of_any_outputs_is_refused_or_goes_on(
        model in invertible_model(8),
        initial in vec(prop_oneof![Just(0.0), -20.0..20.0], 8),
        x in prop_oneof![history(4), vec(-0.1 * REACH..0.1 * REACH, 1..4)],
        y in samples(),
    ) {
        let (compiled, initial) = (CompiledModel::new(&model), &initial[..model.weights().len()]);
        let mut started = Forward::with_initial(&compiled, initial).unwrap();
        let mut other = model.forward();
        run(&mut started, &x);
        let (before, taken) = (other.state(), other.set_state(&started.state()));
        if taken.is_ok() {
            restored_goes_on(&other, &y)?;
            go_on_alike(&mut started, &mut other, &y, 1e-12 * output_range(&model))?;
            restored_goes_on(&other, &y)?;
        } else {
            prop_assert_eq!(other.state(), before);
        }

        let mut started = Inverse::with_initial(&compiled, None, initial).unwrap();
        let mut other = model.inverse(None).unwrap();
        run(&mut started, &x);
        if other.set_state(&started.state()).is_ok() {
            go_on_alike(&mut started, &mut other, &y, drive_tolerance(&model))?;
            restored_goes_on(&other, &y)?;
        }
    }
}

fn plays(thresholds: &[f64]) -> ModifiedPrandtlIshlinskii {
    let weights = vec![1.0; thresholds.len()];
    ModifiedPrandtlIshlinskii::from(&PrandtlIshlinskii::new(&weights, thresholds, Offsets::default()).unwrap())
}

fn driven(mut stream: Forward, drive: &[f64]) -> Forward {
    run(&mut stream, drive);
    stream
}

fn outputs(stream: &Forward) -> Vec<f64> {
    match stream.state().memory {
        MemoryState::Bank(BankState { outputs, .. }) => outputs.into(),
        MemoryState::TurningPoints(_) => panic!("a stream by turning points"),
    }
}

/// What a stream by turning points says to the state of a bank that started from these outputs.
fn refusal(model: &ModifiedPrandtlIshlinskii, initial: &[f64], drive: &[f64]) -> String {
    let started = Forward::with_initial(&CompiledModel::new(model), initial).unwrap();
    let mut stream = driven(model.forward(), &[30.0, -20.0, 10.0]);
    let before = stream.state();
    let error = stream.set_state(&driven(started, drive).state()).unwrap_err();
    assert_eq!(stream.state(), before);
    error.to_string()
}

#[test]
fn turning_points_that_are_wiped_out_no_longer_are_of_no_account() {
    // The fall to 0 moved the first play alone, and the rise to 5 has moved it on: what is left of the three reversals
    // is 10 and 5, and a drive to 10 and then to 5 would leave the first play at 6.
    let [mut turning, mut bank] = forwards(&plays(&[0.0, 1.0, 6.0]));
    run(&mut turning, &[10.0, 0.0, 5.0, 4.5]);
    assert_eq!(turning.turning_points(), [10.0, 5.0]);
    bank.set_state(&turning.state()).unwrap();
    assert_eq!(outputs(&bank), [4.5, 4.0, 4.0]);

    let [mut again, _] = forwards(&plays(&[0.0, 1.0, 6.0]));
    again.set_state(&bank.state()).unwrap();
    assert_eq!(run(&mut again, &[9.0, -8.0, 3.0]), run(&mut turning, &[9.0, -8.0, 3.0]));
}

#[test]
fn the_branch_that_a_bank_is_on_is_no_turning_point() {
    for (drive, expected) in [
        (&[][..], &[][..]),
        (&[6.0], &[]),
        (&[-6.0], &[]),
        (&[6.0, 2.0], &[6.0]),
        (&[-6.0, -2.0], &[-6.0]),
        (&[8.0, 0.0, 5.0], &[0.0]),
        (&[60.0, 0.0, 5.0], &[60.0, 0.0]),
        (&[-60.0, 0.0, -5.0, -3.0], &[-60.0, 0.0, -5.0]),
    ] {
        let [mut turning, bank] = forwards(&plays(&[0.0, 0.5, 1.0, 2.0, 2.75, 3.0, 40.0]));
        turning.set_state(&driven(bank, drive).state()).unwrap();
        assert_eq!(turning.turning_points(), expected, "{drive:?}");
    }
}

#[test]
fn a_reversal_that_left_operators_above_and_below_zero_is_one_turning_point() {
    // Those of 1 and 2 at 4 and 3, those of 9 and 10 at -4 and -5, and the last one still at -10.
    for sign in [1.0, -1.0] {
        let drive = [-30.0, 5.0, 4.5].map(|x| sign * x);
        let [mut turning, bank] = forwards(&plays(&[0.0, 1.0, 2.0, 9.0, 10.0, 20.0]));
        assert_eq!(driven(turning.clone(), &drive).turning_points(), drive[..2]);
        turning.set_state(&driven(bank, &drive).state()).unwrap();
        assert_eq!(turning.turning_points(), drive[..2]);
    }
}

#[test]
fn a_reversal_at_the_very_input_is_not_put_behind_it_by_rounding() {
    // Of the second play x + rb is where it is, but z - rb is x plus a rounding.
    let x = -7.561_972_036_017_953;
    let outputs = [x, 12.179_220_943_829_758, 28.845_887_610_496_43];
    let outer = [0.0, 16.666_666_666_666_668, 33.333_333_333_333_336];
    let inner = [0.0, 19.741_192_979_847_71, 36.407_859_646_514_38];
    let model =
        ModifiedPrandtlIshlinskii::new(&[0.2, 0.0, 0.5], &outer, &inner, &inner, &outer, Offsets::default()).unwrap();
    let model = model.with_negative_weights(&[1.9, 0.0, 0.0]).unwrap();
    let mut bank = driven(Forward::with_initial(&CompiledModel::new(&model), &outputs).unwrap(), &[x]);
    let [mut turning, _] = forwards(&model);
    turning.set_state(&bank.state()).unwrap();
    assert_eq!(turning.turning_points(), [0.0; 0]);
    restored_goes_on(&turning, &[]).unwrap();
    go_on_alike(&mut bank, &mut turning, &[x, -9.0, 8.0, x, 70.0], 1e-13).unwrap();
}

#[test]
fn outputs_that_no_drive_leads_to_are_refused() {
    let unreached = "operator outputs that some drive leads to from rest";
    // The play of 1 was pushed up to 5 by an input of 6, which would have left that of 2 at 4 or more, or down by one
    // of 4, which would have left it at 6 or less.
    let model = plays(&[0.0, 1.0, 2.0]);
    assert!(refusal(&model, &[0.0, 5.0, 3.5], &[5.0]).contains(unreached));
    assert!(refusal(&model, &[0.0, 5.0, 6.5], &[5.0]).contains(unreached));
    assert!(refusal(&model, &[0.0, -5.0, -3.5], &[-5.0]).contains(unreached));
    for reached in [4.0, 6.0] {
        let started = Forward::with_initial(&CompiledModel::new(&model), &[0.0, 5.0, reached]).unwrap();
        model.forward().set_state(&driven(started, &[5.0]).state()).unwrap();
    }
}

#[test]
fn outputs_above_and_below_zero_that_no_drive_leads_to_are_refused() {
    // The fall to -4 that left the second play at -1 would have brought the third one down to 6.
    let thresholds = [[0.0; 4], [10.0, 3.0, 3.0, 10.0], [20.0, 10.0, 10.0, 20.0]];
    let column = |j: usize| thresholds.map(|row| row[j]);
    let (r, ra, rb, rc) = (column(0), column(1), column(2), column(3));
    let model = ModifiedPrandtlIshlinskii::new(&[1.0; 3], &r, &ra, &rb, &rc, Offsets::default()).unwrap();
    assert!(refusal(&model, &[0.0, -1.0, 7.0], &[0.0]).contains("some drive leads to from rest"));
    let started = Forward::with_initial(&CompiledModel::new(&model), &[0.0, -1.0, 6.0]).unwrap();
    model.forward().set_state(&driven(started, &[0.0]).state()).unwrap();
}

#[test]
fn outputs_before_the_first_sample_are_refused_unless_at_rest() {
    let model = plays(&[0.0, 1.0, 2.0]);
    assert!(refusal(&model, &[0.0, 1.5, 1.5], &[]).contains("that the last input has led to"));
    assert!(refusal(&model, &[0.5, 0.0, 0.0], &[]).contains("that the last input has led to"));
    let started = Forward::with_initial(&CompiledModel::new(&model), &[0.0, 1.0, 0.5]).unwrap();
    model.forward().set_state(&started.state()).unwrap();
}

#[test]
fn what_a_bank_refuses_is_refused_by_turning_points_too() {
    let [mut turning, bank] = forwards(&plays(&[0.0, 1.0]));
    let good = driven(bank, &[3.0]).state();
    let with = |outputs: &[f64]| MemoryState::Bank(BankState { outputs: outputs.into(), line: None, small_moves: 0 });
    for (memory, words) in [
        (with(&[3.0, 2.0, 1.0]), "one finite output for each operator"),
        (with(&[3.0, f64::NAN]), "one finite output for each operator"),
        (with(&[3.0, 2.1]), "sum to the output"),
    ] {
        let error = turning.set_state(&StreamState { memory, ..good.clone() }).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
    turning.set_state(&good).unwrap();
}

#[test]
fn turning_points_that_no_drive_has_left_are_refused_by_a_bank() {
    let model = plays(&[0.0, 2.0]);
    let [turning, mut bank] = forwards(&model);
    let good = driven(turning, &[4.0, 1.0]).state();
    let MemoryState::TurningPoints(memory) = &good.memory else { panic!("nested thresholds") };
    // Both families at 2: nothing of it is in the output here, nor in that at the turning points.
    let mut both = memory.clone();
    both.negative = both.positive.clone();
    both.negative.turning_points[0].output = -4.0 - 2.0;
    let state = StreamState { last_output: 1.0, memory: MemoryState::TurningPoints(both), ..good.clone() };
    assert!(bank.set_state(&state).unwrap_err().to_string().contains("each operator on one side of zero"));

    let mut elsewhere = memory.clone();
    elsewhere.positive.turning_points[0].output += 1e-3;
    let state = StreamState { memory: MemoryState::TurningPoints(elsewhere), ..good };
    assert!(bank.set_state(&state).unwrap_err().to_string().contains("turning points with the outputs"));
    assert_eq!(bank.state(), forwards(&model)[1].state());
}

#[test]
fn a_bank_of_thresholds_that_are_not_nested_takes_no_turning_points() {
    let [rows, weights] = [[0.0, 2.0, 4.0], [1.0, 0.5, 0.5]];
    let (zeros, falls) = ([0.0; 3], [0.0, 2.0, 1.0]);
    let crossed = ModifiedPrandtlIshlinskii::new(&weights, &rows, &rows, &falls, &zeros, Offsets::default()).unwrap();
    let mut bank = crossed.forward();
    assert_eq!(bank.method(), Method::Bank);
    let nested = plays(&[0.0, 2.0, 4.0]).forward().state();
    let state = StreamState { model: bank.state().model, ..nested };
    assert!(bank.set_state(&state).unwrap_err().to_string().contains("not nested have no turning points"));
}

#[test]
fn operators_in_any_order_keep_their_outputs_also_behind_another_model() {
    let of = |weights: &[f64], r: &[f64]| {
        CompiledModel::new(
            &ModifiedPrandtlIshlinskii::from_ratios(weights, r, Ratios::PAPER, Offsets::default()).unwrap(),
        )
    };
    let (one, other) = (of(&[0.5, 1.0, 0.5], &[6.0, 0.0, 2.0]), of(&[0.5, 1.0, 0.5], &[2.0, 0.0, 6.0]));
    let drive = [20.0, 4.0, 9.0];
    let mut turning = driven(Forward::new(&one), &drive);
    turning.set_model(&other).unwrap();
    let mut bank = Forward::with_method(&other, Method::Bank).unwrap();
    bank.set_state(&turning.state()).unwrap();
    let expected = driven(Forward::with_method(&other, Method::Bank).unwrap(), &drive);
    assert_eq!(outputs(&bank), outputs(&expected));
    turning.set_state(&expected.state()).unwrap();
    for sample in [2.0, -30.0, 7.0] {
        assert!((turning.step(sample) - bank.step(sample)).abs() < 1e-12);
    }
}

#[test]
fn ten_thousand_operators_take_no_longer_than_sorting_them() {
    // Every swing leaves one operator more behind.
    let thresholds: Vec<f64> = (0..10_000).map(f64::from).collect();
    let drive: Vec<f64> = (0..10_000_i32).rev().map(|k| (f64::from(k) + 0.25) * f64::from(1 - 2 * (k % 2))).collect();
    let [mut turning, bank] = forwards(&plays(&thresholds));
    let mut bank = driven(bank, &drive);
    turning.set_state(&bank.state()).unwrap();
    assert!(turning.turning_points().len() > 9000);
    for sample in [5000.5, -8000.5, 20_000.0] {
        assert!((turning.step(sample) - bank.step(sample)).abs() < 1e-12 * 1e8);
    }
}
