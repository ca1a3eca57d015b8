//! What filters do from sample to sample.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use pulp::Simd;

use super::{Amplifier, FilterLanes, Filters, Mode, TERMS};
use crate::fit::bank_lanes::BLOCK;
use crate::fit::eight::{Eight, EightLoop, Lanes};

/// The work of [`FilterLanes::put_out`].
pub(super) struct PutOut<'a> {
    pub(super) lanes: &'a mut FilterLanes,
    pub(super) is_first: bool,
    pub(super) samples: usize,
    pub(super) signals: &'a [Lanes],
    pub(super) readings: &'a mut [Lanes],
}

impl EightLoop for PutOut<'_> {
    #[inline(always)]
    fn run<S: Simd, const G: usize>(self, eight: Eight<S, G>) {
        let FilterLanes { decays, eights, behind_creep, .. } = self.lanes;
        let blocks = self.signals.chunks_exact(BLOCK).zip(behind_creep.chunks_exact_mut(BLOCK));
        let all = eights.iter_mut().zip(blocks.zip(self.readings.chunks_exact_mut(BLOCK)));
        for (filters, ((signals, behind_creep), readings)) in all {
            let (signals, p, y) =
                (&signals[..self.samples], &mut behind_creep[..self.samples], &mut readings[..self.samples]);
            creep(eight, decays, filters, self.is_first, signals, p);
            if self.is_first {
                filters.before = p[0];
                for mode in &mut filters.dynamics {
                    mode.before = p[0];
                    if let Some(amplifier) = &mut mode.amplifier {
                        amplifier.ends = p[0];
                    }
                }
            }
            let Some((first, further)) = filters.dynamics.split_first_mut() else {
                delayed(eight, filters, p, y);
                continue;
            };
            match &first.amplifier {
                None => hold::<S, G, true>(eight, first, &filters.position, p, y),
                Some(_) => lead::<S, G, true>(eight, first, &filters.position, p, y),
            }
            for mode in further {
                match &mode.amplifier {
                    None => hold::<S, G, false>(eight, mode, &filters.position, p, y),
                    Some(_) => lead::<S, G, false>(eight, mode, &filters.position, p, y),
                }
            }
        }
    }
}

/// p(k) = h(k) + sum_j c_j q_j(k).
#[inline(always)]
fn creep<S: Simd, const G: usize>(
    eight: Eight<S, G>,
    decays: &[f64],
    filters: &mut Filters,
    is_first: bool,
    h: &[Lanes],
    p: &mut [Lanes],
) {
    let direct = eight.load(&filters.direct);
    for (h, p) in h.iter().zip(&mut *p) {
        eight.store(eight.mul(direct, eight.load(h)), p);
    }
    let (decays, _) = decays.as_chunks::<TERMS>();
    let (amplitudes, _) = filters.amplitudes.as_chunks::<TERMS>();
    let (states, _) = filters.creep.as_chunks_mut::<TERMS>();
    for ((a, c), states) in decays.iter().zip(amplitudes).zip(states) {
        if is_first {
            *states = [h[0]; TERMS];
        }
        let mut q = [eight.splat(0.0); TERMS];
        for j in 0..TERMS {
            q[j] = eight.load(&states[j]);
        }
        for (h, p) in h.iter().zip(&mut *p) {
            let (h, mut sum) = (eight.load(h), eight.load(p));
            for j in 0..TERMS {
                sum = eight.mul_add(eight.load(&c[j]), q[j], sum);
                // The distance from rest decays: at rest nothing moves, not even a rounding.
                q[j] = eight.mul_add(eight.splat(a[j]), eight.sub(q[j], h), h);
            }
            eight.store(sum, p);
        }
        for j in 0..TERMS {
            eight.store(q[j], &mut states[j]);
        }
    }
}

