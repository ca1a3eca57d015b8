//! The laws of the Duhem operator, under the same names as in the Python tests.

use hysteresis_core::{
    ControllerOptions, Duhem, DuhemForward, DuhemInverse, DuhemState, Error, HybridController, Process,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// A few roundings of each of up to a hundred exponentials.
const AGREE: f64 = 1e-13;

fn any_duhem() -> impl Strategy<Value = Duhem<9>> {
    let slope = prop_oneof![0.05..3.0, Just(1.0), Just(0.05)];
    let sign = prop_oneof![2 => Just(1.0), 1 => Just(-1.0)];
    (2..=9_usize)
        .prop_flat_map(move |n| {
            (-2.0..0.0, vec(0.3..1.0, n), vec(slope.clone(), n), vec(slope.clone(), n), sign.clone())
        })
        .prop_map(|(first, widths, rising, falling, sign)| {
            let knots: Vec<f64> =
                widths.iter().scan(first, |z, width| Some(std::mem::replace(z, *z + width))).collect();
            let signed = |slopes: &[f64]| slopes.iter().map(|f| sign * f).collect::<Vec<f64>>();
            Duhem::new(&knots, &signed(&rising), &signed(&falling)).unwrap()
        })
}

/// A slope beside which the sum rises: above minus the smallest f.
fn gain_beside(duhem: &Duhem<9>, share: f64) -> f64 {
    let least = duhem.min_slope();
    if least < 0.0 { -least * (1.1 + share.abs()) } else { share * if share < 0.0 { least } else { 1.0 } }
}

/// Jumps, small moves, repeats and denormals.
fn history() -> impl Strategy<Value = Vec<f64>> {
    let sample = prop_oneof![4 => -3.0..3.0, 1 => Just(0.0), 1 => Just(-0.0), 1 => Just(1.0), 1 => Just(5e-324)];
    (vec(sample, 1..30), vec(-0.02..0.02, 0..30)).prop_map(|(jumps, moves)| {
        let last = *jumps.last().unwrap();
        let walked = moves.into_iter().scan(last, |x, by| {
            *x += by;
            Some(*x)
        });
        jumps.into_iter().chain(walked).collect()
    })
}

fn run(process: &mut impl Process, input: &[f64]) -> Vec<f64> {
    let mut output = vec![0.0; input.len()];
    process.run(input, &mut output).unwrap();
    output
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// z after a straight move, by many steps of fourth order.
fn integrated(slope: impl Fn(f64, bool) -> f64, mut z: f64, (from, to): (f64, f64)) -> f64 {
    const STEPS: u32 = 4000;
    let (h, rising) = ((to - from) / f64::from(STEPS), to > from);
    for _ in 0..STEPS {
        let k1 = slope(z, rising);
        let k2 = slope(z + 0.5 * h * k1, rising);
        let k3 = slope(z + 0.5 * h * k2, rising);
        z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(z + h * k3, rising));
    }
    z
}

proptest! {
    #[test]
    fn equals_integration(duhem in any_duhem(), x in vec(-1.0..1.0, 1..6)) {
        let mut forward = DuhemForward::new(duhem);
        let (mut last, mut z) = (0.0, 0.0);
        for x in x {
            z = integrated(|z, rising| duhem.slope(z, rising), z, (last, x));
            let got = forward.step(x);
            // Where a knot lies within a step of the integration, that is of second order.
            prop_assert!((got - z).abs() <= 2e-5 * z.abs().max(1.0), "{got} {z}");
            (last, z) = (x, got);
        }
    }

    /// A file keeps them.
    #[test]
    fn made_of_its_own_parameters_it_is_the_same(duhem in any_duhem()) {
        let [knots, rising, falling] = [duhem.knots().collect::<Vec<_>>(), duhem.rising().collect(), duhem.falling().collect()];
        let again = Duhem::<9>::new(&knots, &rising, &falling).unwrap();
        prop_assert_eq!(again.fingerprint(), duhem.fingerprint());
        prop_assert_eq!(again, duhem);
    }

    #[test]
    fn sampling_independence(duhem in any_duhem(), x in history(), parts in 2..9_u32) {
        let (mut whole, mut split) = (DuhemForward::new(duhem), DuhemForward::new(duhem));
        let mut last = 0.0;
        for x in x {
            for part in 1..parts {
                split.step(last + (x - last) * f64::from(part) / f64::from(parts));
            }
            prop_assert_eq!(whole.step(x).to_bits(), split.step(x).to_bits());
            last = x;
        }
    }

    #[test]
    fn rate_independence(duhem in any_duhem(), x in history(), times in 2..5_usize) {
        let (mut once, mut held) = (DuhemForward::new(duhem), DuhemForward::new(duhem));
        for x in x {
            let z = once.step(x);
            for _ in 0..times {
                prop_assert_eq!(held.step(x).to_bits(), z.to_bits());
            }
        }
    }

    #[test]
    fn monotony(duhem in any_duhem(), x in history()) {
        let mut forward = DuhemForward::new(duhem);
        for x in x {
            let (before, from) = (forward.output(), forward.input());
            let rise = (forward.step(x) - before) * (x - from).signum();
            let least = duhem.min_slope() * (x - from).abs();
            let rounding = AGREE * before.abs().max(forward.output().abs()).max(1.0);
            prop_assert!(rise >= least - rounding, "{rise} {least}");
        }
    }

    #[test]
    fn inverse_undoes_forward(duhem in any_duhem(), x in history(), share in -0.9..2.0) {
        let gain = gain_beside(&duhem, share);
        let (mut forward, mut inverse) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, gain).unwrap());
        let (mut scale, mut allowed) = (10.0_f64, 0.0_f64);
        for x in x {
            let (before, rising) = (forward.output(), x > forward.input());
            let z = forward.step(x);
            let got = inverse.step(gain * x + z);
            // On a branch a difference in z grows as f does. It moves x by 1 / (gain + f), and that moves the z of the
            // inverse by the gain.
            let slope = duhem.slope(z, rising);
            scale = scale.max(z.abs());
            allowed = allowed * (slope / duhem.slope(before, rising)).max(1.0) + AGREE * scale;
            prop_assert!((got - x).abs() <= 100.0 * allowed / (gain + duhem.min_slope()), "{got} {x}");
            allowed *= (gain.abs() / (gain + slope)).max(1.0);
        }
    }

    #[test]
    fn forward_undoes_inverse(duhem in any_duhem(), sums in history(), share in -0.9..2.0) {
        let gain = gain_beside(&duhem, share);
        let (mut forward, mut inverse) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, gain).unwrap());
        let (mut scale, mut allowed) = (10.0_f64, 0.0_f64);
        for sum in sums {
            let ahead = inverse.peek(sum);
            let x = inverse.step(sum);
            prop_assert_eq!(ahead.to_bits(), x.to_bits());
            let (before, rising) = (forward.output(), x > forward.input());
            let got = gain * x + forward.step(x);
            // On a branch a difference in z grows as f does, and a rounding of x moves z by f.
            let slope = duhem.slope(forward.output(), rising);
            scale = scale.max((gain * x).abs()).max(forward.output().abs()).max(slope * x.abs());
            allowed = allowed * (slope / duhem.slope(before, rising)).max(1.0) + AGREE * scale;
            prop_assert!((got - sum).abs() <= 10.0 * allowed, "{got} {sum}");
            prop_assert!((forward.output() - inverse.hysteresis()).abs() <= allowed);
        }
    }

    #[test]
    fn peek_changes_nothing_and_run_is_step(duhem in any_duhem(), x in history(), probe in -3.0..3.0) {
        let (mut stepped, mut block) = (DuhemForward::new(duhem), DuhemForward::new(duhem));
        let expected: Vec<f64> = x.iter().map(|x| {
            let ahead = stepped.peek(*x);
            stepped.peek(probe);
            assert_eq!(stepped.step(*x).to_bits(), ahead.to_bits());
            ahead
        }).collect();
        prop_assert_eq!(bits(&expected), bits(&run(&mut block, &x)));
    }

    #[test]
    fn a_saved_state_continues_bit_for_bit(duhem in any_duhem(), x in history(), y in history()) {
        let mut forward = DuhemForward::new(duhem);
        let gain = gain_beside(&duhem, 0.5);
        let mut inverse = DuhemInverse::new(duhem, gain).unwrap();
        run(&mut forward, &x);
        run(&mut inverse, &x);
        let (mut other, mut other_inverse) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, gain).unwrap());
        other.set_state(&forward.state()).unwrap();
        other_inverse.set_state(&inverse.state()).unwrap();
        prop_assert_eq!(forward.output().to_bits(), other.output().to_bits());
        prop_assert_eq!(bits(&run(&mut forward, &y)), bits(&run(&mut other, &y)));
        prop_assert_eq!(bits(&run(&mut inverse, &y)), bits(&run(&mut other_inverse, &y)));
    }

    #[test]
    fn bouc_wen_is_three_knots(alpha in 0.5..2.0_f64, falls: bool, beta in 0.5..2.0, gamma in 0.1..1.0, delta in -1.5..1.5, x in vec(-2.0..2.0, 1..5)) {
        prop_assume!(!falls || delta < 0.9 * gamma);
        let alpha: f64 = if falls { -alpha } else { alpha };
        let mut forward = DuhemForward::new(Duhem::<3>::from_bouc_wen(alpha, beta, gamma, delta).unwrap());
        let (mut last, mut z) = (0.0, 0.0);
        for x in x {
            let slope = |z: f64, rising| alpha - beta * (if rising { gamma * z } else { -gamma * z } + delta * z.abs());
            z = integrated(slope, z, (last, x));
            let got = forward.step(x);
            prop_assert!((got - z).abs() <= 2e-5 * z.abs().max(1.0), "{got} {z}");
            (last, z) = (x, got);
        }
    }
}

