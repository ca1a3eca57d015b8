//! The stage as one object.

use hysteresis_control::linear::{Block, Creep, FirstOrder, LinearDynamics, SecondOrder};
use hysteresis_control::stage::{
    Error, FeedForwardKind, Identified, PrecompensateOptions, RecordSource, Stage, StageParts, StageWarning,
};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, Process, Ratios};

const DT: f64 = 1e-4;

/// Hysteresis of about 15 % over 0..150 V and 100 um.
fn hysteresis() -> ModifiedPrandtlIshlinskii {
    let n = 20_u32;
    let r: Vec<f64> = (0..n).map(|i| 7.5 * f64::from(i)).collect();
    let w: Vec<f64> = (0..n).map(|i| if i == 0 { 0.53 } else { 0.02 * 0.9_f64.powi(i.cast_signed()) }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios { ra: 0.95, rb: 0.3, rc: 0.35 }, Offsets::default()).unwrap()
}

fn creep() -> Creep {
    Creep::logarithmic(0.012, 0.01, 100.0, 8).unwrap()
}

/// Triangle of 70 % of the stroke at 10 Hz, with its beginning at 0.
fn raster(seconds: f64) -> Vec<f64> {
    let triangle = |t: f64| 2.0 * ((t + 0.5).rem_euclid(1.0) - 0.5).abs();
    let times = (0_u32..).map(|k| DT * f64::from(k)).take_while(|t| *t < seconds - 0.5 * DT);
    times.map(|t| 70.0 * triangle(10.0 * t)).collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), e| (sum + e * e, n + 1.0));
    (sum / f64::sqrt(n) / f64::sqrt(n)).sqrt()
}

fn lightly_damped() -> Stage {
    Stage::new(StageParts {
        creep: Some(creep()),
        dynamics: SecondOrder::new(800.0, 0.02).unwrap().into(),
        dead_time: DT,
        limits: Some((-10.0, 150.0)),
        ..StageParts::new(hysteresis())
    })
    .unwrap()
}

/// A plant written from its equations, apart from the stage: loop over plays, creep and mode in the same order.
struct Bench {
    hysteresis: hysteresis_core::Forward,
    mode: hysteresis_control::linear::LinearBlock,
    creep: Vec<(f64, f64, f64)>,
    waiting: f64,
}

impl Bench {
    fn new() -> Self {
        let creep = creep();
        let terms = creep.amplitudes().iter().zip(creep.time_constants());
        Self {
            hysteresis: hysteresis().forward(),
            mode: SecondOrder::new(800.0, 0.02).unwrap().block(DT).unwrap(),
            creep: terms.map(|(c, tau)| (*c, (-DT / tau).exp(), 0.0)).collect(),
            waiting: 0.0,
        }
    }

    fn step(&mut self, drive: f64) -> f64 {
        let h = self.hysteresis.step(core::mem::replace(&mut self.waiting, drive));
        let moved = self.mode.step(h);
        let mut y = moved;
        for (c, a, q) in &mut self.creep {
            y += *c * *q;
            *q = *a * *q + (1.0 - *a) * moved;
        }
        y
    }
}

// 0.02 % of the stroke.
#[test]
fn open_loop_raster_of_a_lightly_damped_creeping_stage() {
    let reference = raster(2.0);
    let found = lightly_damped().precompensate(&reference, DT, &PrecompensateOptions::default()).unwrap();
    assert_eq!((found.drive.len(), found.saturated_count), (reference.len(), 0));
    let mut bench = Bench::new();
    let errors: Vec<f64> = found.drive.iter().zip(&reference).map(|(u, r)| bench.step(*u) - r).collect();
    let all = rms(errors.iter().copied());
    assert!(all < 2e-4 * 100.0, "{all} um rms of 100 um");
}

