//! Creep for many signals at once: arrays, so that the compiler works on several signals at a time.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::linear_part::SampledPart;

/// So many signals are worked on at a time: their states stay in registers from one time constant to the next.
const WIDTH: usize = 8;

/// Signals side by side, each with creep of its own. At rest before the record.
#[derive(Clone, Debug)]
pub(crate) struct CreepLanes {
    amplitudes: Vec<f64>,
    /// a_j.
    decays: Vec<f64>,
    /// q_j(k) of every block of signals, term by term.
    states: Vec<[f64; WIDTH]>,
    is_at_rest: bool,
}

impl CreepLanes {
    pub(crate) fn new(part: &SampledPart, lanes: usize) -> Self {
        let states = vec![[0.0; WIDTH]; part.decays.len() * lanes.div_ceil(WIDTH)];
        let (amplitudes, decays) = (part.amplitudes.clone(), part.decays.clone());
        Self { amplitudes, decays, states, is_at_rest: true }
    }

    /// Takes the first h of every lane for the value at which it rests.
    #[inline(always)]
    fn settle(&mut self, h: &[f64]) {
        if self.is_at_rest && !self.decays.is_empty() {
            for (h, states) in h.chunks(WIDTH).zip(self.states.chunks_exact_mut(self.decays.len())) {
                for q in states {
                    q[..h.len()].copy_from_slice(h);
                }
            }
            self.is_at_rest = false;
        }
    }

    /// Takes h(k) of every lane and writes p(k) = h(k) + sum_j c_j q_j(k).
    #[inline(always)]
    pub(crate) fn put_out(&mut self, h: &[f64], p: &mut [f64]) {
        self.settle(h);
        if self.decays.is_empty() {
            return p.copy_from_slice(h);
        }
        let (blocks, rest) = h.as_chunks::<WIDTH>();
        let (blocks_out, rest_out) = p.as_chunks_mut::<WIDTH>();
        let mut states = self.states.chunks_exact_mut(self.decays.len());
        for ((h, p), states) in blocks.iter().zip(blocks_out).zip(&mut states) {
            *p = creep(*h, &self.amplitudes, &self.decays, states);
        }
        if let Some(states) = states.next() {
            let mut last = [0.0; WIDTH];
            last[..rest.len()].copy_from_slice(rest);
            rest_out.copy_from_slice(&creep(last, &self.amplitudes, &self.decays, states)[..rest.len()]);
        }
    }

    /// The same of a single lane.
    pub(crate) fn put_out_one(&mut self, h: f64) -> f64 {
        let mut p = [0.0];
        self.put_out(&[h], &mut p);
        p[0]
    }
}

/// p(k) of a block of signals, whose states go on.
#[inline(always)]
fn creep(h: [f64; WIDTH], amplitudes: &[f64], decays: &[f64], states: &mut [[f64; WIDTH]]) -> [f64; WIDTH] {
    let mut p = h;
    for (q, (c, a)) in states.iter_mut().zip(amplitudes.iter().zip(decays)) {
        for i in 0..WIDTH {
            p[i] += c * q[i];
            // The distance from rest decays: at rest nothing moves, not even a rounding.
            q[i] = h[i] + a * (q[i] - h[i]);
        }
    }
    p
}
