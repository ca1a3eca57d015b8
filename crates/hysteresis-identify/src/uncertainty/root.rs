//! The covariance of a fit, as a root: for white residuals, and for others.
//!
//! Least squares makes p - p_true = (J'J)^-1 J'e. What is left, e, is taken as e = L c + v:
//!
//! - v is noise, stationary in every record, with the spectrum of an autoregressive model (`fit::colour`). Its part of
//!   J'e has the covariance J' Omega J, the sum of squares of the rows of J through the filter of that model.
//! - L c is what a linear part that the model lacks adds to its output, a sum of lags (`lags.rs`). It follows the drive
//!   as J does, so it adds up where noise averages out. It counts if noise alone would hardly ever show as much.
//!
//! c and the model of v come from generalised least squares: rows whitened by the model of what least squares leaves, c
//! and p together, and then once more with the model of what that leaves. This sees also noise at the frequencies of
//! the drive, of which the plain residual has lost a part to the parameters. The covariance is the mean square of p -
//! p_true under c +- its errors.

use faer::Mat;
use hysteresis_control::linear::Dynamics;

use crate::algebra::factor::{Echelon, TriangularFactor, back_substitute, echelon_of, triangle_of};
use crate::fit::colour::{Autoregression, ROUNDING, RowFilter};
use crate::fit::point::Parameter;
use crate::fit::projection::{Linearised, ProjectedFit};
use crate::fit::response::Chain;
use crate::fit::space::Space;
use crate::fit::tangent::Tangent;
use crate::records::course::Course;
use crate::records::record::{Record, largest_range};
use crate::records::signal::as_f64;
use crate::terms::weights::WeightBasis;
use crate::uncertainty::lags::{Amplitudes, Generalised, Lags};

/// What is reported of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// The weight of a column.
    Weight(usize),
    Ra,
    Rb,
    Rc,
    InputOffset,
    DeadTime,
    /// Of a mode by its number, 0 for the first one, or of a lag.
    Frequency(usize),
    Damping(usize),
    Gain(usize),
    /// Dead time and lags of amplifier and dynamics together.
    Lag,
    Creep(usize),
    /// The amplitude of the slow gain, and its time constant.
    SlowGain,
    SlowGainTime,
}

/// A quantity as a sum of fitted parameters, unknowns of the weights first, each with its factor. Known ones are left
/// out.
type Gradient = Vec<(usize, f64)>;

/// The frequency of a mode, 0 for the first one, or of a lag.
pub(crate) fn log_frequency(mode: usize) -> Parameter {
    mode.checked_sub(1).map_or(Parameter::LogFrequency, Parameter::ModeLogFrequency)
}

pub(crate) fn log_damping(mode: usize) -> Parameter {
    mode.checked_sub(1).map_or(Parameter::LogDamping, Parameter::ModeLogDamping)
}

/// The gradients at a fit.
pub(crate) struct Gradients<'a> {
    pub(crate) fit: &'a ProjectedFit,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) space: &'a Space,
}

