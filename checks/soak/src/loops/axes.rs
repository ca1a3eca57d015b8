//! Several axes behind a decoupling.

use core::error::Error;

use hysteresis_control::stage::Stage;
use hysteresis_core::{Counters, HybridController, MultiAxisController, Preview};

use super::axis::Change;
use super::bench::Bench;
use super::episode::{Breach, Episode, Guard, grows_by_one_at_most, holds, same};
use super::setup::{self, DT};
use crate::signal::{Mixed, Random};

const N: usize = 3;
const CHANGE_ONCE_IN: f64 = 80.0;
const RESTORE_ONCE_IN: f64 = 100.0;
const SPAN: f64 = 4.0;

/// Three axes, and twins that take every sample with a plain step and are made anew from the saved state. A write of
/// one actuator that fails leaves all of them as they are.
#[derive(Clone, Debug)]
pub struct Axes {
    stages: Vec<Stage>,
    preview: Option<Preview>,
    decoupling: Vec<f64>,
    controllers: MultiAxisController,
    twin: MultiAxisController,
    benches: Vec<Bench>,
    references: Vec<Mixed>,
    random: Random,
}

impl Episode for Axes {
    const NAME: &'static str = "three axes";

    fn new(seed: u64) -> Result<Self, Box<dyn Error>> {
        let mut random = Random::new(seed);
        let preview = setup::preview(&mut random)?;
        let (mut stages, mut controllers, mut benches, mut references) = (vec![], vec![], vec![], vec![]);
        for axis in 0..N as u64 {
            let (stage, options) = (setup::stage(&mut random)?, setup::options(&mut random)?);
            let controller = setup::controller(&stage, preview.as_ref(), &options)?;
            let guard = Guard::new(options.limits, options.slew, DT, controller.drive());
            benches.push(Bench::new(setup::stage(&mut random)?.forward(DT)?, guard, 0.01, seed + axis));
            references.push(Mixed::new(seed + axis));
            stages.push(stage);
            controllers.push(controller);
        }
        let entry = |random: &mut Random| if random.once_in(3.0) { 0.0 } else { random.signed() };
        let decoupling: Vec<f64> = (0..N * N).map(|i| f64::from(i % (N + 1) == 0) + 0.5 * entry(&mut random)).collect();
        let axes = MultiAxisController::new(controllers, Some(&decoupling))?;
        Ok(Self { stages, preview, decoupling, twin: axes.clone(), controllers: axes, benches, references, random })
    }

    fn sample(&mut self) -> Result<(), Breach> {
        if self.random.once_in(CHANGE_ONCE_IN) {
            self.change()?;
        }
        let (mut references, mut measured) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (references[i], measured[i]) = (SPAN * self.references[i].sample(), self.benches[i].show());
        }
        let counted = self.counters();
        let (mut peeked, mut planned, mut stepped) = ([0.0; N], [0.0; N], [0.0; N]);
        lengths(self.controllers.peek((&references).into(), &measured, &mut peeked))?;
        lengths(self.controllers.plan((&references).into(), &measured, &mut planned))?;
        each("a plan is what was peeked at", &planned, &peeked)?;
        if self.random.once_in(100.0) {
            // Lost on the way to the amplifiers: the sample was none.
            lengths(self.controllers.peek((&references).into(), &measured, &mut stepped))?;
            each("a dropped plan changes nothing", &stepped, &peeked)?;
            return each("a drive that was not written is not taken", &self.drives(), &self.put_out());
        }
        holds("a plan is taken", self.controllers.commit(), (0.0, 0.0))?;
        lengths(self.twin.step((&references).into(), &measured, &mut stepped))?;
        each("plan and commit are a step", &stepped, &planned)?;
        each("what is taken is what was planned", &self.drives(), &planned)?;
        for (bench, drive) in self.benches.iter_mut().zip(planned) {
            bench.hold(drive)?;
        }
        for (before, after) in counted.iter().zip(self.counters()) {
            grows_by_one_at_most("a sample counts once", (before.rejected_count, after.rejected_count))?;
            grows_by_one_at_most("a sample counts once", (before.missing_count, after.missing_count))?;
        }
        if self.random.once_in(RESTORE_ONCE_IN) { self.restore() } else { Ok(()) }
    }

    fn held_back(&self) -> u64 {
        self.counters().iter().map(|counters| counters.saturated_count + counters.slewing_count).sum()
    }
}

impl Axes {
    fn counters(&self) -> [Counters; N] {
        core::array::from_fn(|i| self.controllers.controllers()[i].counters())
    }

    fn drives(&self) -> [f64; N] {
        core::array::from_fn(|i| self.controllers.controllers()[i].drive())
    }

    /// The drives that the amplifiers have.
    fn put_out(&self) -> [f64; N] {
        core::array::from_fn(|i| self.benches[i].drive())
    }

    /// Something happens to one axis.
    fn change(&mut self) -> Result<(), Breach> {
        let (change, i) = (Change::new(&mut self.random), self.random.below(N));
        let happen = |axes: &mut MultiAxisController| change.happen(&mut axes.controllers_mut()[i]);
        holds(
            "both take a change, or both refuse it",
            happen(&mut self.controllers) == happen(&mut self.twin),
            (0.0, 0.0),
        )?;
        if change.tells_a_drive() {
            let drive = self.drives()[i];
            self.benches[i].told(drive);
        }
        each("a change leaves the drives as they are", &self.drives(), &self.put_out())
    }

    /// The twin is made anew, and goes on from the saved state.
    fn restore(&mut self) -> Result<(), Breach> {
        let state = self.controllers.state();
        holds("the states are the same", self.twin.state() == state, (0.0, 0.0))?;
        let made = Breach { law: "controllers are made again", got: 0.0, beside: 0.0 };
        let controllers: Result<Vec<HybridController>, _> = (self.stages.iter().zip(self.controllers.controllers()))
            .map(|(stage, own)| setup::controller(stage, self.preview.as_ref(), own.options()))
            .collect();
        let fresh = MultiAxisController::new(controllers.map_err(|_| made)?, Some(&self.decoupling));
        self.twin = fresh.map_err(|_| made)?;
        holds("a state is taken over", self.twin.set_state(&state).is_ok(), (0.0, 0.0))?;
        holds("a state is what it was", self.twin.state() == state, (0.0, 0.0))
    }
}

fn each(law: &'static str, got: &[f64; N], beside: &[f64; N]) -> Result<(), Breach> {
    got.iter().zip(beside).try_for_each(|(got, beside)| same(law, *got, *beside))
}

fn lengths(taken: Result<(), hysteresis_core::Error>) -> Result<(), Breach> {
    holds("there is a number for each axis", taken.is_ok(), (0.0, 0.0))
}
