//! What a controller asks of the source of its feed-forward.

use core::fmt::Debug;

use crate::duhem::DuhemInverse;
use crate::embedded::{Holds, Inverse};
use crate::error::{Error, MAX_MAGNITUDE};
use crate::process::Process;
use crate::real::Real;

/// Where the feed-forward of a [`HybridController`](super::HybridController) comes from:
/// [`FeedForward`](super::FeedForward), or the inverse of a model of fixed size,
/// [`embedded::Inverse`](crate::embedded::Inverse), or [`DuhemInverse`](crate::DuhemInverse).
///
/// No method allocates, locks or panics. Drives are in volts, targets in the unit of the model's output.
pub trait DriveSource: Clone + Debug {
    /// Moves on to the target: the volts that go with it, 0 where they are not of this source.
    fn step(&mut self, target: f64) -> f64;

    /// What [`step`](Self::step) would give.
    fn peek(&self, target: f64) -> f64;

    /// A sample passes in which the drive is held: loop shift and creep go on.
    fn wait(&mut self);

    /// Remembers a drive that goes out instead of its own. A model that is itself an inverse knows targets alone and
    /// stays where it is.
    fn follow_drive(&mut self, drive: f64);

    /// Takes over what was driven before, oldest drive first.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits, [`Error::CannotFollow`] of a source that knows targets alone.
    fn follow(&mut self, drives: &[f64]) -> Result<(), Error>;

    /// Checks that an inverse has the limits of its controller.
    ///
    /// # Errors
    /// [`Error::OtherLimits`].
    fn check_limits(&self, expected: (f64, f64)) -> Result<(), Error>;

    /// Whether the volts come with every [`Command`](super::Command).
    fn is_given(&self) -> bool;

    /// Back to the virgin state.
    fn reset(&mut self);
}

/// What the window of a preview shows; without one, the newest reference.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) reference: f64,
    pub(super) target: f64,
    /// Whether the window is full with this reference, for the first time.
    pub(super) filled: bool,
}

pub(super) fn check_same_limits(got: Option<(f64, f64)>, expected: (f64, f64)) -> Result<(), Error> {
    let same = got.unwrap_or((-MAX_MAGNITUDE, MAX_MAGNITUDE)) == expected;
    if same { Ok(()) } else { Err(Error::OtherLimits { expected, got }) }
}

/// Targets and drives in `f64`, rounded where the inverse works with `f32`.
impl<T: Real, const N: usize, M: Holds<T, N>> DriveSource for Inverse<T, N, M> {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        Process::step(self, T::narrow(target)).wide()
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        Process::peek(self, T::narrow(target)).wide()
    }

    #[inline]
    fn wait(&mut self) {}

    #[inline]
    fn follow_drive(&mut self, drive: f64) {
        Inverse::follow_drive(self, T::narrow(drive));
    }

    fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        // The controller has checked them against the same limits.
        for drive in drives {
            DriveSource::follow_drive(self, *drive);
        }
        Ok(())
    }

    fn check_limits(&self, expected: (f64, f64)) -> Result<(), Error> {
        check_same_limits(self.limits().map(|(low, high)| (low.wide(), high.wide())), expected)
    }

    #[inline]
    fn is_given(&self) -> bool {
        false
    }

    fn reset(&mut self) {
        Process::reset(self);
    }
}

impl<const N: usize> DriveSource for DuhemInverse<N> {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        Process::step(self, target)
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        Process::peek(self, target)
    }

    #[inline]
    fn wait(&mut self) {}

    #[inline]
    fn follow_drive(&mut self, drive: f64) {
        DuhemInverse::follow_drive(self, drive);
    }

    fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        // The controller has checked them against the same limits.
        for drive in drives {
            DuhemInverse::follow_drive(self, *drive);
        }
        Ok(())
    }

    fn check_limits(&self, expected: (f64, f64)) -> Result<(), Error> {
        check_same_limits(self.limits(), expected)
    }

    #[inline]
    fn is_given(&self) -> bool {
        false
    }

    fn reset(&mut self) {
        Process::reset(self);
    }
}
