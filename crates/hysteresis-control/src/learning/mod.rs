//! Learning from periods that repeat: what feed-forward and feedback leave behind is the same in every period.
//!
//! Both schemes correct the *target* of the feed-forward, a displacement, not the drive: the exact inverse between them
//! turns the actuator into its linear dynamics, so one linear model of the loop ([`FeedbackLoop`]) tells how a
//! correction v of the target moves the position: y = M v. The measured error of a period is e = e0 - M v.
//!
//! The loop is not known exactly. [`LoopUncertainty`] tells what it may be: modes of other frequency and damping,
//! another slope. At every frequency that gives a mean of M and a variance P.
//!
//! [`IterativeLearning`] works on whole recorded periods. What is believed of e0 and M at every harmonic is a Gaussian
//! that each period makes narrower ([`Belief`]). The correction moves towards the one with the least mean square of the
//! error to be expected, with C the covariance of e0 with M:
//!
//! v <- Q (v + (conj(M) (e0 - M v) + C - (P + 0.02^2) v) / (|M|^2 + P + 0.02^2 + 0.05^2)).
//!
//! So little is learned where the loop is not known, where an error does not show above the noise, and where M is
//! small, as below the corner of an integrating feedback: the feedback does it.
//!
//! [`RepetitiveControl`] works sample by sample beside the controller, with filters that are fixed:
//!
//! v <- Q (v + gamma L e),   L = conj(M) / (|M|^2 + P + 0.05^2).
//!
//! Q = 1 / (1 + (f / `bandwidth`)^4) is a Butterworth low-pass run forwards and backwards: it has no phase. The error
//! of a harmonic shrinks from period to period by |Q (1 - gamma L M')|, M' the true loop. Where that is above 1 it
//! grows: a supervisor sees it, and stops learning.
//!
//! Each file knows only those above it: `feedback_loop`, the loop that is believed in, and what it may be; `harmonics`,
//! then `iterative`; `repetitive_filters` and `supervisor`, then `repetitive`.

mod feedback_loop;
mod harmonics;
mod iterative;
mod repetitive;
mod repetitive_filters;
mod supervisor;

pub use feedback_loop::{FeedbackLoop, LoopUncertainty};
pub use harmonics::{Belief, LearningOptions};
pub use iterative::{IterativeLearning, IterativeState, Trial};
pub use repetitive::{LearningPhase, RepetitiveControl, RepetitiveOptions, RepetitiveState, Supervision};
pub use supervisor::SupervisorState;
