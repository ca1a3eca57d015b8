//! The operators: of which model they are, how many there are, where their thresholds lie, and what they put out.
//!
//! z_i(k) = max(lo, min(hi, z_i(k-1))) with lo = max(x - r, min(x - rc, 0)) and hi = min(x + ra, max(x + rb, 0)): one
//! at a time for a plain loop, or eight at once over a block of samples.

use fearless_simd::{Simd, SimdBase, SimdFloat};
use hysteresis_core::{CoupledPlay, Model, Offsets, Ratios};

use crate::algebra::eight::{LANES, Lanes, SimdLoop, dispatch, eights, load, load_all, splat, sum};
use crate::records::course::turns;
use crate::records::record::Record;
use crate::records::signal::{as_f64, bounds_of};

/// Which model to fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ModelKind {
    /// The conventional Prandtl-Ishlinskii model (CPI), equation (4): plays. It has no ratios, and its input offset
    /// moves nothing but the virgin state: [`Setting::Fit`](crate::Setting::Fit) puts it at the middle of the input
    /// range.
    Conventional,
    /// The modified Prandtl-Ishlinskii model (MPI), equation (6): coupled plays.
    #[default]
    Modified,
}

impl ModelKind {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Conventional, Self::Modified];

    /// Its name in lower case.
    ///
    /// ```
    /// use hysteresis_identify::ModelKind;
    /// assert_eq!(ModelKind::default().name(), "modified");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Conventional => "conventional",
            Self::Modified => "modified",
        }
    }
}

/// The ratios ra/r, rb/r and rc/r that the thresholds of coupled plays have, equation (3); plays are coupled plays
/// whose ratios are 1.
///
/// ```
/// use hysteresis_core::Ratios;
/// use hysteresis_identify::{Options, RatiosModel};
/// assert_eq!(Options::default().ratios, RatiosModel::Auto);
/// let known = Options { ratios: RatiosModel::Fixed(Ratios::PAPER), ..Options::default() };
/// # assert_ne!(known, Options::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RatiosModel {
    /// Those of plays, unless coupled plays predict stretches of the records better by a tenth of the error: then
    /// everything is searched once more with these. [`Fit`](Self::Fit) where weight law, smoothness and all terms are
    /// given; plays stay beside a Duhem operator that is given.
    #[default]
    Auto,
    /// Searched in 2 >= ra/r >= rb/r >= 0, 1 >= rc/r >= 0.
    Fit,
    /// Known beforehand.
    Fixed(Ratios),
}

/// The fewest operators where their number follows from the records by doubling.
const FEWEST: usize = 20;

