//! What a linear part that the model lacks would add to its output: a sum of lags, whose amplitudes generalised least
//! squares find together with the parameters, from rows that were whitened.

use std::ops::Range;

use faer::{Mat, c64};

use crate::algebra::factor::{DEPENDS, Echelon};
use crate::fit::colour::Autoregression;
use crate::records::signal::as_f64;

/// Each lag is so many times as long as the one before: half a decade.
const RATIO: f64 = 3.162_277_660_168_379_5;

/// From here on a lag is creep, which comes on top of the output at once; a shorter one is of dynamics, which have unit
/// static gain. In sampling intervals.
const CREEP_SAMPLES: f64 = 30.0;

/// Residuals ring where a pole of their model is at least so large: the ringing falls to 1/e in more than four samples.
const RINGING: f64 = 0.8;

/// The residuals of a record ring at so many frequencies at most.
const MAX_RINGING: usize = 3;

/// Time constants from one sample to the length of the longest record, in its unit of time, and the poles at which
/// residuals ring.
///
/// Left-out dynamics or creep add a linear response to the modelled output h. It is nearly a sum of c_j q_j, or c_j
/// (q_j - h) for short time constants, with q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k) and a_j = exp(-dt / tau_j). Left-out
/// dynamics of low damping ring with a frequency and a damping of their own, and so does what they leave. There a_j =
/// exp(s_j dt), with a complex s_j: the real part of q_j - h and the imaginary part each have an amplitude.
pub(crate) struct Lags {
    time_constants: Vec<f64>,
    creep_from: f64,
    /// s_j, with a positive imaginary part.
    ringing: Vec<c64>,
}

impl Lags {
    /// For records that are sampled every `dt` at least, the longest of this length.
    pub(crate) fn new(dt: f64, longest: f64) -> Self {
        let constants = std::iter::successors(Some(dt), |tau| Some(tau * RATIO));
        let time_constants = constants.take_while(|tau| *tau <= longest).collect();
        Self { time_constants, creep_from: CREEP_SAMPLES * dt, ringing: Vec::new() }
    }

    /// Those of dynamics alone, shorter than any creep that is in the model: longer ones are not told from it.
    pub(crate) fn beside_creep(mut self, time_constants: &[f64]) -> Self {
        if let Some(shortest) = time_constants.iter().copied().reduce(f64::min) {
            let from = shortest.min(self.creep_from);
            self.time_constants.retain(|tau| *tau < from);
        }
        self
    }

    /// The same with the frequencies at which the residuals of a record ring, by their model.
    pub(crate) fn with_ringing(mut self, residuals: &Autoregression, dt: f64) -> Self {
        self.ringing.extend(ringing(residuals).into_iter().map(|a| a.ln() / dt));
        self
    }

    /// None.
    pub(crate) fn none() -> Self {
        Self { time_constants: Vec::new(), creep_from: 0.0, ringing: Vec::new() }
    }

    /// How many columns they have.
    pub(crate) fn len(&self) -> usize {
        self.time_constants.len() + 2 * self.ringing.len()
    }

    /// Whether each column is one of creep.
    pub(crate) fn are_creep(&self) -> Vec<bool> {
        let of_ringing = std::iter::repeat_n(false, 2 * self.ringing.len());
        self.time_constants.iter().map(|tau| *tau >= self.creep_from).chain(of_ringing).collect()
    }

    /// How much later slow motion is seen per unit of the amplitude of every column: dynamics delay it, creep does not
    /// count.
    pub(crate) fn delays(&self, dt: f64) -> Vec<f64> {
        let of_lag = |tau: &f64| if *tau < self.creep_from { -dt / (-dt / tau).exp_m1() } else { 0.0 };
        let of_ringing = |s: &c64| {
            let delay = dt / (1.0 - (s * dt).exp());
            [delay.re, delay.im]
        };
        self.time_constants.iter().map(of_lag).chain(self.ringing.iter().flat_map(of_ringing)).collect()
    }

