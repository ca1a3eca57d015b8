//! How far a search is, and whether it is to stop.

use std::ops::ControlFlow;

use crate::error::Error;
use crate::fit::point::Point;
use crate::fit::projection::{ProjectedFit, Projection};
use crate::records::signal::as_f64;

/// What the search is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SearchStage {
    /// Trying starts on a selection of the samples.
    Scan,
    /// Improving the best starts on that selection.
    Refine,
    /// Trying dynamics and creep behind the hysteresis found.
    Dynamics,
    /// Improving the best of them on all samples.
    Finish,
}

/// How far the search is, reported after every evaluation of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Progress {
    /// What the search is doing; where cross-validation chooses, one search follows the other.
    pub stage: SearchStage,
    /// Passes over the records so far.
    pub evaluations: usize,
    /// The smallest root mean square error of this stage, in the unit of the output, over the samples it uses.
    pub best_rmse: f64,
    /// The share of the work that is done at least, from 0 to 1; it never decreases.
    pub fraction: f64,
}

/// What an identification that is told to stop leaves behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Nothing: [`Error::Interrupted`].
    Discard,
    /// The best that was found so far, marked as partial.
    KeepBest,
}

const WHOLE: Span = Span { from: 0.0, to: 1.0 };

/// Counts evaluations and reports them.
pub(crate) struct SearchMonitor<'a> {
    report: &'a mut dyn FnMut(&Progress) -> ControlFlow<Stop>,
    now: Progress,
    /// Where the smallest error of this stage was found.
    best: Option<Point>,
    keeps_best: bool,
    /// The share of the present part of the work that the present search is.
    span: Span,
    /// The share of the whole work that the present part is.
    part: Span,
    /// The share of everything that the present whole is: less than all for a search within another.
    whole: Span,
    /// What was reported as done before the work that is now repeated.
    done: f64,
}

impl<'a> SearchMonitor<'a> {
    pub(crate) fn new(report: &'a mut dyn FnMut(&Progress) -> ControlFlow<Stop>) -> Self {
        let now = Progress { stage: SearchStage::Scan, evaluations: 0, best_rmse: f64::INFINITY, fraction: 0.0 };
        Self { report, now, best: None, keeps_best: false, span: WHOLE, part: WHOLE, whole: WHOLE, done: 0.0 }
    }

    /// The best point so far, if the search was stopped and that is to be kept.
    pub(crate) fn kept(&self) -> Option<Point> {
        self.best.filter(|_| self.keeps_best)
    }

    /// Makes the next search the part number `part` of so many.
    pub(crate) fn within(&mut self, part: usize, of: usize) {
        self.span = WHOLE.part(part, of);
        self.enter(SearchStage::Scan);
    }

    /// Begins the choice of the structure, the first half of a part of the work.
    pub(crate) fn begin_structure(&mut self) {
        self.span = WHOLE.part(0, 2);
        self.enter(SearchStage::Refine);
    }

    /// Whether the search was stopped and the best is to be kept.
    pub(crate) fn keeps_best(&self) -> bool {
        self.keeps_best
    }

    /// Begins the search for dynamics: what was best for the hysteresis alone is none of its points.
    pub(crate) fn forget(&mut self) {
        self.enter(SearchStage::Dynamics);
        self.best = None;
    }

    /// Makes the next searches a part of the whole work.
    pub(crate) fn begin(&mut self, part: Span) {
        (self.part, self.span) = (part, WHOLE);
    }

    /// Makes a search with parts of its own the present part of the work.
    pub(crate) fn nested<T>(&mut self, search: impl FnOnce(&mut Self) -> T) -> T {
        let (part, whole) = (self.part, self.whole);
        self.whole = Span { from: whole.within(part.from), to: whole.within(part.to) };
        let found = search(self);
        self.whole = whole;
        self.begin(part);
        found
    }

    /// Begins again what is done already: progress does not go back.
    pub(crate) fn hold(&mut self) {
        self.done = self.now.fraction;
    }

    pub(crate) fn evaluations(&self) -> usize {
        self.now.evaluations
    }

    /// Reports that all is done, where some of the work was not needed. It is too late to stop.
    pub(crate) fn finish(&mut self) {
        self.now.fraction = 1.0;
        // Whatever the answer, the result is there.
        let _ = (self.report)(&self.now);
    }

    /// Starts a stage.
    pub(crate) fn enter(&mut self, stage: SearchStage) {
        self.now.stage = stage;
        self.now.best_rmse = f64::INFINITY;
    }

    /// Counts a fit that is only judged: it is none of the search.
    pub(crate) fn looked(&mut self, fraction: f64) -> Result<(), Error> {
        self.span = WHOLE;
        self.counted(fraction)
    }

    /// Counts one evaluation.
    pub(crate) fn evaluated(
        &mut self,
        projection: &Projection<'_>,
        fit: &ProjectedFit,
        fraction: f64,
    ) -> Result<(), Error> {
        let rmse = projection.rmse(fit.squares);
        if rmse < self.now.best_rmse {
            (self.now.best_rmse, self.best) = (rmse, Some(fit.point));
        }
        self.counted(fraction)
    }

    fn counted(&mut self, fraction: f64) -> Result<(), Error> {
        self.now.evaluations += 1;
        self.now.fraction = self.whole.within(self.part.within(self.span.within(fraction))).max(self.done);
        match (self.report)(&self.now) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(stop) => {
                self.keeps_best = stop == Stop::KeepBest;
                Err(Error::Interrupted)
            }
        }
    }
}

/// The part of the whole work that an improvement takes.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Span {
    /// A share of it, as a share of the whole.
    fn within(self, share: f64) -> f64 {
        self.from + (self.to - self.from) * share
    }

    /// The part number `number` of so many equal ones.
    pub(crate) fn part(self, number: usize, of: usize) -> Self {
        Self { from: self.at(number, of), to: self.at(number + 1, of) }
    }

    pub(crate) fn at(self, done: usize, of: usize) -> f64 {
        self.from + (self.to - self.from) * as_f64(done) / as_f64(of)
    }
}
