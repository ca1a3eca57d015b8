//! The linear half: the best weights for rows, with pairs and lengths that lie far from the others counted less.
//!
//! With D the rows of the pairs, L those of the lengths l, r and s their standard deviations, the weights w >= 0
//! minimise
//!
//! sum_i q_i (D_i w / r_i)^2 + sum_k q_k (scale / s_k)^2 (L_k w - l_k)^2 + penalty,
//!
//! where `scale` is the standard deviation of D_i w / r_i and q the share that a robust loss leaves of a pair or a
//! length (Huber, Ann. Math. Stat. 35, 73, 1964; Beaton and Tukey, Technometrics 16, 147, 1974). Pairs say that a
//! difference is 0, which a smaller scale of all weights always suits better: so the lengths alone set the scale in the
//! end.

use faer::Mat;

use crate::algebra::bounded;
use crate::algebra::factor::TriangularFactor;
use crate::places::given::Given;
use crate::places::rows::Rows;
use crate::places::space::{PlacePoint, PlaceSpace};
use crate::records::signal::{as_f64, mean, median, robust_deviation};
use crate::terms::operators::Thresholds;
use crate::terms::side_columns::Sides;
use crate::terms::weights::{WeightBasis, WeightLaw, penalty};

/// Constants of the two losses, for 95 % of the efficiency of least squares under normal noise.
const HUBER: f64 = 1.345;
const BISQUARE: f64 = 4.685;

/// A scale below this share of the longest length is taken for it: nobody matches places more exactly, and what is left
/// is of the model.
pub(crate) const FINEST: f64 = 1e-4;

/// With so many lengths more than unknowns that they tell, one that is wrong is told from the others.
const SPARE_LENGTHS: usize = 10;

/// How often shares and weights are made from each other at most.
const ROUNDS: usize = 8;

/// Shares that change by less are settled.
const SETTLED: f64 = 1e-3;

/// An identity weighs at least this share of all other operators together: so the model has an inverse.
const LEAST_SLOPE: f64 = 1e-3;

/// A robust loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RobustLoss {
    /// Convex: finds its way from anywhere.
    Huber,
    /// Leaves out what is far away.
    Bisquare,
}

impl RobustLoss {
    /// The loss at a distance in standard deviations.
    fn of(self, distance: f64) -> f64 {
        let distance = distance.abs();
        match self {
            Self::Huber if distance <= HUBER => 0.5 * distance * distance,
            Self::Huber => HUBER * (distance - 0.5 * HUBER),
            Self::Bisquare => {
                let within = (1.0 - (distance / BISQUARE).powi(2)).max(0.0);
                BISQUARE * BISQUARE / 6.0 * (1.0 - within.powi(3))
            }
        }
    }

    fn share(self, mismatch: f64, scale: f64) -> f64 {
        let distance = mismatch.abs() / scale;
        match self {
            Self::Huber => (HUBER / distance).min(1.0),
            Self::Bisquare if distance < BISQUARE => (1.0 - (distance / BISQUARE).powi(2)).powi(2),
            Self::Bisquare => 0.0,
        }
    }
}

/// Beside which standard deviations the robust loss sees distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scales {
    /// Of a pair of middling uncertainty, in the unit of the position.
    pub(crate) pairs: f64,
    /// Of a length, in its own standard deviations; none where there are too few lengths to accuse one.
    pub(crate) lengths: Option<f64>,
}

/// How much every pair and every length counts, and beside which scales.
#[derive(Clone, Debug)]
pub(crate) struct Shares {
    pub(crate) of_pairs: Vec<f64>,
    pub(crate) of_lengths: Vec<f64>,
    pub(crate) scales: Scales,
}

impl Shares {
    /// Those that are left out.
    pub(crate) fn left_out(of: &[f64]) -> Vec<usize> {
        of.iter().enumerate().filter(|(_, share)| **share == 0.0).map(|(place, _)| place).collect()
    }
}

/// The best weights for rows.
#[derive(Clone, Debug)]
pub(crate) struct Weighed {
    /// The weights, and behind them the amplitudes beside the operators.
    pub(crate) weights: Vec<f64>,
    pub(crate) shares: Shares,
    /// D_i w / r_i of every pair.
    pub(crate) mismatches: Vec<f64>,
    /// L_k w - l_k of every length.
    pub(crate) length_errors: Vec<f64>,
}

