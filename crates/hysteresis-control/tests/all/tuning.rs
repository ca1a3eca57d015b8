//! What the gains of the feedback keep.

use hysteresis_control::filters::FeedbackFilter;
use hysteresis_control::linear::{Block, Delay, FirstOrder, LinearDynamics, Modes, SecondOrder, StateSpace};
use hysteresis_control::tuning::{LoopFamily, ModeUncertainty, Structure, TuningOptions, loop_margins, tune};
use proptest::prelude::*;

fn chains() -> impl Strategy<Value = LinearDynamics> {
    let frequency = || 20.0..4000.0;
    let dynamics = prop_oneof![
        Just(LinearDynamics::none()),
        frequency().prop_map(|f| FirstOrder::new(f).unwrap().into()),
        (frequency(), 0.01..2.0).prop_map(|(f, zeta)| SecondOrder::new(f, zeta).unwrap().into()),
    ];
    let amplifier = prop::option::of(frequency().prop_map(|f| LinearDynamics::from(FirstOrder::new(f).unwrap())));
    let dead_time = prop_oneof![Just(0.0), 0.0..6.0].prop_map(|samples| Delay::new(samples * 1e-4).unwrap());
    (dynamics, amplifier, dead_time)
        .prop_map(|(dynamics, amplifier, delay)| amplifier.unwrap_or_default().then(dynamics).then(delay))
}

fn a1() -> LinearDynamics {
    SecondOrder::new(400.0, 0.95).unwrap().into()
}

fn options() -> TuningOptions {
    TuningOptions::new((4.257e-3, 7.919e-3), 1e-4, 1.7)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_bound_is_kept_and_met(chain in chains(), min in 1e-4..1e2, ratio in 1.0..5.0, limit in 1.1..3.0) {
        let slopes = (min, min * ratio);
        let tuning = tune(&chain, &TuningOptions::new(slopes, 1e-4, limit)).unwrap();
        prop_assert!((tuning.kp >= 0.0 || tuning.structure == Structure::ActiveDamping) && tuning.ki > 0.0);
        // The greatest ki meets the bound but for what the search leaves.
        prop_assert!(tuning.peak_sensitivity <= limit && tuning.peak_sensitivity > limit * (1.0 - 1e-3));
        for share in [0.0, 0.2, 0.7, 1.0] {
            let slope = slopes.0 + share * (slopes.1 - slopes.0);
            let margins = loop_margins(&chain, 1e-4, &tuning.filters, (tuning.kp, tuning.ki), slope).unwrap();
            prop_assert!(margins.peak_sensitivity <= limit * (1.0 + 1e-9), "{margins:?}");
            prop_assert!(margins.gain_margin > limit / (limit - 1.0) * (1.0 - 1e-6), "{margins:?}");
            let min_phase = 2.0 * (0.5 / limit).asin().to_degrees();
            prop_assert!(margins.phase_margin > min_phase * (1.0 - 1e-6), "{margins:?}");
        }
    }
}

/// An integrator before a delay of one sample and the read-out: L = g z / ((z - 1) z^2), known in closed form.
#[test]
fn margins_of_an_integrator_are_those_of_the_textbook() {
    let (dt, gain) = (1e-3, 0.25);
    let chain = LinearDynamics::from(Delay::new(dt).unwrap());
    let margins = loop_margins(&chain, dt, &[], (0.0, gain / dt), 1.0).unwrap();
    // |L| = g / (2 sin(w/2)), arg L = w/2 - pi/2 - 2 w per sample.
    let crossover = 2.0 * (0.5 * gain).asin();
    let phase_margin = 90.0 - (1.5 * crossover).to_degrees();
    let turned = core::f64::consts::PI / 3.0;
    let gain_margin = 2.0 * (0.5 * turned).sin() / gain;
    assert!((margins.crossover * core::f64::consts::TAU * dt - crossover).abs() < 1e-9);
    assert!((margins.phase_margin - phase_margin).abs() < 1e-6, "{margins:?}");
    assert!((margins.gain_margin - gain_margin).abs() < 1e-9, "{margins:?}");
}

