//! Several axes with hysteresis in front of or inside their dynamics: equations, laws, states, file, refusals.

use hysteresis_control::multi_axis::{
    FileError, Matrices, MultiAxisForward, MultiAxisStage, PrecompensationOptions, ScalarOperator,
};
use hysteresis_core::{Duhem, Error};
use nalgebra::DMatrix;
use proptest::prelude::*;

fn matrices() -> Matrices {
    Matrices {
        a: DMatrix::from_row_slice(3, 3, &[0.6, 0.3, 0.0, -0.3, 0.6, 0.1, 0.0, 0.0, 0.5]),
        b: DMatrix::from_row_slice(3, 2, &[0.2, 0.0, 0.1, 0.3, 0.0, 0.4]),
        bw: DMatrix::from_row_slice(3, 2, &[0.05, 0.0, 0.0, -0.04, 0.02, 0.03]),
        c: DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.2, 0.0, 1.0, -0.1]),
        d: DMatrix::from_row_slice(2, 2, &[0.0, 0.01, 0.02, 0.0]),
        cq: DMatrix::from_row_slice(2, 3, &[0.3, 0.0, 0.0, 0.0, 0.2, 0.1]),
        dq: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.8]),
    }
}

fn operators() -> Vec<ScalarOperator> {
    let duhem = Duhem::new(&[-1.0, 0.0, 1.0], &[1.4, 1.0, 0.6], &[0.6, 1.0, 1.4]).unwrap();
    vec![ScalarOperator::plays(&[0.1, 0.4], &[0.7, -0.2]).unwrap(), ScalarOperator::duhem(duhem)]
}

fn stage() -> MultiAxisStage {
    MultiAxisStage::new(matrices(), operators(), vec![0.5, -0.5], 1e-3).unwrap()
}

fn run(stage: &MultiAxisStage, u: &[[f64; 2]]) -> Vec<f64> {
    let mut y = vec![0.0; 2 * u.len()];
    MultiAxisForward::new(stage).run(u.as_flattened(), &mut y).unwrap();
    y
}

fn drives() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec([-3.0..3.0, -3.0..3.0], 1..60)
}

proptest! {
    #[test]
    fn without_operators_responses_add_up(u in drives(), factor in -3.0..3.0) {
        let none = |rows, columns| DMatrix::zeros(rows, columns);
        let linear = Matrices { bw: none(3, 0), cq: none(0, 3), dq: none(0, 2), ..matrices() };
        let stage = MultiAxisStage::new(linear, Vec::new(), vec![0.0; 2], 1e-3).unwrap();
        let only = |axis: usize, by: f64| -> Vec<[f64; 2]> {
            u.iter().map(|u| if axis == 0 { [by * u[0], 0.0] } else { [0.0, by * u[1]] }).collect()
        };
        let (one, other) = (run(&stage, &only(0, 1.0)), run(&stage, &only(1, factor)));
        let sum: Vec<f64> = one.iter().zip(other).map(|(p, q)| p + q).collect();
        let both = u.iter().map(|u| [u[0], factor * u[1]]).collect::<Vec<_>>();
        for (p, q) in run(&stage, &both).iter().zip(sum) {
            prop_assert!((p - q).abs() < 1e-12 * (1.0 + q.abs()));
        }
    }

    #[test]
    fn hysteresis_in_front_does_not_depend_on_the_rate(u in drives(), parts in 2_u32..5) {
        // Without dynamics but one sample of delay, positions are those of the operators.
        let one = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.0]);
        let none = DMatrix::zeros(2, 2);
        let matrices = Matrices {
            a: none.clone(), b: none.clone(), bw: one.clone(), c: one.clone(), d: none.clone(), cq: none, dq: one,
        };
        let stage = MultiAxisStage::new(matrices, operators(), vec![0.0; 2], 1e-3).unwrap();
        let mut slow = Vec::new();
        let mut last = [0.0; 2];
        for to in u.iter().chain([&[0.0; 2]]) {
            let share = |i: u32| f64::from(i) / f64::from(parts);
            slow.extend((1..=parts).map(|i| [0, 1].map(|j| last[j] + (to[j] - last[j]) * share(i))));
            last = *to;
        }
        let fast: Vec<_> = u.iter().copied().chain([[0.0; 2]]).collect();
        let (fast, slow) = (run(&stage, &fast), run(&stage, &slow));
        for (k, y) in fast.chunks(2).enumerate().skip(1) {
            let same = &slow[2 * k * parts as usize..][..2];
            prop_assert!(y.iter().zip(same).all(|(p, q)| (p - q).abs() < 1e-12), "{k} {y:?} {same:?}");
        }
    }

    #[test]
    fn sub_steps_are_steps_with_the_same_drives(u in drives(), parts in 1_usize..5) {
        let whole = run(&stage().with_sub_steps(parts).unwrap(), &u);
        let held: Vec<_> = u.iter().flat_map(|u| std::iter::repeat_n(*u, parts)).collect();
        let steps = run(&stage(), &held);
        for (y, same) in whole.chunks(2).zip(steps.chunks(2).step_by(parts)) {
            prop_assert_eq!(y, same);
        }
    }

    #[test]
    fn a_saved_state_goes_on_bit_for_bit(u in drives(), at in 0_usize..60, parts in 1_usize..3) {
        let stage = stage().with_sub_steps(parts).unwrap();
        let (first, rest) = u.split_at(at.min(u.len()));
        let mut one = MultiAxisForward::new(&stage);
        let mut y = [0.0; 2];
        for u in first {
            one.step(u, &mut y).unwrap();
        }
        let text = serde_json::to_string(&one.state()).unwrap();
        let mut other = MultiAxisForward::new(&stage);
        other.set_state(&serde_json::from_str(&text).unwrap()).unwrap();
        for u in rest {
            let mut same = [0.0; 2];
            one.step(u, &mut y).unwrap();
            other.step(u, &mut same).unwrap();
            prop_assert_eq!(y, same);
        }
    }
}

