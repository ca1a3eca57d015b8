//! Any sequence of samples and changes through a controller with observer and learning in its loop.

use std::sync::LazyLock;

use hysteresis_control::learning::{RepetitiveControl, RepetitiveOptions};
use hysteresis_control::stage::{Error, FeedForwardKind};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{AntiWindup, Command, ControllerOptions, Law, Mode, Sections};
use soak::loops::{Breach, Guard};

use crate::bytes::Bytes;
use crate::stages::{DT, plain, stage};

/// The reach of the stages in their units.
const DRIVES: f64 = 150.0;
const POSITIONS: f64 = 25.0;

/// The period of learning in samples.
const PERIOD: usize = 20;

/// Every drive is finite, within limits and slew; a peek is the step that follows it; a state continues bit for bit in
/// a controller that is made anew.
///
/// # Panics
/// If not.
pub fn steps(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let Ok(mut run) = Run::new(&mut bytes) else {
        return;
    };
    while !bytes.is_empty() {
        if let Err(breach) = run.go_on(&mut bytes) {
            panic!("{breach}");
        }
    }
}

static LEARNING: LazyLock<RepetitiveControl> = LazyLock::new(|| {
    let believed = plain().feedback_loop(DT, (0.0, 0.0), Sections::default()).expect("the plain stage rises");
    let options = RepetitiveOptions::new(200.0);
    RepetitiveControl::new(&believed, PERIOD, &options).expect("learning converges without feedback")
});

struct Run {
    fresh: StageController,
    controller: StageController,
    guard: Guard,
}

fn options(bytes: &mut Bytes<'_>) -> ControllerOptions {
    let mut limits = (-30.0, 150.0);
    if bytes.below(4) == 0 {
        limits = (bytes.number(DRIVES), bytes.number(DRIVES));
    }
    let back = AntiWindup::BackCalculation { tracking_time: bytes.coin().then(|| bytes.magnitude(-6.0, 1.0)) };
    let set = ControllerOptions::new(bytes.magnitude(-3.0, 5.0), bytes.magnitude(-1.0, 9.0), DT, limits);
    ControllerOptions {
        slew: bytes.coin().then(|| bytes.magnitude(0.0, 8.0)),
        law: if bytes.coin() { Law::Incremental } else { Law::Positional },
        anti_windup: if bytes.coin() { back } else { AntiWindup::Conditional },
        bumpless_time: if bytes.coin() { 0.0 } else { bytes.magnitude(-6.0, 0.0) },
        max_missing: bytes.byte().into(),
        measurement_range: bytes.coin().then(|| (bytes.number(POSITIONS), bytes.number(POSITIONS))),
        max_measurement_step: bytes.coin().then(|| bytes.magnitude(-3.0, 2.0)),
        start_drive: bytes.coin().then(|| bytes.number(DRIVES)),
        ..set
    }
}

impl Run {
    fn new(bytes: &mut Bytes<'_>) -> Result<Self, Error> {
        let stage = stage(bytes.byte());
        let options = options(bytes);
        let feedforward = match bytes.below(4) {
            0 => FeedForwardKind::Given,
            1 => FeedForwardKind::Preview { ahead: bytes.below(40).into(), smoothing: f64::from(bytes.below(30)) * DT },
            _ => FeedForwardKind::Inverse,
        };
        let mut fresh = StageController::from(stage.controller(feedforward, &options)?);
        if bytes.coin() {
            let options = ObserverOptions { noise: bytes.magnitude(-6.0, 1.0), drift: bytes.magnitude(-4.0, 4.0) };
            fresh = fresh.with_observer(Observer::new(stage, DT, &options)?)?;
        }
        if bytes.coin() {
            fresh = fresh.with_repetitive(LEARNING.clone())?;
        }
        let guard = Guard::new(options.limits, options.slew, DT, fresh.controller().drive());
        Ok(Self { controller: fresh.clone(), fresh, guard })
    }

    fn go_on(&mut self, bytes: &mut Bytes<'_>) -> Result<(), Breach> {
        match bytes.below(16) {
            0..8 => self.sample(bytes),
            8 => self.planned(bytes),
            9 => self.block(bytes),
            10 => {
                self.restore();
                Ok(())
            }
            _ => {
                self.change(bytes);
                Ok(())
            }
        }
    }