impl Gradients<'_> {
    pub(crate) fn of(&self, quantity: Quantity) -> Gradient {
        let point = &self.fit.point;
        match quantity {
            Quantity::Weight(i) => (0..self.fit.unknowns.len())
                .map(|j| (j, self.basis.derivative(i, j)))
                .filter(|(_, slope)| *slope != 0.0)
                .collect(),
            Quantity::Ra => self.searched(&[(Parameter::Ra, 1.0)]),
            // rb is searched as its share of ra.
            Quantity::Rb => self.searched(&[
                (Parameter::Ra, point.get(Parameter::RbShare)),
                (Parameter::RbShare, point.get(Parameter::Ra)),
            ]),
            Quantity::Rc => self.searched(&[(Parameter::Rc, 1.0)]),
            Quantity::InputOffset => self.searched(&[(Parameter::InputOffset, 1.0)]),
            Quantity::DeadTime => self.searched(&[(Parameter::DeadTime, 1.0)]),
            Quantity::Frequency(mode) => {
                let parameter = log_frequency(mode);
                self.searched(&[(parameter, point.get(parameter).exp())])
            }
            Quantity::Damping(mode) => {
                let parameter = log_damping(mode);
                self.searched(&[(parameter, point.get(parameter).exp())])
            }
            // The first mode has what the others leave.
            Quantity::Gain(0) => {
                let others: Vec<_> =
                    (1..self.space.modes()).map(|mode| (Parameter::ModeGain(mode - 1), -1.0)).collect();
                self.searched(&others)
            }
            Quantity::Gain(mode) => self.searched(&[(Parameter::ModeGain(mode - 1), 1.0)]),
            Quantity::Creep(number) => self.searched(&[(Parameter::Creep(number), 1.0)]),
            Quantity::SlowGain => self.searched(&[(Parameter::SlowGain, 1.0)]),
            Quantity::SlowGainTime => {
                let parameter = Parameter::SlowGainLogTime;
                self.searched(&[(parameter, point.get(parameter).exp())])
            }
            Quantity::Lag => self.searched(&self.slopes_of_lag()),
        }
    }

    /// How the lag of dead time, amplifier and dynamics changes.
    fn slopes_of_lag(&self) -> Vec<(Parameter, f64)> {
        let part = self.space.linear_part(&self.fit.point);
        let mut slopes = vec![(Parameter::DeadTime, 1.0), (Parameter::LogBandwidth, -part.amplifier_lag())];
        if let Some(Dynamics::FirstOrder(lag)) = part.dynamics {
            slopes.push((Parameter::LogFrequency, -lag.time_constant()));
        }
        let modes = part.modes();
        for (number, mode) in modes.iter().enumerate() {
            let lag = mode.gain * mode.lag();
            slopes.extend([(log_frequency(number), -lag), (log_damping(number), lag)]);
            if number > 0 {
                slopes.push((Parameter::ModeGain(number - 1), mode.lag() - modes[0].lag()));
            }
        }
        slopes
    }

    fn searched(&self, slopes: &[(Parameter, f64)]) -> Gradient {
        let (unknowns, axes) = (self.fit.unknowns.len(), self.space.axes());
        let place = |parameter| axes.iter().position(|axis| axis.parameter == parameter);
        slopes.iter().filter_map(|(parameter, slope)| Some((unknowns + place(*parameter)?, *slope))).collect()
    }
}

/// A column whose part beside the others is below this share of its norm tells nothing of its parameter.
const MIN_INDEPENDENT_SHARE: f64 = 1e-9;

/// The root of the covariance of what was fitted: the covariance is X X'. Its rows are what the records have of their
/// own, first the output offset of the first record, then the free unknowns of the weights, then the free searched
/// parameters.
///
/// What lies at a bound has no place in it, and neither has what depends on others.
pub(crate) struct Root {
    pub(crate) x: Mat<f64>,
    /// The row of every parameter.
    pub(crate) places: Vec<Option<usize>>,
    /// How many of the parameters are unknowns of the weights.
    unknowns: usize,
    /// The standard deviation s of one sample.
    pub(crate) deviation: f64,
}

impl Root {
    /// For white residuals: s R^-1, with R the triangle of the columns, so that X X' is s^2 (J'J)^-1.
    pub(crate) fn of(fit: &ProjectedFit, linearised: &Linearised, space: &Space, rows: usize) -> Self {
        let unknowns = fit.unknowns.len();
        let inside = |value: f64, lower: f64, upper: f64| lower < value && value < upper;
        let mut free: Vec<usize> = (0..unknowns).filter(|j| fit.unknowns[*j] != 0.0).collect();
        for (k, axis) in space.axes().iter().enumerate() {
            if inside(fit.point.get(axis.parameter), axis.lower, axis.upper) {
                free.push(unknowns + k);
            }
        }
        white_root(fit, linearised, free, rows)
    }

    /// Whether all parameters of a gradient have a place.
    pub(crate) fn tells(&self, gradient: &Gradient) -> bool {
        gradient.iter().all(|(parameter, _)| self.places[*parameter].is_some())
    }