/// The thresholds r_i of the operators, in the unit of the input.
///
/// Where their number is left to cross-validation, it is chosen with everything else in the model: dynamics, dead time,
/// creep, loop shift, maps, ratios and offsets are fitted with 20 operators (with fewer if the samples bear no more).
/// There, every number is judged on stretches of the records, each predicted from weights fitted to the others, at the
/// smoothness that suits this number, the searched parameters linearised about their values. With the number that is
/// chosen the search goes on.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Thresholds {
    /// That many operators at r_i = i X / n, i = 0..n-1, the first of them the identity.
    ///
    /// X is the largest |u - `input_offset`| of all records (skipped samples included) for coupled plays; it moves with
    /// an offset that is searched. For plays, those of the conventional model and those of [`RatiosModel::Auto`], X is
    /// half the peak-to-peak of the input: a play of threshold r moves both ways only on strokes above 2 r.
    Uniform(usize),
    /// As [`Uniform`](Self::Uniform), 20 of them, or 40 or 80 where these predict stretches of the records better: by a
    /// fiftieth of the error at least, and by more than its standard error. Each number is compared with the one
    /// before. A number that the samples do not bear is not tried.
    Refined,
    /// As [`Uniform`](Self::Uniform), as many of 4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64 and 80 as cross-validation
    /// asks for: the fewest that predict as well as the best, by the same rule as
    /// [`WeightLaw::Auto`](crate::WeightLaw::Auto); a hundredth of the error counts for nothing.
    Auto,
    /// That many operators, the first of them the identity, at quantiles of the amplitudes at which the input turns
    /// round: dense where it does so often. The amplitudes are |u - `input_offset`| at the reversals of all records,
    /// those nearer to each other than a hundredth of the largest counted once; for plays they are half the distances
    /// between successive reversals.
    Quantiles(usize),
    /// As many operators as [`Refined`](Self::Refined) would take, at [`Quantiles`](Self::Quantiles).
    RefinedQuantiles,
    /// As many operators as [`Auto`](Self::Auto) would take, at [`Quantiles`](Self::Quantiles).
    AutoQuantiles,
    /// That many operators, the first of them the identity, the others at growing distances, so that small loops have
    /// more of them: r_0 = 0 and r_i = X / q^(n - i), i = 1..n-1, X as for [`Uniform`](Self::Uniform) and q = min(2,
    /// 100^(1 / (n - 1))).
    ///
    /// From 8 operators on the smallest threshold is X / 100: a loop of a hundredth of the range is about the smallest
    /// that is told from noise, and reversals nearer to each other count once for [`Quantiles`](Self::Quantiles), too.
    /// Fewer operators lie an octave apart: thresholds further apart leave loops between them without any.
    Geometric(usize),
    /// As many operators as [`Refined`](Self::Refined) would take, at [`Geometric`](Self::Geometric).
    RefinedGeometric,
    /// As many operators as [`Auto`](Self::Auto) would take, at [`Geometric`](Self::Geometric).
    AutoGeometric,
    /// These, strictly increasing from zero or above.
    Given(Vec<f64>),
}

/// How a number of operators that is left open is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    /// 20, doubled where that predicts better.
    Refined,
    /// The fewest that predict as well as the best.
    Auto,
}

impl Thresholds {
    /// Whether their number is left to cross-validation.
    #[must_use]
    pub fn are_counted_by_validation(&self) -> bool {
        self.count().is_some()
    }

    /// How many there are; while that is left to cross-validation the fewest there may be, or 0 where these may be any.
    pub(crate) fn operators(&self) -> usize {
        match self {
            Self::Uniform(operators) | Self::Quantiles(operators) | Self::Geometric(operators) => *operators,
            Self::Given(thresholds) => thresholds.len(),
            Self::Refined | Self::RefinedQuantiles | Self::RefinedGeometric => FEWEST,
            Self::Auto | Self::AutoQuantiles | Self::AutoGeometric => 0,
        }
    }

    /// How their number is chosen; none if it is known.
    pub(crate) fn count(&self) -> Option<Count> {
        match self {
            Self::Refined | Self::RefinedQuantiles | Self::RefinedGeometric => Some(Count::Refined),
            Self::Auto | Self::AutoQuantiles | Self::AutoGeometric => Some(Count::Auto),
            Self::Uniform(_) | Self::Quantiles(_) | Self::Geometric(_) | Self::Given(_) => None,
        }
    }

    /// That many, placed alike; those that are given stay.
    #[must_use]
    pub fn of(&self, operators: usize) -> Self {
        match self {
            Self::Uniform(_) | Self::Refined | Self::Auto => Self::Uniform(operators),
            Self::Quantiles(_) | Self::RefinedQuantiles | Self::AutoQuantiles => Self::Quantiles(operators),
            Self::Geometric(_) | Self::RefinedGeometric | Self::AutoGeometric => Self::Geometric(operators),
            Self::Given(_) => self.clone(),
        }
    }

    /// 20 where they would be doubled, and all others as they are.
    #[must_use]
    pub fn unrefined(&self) -> Self {
        if self.count() == Some(Count::Refined) { self.of(FEWEST) } else { self.clone() }
    }
}

/// Reversals nearer to each other than this share of the range count once.
const MERGED: f64 = 0.01;

