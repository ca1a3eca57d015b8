//! Loops around what is not a plant of ours, and loops of several axes.

use core::convert::Infallible;

use hysteresis_control::StageController;
use hysteresis_control::multi_axis::{MultiAxisStage, TrackingOptions};
use hysteresis_control::oscillator::HystereticOscillator;
use hysteresis_core::{ControllerOptions, Duhem, HybridController, Mode, MultiAxisController};
use hysteresis_simulate::closed_loop::{Tracking, TrackingTask};
use hysteresis_simulate::driven::{Driven, Reading};
use hysteresis_simulate::metrics::{LoopRecord, Run};
use hysteresis_simulate::multi_axis::MultiAxisTask;
use hysteresis_simulate::paper::{Benchmark, table_2};
use hysteresis_simulate::plant::{MultiAxisPlant, Plant};

/// A plant of ours that can fail, and shows nothing at some samples.
struct Bench {
    plant: Plant,
    fails_at: Option<usize>,
    blind_from: usize,
}

impl Bench {
    fn new(fails_at: Option<usize>, blind_from: usize) -> Self {
        Self { plant: Benchmark::A1.plant(3), fails_at, blind_from }
    }
}

impl Driven<usize> for Bench {
    const WRITE_MAY_FAIL: bool = true;

    fn read(&mut self, sample: Option<usize>) -> Result<Reading, usize> {
        let blind = sample.is_some_and(|k| k >= self.blind_from);
        let measured = if blind { f64::INFINITY } else { self.plant.measured() };
        Ok(Reading { measured, position: self.plant.position() })
    }

    fn write(&mut self, sample: Option<usize>, drive: f64) -> Result<(), usize> {
        if sample.is_some() && sample == self.fails_at {
            return Err(sample.unwrap_or_default());
        }
        self.plant.step(drive);
        Ok(())
    }

    fn put_out(&mut self, _: Option<usize>, _: f64) -> Result<f64, usize> {
        Ok(self.plant.drive())
    }

    fn limits(&self) -> Option<(f64, f64)> {
        self.plant.limits()
    }
}

fn hybrid() -> HybridController {
    let gains = Benchmark::A1.gains();
    let options = ControllerOptions::new(gains.kp, gains.ki, 1e-4, (-560.0, 560.0));
    HybridController::new(table_2().forward().into(), None, &options).unwrap()
}

fn controller() -> StageController {
    hybrid().into()
}

fn reference() -> Vec<f64> {
    (0..400).map(|k| 3.0 * (0.012 * f64::from(k)).sin()).collect()
}

fn shown(controller: &StageController) -> String {
    format!("{:?}", controller.controller().state())
}

#[test]
fn what_may_fail_gives_the_same_bits_as_long_as_it_does_not() {
    let (reference, mut one, mut other) = (reference(), controller(), controller());
    let task = TrackingTask::new(&reference, Some(100.0)).unwrap();
    let Ok(run) = Tracking::of(&mut one).run(&task, &mut Benchmark::A1.plant(3), |_| Ok::<_, Infallible>(()));
    let mut bench = Bench::new(None, usize::MAX);
    assert_eq!(Tracking::of(&mut other).run(&task, &mut bench, |_| Ok(())), Ok(run));
    assert_eq!(shown(&one), shown(&other));
}

#[test]
fn a_controller_has_not_taken_a_sample_that_was_not_written() {
    let (reference, mut one, mut other) = (reference(), controller(), controller());
    let mut rows = 0;
    let adapt = |_: &mut HybridController, _: f64, _: f64| {
        rows += 1;
        Ok(())
    };
    let mut bench = Bench::new(Some(100), usize::MAX);
    let task = TrackingTask::new(&reference, None).unwrap();
    assert_eq!(Tracking::of(&mut one).run_with(&task, &mut bench, adapt, |_| Ok(())), Err(100));
    assert_eq!(rows, 100);
    let task = TrackingTask::new(&reference[..100], None).unwrap();
    Tracking::of(&mut other).run(&task, &mut Bench::new(None, usize::MAX), |_| Ok(())).unwrap();
    assert_eq!(shown(&one), shown(&other));
}

