//! Identification while the actuator runs: recursive least squares with forgetting, sample by sample.
//!
//! What the identifier may be told, what it does with a sample, and its state as a plain value.

pub(crate) mod covariance;
pub(crate) mod regressors;

use hysteresis_control::linear::{LinearDynamics, LinearState};
use hysteresis_core::{MAX_MAGNITUDE, Model, Offsets, check_all_finite, is_admissible};

use crate::error::Error;
use crate::options::Setting;
use crate::recursive::covariance::{Bounds, Covariance, dot};
use crate::recursive::regressors::Regressors;

/// A sample is worth forgetting for if its leverage is this much above that of one regressor repeated for ever.
const MIN_NEWS: f64 = 1.25;

/// Weights are published if their identity is more than this share of their sum: the core asks for 1e-12.
const MIN_RELATIVE_SLOPE: f64 = 1e-11;

/// And more than this, as the core asks for.
const MIN_SLOPE: f64 = 1.0 / MAX_MAGNITUDE;

/// The weights of a model that follow the measurements of a running actuator: recursive least squares with forgetting.
///
/// y(k) = `output_offset` + sum_i w_i z_i(k), z_i the operators of the given model at u - `input_offset`, through the
/// dynamics behind the hysteresis if there are any: thresholds stay, weights and output offset are estimated. Of a
/// split model max(0, z_i) and min(0, z_i) count with weights of their own. At every sample
///
/// ```text
/// s = z' P z,   g = P z / (forgetting + s),   w <- w + g (y - z' w),   P <- (P - g z' P) / forgetting
/// ```
///
/// with P = U D U' kept in factors (Bierman 1977), which rounding cannot make indefinite. At forgetting = 1 the result
/// is that of least squares over all samples, the given model counting as 1 / `covariance`.
///
/// **Covariance.** What is not excited would be forgotten without bound. So at every sample that forgets, one unknown
/// in turn is measured at its own estimate, which changes no weight, with the noise that keeps its information at 1 /
/// `covariance_limit` (the cyclic regularisation of Gunnarsson, CDC 1996): no eigenvalue of P exceeds the larger of
/// `covariance` and `covariance_limit`, over forgetting^m for m unknowns, and in the long run `covariance_limit`
/// decides alone. At standstill the identifier freezes as a whole: [`Frozen::PoorExcitation`].
///
/// **Model.** The published weights are the nearest to the estimate, in the metric of P^-1, of those that are not
/// negative, the identity weight at least [`MIN_IDENTITY_SHARE`](crate::MIN_IDENTITY_SHARE) of the given one: its
/// inverse exists at every sample. The estimate itself stays free, so a weight that is zero for a while costs no
/// accuracy later.
///
/// [`update`](Self::update) does not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_simulate::paper;
/// use hysteresis_identify::{RecursiveIdentifier, RecursiveOptions};
/// let actuator = paper::table_1_recovered();
/// let mut plant = actuator.forward();
/// let given = paper::table_1(); // the printed weights are up to 31 % off
/// let mut identifier = RecursiveIdentifier::new(&given.into(), &RecursiveOptions::default())?;
/// for k in 0..20_000 {
///     let u = 600.0 * (1e-3 * f64::from(k)).sin() * (1.0 - 4e-5 * f64::from(k));
///     identifier.update(u, plant.step(u));
/// }
/// for (w, true_w) in identifier.weights().zip(actuator.weights()) {
///     assert!((w - true_w).abs() < 1e-9);
/// }
/// # Ok::<(), hysteresis_identify::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct RecursiveIdentifier {
    pub(crate) given: Model,
    pub(crate) options: RecursiveOptions,
    pub(crate) regressors: Regressors,
    pub(crate) input_offset: f64,
    /// The output offset, if it is held; else zero, and it is the last unknown.
    held_offset: f64,
    /// The columns of the weights, and 1 for an offset that is fitted: in the order of the bounds, as all of the
    /// following but for the prior.
    pub(crate) regressor: Box<[f64]>,
    /// The weights of the given model and its offset, as they are fitted: w_i times the scale.
    pub(crate) prior: Box<[f64]>,
    pub(crate) estimate: Box<[f64]>,
    published: Box<[f64]>,
    pub(crate) candidate: Box<[f64]>,
    pub(crate) bounds: Bounds,
    pub(crate) covariance: Covariance,
    /// The noise of the measurement that bounds the covariance of one unknown.
    bounding_noise: f64,
    pub(crate) turn: usize,
    last_error: f64,
    pub(crate) frozen: Option<Frozen>,
    rejected: u64,
}

