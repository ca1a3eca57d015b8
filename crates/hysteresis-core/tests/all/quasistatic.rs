//! Laws of the stage without fast dynamics: maps, hysteresis, loop shift, relaxing plays, slow gain and creep, forward
//! and inverse.

use hysteresis_core::{
    Bracket, CompiledModel, CreepTerms, Duhem, Error, LoopShiftTerms, MAX_KNOTS, ModifiedPrandtlIshlinskii, Offsets,
    PiecewiseLinearMap, PrandtlIshlinskii, Process, QuasiStatic, QuasiStaticForward, QuasiStaticInverse,
    QuasiStaticState, Ratios, RelaxingPlayTerms, SlowGainTerms,
};
use proptest::prelude::*;

const LIMITS: (f64, f64) = (-20.0, 150.0);

/// A strictly monotone map over about the given range, slopes within a factor of four.
fn map(low: f64, high: f64) -> impl Strategy<Value = PiecewiseLinearMap> {
    (proptest::collection::vec((0.5..2.0, 0.5..2.0), 1..6), any::<bool>()).prop_map(move |steps| {
        let (steps, falling) = steps;
        let total: (f64, f64) = steps.iter().fold((0.0, 0.0), |sum, step| (sum.0 + step.0, sum.1 + step.1));
        let (mut x, mut y) = (vec![low], vec![low]);
        for (dx, dy) in steps {
            x.push(x[x.len() - 1] + dx / total.0 * (high - low));
            y.push(y[y.len() - 1] + dy / total.1 * (high - low));
        }
        if falling {
            for y in &mut y {
                *y = low + high - *y;
            }
        }
        PiecewiseLinearMap::new(&x, &y).unwrap()
    })
}

fn hysteresis() -> impl Strategy<Value = ModifiedPrandtlIshlinskii> {
    (proptest::collection::vec(0.0..0.1, 1..24), 0.2..1.0, 0.3..1.0, -5.0..20.0_f64).prop_map(
        |(mut w, w0, ratio, offset)| {
            w[0] = w0;
            let r: Vec<f64> = (0..w.len()).map(|i| 6.0 * f64::from(u32::try_from(i).unwrap())).collect();
            let ratios = Ratios { ra: 0.9, rb: 0.9 * ratio, rc: ratio };
            ModifiedPrandtlIshlinskii::from_ratios(&w, &r, ratios, Offsets { input: offset, output: 0.1 }).unwrap()
        },
    )
}

fn creep() -> impl Strategy<Value = CreepTerms> {
    proptest::collection::vec((-0.02..0.02, 0.0..1.0), 0..4).prop_map(|terms| {
        let (c, a): (Vec<f64>, Vec<f64>) = terms.into_iter().unzip();
        CreepTerms::new(&c, &a).unwrap()
    })
}

/// Shifts of some percent of the range; the limit is reached by jumps, or hardly ever.
fn loop_shift() -> impl Strategy<Value = Option<LoopShiftTerms>> {
    let terms = ((-20.0..150.0), (-5.0..5.0, -5.0..5.0), 0.05..3.0, 0.0..=1.0)
        .prop_map(|(center, (c, d), limit, a)| LoopShiftTerms::new(center, 85.0, [c, d], limit, a).unwrap());
    proptest::option::weighted(0.8, terms)
}

/// Gains of any size, of drives within and beyond the half range.
fn slow_gain() -> impl Strategy<Value = Option<SlowGainTerms>> {
    let terms = (20.0..200.0, -0.5..=0.5, -50.0..150.0, 0.0..=1.0)
        .prop_map(|(half_range, kappa, zero, a)| SlowGainTerms::new(half_range, kappa, zero, a).unwrap());
    proptest::option::weighted(0.6, terms)
}

/// From fast to slow, of weights of either sign.
fn relaxing_plays() -> impl Strategy<Value = Option<RelaxingPlayTerms>> {
    let rows = || proptest::collection::vec(proptest::collection::vec(-0.05..0.1_f64, 3), 2);
    let terms =
        ((-20.0..150.0_f64), proptest::array::uniform2(0.0..1.0_f64), rows()).prop_map(|(origin, decays, weights)| {
            RelaxingPlayTerms::new(&[0.0, 10.0, 40.0], origin, &decays, &weights).unwrap()
        });
    proptest::option::weighted(0.6, terms)
}