/// What stands beside the rows: targets and standard deviations.
pub(crate) struct System<'a> {
    pub(crate) given: Given<'a>,
    /// The pairs that say nothing: their mismatches are 0 whatever the weights are, and no measure of the others.
    pub(crate) uninformative: Vec<usize>,
    /// r_i: 1 for the pair in the middle.
    pub(crate) pair_deviations: Vec<f64>,
    pub(crate) length_deviations: Vec<f64>,
    /// The same as the fit takes them: one length alone says nothing but the scale, so it is held.
    fit_deviations: Vec<f64>,
}

impl<'a> System<'a> {
    pub(crate) fn new(given: Given<'a>) -> Self {
        let length_deviations = given.length_deviations();
        let fit_deviations = match given.lengths {
            [one] => vec![1e-3 * one.length.abs()],
            _ => length_deviations.clone(),
        };
        let deviations: Vec<f64> = given.pairs.iter().map(|pair| pair.std).collect();
        let middle = median(&deviations);
        let pair_deviations = deviations.iter().map(|deviation| deviation / middle).collect();
        Self { given, uninformative: Vec::new(), pair_deviations, length_deviations, fit_deviations }
    }

    pub(crate) fn pairs(&self) -> usize {
        self.given.pairs.len()
    }

    /// All pairs alike, for a first look.
    pub(crate) fn first_shares(&self) -> Shares {
        let pairs = if self.pairs() == 0 { mean(&self.fit_deviations) } else { 1e-2 * self.given.longest() };
        Shares {
            of_pairs: vec![1.0; self.pairs()],
            of_lengths: vec![1.0; self.given.lengths.len()],
            scales: Scales { pairs, lengths: None },
        }
    }

    /// Each equation's factor, and its target.
    pub(crate) fn factors(&self, shares: &Shares) -> impl Iterator<Item = (f64, f64)> {
        let pairs = self.pair_deviations.iter().zip(&shares.of_pairs).map(|(r, share)| (share.sqrt() / r, 0.0));
        let scale = shares.scales.pairs;
        let lengths = self.given.lengths.iter().zip(&self.fit_deviations).zip(&shares.of_lengths);
        pairs.chain(lengths.map(move |((known, deviation), share)| (share.sqrt() * scale / deviation, known.length)))
    }

    /// What the weights make of the rows.
    pub(crate) fn weighed(&self, rows: &Rows, weights: Vec<f64>, shares: Shares) -> Weighed {
        let mut said = rows.times(&weights);
        let lengths = said.split_off(self.pairs());
        let mismatches = said.iter().zip(&self.pair_deviations).map(|(said, r)| said / r).collect();
        let length_errors = lengths.iter().zip(self.given.lengths).map(|(said, known)| said - known.length).collect();
        Weighed { weights, shares, mismatches, length_errors }
    }

    /// The weights with shares that belong to them; at scales that are given, or at those of the distances.
    pub(crate) fn robust(
        &self,
        rows: &Rows,
        law: &Law,
        (loss, scales): (RobustLoss, Option<Scales>),
        mut shares: Shares,
    ) -> Weighed {
        let mut weighed = self.weighed(rows, law.best(&law.triangle(self, rows, &shares)), shares);
        for _ in 0..ROUNDS {
            shares = self.shares(&weighed, loss, scales.unwrap_or_else(|| self.scales(&weighed, law)));
            let before = weighed.shares.of_pairs.iter().chain(&weighed.shares.of_lengths);
            let changes = shares.of_pairs.iter().chain(&shares.of_lengths).zip(before).map(|(a, b)| (a - b).abs());
            let change = changes.fold(0.0, f64::max);
            weighed = self.weighed(rows, law.best(&law.triangle(self, rows, &shares)), shares);
            if change < SETTLED {
                break;
            }
        }
        weighed
    }

    fn shares(&self, weighed: &Weighed, loss: RobustLoss, scales: Scales) -> Shares {
        let of_lengths = match scales.lengths {
            Some(scale) => self.length_distances(weighed).map(|e| loss.share(e, scale)).collect(),
            None => vec![1.0; weighed.length_errors.len()],
        };
        Shares {
            of_pairs: weighed.mismatches.iter().map(|e| loss.share(*e, scales.pairs)).collect(),
            of_lengths,
            scales,
        }
    }

