//! A Duhem operator beside a hysteresis: what the laws of the whole stage do not say.

use hysteresis_core::{
    Bracket, CompiledModel, Duhem, DuhemForward, DuhemInverse, Error, MAX_KNOTS, ModifiedPrandtlIshlinskii, Offsets,
    PrandtlIshlinskii, Process, QuasiStatic, Ratios,
};
use proptest::prelude::*;

use crate::support::past_drives::assert_refusals_move_nothing;

fn bouc_wen() -> Duhem<MAX_KNOTS> {
    Duhem::from_bouc_wen(0.6, 0.02, 0.9, 0.4).unwrap()
}

/// One that comes to rest further out.
fn further() -> Duhem<MAX_KNOTS> {
    Duhem::from_bouc_wen(0.6, 0.005, 0.9, 0.4).unwrap()
}

fn linear(slope: f64) -> QuasiStatic {
    let model = PrandtlIshlinskii::new(&[slope], &[0.0], Offsets::default()).unwrap();
    QuasiStatic::new(&CompiledModel::new(&(&model).into()))
}

fn plays(offset: f64) -> QuasiStatic {
    let (weights, thresholds) = ([0.4, 0.1, 0.05, 0.1], [0.0, 5.0, 20.0, 45.0]);
    let offsets = Offsets { input: offset, output: 0.5 };
    let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, offsets).unwrap();
    QuasiStatic::new(&CompiledModel::new(&model))
}

#[test]
fn the_output_is_the_sum_of_both_from_the_input_offset() {
    let (mut whole, mut alone) = (plays(12.0).with_duhem(bouc_wen()).forward(), plays(12.0).forward());
    let mut z = DuhemForward::starting_at(bouc_wen(), 12.0, 0.0).unwrap();
    assert_eq!(whole.output(), alone.output());
    for drive in [40.0, -10.0, 90.0, 30.0, 31.0] {
        assert_eq!(whole.peek(drive), whole.step(drive));
        assert_eq!(whole.output(), alone.step(drive) + z.step(drive));
    }
    whole.settle(50.0);
    z.reset();
    assert_eq!(whole.output(), alone.settle(50.0) + z.step(50.0));
}

/// Plays that stand still after a reversal: they have no inverse of their own.
fn flat_plays() -> QuasiStatic {
    let (weights, thresholds) = ([0.0, 0.1, 0.05], [0.0, 5.0, 20.0]);
    let model = PrandtlIshlinskii::new(&weights, &thresholds, Offsets::default()).unwrap();
    QuasiStatic::new(&CompiledModel::new(&(&model).into()))
}

#[test]
fn beside_a_slope_the_inverse_is_that_of_the_operator() {
    for slope in [0.3, 0.0] {
        let stage = linear(slope).with_duhem(bouc_wen());
        let (mut inverse, mut forward) = (stage.inverse(None).unwrap(), stage.forward());
        let mut exact = DuhemInverse::new(bouc_wen(), slope).unwrap();
        for target in [20.0, 4.0, -15.0, 12.0, 12.0, 12.1] {
            let (got, want) = (inverse.step(target), exact.step(target));
            assert!((got - want).abs() < 1e-12 * 100.0, "{got} {want}");
            assert!((forward.step(got) - target).abs() < 1e-12 * 100.0);
        }
    }
}

/// Where z rises with the drive the sum does, however flat the plays are; not with a weight below zero, nor with an
/// operator that falls.
#[test]
fn beside_an_operator_that_rises_the_plays_need_no_inverse() {
    let stage = flat_plays().with_duhem(further());
    let (mut inverse, mut forward) = (stage.inverse(None).unwrap(), stage.forward());
    for k in 0..400 {
        let target = 25.0 * f64::sin(0.1 * f64::from(k)) * f64::cos(0.013 * f64::from(k));
        let reached = forward.step(inverse.step(target));
        assert!((reached - target).abs() < 1e-12 * 100.0, "{reached} {target}");
        let mut restored = stage.inverse(None).unwrap();
        restored.set_state(&inverse.state()).unwrap();
        assert_eq!(restored.peek(3.0), inverse.peek(3.0));
    }
    let steep = PrandtlIshlinskii::new(&[0.5, 0.1, 0.05], &[0.0, 5.0, 20.0], Offsets::default()).unwrap();
    inverse.set_model(&CompiledModel::new(&(&steep).into())).unwrap();
    inverse.set_model(flat_plays().hysteresis()).unwrap();
    assert_eq!(forward.step(inverse.step(7.0)) - 7.0, 0.0);
    let falls = Duhem::from_bouc_wen(-0.5, 0.02, 0.9, -0.4).unwrap();
    assert!(matches!(flat_plays().with_duhem(falls).inverse(None), Err(Error::NotInvertible { .. })));
    let negative = PrandtlIshlinskii::new(&[0.0, -0.1], &[0.0, 5.0], Offsets::default()).unwrap();
    let negative = QuasiStatic::new(&CompiledModel::new(&(&negative).into())).with_duhem(further());
    assert!(matches!(negative.inverse(None), Err(Error::NotInvertible { .. })));
}