    /// The same with another covariance, in which only these rows are told.
    pub(crate) fn with(self, x: Mat<f64>, told: &[usize]) -> Self {
        let places = self.places.iter().map(|place| place.filter(|row| told.contains(row))).collect();
        Self { x, places, ..self }
    }

    /// The parameters that have a place, in the order of their rows.
    pub(crate) fn free(&self) -> Vec<usize> {
        (0..self.places.len()).filter(|parameter| self.places[*parameter].is_some()).collect()
    }

    /// X'g for the output offset of the first record.
    pub(crate) fn of_offset(&self) -> Vec<f64> {
        (0..self.x.ncols()).map(|k| self.x[(0, k)]).collect()
    }

    /// How many of its columns come from noise: the first ones, as many as there are rows. What the model lacks has the
    /// others.
    pub(crate) fn of_noise(&self) -> usize {
        self.x.nrows()
    }

    /// X'g for a gradient g; what has no place counts as known.
    pub(crate) fn along(&self, gradient: &Gradient) -> Vec<f64> {
        let mut sum = vec![0.0; self.x.ncols()];
        for (parameter, slope) in gradient {
            if let Some(place) = self.places[*parameter] {
                sum.iter_mut().enumerate().for_each(|(k, sum)| *sum += slope * self.x[(place, k)]);
            }
        }
        sum
    }

    /// The standard error of a sum of parameters: zero of none, and not a number if a searched one has no place, at a
    /// bound or not told. Of weights, those at zero count as known.
    pub(crate) fn error_of(&self, gradient: &Gradient) -> f64 {
        let is_untold =
            |(parameter, _): &(usize, f64)| *parameter >= self.unknowns && self.places[*parameter].is_none();
        if gradient.iter().any(is_untold) {
            return f64::NAN;
        }
        self.along(gradient).iter().map(|e| e * e).sum::<f64>().sqrt()
    }
}

/// s R^-1 of the records' own columns and the free ones, those left out that depend on others.
fn white_root(fit: &ProjectedFit, linearised: &Linearised, mut free: Vec<usize>, rows: usize) -> Root {
    let (a, _) = linearised.below_own();
    let r = loop {
        let r = triangle_of(Mat::from_fn(a.nrows().max(free.len()), free.len(), |i, j| {
            if i < a.nrows() { a[(i, free[j])] } else { 0.0 }
        }));
        let depends =
            |place: &usize| r[(*place, *place)].abs() <= MIN_INDEPENDENT_SHARE * a.col(free[*place]).norm_l2();
        match (0..free.len()).find(depends) {
            Some(place) => free.remove(place),
            None => break r,
        };
    };
    let (own, (of_own, above)) = (linearised.own(), linearised.own_rows());
    // The columns that are told, and their rows of the triangle.
    let told: Vec<usize> = of_own.iter().copied().chain(free.iter().map(|j| own + j)).collect();
    let whole = Mat::from_fn(told.len(), told.len(), |i, j| match (i.checked_sub(of_own.len()), j) {
        (None, j) => above[(i, told[j])],
        (Some(_), j) if j < of_own.len() => 0.0,
        (Some(i), j) => r[(i, j - of_own.len())],
    });
    let estimated = free.len() + of_own.len();
    let s = (fit.squares / as_f64(rows.saturating_sub(estimated).max(1))).sqrt();
    // One of the records' own columns that depends on others has a row of zeros.
    let of_told: Vec<usize> = of_own.iter().copied().chain(own..own + free.len()).collect();
    let mut x = Mat::zeros(own + free.len(), own + free.len());
    for k in 0..told.len() {
        let mut column = vec![0.0; told.len()];
        column[k] = s;
        back_substitute(whole.as_ref(), &mut column);
        column.into_iter().enumerate().for_each(|(i, value)| x[(of_told[i], k)] = value);
    }
    let mut places = vec![None; a.ncols()];
    free.iter().enumerate().for_each(|(place, parameter)| places[*parameter] = Some(own + place));
    Root { x, places, unknowns: fit.unknowns.len(), deviation: s }
}