/// What white noise becomes is the energy of the answer to one wrong measurement (Parseval), here in the steepest loop.
#[test]
fn the_noise_bandwidth_is_that_of_the_loop_in_time() {
    for chain in [a1(), a1().then(Delay::new(3e-4).unwrap()), FirstOrder::new(300.0).unwrap().into()] {
        let options = options();
        let tuning = tune(&chain, &options).unwrap();
        let mut plant = chain.block(options.dt).unwrap();
        let (mut energy, mut integral, mut position) = (0.0, 0.0, 0.0);
        for k in 0..100_000 {
            let error = if k == 0 { 1.0 } else { 0.0 } - position;
            integral += tuning.ki * options.dt * error;
            position = plant.advance(options.slopes.1 * (tuning.kp * error + integral));
            energy += position * position;
        }
        let expected = 0.5 * energy / options.dt;
        assert!((tuning.noise_bandwidth / expected - 1.0).abs() < 1e-3, "{} {expected}", tuning.noise_bandwidth);
    }
}

/// What a gain in the dynamics does, a gain of the hysteresis does too; and time has a unit.
#[test]
fn gains_follow_the_units() {
    let tuned = tune(&a1(), &options()).unwrap();
    let halved = a1().then(StateSpace::from_gain(0.01).unwrap());
    let other = tune(&halved, &options()).unwrap();
    assert!((other.kp / tuned.kp / 100.0 - 1.0).abs() < 1e-9 && (other.ki / tuned.ki / 100.0 - 1.0).abs() < 1e-9);
    let ten_times_faster = SecondOrder::new(4000.0, 0.95).unwrap().into();
    let other = tune(&ten_times_faster, &TuningOptions { dt: 1e-5, ..options() }).unwrap();
    assert!((other.kp / tuned.kp - 1.0).abs() < 1e-6 && (other.ki / tuned.ki / 10.0 - 1.0).abs() < 1e-6);
    let inverted = a1().then(StateSpace::from_gain(-1.0).unwrap());
    assert!(
        tune(&inverted, &options()).unwrap_err().to_string().starts_with("dynamics.static_gain: expected a finite")
    );
}

/// The published gains are far slower than what the dynamics allow.
#[test]
fn the_published_gains_are_slow() {
    let (tuned, slopes) = (tune(&a1(), &options()).unwrap(), options().slopes);
    let published = loop_margins(&a1(), 1e-4, &[], (60.0, 6000.0), slopes.1).unwrap();
    assert!(published.crossover < 10.0 && tuned.at_max_slope.crossover > 300.0);
    assert!(tuned.ki > 50.0 * 6000.0);
}

#[test]
fn what_cannot_be_tuned_is_named() {
    let refused = |change: &dyn Fn(&mut TuningOptions)| {
        let mut options = options();
        change(&mut options);
        tune(&a1(), &options).unwrap_err().to_string()
    };
    let above = "expected a finite number above 0 (1e-100 to 1e100)";
    assert_eq!(refused(&|o| o.slopes = (0.0, 1.0)), format!("slopes[0]: {above}, got 0.0"));
    assert_eq!(refused(&|o| o.slopes = (1.0, f64::NAN)), format!("slopes[1]: {above}, got NaN"));
    assert_eq!(refused(&|o| o.slopes = (1.0, 0.5)), "slopes[1]: expected at least the first one, got 0.5");
    assert_eq!(refused(&|o| o.peak_sensitivity = 1.0), "peak_sensitivity: expected 1.05 to 5, got 1.0");
    assert_eq!(refused(&|o| o.dt = -1.0), format!("dt: {above}, got -1.0"));
    let late = a1().then(Delay::new(0.1001).unwrap());
    assert_eq!(
        tune(&late, &options()).unwrap_err().to_string(),
        "dead_time: expected at most 1000 samples, got 0.1001"
    );
    assert!(loop_margins(&a1(), 1e-4, &[], (f64::NAN, 1.0), 1.0).unwrap_err().to_string().starts_with("kp: expected"));
    assert!(loop_margins(&a1(), 1e-4, &[], (0.0, 0.0), 1.0).unwrap_err().to_string().starts_with("ki: expected"));
}