/// The smallest threshold of geometric ones over the reach, and the largest factor between neighbours.
const SMALLEST: f64 = 0.01;
const OCTAVE: f64 = 2.0;

/// What the thresholds are made of.
#[derive(Clone)]
pub(crate) struct Placement {
    /// Whether the operators are plays: a play of threshold r moves both ways only on strokes above 2 r.
    are_plays: bool,
    thresholds: Thresholds,
    /// The smallest and the largest input.
    low: f64,
    high: f64,
    /// The inputs at the reversals of every record, if the thresholds are made of them.
    reversals: Vec<Vec<f64>>,
}

impl Placement {
    pub(crate) fn new(records: &[Record<'_>], are_plays: bool, thresholds: &Thresholds) -> Self {
        let (low, high) = bounds_of(records.iter().map(Record::input_bounds));
        let thresholds = thresholds.clone();
        let reversals = match thresholds {
            Thresholds::Quantiles(_) => records.iter().map(|record| reversals(record, MERGED * (high - low))).collect(),
            _ => Vec::new(),
        };
        Self { are_plays, thresholds, low, high, reversals }
    }

    /// The smallest and the largest input.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// The thresholds r_i for an input offset.
    pub(crate) fn thresholds(&self, offset: f64) -> Vec<f64> {
        let reach = if self.are_plays {
            0.5 * (self.high - self.low)
        } else {
            (self.high - offset).abs().max((self.low - offset).abs())
        };
        match &self.thresholds {
            // Cross-validation puts a number in place of this before a space is made.
            Thresholds::Auto
            | Thresholds::AutoQuantiles
            | Thresholds::AutoGeometric
            | Thresholds::Refined
            | Thresholds::RefinedQuantiles
            | Thresholds::RefinedGeometric => Vec::new(),
            Thresholds::Given(thresholds) => thresholds.clone(),
            Thresholds::Uniform(n) => (0..*n).map(|i| as_f64(i) * reach / as_f64(*n)).collect(),
            Thresholds::Geometric(n) => geometric(*n, reach),
            Thresholds::Quantiles(n) => {
                let knots = self.amplitudes(offset, reach);
                (0..*n).map(|i| interpolated(&knots, as_f64(i) / as_f64(*n))).collect()
            }
        }
    }

    /// Zero, the amplitudes of the reversals in growing order and well apart, and the reach.
    fn amplitudes(&self, offset: f64, reach: f64) -> Vec<f64> {
        let mut amplitudes: Vec<f64> = if self.are_plays {
            self.reversals.iter().flat_map(|x| x.windows(2).map(|x| 0.5 * (x[1] - x[0]).abs())).collect()
        } else {
            self.reversals.iter().flatten().map(|x| (x - offset).abs()).collect()
        };
        amplitudes.sort_by(f64::total_cmp);
        let mut knots = vec![0.0];
        for amplitude in amplitudes {
            if amplitude - knots[knots.len() - 1] > MERGED * reach && amplitude < (1.0 - MERGED) * reach {
                knots.push(amplitude);
            }
        }
        knots.push(reach);
        knots
    }
}

/// Zero, and thresholds of which each is smaller than the next by the same factor, the reach behind the last.
fn geometric(n: usize, reach: f64) -> Vec<f64> {
    let factor = SMALLEST.recip().powf(1.0 / as_f64(n.saturating_sub(1).max(1))).min(OCTAVE);
    (0..n).map(|i| if i == 0 { 0.0 } else { reach / factor.powf(as_f64(n - i)) }).collect()
}

/// About the same weights at other thresholds: each is shared by the two next to it, so that sum and mean threshold
/// stay.
pub(crate) fn spread(weights: &[f64], from: &[f64], to: &[f64]) -> Vec<f64> {
    let mut spread = vec![0.0; to.len()];
    for (weight, r) in weights.iter().zip(from) {
        let above = to.partition_point(|other| other <= r).clamp(1, to.len().max(2) - 1);
        let [Some(low), Some(high)] = [above - 1, above].map(|place| to.get(place)) else {
            spread[0] += weight;
            continue;
        };
        let share = ((r - low) / (high - low)).clamp(0.0, 1.0);
        spread[above - 1] += (1.0 - share) * weight;
        spread[above] += share * weight;
    }
    spread
}

fn reversals(record: &Record<'_>, dead_band: f64) -> Vec<f64> {
    turns(record.input(), dead_band).into_iter().map(|k| record.input()[k]).collect()
}

/// The value a share of the way through evenly spaced knots, straight between them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the knots")]
fn interpolated(knots: &[f64], share: f64) -> f64 {
    let place = share * as_f64(knots.len() - 1);
    let below = (place as usize).min(knots.len() - 2);
    knots[below] + (place - as_f64(below)) * (knots[below + 1] - knots[below])
}

/// The thresholds of all operators, one array per kind, so that the compiler works on several operators at a time.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct OperatorBank {
    r: Vec<f64>,
    ra: Vec<f64>,
    rb: Vec<f64>,
    rc: Vec<f64>,
}

