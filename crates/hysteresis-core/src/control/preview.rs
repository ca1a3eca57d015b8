use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use crate::engine::count_as_f64;
use crate::error::{Bound, Error, check_finite};

/// A target for the feed-forward made of references that are known beforehand, by a fixed window:
///
/// ```text
/// target(k) = sum_j c_j r(k + ahead - j),   j = 0 the newest
/// ```
///
/// With it references enter the controller `ahead` samples early; its feedback uses r(k), from the same window. At the
/// start all of the window is the first reference, as if it had been there for ever. A window that fills anew, at the
/// start, after a hold and after a rejected reference, so makes differentiating coefficients ask for a kick as soon as the
/// next references come, which only limits and slew bound.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Preview};
/// let lead = Preview::new(&[0.5, 0.5], 1)?; // half a sample
/// let options = ControllerOptions::new(0.0, 0.0, (-10.0, 10.0));
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
    /// All references of the window but the newest, a ring: from `newest` on to the end, then from the beginning.
    past: Box<[f64]>,
    newest: usize,
    started: bool,
}

/// The references that a [`Preview`] remembers.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Preview};
/// let options = ControllerOptions::new(0.0, 0.0, (-10.0, 10.0));
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
    /// The last references, one fewer than there are coefficients, newest first.
    pub past: Vec<f64>,
    /// Whether there was a reference since the start.
    pub started: bool,
}

/// What the window shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) reference: f64,
    pub(super) target: f64,
}

impl Preview {
    /// A window of as many references as there are coefficients.
    ///
    /// # Errors
    /// [`Error::Empty`] without a coefficient, [`Error::Domain`] unless all are finite and `ahead` lies in the window.
    pub fn new(coefficients: &[f64], ahead: usize) -> Result<Self, Error> {
        let last = coefficients.len().checked_sub(1).ok_or(Error::Empty { parameter: "coefficients" })?;
        for (j, c) in coefficients.iter().enumerate() {
            check_finite("coefficients", Some(j), *c)?;
        }
        if ahead > last {
            let expected = Bound::UpTo { last };
            return Err(Error::Domain { parameter: "ahead", index: None, expected, got: count_as_f64(ahead) });
        }
        let past = vec![0.0; last].into();
        Ok(Self { coefficients: coefficients.into(), ahead, past, newest: 0, started: false })
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

    /// The references before the newest, newest first.
    #[inline]
    fn past(&self) -> impl Iterator<Item = f64> + '_ {
        let (older, newer) = self.past.split_at_checked(self.newest).unwrap_or((&[], &self.past));
        newer.iter().chain(older).copied()
    }

    /// What the window shows once `newest` has come.
    #[inline]
    pub(super) fn look(&self, newest: f64) -> View {
        let mut view = View { reference: newest, target: 0.0 };
        let known = self.started;
        let window = core::iter::once(newest).chain(self.past().map(|r| if known { r } else { newest }));
        for (j, (c, r)) in self.coefficients.iter().zip(window).enumerate() {
            view.target += c * r;
            if j == self.ahead {
                view.reference = r;
            }
        }
        view
    }

    /// Takes a reference.
    #[inline]
    pub(super) fn push(&mut self, newest: f64) {
        if !self.started {
            self.past.fill(newest);
            self.started = true;
        }
        self.newest = self.newest.checked_sub(1).unwrap_or(self.past.len().saturating_sub(1));
        if let Some(oldest) = self.past.get_mut(self.newest) {
            *oldest = newest;
        }
    }

    /// The next reference fills the window.
    #[inline]
    pub(super) fn restart(&mut self) {
        self.started = false;
    }

    pub(super) fn state(&self) -> PreviewState {
        PreviewState { past: self.past().collect(), started: self.started }
    }

    pub(super) fn check(&self, state: &PreviewState) -> Result<(), Error> {
        let (expected, got) = (self.past.len(), state.past.len());
        if got != expected {
            return Err(Error::Length { parameter: "state.preview.past", expected, got });
        }
        for (j, r) in state.past.iter().enumerate() {
            check_finite("state.preview.past", Some(j), *r)?;
        }
        Ok(())
    }

    /// Continues from a state that was checked.
    pub(super) fn set_state(&mut self, state: &PreviewState) {
        self.past.copy_from_slice(&state.past);
        (self.newest, self.started) = (0, state.started);
    }
}