    /// The lags of one record, at rest at the first value of its output.
    pub(crate) fn of_record(&self, rest: f64, dt: f64) -> LagLane<'_> {
        LagLane {
            lags: self,
            rest,
            shares: self.time_constants.iter().map(|tau| -(-dt / tau).exp_m1()).collect(),
            states: vec![0.0; self.time_constants.len()],
            factors: self.ringing.iter().map(|s| (s * dt).exp()).collect(),
            ringing: vec![c64::new(0.0, 0.0); self.ringing.len()],
        }
    }
}

/// The poles at which residuals ring, one of every pair, the longest first.
fn ringing(model: &Autoregression) -> Vec<c64> {
    let order = model.order();
    let companion = Mat::from_fn(order, order, |i, j| match (i, j) {
        (0, j) => -model.coefficients[j],
        (i, j) => f64::from(i == j + 1),
    });
    // What rings is told nothing of where its poles cannot be found.
    let poles = if order == 0 { Vec::new() } else { companion.eigenvalues().unwrap_or_default() };
    let mut poles: Vec<c64> = poles.into_iter().filter(|a| a.im > 0.0 && a.norm() > RINGING).collect();
    poles.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    poles.truncate(MAX_RINGING);
    poles
}

/// See [`Lags::of_record`].
pub(crate) struct LagLane<'a> {
    lags: &'a Lags,
    rest: f64,
    shares: Vec<f64>,
    states: Vec<f64>,
    /// exp(s_j dt).
    factors: Vec<c64>,
    ringing: Vec<c64>,
}

impl LagLane<'_> {
    /// Writes what the lags add at the next sample of the output, which goes on.
    pub(crate) fn next(&mut self, output: f64, row: &mut [f64]) {
        let h = output - self.rest;
        let (row, ringing) = row.split_at_mut(self.states.len());
        let states = self.states.iter_mut().zip(&self.shares).zip(&self.lags.time_constants);
        for (value, ((q, share), tau)) in row.iter_mut().zip(states) {
            *value = if *tau < self.lags.creep_from { *q - h } else { *q };
            *q += share * (h - *q);
        }
        for (pair, (q, a)) in ringing.chunks_exact_mut(2).zip(self.ringing.iter_mut().zip(&self.factors)) {
            pair.copy_from_slice(&[q.re - h, q.im]);
            *q = h + a * (*q - h);
        }
    }
}

/// Lags count if they lower the whitened sum of squares by their number and so many of its standard deviations.
const EVIDENCE: f64 = 4.0;

/// The sizes of the amplitudes of dynamics that are tried: four in a decade, from one to a millionth of the output.
const SIZES: i32 = 25;

/// By how many half decades those of creep may be smaller or larger.
const RATIOS: i32 = 8;

/// The solution of generalised least squares, from the triangle of the whitened rows.
#[derive(Debug)]
pub(crate) struct Generalised {
    /// Of the records' own and of what is free.
    pub(crate) told: Vec<f64>,
    /// The amplitudes of the lags, and the root of their covariance. None where noise alone may show as much.
    pub(crate) lags: Option<Amplitudes>,
}

/// What the rows tell of the amplitudes of the lags, and what they do not tell.
///
/// Many of them go together with each other or with the weights of the operators, and the rows tell them badly. So they
/// are taken for normal before the rows are seen, of one size for dynamics and of another for creep: the sizes at which
/// the rows are the likeliest.
#[derive(Debug)]
pub(crate) struct Amplitudes {
    /// What the rows make most likely.
    pub(crate) likely: Vec<f64>,
    /// X with X X' their covariance.
    pub(crate) errors: Mat<f64>,
    /// -2 log of how likely the rows are, but for a constant.
    unlikely: f64,
}

