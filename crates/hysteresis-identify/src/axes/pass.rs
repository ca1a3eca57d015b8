//! One pass over the records: what a point misses, and its normal equations by forward tangents.
//!
//! The tangent of a number is a run of the same dynamics with the slopes of the operators, driven where the number
//! stands by the signal that it multiplies. Eight numbers run at once; blocks of samples keep what is held small.

use std::ops::Range;

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, Par};
use fearless_simd::{Simd, SimdFloat, f64x8};

use super::bank::{Bank, BankStream, Follows};
use super::data::{Data, Stretch};
use super::point::{Free, Point};
use crate::algebra::eight::{LANES, Lanes, SimdLoop, dispatch, load, splat};
use crate::fit::colour::{Autoregression, RowFilter};
use crate::threads;

/// Samples in a block.
const BLOCK: usize = 256;

/// A position beyond this, in standard deviations, has left all bounds.
const LARGEST: f64 = 1e6;

/// Where a number acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    /// The next of a state.
    State(usize),
    /// A q.
    Query(usize),
    /// A w.
    Output(usize),
    /// The memory of an operator, by its place among all memories.
    Memory(usize),
    /// A position, at once and nothing else.
    Position(usize),
}

/// The place of the signals of a sample in a row: x, u, 1, w, and the derivatives by the numbers of the operators.
struct Signals {
    drives: usize,
    one: usize,
    outputs: usize,
    parameters: usize,
    width: usize,
}

impl Signals {
    fn new(point: &Point) -> Self {
        let one = point.states + point.drives;
        let parameters = one + 1 + point.banks.len();
        let width = parameters + point.banks.iter().map(|bank| bank.numbers().len()).sum::<usize>();
        Self { drives: point.states, one, outputs: one + 1, parameters, width }
    }
}

/// Where each searched number acts, and the signal that it multiplies: in the order of [`Point::numbers_mut`].
fn columns(point: &Point, free: Free) -> Vec<(Target, usize)> {
    let (n, m, h, signals) = (point.states, point.drives, point.banks.len(), Signals::new(point));
    let mut all = Vec::new();
    for i in 0..n {
        if free.dynamics {
            all.push((Target::State(i), i));
            if point.partner(i) != i {
                all.push((Target::State(i), point.partner(i)));
            }
        }
        all.extend((0..m).map(|j| (Target::State(i), signals.drives + j)));
        all.extend((0..h).map(|j| (Target::State(i), signals.outputs + j)));
    }
    if free.query {
        for i in 0..h {
            all.extend((0..n + m).map(|j| (Target::Query(i), j)));
        }
    }
    let (mut place, mut memory) = (signals.parameters, 0);
    for (i, bank) in point.banks.iter().enumerate() {
        let target = if bank.acts_on_memory() { Target::Memory(memory) } else { Target::Output(i) };
        all.extend((place..place + bank.numbers().len()).map(|signal| (target, signal)));
        place += bank.numbers().len();
        memory += bank.elements();
    }
    let at_once = |sources: Range<usize>| {
        (0..point.positions).flat_map(move |i| sources.clone().map(move |j| (Target::Position(i), j)))
    };
    if free.dynamics {
        all.extend(at_once(0..n));
    }
    all.extend(at_once(signals.drives..signals.one));
    all.extend(at_once(signals.one..signals.one + 1));
    all
}

fn dot(p: &[f64], q: &[f64]) -> f64 {
    p.iter().zip(q).map(|(p, q)| p * q).sum()
}

/// A point that runs through a record.
struct Runner<'a> {
    point: &'a Point,
    signals: Signals,
    banks: Vec<BankStream>,
    x: Vec<f64>,
    next: Vec<f64>,
}

impl<'a> Runner<'a> {
    fn new(point: &'a Point) -> Option<Self> {
        let banks = point.banks.iter().map(|bank| bank.stream().ok()).collect::<Option<_>>()?;
        let zeros = vec![0.0; point.states];
        Some(Self { point, signals: Signals::new(point), banks, x: zeros.clone(), next: zeros })
    }

