//! How far a stage of several axes may be from the truth: standard errors of what does not depend on the coordinates of
//! its states and of what is between.
//!
//! The numbers of the matrices are no such thing: other coordinates of the states, a larger w with a smaller Bw, or a
//! larger q with a smaller f are the same stage. So J'J of all numbers is singular, and its inverse that of the
//! directions that move a sample. What is reported stays along the others: operators are looked at in the units of w
//! and q in which w moves the positions, and the drives move q, by what they do at the fit.

use faer::{Mat, Side};

use super::data::{Data, Stretch};
use super::pass::{coloured, linearise};
use super::point::{Free, Point};
use crate::fit::colour::Autoregression;
use crate::records::signal::as_f64;

/// Standard errors of a stage of several axes. Infinite for what the records do not tell, as f where z never was; NaN
/// for what has none, as f at its bound.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxesStandardErrors {
    /// Of the frequency of each mode in Hz.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub frequencies: Vec<f64>,
    /// Of the damping ratio of each mode.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub dampings: Vec<f64>,
    /// Of the weights of each operator's plays, or of f+ and then f- at its knots, where w moves the positions, and the
    /// drives move q, by as much as in the model: beside Bw and Cq the records tell no more.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub operators: Vec<Vec<f64>>,
    /// Of the output offset of each position.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub output_offset: Vec<f64>,
}

/// What does not depend on coordinates: the modes of A, from the lowest frequency up, the numbers of operators in the
/// units of a point, the offsets.
struct Quantities {
    modes: Vec<[f64; 2]>,
    operators: Vec<Vec<f64>>,
    offset: Vec<f64>,
}

impl Quantities {
    /// Those of a point, in units of w and q with these gains.
    fn of(point: &Point, dt: f64, units: &[[f64; 2]]) -> Self {
        let operator = |(i, [of_w, of_q]): (usize, &[f64; 2])| {
            let here = gains(point, i);
            point.banks[i].in_units(here[0] / of_w, here[1] / of_q)
        };
        Self {
            modes: modes(point, dt),
            operators: units.iter().enumerate().map(operator).collect(),
            offset: point.offset.clone(),
        }
    }

    /// All in turn. Modes of another number than `modes` are not those that are asked for: NaN.
    fn numbers(&self, modes: usize) -> Vec<f64> {
        let known = self.modes.len() == modes;
        let modes = (0..modes).flat_map(|i| if known { self.modes[i] } else { [f64::NAN; 2] });
        modes.chain(self.operators.iter().flatten().chain(&self.offset).copied()).collect()
    }
}

/// By how much a constant w of an operator moves the positions, and by how much constant drives move its q.
fn gains(point: &Point, operator: usize) -> [f64; 2] {
    let (n, m, h) = (point.states, point.drives, point.banks.len());
    let moved = at_rest(point, |i| point.bw[i * h + operator]);
    let norm = |rows: &mut dyn Iterator<Item = f64>| rows.map(|x| x * x).sum::<f64>().sqrt();
    let seen = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
    let of_w = norm(&mut point.c.chunks_exact(n).map(|row| seen(row, &moved)));
    let of_drive = |j: usize| {
        let moved = at_rest(point, |i| point.b[i * m + j]);
        point.dq[operator * m + j] + seen(&point.cq[operator * n..][..n], &moved)
    };
    [of_w, norm(&mut (0..m).map(of_drive))]
}

/// The states that a constant input keeps: (1 - A)^-1 of it.
fn at_rest(point: &Point, input: impl Fn(usize) -> f64) -> Vec<f64> {
    let state = |i: usize| {
        let other = point.partner(i);
        let [own, across] = point.a_of(i);
        if other == i {
            return input(i) / (1.0 - own);
        }
        let [of_other, back] = point.a_of(other);
        let determinant = (1.0 - own) * (1.0 - of_other) - across * back;
        ((1.0 - of_other) * input(i) + across * input(other)) / determinant
    };
    (0..point.states).map(state).collect()
}

/// Frequency in Hz and damping ratio of the modes of A, from the lowest frequency up: what rings while all operators
/// stand.
pub(super) fn modes(point: &Point, dt: f64) -> Vec<[f64; 2]> {
    let mode = |i: usize| {
        let ([a, b], [d, c]) = (point.a_of(i), point.a_of(point.partner(i)));
        let (half, determinant) = (0.5 * (a + d), a * d - b * c);
        let square = determinant - half * half;
        let is_mode = point.partner(i) != i && square > 0.0;
        is_mode.then(|| {
            let (rate, turn) = (-0.5 * determinant.ln(), square.sqrt().atan2(half));
            let natural = rate.hypot(turn);
            [natural / (std::f64::consts::TAU * dt), rate / natural]
        })
    };
    let mut all: Vec<[f64; 2]> = (0..point.states).step_by(2).filter_map(mode).collect();
    all.sort_by(|p, q| p[0].total_cmp(&q[0]));
    all
}

