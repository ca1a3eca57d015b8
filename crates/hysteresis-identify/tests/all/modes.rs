//! Modes in parallel come back from records of a stage that is simulated apart from the fit.

use crate::actuators::{decaying_triangle, noise, run};
use hysteresis_control::linear::{Block, Dynamics, FirstOrder, LinearDynamics, Modes, SecondOrder};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
use hysteresis_identify::{
    AmplifierModel, DynamicsModel, Error, FindingCode, Identification, ModesModel, Options, Order, Record, Setting,
    Thresholds,
};

/// Sub-steps of a sampling interval.
const STEPS: u32 = 20;

/// Of the noise, in um.
const DEVIATION: f64 = 0.02;

/// A stage of about 100 um.
struct Truth {
    /// Gain, frequency and damping of its modes.
    modes: Vec<[f64; 3]>,
    /// In Hz.
    amplifier: Option<f64>,
    /// In sub-steps.
    dead_time: usize,
    dt: f64,
}

fn hysteresis() -> ModifiedPrandtlIshlinskii {
    let ratios = Ratios { ra: 0.8, rb: 0.5, rc: 0.6 };
    let (weights, thresholds) = ([1.0, 0.25, 0.2, 0.15, 0.1], [0.0, 10.0, 20.0, 30.0, 40.0]);
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, ratios, Offsets::default()).unwrap()
}

/// Swings of -50 to 50 V and smaller ones, steps, and a chirp to a third of the sampling rate.
fn drive() -> Vec<f64> {
    let mut drive = decaying_triangle(4000, 50.0, 9.5, 0.0);
    for level in [20.0, -10.0, 35.0, 0.0] {
        drive.extend([level; 300]);
    }
    drive.extend((0..2000_u32).map(|k| f64::from(k) / 2000.0).map(|share| {
        let phase = std::f64::consts::TAU * 0.33 * 2000.0 * (1e-3 * share + 0.5 * share * share);
        4.0 * phase.sin() * (1.0 - share).min(0.05) / 0.05
    }));
    drive
}

impl Truth {
    fn at_10_khz(modes: &[[f64; 3]]) -> Self {
        Self { modes: modes.to_vec(), amplifier: None, dead_time: 26, dt: 1e-4 }
    }

    fn dynamics(&self) -> LinearDynamics {
        let gains: Vec<f64> = self.modes.iter().map(|mode| mode[0]).collect();
        let modes: Vec<_> = self.modes.iter().map(|[_, f, zeta]| SecondOrder::new(*f, *zeta).unwrap()).collect();
        Modes::new(&gains, &modes).unwrap().into()
    }

    /// The rows without noise: everything in small steps.
    fn rows(&self, drive: &[f64]) -> Vec<f64> {
        let fine = self.dt / f64::from(STEPS);
        let (mut hysteresis, mut block) = (hysteresis().forward(), self.dynamics().block(fine).unwrap());
        let mut amplifier = self.amplifier.map(|f| FirstOrder::new(f).unwrap().block(fine).unwrap());
        if let Some(amplifier) = &mut amplifier {
            amplifier.settle(drive[0]);
        }
        let mut positions = vec![block.settle(hysteresis.step(drive[0]))];
        for u in drive {
            for _ in 0..STEPS {
                let voltage = amplifier.as_mut().map_or(*u, |amplifier| amplifier.advance(*u));
                positions.push(block.advance(hysteresis.step(voltage)));
            }
        }
        (0..drive.len()).map(|k| positions[(k * 20).saturating_sub(self.dead_time)]).collect()
    }

    /// The rows with noise, from a converter of 16 bits for 100 um.
    fn measured(&self, drive: &[f64], seed: u64) -> Vec<f64> {
        let bit = 100.0 / 65536.0;
        let noise = noise(drive.len(), DEVIATION, seed);
        self.rows(drive).iter().zip(noise).map(|(y, e)| ((y + e) / bit).round() * bit).collect()
    }

    fn found(&self, seed: u64, options: &Options) -> Identification {
        let drive = drive();
        self.found_in(&drive, &self.measured(&drive, seed), options)
    }

    fn found_in(&self, drive: &[f64], position: &[f64], options: &Options) -> Identification {
        let options = Options { dt: Some(self.dt), ..options.clone() };
        run(&[Record::new(drive, position, 0).unwrap()], &options).unwrap()
    }

