//! Laws of trajectories.

use hysteresis_control::trajectory::{
    Axis, Lissajous, Motion, MotionLimits, PointToPoint, Raster, RasterOptions, RoundedTriangle, Scan, Sine, Spiral,
    SpiralRate, Trajectory,
};
use proptest::prelude::*;

fn sines() -> impl Strategy<Value = Sine> {
    (-5.0..5.0, 0.5..200.0, -5.0..5.0).prop_map(|(a, f, offset)| Sine::new(a, f, offset).unwrap())
}

fn triangles() -> impl Strategy<Value = RoundedTriangle> {
    (-5.0..5.0, 0.5..200.0, 0.02..0.5, -5.0..5.0)
        .prop_map(|(a, f, share, offset)| RoundedTriangle::new(a, f, share / f, offset).unwrap())
}

fn moves() -> impl Strategy<Value = PointToPoint> {
    let limits = (1.0..1e3, 1e1..1e6, 1e3..1e9);
    (prop::collection::vec(-10.0..10.0, 1..5), limits, prop_oneof![Just(0.0), 0.0..0.1]).prop_map(
        |(points, (velocity, acceleration, jerk), dwell)| {
            PointToPoint::new(&points, MotionLimits { velocity, acceleration, jerk }, dwell).unwrap()
        },
    )
}