impl Generalised {
    /// From the triangle in echelon form of the whitened rows of what is told, the lags and the residual; whether each
    /// lag is creep.
    ///
    /// What is told by prior information alone, as the weight of an operator that never moves is under a smoothness,
    /// has a column of zeros here. It takes no row, and is zero in the solution.
    ///
    /// A residual that the columns explain to rounding has the noise of rounding: lags of which it is made are told
    /// with hardly an error. One of zeros has none, and no lags.
    pub(crate) fn of(t: &Mat<f64>, told: usize, creeps: &[bool], rows: usize) -> Self {
        let end = t.ncols() - 1;
        let echelon = Echelon::of(t.as_ref());
        let (of_told, rank) = (echelon.rank(told), echelon.rank(end));
        let rounding = DEPENDS * t.col(end).norm_l2();
        let noise = t[(rank, end)].abs().max(rounding) / as_f64(rows.saturating_sub(rank).max(1)).sqrt();
        let evidence = (of_told..rank).map(|i| (t[(i, end)] / noise).powi(2)).sum::<f64>();
        let count = as_f64(rank - of_told);
        let is_told = noise > 0.0 && evidence > count + EVIDENCE * (2.0 * count).sqrt();
        let lags = if is_told { Amplitudes::of(t, told, of_told..rank, creeps, noise) } else { None };
        let of_lags = |i: usize| {
            lags.iter().flat_map(|lags| lags.likely.iter().enumerate()).map(|(j, c)| t[(i, told + j)] * c).sum::<f64>()
        };
        let solution = echelon.solve(told, (0..of_told).map(|i| t[(i, end)] - of_lags(i)).collect());
        Self { told: solution, lags }
    }
}

impl Amplitudes {
    /// From the rows of a triangle that the lags take beside what is told; none if their singular values cannot be
    /// found.
    ///
    /// Lags that depend on others, or on what is told, leave directions along which the rows say nothing. They stay,
    /// with the size of the others, as those do that nearly depend: what is told may be off by as much.
    fn of(t: &Mat<f64>, told: usize, taken: Range<usize>, creeps: &[bool], noise: f64) -> Option<Self> {
        let end = t.ncols() - 1;
        // As many rows as lags, of zeros where lags take none.
        let at = |i: usize, column: usize| taken.clone().nth(i).map_or(0.0, |row| t[(row, column)]);
        let seen: Vec<f64> = (0..end - told).map(|i| at(i, end) / noise).collect();
        let with = |ratio: i32| {
            let creep = 10.0_f64.powf(0.5 * f64::from(ratio));
            let scales: Vec<f64> = creeps.iter().map(|is_creep| if *is_creep { creep } else { 1.0 }).collect();
            let lags = Mat::from_fn(end - told, end - told, |i, j| at(i, told + j) * scales[j] / noise);
            Self::scaled(&lags, &seen, &scales)
        };
        (-RATIOS..=RATIOS).filter_map(with).min_by(|a, b| a.unlikely.total_cmp(&b.unlikely))
    }

    /// For columns that were multiplied by scales, over the noise.
    fn scaled(lags: &Mat<f64>, seen: &[f64], scales: &[f64]) -> Option<Self> {
        let (parts, count) = (lags.svd().ok()?, scales.len());
        // Along each direction: how far an amplitude of one shows above the noise, and what does.
        let rho: Vec<f64> = (0..count).map(|k| parts.S().column_vector()[k]).collect();
        let along = |k: usize| seen.iter().enumerate().map(|(i, seen)| parts.U()[(i, k)] * seen).sum::<f64>();
        let shown: Vec<f64> = (0..count).map(along).collect();
        let unlikely = |size: f64| -> f64 {
            let spread = rho.iter().map(|rho| 1.0 + (size * rho).powi(2));
            spread.zip(&shown).map(|(spread, z)| spread.ln() + z * z / spread).sum()
        };
        let sizes = (0..SIZES).map(|k| 10.0_f64.powf(-f64::from(k) / 4.0));
        let size = sizes.min_by(|a, b| unlikely(*a).total_cmp(&unlikely(*b)))?;
        let spread = |k: usize| 1.0 + (size * rho[k]).powi(2);
        let likely: Vec<f64> = (0..count).map(|k| size * size * rho[k] * shown[k] / spread(k)).collect();
        let v = |j: usize, k: usize| scales[j] * parts.V()[(j, k)];
        Some(Self {
            likely: (0..count).map(|j| (0..count).map(|k| v(j, k) * likely[k]).sum()).collect(),
            errors: Mat::from_fn(count, count, |j, k| v(j, k) * size / spread(k).sqrt()),
            unlikely: unlikely(size),
        })
    }

