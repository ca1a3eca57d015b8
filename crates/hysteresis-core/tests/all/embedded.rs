//! Streams of a fixed size: with f64 those of the heap bit for bit, with f32 within 1e-6 of the range.

use crate::support::{REACH, any_nested_model, history, invertible_model, oscillations, unnested_model};
use hysteresis_core::embedded::{Forward, Inverse, Model};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Process, Ratios};
use proptest::collection::vec;
use proptest::prelude::*;

/// Room for the operators of every model of these tests.
const ROOM: usize = 100;

/// What no stream takes.
const BAD: [f64; 4] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e101];

/// Jumps, small moves, swings, slow sines, noise within one operator, and now and then a number that no stream takes.
fn mixed() -> impl Strategy<Value = Vec<f64>> {
    let smooth = (0.0..2.0 * REACH, 0.001..0.3_f64, 1..300_u32)
        .prop_map(|(swing, pace, n)| (0..n).map(|k| swing * (pace * f64::from(k)).sin()).collect());
    let noise = vec(-2.0 * REACH..2.0 * REACH, 1..200);
    let bad = (0..BAD.len()).prop_map(|i| vec![BAD[i]]);
    vec(prop_oneof![2 => history(60), 1 => oscillations(), 2 => smooth, 1 => noise, 1 => bad], 1..6)
        .prop_map(|parts| parts.concat())
}

/// The output of the model from one end of what histories reach to the other.
fn range(model: &ModifiedPrandtlIshlinskii) -> f64 {
    let mut stream = model.forward();
    stream.step(2.0 * REACH) - stream.step(-2.0 * REACH)
}

/// The bound of f32, relative to the range of the output.
const SINGLE: f64 = 1e-6;

#[expect(clippy::cast_possible_truncation, reason = "what a firmware that works with f32 gets")]
fn single(x: f64) -> f32 {
    x as f32
}