impl RecursiveIdentifier {
    /// An identifier of the weights of `model`, which must be invertible, at rest.
    ///
    /// # Errors
    /// [`Error::Core`] for an option outside its domain or a model that may not be invertible.
    pub fn new(model: &Model, options: &RecursiveOptions) -> Result<Self, Error> {
        options.check()?;
        let offsets = match model {
            Model::Conventional(model) => model.check_invertible().map(|()| model.offsets()),
            Model::Modified(model) => model.check_invertible().map(|()| model.offsets()),
        }?;
        let (regressors, weights) = Regressors::of_model(model, options.dynamics.as_ref())?;
        let (held_offset, fitted) = match options.output_offset {
            Setting::Fixed(offset) => (offset, None),
            Setting::Fit => (0.0, Some(offsets.output)),
        };
        let mut lower = regressors.lower_bounds(&weights);
        lower.extend(fitted.map(|_| f64::NEG_INFINITY));
        let prior: Box<[f64]> = weights.iter().map(|w| w * regressors.scale()).chain(fitted).collect();
        let m = prior.len();
        let zeros: Box<[f64]> = vec![0.0; m].into();
        let mut identifier = Self {
            given: model.clone(),
            options: options.clone(),
            input_offset: offsets.input,
            held_offset,
            regressors,
            regressor: zeros.clone(),
            bounds: Bounds::new(lower.into()),
            estimate: zeros.clone(),
            published: zeros.clone(),
            candidate: zeros,
            covariance: Covariance::new(m, options.covariance),
            bounding_noise: options.covariance_limit / (1.0 - power(options.forgetting, m)),
            prior,
            turn: 0,
            last_error: 0.0,
            frozen: None,
            rejected: 0,
        };
        identifier.reset();
        Ok(identifier)
    }