    /// The root of their mean square: what was found, and then its errors.
    pub(crate) fn root(&self, j: usize, column: usize) -> f64 {
        match column.checked_sub(1) {
            None => self.likely[j],
            Some(error) => self.errors[(j, error)],
        }
    }

    /// How many columns that root has.
    pub(crate) fn root_columns(&self) -> usize {
        1 + self.errors.ncols()
    }
}

#[cfg(test)]
mod tests_of_lags {
    use super::*;

    #[test]
    fn lags_of_a_step_go_to_its_height_or_take_nothing_from_it() {
        let lags = Lags::new(0.1, 40.0);
        assert_eq!(lags.len(), 6);
        let mut lane = lags.of_record(2.0, 0.1);
        let mut row = vec![0.0; 6];
        lane.next(2.0, &mut row);
        assert_eq!(row, [0.0; 6]);
        lane.next(3.0, &mut row);
        assert_eq!(row, [-1.0, -1.0, -1.0, 0.0, 0.0, 0.0]);
        lane.next(3.0, &mut row);
        assert!((row[0] + (-1.0_f64).exp()).abs() < 1e-12, "{row:?}");
        (0..10_000).for_each(|_| lane.next(3.0, &mut row));
        let delays = lags.delays(0.1);
        assert!((delays[0] - 0.1 / (1.0 - (-1.0_f64).exp())).abs() < 1e-12 && delays[3] == 0.0);
        assert!(row[..3].iter().all(|q| q.abs() < 1e-9) && row[3..].iter().all(|q| (q - 1.0).abs() < 1e-9), "{row:?}");
    }

    /// 800 Hz, damping 0.05, at 10 kHz: a ramp is seen later by the delay, and a step rings with that frequency.
    #[test]
    fn what_rings_follows_a_ramp_by_its_delay() {
        let (dt, s) = (1e-4, c64::new(-0.05, 0.998_749_2) * (core::f64::consts::TAU * 800.0));
        let a = (s * dt).exp();
        let model = Autoregression { coefficients: vec![-2.0 * a.re, a.norm_sqr()], deviation: 1.0 };
        let lags = Lags { time_constants: Vec::new(), ..Lags::new(dt, 0.0) }.with_ringing(&model, dt);
        assert!(lags.len() == 2 && (lags.ringing[0] - s).norm() < 1e-6 * s.norm(), "{:?}", lags.ringing);
        let (mut lane, mut row, delays) = (lags.of_record(1.0, dt), [0.0; 2], lags.delays(dt));
        (0..3000).for_each(|k| lane.next(1.0 + 5.0 * f64::from(k) * dt, &mut row));
        assert!(
            (row[0] + 5.0 * delays[0]).abs() < 1e-9 && (row[1] + 5.0 * delays[1]).abs() < 1e-9,
            "{row:?} {delays:?}"
        );
    }

    #[test]
    fn white_residuals_and_slow_ones_do_not_ring() {
        let with = |coefficients| ringing(&Autoregression { coefficients, deviation: 1.0 }).len();
        assert_eq!([with(vec![]), with(vec![-0.95]), with(vec![-0.5, 0.3]), with(vec![-1.0, 0.9])], [0, 0, 0, 1]);
    }
}

