//! Creep and dynamics for many signals at once: arrays, so that the compiler works on several signals at a time.

use super::linear_part::{SampledDynamics, SampledPart};

/// Signals side by side, each with creep of its own. At rest before the record.
#[derive(Clone, Debug)]
pub(crate) struct CreepLanes {
    lanes: usize,
    amplitudes: Vec<f64>,
    /// a_j.
    decays: Vec<f64>,
    /// q_j(k+1) of every lane, term by term, and q_j(k).
    next: Vec<f64>,
    q: Vec<f64>,
    p: Vec<f64>,
    is_at_rest: bool,
}

impl CreepLanes {
    pub(crate) fn new(part: &SampledPart, lanes: usize) -> Self {
        let states = vec![0.0; part.decays.len() * lanes];
        let (amplitudes, decays) = (part.amplitudes.clone(), part.decays.clone());
        Self { lanes, amplitudes, decays, next: states.clone(), q: states, p: vec![0.0; lanes], is_at_rest: true }
    }

    /// q_j(k) of every lane.
    pub(crate) fn term(&self, j: usize) -> &[f64] {
        &self.q[j * self.lanes..(j + 1) * self.lanes]
    }

    /// Takes h(k) of every lane and returns p(k) = h(k) + sum_j c_j q_j(k).
    pub(crate) fn put_out(&mut self, h: &[f64]) -> &[f64] {
        let n = self.lanes;
        let (h, p) = (&h[..n], &mut self.p[..n]);
        p.copy_from_slice(h);
        if n == 0 {
            return p;
        }
        if self.is_at_rest {
            self.next.chunks_exact_mut(n).for_each(|states| states.copy_from_slice(h));
            self.is_at_rest = false;
        }
        let states = self.next.chunks_exact_mut(n).zip(self.q.chunks_exact_mut(n));
        for ((next, q), (c, a)) in states.zip(self.amplitudes.iter().zip(&self.decays)) {
            let (next, q) = (&mut next[..n], &mut q[..n]);
            for i in 0..n {
                q[i] = next[i];
                p[i] += c * q[i];
                // The distance from rest decays: at rest nothing moves, not even a rounding.
                next[i] = h[i] + a * (q[i] - h[i]);
            }
        }
        p
    }
}

/// Signals side by side, each through the same dynamics and dead time. At rest before the record.
#[derive(Clone, Debug)]
pub(crate) struct DynamicLanes {
    dynamics: Option<SampledDynamics>,
    share: f64,
    p: Vec<f64>,
    before: Vec<f64>,
    /// x - p and v at t_k.
    deviation: Vec<f64>,
    v: Vec<f64>,
    is_at_rest: bool,
}

impl DynamicLanes {
    pub(crate) fn new(part: &SampledPart, lanes: usize) -> Self {
        let zeros = vec![0.0; lanes];
        let (p, before, deviation, v) = (zeros.clone(), zeros.clone(), zeros.clone(), zeros);
        Self { dynamics: part.dynamics.clone(), share: part.share, p, before, deviation, v, is_at_rest: true }
    }

    /// Puts out p(k) of every lane.
    pub(crate) fn put_out(&mut self, p: &[f64]) {
        std::mem::swap(&mut self.p, &mut self.before);
        self.p.copy_from_slice(p);
        if self.is_at_rest {
            self.before.copy_from_slice(p);
            self.is_at_rest = false;
        }
        let Some(dynamics) = &self.dynamics else { return };
        // From t_(k-1) to t_k p(k-1) was held; from now on the distance is that from p(k).
        let (e, n) = (dynamics.step, p.len());
        let (before, deviation, v) = (&self.before[..n], &mut self.deviation[..n], &mut self.v[..n]);
        for i in 0..n {
            let moved = e.xx * deviation[i] + e.xv * v[i];
            v[i] = e.vx * deviation[i] + e.vv * v[i];
            deviation[i] = moved + (before[i] - p[i]);
        }
    }

    /// The readings of the first lanes.
    pub(crate) fn read(&self, y: &mut [f64]) {
        let n = y.len();
        let p = &self.p[..n];
        if let Some(dynamics) = &self.dynamics {
            let (e, deviation, v) = (dynamics.reading, &self.deviation[..n], &self.v[..n]);
            for i in 0..n {
                y[i] = p[i] + (e.xx * deviation[i] + e.xv * v[i]);
            }
        } else {
            let (share, before) = (self.share, &self.before[..n]);
            for i in 0..n {
                // Not (1 - share) p + share before: a whole dead time must give the signal's own bits.
                y[i] = p[i] + share * (before[i] - p[i]);
            }
        }
    }

    /// The reading of one lane.
    pub(crate) fn read_one(&self, lane: usize) -> f64 {
        let p = self.p[lane];
        match &self.dynamics {
            Some(dynamics) => p + (dynamics.reading.xx * self.deviation[lane] + dynamics.reading.xv * self.v[lane]),
            None => p + self.share * (self.before[lane] - p),
        }
    }

    /// The derivative of a reading by the dead time, for a sampling interval `dt`.
    pub(crate) fn slope_over_dead_time(&self, lane: usize, dt: f64) -> f64 {
        match &self.dynamics {
            Some(dynamics) => -dynamics.speed(self.deviation[lane], self.v[lane]),
            None => (self.before[lane] - self.p[lane]) / dt,
        }
    }
}