    /// Writes the signals, how memories follow and the positions, and moves on. False if the motion leaves all bounds.
    fn step(&mut self, u: &[f64], row: &mut [f64], follows: &mut [Follows], y: &mut [f64]) -> bool {
        let (point, signals) = (self.point, &self.signals);
        let (n, m, h) = (point.states, point.drives, self.banks.len());
        row[..n].copy_from_slice(&self.x);
        row[n..n + m].copy_from_slice(u);
        row[signals.one] = 1.0;
        let (seen, rest) = row.split_at_mut(signals.one);
        let (mut place, mut memory) = (signals.parameters - signals.one, 0);
        for (i, bank) in self.banks.iter_mut().enumerate() {
            let q = dot(&point.cq[i * n..][..n], &seen[..n]) + dot(&point.dq[i * m..][..m], u);
            let (count, elements) = (point.banks[i].numbers().len(), point.banks[i].elements());
            rest[1 + i] = bank.step(q, &mut rest[place..place + count], &mut follows[memory..memory + elements]);
            place += count;
            memory += elements;
        }
        for (i, y) in y.iter_mut().enumerate() {
            *y = dot(&point.c[i * n..][..n], &seen[..n]) + dot(&point.d[i * m..][..m], u) + point.offset[i];
        }
        for (i, next) in self.next.iter_mut().enumerate() {
            let [own, other] = point.a_of(i);
            *next = own * seen[i]
                + other * seen[point.partner(i)]
                + dot(&point.b[i * m..][..m], u)
                + dot(&point.bw[i * h..][..h], &rest[1..]);
        }
        std::mem::swap(&mut self.x, &mut self.next);
        y.iter().all(|y| y.abs() < LARGEST)
    }
}

/// What a point misses: of each sample that counts, all positions in turn. None if the motion leaves all bounds.
pub(super) fn residuals(point: &Point, data: &Data, (record, range): &Stretch) -> Option<Vec<f64>> {
    let mut runner = Runner::new(point)?;
    let (u, y) = &data.records[*record];
    let (m, p) = (data.drives, data.positions);
    let mut row = vec![0.0; runner.signals.width];
    let mut follows = vec![[0.0; 3]; point.banks.iter().map(Bank::elements).sum()];
    let (mut position, mut all) = (vec![0.0; p], Vec::with_capacity(range.len() * p));
    for (k, (u, y)) in u.chunks_exact(m).zip(y.chunks_exact(p)).enumerate().take(range.end) {
        if !runner.step(u, &mut row, &mut follows, &mut position) {
            return None;
        }
        if k >= range.start {
            all.extend(y.iter().zip(&position).map(|(y, position)| y - position));
        }
    }
    Some(all)
}

/// All stretches in turn, each on a thread that is free. None where the work of one of them is.
fn shared<T: Send>(stretches: &[Stretch], work: impl Fn(&Stretch) -> Option<T> + Sync) -> Option<Vec<T>> {
    threads::all(threads::processors(), stretches.len(), |i| work(&stretches[i]))?.into_iter().collect()
}

/// What is missed of all stretches, one after the other.
pub(super) fn missed(point: &Point, data: &Data, stretches: &[Stretch]) -> Option<Vec<Vec<f64>>> {
    shared(stretches, |stretch| residuals(point, data, stretch))
}

/// The largest magnitude of each q.
pub(super) fn reaches(point: &Point, data: &Data, stretches: &[Stretch]) -> Option<Vec<f64>> {
    let (n, m) = (point.states, point.drives);
    let mut most = vec![0.0_f64; point.banks.len()];
    for (record, range) in stretches {
        let mut runner = Runner::new(point)?;
        let mut row = vec![0.0; runner.signals.width];
        let mut follows = vec![[0.0; 3]; point.banks.iter().map(Bank::elements).sum()];
        let mut position = vec![0.0; data.positions];
        for u in data.records[*record].0.chunks_exact(m).take(range.end) {
            if !runner.step(u, &mut row, &mut follows, &mut position) {
                return None;
            }
            for (i, most) in most.iter_mut().enumerate() {
                let q = dot(&point.cq[i * n..][..n], &row[..n]) + dot(&point.dq[i * m..][..m], u);
                // z of a Duhem operator is what its knots must cover.
                let z = if point.banks[i].acts_on_memory() { row[runner.signals.outputs + i] } else { q };
                *most = most.max(z.abs());
            }
        }
    }
    Some(most)
}