#[cfg(test)]
mod tests_of_generalised {
    use proptest::prelude::*;

    use crate::algebra::factor::{TriangularFactor, echelon_of};
    use crate::records::signal::white;

    use super::*;

    /// Three lags seen above noise of 0.1: the first well, the second hardly, the third not at all.
    fn triangle(seen: [f64; 3]) -> Mat<f64> {
        echelon_of(columns(seen), 5)
    }

    fn columns(seen: [f64; 3]) -> Mat<f64> {
        let rows = 400_f64;
        let mut t = Mat::zeros(5, 5);
        (t[(0, 0)], t[(0, 1)], t[(0, 4)]) = (10.0, 5.0, 2.0);
        for (k, (size, seen)) in [(100.0, seen[0]), (0.5, seen[1]), (0.0, seen[2])].into_iter().enumerate() {
            (t[(k + 1, k + 1)], t[(k + 1, 4)]) = (size, seen);
        }
        t[(4, 4)] = 0.1 * (rows - 4.0).sqrt();
        t
    }

    #[test]
    fn what_the_rows_do_not_tell_is_as_large_as_what_they_tell() {
        let solution = Generalised::of(&triangle([5.0, 0.05, 0.0]), 1, &[false; 3], 400);
        let lags = solution.lags.unwrap();
        assert!((lags.likely[0] - 0.05).abs() < 1e-4 && lags.likely[2].abs() < 1e-12, "{:?}", lags.likely);
        let error = |j: usize| (0..3).map(|k| lags.errors[(j, k)].powi(2)).sum::<f64>().sqrt();
        assert!((error(0) - 1e-3).abs() < 1e-4, "{}", error(0));
        assert!((0.02..0.2).contains(&error(2)) && (0.02..0.2).contains(&error(1)), "{} {}", error(1), error(2));
        assert!((solution.told[0] - (2.0 - 5.0 * lags.likely[0]) / 10.0).abs() < 1e-12);
    }

    #[test]
    fn noise_alone_has_no_lags() {
        let solution = Generalised::of(&triangle([0.2, 0.1, 0.1]), 1, &[false; 3], 400);
        assert!(solution.lags.is_none());
        assert!((solution.told[0] - 0.2).abs() < 1e-12);
    }

    /// Dynamics of one amplitude that shows a lot, creep that is seen to be small.
    #[test]
    fn creep_has_a_size_of_its_own() {
        let mut t = columns([90.0, 0.0, 0.0]);
        (t[(2, 2)], t[(2, 4)]) = (100.0, 0.5);
        let t = echelon_of(t, 5);
        let error = |creeps: [bool; 3]| {
            let lags = Generalised::of(&t, 1, &creeps, 400).lags.unwrap();
            (0..3).map(|k| lags.errors[(2, k)].powi(2)).sum::<f64>().sqrt()
        };
        let (alike, apart) = (error([false; 3]), error([false, true, true]));
        assert!(alike > 0.3 && apart < 0.03, "{alike} {apart}");
    }

    /// A column of this share of a, b, q and r, at this place.
    type Dependent = (usize, [f64; 4]);

    /// From rows of two columns a and b that are told, two lags q and r, and the residual 0.3 a - 0.2 b + `size` (0.5 q - 0.4 r) + noise,
    /// with a dependent column inserted: then `told` columns are told.
    fn solution(size: f64, noise: f64, told: usize, dependent: Option<Dependent>) -> Generalised {
        const ROWS: usize = 400;
        let numbers = white(5 * ROWS);
        let columns = 5 + usize::from(dependent.is_some());
        let mut factor = TriangularFactor::new(columns);
        for number in numbers.chunks_exact(5) {
            let [a, b, q, r, e] = [number[0], number[1] + 3.0, number[2] + 0.5 * number[0], number[3], number[4]];
            let residual = 0.3 * a - 0.2 * b + size * (0.5 * q - 0.4 * r) + noise * 3.0_f64.sqrt() * e;
            let mut row = vec![a, b, q, r, residual];
            if let Some((place, parts)) = dependent {
                row.insert(place, [a, b, q, r].iter().zip(parts).map(|(column, part)| column * part).sum());
            }
            factor.push(&row);
        }
        Generalised::of(&factor.finish(), told, &vec![false; columns - 1 - told], ROWS)
    }

