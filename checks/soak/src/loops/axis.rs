//! One axis: controller, filters, smoothed preview, observer and repetitive control.

use core::error::Error;

use hysteresis_control::learning::{RepetitiveControl, RepetitiveOptions};
use hysteresis_control::stage::Stage;
use hysteresis_control::{Observer, ObserverOptions};
use hysteresis_core::{
    Command, ControllerOptions, Counters, Error as CoreError, HybridController, Mode, Preview, Sections, is_admissible,
};

use super::bench::Bench;
use super::episode::{Breach, Episode, Guard, grows, grows_by_one_at_most, holds, same};
use super::setup::{self, DT};
use crate::signal::{Mixed, Random};

/// Once in so many samples somebody changes something, and once in so many the state is saved and restored.
const CHANGE_ONCE_IN: f64 = 80.0;
const RESTORE_ONCE_IN: f64 = 100.0;

/// What a reference of [`Mixed`] is multiplied by: positions of some um.
const SPAN: f64 = 4.0;

/// What takes part in a sample.
#[derive(Clone, Debug)]
struct Parts {
    controller: HybridController,
    observer: Observer,
    repetitive: RepetitiveControl,
}

/// A loop of one axis, and a twin that takes every sample with a plain step and is made anew from the saved states.
#[derive(Clone, Debug)]
pub struct Axis {
    stage: Stage,
    preview: Option<Preview>,
    parts: Parts,
    twin: Parts,
    correction_limit: f64,
    bench: Bench,
    reference: Mixed,
    random: Random,
    learns: bool,
    observes: bool,
}

impl Episode for Axis {
    const NAME: &'static str = "one axis";

    fn new(seed: u64) -> Result<Self, Box<dyn Error>> {
        let mut random = Random::new(seed);
        let stage = setup::stage(&mut random)?;
        let (options, preview) = (setup::options(&mut random)?, setup::preview(&mut random)?);
        // The model of learning and the stage on the bench are others than the stage of the controller.
        let believed = stage.feedback_loop(DT, (0.0, 0.0), Sections::default())?;
        let correction_limit = if random.once_in(2.0) { f64::INFINITY } else { random.unit() };
        let limit = correction_limit.is_finite().then_some(correction_limit);
        let set = RepetitiveOptions { limit, ..RepetitiveOptions::new(random.between(50.0, 500.0)) };
        let observer = ObserverOptions { noise: 0.01, drift: 10_f64.powf(random.between(-1.0, 1.0)) };
        let parts = Parts {
            controller: setup::controller(&stage, preview.as_ref(), &options)?,
            observer: Observer::new(&stage, DT, &observer)?,
            repetitive: RepetitiveControl::new(&believed, 8 + random.below(300), &set)?,
        };
        let guard = Guard::new(options.limits, options.slew, DT, parts.controller.drive());
        Ok(Self {
            bench: Bench::new(setup::stage(&mut random)?.forward(DT)?, guard, 0.01, seed),
            twin: parts.clone(),
            parts,
            stage,
            preview,
            correction_limit,
            reference: Mixed::new(seed),
            learns: random.once_in(2.0),
            observes: random.once_in(2.0),
            random,
        })
    }

    fn sample(&mut self) -> Result<(), Breach> {
        if self.random.once_in(CHANGE_ONCE_IN) {
            self.change()?;
        }
        let measured = self.bench.show();
        let reference = SPAN * self.reference.sample();
        let (command, seen) = self.ask(reference, measured)?;
        let before = self.parts.controller.counters();
        let (mode, peeked) = (self.parts.controller.mode(), self.parts.controller.peek(command, seen));
        let planned = self.parts.controller.plan(command, seen);
        same("a plan is what was peeked at", planned, peeked)?;
        if !self.bench.put_out(planned)? {
            same("a drive that was not written is not taken", self.parts.controller.drive(), self.bench.drive())?;
            return same("a dropped plan changes nothing", self.parts.controller.peek(command, seen), peeked);
        }
        holds("a plan is taken", self.parts.controller.commit(), (planned, peeked))?;
        same("what is taken is what was planned", self.parts.controller.drive(), planned)?;
        same("plan and commit are a step", self.twin.controller.step(command, seen), planned)?;
        check_counters(mode, (before, self.parts.controller.counters()), command, seen)?;
        if self.random.once_in(RESTORE_ONCE_IN) { self.restore() } else { Ok(()) }
    }

    fn held_back(&self) -> u64 {
        let Counters { saturated_count, slewing_count, .. } = self.parts.controller.counters();
        saturated_count + slewing_count
    }
}