#[test]
fn a_file_has_every_bit() {
    let text = stage().to_json().unwrap();
    assert_eq!(MultiAxisStage::from_json(&text).unwrap(), stage());
    let parted = stage().with_sub_steps(3).unwrap();
    assert_eq!(MultiAxisStage::from_json(&parted.to_json().unwrap()).unwrap(), parted);
    assert!(parted != stage() && !text.contains("sub_steps"));
    let message = MultiAxisStage::from_json(&parted.to_json().unwrap().replace("sub_steps\": 3", "sub_steps\": 0"));
    let message = message.unwrap_err().to_string();
    assert_eq!(message, "sub_steps: expected 1 to 1000 steps in a sample, got 0");
    let other = text.replace("multi_axis_stage/1", "multi_axis_stage/9");
    assert!(matches!(MultiAxisStage::from_json(&other), Err(FileError::Schema { got: Some(_), .. })));
    let message = MultiAxisStage::from_json(&text.replacen("0.6", "1.6", 1)).unwrap_err().to_string();
    assert!(message.starts_with("a: expected eigenvalues inside the unit circle, got 1."), "{message}");
}

#[test]
fn what_no_stage_may_have_is_named() {
    let refused = |change: &dyn Fn(&mut Matrices)| {
        let mut changed = matrices();
        change(&mut changed);
        MultiAxisStage::new(changed, operators(), vec![0.0; 2], 1e-3).unwrap_err().to_string()
    };
    let shown = refused(&|matrices| matrices.b = DMatrix::zeros(2, 2));
    assert_eq!(shown, "b: expected as many rows as a, got 2");
    let shown = refused(&|matrices| matrices.bw = DMatrix::zeros(3, 1));
    assert_eq!(shown, "bw: expected as many columns as there are operators, got 1");
    let shown = refused(&|matrices| matrices.c[(0, 1)] = f64::NAN);
    assert_eq!(shown, "c[2]: expected a finite number (at most 1e100 in magnitude), got NaN");
    // Stable alone, but not with the slopes of the operators.
    let shown = refused(&|matrices| matrices.bw *= 400.0);
    assert!(shown.starts_with("bw: expected eigenvalues of a + bw diag(slopes of the operators) cq inside"), "{shown}");
    let error = ScalarOperator::plays(&[-1.0], &[1.0]).unwrap_err();
    assert_eq!(error.to_string(), "thresholds[0]: expected a number from 0 to 1e50, got -1.0");
}

