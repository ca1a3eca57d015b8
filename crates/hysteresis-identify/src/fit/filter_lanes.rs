//! Creep and dynamics for many signals over a block of samples, eight signals at once.

use fearless_simd::{Simd, SimdFloat, f64x8};
use hysteresis_core::unless_faded;

use crate::algebra::eight::{LANES, Lanes, SimdLoop, dispatch, load, load_all, splat};
use crate::terms::dynamics::{SampledDynamics, SampledPart};
use crate::terms::operators::BLOCK;

/// So many terms of creep are worked on at a time: their states stay in registers from sample to sample.
const TERMS: usize = 4;

/// What becomes of one signal.
pub(crate) struct Lane<'a> {
    /// The share of the signal itself behind the creep, 1 or 0.
    pub(crate) direct: f64,
    /// The amplitudes c_j of its creep.
    pub(crate) amplitudes: &'a [f64],
    pub(crate) part: &'a SampledPart,
    pub(crate) reading: Reading,
}

/// What is read.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Reading {
    /// The output.
    Position,
    /// How far the output of dynamics is from their input.
    FromInput,
    /// Its derivative by the dead time, for this sampling interval.
    OverDeadTime(f64),
}

/// Signals side by side, each through creep and dynamics of its own, at rest at the first sample; all creep has the
/// same time constants.
pub(crate) struct FilterLanes {
    /// a_j, filled up with zeros.
    decays: Vec<f64>,
    eights: Vec<Filters>,
    is_at_rest: bool,
    /// The signals behind the creep; in the order of the readings.
    behind_creep: Vec<Lanes>,
    /// One for each eight, if blocks in which its signals stand still are passed in one step.
    still: Vec<Still>,
}

/// What eight signals that stand still for a whole block come to, without a look at its samples: filters are linear, so
/// how far they are from rest decays in the same way from every such block's begin.
///
/// ```text
/// s(k) = h e + M^k (s(0) - h e),   y(k) = h g + c M^k (s(0) - h e)
/// ```
///
/// h are the signals, s the states, e and g the states and the readings at rest at 1.
#[derive(Clone)]
struct Still {
    /// e and g.
    rest: Vec<Lanes>,
    gain: Lanes,
    /// c M^k for every sample of a block, state by state.
    readings: Vec<Lanes>,
    /// The elements of M^BLOCK that are not zero, with row and column.
    step: Vec<(usize, usize, Lanes)>,
    /// The signals of the last block if it was passed, and how far the states were from rest at its begin.
    passed: Option<Lanes>,
    distances: Vec<Lanes>,
    ends: Vec<Lanes>,
}

/// Of eight signals.
struct Filters {
    /// How many terms of creep there are.
    terms: usize,
    direct: Lanes,
    /// c_j and q_j, term by term.
    amplitudes: Vec<Lanes>,
    creep: Vec<Lanes>,
    /// Of all modes.
    dynamics: Vec<ModeLanes>,
    /// Without dynamics: the share of the last sample.
    share: Lanes,
    before: Lanes,
    /// 1 where a position is read.
    position: Lanes,
}

/// One mode of eight signals: what it does from sample to sample, and what of its state is read.
#[derive(Clone, Default)]
struct ModeLanes {
    xx: Lanes,
    xv: Lanes,
    vx: Lanes,
    vv: Lanes,
    read_x: Lanes,
    read_v: Lanes,
    /// x - p and v.
    deviation: Lanes,
    v: Lanes,
    before: Lanes,
    amplifier: Option<Box<AmplifierLanes>>,
}

/// See [`SampledAmplifier`](crate::terms::dynamics::SampledAmplifier).
#[derive(Clone, Default)]
struct AmplifierLanes {
    reach: Lanes,
    step: Lanes,
    start_x: Lanes,
    start_v: Lanes,
    read: Lanes,
    ends: Lanes,
    decaying: Lanes,
}