/// An amplifier in front of the hysteresis: its lag does not commute with that, so its inverse comes last. Before it
/// came first, and a hundred times as much was left, in open loop and with a preview. What is left are the corners,
/// which no drive follows.
#[test]
fn the_lag_of_an_amplifier_is_inverted_last() {
    let parts = StageParts {
        amplifier: Some(FirstOrder::new(250.0).unwrap()),
        dynamics: SecondOrder::new(160.0, 0.04).unwrap().into(),
        dead_time: 3e-4,
        limits: Some((-100.0, 250.0)),
        ..StageParts::new(hysteresis())
    };
    let (stage, reference) = (Stage::new(parts).unwrap(), raster(0.4));
    let found = stage.precompensate(&reference, DT, &PrecompensateOptions::default()).unwrap();
    assert_eq!((found.saturated_count, found.slewing_count), (0, 0));
    let mut plant = stage.forward(DT).unwrap();
    let errors: Vec<f64> = found.drive.iter().zip(&reference).map(|(u, r)| plant.step(*u) - r).collect();
    let open = rms(errors[1000..].iter().copied());
    assert!(open < 2e-4 * 70.0, "{open} um rms of 70 um");

    let options = stage.controller_options_with_gains(DT, None, (0.0, 0.0)).unwrap();
    let ahead = stage.preview_ahead(DT).unwrap();
    let kind = FeedForwardKind::Preview { ahead, smoothing: 0.0 };
    let mut controller = stage.controller(kind, &options).unwrap();
    let mut plant = stage.forward(DT).unwrap();
    let mut errors = Vec::new();
    for k in 0..reference.len() - ahead {
        let drive = controller.step(reference[k + ahead].into(), 0.0);
        errors.push(plant.step(drive) - reference[k]);
    }
    let previewed = rms(errors[1000..].iter().copied());
    assert!(previewed < 1e-3 * 70.0, "{previewed} um rms of 70 um");
}

#[test]
fn the_stage_is_the_plant_of_its_equations() {
    let mut forward = lightly_damped().forward(DT).unwrap();
    let mut bench = Bench::new();
    for k in 0..5000 {
        let drive = 40.0 - 40.0 * (0.01 * f64::from(k)).cos() + if k % 700 > 600 { 20.0 } else { 0.0 };
        let (stage, plant) = (forward.step(drive), bench.step(drive));
        // Creep before or behind the mode: they commute but for what creeps within a sample.
        assert!((stage - plant).abs() < 2e-3, "{k}: {stage} {plant}");
    }
}

#[test]
fn forward_of_inverse_is_the_target_with_maps_and_creep() {
    let stage = Stage::new(StageParts {
        creep: Some(Creep::new(&[0.004, 0.003, 0.005], &[0.02, 0.5, 20.0]).unwrap()),
        input_map: Some(PiecewiseLinearMap::new(&[0.0, 50.0, 150.0], &[0.0, 55.0, 150.0]).unwrap()),
        output_map: Some(PiecewiseLinearMap::new(&[0.0, 40.0, 100.0], &[0.0, 42.0, 100.0]).unwrap()),
        limits: Some((-20.0, 150.0)),
        ..StageParts::new(hysteresis())
    })
    .unwrap();
    let (mut forward, mut inverse) = (stage.forward(DT).unwrap(), stage.inverse(DT, None).unwrap());
    for target in raster(0.5) {
        assert!((forward.step(inverse.step(target)) - target).abs() < 1e-11 * 100.0);
    }
}

#[test]
fn a_reference_that_begins_elsewhere_needs_a_lead_in() {
    let stage = lightly_damped();
    let reference: Vec<f64> = raster(0.2).iter().map(|r| r + 10.0).collect();
    let error = stage.precompensate(&reference, DT, &PrecompensateOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Start { got: 10.0, .. }), "{error}");
    assert!(error.to_string().contains("give `lead_in`,"), "{error}");
    let options = PrecompensateOptions { lead_in: Some(0.05), ..PrecompensateOptions::default() };
    let found = stage.precompensate(&reference, DT, &options).unwrap();
    assert_eq!((found.lead_in_samples, found.drive.len()), (500, reference.len() + 500));
    // From rest into the motion of the raster, so that there is nothing to catch up with.
    let largest_step = found.drive[..500].windows(2).map(|w| (w[1] - w[0]).abs()).fold(found.drive[0].abs(), f64::max);
    assert!(largest_step < 0.4, "{largest_step} V");
    let mut bench = Bench::new();
    let positions: Vec<f64> = found.drive.iter().map(|u| bench.step(*u)).collect();
    let error = rms(positions[500..].iter().zip(&reference).map(|(y, r)| y - r));
    assert!(error < 0.02, "{error}");
}