impl OperatorBank {
    /// The operators of thresholds `r` in these proportions: the same products as in the core.
    pub(crate) fn from_ratios(r: &[f64], ratios: Ratios) -> Self {
        let scaled = |ratio: f64| r.iter().map(|r| ratio * r).collect();
        Self { r: r.to_vec(), ra: scaled(ratios.ra), rb: scaled(ratios.rb), rc: scaled(ratios.rc) }
    }

    fn from_operators(operators: impl Iterator<Item = CoupledPlay> + Clone) -> Self {
        Self {
            r: operators.clone().map(|z| z.r()).collect(),
            ra: operators.clone().map(|z| z.ra()).collect(),
            rb: operators.clone().map(|z| z.rb()).collect(),
            rc: operators.map(|z| z.rc()).collect(),
        }
    }

    /// The operators of a model, its weights as [`Regressor::output`] takes them, and its offsets.
    pub(crate) fn of_model(model: &Model) -> (Self, Vec<f64>, Offsets) {
        match model {
            Model::Conventional(model) => {
                let plays = model.operators().iter().map(|play| CoupledPlay::from(*play));
                (Self::from_operators(plays), model.weights().to_vec(), model.offsets())
            }
            Model::Modified(model) => {
                let below = if model.is_split() { model.weights_negative() } else { &[] };
                let operators = model.operators().iter().copied();
                (Self::from_operators(operators), [model.weights(), below].concat(), model.offsets())
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.r.len()
    }

    /// The threshold r of every operator.
    pub(crate) fn thresholds(&self) -> &[f64] {
        &self.r
    }

    /// The thresholds r, ra, rb and rc of every operator.
    fn all_thresholds(&self) -> [&[f64]; 4] {
        [&self.r, &self.ra, &self.rb, &self.rc].map(Vec::as_slice)
    }

    /// z(k) = max(lo, min(hi, z(k-1))) for every operator: `CoupledPlay` of the core, as a loop over arrays.
    #[inline(always)]
    pub(crate) fn next(&self, last: &[f64], x: f64, z: &mut [f64]) {
        let n = z.len();
        let (r, ra, rb, rc, last) = (&self.r[..n], &self.ra[..n], &self.rb[..n], &self.rc[..n], &last[..n]);
        for i in 0..n {
            let lo = max(x - r[i], min(x - rc[i], 0.0));
            let hi = min(x + ra[i], max(x + rb[i], 0.0));
            z[i] = max(lo, min(hi, last[i]));
        }
    }
}

/// `f64::max` without its care for NaN, of which a record has none: one instruction, and it vectorises.
#[inline(always)]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// `f64::min` likewise.
#[inline(always)]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// So many samples make a block: what is done with it stays in the nearest cache.
pub(crate) const BLOCK: usize = 32;

/// Above so many runs a block takes both bounds at every sample: what they save is less than what their turns cost.
const MOST_RUNS: usize = BLOCK / 4;

/// Successive samples of an input at which the same bounds can move an operator.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    /// The sample behind its last one.
    end: usize,
    bounds: Bounds,
}

/// What can move an operator. A rising input only raises lo, and z is below hi already; below zero lo is x - rc, as rc
/// <= r. Likewise of a falling one, as rb <= ra.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bounds {
    Both,
    RisingBelow,
    RisingAbove,
    FallingBelow,
    FallingAbove,
}