#[test]
fn drives_that_are_no_numbers_count_as_the_last() {
    let stage = stage();
    let (mut one, mut other) = (MultiAxisForward::new(&stage), MultiAxisForward::new(&stage));
    let (mut y, mut same) = ([0.0; 2], [0.0; 2]);
    for (u, meant) in [([1.0, 2.0], [1.0, 2.0]), ([f64::NAN, 1.0], [1.0, 1.0]), ([0.5, f64::INFINITY], [0.5, 1.0])] {
        one.step(&u, &mut y).unwrap();
        other.step(&meant, &mut same).unwrap();
        assert_eq!(y, same);
    }
    assert_eq!((one.rejected(), other.rejected()), (2, 0));
    assert!(matches!(one.step(&[1.0], &mut y), Err(Error::Length { parameter: "u", expected: 2, got: 1 })));
    let before = one.state();
    one.reset();
    assert_eq!((one.rejected(), one.state().states), (0, vec![0.0; 3]));
    let mut wrong = before.clone();
    wrong.operators.reverse();
    assert!(one.set_state(&wrong).is_err());
    one.set_state(&before).unwrap();
    assert_eq!(one.state(), before);
}

#[test]
fn drives_of_a_reference_are_followed() {
    let samples = 600;
    let bump = |k: usize, at: usize| {
        if k.abs_diff(at) < 100 {
            0.5 + 0.5 * (f64::from(u32::try_from(k.abs_diff(at)).unwrap()) * 0.0314).cos()
        } else {
            0.0
        }
    };
    let reference: Vec<f64> = (0..samples).flat_map(|k| [0.5 + bump(k, 200), -0.5 - 0.6 * bump(k, 300)]).collect();
    let found = stage().precompensate(&reference, &PrecompensationOptions::default()).unwrap();
    assert!(found.converged && found.sweeps < 30, "{} passes", found.sweeps);
    assert!(found.missed.iter().all(|missed| *missed < 1e-4), "{:?}", found.missed);
    for parts in [2, 5] {
        let found = stage()
            .with_sub_steps(parts)
            .unwrap()
            .precompensate(&reference, &PrecompensationOptions::default())
            .unwrap();
        assert!(found.converged && found.sweeps < 30, "{} passes", found.sweeps);
        assert!(found.missed.iter().all(|missed| *missed < 1e-4), "{:?}", found.missed);
    }
    let none = |rows, columns| DMatrix::zeros(rows, columns);
    let linear = Matrices { bw: none(3, 0), cq: none(0, 3), dq: none(0, 2), ..matrices() };
    let linear = MultiAxisStage::new(linear, Vec::new(), vec![0.5, -0.5], 1e-3).unwrap();
    let found = linear.precompensate(&reference, &PrecompensationOptions::default()).unwrap();
    assert!(found.converged && found.sweeps == 1 && found.missed.iter().all(|missed| *missed < 1e-4));
    let error = stage().precompensate(&reference[1..], &PrecompensationOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "reference: expected 1198 elements, got 1199");
}

/// What follows of a motion, begun with all that is remembered there, at rest or in the middle of a move, is what
/// follows.
#[test]
fn a_reference_begins_where_the_last_one_ended() {
    let eased = |k: usize| (f64::from(u32::try_from(k).unwrap()) * 0.0105).sin().powi(2);
    let way = |k: usize| match k {
        200..350 => eased(k - 200),
        350..800 => 1.0,
        800..950 => eased(k - 650),
        _ => 0.0,
    };
    let whole: Vec<f64> = (0..1200).flat_map(|k| [0.5 + way(k), -0.5 - 0.6 * way(k)]).collect();
    let usual = PrecompensationOptions::default();
    for (parts, cut) in [(1, 600), (1, 260), (3, 600), (3, 870)] {
        let stage = stage().with_sub_steps(parts).unwrap();
        let asked = stage.precompensate(&whole, &usual).unwrap();
        let (before, after) = asked.drives.split_at(2 * cut);
        let mut forward = MultiAxisForward::new(&stage);
        forward.run(before, &mut vec![0.0; 2 * cut]).unwrap();
        let options = PrecompensationOptions { start: Some(forward.state()), ..usual.clone() };
        let found = stage.precompensate(&whole[2 * cut..], &options).unwrap();
        assert!(
            found.converged && found.missed.iter().all(|missed| *missed < 1e-4),
            "{parts} {cut} {:?}",
            found.missed
        );
        let far = found.drives.iter().zip(after).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
        assert!(far < 0.01, "{parts} {cut} {far}");
        // As if it were at rest, it misses by all that lies between.
        let at_rest = stage.precompensate(&whole[2 * cut..], &usual).unwrap();
        assert!(at_rest.missed[0] > 0.01 && at_rest.begins_off[0].abs() > 0.1, "{:?}", at_rest.begins_off);
        assert!(found.begins_off.iter().all(|off| off.abs() < 1e-3), "{:?}", found.begins_off);
    }
}