proptest! {
    #[test]
    fn forward_has_the_bits_of_the_heap(model in any_nested_model(40), x in mixed(), probe in -REACH..REACH) {
        let embedded = Model::<f64, 40>::try_from(&model).unwrap();
        let (mut heap, mut owner, mut guest) = (model.forward(), Forward::new(embedded.clone()), Forward::new(&embedded));
        for x in x {
            prop_assert_eq!(owner.peek(probe).to_bits(), heap.peek(probe).to_bits());
            let expected = heap.step(x).to_bits();
            prop_assert_eq!((owner.step(x).to_bits(), guest.step(x).to_bits()), (expected, expected));
            prop_assert_eq!((owner.output().to_bits(), owner.rejected()), (heap.output().to_bits(), heap.rejected()));
        }
        owner.reset();
        prop_assert_eq!(owner.step(probe).to_bits(), model.forward().step(probe).to_bits());
    }

    #[test]
    fn inverse_has_the_bits_of_the_heap(
        model in invertible_model(40),
        y in mixed(),
        probe in -REACH..REACH,
        limits in prop_oneof![Just(None), Just(Some((-60.0, 80.0))), Just(Some((5.0, 60.0)))],
    ) {
        let embedded = Model::<f64, 40>::try_from(&model).unwrap();
        let (mut heap, mut inverse) = (model.inverse(limits).unwrap(), Inverse::new(&embedded, limits).unwrap());
        for (k, y) in y.into_iter().enumerate() {
            prop_assert_eq!(inverse.peek(probe).to_bits(), heap.peek(probe).to_bits());
            if k % 7 == 6 {
                prop_assert_eq!(inverse.follow_drive(y).to_bits(), heap.follow_drive(y).to_bits());
            } else {
                prop_assert_eq!(inverse.step(y).to_bits(), heap.step(y).to_bits());
            }
            prop_assert_eq!(inverse.output().to_bits(), heap.output().to_bits());
            prop_assert_eq!(inverse.reached().to_bits(), heap.reached().to_bits());
            prop_assert_eq!((inverse.saturated(), inverse.rejected()), (heap.saturated(), heap.rejected()));
        }
        inverse.reset();
        prop_assert_eq!(inverse.step(probe).to_bits(), model.inverse(limits).unwrap().step(probe).to_bits());
    }

    #[test]
    fn f32_forward_is_within_1e_6_of_the_range(model in invertible_model(ROOM), x in mixed()) {
        let (mut wide, mut narrow) = (model.forward(), Forward::new(Model::<f32, ROOM>::try_from(&model).unwrap()));
        let tolerance = SINGLE * range(&model);
        for x in x {
            let (y, error) = (wide.step(f64::from(single(x))), f64::from(narrow.step(single(x))));
            prop_assert!((y - error).abs() <= tolerance, "{error} and {y} at {x}: {}", (y - error) / tolerance);
        }
        prop_assert_eq!(narrow.rejected(), wide.rejected());
    }

    #[test]
    fn f32_inverse_is_undone_within_1e_6_of_the_range(
        model in invertible_model(ROOM),
        x in mixed(),
        limits in prop_oneof![Just((-2.0 * REACH, 2.0 * REACH)), Just((-60.0, 80.0))],
    ) {
        // Targets that the drive x would reach; the true actuator, in f64, and the model in f32 follow the drive of the
        // inverse.
        let (mut targets, mut actuator) = (model.forward(), model.forward());
        let embedded = Model::<f32, ROOM>::try_from(&model).unwrap();
        let mut narrow = Forward::new(&embedded);
        let (low, high) = (single(limits.0), single(limits.1));
        let mut inverse = Inverse::new(&embedded, Some((low, high))).unwrap();
        let tolerance = SINGLE * range(&model);
        for x in x {
            let y = targets.step(x);
            let drive = inverse.step(single(y));
            prop_assert!((low..=high).contains(&drive), "{drive}");
            let (truth, own) = (actuator.step(f64::from(drive)), f64::from(narrow.step(drive)));
            prop_assert!((truth - own).abs() <= tolerance, "{own} and {truth} at {drive}");
            if !inverse.saturated() {
                prop_assert!((truth - y).abs() <= tolerance, "{truth}, not {y}: {}", (truth - y) / tolerance);
            }
            prop_assert!((f64::from(inverse.reached()) - truth).abs() <= tolerance, "{} {truth}", inverse.reached());
        }
    }

    #[test]
    fn no_number_takes_the_drive_beyond_its_limits(y in vec(prop_oneof![any::<f32>(), -300.0..300.0_f32], 1..100)) {
        let (w, r) = ([1.0, 0.5, 0.25], [0.0, 20.0, 40.0]);
        let model = Model::<f32, 3>::from_ratios(&w, &r, Ratios::PAPER, Offsets { input: 3.0, output: -7.0 }).unwrap();
        let mut inverse = Inverse::new(model, Some((-20.0, 150.0))).unwrap();
        let mut rejected = 0;
        for y in y {
            let before = inverse.output();
            let drive = inverse.step(y);
            prop_assert!((-20.0..=150.0).contains(&drive), "{drive}");
            let taken = y.abs() <= 1e11;
            if !taken {
                rejected += 1;
                prop_assert_eq!(drive.to_bits(), before.to_bits());
            }
            prop_assert_eq!(inverse.rejected(), rejected);
        }
    }

    #[test]
    fn thresholds_must_be_nested(model in unnested_model()) {
        let error = Model::<f64, 3>::try_from(&model).unwrap_err();
        prop_assert_eq!(error.parameter(), Some("rb"));
        prop_assert!(error.to_string().contains("nested"), "{}", error);
    }
}

#[test]
fn constructors_agree_with_those_of_the_heap() {
    let (w, r) = ([1.0, 0.5, 0.25], [0.0, 2.0, 4.0]);
    let offsets = Offsets { input: 0.5, output: -1.0 };
    let scaled = |ratio: f64| r.map(|r| ratio * r);
    let (ra, rb, rc) = (scaled(0.95), scaled(0.30), scaled(0.35));
    let v = [1.0, 0.25, 0.5];
    let pairs = [
        (Model::<f64, 5>::conventional(&w, &r, offsets), (&PrandtlIshlinskii::new(&w, &r, offsets).unwrap()).into()),
        (
            Model::from_ratios(&w, &r, Ratios::PAPER, offsets),
            ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PAPER, offsets).unwrap(),
        ),
        (
            Model::new(&w, &r, &ra, &rb, &rc, offsets),
            ModifiedPrandtlIshlinskii::new(&w, &r, &ra, &rb, &rc, offsets).unwrap(),
        ),
        (
            Model::split(&w, &v, [&r, &ra, &rb, &rc], offsets),
            ModifiedPrandtlIshlinskii::new(&w, &r, &ra, &rb, &rc, offsets).unwrap().with_negative_weights(&v).unwrap(),
        ),
    ];
    for (embedded, heap) in pairs {
        let (mut embedded, mut heap) = (Forward::new(embedded.unwrap()), heap.forward());
        for x in [5.0, -3.0, 4.0, 1.0, 9.0, -9.0] {
            assert_eq!(embedded.step(x), heap.step(x));
        }
    }
}