/// Loops of some or many percent of the range, symmetric or not; along a branch a rounding grows by two thirds at most.
/// One that falls does so by less than the hysteresis rises.
fn duhem() -> impl Strategy<Value = Option<Duhem<MAX_KNOTS>>> {
    let slope = || proptest::collection::vec(0.05..0.3_f64, 5);
    let parts = (2..6_u32, 300.0..800.0, -1.0..1.0, slope(), slope(), prop_oneof![2 => Just(1.0), 1 => Just(-0.4)]);
    let duhem = parts.prop_map(|(knots, reach, first, up, down, sign)| {
        let knots: Vec<f64> = (0..knots).map(|i| reach * (first - 0.5 + 0.3 * f64::from(i))).collect();
        let signed = |slopes: &[f64]| slopes[..knots.len()].iter().map(|f| sign * f).collect::<Vec<f64>>();
        Duhem::new(&knots, &signed(&up), &signed(&down)).unwrap()
    });
    proptest::option::weighted(0.6, duhem)
}

fn stage() -> impl Strategy<Value = QuasiStatic> {
    let parts = (
        hysteresis(),
        map(-20.0, 150.0),
        map(-20.0, 160.0),
        duhem(),
        loop_shift(),
        (relaxing_plays(), slow_gain()),
        creep(),
    );
    parts.prop_map(|(model, gamma, phi, duhem, shift, (plays, gain), creep)| {
        let stage =
            QuasiStatic::new(&CompiledModel::new(&model)).with_input_map(gamma).with_output_map(phi).with_creep(creep);
        let stage = duhem.into_iter().fold(stage, QuasiStatic::with_duhem);
        let stage = shift.into_iter().fold(stage, QuasiStatic::with_loop_shift);
        let stage = plays.into_iter().fold(stage, QuasiStatic::with_relaxing_plays);
        gain.into_iter().fold(stage, QuasiStatic::with_slow_gain)
    })
}

/// Drives of all kinds within the limits: slow ramps, jumps, plateaus.
fn drives() -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec((LIMITS.0..LIMITS.1, 1_u32..12), 1..20).prop_map(|ways| {
        let mut drives = vec![ways[0].0];
        for (to, samples) in ways {
            let from = drives[drives.len() - 1];
            drives.extend((1..=samples).map(|k| from + (to - from) * f64::from(k) / f64::from(samples)));
        }
        drives
    })
}

/// An inverse alone, or behind an amplifier of which this is left of a voltage after a sample.
fn inverse(stage: &QuasiStatic, left: Option<f64>, limits: Option<(f64, f64)>) -> QuasiStaticInverse {
    let inverse = stage.inverse(limits).unwrap();
    match left {
        Some(left) => inverse.behind_amplifier(left).unwrap(),
        None => inverse,
    }
}

fn left() -> impl Strategy<Value = Option<f64>> {
    proptest::option::weighted(0.6, 0.0..0.9_f64)
}

