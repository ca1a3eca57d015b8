//! What filters do from sample to sample.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use fearless_simd::{Simd, SimdFloat};

use super::{Amplifier, FilterLanes, Filters, Mode, TERMS};
use crate::fit::bank_lanes::BLOCK;
use crate::fit::eight::{Lanes, SimdLoop, load, splat};

/// The work of [`FilterLanes::put_out`].
pub(super) struct PutOut<'a> {
    pub(super) lanes: &'a mut FilterLanes,
    pub(super) is_first: bool,
    pub(super) samples: usize,
    pub(super) signals: &'a [Lanes],
    pub(super) readings: &'a mut [Lanes],
}

impl SimdLoop for PutOut<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let FilterLanes { decays, eights, behind_creep, .. } = self.lanes;
        let blocks = self.signals.chunks_exact(BLOCK).zip(behind_creep.chunks_exact_mut(BLOCK));
        let all = eights.iter_mut().zip(blocks.zip(self.readings.chunks_exact_mut(BLOCK)));
        for (filters, ((signals, behind_creep), readings)) in all {
            let (signals, p, y) =
                (&signals[..self.samples], &mut behind_creep[..self.samples], &mut readings[..self.samples]);
            creep(simd, decays, filters, self.is_first, signals, p);
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
                delayed(simd, filters, p, y);
                continue;
            };
            match &first.amplifier {
                None => hold::<S, true>(simd, first, &filters.position, p, y),
                Some(_) => lead::<S, true>(simd, first, &filters.position, p, y),
            }
            for mode in further {
                match &mode.amplifier {
                    None => hold::<S, false>(simd, mode, &filters.position, p, y),
                    Some(_) => lead::<S, false>(simd, mode, &filters.position, p, y),
                }
            }
        }
    }
}

/// p(k) = h(k) + sum_j c_j q_j(k).
#[inline(always)]
fn creep<S: Simd>(simd: S, decays: &[f64], filters: &mut Filters, is_first: bool, h: &[Lanes], p: &mut [Lanes]) {
    let direct = load(simd, &filters.direct);
    for (h, p) in h.iter().zip(&mut *p) {
        *p = (direct * load(simd, h)).into();
    }
    let (decays, _) = decays.as_chunks::<TERMS>();
    let (amplitudes, _) = filters.amplitudes.as_chunks::<TERMS>();
    let (states, _) = filters.creep.as_chunks_mut::<TERMS>();
    for ((a, c), states) in decays.iter().zip(amplitudes).zip(states) {
        if is_first {
            *states = [h[0]; TERMS];
        }
        let mut q = [splat(simd, 0.0); TERMS];
        for j in 0..TERMS {
            q[j] = load(simd, &states[j]);
        }
        for (h, p) in h.iter().zip(&mut *p) {
            let (h, mut sum) = (load(simd, h), load(simd, p));
            for j in 0..TERMS {
                sum = load(simd, &c[j]).mul_add(q[j], sum);
                // The distance from rest decays: at rest nothing moves, not even a rounding.
                q[j] = splat(simd, a[j]).mul_add(q[j] - h, h);
            }
            *p = sum.into();
        }
        for j in 0..TERMS {
            states[j] = q[j].into();
        }
    }
}

/// Without dynamics: straight between samples.
#[inline(always)]
fn delayed<S: Simd>(simd: S, filters: &mut Filters, p: &[Lanes], y: &mut [Lanes]) {
    let (position, share) = (load(simd, &filters.position), load(simd, &filters.share));
    let mut before = load(simd, &filters.before);
    for (p, y) in p.iter().zip(y) {
        let p = load(simd, p);
        // Not (1 - share) p + share before: a whole dead time must give the signal's own bits.
        *y = share.mul_add(before - p, position * p).into();
        before = p;
    }
    filters.before = before.into();
}

/// A mode by intervals in which the last p was held. The first mode writes a reading, the others add to it.
#[inline(always)]
fn hold<S: Simd, const FIRST: bool>(simd: S, mode: &mut Mode, position: &Lanes, p: &[Lanes], y: &mut [Lanes]) {
    let [xx, xv, vx, vv] = [&mode.xx, &mode.xv, &mode.vx, &mode.vv].map(|e| load(simd, e));
    let [read_x, read_v, position] = [&mode.read_x, &mode.read_v, position].map(|e| load(simd, e));
    let [mut deviation, mut v, mut before] = [&mode.deviation, &mode.v, &mode.before].map(|e| load(simd, e));
    for (p, y) in p.iter().zip(y) {
        let p = load(simd, p);
        let moved = xv.mul_add(v, before - p);
        v = vv.mul_add(v, vx * deviation);
        deviation = xx.mul_add(deviation, moved);
        before = p;
        let from = if FIRST { position * p } else { load(simd, y) };
        *y = read_x.mul_add(deviation, read_v.mul_add(v, from)).into();
    }
    mode.deviation = deviation.into();
    mode.v = v.into();
    mode.before = before.into();
}

/// As [`hold`] behind an amplifier: the input goes from the last p to this one by the end of the interval. The state holds what does
/// not decay with the input.
#[inline(always)]
fn lead<S: Simd, const FIRST: bool>(simd: S, mode: &mut Mode, position: &Lanes, p: &[Lanes], y: &mut [Lanes]) {
    let Some(amplifier) = &mut mode.amplifier else { return };
    let [xx, xv, vx, vv] = [&mode.xx, &mode.xv, &mode.vx, &mode.vv].map(|e| load(simd, e));
    let [read_x, read_v, position] = [&mode.read_x, &mode.read_v, position].map(|e| load(simd, e));
    let Amplifier { reach, step, start_x, start_v, read, .. } = &**amplifier;
    let [reach, step, start_x, start_v, read] = [reach, step, start_x, start_v, read].map(|e| load(simd, e));
    let [mut deviation, mut v, mut before] = [&mode.deviation, &mode.v, &mode.before].map(|e| load(simd, e));
    let [mut ends, mut decaying] = [&amplifier.ends, &amplifier.decaying].map(|e| load(simd, e));
    for (p, y) in p.iter().zip(y) {
        let p = load(simd, p);
        let end = (p - before).mul_add(reach, before);
        let left = before - end;
        let change = decaying * step - left;
        let moved = xv.mul_add(v, start_x.mul_add(change, ends - end));
        v = vv.mul_add(v, vx.mul_add(deviation, start_v * change));
        deviation = xx.mul_add(deviation, moved);
        (ends, before, decaying) = (end, p, left);
        let from = if FIRST { position * end } else { load(simd, y) };
        let states = read_x.mul_add(deviation, read_v.mul_add(v, from));
        *y = read.mul_add(decaying, states).into();
    }
    mode.deviation = deviation.into();
    mode.v = v.into();
    mode.before = before.into();
    amplifier.ends = ends.into();
    amplifier.decaying = decaying.into();
}