impl FilterLanes {
    pub(crate) fn new(decays: &[f64], lanes: &[Lane<'_>]) -> Self {
        let eights: Vec<_> = lanes.chunks(LANES).map(|lanes| Filters::new(lanes, decays.len())).collect();
        let filled = decays.len().next_multiple_of(TERMS);
        let filled_up = decays.iter().copied().chain(std::iter::repeat(0.0)).take(filled).collect();
        let behind_creep = vec![[0.0; LANES]; eights.len() * BLOCK];
        Self { decays: filled_up, eights, is_at_rest: true, behind_creep, still: Vec::new() }
    }

    /// The same for long records, as it takes some blocks to learn: those in which eight signals stand still are passed
    /// in one step. Their readings are in [`row`](Self::row) alone.
    pub(crate) fn passing_still_blocks(mut self) -> Self {
        let count = self.eights.len() * BLOCK;
        let mut readings = vec![[0.0; LANES]; count];
        self.put_out(BLOCK, &vec![[1.0; LANES]; count], &mut readings);
        let mut still: Vec<_> = self
            .eights
            .iter_mut()
            .zip(readings.chunks_exact(BLOCK))
            .map(|(eight, y)| Still::new(eight, y[0]))
            .collect();
        let states = still.first().map_or(0, |first| first.rest.len());
        for from in 0..states {
            for filters in &mut self.eights {
                filters.states().enumerate().for_each(|(to, state)| *state = [f64::from(u8::from(to == from)); LANES]);
            }
            self.put_out(BLOCK, &vec![[0.0; LANES]; count], &mut readings);
            for ((still, filters), y) in still.iter_mut().zip(&mut self.eights).zip(readings.chunks_exact(BLOCK)) {
                still.learn(from, filters, y);
            }
        }
        for filters in &mut self.eights {
            filters.states().for_each(|state| *state = [0.0; LANES]);
        }
        Self { still, is_at_rest: true, ..self }
    }

    /// What is read at a sample of the last block, `readings` being what that put out.
    pub(crate) fn row(&self, sample: usize, readings: &[Lanes], row: &mut [Lanes]) {
        dispatch(ReadRow { still: &self.still, sample, readings, row });
    }

    /// Takes a block of `samples` and puts out the readings, both the first eight signals at all samples, then the
    /// next.
    pub(crate) fn put_out(&mut self, samples: usize, signals: &[Lanes], readings: &mut [Lanes]) {
        let is_first = std::mem::take(&mut self.is_at_rest);
        dispatch(PutOut { lanes: self, is_first, samples, signals, readings });
    }

    /// What is read before the record, once its first block was put out: the first sample of that, held for ever.
    pub(crate) fn at_rest(&self, lane: usize) -> f64 {
        let (eight, place) = (lane / LANES, lane % LANES);
        self.eights[eight].position[place] * self.behind_creep[eight * BLOCK][place]
    }
}

impl Still {
    /// From filters at rest at 1, and what they read.
    fn new(filters: &mut Filters, gain: Lanes) -> Self {
        let rest: Vec<_> = filters.states().map(|state| *state).collect();
        let zeros = vec![[0.0; LANES]; rest.len()];
        Self {
            readings: vec![[0.0; LANES]; rest.len() * BLOCK],
            rest,
            gain,
            step: Vec::new(),
            passed: None,
            distances: zeros.clone(),
            ends: zeros,
        }
    }

    /// What was read, and where states are, a block after one of them was 1 and the others and the signals were zero.
    fn learn(&mut self, from: usize, filters: &mut Filters, readings: &[Lanes]) {
        let states = self.rest.len();
        for (all, reading) in self.readings.chunks_exact_mut(states).zip(readings) {
            all[from] = *reading;
        }
        let ends = filters.states().enumerate().map(|(to, state)| (to, from, *state));
        self.step.extend(ends.filter(|(_, _, state)| state.iter().any(|value| *value != 0.0)));
    }