/// J'J and J'r, with the sum of r^2.
#[derive(Clone)]
pub(super) struct Normal {
    /// Its lower triangle.
    pub(super) matrix: Mat<f64>,
    pub(super) vector: Vec<f64>,
    pub(super) squares: f64,
}

/// The normal equations of a point. None if the motion leaves all bounds.
pub(super) fn linearise(point: &Point, data: &Data, stretches: &[Stretch], free: Free) -> Option<Normal> {
    coloured(point, data, stretches, free, &[])
}

/// The same with the derivatives of each position behind the filter of its noise, so that J'J is J' Omega J of the
/// plain ones.
pub(super) fn coloured(
    point: &Point,
    data: &Data,
    stretches: &[Stretch],
    free: Free,
    colours: &[Autoregression],
) -> Option<Normal> {
    let columns = columns(point, free);
    let mut parts = shared(stretches, |stretch| of_stretch(point, data, stretch, (&columns, colours)))?.into_iter();
    let mut sum = parts.next()?;
    for part in parts {
        sum.matrix += &part.matrix;
        sum.vector.iter_mut().zip(part.vector).for_each(|(sum, part)| *sum += part);
        sum.squares += part.squares;
    }
    Some(sum)
}

fn of_stretch(
    point: &Point,
    data: &Data,
    (record, range): &Stretch,
    (columns, colours): (&[(Target, usize)], &[Autoregression]),
) -> Option<Normal> {
    let (u, y) = &data.records[*record];
    let mut filters: Vec<_> = colours.iter().map(|colour| RowFilter::new(colour, columns.len())).collect();
    let (m, p, count) = (data.drives, data.positions, columns.len());
    let mut runner = Runner::new(point)?;
    let mut groups: Vec<Group> = groups(point, columns);
    let width = runner.signals.width;
    let memories = point.banks.iter().map(Bank::elements).sum::<usize>();
    let coefficients = Coefficients::new(point);
    let (mut rows, mut follows) = (vec![0.0; BLOCK * width], vec![[0.0; 3]; BLOCK * memories]);
    let (mut position, mut out) = (vec![0.0; p], vec![[0.0; LANES]; BLOCK * p]);
    let mut sum = Normal { matrix: Mat::zeros(count, count), vector: vec![0.0; count], squares: 0.0 };
    for first in (0..range.end).step_by(BLOCK) {
        let samples = BLOCK.min(range.end - first);
        let mut residual = Vec::with_capacity(samples * p);
        for k in 0..samples {
            let row = &mut rows[k * width..][..width];
            let follows = &mut follows[k * memories..][..memories];
            if !runner.step(&u[(first + k) * m..][..m], row, follows, &mut position) {
                return None;
            }
            residual.extend(y[(first + k) * p..][..p].iter().zip(&position).map(|(y, position)| y - position));
        }
        let behind = range.start.saturating_sub(first).min(samples);
        let mut jacobian = Mat::zeros((samples - behind) * p, count);
        for (j, (target, source)) in columns.iter().enumerate() {
            if let Target::Position(i) = target {
                for k in behind..samples {
                    jacobian[((k - behind) * p + i, j)] = rows[k * width + source];
                }
            }
        }
        for group in &mut groups {
            dispatch(Sweep {
                coefficients: &coefficients,
                rows: &rows[..samples * width],
                follows: &follows[..samples * memories],
                width,
                group,
                out: &mut out[..samples * p],
            });
            for (lane, j) in group.columns.clone().enumerate() {
                let column = jacobian.col_as_slice_mut(j);
                column.iter_mut().zip(&out[behind * p..]).for_each(|(entry, lanes)| *entry = lanes[lane]);
            }
        }
        filter_rows(&mut jacobian, &mut filters);
        let residual = &residual[behind * p..];
        for (j, sum) in sum.vector.iter_mut().enumerate() {
            *sum += jacobian.col_as_slice(j).iter().zip(residual).map(|(j, r)| j * r).sum::<f64>();
        }
        sum.squares += residual.iter().map(|r| r * r).sum::<f64>();
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        let (transposed, jacobian) = (jacobian.transpose(), jacobian.as_ref());
        matmul(sum.matrix.as_mut(), lower, Accum::Add, transposed, whole, jacobian, whole, 1.0, Par::Seq);
    }
    sum.squares.is_finite().then_some(sum)
}

