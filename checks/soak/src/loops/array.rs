//! Many actuators with few sensors.

use core::error::Error;

use hysteresis_control::stage::Stage;
use hysteresis_core::{
    ArrayController, ArrayCounters, ArrayOptions, ArraySample, CompiledModel, Inverse, Mode, StreamArray, is_admissible,
};

use super::bench::Bench;
use super::episode::{Breach, Episode, Guard, grows, grows_by_one_at_most, holds, same};
use super::setup::{self, DT};
use crate::signal::{Mixed, Random};

const ACTUATORS: usize = 5;
const SENSORS: usize = 3;
const CHANGE_ONCE_IN: f64 = 80.0;
const RESTORE_ONCE_IN: f64 = 100.0;
const SPAN: f64 = 4.0;

/// Five actuators with pairs that stay together, and a twin that is made anew from the saved state.
#[derive(Clone, Debug)]
pub struct Actuators {
    stages: Vec<Stage>,
    limits: Vec<(f64, f64)>,
    controller: ArrayController,
    twin: ArrayController,
    benches: Vec<Bench>,
    references: Vec<Mixed>,
    random: Random,
}

fn make(stages: &[Stage], limits: &[(f64, f64)], options: &ArrayOptions) -> Result<ArrayController, Box<dyn Error>> {
    let stream = |(stage, limits): (&Stage, &(f64, f64))| {
        Inverse::new(&CompiledModel::new(&stage.parts().hysteresis), Some(*limits))
    };
    let inverse: StreamArray<Inverse> =
        stages.iter().zip(limits).map(stream).collect::<Result<Vec<_>, _>>()?.into_iter().collect();
    Ok(ArrayController::new(inverse, options)?)
}

fn options(random: &mut Random) -> ArrayOptions {
    let slew = |random: &mut Random| 10_f64.powf(random.between(3.0, 7.0));
    let pairs = !random.once_in(3.0);
    ArrayOptions {
        ki: if random.once_in(3.0) { 0.0 } else { 10_f64.powf(random.between(0.0, 5.0)) },
        leak: if random.once_in(2.0) { 0.0 } else { 10_f64.powf(random.between(-1.0, 3.9)) },
        reconstruction: random.once_in(1.5).then(|| (0..ACTUATORS * SENSORS).map(|_| random.signed()).collect()),
        slew: match random.below(3) {
            0 => vec![],
            1 => vec![slew(random)],
            _ => (0..ACTUATORS).map(|_| slew(random)).collect(),
        },
        neighbours: if pairs { (1..ACTUATORS).map(|i| (i - 1, i)).collect() } else { vec![] },
        max_difference: if pairs { vec![random.between(0.05, 3.0)] } else { vec![] },
        bumpless_time: if random.once_in(2.0) { 0.0 } else { 5e-3 },
        ..ArrayOptions::new(DT)
    }
}

impl Episode for Actuators {
    const NAME: &'static str = "an array";

    fn new(seed: u64) -> Result<Self, Box<dyn Error>> {
        let mut random = Random::new(seed);
        let options = options(&mut random);
        let stages = (0..ACTUATORS).map(|_| setup::stage(&mut random)).collect::<Result<Vec<_>, _>>()?;
        let limits: Vec<_> = (0..ACTUATORS).map(|_| setup::limits(&mut random)).collect();
        let controller = make(&stages, &limits, &options)?;
        let bench = |(i, drive): (usize, &f64)| -> Result<Bench, Box<dyn Error>> {
            let slew = options.slew.get(i).or(options.slew.first()).copied();
            let guard = Guard::new(limits[i], slew, DT, *drive);
            Ok(Bench::new(stages[i].forward(DT)?, guard, 0.01, seed + i as u64))
        };
        let benches = controller.drives().iter().enumerate().map(bench).collect::<Result<Vec<_>, _>>()?;
        let references = (0..ACTUATORS as u64).map(|i| Mixed::new(seed + i)).collect();
        Ok(Self { twin: controller.clone(), controller, stages, limits, benches, references, random })
    }