    /// That the modes are those of this stage, and that another record is predicted.
    fn check(&self, found: &Identification) {
        let told = told(found);
        let case = format!("{:?}: {told:?} {:?} {:?}", self.modes, found.dynamics, found.warnings);
        assert_eq!(told.len(), self.modes.len(), "{case}");
        for ([gain, frequency, damping], [g, f, zeta]) in told.iter().zip(&self.modes) {
            assert!((gain / g - 1.0).abs() < 0.05, "{case}");
            assert!((frequency / f - 1.0).abs() < 0.003, "{case}");
            assert!((damping / zeta - 1.0).abs() < 0.1, "{case}");
        }
        assert!(found.fit.rmse < 1.1 * DEVIATION, "{case} {:?}", found.fit);
        let other: Vec<f64> =
            (0..1500).map(|k| 12.0 + 30.0 * (f64::from(k) / 17.0).sin() + f64::from(k / 300 % 2)).collect();
        let (rows, predicted) = (self.rows(&other), found.predict(&other).unwrap());
        // The output offset is that of the record, which differs by the noise.
        let worst = rows.iter().zip(&predicted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 3.0 * DEVIATION, "{case}: {worst}");
    }
}

fn options() -> Options {
    Options {
        thresholds: Thresholds::Given(vec![0.0, 10.0, 20.0, 30.0, 40.0]),
        input_offset: Setting::Fixed(0.0),
        ..Options::default()
    }
}

/// Gain, frequency and damping of several modes.
fn told(found: &Identification) -> Vec<[f64; 3]> {
    let Some(modes) = &found.modes else { return Vec::new() };
    modes.gains().iter().zip(modes.modes()).map(|(gain, mode)| [*gain, mode.frequency(), mode.damping()]).collect()
}

#[test]
fn two_modes_come_back() {
    let fast = Truth::at_10_khz(&[[0.8, 800.0, 0.02], [0.2, 1900.0, 0.01]]);
    let slow = Truth { modes: vec![[0.8, 60.0, 0.02], [0.2, 140.0, 0.01]], amplifier: None, dead_time: 0, dt: 1e-3 };
    // The weaker one first, and one that moves against the other.
    let weak = Truth::at_10_khz(&[[0.2, 400.0, 0.03], [0.8, 900.0, 0.02]]);
    let against = Truth::at_10_khz(&[[1.3, 700.0, 0.03], [-0.3, 1500.0, 0.02]]);
    for (seed, truth) in (1..).zip([fast, slow, weak, against]) {
        let found = truth.found(seed, &options());
        truth.check(&found);
        assert!(found.dynamics.is_none() && found.warnings.is_empty(), "{:?}", found.warnings);
        let dead_time = f64::from(u32::try_from(truth.dead_time).unwrap()) / f64::from(STEPS);
        assert!((found.dead_time_samples.unwrap() - dead_time).abs() < 0.01, "{:?}", found.dead_time_samples);
        let lags = truth.modes.iter().map(|[gain, f, zeta]| gain * 2.0 * zeta / (std::f64::consts::TAU * f));
        let lag = dead_time * truth.dt + lags.sum::<f64>();
        assert!((found.lag - lag).abs() < 5.0 * found.standard_errors.lag.max(1e-9), "{} {lag}", found.lag);
    }
}

/// Once glitches are known they are left out of the search for a further mode too.
#[test]
fn glitches_do_not_hide_a_mode() {
    let truth = Truth::at_10_khz(&[[0.8, 800.0, 0.02], [0.2, 1900.0, 0.01]]);
    let drive = drive();
    let mut position = truth.measured(&drive, 1);
    let wrong: Vec<usize> = (50..position.len()).step_by(97).collect();
    for k in &wrong {
        position[*k] = if k % 2 == 0 { -20.0 } else { 60.0 };
    }
    let found = truth.found_in(&drive, &position, &options());
    truth.check(&found);
    assert_eq!(found.left_out_samples, [wrong]);
}

#[test]
fn three_modes_come_back() {
    let truth = Truth::at_10_khz(&[[0.7, 500.0, 0.02], [0.2, 1300.0, 0.01], [0.1, 2400.0, 0.015]]);
    truth.check(&truth.found(1, &options()));
    truth.check(&truth.found(2, &Options { modes: ModesModel::Number(3), ..options() }));
}

/// The amplifier is judged once the modes are known.
#[test]
fn two_modes_behind_an_amplifier_come_back() {
    let modes = vec![[0.8, 800.0, 0.02], [0.2, 1900.0, 0.01]];
    let truth = Truth { modes, amplifier: Some(400.0), dead_time: 26, dt: 1e-4 };
    let found = truth.found(1, &options());
    truth.check(&found);
    assert!((found.amplifier().unwrap().frequency() / 400.0 - 1.0).abs() < 0.01, "{:?}", found.amplifier());
    assert!((found.dead_time_samples.unwrap() - 1.3).abs() < 0.05, "{:?}", found.dead_time_samples);
    let given = Options {
        dynamics: DynamicsModel::Order(Order::Second),
        amplifier: AmplifierModel::Bandwidth(400.0),
        ..options()
    };
    truth.check(&truth.found(2, &given));
    let without = Truth { amplifier: None, ..truth };
    assert!(without.found(3, &options()).amplifier().is_none());
}