/// What the operators are shown, block by block.
#[derive(Debug)]
pub(crate) struct Runs {
    /// The last sample of the block.
    last: Option<f64>,
    /// Its least and its greatest.
    bounds: (f64, f64),
    stand_still: bool,
    all: Vec<Run>,
}

impl Runs {
    pub(crate) fn new() -> Self {
        Self { last: None, bounds: (0.0, 0.0), stand_still: false, all: Vec::with_capacity(BLOCK) }
    }

    /// Those of the next block.
    pub(crate) fn take(&mut self, xs: &[f64]) {
        self.all.clear();
        let Some(end) = xs.last() else { return };
        // Before the first sample no operator is where it may be.
        let mut last = self.last.unwrap_or(f64::NAN);
        self.bounds = bounds_of(xs.iter().map(|x| (*x, *x)));
        self.stand_still = self.bounds == (last, last);
        for (number, x) in xs.iter().enumerate() {
            let bounds = match (*x >= last, *x <= last) {
                (true, _) if *x <= 0.0 => Bounds::RisingBelow,
                (true, _) => Bounds::RisingAbove,
                (_, true) if *x >= 0.0 => Bounds::FallingAbove,
                (_, true) => Bounds::FallingBelow,
                _ => Bounds::Both,
            };
            last = *x;
            match self.all.last_mut() {
                Some(run) if run.bounds == bounds => run.end = number + 1,
                _ => self.all.push(Run { end: number + 1, bounds }),
            }
        }
        if self.all.len() > MOST_RUNS {
            self.all.clear();
            self.all.push(Run { end: xs.len(), bounds: Bounds::Both });
        }
        self.last = Some(*end);
    }

    /// Whether every sample of the block is that which was the last before it.
    pub(crate) fn stand_still(&self) -> bool {
        self.stand_still
    }
}

/// The operators of a bank, from z = 0.
#[derive(Debug)]
pub(crate) struct BankLanes {
    thresholds: Vec<EightThresholds>,
    z: Vec<Lanes>,
    /// Which eights stood still in the last block.
    still: Vec<bool>,
}

/// Of eight operators.
#[derive(Clone, Copy, Debug)]
struct EightThresholds {
    r: Lanes,
    ra: Lanes,
    rb: Lanes,
    rc: Lanes,
}

impl BankLanes {
    pub(crate) fn new(bank: &OperatorBank) -> Self {
        // No input moves those that fill up the last eight.
        let [r, ra, rb, rc] = bank.all_thresholds().map(|thresholds| eights(thresholds, f64::INFINITY));
        let thresholds: Vec<_> =
            (0..r.len()).map(|i| EightThresholds { r: r[i], ra: ra[i], rb: rb[i], rc: rc[i] }).collect();
        let z = vec![[0.0; LANES]; thresholds.len()];
        let still = vec![false; z.len()];
        Self { thresholds, z, still }
    }

    /// Which eights stood still in the last block.
    pub(crate) fn still(&self) -> &[bool] {
        &self.still
    }

    /// How many eights of operators there are.
    pub(crate) fn eights(&self) -> usize {
        self.z.len()
    }

    /// z of every operator for every sample of a block, the first eight of them at all samples, then the next: bit for
    /// bit those of the core.
    pub(crate) fn put_out(&mut self, xs: &[f64], runs: &Runs, z: &mut [Lanes]) {
        dispatch(PutOut { lanes: self, xs, bounds: runs.bounds, runs: &runs.all, out: z });
    }
}