/// A first step of 5 % of the span stands out where all later ones are a tenth of it; one of 26 % is told beside steps
/// nearly as large; one below 1 % of the span is not, nor what begins at rest.
#[test]
fn a_first_step_that_stands_out_is_told() {
    let rigid = ModifiedPrandtlIshlinskii::from_ratios(&[0.5], &[0.0], Ratios::PAPER, Offsets::default()).unwrap();
    let lag = FirstOrder::new(100.0).unwrap();
    let stage = Stage::new(StageParts { dynamics: lag.into(), ..StageParts::new(rigid) }).unwrap();
    let found = |reference: &[f64]| stage.precompensate(reference, DT, &PrecompensateOptions::default()).unwrap();
    // The inverse of the lag is ahead by its time constant: 16 samples.
    let sine =
        |frequency: f64| (0..2000).map(move |k| 30.0 * (core::f64::consts::TAU * frequency * DT * f64::from(k)).sin());
    let in_motion = found(&sine(5.0).collect::<Vec<_>>());
    let (first, span) = (in_motion.first_step, 4.0 * 30.0);
    assert!(0.02 * span < first && first < 0.05 * span, "{first}");
    assert!(in_motion.begins_with_a_jump());
    let slow = found(&sine(0.5).take(2000).map(|r| r * 2.0).collect::<Vec<_>>());
    assert!(slow.first_step < 0.01 * 4.0 * 60.0 && !slow.begins_with_a_jump(), "{}", slow.first_step);
    let at_rest: Vec<f64> = (0..2000).map(|k| 30.0 - 30.0 * (0.003 * f64::from(k)).cos()).collect();
    assert!(!found(&at_rest).begins_with_a_jump());
    let large = found(&sine(60.0).collect::<Vec<_>>());
    assert!(large.begins_with_a_jump(), "{}", large.first_step);
}

#[test]
fn drives_keep_limits_and_slew() {
    let parts = StageParts { slew: Some(2e3), limits: Some((0.0, 80.0)), ..lightly_damped().parts().clone() };
    let found = Stage::new(parts).unwrap().precompensate(&raster(0.3), DT, &PrecompensateOptions::default()).unwrap();
    assert!(found.slewing_count > 0 && found.saturated_count > 0);
    let mut last = 0.0_f64;
    for drive in found.drive {
        assert!((0.0..=80.0).contains(&drive) && (drive - last).abs() <= 2e3 * DT * (1.0 + 1e-12));
        last = drive;
    }
}

/// At the limit itself a target is reached but for rounding, whether it is a large number or a small one.
#[test]
fn targets_beyond_the_limits_are_counted_and_those_at_them_are_not() {
    for slope in [1.0 / 3.0, 1e-4 / 3.0, 1e4 / 3.0] {
        let rigid = ModifiedPrandtlIshlinskii::from_ratios(&[slope], &[0.0], Ratios::PAPER, Offsets::default());
        let stage = Stage::new(StageParts { limits: Some((-10.0, 150.0)), ..StageParts::new(rigid.unwrap()) }).unwrap();
        for (beyond, counted) in [(0.0, 0), (1e-12, 0), (1e-6 + 1e-6 / slope, 7), (0.5, 7)] {
            let highest = slope * 150.0 * (1.0 + beyond);
            // A tenth of a second up and down, and seven samples at the top.
            let up: Vec<f64> = (0..1000).map(|k| slope * 149.0 * f64::from(k) / 1000.0).collect();
            let reference: Vec<f64> = up.iter().copied().chain([highest; 7]).chain(up.iter().rev().copied()).collect();
            let found = stage.precompensate(&reference, DT, &PrecompensateOptions::default()).unwrap();
            assert_eq!(found.saturated_count, counted, "{slope} {beyond}");
            assert_eq!(found.drive.iter().filter(|drive| **drive == 150.0).count(), 7);
        }
    }
}

#[test]
fn a_stage_file_reads_back_bit_for_bit() {
    let dynamics = LinearDynamics::from(FirstOrder::new(3000.0).unwrap()).then(SecondOrder::new(800.0, 0.02).unwrap());
    let stage = Stage::new(StageParts {
        dynamics,
        amplifier: Some(FirstOrder::new(5000.0).unwrap()),
        output_map: Some(PiecewiseLinearMap::new(&[0.0, 1.0 / 3.0], &[0.1, 0.7]).unwrap()),
        noise: Some(0.02),
        ..lightly_damped().parts().clone()
    })
    .unwrap();
    assert_eq!(Stage::from_json(&stage.to_json()).unwrap(), stage);
    let cut = &stage.to_json()[..300];
    assert!(Stage::from_json(cut).unwrap_err().to_string().starts_with("not a stage file"));
    let other = stage.to_json().replace("mpi_hyst/stage/1", "mpi_hyst/stage/9");
    assert!(Stage::from_json(&other).unwrap_err().to_string().contains("expected \"mpi_hyst/stage/1\""));
}