/// The stage has the modes: it repeats the prediction. The standard errors are those of the covariance, and hold the
/// truth.
#[test]
fn stage_and_errors_have_all_modes() {
    let truth = Truth::at_10_khz(&[[0.8, 800.0, 0.02], [0.2, 1900.0, 0.01]]);
    let found = truth.found(4, &options());
    assert_eq!((found.linear_dynamics().order(), found.stage_parts().dynamics), (4, found.linear_dynamics()));
    let mut forward = found.stage().unwrap().forward(1e-4).unwrap();
    forward.settle(0.0);
    let rows = drive().iter().map(|u| forward.step(*u)).collect::<Vec<_>>();
    let worst = rows.iter().zip(found.predict(&drive()).unwrap()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-9, "{worst}");
    let errors = &found.standard_errors.modes;
    assert_eq!((errors.len(), found.standard_errors.frequency), (2, errors[0][0]));
    for (place, (got, want)) in told(&found).iter().zip(&truth.modes).enumerate() {
        for (name, error, difference) in [
            ("frequency", errors[place][0], got[1] - want[1]),
            ("damping", errors[place][1], got[2] - want[2]),
            ("gain", errors[place][2], got[0] - want[0]),
        ] {
            let name = format!("{name}[{place}]");
            let row = found.covariance.parameters.iter().position(|parameter| *parameter == name).unwrap();
            assert!((found.covariance.matrix[row][row].sqrt() / error - 1.0).abs() < 1e-9, "{name}");
            assert!(difference.abs() < 5.0 * error, "{name}: {difference} {error}");
        }
    }
    let std = found.predict_std(&drive()).unwrap();
    assert!(std.iter().all(|std| *std < DEVIATION), "{std:?}");
}

/// Noise is no mode, and neither is an amplifier or a lag.
#[test]
fn one_mode_stays_one() {
    for seed in 0..12_u32 {
        let (place, step) = (f64::from(seed), f64::from(seed % 4));
        let mode = [1.0, 150.0 * 1.28_f64.powf(place), 0.004 * 4.0_f64.powf(step)];
        let amplifier = (seed % 3 == 0).then_some(300.0 + 100.0 * place);
        let truth = Truth { modes: vec![mode], amplifier, dead_time: 3 * seed as usize, dt: 1e-4 };
        let found = truth.found(u64::from(seed), &options());
        let case = format!("{mode:?} {amplifier:?}: {:?} {:?}", told(&found), found.dynamics);
        assert_eq!(found.modes, None, "{case}");
        let Some(Dynamics::SecondOrder(resonance)) = found.dynamics else { panic!("{case}") };
        assert!((resonance.frequency() / mode[1] - 1.0).abs() < 0.01, "{case}");
    }
}

#[test]
fn modes_that_the_records_do_not_tell_are_named() {
    let truth = Truth::at_10_khz(&[[1.0, 800.0, 0.02]]);
    let found = truth.found(1, &Options { modes: ModesModel::Number(2), ..options() });
    let finding = found.warnings.iter().find(|one| one.code == FindingCode::ModeNotTold).unwrap();
    assert!(finding.message.starts_with("of 2 modes that were asked for the records tell 1:"), "{finding}");
    assert!(finding.value < finding.limit && found.modes.is_none() && found.dynamics.is_some());
    // One is what was asked for.
    let two = Truth::at_10_khz(&[[0.8, 800.0, 0.02], [0.2, 1900.0, 0.01]]);
    let found = two.found(1, &Options { modes: ModesModel::Number(1), ..options() });
    assert!(found.modes.is_none() && found.dynamics.is_some());
}

#[test]
fn numbers_of_modes_are_checked() {
    let drive = drive();
    let record = [Record::new(&drive, &drive, 0).unwrap()];
    let refused = |modes, dynamics, dt| run(&record, &Options { modes, dynamics, dt, ..options() }).unwrap_err();
    for (modes, dynamics, expected) in [
        (ModesModel::Number(0), DynamicsModel::Auto, "modes: expected 1, 2 or 3, got 0"),
        (ModesModel::Number(4), DynamicsModel::Auto, "modes: expected 1, 2 or 3, got 4"),
        (ModesModel::Number(2), DynamicsModel::None, "modes: expected 1 without second-order dynamics"),
        (ModesModel::Number(3), DynamicsModel::Order(Order::First), "modes: expected 1 without second-order dynamics"),
    ] {
        let error = refused(modes, dynamics, Some(1e-4));
        assert!(error.to_string().starts_with(expected) && error.parameter() == Some("modes"), "{error}");
    }
    // Several modes are dynamics of second order, which need seconds.
    assert_eq!(refused(ModesModel::Number(2), DynamicsModel::Auto, None), Error::NoInterval { record: 0 });
}
