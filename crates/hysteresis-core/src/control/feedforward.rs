use crate::error::{Error, MAX_MAGNITUDE};
use crate::memory::Kernel;
use crate::process::Process;
use crate::stream::{Forward, Inverse, StreamState};

/// Where the feed-forward term H^-1\[r\] of equation (8) comes from: a target in, volts out.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, paper};
/// let limits = (-500.0, 500.0);
/// let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, 1e-4, limits) };
/// let exact: FeedForward = paper::table_1_recovered().inverse(Some(limits))?.into();
/// let parametric: FeedForward = paper::table_2().forward().into(); // itself an inverse: um in, V out
/// for source in [exact, parametric] {
///     let mut controller = HybridController::new(source, None, &options)?;
///     controller.step(1.0.into(), 0.0); // starts from 0 V
///     let drive = controller.step(1.0.into(), 0.0);
///     assert!((drive - 195.0).abs() < 5.0, "{drive}"); // V
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
    /// A model that is itself an inverse, displacement in and volts out: Table II, or a closed form.
    Forward(Forward),
    /// Volts that come with every [`Command`](super::Command); a sample without them is rejected.
    Given,
}

impl From<Inverse> for FeedForward {
    fn from(stream: Inverse) -> Self {
        Self::Inverse(stream)
    }
}

impl From<Forward> for FeedForward {
    fn from(stream: Forward) -> Self {
        Self::Forward(stream)
    }
}

impl FeedForward {
    /// Moves on to the target: the volts that go with it, 0 where they are not of this source.
    #[inline]
    pub(super) fn step(&mut self, target: f64) -> f64 {
        match self {
            Self::Inverse(stream) => stream.step(target),
            Self::Forward(stream) => stream.step(target),
            Self::None | Self::Given => 0.0,
        }
    }

    /// What [`step`](Self::step) would give.
    #[inline]
    pub(super) fn peek(&self, target: f64) -> f64 {
        match self {
            Self::Inverse(stream) => stream.peek(target),
            Self::Forward(stream) => stream.peek(target),
            Self::None | Self::Given => 0.0,
        }
    }

    /// Checks that an inverse has the limits of its controller.
    pub(super) fn check_limits(&self, expected: (f64, f64)) -> Result<(), Error> {
        let Self::Inverse(stream) = self else { return Ok(()) };
        let got = stream.limits();
        let same = got.unwrap_or((-MAX_MAGNITUDE, MAX_MAGNITUDE)) == expected;
        if same { Ok(()) } else { Err(Error::OtherLimits { expected, got }) }
    }

    pub(super) fn is_given(&self) -> bool {
        matches!(self, Self::Given)
    }

    pub(super) fn reset(&mut self) {
        match self {
            Self::Inverse(stream) => stream.reset(),
            Self::Forward(stream) => stream.reset(),
            Self::None | Self::Given => {}
        }
    }

    pub(super) fn set_model(&mut self, kernel: &Kernel) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => stream.set_model(kernel),
            Self::Forward(stream) => stream.set_model(kernel),
            Self::None | Self::Given => Err(Error::NoModel),
        }
    }

    /// What the source remembers. Allocates.
    pub(super) fn state(&self) -> Option<StreamState> {
        match self {
            Self::Inverse(stream) => Some(stream.state()),
            Self::Forward(stream) => Some(stream.state()),
            Self::None | Self::Given => None,
        }
    }

    pub(super) fn set_state(&mut self, state: Option<&StreamState>) -> Result<(), Error> {
        match (self, state) {
            (Self::Inverse(stream), Some(state)) => stream.set_state(state),
            (Self::Forward(stream), Some(state)) => stream.set_state(state),
            (Self::None | Self::Given, None) => Ok(()),
            _ => Err(Error::State { expected: "a feed-forward if, and only if, the controller has one with a memory" }),
        }
    }
}