#[test]
fn a_model_file_is_a_stage_of_hysteresis_alone() {
    let model = hysteresis_core::Model::from(hysteresis());
    let stage = Stage::from_json(&model.to_json()).unwrap();
    assert_eq!(stage, Stage::new(StageParts::new(hysteresis())).unwrap());
}

#[test]
fn a_restored_stage_continues_bit_for_bit() {
    for amplifier in [None, Some(FirstOrder::new(5000.0).unwrap())] {
        let stage = Stage::new(StageParts { amplifier, ..lightly_damped().parts().clone() }).unwrap();
        let (mut one, mut other) = (stage.forward(DT).unwrap(), stage.forward(DT).unwrap());
        for k in 0..300 {
            one.step(30.0 + 20.0 * (0.1 * f64::from(k)).sin());
        }
        other.set_state(&one.state()).unwrap();
        for k in 0..300 {
            let drive = 60.0 * (0.03 * f64::from(k)).cos().abs();
            assert_eq!(one.step(drive).to_bits(), other.step(drive).to_bits());
        }
    }
}

#[test]
fn a_reading_is_the_next_row() {
    let stage = lightly_damped();
    let (mut rows, mut plant) = (stage.forward(DT).unwrap(), stage.forward(DT).unwrap());
    let mut reading = plant.output();
    for k in 0..500 {
        let drive = 30.0 - 30.0 * (0.02 * f64::from(k)).cos();
        assert!((rows.step(drive) - reading).abs() < 1e-9);
        reading = plant.advance(drive);
    }
}

#[test]
fn bad_parts_are_named() {
    let parts = || StageParts::new(hysteresis());
    for (parts, name) in [
        (StageParts { dead_time: f64::NAN, ..parts() }, "dead_time"),
        (StageParts { limits: Some((1.0, 1.0)), ..parts() }, "limits[1]"),
        (StageParts { slew: Some(0.0), ..parts() }, "slew"),
        (StageParts { noise: Some(-1.0), ..parts() }, "noise"),
    ] {
        let error = Stage::new(parts).unwrap_err();
        assert!(error.to_string().starts_with(name), "{error}");
    }
    let stage = Stage::new(StageParts { dead_time: -1e-4, ..parts() }).unwrap();
    assert!(stage.forward(DT).unwrap_err().to_string().starts_with("dead_time: expected 0 s or more"));
    assert!(lightly_damped().inverse(DT, Some((-99.0, 1.0))).unwrap_err().to_string().starts_with("limits[0]"));
    assert!(lightly_damped().inverse(0.0, None).unwrap_err().to_string().starts_with("dt"));
}

/// A finding may rest on a number that JSON has no word for.
#[test]
fn a_file_keeps_numbers_that_are_not_finite() {
    let parts = StageParts {
        identified: Some(Identified {
            drive_range: (0.0, 150.0),
            position_range: (0.0, 100.0),
            dt: vec![DT],
            rmse: 0.1,
            max_error: f64::NAN,
            parameters: vec!["weights[0]".into()],
            covariance: vec![vec![f64::INFINITY]],
            warnings: vec![StageWarning {
                code: "collinear_operators".into(),
                severity: "red".into(),
                message: "odd".into(),
                value: f64::NEG_INFINITY,
                limit: 1.0,
                hint: String::new(),
            }],
            records: vec![RecordSource { name: "record.csv".into(), sha256: None }],
        }),
        ..StageParts::new(hysteresis())
    };
    let text = Stage::new(parts).unwrap().to_json();
    let read = Stage::from_json(&text).unwrap();
    assert_eq!(read.to_json(), text);
    let found = read.parts().identified.clone().unwrap();
    assert!(found.max_error.is_nan() && found.covariance[0][0].is_infinite());
    assert!(found.warnings[0].value < f64::MIN && found.rmse < 0.2);
    assert_eq!(found.warnings[0].severity, "red");
    // Older files do not say how severe a warning is.
    let older = text.replacen("\"severity\":\"red\",", "", 1);
    let older = if older == text { text.replacen("\"severity\": \"red\",", "", 1) } else { older };
    assert_ne!(older, text);
    assert_eq!(Stage::from_json(&older).unwrap().parts().identified.clone().unwrap().warnings[0].severity, "amber");
}

/// The samples of a dead time are more than can be counted.
#[test]
fn an_interval_that_is_too_short_for_a_preview_is_refused() {
    for dt in [1e-12, 1e-30, 1e-90] {
        let refused = lightly_damped().preview_ahead(dt).unwrap_err().to_string();
        assert!(refused.starts_with("dead_time: expected at most"), "{dt}: {refused}");
    }
}