fn run(stream: &mut impl Process, input: &[f64]) -> Vec<f64> {
    let mut output = vec![0.0; input.len()];
    stream.run(input, &mut output).unwrap();
    output
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    // Rounding only: the maps and the hysteresis each lose a few units in the last place of a range of about 200.
    #[test]
    fn forward_of_inverse_is_the_target(stage in stage(), drives in drives()) {
        let targets = run(&mut stage.forward(), &drives);
        let mut inverse = stage.inverse(Some(LIMITS)).unwrap();
        let found = run(&mut inverse, &targets);
        let reached = run(&mut stage.forward(), &found);
        for (reached, target) in reached.iter().zip(&targets) {
            prop_assert!((reached - target).abs() < 1e-11 * 200.0, "{reached} for {target}");
        }
    }

    /// The lag, then the stage, make of its drives what the lag makes of the targets.
    #[test]
    fn behind_an_amplifier_the_lagged_target_is_reached(stage in stage(), left in 0.0..0.9_f64, drives in drives()) {
        let targets = run(&mut stage.forward(), &drives);
        let mut inverse = inverse(&stage, Some(left), None);
        let (mut forward, mut voltage, mut lagged) = (stage.forward(), inverse.output(), inverse.position());
        forward.settle(voltage);
        for target in targets {
            voltage = left * voltage + (1.0 - left) * inverse.step(target);
            lagged = left * lagged + (1.0 - left) * target;
            let reached = forward.step(voltage);
            prop_assert!((reached - lagged).abs() < 1e-10 * 200.0, "{reached} for {lagged}");
        }
    }

    #[test]
    fn the_drive_never_leaves_the_limits(
        stage in stage(), left in left(), targets in proptest::collection::vec(-1e4..1e4, 1..60)
    ) {
        let (mut inverse, mut forward) = (inverse(&stage, left, Some(LIMITS)), stage.forward());
        let mut voltage = inverse.output();
        forward.settle(voltage);
        for (k, target) in targets.into_iter().enumerate() {
            let last = inverse.output();
            let between = (LIMITS.0.max(last - 30.0), LIMITS.1.min(last + 30.0));
            let is_bound = k % 3 == 2;
            let drive = if is_bound {
                inverse.step_between(target, between);
                inverse.output()
            } else {
                inverse.step(target)
            };
            prop_assert!((LIMITS.0..=LIMITS.1).contains(&drive) && drive == inverse.output());
            prop_assert!(!is_bound || (between.0..=between.1).contains(&drive));
            voltage = left.map_or(drive, |left| left * voltage + (1.0 - left) * drive);
            let reached = forward.step(voltage);
            prop_assert!((LIMITS.0..=LIMITS.1).contains(&voltage));
            if !inverse.saturated() && !is_bound && left.is_none() {
                prop_assert!((reached - target).abs() < 1e-9, "{reached} for {target}");
            }
        }
    }

    #[test]
    fn peek_changes_nothing_and_tells_the_next_step(stage in stage(), left in left(), drives in drives()) {
        let (mut forward, mut inverse) = (stage.forward(), inverse(&stage, left, Some(LIMITS)));
        for drive in drives {
            let (ahead, position) = (forward.peek(drive), forward.step(drive));
            prop_assert_eq!(ahead.to_bits(), position.to_bits());
            let (ahead, drive) = (inverse.peek(position), inverse.step(position));
            prop_assert_eq!(ahead.to_bits(), drive.to_bits());
        }
    }

    #[test]
    fn a_restored_state_continues_bit_for_bit(
        stage in stage(), left in left(), before in drives(), after in drives()
    ) {
        let made = || inverse(&stage, left, Some(LIMITS));
        let (mut forward, mut inverse) = (stage.forward(), made());
        run(&mut inverse, &run(&mut forward, &before));
        let (mut other, mut other_inverse) = (stage.forward(), made());
        other.set_state(&forward.state()).unwrap();
        other_inverse.set_state(&inverse.state()).unwrap();
        prop_assert_eq!(other_inverse.saturated(), inverse.saturated());
        prop_assert_eq!(other_inverse.output(), inverse.output());
        let positions = run(&mut forward, &after);
        prop_assert_eq!(&run(&mut other, &after), &positions);
        prop_assert_eq!(run(&mut other_inverse, &positions), run(&mut inverse, &positions));
    }

    #[test]
    fn an_inverse_that_followed_knows_the_history(stage in stage(), before in drives(), drives in drives()) {
        let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some(LIMITS)).unwrap());
        forward.settle(inverse.output());
        forward.follow(&before).unwrap();
        inverse.follow(&before).unwrap();
        let targets = run(&mut forward.clone(), &drives);
        let reached = run(&mut forward, &run(&mut inverse, &targets));
        for (reached, target) in reached.iter().zip(&targets) {
            prop_assert!((reached - target).abs() < 1e-11 * 200.0);
        }
    }

    #[test]
    fn two_streams_bracket_any_history(model in hysteresis(), before in drives(), after in drives()) {
        let compiled = CompiledModel::new(&model);
        let mut bracket = Bracket::new(&compiled, LIMITS).unwrap();
        let mut truth = model.forward();
        run(&mut truth, &before);
        let mut last = f64::INFINITY;
        for drive in after {
            let (low, high) = bracket.step(drive);
            let y = truth.step(drive);
            prop_assert!(low <= y + 1e-12 && y <= high + 1e-12, "{y} outside {low}, {high}");
            prop_assert!(bracket.width() <= last + 1e-12, "the bracket never widens");
            last = bracket.width();
        }
        bracket.step(LIMITS.0);
        bracket.step(LIMITS.1);
        prop_assert!(bracket.width().abs() < 1e-12);
    }
}