#[test]
fn what_is_no_number_changes_nothing_and_is_counted() {
    let duhem = Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25).unwrap();
    let (mut forward, mut inverse) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, 1.0).unwrap());
    let (z, x) = (forward.step(0.7), inverse.step(0.7));
    for bad in [f64::NAN, f64::INFINITY, -1e101] {
        assert_eq!((forward.peek(bad), forward.step(bad), inverse.peek(bad), inverse.step(bad)), (z, z, x, x));
    }
    assert_eq!((forward.rejected(), inverse.rejected()), (3, 3));
    forward.reset();
    inverse.reset();
    assert_eq!((forward.output(), forward.rejected(), inverse.output(), inverse.rejected()), (0.0, 0, 0.0, 0));
}

#[test]
fn the_largest_inputs_stay_finite() {
    let duhem = Duhem::<2>::new(&[0.0, 1.0], &[1.0, 3.0], &[3.0, 1.0]).unwrap();
    let (mut forward, mut inverse) = (DuhemForward::new(duhem), DuhemInverse::new(duhem, 0.0).unwrap());
    for x in [1e100, -1e100, 0.0, 1e100, 1e99] {
        assert!(forward.step(x).abs() <= 1e100 && inverse.step(x).abs() <= 1e100);
    }
    let steep = DuhemInverse::new(duhem, -0.5).unwrap().step(1e100);
    assert!((steep.ln() - (1e100_f64.ln() / 2.0).ln()).abs() < 0.05, "{steep}");
}