#[test]
fn a_target_out_of_reach_holds_the_limit_and_comes_back() {
    let falls = Duhem::from_bouc_wen(-0.5, 0.02, 0.9, -0.4).unwrap();
    let flat = [flat_plays(), linear(0.0)].map(|stage| stage.with_duhem(further()));
    for stage in [plays(0.0).with_duhem(bouc_wen()), linear(0.8).with_duhem(falls)].into_iter().chain(flat) {
        let (mut inverse, mut forward) = (stage.inverse(Some((0.0, 100.0))).unwrap(), stage.forward());
        for (target, at_limit) in [(30.0, None), (1e3, Some(100.0)), (40.0, None), (-1e3, Some(0.0)), (20.0, None)] {
            let drive = inverse.step(target);
            let reached = forward.step(drive);
            let is_at_limit = drive == at_limit.unwrap_or(drive);
            assert_eq!((inverse.saturated(), is_at_limit), (at_limit.is_some(), true), "{target}");
            assert!(at_limit.is_some() || (reached - target).abs() < 1e-12 * 100.0, "{reached} {target}");
            assert!((inverse.position() - reached).abs() < 1e-12 * 100.0);
            let mut restored = stage.inverse(Some((0.0, 100.0))).unwrap();
            restored.set_state(&inverse.state()).unwrap();
            assert_eq!((restored.saturated(), restored.peek(50.0)), (inverse.saturated(), inverse.peek(50.0)));
        }
    }
}

#[test]
fn what_is_refused_moves_nothing() {
    assert_refusals_move_nothing(linear(1.0).with_duhem(bouc_wen()));
    assert_refusals_move_nothing(flat_plays().with_duhem(further()));
}

#[test]
fn a_state_that_cannot_be_is_refused() {
    let mut with = plays(0.0).with_duhem(bouc_wen()).forward();
    with.follow(&[20.0, 90.0]).unwrap();
    let good = with.state();
    assert_eq!(good.loop_shift.len(), 4);
    assert!(matches!(plays(0.0).forward().set_state(&good), Err(Error::OtherModel { .. })));
    let mut refused = |change: &dyn Fn(&mut Vec<f64>)| {
        let mut state = good.clone();
        change(&mut state.loop_shift);
        with.set_state(&state).unwrap_err().to_string()
    };
    assert_eq!(refused(&|memory| memory.truncate(3)), "state.loop_shift: expected 4 elements, got 3");
    assert!(refused(&|memory| memory[1] = f64::NAN).starts_with("state.loop_shift[1]: expected a finite number"));
    assert!(refused(&|memory| memory[1] = 95.0).starts_with("state.anchor_input: expected"));
    assert_eq!(with.state(), good);
}

/// The piezo form of Bouc-Wen's model: 0.8 x - h.
#[test]
fn beside_a_steeper_slope_an_operator_may_fall() {
    let fall = |alpha: f64| Duhem::<MAX_KNOTS>::from_bouc_wen(-alpha, 0.02, 0.9, -0.4).unwrap();
    let mut inverse = linear(0.8).with_duhem(fall(0.4)).inverse(None).unwrap();
    let mut exact = DuhemInverse::new(fall(0.4), 0.8).unwrap();
    for target in [20.0, 4.0, -60.0, 35.0, 35.0, 35.1] {
        let (got, want) = (inverse.step(target), exact.step(target));
        assert!((got - want).abs() < 1e-12 * 100.0, "{got} {want}");
    }
    let steep = fall(0.8);
    let expected = "duhem: expected a Duhem operator that falls less than the flattest slope of the hysteresis rises";
    let refused = linear(0.8).with_duhem(steep).inverse(None).unwrap_err().to_string();
    assert!(refused.starts_with(expected), "{refused}");
    // Nor may a stream come to that by other weights.
    let flat = PrandtlIshlinskii::new(&[0.3], &[0.0], Offsets::default()).unwrap();
    assert_eq!(inverse.set_model(&CompiledModel::new(&(&flat).into())).unwrap_err().parameter(), Some("duhem"));
    let less_steep = PrandtlIshlinskii::new(&[1.0], &[0.0], Offsets::default()).unwrap();
    inverse.set_model(&CompiledModel::new(&(&less_steep).into())).unwrap();
    assert_refusals_move_nothing(linear(0.8).with_duhem(fall(0.4)));
}

#[test]
fn there_is_no_bracket() {
    let error = Bracket::of_stage(&plays(0.0).with_duhem(bouc_wen()), (0.0, 100.0)).unwrap_err();
    assert_eq!(error.parameter(), Some("duhem"));
}

proptest! {
    /// Neither the rate nor the sampling of a motion changes where it leads.
    #[test]
    fn rate_and_sampling_independence(drives in prop::collection::vec(-20.0..150.0_f64, 1..20), parts in 2..9_u32) {
        let stage = plays(10.0).with_duhem(bouc_wen());
        let (mut whole, mut split) = (stage.forward(), stage.forward());
        let mut last = 10.0;
        for drive in drives {
            for part in 1..parts {
                split.step(last + (drive - last) * f64::from(part) / f64::from(parts));
            }
            let (once, held) = (whole.step(drive), split.step(drive));
            prop_assert!((once - held).abs() <= 1e-13 * 100.0, "{once} {held}");
            last = drive;
        }
    }

    /// The position rises with the drive at least as the smallest slopes say.
    #[test]
    fn monotony(drives in prop::collection::vec(-20.0..150.0_f64, 2..20)) {
        let mut forward = plays(10.0).with_duhem(bouc_wen()).forward();
        let mut last = (drives[0], forward.step(drives[0]));
        for drive in drives {
            let position = forward.step(drive);
            let rise = (position - last.1) * (drive - last.0).signum();
            prop_assert!(rise >= 0.4 * (drive - last.0).abs() - 1e-12 * 100.0);
            last = (drive, position);
        }
    }
}