/// A loop of which the response does not show at the frequencies that are looked at has no margins.
#[test]
fn what_is_too_slow_or_too_little_damped_is_refused() {
    for (frequency, damping, message) in [
        (400.0, 1e-9, "damping: expected 1e-7 or more to tune for, got 1e-9"),
        (
            1e-4,
            0.5,
            "dt: expected at least 1e-5 of 1 / (2 pi f) of the slowest part of dynamics and amplifier, got 0.0001",
        ),
        (
            1.0,
            1e6,
            "dt: expected at least 1e-5 of 1 / (2 pi f) of the slowest part of dynamics and amplifier, got 0.0001",
        ),
    ] {
        let stage = SecondOrder::new(frequency, damping).unwrap().into();
        let error = tune(&stage, &options()).unwrap_err();
        assert_eq!(error.to_string(), message);
    }
    assert!(tune(&a1().then(FirstOrder::new(1e-4).unwrap()), &options()).is_err());
}

/// 800 Hz, damping 0.02 and a sample of dead time: ten times what gains alone allow, for every mode that may be.
#[test]
fn a_lightly_damped_mode_gets_filters() {
    let stage = |f, zeta| LinearDynamics::from(SecondOrder::new(f, zeta).unwrap()).then(Delay::new(1e-4).unwrap());
    let options = TuningOptions::new((0.7, 1.0), 1e-4, 1.7);
    let tuning = tune(&stage(800.0, 0.02), &options).unwrap();
    println!("{tuning:#?}");
    let of = |structure| tuning.tried.iter().find(|(one, _)| *one == structure).unwrap().1;
    assert!(tuning.structure == Structure::Notch && tuning.ki > 20.0 * of(Structure::ProportionalIntegral));
    assert!(of(Structure::LowPass).min(of(Structure::ActiveDamping)) > 20.0 * of(Structure::ProportionalIntegral));
    assert!(tuning.rejection_bandwidth > 80.0);
    // Known exactly, the mode allows more; the bound holds for all that it may be.
    let known = TuningOptions { uncertainty: ModeUncertainty::NONE, ..options };
    assert!(tune(&stage(800.0, 0.02), &known).unwrap().ki > 1.05 * tuning.ki);
    for (f, zeta) in [(760.0, 0.01), (760.0, 0.04), (840.0, 0.01), (840.0, 0.04)] {
        for slope in [0.7, 0.85, 1.0] {
            let gains = (tuning.kp, tuning.ki);
            let margins = loop_margins(&stage(f, zeta), 1e-4, &tuning.filters, gains, slope).unwrap();
            assert!(margins.peak_sensitivity <= 1.7 * (1.0 + 1e-9), "{f} {zeta}: {margins:?}");
        }
    }
    let unknown = |frequency, damping| TuningOptions { uncertainty: ModeUncertainty { frequency, damping }, ..options };
    let refused = |frequency, damping| tune(&stage(800.0, 0.02), &unknown(frequency, damping)).unwrap_err().to_string();
    assert_eq!(refused(0.6, 2.0), "frequency_uncertainty: expected a share from 0 to 0.5, got 0.6");
    assert_eq!(refused(0.05, 0.5), "damping_uncertainty: expected a factor from 1 to 100, got 0.5");
}