    fn command(bytes: &mut Bytes<'_>) -> (Command, f64) {
        let reference = bytes.number(POSITIONS);
        let what = bytes.byte();
        let command = Command {
            target: (what % 4 == 1).then(|| bytes.number(POSITIONS)),
            feedforward: (what / 4 % 4 == 1).then(|| bytes.number(DRIVES)),
            correction: if what / 16 % 4 == 1 { bytes.number(POSITIONS) } else { 0.0 },
            ..reference.into()
        };
        (command, bytes.number(POSITIONS))
    }

    fn sample(&mut self, bytes: &mut Bytes<'_>) -> Result<(), Breach> {
        let (command, measurement) = Self::command(bytes);
        let peeked = self.controller.peek(command, measurement);
        let drive = self.controller.step(command, measurement);
        assert_eq!(drive.to_bits(), peeked.to_bits(), "a peek is the step that follows");
        self.guard.pass(drive)
    }

    /// A plan that is taken or dropped.
    fn planned(&mut self, bytes: &mut Bytes<'_>) -> Result<(), Breach> {
        let (command, measurement) = Self::command(bytes);
        let before = self.controller.controller().drive();
        let drive = self.controller.plan(command, measurement);
        if bytes.coin() {
            assert!(self.controller.commit(), "a plan can be taken");
            return self.guard.pass(drive);
        }
        self.controller.discard_plan();
        assert!(!self.controller.commit(), "a plan that was dropped cannot be taken");
        assert_eq!(self.controller.controller().drive().to_bits(), before.to_bits(), "a dropped plan changes nothing");
        Ok(())
    }

    fn block(&mut self, bytes: &mut Bytes<'_>) -> Result<(), Breach> {
        let references = bytes.numbers(POSITIONS);
        let measurements = vec![bytes.number(POSITIONS); references.len()];
        let mut twin = self.controller.clone();
        let mut drives = vec![0.0; references.len()];
        self.controller.run(&references, &measurements, &mut drives).expect("three arrays of one length");
        for ((reference, measurement), drive) in references.iter().zip(&measurements).zip(&drives) {
            let stepped = twin.step((*reference).into(), *measurement);
            assert_eq!(stepped.to_bits(), drive.to_bits(), "a run is its steps");
            self.guard.pass(*drive)?;
        }
        Ok(())
    }

    /// A controller that is made anew goes on from the state, through a file.
    fn restore(&mut self) {
        let text = serde_json::to_string(&self.controller.state()).expect("a state is written");
        let state = serde_json::from_str(&text).expect("a state is read");
        let mut fresh = self.fresh.clone();
        let (kp, ki) = (self.controller.controller().options().kp, self.controller.controller().options().ki);
        fresh.controller_mut().set_gains(kp, ki).expect("gains that were accepted once");
        fresh.set_state(&state).expect("a state is taken over by a controller like it");
        assert_eq!(fresh.state(), self.controller.state(), "a state is what it was");
        self.controller = fresh;
    }

    fn change(&mut self, bytes: &mut Bytes<'_>) {
        let controller = &mut self.controller;
        // What cannot be is refused, and nothing has changed.
        let told = match bytes.below(10) {
            0 => {
                controller.controller_mut().hold();
                None
            }
            1 => {
                controller.controller_mut().release();
                None
            }
            2 => {
                let mode = [Mode::Run, Mode::Feedforward, Mode::Hold, Mode::Stop][usize::from(bytes.below(4))];
                controller.controller_mut().set_mode(mode).ok();
                None
            }
            3 => {
                controller.controller_mut().stop(bytes.magnitude(0.0, 8.0), bytes.number(DRIVES)).ok();
                None
            }
            4 => {
                let (kp, ki) = (bytes.magnitude(-3.0, 5.0), bytes.magnitude(-1.0, 9.0));
                controller.controller_mut().set_gains(kp, ki).ok();
                None
            }
            5 => controller.reset(None).ok(),
            6 => controller.reset(Some(bytes.number(DRIVES))).ok(),
            7 => controller.start_at(bytes.number(DRIVES)).ok(),
            8 => {
                controller.restart_learning();
                None
            }
            _ => controller.follow(&bytes.numbers(DRIVES)).ok(),
        };
        let drive = self.controller.controller().drive();
        if told.is_some() {
            self.guard.told(drive);
        }
        assert_eq!(drive.to_bits(), self.guard.last().to_bits(), "a change leaves the drive as it is");
    }
}
