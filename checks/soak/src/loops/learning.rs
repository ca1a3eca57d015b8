//! Iterative learning, period by period.

use core::error::Error;
use core::f64::consts::TAU;

use hysteresis_control::StageController;
use hysteresis_control::learning::{FeedbackLoop, IterativeLearning, LearningOptions};
use hysteresis_core::{Counters, Sections, is_admissible};
use hysteresis_simulate::closed_loop::{Tracking, TrackingTask};

use super::bench::{Bench, Ended};
use super::episode::{Breach, Episode, Guard, holds, same};
use super::setup::{self, DT};
use crate::signal::Random;

/// A period that is learned again and again, on a bench that loses drives and shows anything.
#[derive(Debug)]
pub struct Learning {
    feedback: FeedbackLoop,
    options: LearningOptions,
    scheme: IterativeLearning,
    twin: IterativeLearning,
    controller: StageController,
    bench: Bench,
    reference: Vec<f64>,
    random: Random,
}

impl Episode for Learning {
    const NAME: &'static str = "iterative learning";

    fn new(seed: u64) -> Result<Self, Box<dyn Error>> {
        let mut random = Random::new(seed);
        let stage = setup::stage(&mut random)?;
        let options = setup::options(&mut random)?;
        let controller = StageController::from(setup::controller(&stage, None, &options)?);
        // Gains of the controller need not leave a stable loop, those that learning believes in must.
        let feedback = stage.feedback_loop(DT, (0.0, 0.0), Sections::default())?;
        let (samples, amplitude) = ([20, 37, 90, 219_u32][random.below(4)], 6.0 * random.unit());
        let (offset, turns) = (random.signed(), [1.0, 2.0, 3.0][random.below(3)]);
        let reference: Vec<f64> = (0..samples)
            .map(|k| offset + amplitude * (TAU * turns * f64::from(k) / f64::from(samples)).sin())
            .collect();
        let on_demand = random.once_in(2.0);
        let learning_options = LearningOptions {
            bandwidth: random.once_in(2.0).then_some(300.0),
            target_limits: random.once_in(2.0).then_some((-3.0, 2.0)),
            noise: random.once_in(2.0).then_some(0.01),
            settle: random.once_in(2.0).into(),
            on_demand,
            ..LearningOptions::default()
        };
        let learning = IterativeLearning::new(&feedback, &reference, &learning_options)?;
        let guard = Guard::new(options.limits, options.slew, DT, controller.controller().drive());
        let bench = Bench::new(setup::stage(&mut random)?.forward(DT)?, guard, 0.01, seed);
        let twin = learning.clone();
        Ok(Self { feedback, options: learning_options, scheme: learning, twin, controller, bench, reference, random })
    }

    /// One period.
    fn sample(&mut self) -> Result<(), Breach> {
        let Ok(task) = TrackingTask::new(&self.reference, None) else {
            return holds("a reference can be followed", false, (0.0, 0.0));
        };
        let tracking = Tracking { targets: Some(self.scheme.target()), ..Tracking::of(&mut self.controller) };
        let run = match tracking.run(&task, &mut self.bench, |_| Ok(())) {
            Ok(run) => run,
            Err(Ended::Lost) => {
                let (drive, put_out) = (self.controller.controller().drive(), self.bench.drive());
                return same("a drive that was not written is not taken", drive, put_out);
            }
            Err(Ended::Broken(breach)) => return Err(breach),
        };
        let measured = &run.record().measured;
        let mut error: Vec<f64> = self.reference.iter().zip(measured).map(|(r, y)| r - y).collect();
        let (before, gaps) = (self.scheme.state(), !error.iter().copied().all(is_admissible));
        if self.scheme.update(&error).is_err() {
            holds("what is refused changes nothing", self.scheme.state() == before, (0.0, 0.0))?;
            error.iter_mut().filter(|e| e.is_nan() || e.abs() > 1e40).for_each(|e| *e = 0.0);
            holds("a period without gaps is learned from", self.scheme.update(&error).is_ok(), (0.0, 0.0))?;
        } else {
            holds("a period with gaps is refused", !gaps, (0.0, 0.0))?;
        }
        holds("a period is learned from", self.twin.update(&error).is_ok(), (0.0, 0.0))?;
        self.check_target()?;
        if self.random.once_in(10.0) { self.restore() } else { Ok(()) }
    }

    fn held_back(&self) -> u64 {
        let Counters { saturated_count, slewing_count, .. } = self.controller.controller().counters();
        saturated_count + slewing_count
    }
}

impl Learning {
    fn check_target(&self) -> Result<(), Breach> {
        let (low, high) = self.options.target_limits.unwrap_or((-f64::MAX, f64::MAX));
        for (target, twin) in self.scheme.target().iter().zip(self.twin.target()) {
            holds("the target keeps its limits", low <= *target && *target <= high, (*target, high))?;
            same("learning continues", *twin, *target)?;
        }
        Ok(())
    }

    /// The twin is made anew, and goes on from the saved state.
    fn restore(&mut self) -> Result<(), Breach> {
        let state = self.scheme.state();
        holds("the states are the same", self.twin.state() == state, (0.0, 0.0))?;
        let Ok(twin) = IterativeLearning::new(&self.feedback, &self.reference, &self.options) else {
            return holds("learning is made again", false, (0.0, 0.0));
        };
        self.twin = twin;
        holds("a state is taken over", self.twin.set_state(&state).is_ok(), (0.0, 0.0))?;
        holds("a state is what it was", self.twin.state() == state, (0.0, 0.0))
    }
}