/// Every row goes through the filter of its position; none if there are none.
fn filter_rows(rows: &mut Mat<f64>, filters: &mut [RowFilter<'_>]) {
    let mut row = vec![0.0; rows.ncols()];
    for i in 0..rows.nrows().min(rows.nrows() * filters.len()) {
        row.iter_mut().enumerate().for_each(|(j, entry)| *entry = rows[(i, j)]);
        let position = i % filters.len();
        filters[position].coloured(&row).iter().enumerate().for_each(|(j, entry)| rows[(i, j)] = *entry);
    }
}

/// Eight tangents.
struct Group {
    columns: Range<usize>,
    states: Vec<Lanes>,
    next: Vec<Lanes>,
    memories: Vec<Lanes>,
    /// The last q of each operator.
    queries: Vec<Lanes>,
    /// Where its numbers act: the signals of all eight, and 1 for those that act here.
    acts: Vec<(Target, [usize; LANES], Lanes)>,
}

fn groups(point: &Point, columns: &[(Target, usize)]) -> Vec<Group> {
    let memories = point.banks.iter().map(Bank::elements).sum();
    let running = columns.iter().filter(|(target, _)| !matches!(target, Target::Position(_))).count();
    let group = |first: usize| {
        let columns = &columns[first..running.min(first + LANES)];
        let mut acts: Vec<(Target, [usize; LANES], Lanes)> = Vec::new();
        for (lane, (target, source)) in columns.iter().enumerate() {
            if acts.last().is_none_or(|last| last.0 != *target) {
                acts.push((*target, [0; LANES], [0.0; LANES]));
            }
            if let Some((_, sources, mask)) = acts.last_mut() {
                (sources[lane], mask[lane]) = (*source, 1.0);
            }
        }
        let states = vec![[0.0; LANES]; point.states];
        let next = states.clone();
        Group {
            columns: first..first + columns.len(),
            states,
            next,
            memories: vec![[0.0; LANES]; memories],
            queries: vec![[0.0; LANES]; point.banks.len()],
            acts,
        }
    };
    // Those that act at once come last.
    (0..running).step_by(LANES).map(group).collect()
}

/// What the tangents run with, laid out for them.
struct Coefficients {
    /// For each state its own number, that of its partner, and its place.
    a: Vec<([f64; 2], usize)>,
    bw: Vec<f64>,
    c: Vec<f64>,
    cq: Vec<f64>,
    positions: usize,
    /// Of each operator the weights of its memories.
    weights: Vec<Vec<f64>>,
}

impl Coefficients {
    fn new(point: &Point) -> Self {
        Self {
            a: (0..point.states).map(|i| (point.a_of(i), point.partner(i))).collect(),
            bw: point.bw.clone(),
            c: point.c.clone(),
            cq: if point.is_in_front() { Vec::new() } else { point.cq.clone() },
            positions: point.positions,
            weights: point.banks.iter().map(|bank| bank.weights().to_vec()).collect(),
        }
    }
}

/// Runs eight tangents through a block of samples.
struct Sweep<'a> {
    coefficients: &'a Coefficients,
    rows: &'a [f64],
    follows: &'a [Follows],
    width: usize,
    group: &'a mut Group,
    out: &'a mut [Lanes],
}

