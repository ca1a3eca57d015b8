//! Laws of scans: rasters, spirals and Lissajous figures.

use core::f64::consts::{PI, TAU};

use hysteresis_control::sampling::Error;
use hysteresis_control::trajectory::{Lissajous, Motion, Raster, RasterOptions, Scan, Spiral, SpiralRate, Trajectory};
use proptest::prelude::*;

fn rasters() -> impl Strategy<Value = Raster> {
    let share = 0.02..0.95;
    (1.0..50.0, 0.0..50.0, 1_u32..20, 0.5..200.0, share, any::<(bool, bool)>(), (-5.0..5.0, -5.0..5.0)).prop_map(
        |(width, height, lines, line_rate, turnaround, (is_bidirectional, has_steps), center)| {
            let plain = RasterOptions::new(width, height, lines, line_rate);
            Raster::new(RasterOptions { turnaround, is_bidirectional, has_steps, center, ..plain }).unwrap()
        },
    )
}

fn spirals() -> impl Strategy<Value = Spiral> {
    let rate = prop_oneof![
        (0.5..200.0).prop_map(|frequency| SpiralRate::Angular { frequency }),
        (1.0..1e3).prop_map(|speed| SpiralRate::Linear { speed })
    ];
    (1.0..20.0, 1.0..100.0, rate, 0.01..0.5, (-5.0..5.0, -5.0..5.0)).prop_map(|(radius, turns, rate, inner, center)| {
        Spiral::new(radius, radius / turns, rate, inner * radius, center).unwrap()
    })
}

fn figures() -> impl Strategy<Value = Lissajous> {
    let two = |range: core::ops::Range<f64>| (range.clone(), range);
    (two(-5.0..5.0), two(0.5..200.0), -PI..PI, 0.0..2.0, 2.0..5.0, two(-5.0..5.0)).prop_map(
        |(amplitudes, frequencies, phase, seconds, periods, center)| {
            let lead_in = periods * 0.5 * Lissajous::default_lead_in(frequencies);
            Lissajous::new(amplitudes, frequencies, phase, seconds, lead_in, center).unwrap()
        },
    )
}

/// The greatest of a derivative in a time about t.
fn greatest(axis: &impl Trajectory, of: fn(&Motion) -> f64, t: f64, around: f64) -> f64 {
    (-20..=20).map(|k| of(&axis.at(t + f64::from(k) / 20.0 * around)).abs()).fold(0.0, f64::max)
}

/// Every derivative is the central difference of the one before. `h` is small beside everything that changes.
fn differences_agree(axis: &impl Trajectory, share: f64, h: f64, jerk: bool) -> Result<(), TestCaseError> {
    let t = share * axis.duration();
    let (before, here, after) = (axis.at(t - h), axis.at(t), axis.at(t + h));
    let slope = |of: fn(&Motion) -> f64| (of(&after) - of(&before)) / (2.0 * h);
    // Nothing changes much in so short a time; roundings are those of the time and of the centre.
    let scale = |of: fn(&Motion) -> f64| greatest(axis, of, t, 200.0 * h);
    let rounding = |of: fn(&Motion) -> f64| (1e-15 * (10.0 + t / h) * scale(of) + 1e-14) / h;
    let velocity = 1e-3 * scale(|m| m.velocity) + rounding(|m| m.position);
    prop_assert!((slope(|m| m.position) - here.velocity).abs() <= velocity, "velocity at {t}");
    let acceleration = 5e-3 * scale(|m| m.acceleration) + rounding(|m| m.velocity) + 2.0 * h * scale(|m| m.jerk);
    prop_assert!((slope(|m| m.velocity) - here.acceleration).abs() <= acceleration, "acceleration at {t}");
    if jerk {
        let tolerance = 0.1 * scale(|m| m.jerk) + rounding(|m| m.acceleration);
        prop_assert!((slope(|m| m.acceleration) - here.jerk).abs() <= tolerance, "jerk at {t}");
    }
    Ok(())
}