/// Lags are looked for in records of so many rows for each column.
const ROWS_PER_COLUMN: usize = 10;

/// A record is never taken for less noisy than this share of the noise of all.
const MIN_NOISE_SHARE: f64 = 1e-3;

/// A fit, and what it is a fit of.
pub(crate) struct ColouredFit<'a> {
    pub(crate) records: &'a [Record<'a>],
    pub(crate) space: &'a Space,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) fit: &'a ProjectedFit,
    pub(crate) chain: &'a Chain,
}

impl ColouredFit<'_> {
    /// The root of the covariance, from that for white residuals; the same where they are white or rounding.
    pub(crate) fn root(&self, white: Root, penalty: &Mat<f64>) -> Root {
        let range = largest_range(self.records);
        if white.deviation <= ROUNDING * range || white.free().is_empty() {
            return white;
        }
        let free = white.free();
        let pass = Pass::new(self, &free, white.deviation);
        let models = pass.models(pass.colours.clone());
        let first = pass.solved(&pass.whitened(&models), &models);
        if first.lags.is_none() && models.iter().all(|model| model.order() == 0) {
            return white;
        }
        let (plain, models) = pass.after(&first);
        let (whitened, coloured) = pass.whitened_and_coloured(&models);
        let mut second = pass.solved(&whitened, &models);
        if first.lags.is_none() {
            second.lags = None;
        }
        let penalty = Mat::from_fn(penalty.nrows(), pass.told(), |i, j| match j.checked_sub(pass.own) {
            Some(j) if free[j] < self.fit.unknowns.len() => penalty[(i, free[j])],
            _ => 0.0,
        });
        let (mut x, told) = coloured_root(&plain, &coloured, &penalty, &second, white.deviation);
        pass.count_delays(&second, &mut x);
        white.with(x, &told)
    }
}

/// The way through the records, row by row: [the records' own | columns of the weights | derivatives | lags |
/// residual].
struct Pass<'a> {
    fit: &'a ColouredFit<'a>,
    tangent: Tangent,
    courses: Vec<Course>,
    lags: Lags,
    own: usize,
    /// The free parameters, unknowns of the weights first.
    free: &'a [usize],
    deviation: f64,
    /// Of every record the modelled output, all samples, and what it leaves of the fitted ones.
    outputs: Vec<Vec<f64>>,
    residuals: Vec<Vec<f64>>,
    /// The models of these residuals.
    colours: Vec<Autoregression>,
}

impl<'a> Pass<'a> {
    fn new(fit: &'a ColouredFit<'a>, free: &'a [usize], deviation: f64) -> Self {
        let ColouredFit { records, space, basis, .. } = *fit;
        let courses: Vec<_> = records.iter().map(|record| Course::new(record, 1, space.unread_samples())).collect();
        let own = space.own().len();
        let intervals = space.intervals();
        let output = |place: usize| fit.chain.response_in(place, records[place].input(), intervals.of_record(place));
        let outputs: Vec<Vec<f64>> = (0..records.len()).map(output).collect();
        let residual = |place: usize| {
            let (course, output): (&Course, &[f64]) = (&courses[place], &outputs[place]);
            let left = |k: usize| records[place].output()[k] - output[k] - fit.fit.output_offsets[place];
            (0..course.len()).map(|row| left(course.sample(row))).collect()
        };
        let residuals: Vec<Vec<f64>> = (0..records.len()).map(residual).collect();
        let lags = Lags::new(intervals.smallest(), intervals.longest_record());
        let lags = lags.beside_creep(&fit.chain.linear.time_constants);
        let colours: Vec<_> = residuals.iter().map(|residuals| Autoregression::of(residuals)).collect();
        let with_ringing =
            |lags: Lags, (place, colour): (usize, &_)| lags.with_ringing(colour, intervals.of_record(place));
        let lags = colours.iter().enumerate().fold(lags, with_ringing);
        let rows: usize = courses.iter().map(Course::len).sum();
        let lags = if rows < ROWS_PER_COLUMN * (own + free.len() + lags.len()) { Lags::none() } else { lags };
        let tangent = space.tangent(&fit.fit.point, basis.columns(), Some(&fit.fit.weights));
        Self { fit, tangent, courses, lags, own, free, deviation, outputs, residuals, colours }
    }

