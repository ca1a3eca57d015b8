//! What is searched: dynamics of blocks of two states, an operator for each q, and the matrices between.

use faer::Mat;
use hysteresis_control::multi_axis::{Matrices, MultiAxisStage};
use nalgebra::DMatrix;

use super::bank::Bank;
use super::data::Data;
use crate::error::Error;

/// A model in units in which every signal has the standard deviation 1. Matrices are rows one after the other.
///
/// A is block-diagonal, blocks of two states with all four numbers: a pair of complex poles can become two real ones
/// and back. That is any A that can be made diagonal, at 2 n numbers instead of n^2.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) states: usize,
    pub(super) drives: usize,
    pub(super) positions: usize,
    /// For each state its own number, and that of the other one of its block.
    pub(super) a: Vec<[f64; 2]>,
    pub(super) b: Vec<f64>,
    pub(super) bw: Vec<f64>,
    pub(super) c: Vec<f64>,
    pub(super) d: Vec<f64>,
    pub(super) offset: Vec<f64>,
    pub(super) cq: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) banks: Vec<Bank>,
}

/// Which numbers are searched, beside B, D, the offsets and the operators.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free {
    /// A and C.
    pub(super) dynamics: bool,
    /// Cq and Dq.
    pub(super) query: bool,
}

impl Point {
    /// Without input: A and C.
    pub(super) fn of_dynamics(a: Vec<[f64; 2]>, c: Vec<f64>, drives: usize, positions: usize) -> Self {
        let states = a.len();
        Self {
            states,
            drives,
            positions,
            a,
            b: vec![0.0; states * drives],
            bw: Vec::new(),
            c,
            d: vec![0.0; positions * drives],
            offset: vec![0.0; positions],
            cq: Vec::new(),
            dq: Vec::new(),
            banks: Vec::new(),
        }
    }

    /// With an operator of each drive, that acts on nothing yet.
    pub(super) fn with_banks(&self, bank: impl Fn(usize) -> Bank) -> Self {
        let (n, m) = (self.states, self.drives);
        let dq = (0..m * m).map(|i| if i / m == i % m { 1.0 } else { 0.0 }).collect();
        let banks = (0..m).map(bank).collect();
        Self { bw: vec![0.0; n * m], cq: vec![0.0; m * n], dq, banks, ..self.clone() }
    }

    /// With an operator for each position, that acts on nothing yet: of the position, or of what a block of states
    /// gives to it.
    pub(super) fn with_queries(&self, block: Option<usize>, bank: impl Fn(usize) -> Bank) -> Self {
        let (n, m, p) = (self.states, self.drives, self.positions);
        let seen = |(place, c): (usize, &f64)| if block.is_none_or(|block| place % n / 2 == block) { *c } else { 0.0 };
        let c: Vec<f64> = self.c.iter().enumerate().map(seen).collect();
        // w is held for an interval, so it sees the middle of it.
        let cq = (0..p * n).map(|place| {
            let (i, j) = (place / n, place % n);
            let other = self.partner(j);
            let across = if other == j { 0.0 } else { c[i * n + other] * self.a_of(other)[1] };
            0.5 * (c[place] + c[place] * self.a_of(j)[0] + across)
        });
        let dq = (0..p * m).map(|place| {
            let (i, j) = (place / m, place % m);
            let at_once = if block.is_none() { self.d[place] } else { 0.0 };
            at_once + 0.5 * (0..n).map(|k| c[i * n + k] * self.b[k * m + j]).sum::<f64>()
        });
        let banks = (0..p).map(bank).collect();
        Self { bw: vec![0.0; n * p], cq: cq.collect(), dq: dq.collect(), banks, ..self.clone() }
    }

    /// The other state of a block; itself if it is alone.
    pub(super) fn partner(&self, state: usize) -> usize {
        let other = state ^ 1;
        if other < self.states { other } else { state }
    }

    pub(super) fn a_of(&self, state: usize) -> [f64; 2] {
        // A state that is alone has no other.
        if self.partner(state) == state { [self.a[state][0], 0.0] } else { self.a[state] }
    }

    /// Whether all operators stand in front of the dynamics.
    pub(super) fn is_in_front(&self) -> bool {
        self.cq.iter().all(|entry| *entry == 0.0)
    }

    /// The searched numbers, in the order of `columns` in `pass`.
    pub(super) fn numbers_mut(&mut self, free: Free) -> Vec<&mut f64> {
        let (n, m, h) = (self.states, self.drives, self.banks.len());
        let mut all = Vec::new();
        let lone = (0..n).map(|i| self.partner(i) == i).collect::<Vec<_>>();
        let mut b = self.b.chunks_exact_mut(m);
        let mut bw = self.bw.chunks_exact_mut(h.max(1));
        for (a, lone) in self.a.iter_mut().zip(lone) {
            if free.dynamics {
                let count = if lone { 1 } else { 2 };
                all.extend(a.iter_mut().take(count));
            }
            all.extend(b.next().into_iter().flatten());
            all.extend(bw.next().into_iter().flatten());
        }
        if free.query {
            for (cq, dq) in self.cq.chunks_exact_mut(n).zip(self.dq.chunks_exact_mut(m)) {
                all.extend(cq);
                all.extend(dq);
            }
        }
        all.extend(self.banks.iter_mut().flat_map(Bank::numbers_mut));
        if free.dynamics {
            all.extend(&mut self.c);
        }
        all.extend(&mut self.d);
        all.extend(&mut self.offset);
        all
    }

