//! Dynamics and dead time of one signal, sample by sample: the plain loop that `filter_lanes` is for many signals.

use super::linear_part::{SampledDynamics, SampledPart};

/// At rest before the first sample.
pub(crate) struct DynamicsFilter {
    /// The first one, and those beside it.
    modes: Vec<Mode>,
    /// Behind an amplifier: what of a reading decays with the input, for an input that is 1 from where it goes at t_k.
    decaying_gain: f64,
    share: f64,
    /// The last input, and the one before.
    p: f64,
    before: f64,
    /// Behind an amplifier: how far the input is from where it goes, at t_k.
    decaying: f64,
    is_at_rest: bool,
}

/// A mode with its share in the static gain.
struct Mode {
    gain: f64,
    dynamics: SampledDynamics,
    /// x - p and v at t_k, but for what decays with the input behind an amplifier.
    deviation: f64,
    v: f64,
}

impl DynamicsFilter {
    pub(crate) fn new(part: &SampledPart) -> Self {
        let first = part.dynamics.iter().map(|dynamics| (part.first_gain, dynamics));
        let all = first.chain(part.further.iter().map(|(gain, dynamics)| (*gain, dynamics)));
        let modes: Vec<_> =
            all.map(|(gain, dynamics)| Mode { gain, dynamics: dynamics.clone(), deviation: 0.0, v: 0.0 }).collect();
        let decaying_gain = modes.iter().fold(0.0, |sum, mode| sum + mode.gain * mode.dynamics.decaying(1.0));
        let (share, is_at_rest) = (part.share, true);
        Self { modes, decaying_gain, share, p: 0.0, before: 0.0, decaying: 0.0, is_at_rest }
    }

    /// Takes p(k).
    pub(crate) fn take(&mut self, p: f64) {
        if std::mem::take(&mut self.is_at_rest) {
            (self.p, self.before) = (p, p);
        }
        match self.modes.first().and_then(|first| first.dynamics.amplifier) {
            Some(amplifier) => self.lead(p, amplifier.reach),
            None => self.hold(p),
        }
    }

    /// Through an interval in which the last p was held; from now on the distance is that from this one.
    fn hold(&mut self, p: f64) {
        (self.before, self.p) = (self.p, p);
        for Mode { dynamics, deviation, v, .. } in &mut self.modes {
            let e = dynamics.step;
            let moved = e.xx * *deviation + e.xv * *v;
            *v = e.vx * *deviation + e.vv * *v;
            *deviation = moved + (self.before - p);
        }
    }

    /// Behind an amplifier the input goes from the last p to this one by the end of the interval. What is kept as p is where it would
    /// go, and of the state what does not decay with it.
    fn lead(&mut self, p: f64, reach: f64) {
        let end = self.before + (p - self.before) * reach;
        let left = self.before - end;
        for Mode { dynamics, deviation, v, .. } in &mut self.modes {
            let Some(amplifier) = dynamics.amplifier else { continue };
            let (e, [x, speed]) = (dynamics.step, amplifier.start);
            let change = self.decaying * amplifier.step - left;
            let moved = e.xx * *deviation + e.xv * *v;
            *v = e.vx * *deviation + e.vv * *v + speed * change;
            *deviation = moved + (self.p - end) + x * change;
        }
        (self.p, self.before, self.decaying) = (end, p, left);
    }

