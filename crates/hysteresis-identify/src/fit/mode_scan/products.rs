//! The products of what many modes change with what a fit leaves, eight modes at once.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use fearless_simd::{Simd, SimdFloat};

use super::Scan;
use crate::fit::bank_lanes::BLOCK;
use crate::fit::eight::{LANES, Lanes, SimdLoop, dispatch, load, splat};
use crate::fit::filter_lanes::{FilterLanes, Lane, Reading};
use crate::fit::linear_part::{LinearPart, Mode, SampledPart};
use crate::numeric::as_f64;

/// So many modes at a time, with the first one, go through a record: what they need stays in the nearest cache.
const MODES: usize = 4 * LANES - 1;

/// For each mode the products of the difference that it makes, which is how far its answer is from that of the first mode.
pub(super) struct Products {
    pub(super) squares: Vec<f64>,
    pub(super) with_residual: Vec<f64>,
    pub(super) with_columns: Vec<Vec<f64>>,
}

impl Products {
    pub(super) fn new(scan: &Scan, modes: &[Mode]) -> Self {
        let columns = vec![Vec::with_capacity(modes.len()); scan.columns.len()];
        let (squares, with_residual) = (Vec::with_capacity(modes.len()), Vec::with_capacity(modes.len()));
        let mut all = Self { squares, with_residual, with_columns: columns };
        for modes in modes.chunks(MODES) {
            all.append(scan, modes);
        }
        all
    }

    fn append(&mut self, scan: &Scan, modes: &[Mode]) {
        let parts: Vec<LinearPart> = std::iter::once(scan.first.clone())
            .chain(modes.iter().map(|mode| LinearPart { dynamics: Some(mode.dynamics()), ..scan.first.clone() }))
            .collect();
        let eights = parts.len().div_ceil(LANES);
        let mut totals = vec![Sums::zero(scan.columns.len()); eights];
        for signals in &scan.signals {
            let sampled: Vec<_> = parts.iter().map(|part| SampledPart::new(part, signals.dt)).collect();
            let lane = |part| Lane { direct: 1.0, amplitudes: &[], part, reading: Reading::FromInput };
            let lanes: Vec<_> = sampled.iter().map(lane).collect();
            let mut filters = FilterLanes::new(&[], &lanes);
            let mut sums = vec![Sums::zero(scan.columns.len()); eights];
            let (mut inputs, mut answers) = (vec![[0.0; LANES]; eights * BLOCK], vec![[0.0; LANES]; eights * BLOCK]);
            // Before the record the modes are at rest; behind its end the last sample is held.
            let sources = signals.samples().map(|sample| sampled[0].source(sample)).zip(signals.rows.clone());
            let mut rows = sources.filter_map(|(source, row)| Some((source?, row))).peekable();
            let (mut taken, last) = (0, signals.input.len() - 1);
            let mut places = Vec::with_capacity(BLOCK);
            while rows.peek().is_some() {
                for block in inputs.chunks_exact_mut(BLOCK) {
                    for (lanes, sample) in block.iter_mut().zip(taken..) {
                        *lanes = [signals.input[sample.min(last)]; LANES];
                    }
                }
                filters.put_out(BLOCK, &inputs, &mut answers);
                places.clear();
                while let Some((source, row)) = rows.next_if(|(source, _)| *source < taken + BLOCK) {
                    places.push((source - taken, row));
                }
                let first: [f64; BLOCK] = std::array::from_fn(|k| answers[k][0]);
                for (sums, answers) in sums.iter_mut().zip(answers.chunks_exact(BLOCK)) {
                    dispatch(Add { scan, sums, answers, first: &first, places: &places });
                }
                taken += BLOCK;
            }
            for (total, sums) in totals.iter_mut().zip(&sums) {
                total.add_centred(sums, as_f64(signals.rows.len()));
            }
        }
        let lanes = |sums: fn(&Sums) -> &Lanes| totals.iter().flat_map(sums).copied().skip(1).take(modes.len());
        self.squares.extend(lanes(|sums| &sums.squares));
        self.with_residual.extend(lanes(|sums| &sums.with_residual));
        for (number, column) in self.with_columns.iter_mut().enumerate() {
            let all = totals.iter().flat_map(|sums| sums.with_columns[number]).skip(1).take(modes.len());
            column.extend(all);
        }
    }
}

/// Sums over rows, of eight modes.
#[derive(Clone)]
struct Sums {
    differences: Lanes,
    squares: Lanes,
    with_residual: Lanes,
    with_columns: Vec<Lanes>,
}

impl Sums {
    fn zero(columns: usize) -> Self {
        let zero = [0.0; LANES];
        Self { differences: zero, squares: zero, with_residual: zero, with_columns: vec![zero; columns] }
    }

    /// Adds those of a record, about the means of the differences; residual and columns have none.
    fn add_centred(&mut self, record: &Self, rows: f64) {
        let add = |to: &mut Lanes, what: &Lanes| to.iter_mut().zip(what).for_each(|(to, what)| *to += what);
        let centred = std::array::from_fn(|i| record.squares[i] - record.differences[i].powi(2) / rows);
        add(&mut self.squares, &centred);
        add(&mut self.with_residual, &record.with_residual);
        for (to, what) in self.with_columns.iter_mut().zip(&record.with_columns) {
            add(to, what);
        }
    }
}

/// Adds the rows of a block.
struct Add<'a> {
    scan: &'a Scan,
    sums: &'a mut Sums,
    answers: &'a [Lanes],
    first: &'a [f64],
    /// Where in the block the rows are, and which they are.
    places: &'a [(usize, usize)],
}

impl SimdLoop for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { scan, sums, answers, first, places } = self;
        let difference = |k: usize| load(simd, &answers[k]) - splat(simd, first[k]);
        let mut of_all = load(simd, &sums.differences);
        let mut squares = load(simd, &sums.squares);
        let mut with_residual = load(simd, &sums.with_residual);
        for (k, row) in places {
            let difference = difference(*k);
            of_all += difference;
            squares = difference.mul_add(difference, squares);
            with_residual = difference.mul_add(splat(simd, scan.residual[*row]), with_residual);
        }
        sums.differences = of_all.into();
        sums.squares = squares.into();
        sums.with_residual = with_residual.into();
        for (sum, column) in sums.with_columns.iter_mut().zip(&scan.columns) {
            let mut with_column = load(simd, sum);
            for (k, row) in places {
                with_column = difference(*k).mul_add(splat(simd, column[*row]), with_column);
            }
            *sum = with_column.into();
        }
    }
}