#[test]
fn samples_without_a_reading_are_left_out_of_the_measured_errors() {
    let (reference, mut one) = (reference(), controller());
    let task = TrackingTask::new(&reference, Some(390.0)).unwrap();
    let run = Tracking::of(&mut one).run(&task, &mut Bench::new(None, 380), |_| Ok(())).unwrap();
    assert_eq!(one.controller().counters().missing_count, 20);
    assert!(run.record().measured[380..].iter().all(|y| y.is_nan()));
    let (all, settled) = (run.metrics(), run.settled().unwrap());
    assert_eq!((all.samples, all.missing_count, settled.missing_count), (400, 20, 10));
    let largest = (0..380).map(|k| (reference[k] - run.record().measured[k]).abs()).fold(0.0, f64::max);
    assert_eq!(all.max_error, largest);
    assert!(settled.max_error.is_nan() && settled.rmse.is_nan() && settled.hysteresis_percent.is_none());
    assert!(settled.max_position_error.is_finite());
    let again = Run::with_missing(run.record().clone(), run.limits(), run.period()).unwrap();
    assert_eq!(again.metrics(), all);
    assert!(Run::new(run.record().clone(), None, None).is_err());
    let record = |drive| LoopRecord { reference: vec![0.0], measured: vec![0.0], position: vec![0.0], drive };
    assert!(Run::with_missing(record(vec![f64::NAN]), None, None).is_err());
}

#[test]
fn axes_that_do_not_move_each_other_are_loops_of_their_own() {
    let x = reference();
    let rows: Vec<f64> = x.iter().flat_map(|x| [*x, -0.5 * x]).collect();
    let identity = [1.0, 0.0, 0.0, 1.0];
    let mut plant = MultiAxisPlant::new(vec![Benchmark::A1.plant(1), Benchmark::A1.plant(2)], &identity).unwrap();
    let mut axes = MultiAxisController::new(vec![hybrid(); 2], None).unwrap().into();
    let task = MultiAxisTask::new(&rows, 2, Some(100.0)).unwrap();
    let Ok(runs) = task.track(&mut plant, &mut axes, None, |_| Ok::<_, Infallible>(()));
    for (i, (run, seed)) in runs.into_iter().zip([1, 2]).enumerate() {
        let reference: Vec<f64> = rows.iter().skip(i).step_by(2).copied().collect();
        let task = TrackingTask::new(&reference, Some(100.0)).unwrap();
        let mut single = controller();
        let Ok(own) = Tracking::of(&mut single).run(&task, &mut Benchmark::A1.plant(seed), |_| Ok::<_, Infallible>(()));
        assert_eq!(run, own);
        assert_eq!(shown(&axes.controller().controllers()[i].clone().into()), shown(&single));
    }
}

#[test]
fn references_of_several_axes_are_checked() {
    let message = |reference: &[f64], period| MultiAxisTask::new(reference, 2, period).unwrap_err().to_string();
    assert_eq!(message(&[0.0; 3], None), "reference: expected whole rows of 2 elements, got 3 elements");
    assert_eq!(message(&[], None), "reference: expected at least one element, got none");
    assert!(message(&[0.0, f64::NAN], None).starts_with("reference[1]: expected a finite number"));
    assert_eq!(message(&[0.0; 8], Some(4.0)), "period: expected a number from 0.0 to 3.0, got 4.0");
}

/// The first targets are as early as the first references are.
#[test]
fn targets_lead_a_stage_from_the_first_sample_on() {
    let duhem = Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1).unwrap();
    let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, duhem).unwrap();
    let stage = MultiAxisStage::of_oscillator(&oscillator, 1e-3, 1).unwrap();
    let options = ControllerOptions::new(1.0, 0.0, 1e-3, (-200.0, 200.0));
    let wanted: Vec<f64> = (0..300).map(|k| 5e-4 * (0.03 * f64::from(k)).cos()).collect();
    let drives = |reference: &[f64], targets: Option<&[f64]>| {
        let mut controller = stage.controller(&[options], &TrackingOptions::default()).unwrap();
        controller.controller_mut().set_mode(Mode::Feedforward).unwrap();
        let mut plant = MultiAxisPlant::new(vec![Benchmark::A1.plant(0)], &[1.0]).unwrap();
        let task = MultiAxisTask::new(reference, 1, None).unwrap();
        let runs = task.track(&mut plant, &mut controller, targets, |_| Ok::<_, Infallible>(())).unwrap();
        runs[0].record().drive.clone()
    };
    assert_eq!(drives(&wanted, None), drives(&vec![0.0; 300], Some(&wanted)));
}
