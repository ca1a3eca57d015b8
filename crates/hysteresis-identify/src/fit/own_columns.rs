//! What every record has of its own: an output offset, and the creep that was under way when it began.

use faer::Mat;

use crate::algebra::factor::Echelon;
use crate::records::record::Record;
use crate::terms::creep::CreepBasis;

/// A column that varies by less than this share of its size is constant.
const MIN_VARYING_SHARE: f64 = 1e-11;

/// The columns of the records' own unknowns, which stand before all others.
///
/// A record that is fitted from its first sample begins at rest. One whose start is left out says nothing of what was
/// before: there the stage may still creep from another position, d sum_j c_j exp(-t / tau_j) with the c_j of log-type
/// creep, and d is fitted. So what crept before the record does not pass for creep in it.
#[derive(Clone, Debug)]
pub(crate) struct OwnColumns {
    records: usize,
    underway: Vec<Underway>,
}

#[derive(Clone, Debug)]
struct Underway {
    record: usize,
    column: Vec<f64>,
}

impl OwnColumns {
    /// `dt` is the sampling interval of a record.
    pub(crate) fn new(records: &[Record<'_>], dt: impl Fn(usize) -> f64, creep: &CreepBasis) -> Self {
        let underway = |(place, record): (usize, &Record<'_>)| {
            let [unit] = &creep.directions[..] else { return None };
            let column = decay(unit, &creep.time_constants, record.input().len(), dt(place));
            (record.skip() > 0).then_some(Underway { record: place, column })
        };
        Self { records: records.len(), underway: records.iter().enumerate().filter_map(underway).collect() }
    }

    /// How many columns there are.
    pub(crate) fn len(&self) -> usize {
        self.records + self.underway.len()
    }

    /// Which columns belong to a record.
    pub(crate) fn of_record(&self, place: usize) -> impl Iterator<Item = usize> {
        let later = self.underway.iter().position(|underway| underway.record == place);
        std::iter::once(place).chain(later.map(|number| self.records + number))
    }

    /// The columns at a sample of a record.
    pub(crate) fn write(&self, place: usize, sample: usize, row: &mut [f64]) {
        row.fill(0.0);
        row[place] = 1.0;
        for (value, underway) in row[self.records..].iter_mut().zip(&self.underway) {
            *value = if underway.record == place { underway.column[sample] } else { 0.0 };
        }
    }

    /// The output offset of every record, and the creep under way of every record, 0 where there is none.
    pub(crate) fn split(&self, values: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (offsets, amplitudes) = values.split_at(self.records);
        let mut underway = vec![0.0; self.records];
        for (one, amplitude) in self.underway.iter().zip(amplitudes) {
            underway[one.record] = *amplitude;
        }
        (offsets.to_vec(), underway)
    }
}

/// sum_j c_j exp(-k dt / tau_j) for all samples.
fn decay(amplitudes: &[f64], time_constants: &[f64], samples: usize, dt: f64) -> Vec<f64> {
    let mut sum = vec![0.0; samples];
    for (c, tau) in amplitudes.iter().zip(time_constants) {
        let (decay, mut value) = ((-dt / tau).exp(), *c);
        for sum in &mut sum {
            *sum += value;
            value *= decay;
        }
    }
    sum
}

/// What creep under way adds to the samples of a record for d = 1; nothing where there is no such creep.
pub(crate) fn underway(creep: &CreepBasis, samples: usize, dt: f64) -> Vec<f64> {
    let [unit] = &creep.directions[..] else { return Vec::new() };
    decay(unit, &creep.time_constants, samples, dt)
}

/// What goes with these unknowns of the records' own: zero for what the rows do not tell.
pub(crate) fn own_values(factor: &Mat<f64>, own: usize, unknowns: &[f64]) -> Vec<f64> {
    let left = |i: usize| {
        let modelled: f64 = unknowns.iter().enumerate().map(|(j, c)| c * factor[(i, own + j)]).sum();
        factor[(i, factor.ncols() - 1)] - modelled
    };
    let echelon = Echelon::of(factor.get(.., ..own));
    echelon.solve(own, (0..echelon.rank(own)).map(left).collect())
}

/// Eliminates what the records have of their own: the problem left for all other columns, the last one being the
/// right-hand side.
///
/// An operator that never moves in the fitted samples has a constant column; what is left of it is rounding, and an
/// enormous weight would fit noise with it. Such columns become exactly zero.
///
/// A column of the records' own takes no row if it depends on others, as that of a record without a row does.
pub(crate) fn below_own(factor: &Mat<f64>, own: usize) -> (Mat<f64>, Vec<f64>) {
    let last = factor.ncols() - 1;
    let rank = Echelon::of(factor.get(.., ..own)).rank(own);
    let mut a = factor.get(rank.., own..last).to_owned();
    for j in 0..a.ncols() {
        if a.col(j).norm_l2() <= MIN_VARYING_SHARE * factor.col(own + j).norm_l2() {
            a.col_mut(j).fill(0.0);
        }
    }
    (a, (rank..factor.nrows()).map(|i| factor[(i, last)]).collect())
}

#[cfg(test)]
mod tests {
    use crate::algebra::factor::TriangularFactor;
    use crate::terms::creep::CreepModel;

