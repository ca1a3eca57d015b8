//! Householder reflections that fold fresh rows into a triangle, eight columns at once.
//!
//! The reflection of a column has one element in the triangle, its head, and one in every fresh row. Vectors are not scaled: with
//! u = (head, a), H = I - scale u u'. The heads of different columns lie in different rows, so products of vectors are those of fresh rows.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use fearless_simd::{Simd, SimdFloat, f64x8};

use crate::fit::eight::{LANES, Lanes, SimdLoop, load, splat};

/// So many columns of a panel are applied at a time: what they need stays in registers.
const HALF: usize = LANES / 2;

/// A column of a smaller sum of squares is zero: products of such numbers would lose their digits.
const NOTHING: f64 = 1e-280;

/// Folds fresh rows: eights of columns, one eight of all rows after the other, `capacity` rows each, of which the first `rows` count. The
/// triangle has the eights of a row side by side.
pub(super) struct Fold<'a> {
    pub(super) columns: usize,
    pub(super) triangle: &'a mut [Lanes],
    pub(super) fresh: &'a mut [Lanes],
    pub(super) capacity: usize,
    pub(super) rows: usize,
}

/// The reflections of the columns of a panel, whose vectors lie where its fresh rows were.
#[derive(Default)]
struct Reflections {
    heads: Lanes,
    scales: Lanes,
    /// Of the vector of each column with those before it.
    products: [Lanes; LANES],
}

impl SimdLoop for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { columns, triangle, fresh, capacity, rows } = self;
        let eights = columns.div_ceil(LANES);
        for number in 0..eights {
            let (panel, behind) = fresh[number * capacity..].split_at_mut(capacity);
            let panel = &mut panel[..rows];
            let first = number * LANES;
            let heads = &mut triangle[first * eights..columns.min(first + LANES) * eights];
            let reflections = reflect(simd, panel, heads, eights, number);
            for (block, place) in behind.chunks_exact_mut(capacity).zip(number + 1..) {
                apply(simd, &reflections, panel, &mut block[..rows], heads, eights, place);
            }
        }
    }
}

/// Makes the columns of a panel zero below the triangle, of which `heads` are the rows of these columns.
#[inline(always)]
fn reflect<S: Simd>(simd: S, panel: &mut [Lanes], heads: &mut [Lanes], eights: usize, place: usize) -> Reflections {
    let mut reflections = Reflections::default();
    let mut products = products(simd, panel, 0, None);
    let width = heads.len() / eights;
    for (j, row) in heads.chunks_exact_mut(eights).enumerate() {
        let row = &mut row[place];
        let (squares, head) = (products[j], row[j]);
        let mut moved = [0.0; LANES];
        if squares > NOTHING {
            let after = -(head * head + squares).sqrt().copysign(head);
            let head = head - after;
            let scale = -1.0 / (after * head);
            for k in j + 1..LANES {
                moved[k] = (head * row[k] + products[k]) * scale;
                row[k] -= head * moved[k];
            }
            row[j] = after;
            (reflections.heads[j], reflections.scales[j]) = (head, scale);
        } else {
            // What is no number is no column either.
            for row in panel.iter_mut() {
                row[j] = 0.0;
            }
        }
        reflections.products[j] = products;
        if j + 1 < width {
            products = self::products(simd, panel, j + 1, Some(moved));
        }
    }
    reflections
}

/// Subtracts from every row what the column before this one moves, if there is one, and returns the products of this column with all.
#[inline(always)]
fn products<S: Simd>(simd: S, panel: &mut [Lanes], column: usize, moved: Option<Lanes>) -> Lanes {
    let before = column.saturating_sub(1);
    let moves = moved.map(|moved| load(simd, &moved.map(|value| -value)));
    let mut sums = [splat(simd, 0.0); 2];
    let (pairs, rest) = panel.as_chunks_mut::<2>();
    for pair in pairs {
        for i in 0..2 {
            sums[i] = product(simd, &mut pair[i], (before, column), moves, sums[i]);
        }
    }
    for row in rest {
        sums[0] = product(simd, row, (before, column), moves, sums[0]);
    }
    (sums[0] + sums[1]).into()
}

/// The same of one row.
#[inline(always)]
fn product<S: Simd>(
    simd: S,
    row: &mut Lanes,
    (before, column): (usize, usize),
    moves: Option<f64x8<S>>,
    sum: f64x8<S>,
) -> f64x8<S> {
    let here = load(simd, row);
    // Without a column before, nothing times one that is no number would make every column such a one.
    let moved = match moves {
        Some(moves) => splat(simd, row[before]).mul_add(moves, here),
        None => here,
    };
    *row = moved.into();
    // As it was stored, to the last bit: of a column that depends on others rounding is all that is left.
    splat(simd, row[column]).mul_add(moved, sum)
}

/// Applies the reflections of a panel to eight columns behind it.
#[inline(always)]
fn apply<S: Simd>(
    simd: S,
    reflections: &Reflections,
    panel: &[Lanes],
    block: &mut [Lanes],
    heads: &mut [Lanes],
    eights: usize,
    place: usize,
) {
    let width = heads.len() / eights;
    let mut moves = [[0.0; LANES]; LANES];
    for first in (0..width).step_by(HALF) {
        let mut sums = [splat(simd, 0.0); HALF];
        for (vectors, row) in panel.iter().zip(&*block) {
            let row = load(simd, row);
            for j in 0..HALF {
                sums[j] = splat(simd, vectors[first + j]).mul_add(row, sums[j]);
            }
        }
        for j in 0..HALF {
            moves[first + j] = sums[j].into();
        }
    }
    for (j, row) in heads.chunks_exact_mut(eights).enumerate() {
        let (head, scale) = (reflections.heads[j], reflections.scales[j]);
        let row = &mut row[place];
        let mut sum = splat(simd, head).mul_add(load(simd, row), load(simd, &moves[j]));
        for (product, moved) in reflections.products[j].iter().zip(&moves[..j]) {
            sum = splat(simd, *product).mul_add(load(simd, moved), sum);
        }
        let moved = splat(simd, -scale) * sum;
        moves[j] = moved.into();
        *row = splat(simd, head).mul_add(moved, load(simd, row)).into();
    }
    for first in (0..width).step_by(HALF) {
        let mut moved = [splat(simd, 0.0); HALF];
        for j in 0..HALF {
            moved[j] = load(simd, &moves[first + j]);
        }
        for (vectors, row) in panel.iter().zip(&mut *block) {
            let mut sum = load(simd, row);
            for j in 0..HALF {
                sum = splat(simd, vectors[first + j]).mul_add(moved[j], sum);
            }
            *row = sum.into();
        }
    }
}