/// Every derivative is the central difference of the one before, where nothing below jumps. `limits` are those of
/// moves, which accelerate for so short a time that no sample may see it.
fn differences_agree(
    trajectory: &impl Trajectory,
    share: f64,
    limits: Option<MotionLimits>,
) -> Result<(), TestCaseError> {
    let (t, h) = (share * trajectory.duration(), 1e-5 * trajectory.duration());
    let (before, here, after) = (trajectory.at(t - h), trajectory.at(t), trajectory.at(t + h));
    let slope = |of: fn(&Motion) -> f64| (of(&after) - of(&before)) / (2.0 * h);
    // A kink of the derivative in between costs up to h times its derivative, at most that of its greatest values.
    let greatest = |of: fn(&Motion) -> f64| {
        (0..=400).map(|k| of(&trajectory.at(f64::from(k) / 400.0 * trajectory.duration())).abs()).fold(0.0, f64::max)
    };
    let rounding = |of: fn(&Motion) -> f64| 1e-15 * (1.0 + t / h) * greatest(of) / h;
    let acceleration = limits.map_or_else(|| greatest(|m| m.acceleration), |limits| limits.acceleration);
    let tolerance = h * acceleration + rounding(|m| m.position);
    prop_assert!((slope(|m| m.position) - here.velocity).abs() <= tolerance);
    let jerk = limits.map_or_else(|| greatest(|m| m.jerk), |limits| limits.jerk);
    let tolerance = 2.0 * h * jerk + rounding(|m| m.velocity);
    prop_assert!((slope(|m| m.velocity) - here.acceleration).abs() <= tolerance);
    // The jerk of a move jumps.
    if limits.is_none() {
        // The fourth derivative is at most a few hundred jerks per period of the shortest corner.
        let tolerance = 0.05 * jerk + rounding(|m| m.acceleration);
        prop_assert!((slope(|m| m.acceleration) - here.jerk).abs() <= tolerance);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_are_those_of_the_position(
        sine in sines(), triangle in triangles(), moves in moves(), share in 0.01..0.99
    ) {
        differences_agree(&sine, share, None)?;
        differences_agree(&triangle, share, None)?;
        if moves.duration() > 0.0 {
            differences_agree(&moves, share, Some(moves.limits()))?;
        }
    }

    #[test]
    fn a_rounded_triangle_keeps_within_its_swing_and_repeats(triangle in triangles(), share in 0.0..1.0) {
        let (period, amplitude) = (triangle.duration(), triangle.amplitude());
        let here = triangle.at(share * period);
        prop_assert!((here.position - triangle.offset()).abs() <= amplitude.abs() * (1.0 + 1e-14));
        let opposite = triangle.at((share + 0.5) * period);
        // The phase is known to a few roundings, over which the position moves by less than 16 amplitudes per period.
        let tolerance = 1e-13 * (1.0 + amplitude.abs() + triangle.offset().abs());
        prop_assert!((opposite.position + here.position - 2.0 * triangle.offset()).abs() < tolerance);
        let turn = triangle.at(0.25 * period);
        prop_assert!((turn.position - triangle.offset() - amplitude).abs() < tolerance);
    }

    #[test]
    fn moves_stay_within_limits_and_end_exactly(moves in moves(), shares in prop::collection::vec(0.0..1.0, 50)) {
        let limits = moves.limits();
        let (first, last) = (moves.points()[0], *moves.points().last().unwrap());
        for t in [-1.0, 0.0] {
            prop_assert_eq!(moves.at(t), Motion::rest(first));
        }
        for t in [moves.duration(), moves.duration() + 1.0] {
            prop_assert_eq!(moves.at(t), Motion::rest(last));
        }
        let low = moves.points().iter().copied().fold(f64::MAX, f64::min);
        let high = moves.points().iter().copied().fold(f64::MIN, f64::max);
        for share in shares {
            let here = moves.at(share * moves.duration());
            prop_assert!(here.velocity.abs() <= limits.velocity * (1.0 + 1e-12));
            prop_assert!(here.acceleration.abs() <= limits.acceleration * (1.0 + 1e-12));
            prop_assert!(here.jerk.abs() <= limits.jerk);
            prop_assert!((low..=high).contains(&here.position), "{} {low} {high}", here.position);
        }
    }

    /// The last sample is at rest on the last point, whatever the rounding of the duration by the sampling interval.
    #[test]
    fn the_last_sample_is_the_end(moves in moves(), count in 1..2000_u32) {
        let dt = moves.duration() / f64::from(count);
        if dt > 0.0 {
            let motions = moves.sample(dt, None).unwrap();
            prop_assert_eq!(motions[motions.len() - 1], Motion::rest(*moves.points().last().unwrap()));
        }
    }

    #[test]
    fn moves_meet_a_limit_on_every_piece(moves in moves(), share in 0.0..1.0) {
        let (limits, here) = (moves.limits(), moves.at(share * moves.duration()));
        // The fastest move has nowhere less than all that it may have, but where it rests.
        let full = |got: f64, limit: f64| got.abs() > limit * (1.0 - 1e-9);
        prop_assert!(
            full(here.velocity, limits.velocity)
                || full(here.acceleration, limits.acceleration)
                || full(here.jerk, limits.jerk)
                || here == Motion::rest(here.position)
        );
    }
}

/// 159 intervals of a 159th of the duration end one rounding before it.
#[test]
fn a_move_that_is_sampled_ends_on_its_point() {
    let limits = MotionLimits { velocity: 5.0, acceleration: 71.0, jerk: 1000.0 };
    let moves = PointToPoint::new(&[0.0, 4.0], limits, 0.0).unwrap();
    let motions = moves.sample(moves.duration() / 159.0, None).unwrap();
    assert_eq!((motions.len(), motions[159]), (160, Motion::rest(4.0)));
}

#[test]
fn samples_are_counted() {
    let sine = Sine::new(1.0, 50.0, 0.0).unwrap();
    assert_eq!((sine.samples(1e-4, None), sine.samples(1e-4, Some(1.0))), (Ok(200), Ok(10_000)));
    let limits = MotionLimits { velocity: 100.0, acceleration: 1e4, jerk: 1e6 };
    let moves = PointToPoint::new(&[0.0, 3.0], limits, 0.0).unwrap();
    assert_eq!((moves.samples(0.01, None), moves.samples(0.03, None)), (Ok(6), Ok(3)));
    assert_eq!(PointToPoint::new(&[1.0], limits, 0.0).unwrap().samples(0.1, None), Ok(1));
    assert!(sine.samples(0.0, None).unwrap_err().to_string().starts_with("dt: expected a finite number above 0"));
    assert!(sine.samples(1e-30, None).unwrap_err().to_string().starts_with("dt: expected at most 134217728 samples"));
    let refused = sine.samples(1e-4, Some(1e5)).unwrap_err();
    assert_eq!(refused.to_string(), "seconds: expected at most 134217728 samples (2^27), got 1000000000");
    assert_eq!(sine.sample(1e-4, Some(1e5)), Err(refused));
    for seconds in [-1.0, f64::NAN] {
        let refused = sine.samples(1.0, Some(seconds)).unwrap_err();
        assert_eq!(refused.to_string(), format!("seconds: expected a number of seconds, 0 or more, got {seconds:?}"));
    }
}

#[test]
fn what_no_trajectory_can_have_is_named() {
    let sine = |a, f, o| Sine::new(a, f, o).unwrap_err().to_string();
    assert_eq!(sine(f64::NAN, 1.0, 0.0), "amplitude: expected a finite number, got NaN");
    assert_eq!(sine(1.0, 0.0, 0.0), "frequency: expected a finite number above 0, got 0.0");
    assert!(sine(1e300, 1e300, 0.0).starts_with("frequency: expected a number that leaves all derivatives finite"));
    let triangle = |f, corner| RoundedTriangle::new(1.0, f, corner, 0.0).unwrap_err().to_string();
    assert_eq!(triangle(1.0, 0.6), "corner: expected at most half a period, 0.5 s, got 0.6");
    assert!(triangle(1.0, 0.0).starts_with("corner: expected a finite number above 0"));
    assert!(triangle(1.0, 1e-200).starts_with("corner: expected a number that leaves all derivatives finite"));
    let limits = MotionLimits { velocity: 1.0, acceleration: 1.0, jerk: 1.0 };
    let moves = |points: &[f64], limits, dwell| PointToPoint::new(points, limits, dwell).unwrap_err().to_string();
    assert!(moves(&[], limits, 0.0).starts_with("points: expected at least one point"));
    assert!(moves(&[0.0, f64::INFINITY], limits, 0.0).starts_with("points: expected a finite number"));
    assert!(moves(&[-1e308, 1e308], limits, 0.0).starts_with("points: expected a number that leaves"));
    assert!(moves(&[0.0], limits, -1.0).starts_with("dwell: expected a number of seconds"));
    assert!(moves(&[0.0], MotionLimits { jerk: 0.0, ..limits }, 0.0).starts_with("jerk: expected a finite number"));
}

/// Numbers that appear nowhere else, so that none stands for another.
#[test]
fn trajectories_tell_what_they_were_made_of() {
    let sine = Sine::new(3.0, 2.0, 7.0).unwrap();
    assert_eq!((sine.amplitude(), sine.frequency(), sine.offset(), sine.duration()), (3.0, 2.0, 7.0, 0.5));
    let triangle = RoundedTriangle::new(3.0, 2.0, 0.125, 7.0).unwrap();
    assert_eq!((triangle.amplitude(), triangle.frequency(), triangle.corner()), (3.0, 2.0, 0.125));
    assert_eq!((triangle.offset(), triangle.duration()), (7.0, 0.5));
    assert!(sine.is_periodic() && triangle.is_periodic());
    let limits = MotionLimits { velocity: 1e2, acceleration: 1e4, jerk: 1e6 };
    let moves = PointToPoint::new(&[4.0, 3.0, 9.0], limits, 0.25).unwrap();
    assert_eq!((moves.points(), moves.limits(), moves.dwell()), (&[4.0, 3.0, 9.0][..], limits, 0.25));
    assert!(!moves.is_periodic());
    let figure = Lissajous::new((3.0, 4.0), (7.0, 5.0), 0.375, 2.5, 0.75, (8.0, 9.0)).unwrap();
    assert_eq!((figure.amplitudes(), figure.frequencies(), figure.center()), ((3.0, 4.0), (7.0, 5.0), (8.0, 9.0)));
    assert_eq!((figure.phase(), figure.seconds(), figure.lead_in()), (0.375, 2.5, 0.75));
    assert_eq!((figure.steady(), Scan::duration(&figure)), ((0.75, 3.25), 4.0));
    assert_eq!((Lissajous::default_lead_in((8.0, 4.0)), Lissajous::default_lead_in((4.0, 8.0))), (0.5, 0.5));
    let rate = SpiralRate::Angular { frequency: 4.0 };
    let spiral = Spiral::new(8.0, 0.5, rate, 2.5, (3.0, 9.0)).unwrap();
    assert_eq!((spiral.radius(), spiral.pitch(), spiral.rate()), (8.0, 0.5, rate));
    assert_eq!((spiral.inner_radius(), spiral.center()), (2.5, (3.0, 9.0)));
    let options = RasterOptions { turnaround: 0.25, center: (3.0, 9.0), ..RasterOptions::new(12.0, 8.0, 16, 4.0) };
    let raster = Raster::new(options).unwrap();
    // A sweep of 1/8 s, a quarter of which is the turn.
    assert_eq!((raster.options(), raster.speed(), raster.line_duration()), (options, 128.0, 0.09375));
    assert_eq!((raster.overscan(), raster.acceleration()), (1.375, 15360.0));
    assert!(!figure.x().is_periodic());
    assert_eq!((figure.x().scan(), figure.y().axis()), (figure, Axis::Y));
}