    /// Takes a row of a record: the input `u` and the output `y` read as it is put out. Returns the prediction error: y
    /// minus what the model of before predicts, in the unit of the output; the last one again if the sample is not
    /// finite.
    pub fn update(&mut self, u: f64, y: f64) -> f64 {
        self.frozen = self.learn(u, y);
        if self.frozen == Some(Frozen::NotFinite) {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.last_error
    }

    /// Takes over the inputs before, oldest first: operators and dynamics move, nothing is learned.
    ///
    /// # Errors
    /// [`Error::Core`] for an input that is not finite; nothing is taken then.
    pub fn follow(&mut self, inputs: &[f64]) -> Result<(), Error> {
        check_all_finite("inputs", inputs)?;
        for input in inputs {
            self.regressors.advance(input - self.input_offset, |_, _| {});
        }
        Ok(())
    }

    fn learn(&mut self, u: f64, y: f64) -> Option<Frozen> {
        if !is_admissible(u) {
            return Some(Frozen::NotFinite);
        }
        let (regressor, bounds) = (&mut self.regressor, &self.bounds);
        self.regressors.advance(u - self.input_offset, |i, z| regressor[bounds.place(i)] = z);
        let leverage = self.covariance.look(&self.regressor);
        let y = y - self.held_offset;
        let error = y - dot(&self.published, &self.regressor);
        if !(is_admissible(y) && leverage.is_finite() && error.is_finite()) {
            return Some(Frozen::NotFinite);
        }
        self.last_error = error;
        let forgotten = 1.0 - self.options.forgetting;
        if self.regressor.len() > 1 && leverage < MIN_NEWS * forgotten {
            return Some(Frozen::PoorExcitation);
        }
        let innovation = y - dot(&self.estimate, &self.regressor);
        self.covariance.measure(self.options.forgetting);
        for (estimate, gain) in self.estimate.iter_mut().zip(self.covariance.gain()) {
            *estimate += gain * innovation;
        }
        if forgotten > 0.0 {
            self.covariance.forget(self.options.forgetting);
            self.covariance.measure_one(self.bounds.place(self.turn), self.bounding_noise);
            self.turn = if self.turn + 1 == self.regressor.len() { 0 } else { self.turn + 1 };
        }
        self.publish();
        None
    }

    /// The weights of the model: the nearest to the estimate that have an inverse. If they are not found yet, or out of
    /// all proportion, the last ones stay.
    fn publish(&mut self) {
        let others = [&mut *self.regressor, &mut *self.published];
        let nearest = self.bounds.project(&mut self.covariance, &mut self.estimate, others, &mut self.candidate);
        if nearest && self.has_inverse(&self.candidate) {
            self.published.copy_from_slice(&self.candidate);
        }
    }

    /// Whether numbers within the bounds make a model, and one that has an inverse.
    fn has_inverse(&self, unknowns: &[f64]) -> bool {
        let (identity, sum) = self.regressors.identity_and_sum(|i| unknowns[self.bounds.place(i)]);
        let scale = self.regressors.scale();
        unknowns.iter().all(|x| x.abs() <= MAX_MAGNITUDE * scale.min(1.0))
            && identity > MIN_RELATIVE_SLOPE * sum
            && identity / scale > MIN_SLOPE
    }

    /// The weight of a column, in output unit per input unit.
    fn weight(&self, column: usize) -> f64 {
        self.published[self.bounds.place(column)] / self.regressors.scale()
    }

    /// The unknown weights, in output unit per input unit: the w_i of the model; of a split model then its v_i, without
    /// that of an identity that weighs the same above and below zero.
    #[must_use]
    pub fn weights(&self) -> impl ExactSizeIterator<Item = f64> {
        (0..self.regressors.len()).map(|i| self.weight(i))
    }

    /// The output offset of the model.
    #[must_use]
    pub fn output_offset(&self) -> f64 {
        let n = self.regressors.len();
        if n < self.unknowns() { self.published[self.bounds.place(n)] } else { self.held_offset }
    }

    /// The model as of the last sample: the given one with other weights and output offset. Its inverse exists.
    /// Allocates.
    #[must_use]
    pub fn model(&self) -> Model {
        let offsets = Offsets { input: self.input_offset, output: self.output_offset() };
        self.regressors.model(&self.given, |i| self.weight(i), offsets)
    }

    /// Why the last sample changed no weight, or nothing if it did what it could.
    #[must_use]
    pub fn frozen(&self) -> Option<Frozen> {
        self.frozen
    }

    /// How many samples were not finite (or beyond 1e100).
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The model that it started from.
    #[must_use]
    pub fn given(&self) -> &Model {
        &self.given
    }

    /// What it was told.
    #[must_use]
    pub fn options(&self) -> &RecursiveOptions {
        &self.options
    }

    /// The number of unknowns m: the weights, and the output offset if it is fitted.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.regressor.len()
    }

    /// The covariance of the estimate, m rows of m numbers, in units of the variance of the measurement noise: the
    /// weights in the order of [`weights`](Self::weights), then the output offset if it is fitted. Allocates.
    #[must_use]
    pub fn covariance(&self) -> Vec<f64> {
        let m = self.unknowns();
        let unit = |i: usize| if i < self.regressors.len() { self.regressors.scale() } else { 1.0 };
        let place = |i: usize| self.bounds.place(i);
        let entry = |i: usize, j: usize| self.covariance.entry(place(i), place(j)) / unit(i) / unit(j);
        (0..m * m).map(|k| entry(k / m, k % m)).collect()
    }