    fn error(lags: &Amplitudes, parts: &[f64]) -> f64 {
        let along = |k: usize| parts.iter().enumerate().map(|(j, part)| part * lags.errors[(j, k)]).sum::<f64>();
        (0..lags.errors.ncols()).map(|k| along(k).powi(2)).sum::<f64>().sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// A column that is told and depends on others changes nothing, wherever it stands, also one of zeros: what it
        /// does is zero, or its share in what those before it do together.
        #[test]
        fn a_dependent_column_that_is_told_changes_nothing(
            place in 0..3_usize,
            (of_a, of_b) in (-2.0..2.0_f64, -2.0..2.0_f64),
            is_zero in any::<bool>(),
            size in prop::sample::select(vec![0.0, 1.0, 30.0]),
        ) {
            let parts = if is_zero { [0.0; 4] } else { [of_a, of_b, 0.0, 0.0] };
            let plain = solution(size, 0.1, 2, None);
            let with = solution(size, 0.1, 3, Some((place, parts)));
            // What a and b are multiplied by.
            let mut values = with.told.clone();
            let dependent = values.remove(place);
            // Rounding of a column whose direction is that of a difference of the others.
            let rounding = 1e-9 / (of_a * of_b).abs().min(1.0);
            for (i, value) in values.iter().enumerate() {
                prop_assert!((value + parts[i] * dependent - plain.told[i]).abs() < rounding, "{with:?} {plain:?}");
            }
            prop_assert_eq!(with.lags.is_some(), plain.lags.is_some());
            if let (Some(with), Some(plain)) = (with.lags, plain.lags) {
                for j in 0..2 {
                    prop_assert!((with.likely[j] - plain.likely[j]).abs() < rounding);
                    let parts = [[1.0, 0.0], [0.0, 1.0]][j];
                    prop_assert!((error(&with, &parts) / error(&plain, &parts) - 1.0).abs() < rounding);
                }
            }
        }

        /// A lag that depends on others shares in what they do together, and changes neither that nor its error, nor
        /// what is told. Where amplitudes are small beside their errors the prior draws a sum of three less towards
        /// zero than one of two: by less than a hundredth of an amplitude that is as large as here.
        #[test]
        fn a_dependent_lag_changes_nothing(
            place in 2..5_usize,
            (of_q, of_r) in (-1.0..1.0_f64, -1.0..1.0_f64),
            size in prop::sample::select(vec![0.0, 1.0, 30.0]),
        ) {
            let plain = solution(size, 0.1, 2, None);
            let with = solution(size, 0.1, 2, Some((place, [0.0, 0.0, of_q, of_r])));
            prop_assert_eq!(with.lags.is_some(), plain.lags.is_some());
            for (with, plain) in with.told.iter().zip(&plain.told) {
                prop_assert!((with - plain).abs() < 3e-3, "{with} {plain}"); // a third of its error
            }
            let (Some(with), Some(plain)) = (with.lags, plain.lags) else { return Ok(()) };
            for j in 0..2 {
                let alone = [[1.0, 0.0], [0.0, 1.0]][j];
                let mut parts = alone.to_vec();
                parts.insert(place - 2, [of_q, of_r][j]);
                let effect: f64 = parts.iter().zip(&with.likely).map(|(part, c)| part * c).sum();
                prop_assert!((effect - plain.likely[j]).abs() < 0.01 * plain.likely[j].abs(), "{effect} {:?}", plain.likely);
                prop_assert!((error(&with, &parts) / error(&plain, &alone) - 1.0).abs() < 0.01);
            }
        }
    }

