//! What lies between the two converters: amplifier, hysteresis, linear dynamics.

use core::f64::consts::TAU;

use hysteresis_core::{CompiledModel, Forward, Process};

use super::options::PlantOptions;
use hysteresis_control::linear::{Block, CreepBlock, DelayBlock, Dynamics, Error, FirstOrder, LinearBlock};

/// How many sub-steps a sampling interval needs if an amplifier comes before the hysteresis.
///
/// Between samples the voltage is then an exponential, and what the hysteresis makes of it has no closed form for the
/// dynamics behind. So each sub-step holds the mean of the model's outputs at its ends (trapezoidal rule): the error
/// falls with the square of the number of sub-steps. 16 per radian of the faster parts, between 8 and 64, leave
/// less than 0.02 nm of a sine of 20 Hz and 0.5 nm after steps across the whole range (6 um) with the poles and
/// resonances of the tests.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 8 to 64")]
fn sub_steps(amplifier: FirstOrder, dynamics: Dynamics, dt: f64) -> u32 {
    let frequency = match dynamics {
        Dynamics::FirstOrder(lag) => lag.frequency(),
        Dynamics::SecondOrder(resonance) => resonance.frequency(),
    };
    (16.0 * TAU * (amplifier.frequency() + frequency) * dt).ceil().clamp(8.0, 64.0) as u32
}

/// The drive after the D/A converter in, the position out.
#[derive(Clone, Debug)]
pub(super) struct Actuator {
    amplifier: Option<LinearBlock>,
    hysteresis: Forward,
    /// The last output of the hysteresis.
    displacement: f64,
    dynamics: Option<LinearBlock>,
    creep: Option<CreepBlock>,
    delay: DelayBlock,
    sub_steps: u32,
}

impl Actuator {
    /// An actuator that has been at rest at the drive `rest` since forever.
    pub(super) fn new(compiled: &CompiledModel, options: &PlantOptions, rest: f64) -> Result<Self, Error> {
        let count = match (options.amplifier, options.dynamics) {
            (Some(amplifier), Some(dynamics)) => sub_steps(amplifier, dynamics, options.dt),
            // A drive that is held needs none. Without dynamics only the end of the interval is seen, and on the way
            // there the amplifier does not turn back.
            _ => 1,
        };
        Self::with_sub_steps(compiled, options, rest, count)
    }

    fn with_sub_steps(
        compiled: &CompiledModel,
        options: &PlantOptions,
        rest: f64,
        sub_steps: u32,
    ) -> Result<Self, Error> {
        let interval = options.dt / f64::from(sub_steps);
        let mut actuator = Self {
            amplifier: options.amplifier.map(|pole| pole.block(interval)).transpose()?,
            hysteresis: Forward::new(compiled),
            displacement: 0.0,
            dynamics: options.dynamics.map(|dynamics| dynamics.block(interval)).transpose()?,
            creep: options.creep.as_ref().map(|creep| creep.block(options.dt)).transpose()?,
            delay: options.delay.block(options.dt)?,
            sub_steps,
        };
        actuator.settle(rest);
        Ok(actuator)
    }

    /// The number of sub-steps per sample.
    pub(super) fn sub_steps(&self) -> u32 {
        self.sub_steps
    }

    /// Forgets everything: the drive has been `rest` since forever, the hysteresis is virgin but for it.
    pub(super) fn settle(&mut self, rest: f64) -> f64 {
        if let Some(amplifier) = &mut self.amplifier {
            amplifier.settle(rest);
        }
        self.hysteresis.reset();
        self.displacement = self.hysteresis.step(rest);
        let mut position = self.displacement;
        if let Some(dynamics) = &mut self.dynamics {
            position = dynamics.settle(position);
        }
        if let Some(creep) = &mut self.creep {
            position = creep.settle(position);
        }
        self.delay.settle(position)
    }