#[test]
fn drives_of_a_reference_stay_within_limits() {
    let reference: Vec<f64> = (0..600).flat_map(|k| [0.5 + if k > 300 { 1.0 } else { 0.0 }, -0.5]).collect();
    let usual = PrecompensationOptions::default();
    let free = stage().precompensate(&reference, &usual).unwrap();
    let options = PrecompensationOptions { limits: Some(vec![(-0.2, 0.4), (-5.0, 5.0)]), ..usual.clone() };
    let found = stage().precompensate(&reference, &options).unwrap();
    let beyond = |drives: &[f64]| drives.iter().step_by(2).filter(|u| !(-0.2..=0.4).contains(*u)).count();
    assert!(beyond(&free.drives) > 0 && beyond(&found.drives) == 0);
    assert_eq!((free.held_back, usize::try_from(found.held_back)), (0, Ok(beyond(&free.drives))));
    assert!(found.missed[0] > free.missed[0]);
    for (limits, message) in [
        (vec![(0.0, 1.0)], "limits: expected 2 elements, got 1"),
        (vec![(0.0, 1.0), (2.0, 1.0)], "limits[1]: expected a low limit below a high one, both finite, got 1.0"),
        (vec![(f64::NAN, 1.0), (0.0, 1.0)], "limits[0]: expected a low limit below a high one, both finite, got 1.0"),
    ] {
        let options = PrecompensationOptions { limits: Some(limits), ..usual.clone() };
        assert_eq!(stage().precompensate(&reference, &options).unwrap_err().to_string(), message);
    }
}

/// A sample beyond all bounds is counted once.
#[test]
fn sub_steps_end_where_a_state_has_no_bounds() {
    let far = Matrices { b: matrices().b * 1e40, ..matrices() };
    let stage = MultiAxisStage::new(far, operators(), vec![0.0; 2], 1e-3).unwrap().with_sub_steps(3).unwrap();
    let (mut forward, mut y) = (MultiAxisForward::new(&stage), [0.0; 2]);
    forward.step(&[1e90, 0.0], &mut y).unwrap();
    assert_eq!((forward.rejected(), forward.state().states), (1, vec![0.0; 3]));
}

/// What a row of a record is at the next sample, with the same drives once more.
#[test]
fn a_plant_in_a_loop_is_one_sample_later() {
    let stage = stage().with_sub_steps(2).unwrap();
    let (mut plant, mut record) = (MultiAxisForward::new(&stage), MultiAxisForward::new(&stage));
    let [mut later, mut now] = [[0.0; 2]; 2];
    for k in 0..50 {
        let u = [f64::from(k).sin(), f64::from(k).cos()];
        plant.advance(&u, &mut later).unwrap();
        record.step(&u, &mut now).unwrap();
        record.clone().step(&u, &mut now).unwrap();
        assert_eq!(now, later);
    }
}

#[test]
fn steps_allocate_nothing() {
    let mut forward = MultiAxisForward::new(&stage().with_sub_steps(2).unwrap());
    let mut y = [0.0; 2];
    let count = allocations::count(|| {
        for k in 0..100 {
            let u = f64::from(k).sin();
            assert!(forward.step(&[u, -u], &mut y).is_ok());
        }
    });
    assert_eq!(count, 0);
}