/// A notch costs phase: a mode whose resonance stays below the loop has none.
#[test]
fn modes_that_need_a_notch_get_one() {
    let modes = [SecondOrder::new(600.0, 0.02).unwrap(), SecondOrder::new(1100.0, 0.03).unwrap()];
    let stage = |share: f64| {
        let modes = Modes::new(&[1.0 - share, share], &modes).unwrap();
        LinearDynamics::from(modes).then(Delay::new(1e-4).unwrap())
    };
    let options = TuningOptions::new((0.7, 1.0), 1e-4, 1.7);
    let notched = |share| -> Vec<f64> {
        let filters = tune(&stage(share), &options).unwrap().filters;
        filters
            .iter()
            .map(|filter| if let FeedbackFilter::Notch(notch) = filter { notch.frequency() } else { 0.0 })
            .collect()
    };
    assert_eq!(notched(0.01), [600.0]);
    assert_eq!(notched(0.5), [600.0, 1100.0]);
    assert_eq!(notched(0.99), [1100.0]);
}

/// A load that is heavier on one side moves neighbours apart, or together: not all modes by the same share.
#[test]
fn every_mode_may_be_off_by_itself() {
    let stage = |off: &[f64], damping: f64| {
        let known = [(600.0, 0.02), (760.0, 0.03), (1000.0, 0.02), (1500.0, 0.04)];
        let modes: Vec<_> =
            known.iter().zip(off).map(|((f, zeta), off)| SecondOrder::new(f * off, zeta * damping).unwrap()).collect();
        let gains = &[1.0, 0.6, 0.5, 0.3][..modes.len()];
        let share = gains.iter().sum::<f64>();
        let gains: Vec<_> = gains.iter().map(|gain| gain / share).collect();
        LinearDynamics::from(Modes::new(&gains, &modes).unwrap()).then(Delay::new(1e-4).unwrap())
    };
    let options = TuningOptions::new((0.7, 1.0), 1e-4, 1.7);
    let (rises, falls) = (1.05, 0.95);
    let apart: [&[&[f64]]; 3] = [
        &[&[rises, falls], &[falls, rises]],
        &[&[rises, falls, rises]],
        &[&[rises, falls, rises, falls], &[falls, falls, rises, rises]],
    ];
    for cases in apart {
        let known = stage(&vec![1.0; cases[0].len()], 1.0);
        let tuning = tune(&known, &options).unwrap();
        let gains = (tuning.kp, tuning.ki);
        let dampings_and_slopes = [(0.5, 0.7), (0.5, 1.0), (2.0, 0.7), (2.0, 1.0)];
        let each = cases.iter().flat_map(|off| dampings_and_slopes.map(|(damping, slope)| (*off, damping, slope)));
        for (off, damping, slope) in each {
            let margins = loop_margins(&stage(off, damping), 1e-4, &tuning.filters, gains, slope).unwrap();
            assert!(margins.peak_sensitivity <= 1.7 * (1.0 + 1e-9), "{off:?} {damping} {slope}: {margins:?}");
        }
    }
}

