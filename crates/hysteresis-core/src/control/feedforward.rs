//! What is fed forward: a target, made of references that are known beforehand if there is a [`Preview`], and the volts
//! that go with it.

use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use super::source::{DriveSource, View, check_same_limits};
use crate::duhem::Duhem;
use crate::engine::CompiledModel;
use crate::error::{Error, check_all_finite, check_between, no_such};
use crate::fingerprint::Fingerprint;
use crate::process::Process;
use crate::quasistatic::{MAX_KNOTS, QuasiStaticInverse, QuasiStaticState};
use crate::real::count_as_f64;
use crate::stream::{Forward, Inverse, StreamState};

/// Where the feed-forward term H^-1\[target\] of equation (8) comes from: a target in, volts out.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let limits = (-500.0, 500.0);
/// let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, 1e-4, limits) };
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let exact: FeedForward = model.inverse(Some(limits))?.into();
/// let parametric = model.parametric_inverse(Ratios::PAPER_INVERSE)?; // itself a model: um in, V out
/// let parametric: FeedForward = parametric.forward().into();
/// for source in [exact, parametric] {
///     let mut controller = HybridController::new(source, None, &options)?;
///     controller.step(1.0.into(), 0.0); // starts from 0 V
///     let drive = controller.step(1.0.into(), 0.0);
///     assert!((drive - 209.0).abs() < 5.0, "{drive}"); // V
/// }
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub enum FeedForward {
    /// Feedback alone: 0 V.
    None,
    /// The exact inverse of the actuator's model. It must have the limits of the controller: else targets out of reach
    /// would take its memory where the drive never goes.
    Inverse(Inverse),
    /// The exact inverse of hysteresis with maps, loop shift and creep, with the limits of the controller. Loop shift
    /// and creep go on at every sample, also while the drive is held.
    QuasiStatic(Box<QuasiStaticInverse>),
    /// A model that is itself an inverse, displacement in and volts out: Table II, or a closed form.
    Forward(Forward),
    /// Volts that come with every [`Command`](super::Command); a sample without them is rejected.
    Given,
}

/// What the source of the feed-forward remembers.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForwardState, HybridController, Offsets, PrandtlIshlinskii};
/// let limits = (-10.0, 10.0);
/// let inverse = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?.inverse(Some(limits))?;
/// let options = ControllerOptions::new(0.0, 0.0, 1e-4, limits);
/// let controller = HybridController::new(inverse.clone().into(), None, &options)?;
/// assert_eq!(controller.state().feedforward, Some(FeedForwardState::Stream(inverse.state())));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum FeedForwardState {
    /// An inverse, or a model that is itself one.
    Stream(StreamState),
    /// The inverse of hysteresis with maps, loop shift, relaxing plays, slow gain and creep.
    QuasiStatic(QuasiStaticState),
}

impl From<Inverse> for FeedForward {
    fn from(stream: Inverse) -> Self {
        Self::Inverse(stream)
    }
}

impl From<QuasiStaticInverse> for FeedForward {
    fn from(stream: QuasiStaticInverse) -> Self {
        Self::QuasiStatic(Box::new(stream))
    }
}

impl From<Forward> for FeedForward {
    fn from(stream: Forward) -> Self {
        Self::Forward(stream)
    }
}