struct PutOut<'a> {
    lanes: &'a mut BankLanes,
    xs: &'a [f64],
    bounds: (f64, f64),
    runs: &'a [Run],
    out: &'a mut [Lanes],
}

impl SimdLoop for PutOut<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let BankLanes { thresholds, z, still } = self.lanes;
        let (least, greatest) = (splat(simd, self.bounds.0), splat(simd, self.bounds.1));
        let eights = thresholds.iter().zip(z).zip(still);
        for (((thresholds, state), still), out) in eights.zip(self.out.chunks_exact_mut(BLOCK)) {
            let EightThresholds { r, ra, rb, rc } = thresholds;
            let [r, ra, rb, rc] = load_all(simd, [r, ra, rb, rc]);
            let (zero, mut z, mut first) = (splat(simd, 0.0), load(simd, state), 0);
            // What neither end of the block moves nothing between them moves.
            let lo = (greatest - r).max((greatest - rc).min(zero));
            let hi = (least + ra).min((least + rb).max(zero));
            let (raised, lowered): (Lanes, Lanes) = (lo.max(z).into(), hi.min(z).into());
            *still = raised == *state && lowered == *state;
            if *still {
                out[..self.xs.len()].fill(*state);
                continue;
            }
            for run in self.runs {
                let samples = self.xs[first..run.end].iter().zip(&mut out[first..run.end]);
                first = run.end;
                match run.bounds {
                    Bounds::RisingBelow => {
                        for (x, out) in samples {
                            z = z.max(splat(simd, *x) - rc);
                            *out = z.into();
                        }
                    }
                    Bounds::RisingAbove => {
                        for (x, out) in samples {
                            let x = splat(simd, *x);
                            z = z.max((x - r).max((x - rc).min(zero)));
                            *out = z.into();
                        }
                    }
                    Bounds::FallingAbove => {
                        for (x, out) in samples {
                            z = z.min(splat(simd, *x) + rb);
                            *out = z.into();
                        }
                    }
                    Bounds::FallingBelow => {
                        for (x, out) in samples {
                            let x = splat(simd, *x);
                            z = z.min((x + ra).min((x + rb).max(zero)));
                            *out = z.into();
                        }
                    }
                    Bounds::Both => {
                        for (x, out) in samples {
                            let x = splat(simd, *x);
                            let lo = (x - r).max((x - rc).min(zero));
                            let hi = (x + ra).min((x + rb).max(zero));
                            z = lo.max(hi.min(z));
                            *out = z.into();
                        }
                    }
                }
            }
            *state = z.into();
        }
    }
}

/// Weights of operators, one for each, or one for its output above zero and one for that below.
#[derive(Debug)]
pub(crate) struct WeightLanes {
    above: Vec<Lanes>,
    below: Vec<Lanes>,
}

impl WeightLanes {
    /// For so many operators.
    pub(crate) fn new(weights: &[f64], operators: usize) -> Self {
        let (above, below) = weights.split_at(operators.min(weights.len()));
        Self { above: eights(above, 0.0), below: eights(below, 0.0) }
    }

    /// The weighted sums of outputs, sample by sample; `still` says which eights are the same at all of them.
    pub(crate) fn sums(&self, z: &[Lanes], still: &[bool], sums: &mut [f64]) {
        dispatch(Weigh { weights: self, z, still, sums });
    }
}

struct Weigh<'a> {
    weights: &'a WeightLanes,
    z: &'a [Lanes],
    still: &'a [bool],
    sums: &'a mut [f64],
}

impl SimdLoop for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let count = self.sums.len();
        // What stands still first, once for all samples.
        let mut total = [[0.0; LANES]];
        self.add(simd, true, &mut total);
        let mut totals = [total[0]; BLOCK];
        self.add(simd, false, &mut totals[..count]);
        for (place, total) in self.sums.iter_mut().zip(&totals) {
            *place = sum(load(simd, total));
        }
    }
}