    fn sample(&mut self) -> Result<(), Breach> {
        if self.random.once_in(CHANGE_ONCE_IN) {
            self.change()?;
        }
        let mut shown = [0.0; ACTUATORS];
        shown.iter_mut().zip(&mut self.benches).for_each(|(shown, bench)| *shown = bench.show());
        let mut reference = [0.0; ACTUATORS];
        reference.iter_mut().zip(&mut self.references).for_each(|(r, signal)| *r = SPAN * signal.sample());
        let measurement = (!self.random.once_in(10.0)).then_some(&shown[..self.controller.sensors()]);
        let sample = ArraySample { measurement, ..ArraySample::of(&reference) };
        let (before, mode) = (self.controller.counters(), self.controller.mode());
        let (mut peeked, mut drives, mut stepped) = ([0.0; ACTUATORS], [0.0; ACTUATORS], [0.0; ACTUATORS]);
        let taken = self.controller.peek(&sample, &mut peeked).is_ok()
            && self.controller.step(&sample, &mut drives).is_ok()
            && self.twin.step(&sample, &mut stepped).is_ok();
        holds("there are as many numbers as it takes", taken, (0.0, 0.0))?;
        for ((drive, peeked), stepped) in drives.iter().zip(peeked).zip(stepped) {
            same("a step is what was peeked at", *drive, peeked)?;
            // The twin was never peeked at.
            same("a peek changes nothing, and a state continues", stepped, *drive)?;
        }
        for (bench, drive) in self.benches.iter_mut().zip(drives) {
            bench.hold(drive)?;
        }
        check_counters(mode, (before, self.controller.counters()), &sample)?;
        if self.random.once_in(RESTORE_ONCE_IN) { self.restore() } else { Ok(()) }
    }

    fn held_back(&self) -> u64 {
        let ArrayCounters { saturated_count, slewing_count, .. } = self.controller.counters();
        saturated_count + slewing_count
    }
}

impl Actuators {
    /// Somebody changes something, on both.
    fn change(&mut self) -> Result<(), Breach> {
        let (what, share, rate) =
            (self.random.below(8), self.random.unit(), 10_f64.powf(self.random.between(2.0, 5.0)));
        let drives: Vec<f64> = self.limits.iter().map(|(low, high)| low + (high - low) * share).collect();
        let happen = |controller: &mut ArrayController| {
            match what {
                0 => controller.hold(),
                1..=3 => controller.release(),
                4 => return controller.stop(rate, &drives),
                5 => return controller.set_gains(rate, 1e3 * share),
                6 => controller.reset(),
                _ => return controller.follow(&drives),
            }
            Ok(())
        };
        let taken = happen(&mut self.controller).is_ok() && happen(&mut self.twin).is_ok();
        holds("a change is taken", taken, (rate, share))?;
        for (bench, drive) in self.benches.iter_mut().zip(self.controller.drives()) {
            if what > 6 {
                bench.told(*drive);
            }
            same("a change leaves the drives as they are", *drive, bench.drive())?;
        }
        Ok(())
    }

    /// The twin is made anew, and goes on from the saved state.
    fn restore(&mut self) -> Result<(), Breach> {
        let state = self.controller.state();
        holds("the states are the same", self.twin.state() == state, (0.0, 0.0))?;
        self.twin = make(&self.stages, &self.limits, self.controller.options()).map_err(|_| Breach {
            law: "a controller is made again",
            got: 0.0,
            beside: 0.0,
        })?;
        holds("a state is taken over", self.twin.set_state(&state).is_ok(), (0.0, 0.0))?;
        holds("a state is what it was", self.twin.state() == state, (0.0, 0.0))
    }
}

/// Whether the counters grew by what came.
fn check_counters(
    mode: Mode,
    (before, after): (ArrayCounters, ArrayCounters),
    sample: &ArraySample<'_>,
) -> Result<(), Breach> {
    let usable = |numbers: &[f64]| numbers.iter().copied().all(is_admissible);
    let acts = mode == Mode::Run;
    let rejected = acts && !usable(sample.reference);
    let missing = acts && !rejected && !sample.measurement.is_none_or(usable);
    grows("rejected samples are counted", (before.rejected_count, after.rejected_count), rejected.into())?;
    grows("missing measurements are counted", (before.missing_count, after.missing_count), missing.into())?;
    grows_by_one_at_most("a sample counts once", (before.pair_limited_count, after.pair_limited_count))
}