fn example() -> QuasiStatic {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 9.0], Ratios::PAPER, Offsets::default());
    QuasiStatic::new(&CompiledModel::new(&model.unwrap())).with_creep(CreepTerms::new(&[0.01], &[0.9]).unwrap())
}

#[test]
fn a_sample_that_is_not_finite_holds_and_is_counted() {
    let (mut forward, mut inverse): (QuasiStaticForward, QuasiStaticInverse) =
        (example().forward(), example().inverse(Some(LIMITS)).unwrap());
    let (position, drive) = (forward.step(30.0), inverse.step(10.0));
    for bad in [f64::NAN, f64::INFINITY, -1e101] {
        assert_eq!((forward.step(bad), inverse.step(bad), inverse.follow_drive(bad)), (position, drive, drive));
    }
    assert_eq!((forward.rejected(), inverse.rejected()), (3, 6));
    assert_eq!(forward.step(30.0), example().forward().step(30.0) + 0.01 * (1.0 - 0.9) * position);
}

/// What is refused behind an amplifier moves nothing: samples, states, and a lag that is none.
#[test]
fn behind_an_amplifier_bad_numbers_and_states_are_refused() {
    let mut inverse = inverse(&example(), Some(0.5), Some(LIMITS));
    inverse.step(30.0);
    let good = inverse.state();
    for bad in [f64::NAN, f64::INFINITY, -1e101] {
        let drive = inverse.output();
        assert_eq!((inverse.step(bad), inverse.peek(bad), inverse.follow_drive(bad)), (drive, drive, drive));
        inverse.step_between(bad, LIMITS);
        assert_eq!(inverse.output(), drive);
    }
    assert_eq!(inverse.rejected(), 9);
    for (place, wrong) in [(0, f64::NAN), (1, 1e3)] {
        let mut state = good.clone();
        state.loop_shift[place] = wrong;
        assert_eq!(inverse.set_state(&state).unwrap_err().parameter(), Some("state.loop_shift"));
    }
    let short = QuasiStaticState { loop_shift: vec![0.0], ..good.clone() };
    assert!(matches!(inverse.set_state(&short), Err(Error::Length { expected: 3, got: 1, .. })));
    let mut alone = example().inverse(Some(LIMITS)).unwrap();
    assert!(matches!(alone.set_state(&good), Err(Error::OtherModel { .. })));
    inverse.set_state(&good).unwrap();
    assert_eq!(inverse.state(), good);
    let slower = example().inverse(Some(LIMITS)).unwrap().behind_amplifier(0.6).unwrap();
    assert!(matches!(slower.clone().set_state(&good), Err(Error::OtherModel { .. })));
    for left in [-0.1, 1.0, f64::NAN] {
        let refused = example().inverse(None).unwrap().behind_amplifier(left).unwrap_err();
        assert_eq!(refused.parameter(), Some("left"));
    }
}

#[test]
fn an_inverse_tells_whether_a_target_is_out_of_reach() {
    let mut inverse = example().inverse(Some(LIMITS)).unwrap();
    for (target, at_limit) in [(10.0, None), (1e3, Some(LIMITS.1)), (10.0, None), (-1e3, Some(LIMITS.0)), (0.0, None)] {
        let drive = inverse.step(target);
        assert_eq!((inverse.saturated(), drive == at_limit.unwrap_or(drive)), (at_limit.is_some(), true), "{target}");
    }
}

#[test]
fn a_forward_stage_goes_on_as_the_new_model() {
    let compiled = |weights: &[f64]| {
        let model = ModifiedPrandtlIshlinskii::from_ratios(weights, &[0.0, 9.0], Ratios::PAPER, Offsets::default());
        CompiledModel::new(&model.unwrap())
    };
    let (old, new) = (compiled(&[0.5, 0.1]), compiled(&[0.6, 0.2]));
    let (mut stream, mut fresh) = (QuasiStatic::new(&old).forward(), QuasiStatic::new(&new).forward());
    assert_ne!(stream.step(30.0), fresh.step(30.0));
    stream.set_model(&new).unwrap();
    for drive in [20.0, -5.0, 40.0] {
        assert!((stream.step(drive) - fresh.step(drive)).abs() < 1e-12, "{drive}");
    }
}