/// At rest at both ends and beyond, and sampled equally often.
fn rests_at_both_ends(scan: impl Scan, samples: u32) -> Result<(), TestCaseError> {
    let (x, y) = (scan.x(), scan.y());
    let dt = scan.duration() / f64::from(samples);
    for axis in [&x, &y] {
        for t in [-1.0, 0.0, scan.duration(), scan.duration() + 1.0] {
            prop_assert_eq!(axis.at(t), Motion::rest(axis.at(t).position));
        }
        prop_assert_eq!(axis.at(-1.0), axis.at(0.0));
        prop_assert_eq!(axis.at(scan.duration()), axis.at(scan.duration() + 1.0));
        let last = *axis.sample(dt, None).unwrap().last().unwrap();
        prop_assert_eq!(last, Motion::rest(last.position));
    }
    prop_assert_eq!(x.samples(dt, None), y.samples(dt, None));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn derivatives_are_those_of_the_position(
        raster in rasters(), spiral in spirals(), figure in figures(), share in 0.0..1.0
    ) {
        let RasterOptions { line_rate, turnaround, .. } = raster.options();
        let h = 1e-4 * turnaround / line_rate;
        differences_agree(&raster.x(), share, h, true)?;
        differences_agree(&raster.y(), share, h, false)?;
        let h = match spiral.rate() {
            SpiralRate::Angular { frequency } => 1e-5 / frequency,
            SpiralRate::Linear { speed } => 1e-3 * spiral.pitch().min(spiral.inner_radius()) / speed,
        };
        differences_agree(&spiral.x(), share, h, true)?;
        differences_agree(&spiral.y(), share, h, true)?;
        let (fx, fy) = figure.frequencies();
        differences_agree(&figure.x(), share, 1e-5 / fx.max(fy), false)?;
        differences_agree(&figure.y(), share, 1e-5 / fx.max(fy), false)?;
    }

    #[test]
    fn scans_begin_and_end_at_rest(
        raster in rasters(), spiral in spirals(), figure in figures(), samples in 1..2000_u32
    ) {
        rests_at_both_ends(raster, samples)?;
        rests_at_both_ends(spiral, samples)?;
        rests_at_both_ends(figure, samples)?;
    }

    #[test]
    fn lines_are_crossed_at_a_constant_speed(raster in rasters(), line in 0..20_u32, share in 0.0_f64..=1.0) {
        let RasterOptions { width, height, lines, is_bidirectional, has_steps, center, .. } = raster.options();
        let line = line % lines;
        let sweeps = if is_bidirectional { vec![line] } else { vec![2 * line, 2 * line + 1] };
        let middle = center.1 + height * ((f64::from(line) + 0.5) / f64::from(lines) - 0.5);
        let tolerance = 1e-11 * (width + height + center.0.abs() + center.1.abs());
        let mut mean = 0.0;
        for &sweep in &sweeps {
            let (begins, ends) = raster.sweep(sweep).unwrap();
            prop_assert!((ends - begins - raster.line_duration()).abs() < 1e-12 * ends);
            let t = begins + share * (ends - begins);
            let direction = if sweep % 2 == 0 { 1.0 } else { -1.0 };
            let here = raster.x().at(t);
            prop_assert!((here.position - center.0 - direction * width * (share - 0.5)).abs() < tolerance);
            prop_assert!((here.velocity - direction * raster.speed()).abs() < 1e-9 * raster.speed());
            // Nothing jumps where a line begins or ends, nor at the lead-in.
            let h = 1e-7 * raster.line_duration();
            for t in [begins, ends] {
                let (before, after) = (raster.x().at(t - h), raster.x().at(t + h));
                prop_assert!((after.position - before.position).abs() < 3.0 * h * raster.speed() + tolerance);
                prop_assert!((after.velocity - before.velocity).abs() < 1e-6 * raster.speed());
                let (before, after) = (raster.y().at(t - h), raster.y().at(t + h));
                prop_assert!((after.position - before.position).abs() < 1e-6 * height + tolerance);
            }
            let half_way = raster.y().at(0.5 * (begins + ends)).position;
            mean += if is_bidirectional { half_way } else { 0.5 * half_way };
            if has_steps {
                prop_assert_eq!(raster.y().at(t), Motion::rest(half_way));
            }
        }
        prop_assert!((mean - middle).abs() < tolerance, "{mean} {middle}");
        let last = if is_bidirectional { lines } else { 2 * lines };
        prop_assert!(raster.sweep(last).is_none() && raster.sweep(last - 1).is_some());
    }

    #[test]
    fn a_raster_keeps_within_its_overscan_speed_and_acceleration(raster in rasters(), share in 0.0..1.0) {
        let RasterOptions { width, height, center, .. } = raster.options();
        let (x, y) = (raster.x().at(share * raster.duration()), raster.y().at(share * raster.duration()));
        let reach = 0.5 * width + raster.overscan();
        prop_assert!((x.position - center.0).abs() <= reach * (1.0 + 1e-12));
        prop_assert!((y.position - center.1).abs() <= 0.5 * height + 1e-12);
        prop_assert!(x.velocity.abs() <= raster.speed() * (1.0 + 1e-12));
        prop_assert!(x.acceleration.abs() <= raster.acceleration() * (1.0 + 1e-12));
        // The middle of the first turn has both.
        let apex = raster.x().at(0.5 * (raster.sweep(0).unwrap().1 + raster.sweep(1).unwrap_or((f64::NAN, 0.0)).0));
        if apex.position.is_finite() {
            prop_assert!((apex.position - center.0 - reach).abs() < 1e-10 * reach);
            prop_assert!((apex.acceleration + raster.acceleration()).abs() < 1e-6 * raster.acceleration());
        }
    }

    #[test]
    fn the_index_of_a_sample_is_the_line_on_which_it_lies(raster in rasters(), samples in 100..2000_u32) {
        let RasterOptions { lines, is_bidirectional, .. } = raster.options();
        let dt = raster.duration() / f64::from(samples);
        let (traced, retraced) = (raster.line_index(dt, false).unwrap(), raster.line_index(dt, true).unwrap());
        prop_assert_eq!(traced.len(), raster.x().sample(dt, None).unwrap().len());
        let x = raster.x().sample(dt, None).unwrap();
        for ((trace, retrace), motion) in traced.iter().zip(&retraced).zip(&x) {
            prop_assert!(trace.is_none() || retrace.is_none());
            let on_line = (motion.velocity.abs() / raster.speed() - 1.0).abs() < 1e-9;
            let line = trace.or(*retrace);
            prop_assert!(line.is_none() || on_line && line.unwrap() < lines);
            if motion.velocity.abs() < 0.999 * raster.speed() {
                prop_assert_eq!(line, None);
            }
            if !is_bidirectional && line.is_some() {
                prop_assert_eq!(trace.is_some(), motion.velocity > 0.0);
            }
        }
        prop_assert!(traced.iter().flatten().is_sorted());
    }

    #[test]
    fn a_spiral_has_one_rate_and_stays_within_its_radius(spiral in spirals(), share in 0.0..1.0) {
        let (x, y) = (spiral.x(), spiral.y());
        let (begins, ends) = spiral.steady();
        let polar = |t: f64| {
            let (x, y) = (x.at(t).moved_by(-spiral.center().0), y.at(t).moved_by(-spiral.center().1));
            let r = x.position.hypot(y.position);
            (r, (x.position * y.velocity - y.position * x.velocity) / (r * r), x.velocity.hypot(y.velocity))
        };
        let (r, angular, speed) = polar(begins + share * (ends - begins));
        match spiral.rate() {
            SpiralRate::Angular { frequency } => prop_assert!((angular / (TAU * frequency) - 1.0).abs() < 1e-6),
            SpiralRate::Linear { speed: wanted } => prop_assert!((speed / wanted - 1.0).abs() < 1e-6),
        }
        prop_assert!(r >= spiral.inner_radius() * (1.0 - 1e-9) && r <= spiral.radius());
        prop_assert!((polar(begins).0 / spiral.inner_radius() - 1.0).abs() < 1e-6);
        prop_assert!((polar(spiral.duration()).0 / spiral.radius() - 1.0).abs() < 1e-9);
        prop_assert!(polar(share * spiral.duration()).0 <= spiral.radius() * (1.0 + 1e-9));
    }

    /// A turn of the angle moves the path outwards by the pitch, at any radius.
    #[test]
    fn turns_are_a_pitch_apart(spiral in spirals(), share in 0.0..1.0) {
        let t = share * spiral.duration();
        let (x, y) = (spiral.x().at(t).position - spiral.center().0, spiral.y().at(t).position - spiral.center().1);
        let r = x.hypot(y);
        prop_assume!(r > 1e-3 * spiral.radius());
        let turned = (TAU * r / spiral.pitch()).rem_euclid(TAU);
        let difference = (y.atan2(x) - turned).rem_euclid(TAU);
        prop_assert!(difference.min(TAU - difference) < 1e-6);
    }

    /// Braking and starting never ask for more than the image does: at a constant angular velocity the last turn, at a
    /// constant speed the sharpest bend at full speed.
    #[test]
    fn a_spiral_accelerates_no_more_than_it_must(spiral in spirals()) {
        let samples = 3000;
        let worst = (0..=samples)
            .map(|k| f64::from(k) / f64::from(samples) * spiral.duration())
            .map(|t| spiral.x().at(t).acceleration.hypot(spiral.y().at(t).acceleration))
            .fold(0.0, f64::max);
        let bound = match spiral.rate() {
            SpiralRate::Angular { frequency } => (TAU * frequency).powi(2) * (spiral.radius() + spiral.pitch()),
            SpiralRate::Linear { speed } => {
                let factor = if spiral.inner_radius() >= spiral.pitch() { 1.2 } else { 1.5 };
                factor * speed * speed / spiral.inner_radius()
            }
        };
        prop_assert!(worst <= bound, "{worst} {bound}");
    }

    #[test]
    fn a_figure_is_its_sines_between_lead_in_and_lead_out(figure in figures(), share in 0.0_f64..=1.0) {
        let (begins, ends) = figure.steady();
        let t = begins + share * (ends - begins);
        let sine = |f: f64, phase: f64| (TAU * f * (t - begins) + phase).sin();
        let ((ax, ay), (fx, fy), (cx, cy)) = (figure.amplitudes(), figure.frequencies(), figure.center());
        prop_assert!((figure.x().at(t).position - cx - ax * sine(fx, figure.phase())).abs() < 1e-10);
        prop_assert!((figure.y().at(t).position - cy - ay * sine(fy, 0.0)).abs() < 1e-10);
    }

    #[test]
    fn a_figure_is_never_faster_than_its_sines(figure in figures(), share in 0.0..1.0) {
        let t = share * figure.duration();
        let ((ax, ay), (fx, fy), (cx, cy)) = (figure.amplitudes(), figure.frequencies(), figure.center());
        for (axis, amplitude, frequency, center) in [(figure.x(), ax, fx, cx), (figure.y(), ay, fy, cy)] {
            let (here, w, a) = (axis.at(t), TAU * frequency, amplitude.abs() * (1.0 + 1e-12));
            prop_assert!((here.position - center).abs() <= a + 1e-12);
            prop_assert!(here.velocity.abs() <= a * w, "{} {}", here.velocity, a * w);
            // The end of the lead-in asks for a little more.
            prop_assert!(here.acceleration.abs() <= 1.04 * a * w * w, "{} {}", here.acceleration, a * w * w);
        }
    }
}