    /// What the lengths are missed by, in standard deviations of each.
    fn length_distances(&self, weighed: &Weighed) -> impl Iterator<Item = f64> {
        weighed.length_errors.iter().zip(&self.fit_deviations).map(|(error, deviation)| error / deviation)
    }

    /// The scales of the distances that weights leave.
    pub(crate) fn scales(&self, weighed: &Weighed, law: &Law) -> Scales {
        let pairs = match self.pairs() {
            0 => weighed.shares.scales.pairs,
            _ => self.scale_of(&weighed.mismatches),
        };
        Scales { pairs, lengths: self.length_scale(weighed, law) }
    }

    /// How many of so many unknowns the lengths alone tell: beside pairs it is the scale.
    pub(crate) fn told_by_lengths(&self, unknowns: usize) -> usize {
        if self.pairs() == 0 { unknowns } else { 1 }
    }

    /// The robust standard deviation of the distances of lengths. Weights come close to as many lengths as there are
    /// unknowns that these tell, wrong or not: so it takes more of them to accuse one.
    fn length_scale(&self, weighed: &Weighed, law: &Law) -> Option<f64> {
        let lengths = weighed.length_errors.len();
        let weights = law.unknowns_of(&weighed.weights);
        let unknowns = weights[..law.columns].iter().filter(|weight| **weight > 0.0).count() + law.linear - law.columns;
        let spare = lengths.checked_sub(self.told_by_lengths(unknowns))?;
        if spare < SPARE_LENGTHS {
            return None;
        }
        let all = self.length_distances(weighed).collect::<Vec<_>>();
        // One that says nothing of itself is not accused within what it counts as known to: that much is of the model.
        let finest = if self.given.lengths.iter().all(|known| known.std.is_some()) { 1.0 } else { BISQUARE.recip() };
        Some((robust_deviation(&all) * (as_f64(lengths) / as_f64(spare)).sqrt()).max(finest))
    }

    pub(crate) fn scale_of(&self, mismatches: &[f64]) -> f64 {
        let says = |place: &usize| self.uninformative.binary_search(place).is_err();
        let all = mismatches.iter().enumerate();
        let saying: Vec<f64> = all.filter(|(place, _)| says(place)).map(|(_, mismatch)| *mismatch).collect();
        robust_deviation(&saying).max(FINEST * self.given.longest())
    }

    /// What the search minimises: the loss of every pair and of every length; half their squares, over their variances,
    /// where none can be accused.
    pub(crate) fn cost(&self, weighed: &Weighed, (loss, scales): (RobustLoss, Scales)) -> f64 {
        let of_length = |distance: f64| match scales.lengths {
            Some(scale) => scale * scale * loss.of(distance / scale),
            None => 0.5 * distance * distance,
        };
        let pairs = weighed.mismatches.iter().map(|e| loss.of(e / scales.pairs));
        pairs.sum::<f64>() + self.length_distances(weighed).map(of_length).sum::<f64>()
    }

    /// By what the weights must be multiplied so that the lengths alone set their scale.
    pub(crate) fn scale_to_lengths(&self, weighed: &Weighed) -> f64 {
        let all = weighed.length_errors.iter().zip(self.given.lengths).zip(&self.length_deviations);
        let (mut both, mut square) = (0.0, 0.0);
        for (((error, known), deviation), share) in all.zip(&weighed.shares.of_lengths) {
            let said = (error + known.length) / deviation;
            both += share * said * known.length / deviation;
            square += share * said * said;
        }
        if square > 0.0 && both > 0.0 { both / square } else { 1.0 }
    }
}

/// What the weights may be at a point: not negative, an identity among them, and as smooth as is asked.
pub(crate) struct Law {
    /// How many weights there are.
    pub(crate) columns: usize,
    /// How many unknowns are linear: the weights, and what is beside the operators.
    pub(crate) linear: usize,
    has_identity: bool,
    penalty: Mat<f64>,
}