    /// What is told makes all of a lag: the rows say nothing of it, and it stays as large as those of which they say
    /// something.
    #[test]
    fn a_lag_that_is_told_keeps_its_size() {
        let plain = solution(1.0, 0.1, 2, None);
        let with = solution(1.0, 0.1, 2, Some((2, [2.0, 0.5, 0.0, 0.0])));
        assert!(
            with.told.iter().zip(&plain.told).all(|(with, plain)| (with - plain).abs() < 1e-9),
            "{with:?} {plain:?}"
        );
        let (with, plain) = (with.lags.unwrap(), plain.lags.unwrap());
        assert!(with.likely[0].abs() < 1e-9 && (with.likely[1] - plain.likely[0]).abs() < 1e-9);
        assert!((0.2..2.0).contains(&error(&with, &[1.0, 0.0, 0.0])), "{:?}", with.errors);
        assert!((error(&with, &[0.0, 1.0, 0.0]) / error(&plain, &[1.0, 0.0]) - 1.0).abs() < 1e-9);
    }

    /// The noise is that of the rows whatever column depends.
    #[test]
    fn noise_alone_has_no_lags_beside_a_dependent_column() {
        let of_lags = [(2, [0.0; 4]), (2, [1.0, 0.5, 0.0, 0.0]), (3, [0.0, 0.0, 0.5, 0.0]), (4, [0.0, 0.0, 1.0, 1.0])];
        for (told, dependent) in of_lags.map(|lag| (2, lag)).into_iter().chain([(3, (1, [0.5, 0.0, 0.0, 0.0]))]) {
            let with = solution(0.0, 0.1, told, Some(dependent));
            assert!(with.lags.is_none(), "{dependent:?} {with:?}");
            assert!(with.told.iter().all(|value| value.is_finite()), "{dependent:?} {with:?}");
        }
    }

    /// Lags that make all of the residual are told to rounding. One that is told has none, and neither has one of
    /// zeros.
    #[test]
    fn without_noise_all_is_told() {
        let cases = [(2, None), (3, Some((1, [0.5, 0.0, 0.0, 0.0]))), (2, Some((4, [0.0, 0.0, 0.0, 1.0])))];
        for (told, dependent) in cases {
            let Generalised { told: values, lags } = solution(1.0, 0.0, told, dependent);
            let lags = lags.unwrap();
            assert!((lags.likely[0] - 0.5).abs() < 1e-9, "{dependent:?} {:?}", lags.likely);
            assert!((lags.likely[1..].iter().sum::<f64>() + 0.4).abs() < 1e-9, "{dependent:?} {:?}", lags.likely);
            assert!(error(&lags, &[1.0, 0.0]) < 1e-9 && values.iter().all(|value| value.is_finite()), "{dependent:?}");
            let without = solution(0.0, 0.0, told, dependent);
            assert!(without.lags.is_none() && (without.told[told - 1] + 0.2).abs() < 1e-9, "{dependent:?} {without:?}");
        }
        // Also where rounding leaves nothing, or something of lags that are not there.
        let mut exact = triangle([5.0, 0.05, 0.0]);
        exact[(3, 4)] = 0.0;
        let lags = Generalised::of(&exact, 1, &[false; 3], 400).lags.unwrap();
        assert!((lags.likely[0] - 0.05).abs() < 1e-9 && (lags.likely[1] - 0.1).abs() < 1e-9, "{:?}", lags.likely);
        let mut exact = triangle([1e-15, 1e-15, 0.0]);
        exact[(3, 4)] = 0.0;
        assert!(Generalised::of(&exact, 1, &[false; 3], 400).lags.is_none());
        let nothing = Generalised::of(&Mat::zeros(4, 4), 2, &[false], 100);
        assert!(nothing.lags.is_none() && nothing.told == [0.0; 2]);
    }
}
