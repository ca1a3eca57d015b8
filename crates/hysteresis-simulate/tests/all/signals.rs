//! Laws of chirps, multisines and experiments, under the names that the Python tests have.

use core::f64::consts::{PI, TAU};

use hysteresis_simulate::excitation::{ExperimentOptions, FastSignal, Shape};
use hysteresis_simulate::signals::{Chirp, Multisine, Phases, Sweep};
use proptest::prelude::*;

fn chirps() -> impl Strategy<Value = Chirp> {
    let sweep = prop_oneof![Just(Sweep::Linear), Just(Sweep::Logarithmic)];
    ((0.0..1e3, -1e3..1e3, 1e-3..0.5, 1e-3..0.5), (3..3000_u32, 1.0..1e5, sweep, 1e-3..0.5)).prop_map(
        |((amplitude, center, first, last), (samples, rate, sweep, taper))| Chirp {
            amplitude,
            center,
            start_frequency: first * rate,
            stop_frequency: last * rate,
            seconds: f64::from(samples) / rate,
            rate,
            sweep,
            taper,
        },
    )
}

fn multisines() -> impl Strategy<Value = Multisine> {
    let phases = prop_oneof![Just(Phases::Schroeder), any::<u64>().prop_map(Phases::Random)];
    (8..400_u32, 1..4_u32, 0..500_u32, phases, 1e-3..1e3, -1e3..1e3).prop_flat_map(
        |(samples, periods, fade, phases, amplitude, center)| {
            let lines = proptest::sample::subsequence((1..=(samples - 1) / 2).collect::<Vec<_>>(), 1..4);
            lines.prop_map(move |lines| Multisine { amplitude, center, lines, phases, samples, periods, fade })
        },
    )
}

fn experiments() -> impl Strategy<Value = ExperimentOptions> {
    let shape = prop_oneof![Just(Shape::Triangle), Just(Shape::Sine)];
    let signal = prop_oneof![Just(FastSignal::Chirp), Just(FastSignal::Multisine)];
    let places = (-1e3..1e3_f64, 1e-3..1e3_f64, 0.2..0.8, prop_oneof![0.0..=1.0_f64, Just(0.5)]);
    (places, (1.0..20.0, 1001.0..2e3, 1..8_u32), (shape, signal, 1e-3..1.0, 0.05..0.5)).prop_map(
        |((low, width, center, start), (slew, rate, cycles), (shape, fast_signal, amplitude, share))| {
            let (low, high): (f64, f64) = (low, low + width);
            ExperimentOptions {
                cycles,
                shape,
                fast_signal,
                center: low + (high - low) * center,
                start: (low + (high - low) * start).min(high),
                rest: 0.1,
                fast_amplitude: 0.5 * (high - low) * amplitude,
                fast_frequency: rate * share,
                ..ExperimentOptions::new(low, high, slew * (high - low), rate)
            }
        },
    )
}