impl DriveSource for FeedForward {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        match self {
            Self::Inverse(stream) => stream.step(target),
            Self::QuasiStatic(stream) => stream.step(target),
            Self::Forward(stream) => stream.step(target),
            Self::None | Self::Given => 0.0,
        }
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        match self {
            Self::Inverse(stream) => stream.peek(target),
            Self::QuasiStatic(stream) => stream.peek(target),
            Self::Forward(stream) => stream.peek(target),
            Self::None | Self::Given => 0.0,
        }
    }

    #[inline]
    fn wait(&mut self) {
        if let Self::QuasiStatic(stream) = self {
            stream.follow_drive(stream.output());
        }
    }

    #[inline]
    fn follow_drive(&mut self, drive: f64) {
        match self {
            Self::Inverse(stream) => _ = stream.follow_drive(drive),
            Self::QuasiStatic(stream) => _ = stream.follow_drive(drive),
            Self::Forward(_) | Self::None | Self::Given => {}
        }
    }

    fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => stream.follow(drives),
            Self::QuasiStatic(stream) => stream.follow(drives),
            Self::Forward(_) => Err(Error::CannotFollow),
            Self::None | Self::Given => Ok(()),
        }
    }

    fn check_limits(&self, expected: (f64, f64)) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => check_same_limits(stream.limits(), expected),
            Self::QuasiStatic(stream) => check_same_limits(stream.limits(), expected),
            Self::Forward(_) | Self::None | Self::Given => Ok(()),
        }
    }

    fn is_given(&self) -> bool {
        matches!(self, Self::Given)
    }

    fn reset(&mut self) {
        match self {
            Self::Inverse(stream) => stream.reset(),
            Self::QuasiStatic(stream) => stream.reset(),
            Self::Forward(stream) => stream.reset(),
            Self::None | Self::Given => {}
        }
    }
}

impl FeedForward {
    pub(super) fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => stream.set_model(model),
            Self::QuasiStatic(stream) => stream.set_model(model),
            Self::Forward(stream) => stream.set_model(model),
            Self::None | Self::Given => Err(Error::NoModel),
        }
    }

    /// The Duhem operator of the model, if it has one.
    pub(super) fn duhem(&self) -> Option<&Duhem<MAX_KNOTS>> {
        match self {
            Self::QuasiStatic(stream) => stream.duhem(),
            Self::Inverse(_) | Self::Forward(_) | Self::None | Self::Given => None,
        }
    }

    /// What the source remembers. Allocates.
    pub(super) fn state(&self) -> Option<FeedForwardState> {
        match self {
            Self::Inverse(stream) => Some(FeedForwardState::Stream(stream.state())),
            Self::QuasiStatic(stream) => Some(FeedForwardState::QuasiStatic(stream.state())),
            Self::Forward(stream) => Some(FeedForwardState::Stream(stream.state())),
            Self::None | Self::Given => None,
        }
    }

    pub(super) fn set_state(&mut self, state: Option<&FeedForwardState>) -> Result<(), Error> {
        match (self, state) {
            (Self::Inverse(stream), Some(FeedForwardState::Stream(state))) => stream.set_state(state),
            (Self::QuasiStatic(stream), Some(FeedForwardState::QuasiStatic(state))) => stream.set_state(state),
            (Self::Forward(stream), Some(FeedForwardState::Stream(state))) => stream.set_state(state),
            (Self::None | Self::Given, None) => Ok(()),
            _ => Err(Error::State { expected: "a feed-forward of the kind that the controller has" }),
        }
    }
}

/// A target for the feed-forward made of references that are known beforehand, by a fixed window:
///
/// ```text
/// target(k) = sum_j c_j r(k + ahead - j),   j = 0 the newest
/// ```
///
/// With it references enter the controller `ahead` samples early; its feedback uses r(k), from the same window.
///
/// The window fills anew at the start, after a hold or a stop and after a rejected reference. Until it is full, the
/// target is that of a rest at the first reference: coefficients that differentiate would else see a step of the
/// velocity and ask for a kick. At the sample that fills the window the target takes over, and the bumpless term takes
/// the difference. A reference that rests for as many samples as there are coefficients, before it moves, has no
/// difference to take.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Preview};
/// let lead = Preview::new(&[0.5, 0.5], 1)?; // half a sample
/// let options = ControllerOptions::new(0.0, 0.0, 1e-4, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, Some(lead), &options)?;
/// controller.step(1.0.into(), 0.0);
/// controller.step(2.0.into(), 0.0);
/// let terms = controller.terms();
/// assert_eq!((terms.reference, terms.target), (1.0, 1.5));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Preview {
    coefficients: Box<[f64]>,
    ahead: usize,
    /// Weights of the references that make the smoothed one of the feedback, from the newest on; none where it is r(k).
    smooth: Box<[f64]>,
    /// All references of the window but the newest, a ring: from `newest` on to the end, then from the beginning.
    past: Box<[f64]>,
    newest: usize,
    /// How many references came since the window began to fill, up to the number of coefficients.
    samples: usize,
}