    /// Takes a block of these signals.
    #[inline(always)]
    fn pass<S: Simd>(&mut self, simd: S, filters: &mut Filters, signals: &Lanes) {
        let Self { rest, step, distances, ends, .. } = self;
        let h = load(simd, signals);
        for (number, state) in filters.states().enumerate() {
            let at_rest = h * load(simd, &rest[number]);
            distances[number] = (load(simd, state) - at_rest).into();
            ends[number] = at_rest.into();
        }
        for (to, from, factor) in step {
            ends[*to] = load(simd, factor).mul_add(load(simd, &distances[*from]), load(simd, &ends[*to])).into();
        }
        filters.states().zip(&*ends).for_each(|(state, end)| *state = end.map(unless_faded));
        self.passed = Some(*signals);
    }

    /// What is read at a sample of the block of these signals that was passed.
    #[inline(always)]
    fn read<S: Simd>(&self, simd: S, signals: &Lanes, sample: usize) -> f64x8<S> {
        let states = self.rest.len();
        let mut sum = load(simd, signals) * load(simd, &self.gain);
        for (factor, distance) in self.readings[sample * states..][..states].iter().zip(&self.distances) {
            sum = load(simd, factor).mul_add(load(simd, distance), sum);
        }
        sum
    }
}

impl Filters {
    fn new(lanes: &[Lane<'_>], terms: usize) -> Self {
        let (zero, filled) = ([0.0; LANES], terms.next_multiple_of(TERMS));
        let modes = lanes[0].part.dynamics.iter().len() + lanes[0].part.further.len();
        let mut filters = Self {
            terms,
            direct: zero,
            amplitudes: vec![zero; filled],
            creep: vec![zero; filled],
            dynamics: vec![ModeLanes::default(); modes],
            share: zero,
            before: zero,
            position: zero,
        };
        for (place, lane) in lanes.iter().enumerate() {
            filters.direct[place] = lane.direct;
            for (amplitudes, c) in filters.amplitudes.iter_mut().zip(lane.amplitudes) {
                amplitudes[place] = *c;
            }
            (filters.position[place], filters.share[place]) = match lane.reading {
                Reading::Position => (1.0, lane.part.share),
                Reading::FromInput => (0.0, lane.part.share),
                Reading::OverDeadTime(dt) => (0.0, 1.0 / dt),
            };
            let first = lane.part.dynamics.iter().map(|dynamics| (lane.part.first_gain, dynamics));
            let further = lane.part.further.iter().map(|(gain, dynamics)| (*gain, dynamics));
            for (mode, (gain, dynamics)) in filters.dynamics.iter_mut().zip(first.chain(further)) {
                mode.set(place, gain, dynamics, lane.reading);
            }
        }
        filters
    }

    /// What changes from sample to sample.
    fn states(&mut self) -> impl Iterator<Item = &mut Lanes> {
        let creep = self.creep.iter_mut().take(self.terms);
        creep.chain([&mut self.before]).chain(self.dynamics.iter_mut().flat_map(ModeLanes::states))
    }
}

impl ModeLanes {
    fn states(&mut self) -> impl Iterator<Item = &mut Lanes> {
        let Self { deviation, v, before, amplifier, .. } = self;
        let behind = amplifier.iter_mut().flat_map(|amplifier| [&mut amplifier.ends, &mut amplifier.decaying]);
        [deviation, v, before].into_iter().chain(behind)
    }