#[test]
fn refusals_name_what_is_wrong() {
    let refused = |knots: &[f64], rising: &[f64], falling: &[f64]| {
        let error = Duhem::<3>::new(knots, rising, falling).unwrap_err();
        (error.parameter(), error.to_string())
    };
    let (two, ones) = ([0.0, 1.0], [1.0, 1.0]);
    assert_eq!(refused(&[0.0], &[1.0], &[1.0]).1, "knots: expected a whole number from 2 to 3, got 1");
    assert_eq!(refused(&[0.0; 4], &[1.0; 4], &[1.0; 4]).0, Some("knots"));
    assert_eq!(refused(&[1.0, 1.0], &ones, &ones).0, Some("knots"));
    assert_eq!(refused(&[0.0, f64::NAN], &ones, &ones).0, Some("knots"));
    assert_eq!(
        refused(&two, &[1.0, 0.0], &ones).1,
        "rising[1]: expected a number above 0 (1e-50 to 1e50), or all of rising and falling below 0, got 0.0"
    );
    assert_eq!(refused(&two, &ones, &[1.0]).0, Some("falling"));
    assert_eq!(refused(&two, &ones, &[-1.0, 1.0]).0, Some("falling"));
    assert_eq!(refused(&[0.0, 1e-40], &[1.0, 1e20], &ones).0, Some("rising"));
    let below = "falling[0]: expected a number below 0 (-1e50 to -1e-50), as rising[0] is, got 1.0";
    assert_eq!(refused(&two, &[-1.0, -1.0], &ones).1, below);
    let parameter = |got: Result<Duhem<3>, Error>| got.unwrap_err().parameter();
    assert_eq!(parameter(Duhem::from_bouc_wen(0.0, 1.0, 1.0, 0.0)), Some("alpha"));
    assert_eq!(parameter(Duhem::from_bouc_wen(-1.0, 1.0, 1.0, 1.0)), Some("delta"));
    assert_eq!(parameter(Duhem::from_bouc_wen(1.0, f64::NAN, 1.0, 0.0)), Some("beta"));
    assert_eq!(parameter(Duhem::from_bouc_wen(1.0, 1.0, -0.1, 0.0)), Some("gamma"));
    assert_eq!(parameter(Duhem::from_bouc_wen(1.0, 1.0, 1.0, f64::INFINITY)), Some("delta"));
    let duhem = Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.0, 0.0).unwrap();
    assert_eq!(DuhemInverse::new(duhem, -1.0).unwrap_err().parameter(), Some("gain"));
    assert_eq!(DuhemForward::starting_at(duhem, 0.0, f64::NAN).unwrap_err().parameter(), Some("z"));
    let mut forward = DuhemForward::new(duhem);
    let good = forward.state();
    let wrong = DuhemState { anchor_input: 1.0, ..good };
    assert_eq!(forward.set_state(&wrong).unwrap_err().parameter(), Some("state.anchor_input"));
    assert_eq!(forward.state(), good);
    let mut other = DuhemForward::new(Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.1, 0.0).unwrap());
    assert!(matches!(other.set_state(&good), Err(Error::OtherModel { .. })));
}