/// Of a step for differences, beside 1 and the size of a number.
const STEP: f64 = 1e-6;

/// A direction along which samples move by less than this share of the one that moves them most is one of coordinates.
const COORDINATES: f64 = 1e-12;

/// What changes along those directions by more than this share of how it changes at all is told by no record.
const UNTOLD: f64 = 1e-4;

/// Standard errors at the end of a descent, from what it leaves of each stretch. NaN where they cannot be computed.
pub(super) fn standard_errors(
    point: &Point,
    data: &Data,
    (stretches, residuals): (&[Stretch], &[Vec<f64>]),
    free: Free,
    dt: f64,
) -> AxesStandardErrors {
    let units: Vec<[f64; 2]> = (0..point.banks.len()).map(|i| gains(point, i)).collect();
    let here = Quantities::of(point, dt, &units);
    let modes = here.modes.len();
    let of_point = |point: &Point| Quantities::of(point, dt, &units).numbers(modes);
    let count = here.numbers(modes).len();
    let spread = || {
        let plain = linearise(point, data, stretches, free)?.matrix;
        let coloured = coloured(point, data, stretches, free, &colours(residuals, data.positions))?.matrix;
        let (spread, told) = spread(&plain, &coloured, &gradients(point, free, count, of_point))?;
        let samples = residuals.iter().map(Vec::len).sum::<usize>();
        let freedom = (as_f64(samples) / as_f64(samples.saturating_sub(told).max(1))).sqrt();
        Some(spread.into_iter().map(|error| freedom * error).collect::<Vec<f64>>())
    };
    let mut errors = spread().unwrap_or_else(|| vec![f64::NAN; count]).into_iter();
    let of_modes: Vec<f64> = errors.by_ref().take(2 * modes).collect();
    let (frequencies, dampings) =
        of_modes.as_chunks().0.iter().map(|[frequency, damping]| (*frequency, *damping)).unzip();
    let gains = point.operator_gains(data);
    let operators = point.banks.iter().zip(gains).map(|(bank, gain)| {
        let numbers = bank.numbers();
        let error = |(number, error): (&f64, f64)| if bank.is_at_bound(*number) { f64::NAN } else { error * gain };
        numbers.iter().zip(errors.by_ref()).map(error).collect()
    });
    let operators = operators.collect();
    let output_offset = errors.zip(&data.position_scale).map(|(error, scale)| error * scale).collect();
    AxesStandardErrors { frequencies, dampings, operators, output_offset }
}

/// How the residuals of each position follow from each other.
fn colours(residuals: &[Vec<f64>], positions: usize) -> Vec<Autoregression> {
    let of_position = |i: usize| {
        let of_part = |part: &Vec<f64>| part[i..].iter().step_by(positions).copied().collect::<Vec<f64>>();
        Autoregression::of(&residuals.iter().flat_map(of_part).collect::<Vec<f64>>())
    };
    (0..positions).map(of_position).collect()
}

/// How each of `count` quantities changes with each number: a column for each quantity. NaN where a mode turns into two
/// lags, which no derivative tells.
fn gradients(point: &Point, free: Free, count: usize, quantities: impl Fn(&Point) -> Vec<f64>) -> Mat<f64> {
    let values: Vec<f64> = point.clone().numbers_mut(free).into_iter().map(|number| *number).collect();
    let mut all = Mat::zeros(values.len(), count);
    for (i, value) in values.iter().enumerate() {
        let step = STEP * (1.0 + value.abs());
        let at = |by: f64| {
            let mut there = point.clone();
            *there.numbers_mut(free).swap_remove(i) += by;
            quantities(&there)
        };
        let (less, more) = (at(-step), at(step));
        for j in 0..count {
            all[(i, j)] = (more[j] - less[j]) / (2.0 * step);
        }
    }
    all
}