    /// Back to the given model, the operators at rest.
    pub fn reset(&mut self) {
        self.regressors.reset();
        self.covariance.reset(self.options.covariance);
        self.bounds.reset();
        self.regressor.fill(1.0);
        self.estimate.copy_from_slice(&self.prior);
        // P being diagonal, the nearest point is at the bounds that are passed.
        self.bounds.clamp(&self.prior, &mut self.published);
        (self.turn, self.last_error, self.frozen, self.rejected) = (0, 0.0, None, 0);
    }
}

fn power(base: f64, exponent: usize) -> f64 {
    (0..exponent).fold(1.0, |power, _| power * base)
}

/// What a [`RecursiveIdentifier`](RecursiveIdentifier) may be told.
///
/// ```
/// use hysteresis_identify::{RecursiveOptions, Setting};
/// let tracking = RecursiveOptions { forgetting: 0.9999, ..RecursiveOptions::default() }; // a second at 10 kHz
/// assert_eq!(tracking.output_offset, Setting::Fit);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RecursiveOptions {
    /// What a sample counts after the next one, from 0.5 to 1: the memory is 1 / (1 - forgetting) samples long. 1
    /// forgets nothing: least squares over all samples.
    pub forgetting: f64,
    /// Fit the output offset of the model as one more unknown, as a sensor has one, or hold it.
    pub output_offset: Setting<f64>,
    /// The variance of every unknown at the start, in units of the variance of the measurement noise, the unknowns
    /// being w_i X and the output offset. X is the largest threshold, rounded up to a power of two. The default lets
    /// the samples alone decide; with 1 the model counts as one sample of full range.
    pub covariance: f64,
    /// The variance that forgetting may bring back, in the same units.
    pub covariance_limit: f64,
    /// The linear dynamics between the hysteresis and the measurement with their dead time, and the sampling interval
    /// in seconds; without any the measurement follows the input at once.
    pub dynamics: Option<(LinearDynamics, f64)>,
}

impl Default for RecursiveOptions {
    /// Nothing is forgotten, the offset is fitted, the samples alone decide, there are no dynamics.
    fn default() -> Self {
        Self { forgetting: 1.0, output_offset: Setting::Fit, covariance: 1e12, covariance_limit: 1e4, dynamics: None }
    }
}

impl RecursiveOptions {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let domain = |parameter, expected, got| Err(Error::domain(parameter, None, expected, got));
        if !(0.5..=1.0).contains(&self.forgetting) {
            return domain("forgetting", "a number from 0.5 to 1", self.forgetting);
        }
        for (parameter, got) in [("covariance", self.covariance), ("covariance_limit", self.covariance_limit)] {
            if !(1e-30..=1e30).contains(&got) {
                return domain(parameter, "a number from 1e-30 to 1e30", got);
            }
        }
        match self.output_offset {
            Setting::Fixed(got) if !is_admissible(got) => {
                domain("output_offset", "a finite number (at most 1e100 in magnitude)", got)
            }
            _ => Ok(()),
        }
    }
}

/// Why the last sample changed no weight.
///
/// ```
/// use hysteresis_identify::Frozen;
/// assert_eq!(Frozen::PoorExcitation.name(), "poor_excitation");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Frozen {
    /// The sample says less than forgetting would lose: its leverage z' P z is below 1.25 (1 - forgetting). One
    /// regressor repeated for ever, as at standstill, comes to 1 - forgetting; m independent ones average m times that.
    /// Nothing is forgotten meanwhile. Never at forgetting = 1.
    PoorExcitation,
    /// Input or output, or what follows from them, is not a finite number (or beyond 1e100). The sample is counted as
    /// rejected; a good input moves the operators all the same.
    NotFinite,
}

impl Frozen {
    /// The reason as one word: "poor_excitation" or "not_finite".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::PoorExcitation => "poor_excitation",
            Self::NotFinite => "not_finite",
        }
    }
}

