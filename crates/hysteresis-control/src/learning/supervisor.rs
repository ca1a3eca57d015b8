//! Watches whether the error shrinks from period to period, or grows.

use serde::{Deserialize, Serialize};

use crate::as_f64;
use crate::checks::check_terms;
use crate::linear::Error;

/// A window is whole periods of at least this many samples: noise makes the error of fewer a matter of luck.
const WINDOW: usize = 64;

/// The best error is that of so many windows together.
const TOGETHER: usize = 4;

/// An error above this many times the best one is doubtful.
const DOUBTFUL: f64 = 3.0;

/// A doubtful error that is larger than the one before counts once, by this factor twice.
const FAST: f64 = 1.5;

/// So many counts are divergence: three windows that grow fast, or five that grow at all.
const ENOUGH: u32 = 5;

/// By how many times what the reference has changed an error may be explained: fast motions overshoot.
const EXPLAINED: f64 = 2.0;

/// A doubtful error that grows fast, beyond this share of the largest swing of the reference and what its changes
/// explain, needs no second look: the stage is thrown about. That holds for references whose swing is more than
/// doubtful errors.
const OF_SWING: f64 = 0.5;

/// What supervision of learning remembers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SupervisorState {
    /// How many samples of the window came, and how many of them had an error.
    pub samples: [usize; 2],
    /// The sum of the squares of the errors in the window.
    pub errors: f64,
    /// The sum of the squares of what the reference differs from one period before.
    pub changes: f64,
    /// The first reference of the window, if there was any.
    pub first_reference: Option<f64>,
    /// The sum of what the references of the window differ from the first one, and of its squares.
    pub deviations: [f64; 2],
    /// The root mean square by which the reference changed in the last window.
    pub changed: f64,
    /// The largest standard deviation of the reference in a window.
    pub swing: f64,
    /// The mean squares of the errors in the last windows, the oldest first.
    pub windows: [f64; TOGETHER],
    /// How many of these there are.
    pub filled: usize,
    /// The best root mean square of the error, for the reference as it is now; none before there are windows.
    pub best: Option<f64>,
    /// What speaks for divergence.
    pub doubts: u32,
}

/// Tells divergence from errors and references alone: the loop that learning believes in takes no part.
///
/// A reference that changes from one period to the next brings an error that nothing has learned yet, in this window
/// and, as an echo of what was learned, in the next. So the best error may grow then, by what the change explains. It
/// never grows beyond the swing of the reference.
#[derive(Clone, Debug)]
pub(super) struct Supervisor {
    window: usize,
    state: SupervisorState,
}

impl Supervisor {
    pub(super) fn new(period: usize) -> Self {
        Self { window: period * WINDOW.div_ceil(period), state: SupervisorState::default() }
    }

    pub(super) fn state(&self) -> &SupervisorState {
        &self.state
    }

    /// Checks a state for [`restore`](Self::restore).
    pub(super) fn check(&self, state: &SupervisorState) -> Result<(), Error> {
        let SupervisorState { samples: [came, counted], filled, first_reference, .. } = *state;
        if came >= self.window || counted > came || filled > TOGETHER {
            let expected = "fewer samples than a window has, and at most as many errors";
            return Err(Error::whole("state.supervision.supervisor.samples", None, expected, came.max(counted)));
        }
        check_terms("state.supervision.supervisor", 2, &[first_reference.unwrap_or_default(), state.deviations[0]])?;
        let best = state.best.unwrap_or_default();
        let others = [state.errors, state.changes, state.deviations[1], state.changed, state.swing, best];
        let sizes = [&others[..], &state.windows].concat();
        check_terms("state.supervision.supervisor", sizes.len(), &sizes)?;
        match sizes.iter().position(|size| *size < 0.0) {
            None => Ok(()),
            Some(index) => {
                Err(Error::domain("state.supervision.supervisor", Some(index), "a number >= 0", sizes[index]))
            }
        }
    }

    pub(super) fn restore(&mut self, state: &SupervisorState) {
        self.state.clone_from(state);
    }

    pub(super) fn forget(&mut self) {
        self.state = SupervisorState::default();
    }

    /// Takes the error of a sample, its reference, and that of one period before. True if that was the end of a window
    /// that shows divergence.
    #[inline]
    pub(super) fn diverges(&mut self, error: Option<f64>, reference: Option<f64>, before: f64) -> bool {
        let state = &mut self.state;
        state.samples[0] += 1;
        if let Some(error) = error {
            state.samples[1] += 1;
            state.errors += error * error;
        }
        if let Some(reference) = reference {
            let (change, deviation) = (reference - before, reference - *state.first_reference.get_or_insert(reference));
            state.changes += change * change;
            state.deviations[0] += deviation;
            state.deviations[1] += deviation * deviation;
        }
        state.samples[0] >= self.window && self.judge()
    }

    /// At the end of a window.
    fn judge(&mut self) -> bool {
        let state = &mut self.state;
        let [came, counted] = state.samples;
        let [sum, squares] = state.deviations.map(|sum| sum / as_f64(came));
        state.swing = state.swing.max((squares - sum * sum).max(0.0).sqrt());
        let changed = (state.changes / as_f64(came)).sqrt();
        let explained = EXPLAINED * changed.max(core::mem::replace(&mut state.changed, changed));
        let error = (state.errors / as_f64(counted.max(1))).sqrt();
        (state.samples, state.errors, state.changes) = ([0; 2], 0.0, 0.0);
        (state.first_reference, state.deviations) = (None, [0.0; 2]);
        // Of too few errors nothing follows.
        2 * counted >= came && self.look_at(error, explained)
    }

    fn look_at(&mut self, error: f64, explained: f64) -> bool {
        let state = &mut self.state;
        let before = state.windows[TOGETHER - 1].sqrt();
        if let Some(best) = &mut state.best {
            let swing = if state.swing > 0.0 { state.swing } else { f64::INFINITY };
            *best = best.max(error.min(*best + explained).min(swing));
            state.doubts = if error <= DOUBTFUL * *best {
                0
            } else if error < before {
                state.doubts.saturating_sub(1)
            } else {
                let fast = error >= FAST * before;
                let thrown_about = fast && OF_SWING * swing > DOUBTFUL * *best && error > OF_SWING * swing + explained;
                state.doubts.saturating_add(if thrown_about { ENOUGH } else { 1 + u32::from(fast) })
            };
        }
        state.windows.rotate_left(1);
        state.windows[TOGETHER - 1] = error * error;
        state.filled = TOGETHER.min(state.filled + 1);
        let together = state.windows.iter().sum::<f64>() / as_f64(state.filled);
        state.best = Some(state.best.unwrap_or(f64::INFINITY).min(together.sqrt()));
        state.doubts >= ENOUGH
    }
}