#[test]
fn a_structure_can_be_asked_for() {
    let stage = LinearDynamics::from(SecondOrder::new(800.0, 0.02).unwrap()).then(Delay::new(1e-4).unwrap());
    let options = TuningOptions::new((0.7, 1.0), 1e-4, 1.7);
    let free = tune(&stage, &options).unwrap();
    for structure in Structure::ALL {
        let asked = TuningOptions { structure: Some(structure), ..options };
        let tuning = tune(&stage, &asked).unwrap();
        assert_eq!(tuning.structure, structure);
        assert!(tuning.peak_sensitivity <= 1.7 && tuning.peak_sensitivity > 1.69);
        assert_eq!(tuning.kp < 0.0, structure == Structure::ActiveDamping);
        assert!(tuning.ki <= free.ki * 1.05);
        assert!(tuning.explanation(&asked).contains("was asked for"));
        // What is found roughly for the structure is what is found closely.
        let (_, roughly) = *tuning.tried.iter().find(|(one, _)| *one == structure).unwrap();
        assert!((tuning.ki / roughly - 1.0).abs() < 0.1, "{structure:?}: {} {roughly}", tuning.ki);
    }
    assert_eq!(tune(&stage, &TuningOptions { structure: Some(free.structure), ..options }).unwrap(), free);
    let refused = |stage: &LinearDynamics, structure| {
        tune(stage, &TuningOptions { structure: Some(structure), ..options }).unwrap_err().to_string()
    };
    for filters in [Structure::LowPass, Structure::ActiveDamping, Structure::Notch] {
        assert_eq!(
            refused(&a1(), filters),
            format!(
                "structure: expected \"proportional-integral\" for dynamics without modes for filters, with a damping ratio below \
                 0.5 and below 0.45 of the sampling rate, got {:?}",
                filters.name()
            )
        );
    }
    // A mode beyond half of the sampling rate shows nothing that a notch could take out.
    let fast = SecondOrder::new(6000.0, 0.02).unwrap().into();
    assert!(refused(&fast, Structure::Notch).starts_with("structure: expected \"proportional-integral\" for"));
    let alone = TuningOptions { structure: Some(Structure::ProportionalIntegral), ..options };
    assert_eq!(tune(&a1(), &alone).unwrap(), tune(&a1(), &options).unwrap());
}

#[test]
fn the_loops_of_a_tuning_have_its_margins_and_keep_its_bound() {
    let stage = LinearDynamics::from(SecondOrder::new(800.0, 0.02).unwrap()).then(Delay::new(1e-4).unwrap());
    let options = TuningOptions::new((0.7, 1.0), 1e-4, 1.7);
    let tuning = tune(&stage, &options).unwrap();
    let family = LoopFamily::new(&stage, &options, &tuning).unwrap();
    for margins in [&tuning.at_min_slope, &tuning.at_max_slope] {
        let at = |f| family.open_loop(&[f], margins.slope).unwrap()[0];
        assert!((at(margins.crossover).norm() - 1.0).abs() < 1e-6);
        let peak = family.sensitivity(&[margins.peak_frequency], margins.slope).unwrap()[0];
        assert!((peak.norm() - margins.peak_sensitivity).abs() < 1e-6);
    }
    let frequencies: Vec<f64> = (1..=50_000).map(|i| 0.1 * f64::from(i)).collect();
    let worst = family.worst_sensitivity(&frequencies).unwrap();
    let highest = worst.iter().copied().fold(0.0, f64::max);
    assert!(highest <= tuning.peak_sensitivity * (1.0 + 1e-9) && highest > 0.999 * tuning.peak_sensitivity);
    for slope in [0.7, 0.8, 1.0] {
        let nominal = family.sensitivity(&frequencies, slope).unwrap();
        assert!(nominal.iter().zip(&worst).all(|(s, worst)| s.norm() <= worst * (1.0 + 1e-12)));
    }
    // Up to the rejection bandwidth all loops reduce disturbances, and right above it one does not.
    let at = |f: f64| family.worst_sensitivity(&[f]).unwrap()[0];
    assert!(at(0.999 * tuning.rejection_bandwidth) < 0.5_f64.sqrt());
    assert!(at(1.001 * tuning.rejection_bandwidth) > 0.5_f64.sqrt());
    let refused = |f, slope| family.open_loop(&[1.0, f], slope).unwrap_err().to_string();
    assert_eq!(refused(0.0, 1.0), "frequencies[1]: expected a finite number above 0 (1e-100 to 1e100), got 0.0");
    assert_eq!(refused(5001.0, 1.0), "frequencies[1]: expected a number from 0.0 to 5000.0, got 5001.0");
    assert!(refused(1.0, 0.0).starts_with("slope: expected a finite number above 0"));
    assert!(family.open_loop(&[5000.0], 1.0).unwrap()[0].im.abs() < 1e-9);
}