/// The sum of numbers times eights.
#[inline(always)]
fn product<S: Simd>(simd: S, numbers: &[f64], eights: &[Lanes]) -> f64x8<S> {
    let mut sums = [splat(simd, 0.0); 2];
    let (pairs, rest) = numbers.as_chunks::<2>();
    let (eight_pairs, eight_rest) = eights.as_chunks::<2>();
    for ([p, q], [one, other]) in pairs.iter().zip(eight_pairs) {
        sums[0] = splat(simd, *p).mul_add(load(simd, one), sums[0]);
        sums[1] = splat(simd, *q).mul_add(load(simd, other), sums[1]);
    }
    for (number, eight) in rest.iter().zip(eight_rest) {
        sums[0] = splat(simd, *number).mul_add(load(simd, eight), sums[0]);
    }
    sums[0] + sums[1]
}

impl SimdLoop for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { coefficients, rows, follows, width, group, out } = self;
        let Group { states, next, memories, queries, acts, .. } = group;
        let (n, p, h, count) = (states.len(), coefficients.positions, coefficients.weights.len(), memories.len());
        let mut outputs = vec![[0.0; LANES]; h];
        for (k, (row, out)) in rows.chunks_exact(width).zip(out.chunks_exact_mut(p)).enumerate() {
            for (c, out) in coefficients.c.chunks_exact(n).zip(out) {
                *out = product(simd, c, states).into();
            }
            let follows = &follows[k * count..][..count];
            let act = |at: Target, value: f64x8<S>| {
                let mut value = value;
                for (target, sources, mask) in &*acts {
                    if *target == at {
                        value = load(simd, &sources.map(|source| row[source])).mul_add(load(simd, mask), value);
                    }
                }
                value
            };
            let mut place = 0;
            for (i, (weights, w)) in coefficients.weights.iter().zip(&mut outputs).enumerate() {
                let seen = coefficients.cq.get(i * n..(i + 1) * n);
                let query = seen.map_or(splat(simd, 0.0), |cq| product(simd, cq, states));
                let query = act(Target::Query(i), query);
                let mut sum = act(Target::Output(i), splat(simd, 0.0));
                for (weight, [past, now, earlier]) in weights.iter().zip(&follows[place..]) {
                    let before = load(simd, &memories[place]) * splat(simd, *past);
                    let before = splat(simd, *earlier).mul_add(load(simd, &queries[i]), before);
                    let here = act(Target::Memory(place), splat(simd, *now).mul_add(query, before));
                    memories[place] = here.into();
                    sum = splat(simd, *weight).mul_add(here, sum);
                    place += 1;
                }
                queries[i] = query.into();
                *w = sum.into();
            }
            for (i, ([own, other], partner)) in coefficients.a.iter().enumerate() {
                let own = splat(simd, *own) * load(simd, &states[i]);
                let dynamics = splat(simd, *other).mul_add(load(simd, &states[*partner]), own);
                let sum = dynamics + product(simd, &coefficients.bw[i * h..][..h], &outputs);
                next[i] = sum.into();
            }
            for (target, sources, mask) in &*acts {
                if let Target::State(i) = target {
                    let signals = load(simd, &sources.map(|source| row[source]));
                    next[*i] = signals.mul_add(load(simd, mask), load(simd, &next[*i])).into();
                }
            }
            std::mem::swap(states, next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bank::Kind;
    use super::super::data::AxesRecord;
    use super::*;

    /// Two drives, two positions, three states, an operator of each kind but one.
    fn point(kind: Kind) -> Point {
        let c = vec![1.0, 0.2, 0.3, -0.1, 0.9, 0.5];
        let mut point = Point::of_dynamics(vec![[0.7, 0.4], [0.6, -0.3], [0.5, 0.0]], c, 2, 2);
        point = point.with_banks(|i| Bank::new(kind, if i == 0 { 3 } else { 4 }, 2.5));
        point.b = vec![0.3, 0.1, 0.0, 0.4, 0.2, -0.2];
        point.bw = vec![0.1, 0.05, -0.1, 0.1, 0.05, 0.1];
        point.cq = vec![0.3, -0.2, 0.1, 0.1, 0.2, 0.0];
        point
    }

    fn data() -> Data {
        let mut seed = 5_u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1_u32 << 24) - 0.5
        };
        // Slow enough that moves are short beside the knots.
        let mut u = vec![0.0; 2 * 700];
        for k in 2..u.len() {
            u[k] = 0.97 * u[k - 2] + 0.2 * random();
        }
        let y: Vec<f64> = (0..u.len()).map(|_| random()).collect();
        Data::new(&[AxesRecord { u: &u, y: &y }], 2, 2, 3).unwrap()
    }

    #[test]
    fn tangents_are_those_of_differences() {
        let (data, free) = (data(), Free { dynamics: true, query: true });
        let cases =
            [(Kind::Plays, 2.5, 1e-6), (Kind::Curve, 2.5, 1e-6), (Kind::Duhem, 2.5, 1e-3), (Kind::Duhem, 0.5, 1e-2)];
        for (kind, reach, tolerance) in cases {
            let mut point = point(kind);
            // Also where z is beyond the knots most of the time.
            for bank in &mut point.banks {
                *bank = Bank::new(kind, bank.numbers().len() / if kind == Kind::Duhem { 2 } else { 1 }, reach);
            }
            let stretch = (0, 5..700);
            let found = linearise(&point, &data, std::slice::from_ref(&stretch), free).unwrap();
            let before = residuals(&point, &data, &stretch).unwrap();
            let count = found.vector.len();
            assert_eq!(point.clone().numbers_mut(free).len(), count);
            let columns: Vec<Vec<f64>> = (0..count)
                .map(|j| {
                    let at = |by: f64| {
                        let step: Vec<f64> = (0..count).map(|i| if i == j { by } else { 0.0 }).collect();
                        residuals(&point.moved(free, &step), &data, &stretch).unwrap()
                    };
                    at(-1e-6).iter().zip(at(1e-6)).map(|(less, more)| (less - more) / 2e-6).collect()
                })
                .collect();
            for j in 0..count {
                let size = dot(&columns[j], &columns[j]).sqrt();
                for i in j..count {
                    let other = dot(&columns[i], &columns[i]).sqrt();
                    let (got, want) = (found.matrix[(i, j)], dot(&columns[i], &columns[j]));
                    assert!((got - want).abs() <= tolerance * size * other, "{kind:?} {i} {j} {got} {want}");
                }
                let (got, want) = (found.vector[j], dot(&columns[j], &before));
                assert!((got - want).abs() <= tolerance * size * dot(&before, &before).sqrt(), "{j} {got} {want}");
            }
        }
    }

    #[test]
    fn the_stage_does_what_the_point_does() {
        use hysteresis_control::multi_axis::MultiAxisForward;
        let data = data();
        for kind in [Kind::Plays, Kind::Duhem] {
            let mut point = point(kind);
            for inside in [true, false] {
                if !inside {
                    point.cq.fill(0.0);
                }
                let stage = point.stage(&data, 1e-3).unwrap().unwrap();
                let residual = residuals(&point, &data, &(0, 0..700)).unwrap();
                let mut forward = MultiAxisForward::new(&stage);
                for (k, (u, y)) in data.records[0].0.chunks(2).zip(data.records[0].1.chunks(2)).enumerate() {
                    let u: Vec<f64> = u.iter().zip(&data.drive_scale).map(|(u, scale)| u * scale).collect();
                    let mut found = [0.0; 2];
                    forward.step(&u, &mut found).unwrap();
                    for i in 0..2 {
                        let scaled = (found[i] - data.position_mean[i]) / data.position_scale[i];
                        assert!((y[i] - scaled - residual[2 * k + i]).abs() < 1e-9, "{kind:?} {k}");
                    }
                }
            }
        }
    }
}