    fn set(&mut self, place: usize, gain: f64, dynamics: &SampledDynamics, reading: Reading) {
        let step = &dynamics.step;
        (self.xx[place], self.xv[place]) = (step.xx, step.xv);
        (self.vx[place], self.vv[place]) = (step.vx, step.vv);
        let read = |deviation: f64, v: f64, left: f64| match reading {
            Reading::Position | Reading::FromInput => gain * dynamics.answer(deviation, v, left),
            Reading::OverDeadTime(_) => -gain * dynamics.speed(deviation, v, left),
        };
        (self.read_x[place], self.read_v[place]) = (read(1.0, 0.0, 0.0), read(0.0, 1.0, 0.0));
        if let Some(sampled) = &dynamics.amplifier {
            let amplifier = self.amplifier.get_or_insert_default();
            (amplifier.reach[place], amplifier.step[place]) = (sampled.reach, sampled.step);
            [amplifier.start_x[place], amplifier.start_v[place]] = sampled.start;
            amplifier.read[place] = read(0.0, 0.0, 1.0);
        }
    }
}

/// The work of [`FilterLanes::put_out`].
pub(crate) struct PutOut<'a> {
    pub(crate) lanes: &'a mut FilterLanes,
    pub(crate) is_first: bool,
    pub(crate) samples: usize,
    pub(crate) signals: &'a [Lanes],
    pub(crate) readings: &'a mut [Lanes],
}

impl SimdLoop for PutOut<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let FilterLanes { decays, eights, behind_creep, still, .. } = self.lanes;
        let blocks = self.signals.chunks_exact(BLOCK).zip(behind_creep.chunks_exact_mut(BLOCK));
        let all = eights.iter_mut().zip(blocks.zip(self.readings.chunks_exact_mut(BLOCK)));
        let may_pass = !self.is_first && self.samples == BLOCK;
        for (number, (filters, ((signals, behind_creep), readings))) in all.enumerate() {
            if let Some(still) = still.get_mut(number) {
                still.passed = None;
                if may_pass && stand_still(signals) {
                    still.pass(simd, filters, &signals[0]);
                    continue;
                }
            }
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

/// Eight states that decay by themselves, or 0: looked at once in a block, in which none decays from there to numbers
/// that make processors slow.
#[inline(always)]
fn stored<S: Simd>(states: f64x8<S>) -> Lanes {
    Lanes::from(states).map(unless_faded)
}

/// Whether eight signals are the same at all samples: most that move do so at once.
#[inline(always)]
fn stand_still(signals: &[Lanes]) -> bool {
    let first = &signals[0];
    let others = |lanes: &Lanes| (0..LANES).filter(|i| lanes[*i] != first[*i]).count();
    others(&signals[1]) == 0 && signals[2..].iter().map(others).sum::<usize>() == 0
}

/// The work of [`FilterLanes::row`].
struct ReadRow<'a> {
    still: &'a [Still],
    sample: usize,
    readings: &'a [Lanes],
    row: &'a mut [Lanes],
}

impl SimdLoop for ReadRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for (number, place) in self.row.iter_mut().enumerate() {
            let passed = self.still.get(number).and_then(|still| Some((still, still.passed.as_ref()?)));
            *place = match passed {
                Some((still, signals)) => still.read(simd, signals, self.sample).into(),
                None => self.readings[number * BLOCK + self.sample],
            };
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
            states[j] = stored(q[j]);
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
fn hold<S: Simd, const FIRST: bool>(simd: S, mode: &mut ModeLanes, position: &Lanes, p: &[Lanes], y: &mut [Lanes]) {
    let [xx, xv, vx, vv] = load_all(simd, [&mode.xx, &mode.xv, &mode.vx, &mode.vv]);
    let [read_x, read_v, position] = load_all(simd, [&mode.read_x, &mode.read_v, position]);
    let [mut deviation, mut v, mut before] = load_all(simd, [&mode.deviation, &mode.v, &mode.before]);
    for (p, y) in p.iter().zip(y) {
        let p = load(simd, p);
        let moved = xv.mul_add(v, before - p);
        v = vv.mul_add(v, vx * deviation);
        deviation = xx.mul_add(deviation, moved);
        before = p;
        let from = if FIRST { position * p } else { load(simd, y) };
        *y = read_x.mul_add(deviation, read_v.mul_add(v, from)).into();
    }
    mode.deviation = stored(deviation);
    mode.v = stored(v);
    mode.before = before.into();
}

/// As [`hold`] behind an amplifier: the input goes from the last p to this one by the end of the interval. The state
/// holds what does not decay with the input.
#[inline(always)]
fn lead<S: Simd, const FIRST: bool>(simd: S, mode: &mut ModeLanes, position: &Lanes, p: &[Lanes], y: &mut [Lanes]) {
    let Some(amplifier) = &mut mode.amplifier else { return };
    let [xx, xv, vx, vv] = load_all(simd, [&mode.xx, &mode.xv, &mode.vx, &mode.vv]);
    let [read_x, read_v, position] = load_all(simd, [&mode.read_x, &mode.read_v, position]);
    let AmplifierLanes { reach, step, start_x, start_v, read, ends, decaying } = &**amplifier;
    let [reach, step, start_x, start_v, read] = load_all(simd, [reach, step, start_x, start_v, read]);
    let [mut deviation, mut v, mut before] = load_all(simd, [&mode.deviation, &mode.v, &mode.before]);
    let [mut ends, mut decaying] = load_all(simd, [ends, decaying]);
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
    mode.deviation = stored(deviation);
    mode.v = stored(v);
    mode.before = before.into();
    amplifier.ends = ends.into();
    amplifier.decaying = decaying.into();
}

#[cfg(test)]
mod tests {
    use hysteresis_control::linear::{Dynamics, FirstOrder, SecondOrder};