#[test]
fn what_no_model_may_have_is_refused_by_name() {
    let offsets = Offsets::default();
    let of = |w: &[f64], r: &[f64]| Model::<f32, 2>::conventional(w, r, offsets).map(drop).unwrap_err().to_string();
    assert_eq!(of(&[], &[]), "weights: expected at least one element, got none");
    assert_eq!(of(&[1.0; 3], &[0.0; 3]), "weights: expected at most as many as the model has room for, got 3");
    assert_eq!(of(&[1.0; 2], &[0.0]), "thresholds: expected 2 elements, got 1");
    assert_eq!(
        of(&[1.0, f64::NAN], &[0.0; 2]),
        "weights[1]: expected a finite number (at most 1e100 in magnitude), got NaN"
    );
    assert_eq!(
        of(&[1.0, 1e12], &[0.0; 2]),
        "weights[1]: expected a finite number (at most 1e11 in magnitude), got 1000000000000.0"
    );
    assert_eq!(of(&[1.0; 2], &[0.0, -1.0]), "thresholds[1]: expected a finite number >= 0, got -1.0");
    let far = Offsets { input: 0.0, output: 1e30 };
    let error = Model::<f32, 1>::conventional(&[1.0], &[0.0], far).unwrap_err();
    assert_eq!(error.parameter(), Some("output_offset"));
}

#[test]
fn what_has_no_inverse_is_refused() {
    let model = |w0| Model::<f32, 2>::conventional(&[w0, 1.0], &[0.0, 1.0], Offsets::default()).unwrap();
    assert!(Inverse::new(model(1e-3), None).is_ok());
    // Slopes this small are lost among the roundings of f32, not among those of f64.
    assert!(Inverse::new(model(1e-4), None).is_err());
    assert!(model(1e-4).check_invertible().is_err());
    let wide = Model::<f64, 2>::conventional(&[1e-4, 1.0], &[0.0, 1.0], Offsets::default()).unwrap();
    assert!(Inverse::new(wide, None).is_ok());
    let error = Inverse::new(model(1.0), Some((1.0, 1.0))).unwrap_err();
    assert_eq!(error.to_string(), "limits[1]: expected a number above the low limit = 1.0, got 1.0");
    assert_eq!(Inverse::new(model(1.0), Some((0.0, f32::NAN))).unwrap_err().parameter(), Some("limits"));
}

#[test]
fn drives_before_are_followed_or_refused_together() {
    let model = Model::<f32, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    let mut inverse = Inverse::new(&model, Some((-10.0, 10.0))).unwrap();
    inverse.follow(&[7.0, -3.0, 4.0]).unwrap();
    assert_eq!(inverse.output(), 4.0);
    let error = inverse.follow(&[1.0, 99.0]).unwrap_err();
    assert_eq!(error.to_string(), "drives[1]: expected a number from -10.0 to 10.0, got 99.0");
    assert_eq!(inverse.output(), 4.0);
}

#[test]
fn a_run_has_the_bits_of_its_steps() {
    let model = Model::<f32, 3>::conventional(&[1.0, 0.5, 0.25], &[0.0, 2.0, 5.0], Offsets::default()).unwrap();
    let mut samples = [0.0_f32; 203];
    for k in 1..samples.len() {
        samples[k] = samples[k - 1] + if k < 100 { 0.1 } else { -0.1 };
    }
    samples[57] = f32::NAN;
    let (mut at_once, mut one_by_one) = ([0.0; 203], [0.0; 203]);
    Forward::new(model.clone()).run(&samples, &mut at_once).unwrap();
    let mut forward = Forward::new(model.clone());
    for (sample, output) in samples.iter().zip(&mut one_by_one) {
        *output = forward.step(*sample);
    }
    assert_eq!(at_once.map(f32::to_bits), one_by_one.map(f32::to_bits));
    let limits = Some((-8.0, 8.0));
    Inverse::new(model.clone(), limits).unwrap().run(&samples, &mut at_once).unwrap();
    let mut inverse = Inverse::new(model, limits).unwrap();
    for (sample, output) in samples.iter().zip(&mut one_by_one) {
        *output = inverse.step(*sample);
    }
    assert_eq!(at_once.map(f32::to_bits), one_by_one.map(f32::to_bits));
    assert!(
        Forward::new(Model::<f32, 1>::conventional(&[1.0], &[0.0], Offsets::default()).unwrap())
            .run(&[1.0], &mut [])
            .is_err()
    );
}