    /// How many columns there are.
    fn columns(&self) -> usize {
        self.own + self.tangent.columns + self.tangent.slopes.len() + self.lags.len() + 1
    }

    /// How many of them are fitted: the records' own and the free ones.
    fn told(&self) -> usize {
        self.own + self.free.len()
    }

    /// Hands over the rows of one record, numbered.
    fn walk(&self, place: usize, mut take: impl FnMut(usize, &[f64])) {
        let (course, dt) = (&self.courses[place], self.fit.space.intervals().of_record(place));
        let mut rows = self.tangent.rows(self.fit.records[place].input(), dt, None);
        let output = &self.outputs[place];
        let mut lags = self.lags.of_record(output[0], dt);
        let last = self.columns() - 1;
        let first_lag = last - self.lags.len();
        let (mut row, mut seen) = (vec![0.0; last + 1], 0);
        for number in 0..course.len() {
            let k = course.sample(number);
            self.fit.space.own().write(place, k, &mut row[..self.own]);
            rows.write(k, &mut row[self.own..first_lag]);
            while seen <= k {
                lags.next(output[seen], &mut row[first_lag..last]);
                seen += 1;
            }
            row[last] = self.residuals[place][number];
            take(number, &row);
        }
    }

    /// The triangle of [the records' own | free | lags | residual] from that of all columns.
    fn selected(&self, factor: TriangularFactor) -> Mat<f64> {
        let all = self.fit.basis.in_unknowns(factor.finish().as_ref(), self.own);
        let from = all.ncols() - self.lags.len() - 1;
        let chosen: Vec<usize> =
            (0..self.own).chain(self.free.iter().map(|j| self.own + j)).chain(from..all.ncols()).collect();
        echelon_of(Mat::from_fn(all.nrows(), chosen.len(), |i, j| all[(i, chosen[j])]), chosen.len())
    }

    /// The models of what is left in every record, enlarged to the noise of which the fit took a part.
    fn models(&self, left: Vec<Autoregression>) -> Vec<Autoregression> {
        let rows: usize = self.courses.iter().map(Course::len).sum();
        let taken = (as_f64(rows) / as_f64(rows.saturating_sub(self.told()).max(1))).sqrt();
        let enlarged = |model: Autoregression| {
            let deviation = (taken * model.deviation).max(MIN_NOISE_SHARE * self.deviation);
            Autoregression { deviation, ..model }
        };
        left.into_iter().map(enlarged).collect()
    }

    /// The rows that are left when they are whitened.
    fn rows_whitened(&self, models: &[Autoregression]) -> usize {
        self.courses.iter().zip(models).map(|(course, model)| course.len().saturating_sub(model.order())).sum()
    }

    /// The solution from the triangle of the rows that these models whitened.
    fn solved(&self, whitened: &Mat<f64>, models: &[Autoregression]) -> Generalised {
        Generalised::of(whitened, self.told(), &self.lags.are_creep(), self.rows_whitened(models))
    }

    /// The triangle of the whitened rows.
    fn whitened(&self, models: &[Autoregression]) -> Mat<f64> {
        let mut factor = TriangularFactor::new(self.columns());
        for (place, model) in models.iter().enumerate() {
            let mut filter = RowFilter::new(model, self.columns());
            self.walk(place, |_, row| filter.whitened(row).into_iter().for_each(|row| factor.push(row)));
        }
        self.selected(factor)
    }