    /// What is read.
    pub(crate) fn reading(&self) -> f64 {
        if self.modes.is_empty() {
            return self.p + self.share * (self.before - self.p);
        }
        let add = |sum: f64, mode: &Mode| {
            let e = mode.dynamics.reading;
            sum + mode.gain * (e.xx * mode.deviation + e.xv * mode.v)
        };
        self.modes.iter().fold(self.p, add) + self.decaying_gain * self.decaying
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_control::linear::{Block, Dynamics, FirstOrder, LinearDynamics, SecondOrder};

    use super::*;
    use crate::fit::linear_part::LinearPart;
    use crate::fit::response::through;

    fn signal() -> Vec<f64> {
        (0..60_u32).map(|k| 2.0 + (f64::from(k * k) / 7.0).sin() * f64::from(k % 11)).collect()
    }

    /// The whole linear part is what the blocks of a stage make of a signal: creep at the samples, then dynamics behind a
    /// dead time, whole or not.
    #[test]
    fn equals_the_blocks_of_a_stage() {
        let dt = 1e-4;
        let all: [Option<Dynamics>; 4] = [
            None,
            Some(FirstOrder::new(279.0).unwrap().into()),
            Some(SecondOrder::new(800.0, 0.02).unwrap().into()),
            Some(SecondOrder::new(400.0, 1.7).unwrap().into()),
        ];
        for dynamics in all {
            for dead_time in [0.0, 0.3e-4, 1e-4, 2.65e-4] {
                let part = LinearPart {
                    dynamics,
                    amplitudes: vec![0.02, 0.1],
                    time_constants: vec![4e-4, 3e-3],
                    dead_time,
                    ..LinearPart::default()
                };
                let linear = dynamics.map_or_else(LinearDynamics::none, LinearDynamics::from);
                let mut block = linear.with_dead_time(dead_time).unwrap().block(dt).unwrap();
                let mut q = [signal()[0]; 2];
                block.settle(signal()[0] * 1.12);
                for (k, (h, got)) in signal().iter().zip(through(&part, &signal(), dt)).enumerate() {
                    let want = block.step(h + 0.02 * q[0] + 0.1 * q[1]);
                    q[0] += (1.0 - (-dt / 4e-4_f64).exp()) * (h - q[0]);
                    q[1] += (1.0 - (-dt / 3e-3_f64).exp()) * (h - q[1]);
                    assert!((got - want).abs() < 1e-11, "{dynamics:?} {dead_time} {k}: {got} {want}");
                }
            }
        }
    }

    /// Behind an amplifier the input goes exponentially from each value to the next: as many small steps.
    #[test]
    fn an_amplifier_leads_the_input_from_value_to_value() {
        let dt = 1e-4;
        for (bandwidth, zeta) in [(400.0, 0.02), (5000.0, 0.4), (800.0, 1.0)] {
            let dynamics = SecondOrder::new(800.0, zeta).unwrap();
            let part = LinearPart {
                dynamics: Some(dynamics.into()),
                dead_time: 0.4e-4,
                bandwidth: Some(bandwidth),
                ..LinearPart::default()
            };
            let signal = signal();
            let (pieces, sigma) = (1000_u32, core::f64::consts::TAU * bandwidth);
            let mut block = dynamics.block(dt / f64::from(pieces)).unwrap();
            let mut fine = vec![block.settle(signal[0])];
            let mut before = signal[0];
            for p in &signal {
                let end = before + (p - before) / -(-sigma * dt).exp_m1();
                for piece in 0..pieces {
                    let t = dt * (f64::from(piece) + 0.5) / f64::from(pieces);
                    fine.push(block.advance(end + (before - end) * (-sigma * t).exp()));
                }
                before = *p;
            }
            let mut filter = DynamicsFilter::new(&SampledPart::new(&part, dt));
            for (k, p) in signal.iter().enumerate() {
                filter.take(*p);
                let got = filter.reading();
                let want = fine[1000 * k + 600];
                assert!((got - want).abs() < 1e-4, "{bandwidth} {zeta} {k}: {got} {want}");
            }
        }
    }

    /// A negative dead time reads ahead: the same rows, earlier.
    #[test]
    fn a_negative_dead_time_reads_ahead() {
        let part = |dead_time| LinearPart {
            dynamics: Some(SecondOrder::new(800.0, 0.1).unwrap().into()),
            dead_time,
            ..LinearPart::default()
        };
        let (later, now, earlier) = (
            through(&part(0.4e-4), &signal(), 1e-4),
            through(&part(0.0), &signal(), 1e-4),
            through(&part(-1e-4), &signal(), 1e-4),
        );
        let ahead = through(&part(-1.6e-4), &signal(), 1e-4);
        for k in 0..50 {
            assert!((earlier[k] - now[k + 1]).abs() < 1e-12);
            assert!((ahead[k] - later[k + 2]).abs() < 1e-12);
        }
    }

    #[test]
    fn at_rest_nothing_moves() {
        let part = LinearPart {
            dynamics: Some(SecondOrder::new(800.0, 0.02).unwrap().into()),
            amplitudes: vec![0.01],
            time_constants: vec![0.1],
            dead_time: 0.3e-4,
            ..LinearPart::default()
        };
        let held = through(&part, &[0.3; 40], 1e-4);
        assert!(held.iter().all(|y| *y == held[0]));
    }
}