/// Without dynamics: straight between samples.
#[inline(always)]
fn delayed<S: Simd, const G: usize>(eight: Eight<S, G>, filters: &mut Filters, p: &[Lanes], y: &mut [Lanes]) {
    let (position, share) = (eight.load(&filters.position), eight.load(&filters.share));
    let mut before = eight.load(&filters.before);
    for (p, y) in p.iter().zip(y) {
        let p = eight.load(p);
        // Not (1 - share) p + share before: a whole dead time must give the signal's own bits.
        eight.store(eight.mul_add(share, eight.sub(before, p), eight.mul(position, p)), y);
        before = p;
    }
    eight.store(before, &mut filters.before);
}

/// A mode by intervals in which the last p was held. The first mode writes a reading, the others add to it.
#[inline(always)]
fn hold<S: Simd, const G: usize, const FIRST: bool>(
    eight: Eight<S, G>,
    mode: &mut Mode,
    position: &Lanes,
    p: &[Lanes],
    y: &mut [Lanes],
) {
    let [xx, xv, vx, vv] = [&mode.xx, &mode.xv, &mode.vx, &mode.vv].map(|e| eight.load(e));
    let [read_x, read_v, position] = [&mode.read_x, &mode.read_v, position].map(|e| eight.load(e));
    let [mut deviation, mut v, mut before] = [&mode.deviation, &mode.v, &mode.before].map(|e| eight.load(e));
    for (p, y) in p.iter().zip(y) {
        let p = eight.load(p);
        let moved = eight.mul_add(xv, v, eight.sub(before, p));
        v = eight.mul_add(vv, v, eight.mul(vx, deviation));
        deviation = eight.mul_add(xx, deviation, moved);
        before = p;
        let from = if FIRST { eight.mul(position, p) } else { eight.load(y) };
        eight.store(eight.mul_add(read_x, deviation, eight.mul_add(read_v, v, from)), y);
    }
    eight.store(deviation, &mut mode.deviation);
    eight.store(v, &mut mode.v);
    eight.store(before, &mut mode.before);
}

/// As [`hold`] behind an amplifier: the input goes from the last p to this one by the end of the interval. The state holds what does
/// not decay with the input.
#[inline(always)]
fn lead<S: Simd, const G: usize, const FIRST: bool>(
    eight: Eight<S, G>,
    mode: &mut Mode,
    position: &Lanes,
    p: &[Lanes],
    y: &mut [Lanes],
) {
    let Some(amplifier) = &mut mode.amplifier else { return };
    let [xx, xv, vx, vv] = [&mode.xx, &mode.xv, &mode.vx, &mode.vv].map(|e| eight.load(e));
    let [read_x, read_v, position] = [&mode.read_x, &mode.read_v, position].map(|e| eight.load(e));
    let Amplifier { reach, step, start_x, start_v, read, .. } = &**amplifier;
    let [reach, step, start_x, start_v, read] = [reach, step, start_x, start_v, read].map(|e| eight.load(e));
    let [mut deviation, mut v, mut before] = [&mode.deviation, &mode.v, &mode.before].map(|e| eight.load(e));
    let [mut ends, mut decaying] = [&amplifier.ends, &amplifier.decaying].map(|e| eight.load(e));
    for (p, y) in p.iter().zip(y) {
        let p = eight.load(p);
        let end = eight.mul_add(eight.sub(p, before), reach, before);
        let left = eight.sub(before, end);
        let change = eight.sub(eight.mul(decaying, step), left);
        let moved = eight.mul_add(xv, v, eight.mul_add(start_x, change, eight.sub(ends, end)));
        v = eight.mul_add(vv, v, eight.mul_add(vx, deviation, eight.mul(start_v, change)));
        deviation = eight.mul_add(xx, deviation, moved);
        (ends, before, decaying) = (end, p, left);
        let from = if FIRST { eight.mul(position, end) } else { eight.load(y) };
        let states = eight.mul_add(read_x, deviation, eight.mul_add(read_v, v, from));
        eight.store(eight.mul_add(read, decaying, states), y);
    }
    eight.store(deviation, &mut mode.deviation);
    eight.store(v, &mut mode.v);
    eight.store(before, &mut mode.before);
    eight.store(ends, &mut amplifier.ends);
    eight.store(decaying, &mut amplifier.decaying);
}