    /// Holds the drive for one sampling interval and returns the position at its end.
    #[inline]
    pub(super) fn advance(&mut self, drive: f64) -> f64 {
        let mut position = self.before_creep(drive);
        if let Some(creep) = &mut self.creep {
            position = creep.advance(position);
        }
        self.delay.advance(position)
    }

    #[inline]
    fn before_creep(&mut self, drive: f64) -> f64 {
        let Some(amplifier) = &mut self.amplifier else {
            self.displacement = self.hysteresis.step(drive);
            return match &mut self.dynamics {
                Some(dynamics) => dynamics.advance(self.displacement),
                None => self.displacement,
            };
        };
        let mut position = self.displacement;
        for _ in 0..self.sub_steps {
            let displacement = self.hysteresis.step(amplifier.advance(drive));
            position = match &mut self.dynamics {
                Some(dynamics) => dynamics.advance(0.5 * (self.displacement + displacement)),
                None => displacement,
            };
            self.displacement = displacement;
        }
        position
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use crate::paper;

    use super::*;
    use hysteresis_control::linear::SecondOrder;

    fn response(options: &PlantOptions, drives: &[f64], sub_steps: Option<u32>) -> (u32, Vec<f64>) {
        let compiled = CompiledModel::new(&paper::table_1_recovered());
        let mut actuator = match sub_steps {
            Some(count) => Actuator::with_sub_steps(&compiled, options, 0.0, count),
            None => Actuator::new(&compiled, options, 0.0),
        }
        .unwrap();
        (actuator.sub_steps(), drives.iter().map(|u| actuator.advance(*u)).collect())
    }

    fn distance(one: &[f64], other: &[f64]) -> f64 {
        one.iter().zip(other).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    /// What `sub_steps` says of its error, against 1024 sub-steps, and that the rule is of second order.
    #[test]
    fn sub_steps_have_converged() {
        let sine: Vec<f64> = (0..2000).map(|k| 530.0 * (TAU * 20.0 * 1e-4 * f64::from(k)).sin()).collect();
        let jumps: Vec<f64> = (0..1000_u32).map(|k| if (k / 40) % 2 == 0 { 500.0 } else { -500.0 }).collect();
        for (pole, frequency, damping) in
            [(279.0, 2000.0, 0.03), (279.0, 400.0, 0.95), (1000.0, 2000.0, 0.03), (3000.0, 800.0, 0.1)]
        {
            let options = PlantOptions {
                amplifier: Some(FirstOrder::new(pole).unwrap()),
                dynamics: Some(SecondOrder::new(frequency, damping).unwrap().into()),
                ..PlantOptions::default()
            };
            for (drives, bound) in [(&sine, 2e-5), (&jumps, 5e-4)] {
                let (count, chosen) = response(&options, drives, None);
                let (_, exact) = response(&options, drives, Some(1024));
                let (_, half) = response(&options, drives, Some(count / 2));
                let (error, coarser) = (distance(&chosen, &exact), distance(&half, &exact));
                assert!(error < bound, "{pole} {frequency}: {count} sub-steps, {error} um");
                // Half as many: four times the error, and kinks at the breakpoints of the model blur the order.
                assert!(coarser > 3.0 * error, "{pole} {frequency}: {count} sub-steps, {coarser} and {error} um");
            }
        }
    }

    #[test]
    fn without_dynamics_only_the_end_of_the_interval_counts() {
        let options = PlantOptions { amplifier: Some(FirstOrder::new(279.0).unwrap()), ..PlantOptions::default() };
        let drives: Vec<f64> = (0..200_u32).map(|k| f64::from(k * k % 997) - 500.0).collect();
        let (count, once) = response(&options, &drives, None);
        assert_eq!(count, 1);
        // The exponential is multiplied up 16 times instead of evaluated once.
        assert!(distance(&once, &response(&options, &drives, Some(16)).1) < 1e-12);
    }
}