#[test]
fn at_rest_for_ever_nothing_creeps() {
    let mut forward = example().forward();
    let rest = forward.settle(40.0);
    for _ in 0..100 {
        assert!((forward.step(40.0) - rest).abs() < 1e-14);
    }
    let mut inverse = example().inverse(Some(LIMITS)).unwrap();
    assert!((inverse.settle(40.0) - rest).abs() < 1e-14);
    assert!((inverse.step(rest) - 40.0).abs() < 1e-12);
}

fn with_weight(weight: f64) -> QuasiStatic {
    let model = PrandtlIshlinskii::new(&[weight], &[0.0], Offsets::default()).unwrap();
    QuasiStatic::new(&CompiledModel::new(&(&model).into()))
}

/// No part may change without the state of a stream being refused.
#[test]
fn every_part_of_a_stage_is_in_its_fingerprint() {
    let creep = |decay| CreepTerms::new(&[0.01], &[decay]).unwrap();
    let shift = |gain| LoopShiftTerms::new(0.0, 10.0, [gain, 0.0], 0.5, 0.9).unwrap();
    let slow = |kappa| SlowGainTerms::new(10.0, kappa, 0.0, 0.9).unwrap();
    let plays = |weight| RelaxingPlayTerms::new(&[1.0], 0.0, &[0.9], &[vec![weight]]).unwrap();
    let duhem = |delta| Duhem::from_bouc_wen(1.0, 0.1, 1.0, delta).unwrap();
    let map = |top| PiecewiseLinearMap::new(&[0.0, 1.0], &[0.0, top]).unwrap();
    let stages = [
        with_weight(1.0),
        with_weight(2.0),
        with_weight(1.0).with_creep(creep(0.9)),
        with_weight(1.0).with_creep(creep(0.8)),
        with_weight(1.0).with_loop_shift(shift(-3.0)),
        with_weight(1.0).with_loop_shift(shift(-2.0)),
        with_weight(1.0).with_slow_gain(slow(-0.3)),
        with_weight(1.0).with_slow_gain(slow(-0.2)),
        with_weight(1.0).with_relaxing_plays(plays(0.1)),
        with_weight(1.0).with_relaxing_plays(plays(0.2)),
        with_weight(1.0).with_duhem(duhem(1.0)),
        with_weight(1.0).with_duhem(duhem(2.0)),
        with_weight(1.0).with_input_map(map(2.0)),
        with_weight(1.0).with_input_map(map(3.0)),
        with_weight(1.0).with_output_map(map(2.0)),
    ];
    let mut fingerprints = stages.each_ref().map(QuasiStatic::fingerprint).to_vec();
    assert_eq!(fingerprints[0], with_weight(1.0).fingerprint());
    fingerprints.sort_unstable();
    fingerprints.dedup();
    assert_eq!(fingerprints.len(), stages.len());
}

#[test]
fn a_state_of_another_model_is_refused_by_name() {
    let other = example().with_creep(CreepTerms::new(&[0.01], &[0.91]).unwrap());
    let state = example().forward().state();
    let error = other.forward().set_state(&state).unwrap_err();
    assert!(matches!(error, Error::OtherModel { .. }));
    assert!(error.to_string().starts_with("state.model: expected"), "{error}");
    let inverse = example().inverse(None).unwrap().state();
    assert!(matches!(other.inverse(None).unwrap().set_state(&inverse), Err(Error::OtherModel { .. })));
}