/// The references that a [`Preview`] remembers. It belongs to previews with the same coefficients, samples ahead and
/// smoothing.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Preview};
/// let options = ControllerOptions::new(0.0, 0.0, 1e-4, (-10.0, 10.0));
/// let preview = Preview::new(&[0.0, 0.0, 1.0], 0)?;
/// let mut controller = HybridController::new(FeedForward::None, Some(preview), &options)?;
/// controller.step(1.0.into(), 0.0);
/// controller.step(2.0.into(), 0.0);
/// assert_eq!(controller.state().preview.unwrap().past, [2.0, 1.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct PreviewState {
    /// The fingerprint of the window: its coefficients, the samples ahead and the smoothing.
    pub window: u64,
    /// The last references, one fewer than there are coefficients, newest first.
    pub past: Vec<f64>,
    /// How many references came since the window began to fill, up to the number of coefficients.
    pub samples: usize,
}

/// The weights of a kernel may sum to 1 with this error.
const SUM_TOLERANCE: f64 = 1e-9;

impl Preview {
    /// A window of as many references as there are coefficients.
    ///
    /// # Errors
    /// [`Error::Empty`] without a coefficient, [`Error::Domain`] unless all are finite, [`Error::Whole`] unless `ahead`
    /// lies in the window.
    pub fn new(coefficients: &[f64], ahead: usize) -> Result<Self, Error> {
        let last = coefficients.len().checked_sub(1).ok_or(Error::Empty { parameter: "coefficients" })?;
        check_all_finite("coefficients", coefficients)?;
        if ahead > last {
            return Err(no_such("ahead", None, ahead, coefficients.len()));
        }
        let past = vec![0.0; last].into();
        Ok(Self { coefficients: coefficients.into(), ahead, smooth: Box::default(), past, newest: 0, samples: 0 })
    }

    /// The same behind a smoothing of the references, by a kernel s of an odd number of weights: both the target and
    /// the reference of the feedback are those of sum_i s_i r(k + m - i), m = (size - 1) / 2. References come m samples
    /// earlier then.
    ///
    /// So references may have steps and corners that the actuator must not be asked for: a kernel that is a sum over
    /// one period of a resonance does not excite it.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Preview};
    /// let preview = Preview::new(&[1.0], 0)?.smoothed(&[0.25, 0.5, 0.25])?;
    /// assert_eq!((preview.ahead(), preview.coefficients().len()), (1, 3));
    /// let options = ControllerOptions::new(0.0, 0.0, 1e-4, (-10.0, 10.0));
    /// let mut controller = HybridController::new(FeedForward::None, Some(preview), &options)?;
    /// for reference in [0.0, 0.0, 0.0, 1.0] {
    ///     controller.step(reference.into(), 0.0);
    /// }
    /// let terms = controller.terms(); // one sample before the step
    /// assert_eq!((terms.reference, terms.target), (0.25, 0.25));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::State`] for a preview that is smoothed already; [`Error::Whole`] for a number of weights that is not
    /// odd, [`Error::Domain`] for weights that are not finite, or that do not sum to 1 within 1e-9.
    pub fn smoothed(self, kernel: &[f64]) -> Result<Self, Error> {
        if !self.smooth.is_empty() {
            return Err(Error::State { expected: "a preview that is not smoothed yet" });
        }
        if kernel.len().is_multiple_of(2) {
            return Err(Error::whole("kernel", None, "an odd number of weights", kernel.len()));
        }
        check_all_finite("kernel", kernel)?;
        check_between("kernel", None, kernel.iter().sum(), (1.0 - SUM_TOLERANCE, 1.0 + SUM_TOLERANCE))?;
        let size = self.coefficients.len() + kernel.len() - 1;
        let (mut coefficients, mut smooth) = (vec![0.0; size], vec![0.0; size]);
        for (i, weight) in kernel.iter().enumerate() {
            for (sum, c) in coefficients.iter_mut().skip(i).zip(&self.coefficients) {
                *sum += weight * c;
            }
        }
        for (place, weight) in smooth.iter_mut().skip(self.ahead).zip(kernel) {
            *place = *weight;
        }
        let preview = Self::new(&coefficients, self.ahead + kernel.len() / 2)?;
        Ok(Self { smooth: smooth.into(), ..preview })
    }