    use super::*;

    #[test]
    fn records_with_a_start_left_out_have_creep_under_way() {
        let signal: Vec<f64> = (0..50).map(f64::from).collect();
        let record = |skip| Record::new(&signal, &signal, skip).unwrap();
        let records = [record(0), record(10), record(20)];
        let creep = CreepModel::Logarithmic { terms: Some(2) }.basis(5.0, 0.1).unwrap();
        let own = OwnColumns::new(&records, |_| 0.1, &creep);
        assert_eq!(own.len(), 5);
        assert_eq!(own.of_record(0).collect::<Vec<_>>(), [0]);
        assert_eq!(own.of_record(2).collect::<Vec<_>>(), [2, 4]);
        let mut row = [9.0; 5];
        own.write(1, 7, &mut row);
        let [c, tau] = [&creep.directions[0], &creep.time_constants];
        let expected: f64 = (0..2).map(|j| c[j] * (-0.7 / tau[j]).exp()).sum();
        assert!(row[..3] == [0.0, 1.0, 0.0] && (row[3] - expected).abs() < 1e-12 && row[4] == 0.0, "{row:?}");
        assert_eq!(own.split(&[1.0, 2.0, 3.0, 0.5, 0.6]), (vec![1.0, 2.0, 3.0], vec![0.0, 0.5, 0.6]));
        assert_eq!(OwnColumns::new(&records, |_| 0.1, &CreepBasis::default()).len(), 3);
    }

    /// A record without a row, and creep under way in a record of one row, change nothing for the others.
    #[test]
    fn what_no_row_tells_is_zero_and_takes_nothing_from_the_rest() {
        let numbers = crate::records::signal::white(300);
        let triangle = |own: &dyn Fn(usize) -> Vec<f64>| {
            let columns = own(0).len() + 3;
            let mut factor = TriangularFactor::new(columns);
            for (k, number) in numbers.chunks_exact(3).enumerate() {
                let [a, b] = [number[0], number[1] + 2.0];
                let y = 0.5 + 2.0 * a - b + 0.1 * number[2] + if k == 0 { 7.0 } else { 0.0 };
                factor.push(&[own(k), vec![a, b, y]].concat());
            }
            factor.finish()
        };
        // One record of all rows but the first, and one of the first.
        let of = |k: usize| [f64::from(u8::from(k > 0)), f64::from(u8::from(k == 0))];
        let plain = triangle(&|k| of(k).to_vec());
        let more = triangle(&|k| vec![of(k)[0], 0.0, of(k)[1], 0.3 * of(k)[1]]);
        let (a, b) = below_own(&plain, 2);
        let (c, d) = below_own(&more, 4);
        let products = |a: &Mat<f64>, b: &[f64]| {
            let all = Mat::from_fn(b.len(), 3, |i, j| if j < 2 { a[(i, j)] } else { b[i] });
            all.transpose() * &all
        };
        let difference = products(&a, &b) - products(&c, &d);
        assert!(difference.norm_max() < 1e-10, "{difference:?}");
        let (values, expected) = (own_values(&more, 4, &[2.0, -1.0]), own_values(&plain, 2, &[2.0, -1.0]));
        assert!(values[1] == 0.0 && values[3] == 0.0, "{values:?}");
        assert!(
            (values[0] - expected[0]).abs() < 1e-12 && (values[2] - expected[1]).abs() < 1e-12,
            "{values:?} {expected:?}"
        );
    }
}