impl Weigh<'_> {
    /// Adds the eights that stand still, or those that do not, at the first samples.
    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, still: bool, totals: &mut [Lanes]) {
        let WeightLanes { above, below } = self.weights;
        let zero = splat(simd, 0.0);
        for (number, (above, z)) in above.iter().zip(self.z.chunks_exact(BLOCK)).enumerate() {
            if self.still[number] != still {
                continue;
            }
            let above = load(simd, above);
            let rows = totals.iter_mut().zip(z);
            if let Some(below) = below.get(number) {
                let below = load(simd, below);
                for (total, z) in rows {
                    let z = load(simd, z);
                    let with_above = above.mul_add(z.max(zero), load(simd, total));
                    *total = below.mul_add(z.min(zero), with_above).into();
                }
            } else {
                for (total, z) in rows {
                    *total = above.mul_add(load(simd, z), load(simd, total)).into();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn steps() -> impl Strategy<Value = Vec<f64>> {
        // Smooth ways and jumps: both kinds of blocks.
        let smooth = (0.05..1.5_f64, 1.0..12.0_f64)
            .prop_map(|(rate, size)| (0..90).map(|k| size * (rate * f64::from(k) / 8.0).sin()).collect());
        prop_oneof![smooth, prop::collection::vec(prop_oneof![-10.0..10.0_f64, Just(1.0), Just(0.0)], 1..90)]
    }

    proptest! {
        /// Bit for bit the operators of the bank, which are those of the core, whatever the blocks; and their weighted
        /// sums.
        #[test]
        fn equals_the_bank(
            xs in steps(),
            r in prop::collection::vec(0.0..8.0_f64, 1..20),
            (ra, rb, rc) in (0.0..2.0_f64, 0.0..=1.0_f64, 0.0..=1.0_f64),
            block in 1..=BLOCK,
        ) {
            let bank = OperatorBank::from_ratios(&r, Ratios { ra, rb: rb * ra, rc });
            let (mut lanes, mut runs) = (BankLanes::new(&bank), Runs::new());
            let weights: Vec<f64> = (1_u32..).take(2 * r.len()).map(|i| 1.0 / f64::from(i)).collect();
            let (above, below) = weights.split_at(r.len());
            let (one, split) = (WeightLanes::new(above, r.len()), WeightLanes::new(&weights, r.len()));
            let mut got = vec![[f64::NAN; LANES]; lanes.eights() * BLOCK];
            let (mut last, mut z) = (vec![0.0; r.len()], vec![0.0; r.len()]);
            for xs in xs.chunks(block) {
                let mut sums = [[0.0; BLOCK]; 2];
                runs.take(xs);
                lanes.put_out(xs, &runs, &mut got);
                one.sums(&got, lanes.still(), &mut sums[0][..xs.len()]);
                split.sums(&got, lanes.still(), &mut sums[1][..xs.len()]);
                for (k, x) in xs.iter().enumerate() {
                    std::mem::swap(&mut last, &mut z);
                    bank.next(&last, *x, &mut z);
                    for (i, z) in z.iter().enumerate() {
                        prop_assert_eq!(got[i / LANES * BLOCK + k][i % LANES], *z, "sample {}, operator {}", k, i);
                    }
                    let sum: f64 = above.iter().zip(&z).map(|(w, z)| w * z).sum();
                    prop_assert!((sums[0][k] - sum).abs() < 1e-12 * (1.0 + sum.abs()));
                    let lower: f64 = below.iter().zip(&z).map(|(w, z)| w * z.min(0.0)).sum();
                    let upper: f64 = above.iter().zip(&z).map(|(w, z)| w * z.max(0.0)).sum();
                    prop_assert!((sums[1][k] - (upper + lower)).abs() < 1e-12 * (1.0 + upper - lower));
                }
            }
        }
    }
}