    /// The coefficients c_j, the newest reference's first.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// How many samples the references are early.
    #[must_use]
    pub fn ahead(&self) -> usize {
        self.ahead
    }

    /// How many samples come before the one that fills the window, if it is not full.
    pub(super) fn samples_until_full(&self) -> Option<f64> {
        self.past.len().checked_sub(self.samples).map(count_as_f64)
    }

    /// The references before the newest, newest first.
    #[inline]
    fn past(&self) -> impl Iterator<Item = f64> + '_ {
        let (older, newer) = self.past.split_at_checked(self.newest).unwrap_or((&[], &self.past));
        newer.iter().chain(older).copied()
    }

    /// What the window shows once `newest` has come.
    #[inline]
    pub(super) fn look(&self, newest: f64) -> View {
        let size = self.coefficients.len();
        let come = self.samples.saturating_add(1);
        let first = match self.samples {
            0 => Some(newest),
            _ if come < size => self.past.get(self.oldest()).copied(),
            _ => None,
        };
        let mut view = View { reference: newest, target: 0.0, filled: come == size };
        let known = self.samples > 0;
        let window = core::iter::once(newest).chain(self.past().map(|r| if known { r } else { newest }));
        for (j, (c, r)) in self.coefficients.iter().zip(window).enumerate() {
            view.target += c * first.unwrap_or(r);
            if j == self.ahead {
                view.reference = r;
            }
        }
        if !self.smooth.is_empty() {
            let window = core::iter::once(newest).chain(self.past().map(|r| if known { r } else { newest }));
            view.reference = self.smooth.iter().zip(window).map(|(s, r)| s * r).sum();
        }
        view
    }

    /// Where the oldest reference is; while the window fills, that is the first one.
    #[inline]
    fn oldest(&self) -> usize {
        self.newest.checked_sub(1).unwrap_or(self.past.len().saturating_sub(1))
    }

    /// Takes a reference.
    #[inline]
    pub(super) fn push(&mut self, newest: f64) {
        if self.samples == 0 {
            self.past.fill(newest);
        }
        self.samples = self.samples.saturating_add(1).min(self.coefficients.len());
        self.newest = self.oldest();
        if let Some(oldest) = self.past.get_mut(self.newest) {
            *oldest = newest;
        }
    }

    /// The next reference is the first of a window that fills.
    #[inline]
    pub(super) fn restart(&mut self) {
        self.samples = 0;
    }

    pub(super) fn state(&self) -> PreviewState {
        PreviewState { window: self.fingerprint(), past: self.past().collect(), samples: self.samples }
    }

    fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.numbers(&self.coefficients);
        fingerprint.numbers(&self.smooth);
        fingerprint.count(self.ahead);
        fingerprint.finish()
    }

    pub(super) fn check(&self, state: &PreviewState) -> Result<(), Error> {
        let (expected, got) = (self.past.len(), state.past.len());
        if got != expected {
            return Err(Error::Length { parameter: "state.preview.past", expected, got });
        }
        if state.window != self.fingerprint() {
            let expected = "the state of a preview with the same coefficients, samples ahead and smoothing";
            return Err(Error::State { expected });
        }
        check_all_finite("state.preview.past", &state.past)?;
        let most = self.coefficients.len();
        if state.samples > most {
            return Err(no_such("state.preview.samples", None, state.samples, most + 1));
        }
        Ok(())
    }

    /// Continues from a state that was checked.
    pub(super) fn set_state(&mut self, state: &PreviewState) {
        self.past.copy_from_slice(&state.past);
        (self.newest, self.samples) = (0, state.samples);
    }
}