/// Everything that a [`RecursiveIdentifier`](RecursiveIdentifier) remembers: restored, it continues bit for bit.
///
/// The unknowns are the weights times the scale X of the input and then the output offset, if it is fitted; estimate,
/// published and covariance have them in an order of their own.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct RecursiveState {
    /// The operator outputs z_i, in the unit of the input.
    pub outputs: Vec<f64>,
    /// The states of the dynamics behind them, in units of their largest threshold rounded up to a power of two; none
    /// without dynamics.
    pub lags: Vec<LinearState>,
    /// The estimate before the projection.
    pub estimate: Vec<f64>,
    /// The estimate within its bounds: that of the model.
    pub published: Vec<f64>,
    /// Which unknown stands at each place of what is above and below: a permutation.
    pub order: Vec<usize>,
    /// How many of the first are not at their bounds.
    pub free: usize,
    /// U above the diagonal, column by column, of the covariance P = U D U'.
    pub upper: Vec<f64>,
    /// D of the covariance.
    pub diagonal: Vec<f64>,
    /// Whose covariance is bounded next.
    pub turn: usize,
    /// The last prediction error.
    pub last_error: f64,
    /// Why the last sample changed no weight, if it did not.
    pub frozen: Option<Frozen>,
    /// How many samples were not finite.
    pub rejected: u64,
}

impl RecursiveIdentifier {
    /// Everything that is remembered. Allocates.
    #[must_use]
    pub fn state(&self) -> RecursiveState {
        let (upper, diagonal) = self.covariance.factors();
        let (outputs, lags) = self.regressors.state();
        RecursiveState {
            outputs,
            lags,
            estimate: self.estimate.to_vec(),
            published: self.published.to_vec(),
            order: self.bounds.order().to_vec(),
            free: self.bounds.free(),
            upper,
            diagonal,
            turn: self.turn,
            last_error: self.last_error,
            frozen: self.frozen,
            rejected: self.rejected,
        }
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::Core`] with what a state of this identifier must satisfy; it is as before then.
    pub fn set_state(&mut self, state: &RecursiveState) -> Result<(), Error> {
        let wrong = |expected| Err(Error::Core(hysteresis_core::Error::State { expected }));
        let (n, m) = (self.regressors.len(), self.unknowns());
        let lengths = [state.estimate.len(), state.published.len(), state.diagonal.len()];
        let fits = self.regressors.fits(&state.outputs, &state.lags);
        if !fits || lengths != [m, m, m] || state.upper.len() != m * (m - 1) / 2 {
            return wrong("one number for each operator, each unknown and each pair of unknowns, a state for each lag");
        }
        let numbers = [&state.outputs, &state.estimate, &state.published, &state.upper, &state.diagonal];
        let numbers = numbers.into_iter().flatten().chain([&state.last_error]);
        if !numbers.into_iter().all(|x| x.is_finite()) {
            return wrong("finite numbers");
        }
        let permuted = (0..m).all(|i| state.order.contains(&i)) && state.order.len() == m;
        if state.diagonal.iter().any(|d| *d < 0.0) || state.turn >= m || !permuted || state.free > m {
            return wrong("variances that are not negative, and every unknown once in the order");
        }
        let mut bounds = self.bounds.clone();
        bounds.restore(&state.order, state.free);
        let last = std::mem::replace(&mut self.bounds, bounds);
        if !(self.bounds.holds_only_bounded()
            && self.bounds.allow(&state.published)
            && self.has_inverse(&state.published))
        {
            self.bounds = last;
            return wrong("published weights of a model that has an inverse, none of them negative");
        }
        if n < m {
            self.regressor[self.bounds.place(n)] = 1.0;
        }
        self.regressors.restore(&state.outputs, &state.lags);
        self.estimate.copy_from_slice(&state.estimate);
        self.published.copy_from_slice(&state.published);
        self.covariance.restore(&state.upper, &state.diagonal);
        self.turn = state.turn;
        (self.last_error, self.frozen, self.rejected) = (state.last_error, state.frozen, state.rejected);
        Ok(())
    }
}