/// The largest step of a signal.
fn longest_step(samples: &[f64]) -> f64 {
    samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn a_chirp_starts_and_ends_at_its_center_and_keeps_within_its_swing(chirp in chirps()) {
        let samples = chirp.sample().unwrap();
        prop_assert_eq!((samples[0], samples[samples.len() - 1]), (chirp.center, chirp.center));
        let (low, high) = (chirp.center - chirp.amplitude, chirp.center + chirp.amplitude);
        prop_assert!(samples.iter().all(|u| (low..=high).contains(u)));
    }

    #[test]
    fn a_chirp_changes_no_faster_than_it_says(chirp in chirps()) {
        let samples = chirp.sample().unwrap();
        let seconds = f64::from(u32::try_from(samples.len() - 1).unwrap()) / chirp.rate;
        let highest = chirp.start_frequency.max(chirp.stop_frequency);
        let bound = chirp.amplitude * (TAU * highest + PI / (2.0 * chirp.taper * seconds));
        // a step is a difference of two numbers, each with the rounding of a phase of up to 1e4 rad
        let rounding = 1e-15 * chirp.center.abs() + 1e-11 * chirp.amplitude;
        prop_assert!(longest_step(&samples) <= bound / chirp.rate + rounding);
    }

    #[test]
    fn the_frequency_of_a_chirp_sweeps_as_stated(
        sweep in prop_oneof![Just(Sweep::Linear), Just(Sweep::Logarithmic)],
        first in 1.0..20.0, last in 1.0..20.0,
    ) {
        let chirp = Chirp {
            amplitude: 1.0, center: 0.0, start_frequency: first, stop_frequency: last, seconds: 10.0, rate: 1e4, sweep,
            taper: 0.01,
        };
        let samples = chirp.sample().unwrap();
        let crossings: Vec<f64> = (1..99_999_u32)
            .filter(|k| samples[*k as usize - 1] < 0.0 && samples[*k as usize] >= 0.0)
            .map(|k| {
                let (before, after) = (samples[k as usize - 1], samples[k as usize]);
                (f64::from(k) - after / (after - before)) / 1e4
            })
            .collect();
        let end = 99_999.0 / 1e4;
        for pair in crossings.windows(2) {
            let share = 0.5 * (pair[0] + pair[1]) / end;
            let expected = match sweep {
                Sweep::Linear => first + (last - first) * share,
                Sweep::Logarithmic => first * (last / first).powf(share),
            };
            let found = 1.0 / (pair[1] - pair[0]);
            // the law is curved within a cycle, the crossings are interpolated
            prop_assert!((found / expected - 1.0).abs() < 0.03, "{} Hz at {}, not {}", found, share, expected);
        }
    }

    #[test]
    fn a_multisine_keeps_within_its_swing_and_repeats(multisine in multisines()) {
        let samples = multisine.sample().unwrap();
        let (low, high) = (multisine.center - multisine.amplitude, multisine.center + multisine.amplitude);
        prop_assert!(samples.iter().all(|u| (low..=high).contains(u)));
        let (period, fade) = (multisine.samples as usize, multisine.fade as usize);
        prop_assert_eq!(samples.len(), multisine.periods as usize * period + 2 * fade);
        let whole = &samples[fade..samples.len() - fade];
        prop_assert!(whole.chunks(period).all(|one| one == &whole[..period]));
        let peak = whole.iter().map(|u| (u - multisine.center).abs()).fold(0.0, f64::max);
        prop_assert!((peak - multisine.amplitude).abs() <= 1e-12 * (multisine.amplitude + multisine.center.abs()));
        if fade > 0 {
            prop_assert_eq!((samples[0], samples[samples.len() - 1]), (multisine.center, multisine.center));
        }
    }

    #[test]
    fn a_multisine_has_the_lines_asked_for_and_no_others(multisine in multisines()) {
        let samples = Multisine { periods: 1, fade: 0, ..multisine.clone() }.sample().unwrap();
        let count = f64::from(multisine.samples);
        let size = |line: u32| {
            let phases = (0..multisine.samples).map(|n| TAU * f64::from(line) * f64::from(n) / count);
            let sums = phases.zip(&samples).fold((0.0, 0.0), |(re, im): (f64, f64), (phase, u)| {
                let x = (u - multisine.center) / multisine.amplitude;
                (re + x * phase.cos(), im + x * phase.sin())
            });
            sums.0.hypot(sums.1) / count
        };
        let expected = size(multisine.lines[0]);
        // the center leaves a rounding in every sample
        let rounding = 1e-12 * (1.0 + multisine.center.abs() / multisine.amplitude);
        prop_assert!(expected > 0.05);
        for line in 0..=multisine.samples / 2 {
            let wanted = if multisine.lines.contains(&line) { expected } else { 0.0 };
            prop_assert!((size(line) - wanted).abs() <= rounding, "line {}", line);
        }
    }

    #[test]
    fn limits_and_slew_are_kept_and_every_part_comes_home(options in experiments()) {
        for part in options.experiment().unwrap().parts {
            prop_assert_eq!((part.drive[0], part.drive[part.drive.len() - 1]), (options.start, options.start));
            prop_assert!(part.drive.iter().all(|u| (options.low..=options.high).contains(u)));
            let rounding = 1e-15 * options.low.abs().max(options.high.abs());
            prop_assert!(longest_step(&part.drive) <= options.slew / part.rate * (1.0 + 2e-12) + 2.0 * rounding);
        }
    }

    #[test]
    fn segments_follow_each_other_and_say_what_is_in_them(options in experiments()) {
        for part in options.experiment().unwrap().parts {
            let mut next = 0;
            for segment in &part.segments {
                prop_assert_eq!(segment.start, next);
                next = segment.stop;
                let own = &part.drive[segment.start..segment.stop];
                prop_assert!(!own.is_empty());
                prop_assert!(own.iter().all(|u| (segment.range.0..=segment.range.1).contains(u)));
                prop_assert!(longest_step(own) * part.rate <= segment.max_slew);
            }
            prop_assert_eq!(next, part.drive.len());
        }
    }
}