impl Axis {
    /// What observer and learning make of a measurement.
    fn ask(&mut self, reference: f64, measured: f64) -> Result<(Command, f64), Breach> {
        let (drive, error) = (self.bench.drive(), reference - measured);
        let Parts { observer, repetitive, .. } = &mut self.parts;
        let counted = (observer.rejected(), repetitive.rejected());
        let (estimate, correction) = (observer.step(drive, measured), repetitive.step(error));
        holds("the estimate is finite", estimate.is_finite(), (estimate, measured))?;
        let limit = self.correction_limit;
        holds("the correction is finite", correction.is_finite(), (correction, limit))?;
        holds("the correction keeps its limit", correction.abs() <= limit, (correction, limit))?;
        grows("the observer counts", (counted.0, observer.rejected()), u64::from(!is_admissible(measured)))?;
        grows("learning counts", (counted.1, repetitive.rejected()), u64::from(!is_admissible(error)))?;
        same("the observer continues", self.twin.observer.step(drive, measured), estimate)?;
        same("learning continues", self.twin.repetitive.step(error), correction)?;
        let target = self.learns.then_some(reference + correction);
        Ok((Command { target, ..reference.into() }, if self.observes { estimate } else { measured }))
    }

    /// The twin is made anew, and goes on from the saved states.
    fn restore(&mut self) -> Result<(), Breach> {
        let Parts { controller, observer, repetitive } = &mut self.parts;
        let state = controller.state();
        holds("the states are the same", self.twin.controller.state() == state, (0.0, 0.0))?;
        let fresh = setup::controller(&self.stage, self.preview.as_ref(), controller.options());
        self.twin.controller =
            fresh.map_err(|_| Breach { law: "a controller is made again", got: 0.0, beside: 0.0 })?;
        self.twin.observer.reset();
        self.twin.repetitive.reset();
        let taken = |law, taken: Option<()>| holds(law, taken.is_some(), (0.0, 0.0));
        taken("a state of the controller is taken over", self.twin.controller.set_state(&state).ok())?;
        taken("a state of the observer is taken over", self.twin.observer.set_state(&observer.state()).ok())?;
        taken("a state of learning is taken over", self.twin.repetitive.set_state(&repetitive.state()).ok())?;
        holds("a state is what it was", self.twin.controller.state() == state, (0.0, 0.0))
    }

    /// Somebody changes something, on both.
    fn change(&mut self) -> Result<(), Breach> {
        let change = Change::new(&mut self.random);
        let (one, other) = (change.happen(&mut self.parts.controller), change.happen(&mut self.twin.controller));
        holds("both take a change, or both refuse it", one == other, (0.0, 0.0))?;
        let drive = self.parts.controller.drive();
        if change.tells_a_drive() {
            self.bench.told(drive);
        }
        same("a change leaves the drive as it is", drive, self.bench.drive())
    }
}

/// What may happen to a controller that runs.
#[derive(Clone, Debug)]
pub(super) struct Change {
    what: usize,
    /// From 0 to 1, and a rate from 100 to 1e7.
    share: f64,
    rate: f64,
    filters: Sections,
}

impl Change {
    pub(super) fn new(random: &mut Random) -> Self {
        let filters = setup::filters(random).unwrap_or_default();
        let rate = 10_f64.powf(random.between(2.0, 7.0));
        Self { what: random.below(10), share: random.unit(), rate, filters }
    }

    /// Whether somebody brings the amplifier to another drive.
    pub(super) fn tells_a_drive(&self) -> bool {
        self.what >= 8
    }

    pub(super) fn happen(&self, controller: &mut HybridController) -> Result<(), CoreError> {
        let ControllerOptions { limits: (low, high), .. } = *controller.options();
        let drive = low + (high - low) * self.share;
        match self.what {
            0 => controller.hold(),
            1..=3 => controller.release(),
            4 => return controller.set_mode(Mode::Feedforward),
            5 => return controller.stop(self.rate, drive),
            6 => return controller.set_gains(1e3 * self.share, self.rate),
            // No filter behind a negative gain is refused.
            7 => return controller.set_filters(&self.filters),
            8 => return controller.follow(&[high, drive]),
            _ => return controller.start_at(drive),
        }
        Ok(())
    }
}

/// Whether the counters grew by what came.
pub(super) fn check_counters(
    mode: Mode,
    (before, after): (Counters, Counters),
    Command { reference, target, .. }: Command,
    seen: f64,
) -> Result<(), Breach> {
    let acts = matches!(mode, Mode::Run | Mode::Feedforward);
    let usable = is_admissible(reference) && target.is_none_or(is_admissible);
    let rejected = acts && !usable;
    let missing = acts && usable && !is_admissible(seen);
    grows("rejected samples are counted", (before.rejected_count, after.rejected_count), rejected.into())?;
    grows("missing measurements are counted", (before.missing_count, after.missing_count), missing.into())?;
    for (before, after) in [
        (before.implausible_count, after.implausible_count),
        (before.saturated_count, after.saturated_count),
        (before.slewing_count, after.slewing_count),
    ] {
        grows_by_one_at_most("a sample counts once", (before, after))?;
    }
    Ok(())
}