    use crate::fit::response::through;
    use crate::terms::dynamics::{LinearPart, Mode};

    use super::*;

    const DT: f64 = 1e-4;

    /// It moves, then stands still for some blocks, twice.
    fn signal() -> Vec<f64> {
        let moving = |k: u32| 2.0 + (f64::from(k * k) / 7.0).sin() * f64::from(k % 11);
        let way = |from: u32| (from..from + 100).map(moving).chain(std::iter::repeat_n(moving(from), 150));
        way(0).chain(way(100)).collect()
    }

    fn parts() -> Vec<LinearPart> {
        let lag: Dynamics = FirstOrder::new(279.0).unwrap().into();
        let resonance: Dynamics = SecondOrder::new(800.0, 0.02).unwrap().into();
        let beside = Mode { frequency: 1300.0, damping: 0.1, gain: 0.2 };
        let creep = LinearPart {
            amplitudes: vec![0.02, 0.1, 0.03, 0.01, 0.04],
            time_constants: vec![4e-4, 3e-3, 1e-2, 0.1, 1.0],
            dead_time: 0.65e-4,
            ..LinearPart::default()
        };
        let all =
            [(None, None, 0), (Some(lag), None, 0), (Some(resonance), None, 1), (Some(resonance), Some(400.0), 1)];
        let with = |(dynamics, bandwidth, further)| LinearPart {
            dynamics,
            bandwidth,
            further: vec![beside; further],
            ..creep.clone()
        };
        all.into_iter().map(with).collect()
    }

