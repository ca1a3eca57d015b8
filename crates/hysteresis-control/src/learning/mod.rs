//! Learning from periods that repeat: what feed-forward and feedback leave behind is the same in every period.
//!
//! Both schemes correct the *target* of the feed-forward, a displacement, not the drive: the exact inverse between them
//! turns the actuator into its linear dynamics, so one linear model of the loop ([`FeedbackLoop`]) tells how a correction
//! v of the target moves the position: y = M v. With e = r - y, the error of a period,
//!
//! v <- Q (v + gamma L e),   Q = 1 / (1 + (f / `bandwidth`)^4),   L = conj(M) / (|M|^2 + 0.05^2).
//!
//! Q is a Butterworth low-pass run forwards and backwards: it has no phase, and forgets what the model cannot vouch for.
//! Where M is small, as below the corner of an integrating feedback, little is learned: the feedback does it. The error
//! of a harmonic shrinks from period to period by |Q (1 - gamma L M')|, M' the true loop: [`IterativeLearning::convergence_rate`].
//!
//! [`IterativeLearning`] works on whole recorded periods, [`RepetitiveControl`] sample by sample beside the controller.

mod feedback_loop;
mod iterative;
mod options;
mod past;
mod repetitive;
mod spectra;
mod state;
mod taps;

pub use feedback_loop::FeedbackLoop;
pub use iterative::IterativeLearning;
pub use options::{LearningOptions, RepetitiveOptions, Trial};
pub use repetitive::RepetitiveControl;
pub use state::{IterativeState, RepetitiveState};