    /// The triangle of the plain rows, and the models of what a solution leaves.
    fn after(&self, solution: &Generalised) -> (Mat<f64>, Vec<Autoregression>) {
        let along = self.in_columns(solution);
        let mut factor = TriangularFactor::new(self.columns());
        let mut left = Vec::with_capacity(self.residuals.len());
        for place in 0..self.residuals.len() {
            let mut series = Vec::with_capacity(self.residuals[place].len());
            self.walk(place, |_, row| {
                factor.push(row);
                let (columns, residual) = row.split_at(along.len());
                series.push(residual[0] - columns.iter().zip(&along).map(|(z, c)| z * c).sum::<f64>());
            });
            left.push(Autoregression::of(&series));
        }
        (self.selected(factor), self.models(left))
    }

    /// What multiplies every column of a row in a solution.
    fn in_columns(&self, solution: &Generalised) -> Vec<f64> {
        let mut along = vec![0.0; self.columns() - 1];
        along[..self.own].copy_from_slice(&solution.told[..self.own]);
        let unknowns = self.fit.fit.unknowns.len();
        for (parameter, value) in self.free.iter().zip(&solution.told[self.own..]) {
            match parameter.checked_sub(unknowns) {
                Some(axis) => along[self.own + self.tangent.columns + axis] = *value,
                None => (0..self.tangent.columns)
                    .for_each(|i| along[self.own + i] += self.fit.basis.derivative(i, *parameter) * value),
            }
        }
        let first_lag = along.len() - self.lags.len();
        if let Some(lags) = &solution.lags {
            along[first_lag..].copy_from_slice(&lags.likely);
        }
        along
    }

    /// Lags of dynamics that the model lacks belong to its dead time, if that is searched: the lag of both is what it
    /// estimates.
    fn count_delays(&self, solution: &Generalised, x: &mut Mat<f64>) {
        let space = self.fit.space;
        let Some(axis) = space.axes().iter().position(|axis| axis.parameter == Parameter::DeadTime) else { return };
        let parameter = self.fit.fit.unknowns.len() + axis;
        let Some(row) = self.free.iter().position(|free| *free == parameter).map(|place| self.own + place) else {
            return;
        };
        let Some(lags) = &solution.lags else { return };
        let delays = self.lags.delays(space.intervals().smallest());
        for k in 0..lags.root_columns() {
            let delay: f64 = delays.iter().enumerate().map(|(j, delay)| delay * lags.root(j, k)).sum();
            x[(row, self.told() + k)] -= delay;
        }
    }

    /// The triangle of the whitened rows, and that of the coloured ones.
    fn whitened_and_coloured(&self, models: &[Autoregression]) -> (Mat<f64>, Mat<f64>) {
        /// The filter has rung out where a row is this share of the largest.
        const RUNG_OUT: f64 = 1e-4;
        let columns = self.columns();
        let (mut white, mut coloured) = (TriangularFactor::new(columns), TriangularFactor::new(columns));
        for (place, model) in models.iter().enumerate() {
            let (mut whitening, mut colouring) = (RowFilter::new(model, columns), RowFilter::new(model, columns));
            let (mut largest, norm) = (0.0_f64, |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>().sqrt());
            self.walk(place, |_, row| {
                whitening.whitened(row).into_iter().for_each(|row| white.push(row));
                let row = colouring.coloured(row);
                largest = largest.max(norm(row));
                coloured.push(row);
            });
            // What a stationary noise adds behind the end.
            let zeros = vec![0.0; columns];
            for _ in 0..if model.order() > 0 { self.courses[place].len() } else { 0 } {
                let row = colouring.coloured(&zeros);
                coloured.push(row);
                if norm(row) <= RUNG_OUT * largest {
                    break;
                }
            }
        }
        (self.selected(white), self.selected(coloured))
    }
}