/// Jerks that jump where a part begins or ends are the differences of the acceleration within each part.
#[test]
fn jerks_are_the_derivatives_of_the_acceleration_within_each_part() {
    let figure = Lissajous::new((3.0, 2.0), (7.0, 5.0), 0.4, 0.5, 0.3, (1.0, -2.0)).unwrap();
    let plain = RasterOptions::new(10.0, 8.0, 4, 5.0);
    let ramp = Raster::new(plain).unwrap();
    let steps = Raster::new(RasterOptions { has_steps: true, ..plain }).unwrap();
    // The second sweep is the retrace of the first line, after which the slow axis steps.
    let step = steps.sweep(1).unwrap().1;
    let in_steps: Vec<f64> = [0.1, 0.3, 0.7, 0.9].map(|share| step + share * 0.2 * 0.1).to_vec();
    let in_ramp: Vec<f64> = [0.2, 0.4, 0.8].map(|share| share * ramp.sweep(0).unwrap().0).to_vec();
    let in_figure = vec![0.05, 0.11, 0.2, 0.28, 0.4, 0.61, 0.83, 0.9, 1.0, 1.07];
    let axes: [(&str, Box<dyn Trajectory>, Vec<f64>); 4] = [
        ("x of a figure", Box::new(figure.x()), in_figure.clone()),
        ("y of a figure", Box::new(figure.y()), in_figure),
        ("steps", Box::new(steps.y()), in_steps),
        ("ramp", Box::new(ramp.y()), in_ramp),
    ];
    for (name, axis, times) in axes {
        let largest = times.iter().map(|t| axis.at(*t).jerk.abs()).fold(0.0, f64::max);
        for t in times {
            let (h, here) = (1e-6, axis.at(t).jerk);
            let slope = (axis.at(t + h).acceleration - axis.at(t - h).acceleration) / (2.0 * h);
            assert!(largest > 1.0 && (slope - here).abs() < 1e-5 * largest, "{name} at {t} s: {slope} {here}");
        }
    }
}

