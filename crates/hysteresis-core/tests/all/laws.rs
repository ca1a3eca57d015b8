//! The laws of the engine, under the same names as in the Python tests.

use crate::support::{
    REACH, any_nested_model, bank, bank_inverse, forwards, history, inverses, invertible_model, nested_thresholds,
    output_range, run, slopes, unnested_model,
};
use hysteresis_core::{
    CompiledModel, CoupledPlay, CreepTerms, Duhem, Forward, Inverse, Method, Offsets, Play, PrandtlIshlinskii, Process,
    QuasiStatic, StreamArray, Tracked,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// Engine and bank sum in different orders: n roundings of the whole range each.
const AGREE: f64 = 1e-13;

/// The array, by `step`, `peek` and `run`, and the single streams give the same bits.
fn assert_alike<P: Process + Clone>(
    array: StreamArray<P>,
    mut singles: Vec<P>,
    samples: &[f64],
    probe: f64,
) -> Result<(), TestCaseError> {
    let (mut stepped, mut block) = (array.clone(), array);
    let width = singles.len();
    let rows: Vec<f64> = samples.iter().copied().cycle().take(samples.len().next_multiple_of(width)).collect();
    let (mut row, mut ahead, mut output) = (vec![0.0; width], vec![0.0; width], vec![0.0; rows.len()]);
    block.run(&rows, &mut output).unwrap();
    for (x, y) in rows.chunks_exact(width).zip(output.chunks_exact(width)) {
        stepped.peek(&vec![probe; width], &mut ahead).unwrap();
        stepped.step(x, &mut row).unwrap();
        for (m, single) in singles.iter_mut().enumerate() {
            prop_assert_eq!(ahead[m].to_bits(), single.peek(probe).to_bits());
            let expected = single.step(x[m]).to_bits();
            prop_assert_eq!((row[m].to_bits(), y[m].to_bits()), (expected, expected));
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn engine_equals_bank(model in any_nested_model(40), x in history(200)) {
        let mut engine = model.forward();
        prop_assert_eq!(engine.method(), Method::TurningPoints);
        let mut bank = bank(&model);
        prop_assert_eq!(bank.method(), Method::Bank);
        let tolerance = AGREE * output_range(&model);
        for x in x {
            let (one, other) = (engine.step(x), bank.step(x));
            prop_assert!((one - other).abs() <= tolerance, "{one} and {other} at {x}");
        }
    }

    #[test]
    fn slopes_keep_within_their_range(model in any_nested_model(20), x in history(100)) {
        let (least, most) = model.slope_range();
        prop_assert_eq!(CompiledModel::new(&model).slope_range(), (least, most));
        let (mut stream, tolerance) = (model.forward(), AGREE * output_range(&model));
        let mut last = (x[0], stream.step(x[0]));
        for x in x {
            let here = (x, stream.step(x));
            let (moved, rise) = ((here.0 - last.0).abs(), (here.1 - last.1) * f64::signum(here.0 - last.0));
            prop_assert!((least * moved - tolerance..=most * moved + tolerance).contains(&rise), "{rise} over {moved}");
            last = here;
        }
    }

    #[test]
    fn split_is_two_weighted_families(model in any_nested_model(20), x in history(100)) {
        // The definition, one-sided play by one-sided play: w p(x; r, rb) - v p(-x; ra, rc).
        let offsets = model.offsets();
        let mut stream = model.forward();
        let tolerance = AGREE * output_range(&model);
        let mut plays = vec![(0.0_f64, 0.0_f64); model.weights().len()];
        for x in x {
            let u = x - offsets.input;
            let mut expected = offsets.output;
            for (i, (z, (p, q))) in model.operators().iter().zip(&mut plays).enumerate() {
                *p = f64::max(0.0, f64::max(u - z.r(), f64::min(u + z.rb(), *p)));
                *q = f64::max(0.0, f64::max(-u - z.ra(), f64::min(-u + z.rc(), *q)));
                expected += model.weights()[i] * *p - model.weights_negative()[i] * *q;
            }
            prop_assert!((stream.step(x) - expected).abs() <= tolerance);
        }
    }

    #[test]
    fn coupled_play_is_two_one_sided_plays(t in nested_thresholds(1), x in history(50)) {
        let [r, ra, rb, rc] = t[0];
        let mut z = Tracked::new(CoupledPlay::new(r, ra, rb, rc).unwrap());
        let (mut positive, mut negative) = (0.0_f64, 0.0_f64);
        for x in x {
            positive = f64::max(0.0, f64::max(x - r, f64::min(x + rb, positive)));
            negative = f64::max(0.0, f64::max(-x - ra, f64::min(-x + rc, negative)));
            prop_assert_eq!(z.step(x), positive - negative);
        }
    }

    #[test]
    fn play_is_coupled_play_with_equal_thresholds(r in 0.0..REACH, x in history(50)) {
        let play = Play::new(r).unwrap();
        let mut coupled = Tracked::new(CoupledPlay::from(play));
        let mut plain = Tracked::new(play);
        for x in x {
            prop_assert_eq!(plain.step(x), coupled.step(x));
        }
    }

    #[test]
    fn sampling_independence(model in any_nested_model(20), x in history(40), parts in 1_u32..20) {
        // Bit for bit: on a branch the line is a function of the input and the turning points alone.
        let (mut whole, mut split) = (model.forward(), model.forward());
        let mut last = model.offsets().input;
        for x in x {
            for part in 1..parts {
                split.step(last + (x - last) * f64::from(part) / f64::from(parts));
            }
            prop_assert_eq!(whole.step(x).to_bits(), split.step(x).to_bits());
            last = x;
        }
    }

    #[test]
    fn wiping_out(model in any_nested_model(20), x in history(60), y in history(60)) {
        // A full stroke both ways leaves no trace of what was before.
        let stroke = [4.0 * REACH, -4.0 * REACH];
        let (mut one, mut other) = (model.forward(), model.forward());
        run(&mut one, &x);
        run(&mut one, &stroke);
        run(&mut other, &stroke);
        for y in y {
            prop_assert_eq!(one.step(y).to_bits(), other.step(y).to_bits());
        }
    }

    #[test]
    fn return_point_memory(model in any_nested_model(20), x in history(60), inner in 0.0..1.0) {
        // A small excursion that comes back to where it began changes nothing.
        let mut stream = model.forward();
        run(&mut stream, &x);
        let (turn, before) = (x[x.len() - 1], if x.len() > 1 { x[x.len() - 2] } else { model.offsets().input });
        let mut excursion = stream.clone();
        excursion.step(turn + (before - turn) * inner);
        let tolerance = AGREE * output_range(&model);
        prop_assert!((excursion.step(turn) - stream.peek(turn)).abs() <= tolerance);
    }

    #[test]
    fn congruency(model in any_nested_model(20), a in history(20), b in history(20), low in -150.0..0.0, high in 0.0..150.0) {
        // Loops between the same two inputs are congruent whatever came before.
        let swing = |history: &[f64]| {
            let mut stream = model.forward();
            run(&mut stream, history);
            run(&mut stream, &[low, high]);
            stream.step(low) - stream.step(high)
        };
        prop_assert!((swing(&a) - swing(&b)).abs() <= AGREE * output_range(&model));
    }

    #[test]
    fn monotone_and_lipschitz(model in invertible_model(30), x in history(60), one in -2.0 * REACH..2.0 * REACH, other in -2.0 * REACH..2.0 * REACH) {
        // w_0 <= slope <= sum w, between any two inputs that may come next.
        let mut stream = model.forward();
        run(&mut stream, &x);
        let (low, high) = (one.min(other), one.max(other));
        let rise = stream.peek(high) - stream.peek(low);
        let tolerance = AGREE * output_range(&model);
        let (least, most) = slopes(&model);
        prop_assert!(rise >= least * (high - low) - tolerance);
        prop_assert!(rise <= most * (high - low) + tolerance);
    }

    #[test]
    fn inverse_undoes_forward(model in invertible_model(60), x in history(200)) {
        let mut forward = model.forward();
        let mut inverse = model.inverse(None).unwrap();
        for x in x {
            let back = inverse.step(forward.step(x));
            prop_assert!((back - x).abs() <= 1e-12 * 4.0 * REACH, "{x} came back as {back}");
        }
    }

    #[test]
    fn forward_undoes_inverse(model in invertible_model(60), y in history(200)) {
        let mut forward = model.forward();
        let mut inverse = model.inverse(None).unwrap();
        let tolerance = 1e-12 * output_range(&model);
        for y in y {
            let back = forward.step(inverse.step(y));
            prop_assert!((back - y).abs() <= tolerance, "{y} came back as {back}");
        }
    }

    #[test]
    fn bank_inverse_undoes_forward(model in prop_oneof![invertible_model(20), unnested_model()], x in history(100)) {
        let (mut forward, mut inverse) = (bank(&model), bank_inverse(&model, None));
        for x in x {
            let back = inverse.step(forward.step(x));
            prop_assert!((back - x).abs() <= 1e-11 * 4.0 * REACH, "{x} came back as {back}");
        }
    }

    #[test]
    fn unnested_thresholds_go_to_the_bank(model in unnested_model()) {
        prop_assert_eq!(model.forward().method(), Method::Bank);
    }

    #[test]
    fn out_of_reach_clamps_and_says_so(model in invertible_model(20), y in history(100), span in (-80.0..-1.0, 1.0..80.0)) {
        let limits = (model.offsets().input + span.0, model.offsets().input + span.1);
        let tolerance = 1e-12 * output_range(&model);
        for mut inverse in inverses(&model, Some(limits)) {
            let mut forward = model.forward();
            for y in &y {
                let (least, most) = (forward.peek(limits.0), forward.peek(limits.1));
                let drive = inverse.step(*y);
                prop_assert!(limits.0 <= drive && drive <= limits.1);
                let reached = forward.step(drive);
                // The model moves to where the target clamped to its reach is: also back from a limit, without a jump.
                prop_assert!((reached - y.clamp(least, most)).abs() <= tolerance, "{reached} instead of {y}");
                if *y > most + tolerance || *y < least - tolerance {
                    prop_assert!(inverse.saturated());
                }
                if least + tolerance < *y && *y < most - tolerance {
                    prop_assert!(!inverse.saturated());
                }
            }
        }
    }

    #[test]
    fn non_finite_input_holds(model in invertible_model(20), x in history(60), bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(1e300)]) {
        let limits = Some((model.offsets().input - 30.0, model.offsets().input + 30.0));
        let (mut forward, mut inverse) = (model.forward(), model.inverse(limits).unwrap());
        for x in x {
            let (y, drive) = (forward.step(x), inverse.step(x));
            let (forward_memory, inverse_memory) = (forward.state().memory, inverse.state().memory);
            prop_assert_eq!(forward.peek(bad), y);
            prop_assert_eq!(inverse.peek(bad), drive);
            prop_assert_eq!(forward.step(bad), y);
            prop_assert_eq!(inverse.step(bad), drive);
            prop_assert_eq!(forward.state().memory, forward_memory);
            prop_assert_eq!(inverse.state().memory, inverse_memory);
        }
        prop_assert!(forward.rejected() > 0 && forward.rejected() == inverse.rejected());
    }

    #[test]
    fn peek_changes_nothing(model in invertible_model(20), x in history(60), probe in -2.0 * REACH..2.0 * REACH) {
        let limits = Some((-50.0, 50.0));
        for (mut forward, mut inverse) in forwards(&model).into_iter().zip(inverses(&model, limits)) {
            for x in &x {
                let (forward_state, inverse_state) = (forward.state(), inverse.state());
                forward.peek(probe);
                inverse.peek(probe);
                let (y, drive) = (forward.peek(*x), inverse.peek(*x));
                prop_assert_eq!(forward.state(), forward_state);
                prop_assert_eq!(inverse.state(), inverse_state);
                prop_assert_eq!(forward.step(*x).to_bits(), y.to_bits());
                prop_assert_eq!(inverse.step(*x).to_bits(), drive.to_bits());
            }
        }
    }

    #[test]
    fn the_same_sample_again_changes_nothing(model in any_nested_model(20), x in history(60)) {
        for mut forward in forwards(&model) {
            for x in &x {
                let output = forward.step(*x);
                let state = forward.state();
                prop_assert_eq!(forward.peek(*x).to_bits(), output.to_bits());
                prop_assert_eq!(forward.step(*x).to_bits(), output.to_bits());
                prop_assert_eq!(forward.state(), state);
            }
        }
    }

    #[test]
    fn run_equals_step(model in invertible_model(20), x in history(40), parts in 1_u32..40, bad in vec(any::<prop::sample::Index>(), 0..3)) {
        // In many parts, so that whole blocks lie on a line; some samples are refused.
        let mut x: Vec<f64> = x.windows(2).flat_map(|ends| {
            (0..parts).map(|part| ends[0] + (ends[1] - ends[0]) * f64::from(part) / f64::from(parts))
        }).collect();
        for place in if x.is_empty() { Vec::new() } else { bad } {
            *place.get_mut(&mut x) = f64::NAN;
        }
        let mut block = vec![0.0; x.len()];
        // Also from outputs that no input has led to.
        let odd: Vec<f64> = (0..model.weights().len()).map(|i| if i % 2 == 0 { REACH } else { -REACH }).collect();
        let from_odd = Forward::with_initial(&CompiledModel::new(&model), &odd).unwrap();
        for mut forward in forwards(&model).into_iter().chain([from_odd]) {
            let mut at_once = forward.clone();
            at_once.run(&x, &mut block).unwrap();
            prop_assert_eq!(&run(&mut forward, &x), &block);
            prop_assert_eq!(forward.state(), at_once.state());
        }
        for limits in [None, Some((model.offsets().input - 60.0, model.offsets().input + 60.0))] {
            for mut inverse in inverses(&model, limits) {
                let mut at_once = inverse.clone();
                at_once.run(&x, &mut block).unwrap();
                prop_assert_eq!(&run(&mut inverse, &x), &block);
                prop_assert_eq!(inverse.state(), at_once.state());
            }
        }
    }

    /// Why an inverse compares its input with the reach alone, before it adds the offset.
    #[test]
    fn no_input_within_a_reach_is_beyond_its_limit(limit in number(), offset in number(), ulps in 1..4_u64) {
        let (reach, near) = (limit - offset, |x: f64| (0..ulps).fold(x, |x, _| x.next_down()));
        prop_assert!(near(reach) + offset <= limit);
        prop_assert!(-near(-reach) + offset >= limit);
    }

    #[test]
    fn array_equals_independent_streams(
        models in vec(prop_oneof![3 => invertible_model(8), 1 => unnested_model()], 1..5),
        shared in 1..4_usize,
        samples in history(120),
        probe in -2.0 * REACH..2.0 * REACH,
    ) {
        // Bit for bit, with several actuators of each model and targets out of reach.
        let limits = Some((-60.0, 60.0));
        let compiled: Vec<CompiledModel> = models.iter().flat_map(|m| vec![CompiledModel::new(m); shared]).collect();
        let singles: Vec<Inverse> = compiled.iter().map(|k| Inverse::new(k, limits).unwrap()).collect();
        assert_alike(StreamArray::inverse(&compiled, limits).unwrap(), singles, &samples, probe)?;
        assert_alike(StreamArray::forward(&compiled), compiled.iter().map(Forward::new).collect(), &samples, probe)?;
        let creep = CreepTerms::new(&[0.1, 0.01], &[0.9, 0.99]).unwrap();
        let duhem = Duhem::from_bouc_wen(0.5, 0.02, 0.9, 0.4).unwrap();
        let stage = |k| QuasiStatic::new(k).with_creep(creep.clone()).with_duhem(duhem);
        let stages: Vec<QuasiStatic> = compiled.iter().map(stage).collect();
        let inverses: Vec<_> = stages.iter().map(|stage| stage.inverse(limits).unwrap()).collect();
        assert_alike(inverses.iter().cloned().collect(), inverses, &samples, probe)?;
        let forwards: Vec<_> = stages.iter().map(QuasiStatic::forward).collect();
        assert_alike(forwards.iter().cloned().collect(), forwards, &samples, probe)?;
    }
}

/// Numbers of any magnitude, many of them alike.
fn number() -> impl Strategy<Value = f64> {
    (-1e3..1e3_f64, prop_oneof![4 => -3..3_i32, 1 => -300..98_i32])
        .prop_map(|(digits, power)| digits * 10_f64.powi(power))
}

/// Where the output is near zero, its targets are finer than drives: by rounding many are at the very limit, or beyond.
#[test]
fn run_equals_step_where_targets_round_to_a_limit() {
    for (k, side) in (1..=100).flat_map(|k| [(f64::from(k), 1.0), (f64::from(k), -1.0)]) {
        let (offset, near) = (-0.37 * side * k, 0.1 * side * k);
        let reach = side * (near - offset);
        let far = offset - 10.0 * side * reach;
        // From the far limit on, the output is 2 x - 2 reach: zero at the near one.
        let offsets = Offsets { input: offset, output: 0.0 };
        let model = PrandtlIshlinskii::new(&[1.0, 1.0], &[0.0, 2.0 * reach], offsets).unwrap();
        let mut inverse = model.inverse(Some((near.min(far), near.max(far)))).unwrap();
        inverse.step(-100.0 * side * reach);
        inverse.step(-side * reach);
        let targets: Vec<f64> = (1..=64).map(|i| 1e-17 * side * reach * f64::from(i - 64)).collect();
        let mut block = [0.0; 64];
        inverse.clone().run(&targets, &mut block).unwrap();
        assert_eq!(run(&mut inverse, &targets), block, "{k} {side}");
        assert!(block.iter().all(|drive| side * drive <= side * near), "{k} {side}");
    }
}

/// An array takes first what is on its line, a hundred and some streams at a time.
#[test]
fn hundreds_of_actuators_equal_independent_streams() {
    const ACTUATORS: u32 = 300;
    let compiled: Vec<CompiledModel> = (0..ACTUATORS)
        .map(|m| {
            let r: Vec<f64> = (0..8).map(|i| f64::from(i) * (1.0 + f64::from(m) / 300.0)).collect();
            CompiledModel::new(&(&PrandtlIshlinskii::new(&[0.5; 8], &r, Offsets::default()).unwrap()).into())
        })
        .collect();
    // Small moves and jumps; every 101st sample is none.
    let sample = |k: u32| match k {
        _ if k % 101 == 100 => f64::NAN,
        _ if k.is_multiple_of(7) => 20.0 * f64::from(k % 97) / 97.0 - 10.0,
        _ => 6.0 * (f64::from(k / ACTUATORS) / 5.0 + f64::from(k % ACTUATORS)).sin(),
    };
    let samples: Vec<f64> = (0..40 * ACTUATORS).map(sample).collect();
    let limits = Some((-9.0, 9.0));
    let singles: Vec<Inverse> = compiled.iter().map(|k| Inverse::new(k, limits).unwrap()).collect();
    assert_alike(StreamArray::inverse(&compiled, limits).unwrap(), singles, &samples, 1.0).unwrap();
    for method in [Method::TurningPoints, Method::Bank] {
        let singles: Vec<Forward> = compiled.iter().map(|k| Forward::with_method(k, method).unwrap()).collect();
        assert_alike(singles.iter().cloned().collect(), singles, &samples, 1.0).unwrap();
    }
}

#[test]
fn an_operator_alone_goes_on_behind_what_it_followed() {
    let mut play = Tracked::new(Play::new(1.0).unwrap());
    play.follow(&[5.0, 2.5]).unwrap();
    assert_eq!((play.state(), play.peek(2.0), play.step(4.5)), (3.5, 3.0, 3.5));
    assert!(play.follow(&[1.0, f64::NAN]).is_err());
    assert_eq!(play.state(), 3.5);
}