impl Law {
    /// `unit` is the sum of squares of the drive differences of the pairs.
    pub(crate) fn new(space: &PlaceSpace, point: &PlacePoint, smoothness: f64, unit: f64) -> Self {
        let thresholds = space.thresholds(point);
        let columns = thresholds.len();
        let has_identity = thresholds.first() == Some(&0.0);
        let free = WeightBasis::new(WeightLaw::Free, &Thresholds::Given(thresholds.clone()), Sides::default());
        let penalty = if smoothness > 0.0 { penalty(&free, &thresholds, smoothness * unit) } else { Mat::new() };
        Self { columns, linear: columns + space.beside, has_identity, penalty }
    }

    /// A row in the unknowns: each weight but that of the identity brings the least slope with it.
    pub(crate) fn in_unknowns(&self, row: &mut [f64]) {
        let least = if self.has_identity { LEAST_SLOPE * row[0] } else { 0.0 };
        row[1..self.columns].iter_mut().for_each(|value| *value += least);
    }

    /// The weights that belong to the unknowns.
    pub(crate) fn weights(&self, unknowns: &[f64]) -> Vec<f64> {
        let mut weights = unknowns[..self.linear].to_vec();
        if self.has_identity {
            weights[0] += LEAST_SLOPE * weights[1..self.columns].iter().sum::<f64>();
        }
        weights
    }

    /// The unknowns of weights.
    pub(crate) fn unknowns_of(&self, weights: &[f64]) -> Vec<f64> {
        let mut unknowns = weights.to_vec();
        if self.has_identity {
            unknowns[0] -= LEAST_SLOPE * weights[1..self.columns].iter().sum::<f64>();
        }
        unknowns
    }

    /// The rows that ask for smooth weights, so many columns wide.
    pub(crate) fn penalty_rows(&self, width: usize) -> impl Iterator<Item = Vec<f64>> {
        let value = |i: usize, j: usize| if j < self.columns { self.penalty[(i, j)] } else { 0.0 };
        (0..self.penalty.nrows()).map(move |i| (0..width).map(|j| value(i, j)).collect())
    }

    /// The triangle of all rows with their factors, targets behind them.
    pub(crate) fn triangle(&self, system: &System<'_>, rows: &Rows, shares: &Shares) -> Mat<f64> {
        let mut factor = TriangularFactor::new(rows.width + 1);
        let mut row = vec![0.0; rows.width + 1];
        for (values, (weight, target)) in rows.iter().zip(system.factors(shares)) {
            if weight > 0.0 {
                self.scaled(values, weight, target, &mut row);
                factor.push(&row);
            }
        }
        factor.finish()
    }

    /// Writes a row with its factor and its target.
    pub(crate) fn scaled(&self, values: &[f64], weight: f64, target: f64, row: &mut [f64]) {
        let (place, last) = row.split_at_mut(values.len());
        place.copy_from_slice(values);
        self.in_unknowns(place);
        for value in place {
            *value *= weight;
        }
        last.fill(weight * target);
    }

    /// The best unknowns for a triangle, within bounds of those behind the linear ones.
    pub(crate) fn unknowns(&self, triangle: &Mat<f64>, further: &[(f64, f64)]) -> Vec<f64> {
        let columns = self.linear + further.len();
        let mut factor = TriangularFactor::new(columns + 1);
        let mut row = vec![0.0; columns + 1];
        let last = triangle.ncols() - 1;
        for i in 0..triangle.nrows() {
            (0..columns).for_each(|j| row[j] = triangle[(i, j)]);
            row[columns] = triangle[(i, last)];
            factor.push(&row);
        }
        self.penalty_rows(columns + 1).for_each(|row| factor.push(&row));
        let all = factor.finish();
        let target: Vec<f64> = (0..=columns).map(|i| all[(i, columns)]).collect();
        let weights = std::iter::repeat_n((0.0, f64::INFINITY), self.columns);
        let beside = std::iter::repeat_n((f64::NEG_INFINITY, f64::INFINITY), self.linear - self.columns);
        let bounds: Vec<(f64, f64)> = weights.chain(beside).chain(further.iter().copied()).collect();
        // Most weights are above zero: to release them one by one takes as many solutions.
        let free: Vec<usize> = (0..columns).collect();
        bounded::solve(all.get(.., ..columns), &target, &bounds, &free).x
    }

    /// The best weights for a triangle.
    pub(crate) fn best(&self, triangle: &Mat<f64>) -> Vec<f64> {
        self.weights(&self.unknowns(triangle, &[]))
    }
}