/// Positions about another point.
trait Moved {
    fn moved_by(self, by: f64) -> Self;
}

impl Moved for Motion {
    fn moved_by(self, by: f64) -> Self {
        Self { position: self.position + by, ..self }
    }
}

#[test]
fn a_raster_of_whole_samples_has_equally_many_on_every_line() {
    // 0.1 s for a sweep, 0.08 s of it on the line: 81 samples with both ends.
    let raster = Raster::new(RasterOptions::new(10.0, 8.0, 64, 5.0)).unwrap();
    // So that a line begins at a sample: the lead-in takes 11/16 of 0.02 s.
    let dt = 0.02 * 11.0 / 16.0 / 11.0;
    let lines = raster.line_index(dt, false).unwrap();
    for line in 0..64 {
        assert_eq!(lines.iter().filter(|at| **at == Some(line)).count(), 65, "{line}");
    }
    assert_eq!(raster.line_index(dt, true).unwrap().iter().flatten().count(), 64 * 65);
}

#[test]
fn what_no_scan_can_have_is_named() {
    let plain = RasterOptions::new(10.0, 8.0, 64, 5.0);
    let raster = |options: RasterOptions| Raster::new(options).map(|_| ());
    let spiral = |radius, pitch, rate, inner| Spiral::new(radius, pitch, rate, inner, (0.0, 0.0)).map(|_| ());
    let angular = |frequency| SpiralRate::Angular { frequency };
    let linear = |speed| SpiralRate::Linear { speed };
    let figure = |amplitudes, frequencies, phase, seconds, lead_in| {
        Lissajous::new(amplitudes, frequencies, phase, seconds, lead_in, (0.0, 0.0)).map(|_| ())
    };
    let refused: [(Result<(), Error>, &str); 24] = [
        (raster(RasterOptions { width: 0.0, ..plain }), "width: expected a finite number above 0, got 0.0"),
        (raster(RasterOptions { height: -1.0, ..plain }), "height: expected a finite number, 0 or more, got -1.0"),
        (raster(RasterOptions { height: f64::NAN, ..plain }), "height: expected a finite number, 0 or more, got NaN"),
        (raster(RasterOptions { lines: 0, ..plain }), "lines: expected 1 to 2^27, got 0"),
        (raster(RasterOptions { lines: u32::MAX, ..plain }), "lines: expected 1 to 2^27"),
        (raster(RasterOptions { line_rate: 0.0, ..plain }), "line_rate: expected a finite number above 0, got 0.0"),
        (raster(RasterOptions { line_rate: 1e-320, ..plain }), "line_rate: expected a number that leaves all deriv"),
        (
            raster(RasterOptions { turnaround: 1.0, ..plain }),
            "turnaround: expected a share above 0 and below 1, got 1.0",
        ),
        (raster(RasterOptions { turnaround: 1e-300, ..plain }), "line_rate: expected a number that leaves all"),
        (raster(RasterOptions { center: (0.0, f64::INFINITY), ..plain }), "center: expected a finite number, got inf"),
        (spiral(0.0, 0.1, angular(1.0), 0.1), "radius: expected a finite number above 0"),
        (spiral(1.0, 1.5, angular(1.0), 0.1), "pitch: expected at most the radius, 1.0, got 1.5"),
        (spiral(1.0, 0.1, angular(0.0), 0.1), "frequency: expected a finite number above 0"),
        (spiral(1.0, 0.1, linear(f64::NAN), 0.1), "speed: expected a finite number above 0"),
        (spiral(1.0, 0.1, linear(1e200), 0.1), "speed: expected a number that leaves all derivatives finite"),
        (
            spiral(1.0, 0.1, linear(1.0), 0.6),
            "inner_radius: expected above 0, at most half of the radius, 0.5, got 0.6",
        ),
        (spiral(1.0, 0.1, linear(1.0), 0.0), "inner_radius: expected above 0"),
        (figure((f64::NAN, 1.0), (1.0, 1.0), 0.0, 1.0, 1.0), "amplitudes: expected a finite number, got NaN"),
        (figure((1.0, 1.0), (1.0, 0.0), 0.0, 1.0, 1.0), "frequencies: expected a finite number above 0, got 0.0"),
        (figure((1.0, 1.0), (1e200, 1.0), 0.0, 1.0, 1.0), "frequencies: expected a number that leaves all derivatives"),
        (figure((1.0, 1.0), (1.0, 1.0), f64::INFINITY, 1.0, 1.0), "phase: expected a finite number, got inf"),
        (figure((1.0, 1.0), (1.0, 1.0), 0.0, -1.0, 1.0), "seconds: expected a finite number, 0 or more, got -1.0"),
        (figure((1.0, 1.0), (1.0, 1.0), 0.0, 1.0, 0.0), "lead_in: expected a finite number above 0, got 0.0"),
        (figure((1.0, 1.0), (1.0, 1.0), 0.0, 1.0, 1e-200), "lead_in: expected a number that leaves all derivatives"),
    ];
    for (made, message) in refused {
        let error = made.unwrap_err();
        assert!(error.to_string().starts_with(message), "{error}");
        assert!(message.starts_with(error.parameter()));
    }
    let raster = Raster::new(plain).unwrap();
    let error = raster.x().sample(1e-9, None).unwrap_err();
    assert!(error.to_string().starts_with("dt: expected at most 134217728 samples (2^27)"), "{error}");
    assert_eq!(raster.line_index(1e-9, false).unwrap_err(), error);
}