/// X with X X' = A^-1 (J' Omega J + s^2 P'P + J'L M L'J) A^-1, with A = J'J + P'P, P the penalty, which is taken as
/// prior information, and M the mean square of the amplitudes of the lags. Beside it which columns are told: what
/// depends on others has a row of zeros.
fn coloured_root(
    plain: &Mat<f64>,
    coloured: &Mat<f64>,
    penalty: &Mat<f64>,
    solution: &Generalised,
    deviation: f64,
) -> (Mat<f64>, Vec<usize>) {
    let told = penalty.ncols();
    let extra = solution.lags.as_ref().map_or(0, Amplitudes::root_columns);
    let of_lags = |i: usize, k: usize| -> f64 {
        let amplitudes = solution.lags.iter().flat_map(|lags| (0..lags.likely.len()).map(move |j| lags.root(j, k)));
        amplitudes.enumerate().map(|(j, amplitude)| plain[(i, told + j)] * amplitude).sum()
    };
    // R with R'R = A, and beside it Q'L times the root of M.
    let r = Mat::from_fn(plain.nrows() + penalty.nrows(), told + extra, |i, j| {
        match (i.checked_sub(plain.nrows()), j.checked_sub(told)) {
            (Some(i), None) => penalty[(i, j)],
            (Some(_), Some(_)) => 0.0,
            (None, Some(k)) => of_lags(i, k),
            (None, None) => plain[(i, j)],
        }
    });
    let r = echelon_of(r, told);
    let noise = triangle_of(Mat::from_fn(coloured.nrows() + penalty.nrows(), told, |i, j| {
        match i.checked_sub(coloured.nrows()) {
            Some(i) => deviation * penalty[(i, j)],
            None => coloured[(i, j)],
        }
    }));
    let echelon = Echelon::of(r.as_ref());
    let pivots = &echelon.pivots[..echelon.rank(told)];
    let mut x = Mat::zeros(told, told + extra);
    for k in 0..told + extra {
        let mut column: Vec<f64> = match k.checked_sub(told) {
            None => pivots.iter().map(|i| noise[(k, *i)]).collect(),
            Some(k) => (0..pivots.len()).map(|i| r[(i, told + k)]).collect(),
        };
        if k < told {
            for (i, pivot) in pivots.iter().enumerate() {
                let head: f64 = (0..i).map(|j| r[(j, *pivot)] * column[j]).sum();
                column[i] = (column[i] - head) / r[(i, *pivot)];
            }
        }
        echelon.solve(told, column).into_iter().enumerate().for_each(|(i, value)| x[(i, k)] = value);
    }
    (x, pivots.to_vec())
}

#[cfg(test)]
mod tests {
    use crate::records::signal::white;

    use super::*;

    /// A fitted column that depends on others is not told, and changes nothing for them.
    #[test]
    fn a_dependent_column_has_no_errors_and_changes_none() {
        let numbers = white(80);
        // Two that are told and a lag; then a third one, of zeros or the sum of the others.
        let columns = |third: Option<f64>| {
            let row = |i: usize| {
                let [a, b, lag, e] = [0, 1, 2, 3].map(|k| numbers[4 * i + k]);
                let mut row = vec![a, b, lag, 0.5 * lag + 0.01 * e];
                if let Some(share) = third {
                    row.insert(1, share * a);
                }
                row
            };
            let all: Vec<_> = (0..20).map(row).collect();
            echelon_of(Mat::from_fn(20, all[0].len(), |i, j| all[i][j]), all[0].len())
        };
        let errors = |third: Option<f64>| {
            let (plain, told) = (columns(third), 2 + usize::from(third.is_some()));
            let solution = Generalised::of(&plain, told, &[false], 20);
            assert!(solution.lags.is_some());
            let (x, told) = coloured_root(&plain, &plain, &Mat::zeros(0, told), &solution, 1.0);
            (&x * x.transpose(), told)
        };
        let (expected, all) = errors(None);
        assert_eq!(all, [0, 1]);
        for third in [0.0, 2.0] {
            let (with, told) = errors(Some(third));
            assert_eq!(told, [0, 2]);
            for (i, j) in [(0, 0), (0, 1), (1, 1)] {
                assert!((with[(2 * i, 2 * j)] - expected[(i, j)]).abs() < 1e-9, "{with:?} {expected:?}");
            }
            assert!((0..3).all(|j| with[(1, j)] == 0.0), "{with:?}");
        }
    }
}
