//! Cross-validation over the pairs: how well weights that were fitted to some of them predict the others.

use faer::Mat;

use crate::algebra::factor::TriangularFactor;
use crate::choose::cross_validation::{CrossValidation, FOLDS};
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::weighing::{FINEST, Law, Shares};
use crate::records::signal::{as_f64, mean};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::weights::WeightLaw;

/// Below this share of the longest length an rms error of lengths is rounding.
const ROUNDING: f64 = 1e-9;

/// From so many lengths on these are held out, too.
pub(crate) const MANY_LENGTHS: usize = 2 * FOLDS;

/// The stretch of every equation: pairs in order of their earlier instants, lengths in turn; none for lengths that all
/// stretches need.
pub(crate) fn stretches(search: &PlaceSearch<'_>, count: usize) -> Vec<Option<usize>> {
    let given = &search.system.given;
    let mut order: Vec<usize> = (0..given.pairs.len()).collect();
    let key = |place: &usize| (given.pairs[*place].drive, given.pairs[*place].earlier());
    order.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    let mut stretches = vec![None; given.pairs.len() + given.lengths.len()];
    for (rank, place) in order.iter().enumerate() {
        stretches[*place] = Some(rank * count / order.len());
    }
    if given.pairs.is_empty() || given.lengths.len() >= MANY_LENGTHS {
        for number in 0..given.lengths.len() {
            stretches[given.pairs.len() + number] = Some(number % count);
        }
    }
    stretches
}

/// The triangles of the stretches about a fit, and that of what all of them need.
pub(crate) struct PairStretches {
    parts: Vec<(Mat<f64>, usize)>,
    always: Mat<f64>,
    columns: usize,
    rounding: f64,
}

impl PairStretches {
    pub(crate) fn new(search: &PlaceSearch<'_>, found: &FoundPlace, shares: &Shares) -> Self {
        let law = search.law(&found.space, &found.point, 0.0);
        let rows = search.rows_at(&found.space, &found.point);
        let factor = || (TriangularFactor::new(law.linear + 1), 0);
        let (mut parts, mut always): (Vec<_>, _) = ((0..FOLDS).map(|_| factor()).collect(), factor());
        let mut row = vec![0.0; law.linear + 1];
        let factors = search.system.factors(shares);
        for ((values, (weight, target)), stretch) in rows.iter().zip(factors).zip(stretches(search, FOLDS)) {
            if weight > 0.0 {
                law.scaled(values, weight, target, &mut row);
                let (factor, count) = stretch.map_or(&mut always, |stretch| &mut parts[stretch]);
                factor.push(&row);
                *count += 1;
            }
        }
        let parts = parts.into_iter().map(|(factor, count): (TriangularFactor, usize)| (factor.finish(), count));
        let finest = if search.system.pairs() == 0 { ROUNDING } else { FINEST };
        let rounding = (finest * search.system.given.longest()).powi(2);
        Self { parts: parts.collect(), always: always.0.finish(), columns: law.linear, rounding }
    }

    /// How weights of this smoothness predict every stretch from the others.
    pub(crate) fn validate(&self, law: &Law, creep: usize, smoothness: f64) -> CrossValidation {
        let errors: Vec<f64> = (0..self.parts.len())
            .filter(|held_out| self.parts[*held_out].1 > 0)
            .map(|held_out| {
                let mut factor = TriangularFactor::new(self.columns + 1);
                let others = self.parts.iter().enumerate().filter(|(number, _)| *number != held_out);
                for triangle in others.map(|(_, (triangle, _))| triangle).chain([&self.always]) {
                    rows_of(triangle).for_each(|row| factor.push(&row));
                }
                let unknowns = law.unknowns(&factor.finish(), &[]);
                let (triangle, count) = &self.parts[held_out];
                let error = |row: Vec<f64>| {
                    let said: f64 = row.iter().zip(&unknowns).map(|(value, x)| value * x).sum();
                    (said - row[self.columns]).powi(2)
                };
                rows_of(triangle).map(error).sum::<f64>() / as_f64(*count)
            })
            .collect();
        CrossValidation {
            weights: WeightLaw::Free,
            operators: law.columns,
            smoothness,
            creep,
            loop_shift: LoopShiftModel::None,
            rmse: mean(&errors).sqrt(),
            stretches: errors,
            rounding: self.rounding,
        }
    }
}

fn rows_of(triangle: &Mat<f64>) -> impl Iterator<Item = Vec<f64>> {
    (0..triangle.nrows()).map(|i| (0..triangle.ncols()).map(|j| triangle[(i, j)]).collect())
}