#[test]
fn parameters_are_what_was_given() {
    let duhem = Duhem::<4>::new(&[-1.0, 0.0, 2.0], &[1.0, 2.0, 3.0], &[4.0, 5.0, 0.5]).unwrap();
    assert_eq!(duhem.knots().collect::<Vec<_>>(), [-1.0, 0.0, 2.0]);
    assert_eq!(duhem.rising().collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
    assert_eq!(duhem.falling().collect::<Vec<_>>(), [4.0, 5.0, 0.5]);
    assert_eq!(duhem.min_slope(), 0.5);
    // Outwards a line that grows goes on, one that falls stays.
    assert_eq!((duhem.slope(4.0, true), duhem.slope(-3.0, true)), (4.0, 1.0));
    assert_eq!(duhem.slope(f64::INFINITY, true), duhem.slope(1e100, true));
    assert_eq!(duhem.slope(-1e200, false), duhem.slope(-1e100, false));
    assert_eq!((duhem.slope(4.0, false), duhem.slope(-3.0, false), duhem.slope(1.0, false)), (0.5, 4.0, 2.75));
}

#[test]
fn an_operator_that_falls_keeps_its_parameters_and_has_a_steepest_slope() {
    let duhem = Duhem::<4>::new(&[-1.0, 0.0, 2.0], &[-1.0, -2.0, -3.0], &[-4.0, -5.0, -0.5]).unwrap();
    assert_eq!(duhem.knots().collect::<Vec<_>>(), [-1.0, 0.0, 2.0]);
    assert_eq!(duhem.rising().collect::<Vec<_>>(), [-1.0, -2.0, -3.0]);
    assert_eq!(duhem.falling().collect::<Vec<_>>(), [-4.0, -5.0, -0.5]);
    assert_eq!((duhem.min_slope(), duhem.max_slope()), (-5.0, -0.5));
    // Outwards f stays, whether it grows there or not.
    assert_eq!((duhem.slope(4.0, true), duhem.slope(-3.0, true), duhem.slope(1.0, true)), (-3.0, -1.0, -2.5));
    assert_eq!((duhem.slope(4.0, false), duhem.slope(-3.0, false), duhem.slope(1.0, false)), (-0.5, -4.0, -2.75));
    // The piezo form: what is subtracted is the h of the same equation.
    let h = Duhem::<3>::from_bouc_wen(0.4, 0.03, 0.8, 0.3).unwrap();
    let less = Duhem::<3>::from_bouc_wen(-0.4, 0.03, 0.8, -0.3).unwrap();
    let (mut added, mut subtracted) = (DuhemForward::new(h), DuhemForward::new(less));
    for x in [30.0, -50.0, 10.0, 10.5, 0.0] {
        assert_eq!(subtracted.step(x), -added.step(x));
    }
    assert_eq!(DuhemInverse::new(less, 0.4).unwrap_err().parameter(), Some("gain"));
}

/// Within limits x holds the limit before a target that is out of reach, comes back at once, and the sum is that of x.
#[test]
fn within_limits_a_target_out_of_reach_holds_the_limit() {
    let duhem = Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25).unwrap();
    let mut inverse = DuhemInverse::new(duhem, 0.3).unwrap().within((0.5, 2.0)).unwrap();
    let mut forward = DuhemForward::new(duhem);
    forward.step(0.5);
    assert_eq!((inverse.output(), inverse.hysteresis()), (0.5, forward.output()));
    for (target, limit) in [(1.0, None), (99.0, Some(2.0)), (0.9, None), (-99.0, Some(0.5)), (0.8, None)] {
        let (ahead, x) = (inverse.peek(target), inverse.step(target));
        assert_eq!((ahead, x, x == limit.unwrap_or(x)), (x, inverse.output(), true));
        let reached = 0.3 * x + forward.step(x);
        assert!(limit.is_some() || (reached - target).abs() < AGREE, "{reached} {target}");
        assert!((inverse.state().target - reached).abs() < AGREE);
    }
    let saved = inverse.state();
    assert!((inverse.follow_drive(7.0) - (0.6 + forward.step(2.0))).abs() < AGREE);
    assert_eq!(
        (inverse.output(), inverse.follow_drive(f64::NAN), inverse.rejected()),
        (2.0, inverse.state().target, 1)
    );
    let mut narrow = DuhemInverse::new(duhem, 0.3).unwrap().within((1.9, 2.0)).unwrap();
    assert_eq!(narrow.set_state(&saved).unwrap_err().parameter(), Some("state.input"));
    assert_eq!(DuhemInverse::new(duhem, 0.3).unwrap().within((2.0, 1.0)).unwrap_err().parameter(), Some("limits"));
}

/// A controller of a stage that is a slope and an operator, as firmware has it: nothing of it allocates.
#[test]
fn the_inverse_is_a_source_of_feedforward() {
    let (duhem, limits) = (Duhem::<3>::from_bouc_wen(1.0, 1.0, 0.5, 0.25).unwrap(), (-3.0, 3.0));
    let inverse = DuhemInverse::new(duhem, 0.3).unwrap();
    let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.1, 10.0, 1e-3, limits) };
    assert!(HybridController::with_source(inverse.clone(), None, &options).is_err());
    let mut controller = HybridController::with_source(inverse.within(limits).unwrap(), None, &options).unwrap();
    let (mut plant, mut position) = (DuhemForward::new(duhem), 0.0);
    for k in 0..500 {
        let target = 0.8 * f64::sin(0.05 * f64::from(k));
        let drive = controller.step(target.into(), position);
        assert!(drive.abs() <= 3.0);
        position = 0.3 * drive + plant.step(drive);
        // It begins with what the feedback makes of the first sample, and the sample before is what it compares with.
        assert!(k < 20 || (position - target).abs() < 0.01, "{k}: {position} {target}");
    }
    controller.follow(&[1.0, -1.0]).unwrap();
    assert_eq!(controller.drive(), -1.0);
}