#[test]
fn bad_maps_and_creep_are_named() {
    let names = |error: Error| error.to_string();
    let map = |x: &[f64], y: &[f64]| names(PiecewiseLinearMap::new(x, y).unwrap_err());
    assert_eq!(map(&[0.0], &[0.0]), "x: expected 2 elements, got 1");
    assert_eq!(map(&[0.0, 1.0], &[0.0]), "y: expected 2 elements, got 1");
    assert_eq!(map(&[0.0, 0.0], &[0.0, 1.0]), "x[1]: expected a number above the one before it = 0.0, got 0.0");
    assert_eq!(
        map(&[0.0, 1.0, 2.0], &[0.0, 1.0, 0.5]),
        "y[2]: expected a number above the one before it (a rising map) = 1.0, got 0.5"
    );
    assert!(map(&[0.0, f64::NAN], &[0.0, 1.0]).starts_with("x[1]: expected a finite number"));
    let creep = |c: &[f64], a: &[f64]| names(CreepTerms::new(c, a).unwrap_err());
    assert_eq!(creep(&[0.1], &[]), "decays: expected 1 elements, got 0");
    assert_eq!(creep(&[0.1], &[1.5]), "decays[0]: expected a number from 0.0 to 1.0, got 1.5");
    assert_eq!(
        names(example().inverse(Some(LIMITS)).unwrap().follow(&[0.0, 151.0]).unwrap_err()),
        "drives[1]: expected a number from -20.0 to 150.0, got 151.0"
    );
}

#[test]
fn a_drive_that_its_map_takes_too_far_holds_and_is_counted() {
    let map = PiecewiseLinearMap::new(&[0.0, 1.0], &[0.0, 2.0]).unwrap();
    let mut forward = with_weight(1.0).with_input_map(map).forward();
    let position = forward.step(3.0);
    assert_eq!((forward.peek(0.9e100), forward.step(0.9e100), forward.rejected()), (position, position, 1));
    assert_eq!((forward.step(4.0), position), (8.0, 6.0));
}

#[test]
fn a_bracket_goes_on_from_a_state_and_tells_its_limits() {
    let bracket = || Bracket::of_stage(&example(), LIMITS).unwrap();
    let (mut used, mut restored) = (bracket(), bracket());
    assert_eq!((used.limits(), used.outputs()), (LIMITS, restored.outputs()));
    assert!(used.outputs().0 < 0.0 && used.outputs().1 > 0.0);
    let narrow = [30.0, -20.0, 25.0].map(|drive| used.step(drive));
    assert_eq!(used.outputs(), narrow[2]);
    restored.set_state(&used.state()).unwrap();
    assert_eq!((restored.outputs(), restored.step(10.0)), (narrow[2], used.step(10.0)));
}

#[test]
fn a_map_tells_whether_it_rises() {
    let map = |y: [f64; 2]| PiecewiseLinearMap::new(&[0.0, 1.0], &y).unwrap();
    assert!(map([0.0, 2.0]).is_rising() && !map([2.0, 0.0]).is_rising());
}

#[test]
fn a_bracket_takes_over_what_was_driven_or_nothing() {
    let bracket = || Bracket::of_stage(&example(), LIMITS).unwrap();
    let (mut stepped, mut followed, drives) = (bracket(), bracket(), [LIMITS.1, LIMITS.0, 40.0]);
    for drive in drives {
        stepped.step(drive);
    }
    followed.follow(&drives).unwrap();
    assert_eq!(followed.outputs(), stepped.outputs());
    let error = followed.follow(&[0.0, 2.0 * LIMITS.1]).unwrap_err();
    assert!(error.to_string().starts_with("drives[1]: expected"), "{error}");
    assert_eq!(followed.outputs(), stepped.outputs());
}

#[test]
fn a_bracket_needs_weights_that_are_not_negative() {
    let model = PrandtlIshlinskii::new(&[1.0, -0.25], &[0.0, 2.0], Offsets::default()).unwrap();
    let error = Bracket::new(&CompiledModel::new(&(&model).into()), LIMITS).unwrap_err();
    assert_eq!(error.to_string(), "weights: expected a finite number >= 0, got -0.25");
}

#[test]
fn a_bracket_leaves_creep_out() {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 9.0], Ratios::PAPER, Offsets::default());
    let mut plain = Bracket::new(&CompiledModel::new(&model.unwrap()), LIMITS).unwrap();
    let mut of_stage = Bracket::of_stage(&example(), LIMITS).unwrap();
    for drive in [30.0, 30.0, -10.0, 120.0] {
        assert_eq!(of_stage.step(drive), plain.step(drive));
    }
}