    /// The readings of a few lanes from the sample that acts on the first one, or what is read at rest.
    fn readings(part: &LinearPart, blocks: usize, passes: bool, lanes: &[(f64, Reading)]) -> Vec<Vec<f64>> {
        let sampled = SampledPart::new(part, DT);
        let lane = |(direct, reading): &(f64, Reading)| Lane {
            direct: *direct,
            amplitudes: &part.amplitudes,
            part: &sampled,
            reading: *reading,
        };
        let plain = FilterLanes::new(&sampled.decays, &lanes.iter().map(lane).collect::<Vec<_>>());
        let mut filters = if passes { plain.passing_still_blocks() } else { plain };
        let eights = lanes.len().div_ceil(LANES);
        let mut row = vec![[0.0; LANES]; eights];
        let (mut signals, mut out) = (vec![[0.0; LANES]; eights * BLOCK], vec![[0.0; LANES]; eights * BLOCK]);
        let (mut all, mut rest) = (vec![Vec::new(); lanes.len()], Vec::new());
        for block in signal().chunks(blocks) {
            for lanes in signals.chunks_exact_mut(BLOCK) {
                lanes.iter_mut().zip(block).for_each(|(lanes, value)| *lanes = [*value; LANES]);
            }
            filters.put_out(block.len(), &signals, &mut out);
            if rest.is_empty() {
                rest = (0..lanes.len()).map(|lane| filters.at_rest(lane)).collect();
            }
            for k in 0..block.len() {
                filters.row(k, &out, &mut row);
                for (lane, all) in all.iter_mut().enumerate() {
                    all.push(row[lane / LANES][lane % LANES]);
                }
            }
        }
        let read = |(all, rest): (&Vec<f64>, &f64)| {
            (0..signal().len()).map(|k| sampled.source(k).map_or(*rest, |source| all[source])).collect()
        };
        all.iter().zip(&rest).map(read).collect()
    }

    /// Every lane is what the plain loop makes of its signal, whatever the blocks and the lanes beside it.
    #[test]
    fn equals_the_plain_loop() {
        for part in parts() {
            let want = through(&part, &signal(), DT);
            for (lanes, blocks, passes) in [(1, BLOCK, false), (10, 7, false), (8, 1, true), (10, BLOCK, true)] {
                let all = readings(&part, blocks, passes, &vec![(1.0, Reading::Position); lanes]);
                for (lane, got) in all.iter().enumerate() {
                    for (k, (got, want)) in got.iter().zip(&want).enumerate() {
                        assert!((got - want).abs() < 1e-12, "{part:?} lane {lane} sample {k}: {got} {want}");
                    }
                }
            }
        }
    }

    /// A lane without the signal itself is what creep adds.
    #[test]
    fn creep_alone_is_the_rest() {
        for part in parts() {
            let got = readings(&part, BLOCK, true, &[(0.0, Reading::Position)]);
            let without = LinearPart { amplitudes: vec![0.0; 5], ..part.clone() };
            let (whole, without) = (through(&part, &signal(), DT), through(&without, &signal(), DT));
            for (got, (whole, without)) in got[0].iter().zip(whole.iter().zip(without)) {
                assert!((got - (whole - without)).abs() < 1e-12, "{got} {whole} {without}");
            }
        }
    }

    #[test]
    fn the_slope_over_the_dead_time_is_a_difference() {
        for part in parts() {
            let got = &readings(&part, BLOCK, true, &[(1.0, Reading::Position), (1.0, Reading::OverDeadTime(DT))])[1];
            let at = |dead_time| through(&LinearPart { dead_time, ..part.clone() }, &signal(), DT);
            let (sooner, later) = (at(part.dead_time - 1e-9), at(part.dead_time + 1e-9));
            for (k, (got, (sooner, later))) in got.iter().zip(sooner.iter().zip(later)).enumerate() {
                let slope = (later - sooner) / 2e-9;
                assert!((got - slope).abs() < 1e-4 * slope.abs().max(1e3), "{part:?} {k}: {got} {slope}");
            }
        }
    }

    #[test]
    fn at_rest_nothing_moves() {
        for part in parts() {
            let sampled = SampledPart::new(&part, DT);
            let lane = Lane { direct: 1.0, amplitudes: &part.amplitudes, part: &sampled, reading: Reading::Position };
            let mut filters = FilterLanes::new(&sampled.decays, &[lane]);
            let (signals, mut out) = ([[0.3; LANES]; BLOCK], [[0.0; LANES]; BLOCK]);
            filters.put_out(BLOCK, &signals, &mut out);
            assert!(out.iter().all(|y| y[0] == filters.at_rest(0)), "{part:?}");
        }
    }
}
