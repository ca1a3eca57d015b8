//! Dynamics for many signals at once: arrays, so that the compiler works on several signals at a time.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::linear_part::{SampledAmplifier, SampledDynamics, SampledPart};
use super::mode_lanes::ModeLanes;

/// Signals side by side, each through the same dynamics and dead time. At rest before the record.
#[derive(Clone, Debug)]
pub(crate) struct DynamicLanes {
    dynamics: Option<SampledDynamics>,
    /// The share of these dynamics, and the modes beside them.
    gain: f64,
    further: ModeLanes,
    /// Behind an amplifier: what of a reading decays with the input, for an input that is 1 from where it goes at t_k.
    decaying_gain: f64,
    share: f64,
    p: Vec<f64>,
    before: Vec<f64>,
    /// x - p and v at t_k, but for what decays with the input behind an amplifier.
    deviation: Vec<f64>,
    v: Vec<f64>,
    /// Behind an amplifier: how far the input is from where it goes, at t_k.
    decaying: Vec<f64>,
    is_at_rest: bool,
}

impl DynamicLanes {
    pub(crate) fn new(part: &SampledPart, lanes: usize) -> Self {
        let zeros = vec![0.0; lanes];
        let (p, before, deviation, v) = (zeros.clone(), zeros.clone(), zeros.clone(), zeros.clone());
        let (dynamics, gain, share) = (part.dynamics.clone(), part.first_gain, part.share);
        let further = ModeLanes::new(part, lanes);
        let first = dynamics.as_ref().map_or(0.0, |dynamics| gain * dynamics.decaying(1.0));
        let decaying_gain = further.iter().fold(first, |sum, (gain, mode)| sum + gain * mode.decaying(1.0));
        let is_at_rest = true;
        Self { dynamics, gain, further, decaying_gain, share, p, before, deviation, v, decaying: zeros, is_at_rest }
    }

    /// Puts out p(k) of every lane.
    #[inline(always)]
    pub(crate) fn put_out(&mut self, p: &[f64]) {
        if self.is_at_rest {
            self.before.copy_from_slice(p);
            self.p.copy_from_slice(p);
            self.is_at_rest = false;
        }
        if let Some(amplifier) = self.dynamics.as_ref().and_then(|dynamics| dynamics.amplifier) {
            return self.lead(p, &amplifier);
        }
        std::mem::swap(&mut self.p, &mut self.before);
        self.p.copy_from_slice(p);
        let Some(dynamics) = &self.dynamics else { return };
        hold(dynamics, &self.before, p, &mut self.deviation, &mut self.v);
        self.further.hold(&self.before, p);
    }

    /// Behind an amplifier the input goes from the last p to this one by the end of the interval. The lanes hold where it would
    /// go, and of the state what does not decay with it.
    #[inline(always)]
    fn lead(&mut self, p: &[f64], amplifier: &SampledAmplifier) {
        let Some(dynamics) = &self.dynamics else { return };
        let inputs = LedInputs { ends: &self.p, before: &self.before, decaying: &self.decaying, p };
        lead(dynamics, amplifier, &inputs, &mut self.deviation, &mut self.v);
        self.further.lead(&inputs);
        let n = p.len();
        let (ends, before, decaying) = (&mut self.p[..n], &mut self.before[..n], &mut self.decaying[..n]);
        for i in 0..n {
            let end = before[i] + (p[i] - before[i]) * amplifier.reach;
            (ends[i], before[i], decaying[i]) = (end, p[i], before[i] - end);
        }
    }

    /// The reading of one lane.
    pub(crate) fn read_one(&self, lane: usize) -> f64 {
        let p = self.p[lane];
        match &self.dynamics {
            Some(dynamics) => {
                let e = dynamics.reading;
                let first = p + self.gain * (e.xx * self.deviation[lane] + e.xv * self.v[lane]);
                self.further.added_to(first, lane) + self.decaying_gain * self.decaying[lane]
            }
            None => p + self.share * (self.before[lane] - p),
        }
    }
}

/// Takes dynamics of every lane on by an interval in which `before` was held; from now on the distance is that from `p`.
#[inline(always)]
pub(super) fn hold(dynamics: &SampledDynamics, before: &[f64], p: &[f64], deviation: &mut [f64], v: &mut [f64]) {
    let (e, n) = (dynamics.step, p.len());
    let (before, deviation, v) = (&before[..n], &mut deviation[..n], &mut v[..n]);
    for i in 0..n {
        let moved = e.xx * deviation[i] + e.xv * v[i];
        v[i] = e.vx * deviation[i] + e.vv * v[i];
        deviation[i] = moved + (before[i] - p[i]);
    }
}

/// The inputs of every lane behind an amplifier: from `before` they went towards `ends`, from which they were `decaying` away, and
/// go to `p` now.
pub(super) struct LedInputs<'a> {
    ends: &'a [f64],
    before: &'a [f64],
    decaying: &'a [f64],
    p: &'a [f64],
}

/// As [`hold`] behind an amplifier.
#[inline(always)]
pub(super) fn lead(
    dynamics: &SampledDynamics,
    amplifier: &SampledAmplifier,
    inputs: &LedInputs<'_>,
    deviation: &mut [f64],
    v: &mut [f64],
) {
    let (e, [x, speed], n) = (dynamics.step, amplifier.start, inputs.p.len());
    let (ends, before, decaying, p) = (&inputs.ends[..n], &inputs.before[..n], &inputs.decaying[..n], inputs.p);
    let (deviation, v) = (&mut deviation[..n], &mut v[..n]);
    for i in 0..n {
        let end = before[i] + (p[i] - before[i]) * amplifier.reach;
        let change = decaying[i] * amplifier.step - (before[i] - end);
        let moved = e.xx * deviation[i] + e.xv * v[i];
        v[i] = e.vx * deviation[i] + e.vv * v[i] + speed * change;
        deviation[i] = moved + (ends[i] - end) + x * change;
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
            let mut lane = DynamicLanes::new(&SampledPart::new(&part, dt), 1);
            for (k, p) in signal.iter().enumerate() {
                lane.put_out(&[*p]);
                let got = lane.read_one(0);
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

    /// Two lanes are two signals.
    #[test]
    fn lanes_do_not_mix() {
        let lag: Dynamics = FirstOrder::new(300.0).unwrap().into();
        for dynamics in [lag, SecondOrder::new(900.0, 0.3).unwrap().into()] {
            let part = LinearPart { dynamics: Some(dynamics), dead_time: 0.4e-4, ..LinearPart::default() };
            let part = SampledPart::new(&part, 1e-4);
            let (mut both, mut alone) = (DynamicLanes::new(&part, 2), DynamicLanes::new(&part, 1));
            for u in signal() {
                both.put_out(&[1.0 - u, u]);
                alone.put_out(&[u]);
                assert_eq!(both.read_one(1), alone.read_one(0));
            }
        }
    }
}