/// The roots of the diagonal of G'(J'J)^+ J' Omega J (J'J)^+ G, infinite for a quantity with a part that moves no
/// sample; and how many directions move samples.
fn spread(plain: &Mat<f64>, coloured: &Mat<f64>, gradients: &Mat<f64>) -> Option<(Vec<f64>, usize)> {
    let count = plain.nrows();
    let entry = |matrix: &Mat<f64>, i: usize, j: usize| if i >= j { matrix[(i, j)] } else { matrix[(j, i)] };
    // Columns of unit size, as those of A and of D differ by orders.
    let scale: Vec<f64> =
        (0..count).map(|i| if plain[(i, i)] > 0.0 { plain[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let scaled = |matrix: &Mat<f64>| Mat::from_fn(count, count, |i, j| entry(matrix, i, j) * scale[i] * scale[j]);
    let directions = scaled(plain).self_adjoint_eigen(Side::Lower).ok()?;
    let (basis, values) = (directions.U(), directions.S().column_vector());
    let most = (0..count).map(|k| values[k]).fold(0.0, f64::max);
    let is_told = |k: usize| values[k] > COORDINATES * most;
    let told: Vec<usize> = (0..count).filter(|k| is_told(*k)).collect();
    let along = basis.transpose() * Mat::from_fn(count, gradients.ncols(), |i, j| gradients[(i, j)] * scale[i]);
    let part = Mat::from_fn(told.len(), gradients.ncols(), |k, j| along[(told[k], j)] / values[told[k]]);
    let basis = Mat::from_fn(count, told.len(), |i, k| basis[(i, told[k])]);
    let moved = basis * part;
    let noise = scaled(coloured) * &moved;
    let error = |j: usize| {
        let size = |part: &mut dyn Iterator<Item = usize>| part.map(|k| along[(k, j)].powi(2)).sum::<f64>().sqrt();
        let beside = size(&mut (0..count).filter(|k| !is_told(*k)));
        let of_no_sample = (0..count).any(|i| scale[i] == 0.0 && gradients[(i, j)].abs() > 0.0);
        if of_no_sample || beside > UNTOLD * size(&mut (0..count)) {
            return f64::INFINITY;
        }
        let square = (0..count).map(|i| moved[(i, j)] * noise[(i, j)]).sum::<f64>();
        // Rounding may make it negative; `clamp` keeps NaN, which `max` does not.
        square.clamp(0.0, f64::INFINITY).sqrt()
    };
    Some(((0..gradients.ncols()).map(error).collect(), told.len()))
}

#[cfg(test)]
mod tests {
    use super::super::bank::{Bank, Kind};
    use super::super::data::AxesRecord;
    use super::super::pass::missed;
    use super::*;

    /// Two drives about a mean and two positions, slow enough that moves are short beside knots, and a point with three
    /// states.
    fn fit(kind: Kind, mean: f64, reach: f64) -> (Data, Point) {
        let mut seed = 5_u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1_u32 << 24) - 0.5
        };
        let mut u = vec![0.0; 2 * 2000];
        for k in 2..u.len() {
            u[k] = 0.9 * u[k - 2] + 0.4 * random();
        }
        u[2..].iter_mut().for_each(|u| *u += mean);
        let y: Vec<f64> = (0..u.len()).map(|_| random()).collect();
        let data = Data::new(&[AxesRecord { u: &u, y: &y }], 2, 2, 3).unwrap();
        let c = vec![1.0, 0.2, 0.3, -0.1, 0.9, 0.5];
        let mut point = Point::of_dynamics(vec![[0.7, 0.4], [0.6, -0.3], [0.5, 0.0]], c, 2, 2);
        point = point.with_banks(|_| Bank::new(kind, 3, reach));
        point.b = vec![0.3, 0.1, 0.0, 0.4, 0.2, -0.2];
        point.bw = vec![0.1, 0.05, -0.1, 0.1, 0.05, 0.1];
        point.cq = vec![0.3, -0.2, 0.1, 0.1, 0.2, 0.0];
        (data, point)
    }

    fn errors(data: &Data, point: &Point) -> AxesStandardErrors {
        let all = data.all();
        let residuals = missed(point, data, &all).unwrap();
        standard_errors(point, data, (&all, &residuals), Free { dynamics: true, query: true }, 1e-3)
    }

    /// Other coordinates of the states, and other units of w or q: the same stage with the same errors.
    #[test]
    fn what_only_looks_different_has_the_same_errors() {
        for kind in [Kind::Plays, Kind::Duhem] {
            let (data, point) = fit(kind, 0.0, 2.5);
            let mut other = point.clone();
            // The first two states are three times as large.
            for i in 0..2 {
                other.b[2 * i..][..2].iter_mut().for_each(|b| *b *= 3.0);
                other.bw[2 * i..][..2].iter_mut().for_each(|bw| *bw *= 3.0);
                for operator in 0..2 {
                    other.c[3 * operator + i] /= 3.0;
                    other.cq[3 * operator + i] /= 3.0;
                }
            }
            // The first operator has twice the w of plays, or twice the q of a Duhem operator.
            let factor = if kind == Kind::Plays { 2.0 } else { 0.5 };
            other.banks[0].numbers_mut().iter_mut().for_each(|number| *number *= factor);
            if kind == Kind::Plays {
                other.bw.iter_mut().step_by(2).for_each(|bw| *bw /= 2.0);
            } else {
                other.cq[..3].iter_mut().for_each(|cq| *cq *= 2.0);
                other.dq[..2].iter_mut().for_each(|dq| *dq *= 2.0);
            }
            let (one, two) = (errors(&data, &point), errors(&data, &other));
            let same = |one: &[f64], two: &[f64], factor: f64| {
                assert_eq!(one.len(), two.len());
                for (p, q) in one.iter().zip(two) {
                    assert!(*p > 0.0 && (q / (p * factor) - 1.0).abs() < 1e-3, "{kind:?} {p} {q} {factor}");
                }
            };
            same(&one.frequencies, &two.frequencies, 1.0);
            same(&one.dampings, &two.dampings, 1.0);
            same(&one.output_offset, &two.output_offset, 1.0);
            same(&one.operators[0], &two.operators[0], factor);
            same(&one.operators[1], &two.operators[1], 1.0);
        }
    }

    /// Drives of one sign: z never visits the knot on the other side, the records do not tell f there.
    #[test]
    fn f_where_z_never_was_has_an_infinite_error() {
        let (data, mut point) = fit(Kind::Duhem, 2.0, 12.0);
        point.cq.fill(0.0);
        // A curve: loops would lead z back to 0.
        point.banks.iter_mut().for_each(|bank| bank.numbers_mut().copy_from_slice(&[1.0, 1.0, 0.6, 1.0, 1.0, 0.6]));
        let found = errors(&data, &point);
        for operator in &found.operators {
            // f+ and f- at the lowest knot, and what is told.
            assert_eq!([operator[0], operator[3]], [f64::INFINITY; 2], "{found:?}");
        }
        let told = found.operators.iter().flat_map(|operator| [&operator[1..3], &operator[4..]].concat());
        let others = [&found.frequencies[..], &found.dampings, &found.output_offset].concat();
        assert!(told.chain(others).all(|error| error > 0.0 && error.is_finite()), "{found:?}");
    }

    /// Two numbers of which the records tell the sum alone; then two of which the second moves no sample.
    #[test]
    fn what_moves_no_sample_is_untold_and_nan_stays() {
        let sum = Mat::from_fn(2, 2, |_, _| 1.0);
        let of_each = Mat::from_fn(2, 3, |i, j| [[1.0, 1.0, f64::NAN], [0.0, 1.0, 1.0]][i][j]);
        let (errors, told) = spread(&sum, &sum, &of_each).unwrap();
        assert_eq!((errors[0], told), (f64::INFINITY, 1));
        assert!((errors[1] - 1.0).abs() < 1e-12 && errors[2].is_nan(), "{errors:?}");
        let first = Mat::from_fn(2, 2, |i, j| if i + j == 0 { 1.0 } else { 0.0 });
        let (errors, told) = spread(&first, &first, &Mat::from_fn(2, 2, |i, j| f64::from(u8::from(i <= j)))).unwrap();
        assert_eq!((&errors[..], told), (&[1.0, f64::INFINITY][..], 1));
    }

    /// A mode that a small step turns into two lags has no error; all else has.
    #[test]
    fn a_mode_next_to_two_lags_has_no_error_alone() {
        let (data, mut point) = fit(Kind::Plays, 0.0, 2.5);
        (point.a[0], point.a[1]) = ([0.7, 1e-6], [0.7, -1e-6]);
        let found = errors(&data, &point);
        assert!(found.frequencies[0].is_nan() && found.dampings[0].is_nan(), "{found:?}");
        let others = found.operators.iter().flatten().chain(&found.output_offset);
        assert!(others.copied().all(|error| error > 0.0 && error.is_finite()), "{found:?}");
    }

    /// A motion that leaves all bounds has no tangents.
    #[test]
    fn what_cannot_be_computed_is_nan() {
        let (data, mut point) = fit(Kind::Plays, 0.0, 2.5);
        let all = data.all();
        let residuals = missed(&point, &data, &all).unwrap();
        point.offset[0] = 1e9;
        let free = Free { dynamics: true, query: true };
        let found = standard_errors(&point, &data, (&all, &residuals), free, 1e-3);
        let numbers = [&found.frequencies, &found.dampings, &found.operators[1], &found.output_offset];
        assert_eq!(numbers.map(Vec::len), [1, 1, 3, 2]);
        assert!(numbers.into_iter().flatten().all(|error| error.is_nan()), "{found:?}");
    }
}