    /// The point a step away, with numbers that operators can have.
    pub(super) fn moved(&self, free: Free, step: &[f64]) -> Self {
        let mut there = self.clone();
        there.numbers_mut(free).into_iter().zip(step).for_each(|(number, step)| *number += step);
        there.banks.iter_mut().for_each(Bank::clamp);
        there
    }

    /// Whether the dynamics are stable without the operators.
    pub(super) fn is_stable(&self) -> bool {
        (0..self.states).step_by(2).all(|i| {
            if self.partner(i) == i {
                return self.a[i][0].abs() < 1.0;
            }
            let ([a, b], [d, c]) = (self.a[i], self.a[i + 1]);
            let (trace, determinant) = (a + d, a * d - b * c);
            determinant.abs() < 1.0 && trace.abs() < 1.0 + determinant
        })
    }

    /// What each operator of the stage takes times its q, to have that of this point: q in front has the unit of its
    /// drive, which is what thresholds are read in.
    pub(super) fn operator_gains(&self, data: &Data) -> Vec<f64> {
        let gain = |i: usize| if self.is_in_front() { 1.0 / data.drive_scale[i] } else { 1.0 };
        (0..self.banks.len()).map(gain).collect()
    }

    /// The stage in the units of the records. None if an operator is one that no stage has.
    pub(super) fn stage(&self, data: &Data, dt: f64) -> Result<Option<MultiAxisStage>, Error> {
        let (n, m, p, h) = (self.states, self.drives, self.positions, self.banks.len());
        let (u, y) = (&data.drive_scale, &data.position_scale);
        let gains = self.operator_gains(data);
        let mut operators = Vec::with_capacity(h);
        for (i, bank) in self.banks.iter().enumerate() {
            let Some(operator) = bank.operator(gains[i])? else { return Ok(None) };
            operators.push(operator);
        }
        let mut a = DMatrix::zeros(n, n);
        for i in 0..n {
            let [own, other] = self.a_of(i);
            a[(i, self.partner(i))] += other;
            a[(i, i)] += own;
        }
        let matrices = Matrices {
            a,
            b: DMatrix::from_fn(n, m, |i, j| self.b[i * m + j] / u[j]),
            bw: DMatrix::from_fn(n, h, |i, j| self.bw[i * h + j]),
            c: DMatrix::from_fn(p, n, |i, j| self.c[i * n + j] * y[i]),
            d: DMatrix::from_fn(p, m, |i, j| self.d[i * m + j] * y[i] / u[j]),
            cq: DMatrix::from_fn(h, n, |i, j| self.cq[i * n + j] / gains[i]),
            dq: DMatrix::from_fn(h, m, |i, j| self.dq[i * m + j] / u[j] / gains[i]),
        };
        let offset = (0..p).map(|i| self.offset[i] * y[i] + data.position_mean[i]).collect();
        Ok(Some(MultiAxisStage::new(matrices, operators, offset, dt)?))
    }
}

/// The real blocks of a matrix that can be made diagonal, and C in their states; poles outside the unit circle are
/// mirrored into it.
pub(super) fn blocks(a: &Mat<f64>, c: &Mat<f64>) -> Option<(Vec<[f64; 2]>, Vec<f64>)> {
    /// No pole is nearer to the unit circle.
    const NEAREST: f64 = 0.9999;
    let eigen = a.eigen().ok()?;
    let (vectors, values) = (eigen.U(), eigen.S().column_vector());
    let n = a.nrows();
    let mut order: Vec<usize> = (0..n).filter(|i| values[*i].im > 0.0).collect();
    let pairs = order.len();
    order.extend((0..n).filter(|i| values[*i].im == 0.0));
    let (mut blocks, mut columns) = (Vec::new(), Vec::new());
    for (place, i) in order.into_iter().enumerate() {
        let value = values[i];
        let size = value.re.hypot(value.im);
        let to = if size > 1.0 { 1.0 / size } else { size }.min(NEAREST);
        let (re, im) = if size > 0.0 { (value.re * to / size, value.im * to / size) } else { (0.0, 0.0) };
        columns.push((0..n).map(|k| vectors[(k, i)].re).collect::<Vec<f64>>());
        if place < pairs {
            blocks.extend([[re, im], [re, -im]]);
            columns.push((0..n).map(|k| vectors[(k, i)].im).collect());
        } else {
            blocks.push([re, 0.0]);
        }
    }
    if columns.len() != n {
        return None;
    }
    let seen = (0..c.nrows()).flat_map(|i| columns.iter().map(move |column| (i, column)));
    let c: Vec<f64> = seen.map(|(i, column)| (0..n).map(|k| c[(i, k)] * column[k]).sum()).collect();
    c.iter().all(|entry: &f64| entry.is_finite()).then_some((blocks, c))
}
