//! How far a search is, and whether it is to stop.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::error::Error;
use crate::fit::point::Point;
use crate::fit::projection::{ProjectedFit, Projection};
use crate::records::signal::as_f64;
use crate::threads::Shared;

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

/// A pass over fewer samples takes about as long as a thread takes to begin.
const WORTH_A_THREAD: usize = 10_000;

const WHOLE: Span = Span { from: 0.0, to: 1.0 };

/// What is told of every evaluation, with where the smallest error of this stage was found.
type Report<'a> = dyn FnMut(&Progress, Option<&Point>) -> ControlFlow<Stop> + 'a;

/// Counts evaluations and reports them.
pub(crate) struct SearchMonitor<'a> {
    report: Box<Report<'a>>,
    /// Searches that do not wait for each other are shared out among so many threads.
    threads: usize,
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
        Self::reporting(Box::new(|now, _| report(now)), 1)
    }

    /// The same on so many threads.
    #[cfg(test)]
    pub(crate) fn on_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    fn reporting(report: Box<Report<'a>>, threads: usize) -> Self {
        let now = Progress { stage: SearchStage::Scan, evaluations: 0, best_rmse: f64::INFINITY, fraction: 0.0 };
        let (span, part, whole) = (WHOLE, WHOLE, WHOLE);
        Self { report, threads, now, best: None, keeps_best: false, span, part, whole, done: 0.0 }
    }

    /// The same on all processors, if the records have so many samples that a pass over them is worth a thread.
    pub(crate) fn on_all_processors(self, samples: usize) -> Self {
        let all = || thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Self { threads: if samples < WORTH_A_THREAD { 1 } else { all() }, ..self }
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
        let _ = (self.report)(&self.now, self.best.as_ref());
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
        match (self.report)(&self.now, self.best.as_ref()) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(stop) => {
                self.keeps_best = stop == Stop::KeepBest;
                Err(Error::Interrupted)
            }
        }
    }
}

/// An evaluation on another thread: of which piece of work, and what it reports.
struct Message {
    piece: usize,
    now: Progress,
    best: Option<Point>,
}

impl SearchMonitor<'_> {
    /// What comes of pieces of work that do not wait for each other, each with its part of the work: the same for any number of threads. This
    /// thread reports what the others do.
    pub(crate) fn side_by_side<T: Send, U: Send>(
        &mut self,
        pieces: Vec<(T, Span)>,
        work: impl Fn(T, Span, &mut SearchMonitor<'_>) -> Result<U, Error> + Sync,
    ) -> Result<Vec<U>, Error> {
        let (count, threads) = (pieces.len(), self.threads.min(pieces.len()));
        if threads < 2 {
            return pieces.into_iter().map(|(piece, span)| work(piece, span, self)).collect();
        }
        let (pieces, spans): (Vec<_>, Vec<_>) =
            pieces.into_iter().map(|(piece, span)| (Mutex::new(Some(piece)), span)).unzip();
        let (stopped, of_each) = (AtomicBool::new(false), self.threads / threads);
        let one = |number: usize, messages: &Sender<Message>| {
            let begun = pieces[number].lock().unwrap_or_else(PoisonError::into_inner).take();
            let piece = begun.filter(|_| !stopped.load(Ordering::Relaxed)).ok_or(Error::Interrupted)?;
            let report = |now: &Progress, best: Option<&Point>| {
                // Whoever does not listen any more has stopped this.
                let _ = messages.send(Message { piece: number, now: *now, best: best.copied() });
                let goes_on = !stopped.load(Ordering::Relaxed);
                if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(Stop::Discard) }
            };
            let mut monitor = SearchMonitor::reporting(Box::new(report), of_each);
            monitor.now.fraction = spans[number].from;
            work(piece, spans[number], &mut monitor)
        };
        let (messages, told) = channel();
        let (reported, results) = thread::scope(|scope| {
            let mut goes_on = |_| ControlFlow::Continue(());
            let others = scope.spawn(move || {
                Shared::new(threads, &mut goes_on).all(count, false, |number, _| one(number, &messages))
            });
            let reported = self.report_pieces(&spans, &told, &stopped);
            (reported, others.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        });
        reported?;
        results.unwrap_or_default().into_iter().collect()
    }

    /// Reports what other threads do until all of it is done; tells them if it is to stop.
    fn report_pieces(&mut self, spans: &[Span], told: &Receiver<Message>, stopped: &AtomicBool) -> Result<(), Error> {
        let mut reached: Vec<f64> = spans.iter().map(|span| span.from).collect();
        let mut reported = Ok(());
        for Message { piece, now, best } in told {
            if reported.is_err() {
                continue;
            }
            if now.best_rmse < self.now.best_rmse {
                (self.now.best_rmse, self.best) = (now.best_rmse, best);
            }
            reached[piece] = now.fraction;
            let done: f64 = reached.iter().zip(spans).map(|(reached, span)| reached - span.from).sum();
            reported = self.counted(spans[0].from + done);
            stopped.store(reported.is_err(), Ordering::Relaxed);
        }
        reported
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

#[cfg(test)]
mod tests {
    use super::*;

    const PIECES: usize = 7;
    const LOOKS: usize = PIECES * (PIECES + 1) / 2;

    /// Pieces of work that each look `number + 1` times and come to their number's square; with what is reported, and whether it was stopped
    /// at a report.
    fn side_by_side(threads: usize, stop: Option<(usize, Stop)>) -> (Result<Vec<usize>, Error>, Vec<Progress>, bool) {
        let mut seen: Vec<Progress> = Vec::new();
        let mut report = |now: &Progress| {
            seen.push(*now);
            match stop {
                Some((at, stop)) if seen.len() == at => ControlFlow::Break(stop),
                _ => ControlFlow::Continue(()),
            }
        };
        let mut monitor = SearchMonitor::new(&mut report).on_threads(threads);
        let whole = Span { from: 0.2, to: 0.9 };
        let pieces = (0..PIECES).map(|number| (number, whole.part(number, PIECES))).collect();
        let found = monitor.side_by_side(pieces, |number, span, monitor| {
            (0..=number).try_for_each(|look| monitor.counted(span.at(look + 1, number + 1)))?;
            Ok(number * number)
        });
        assert_eq!(monitor.threads, threads);
        let keeps_best = monitor.keeps_best();
        drop(monitor);
        (found, seen, keeps_best)
    }

    #[test]
    fn work_side_by_side_is_the_same_for_any_number_of_threads_and_every_look_is_reported() {
        for threads in [1, 2, 3, 20] {
            let (found, seen, _) = side_by_side(threads, None);
            assert_eq!(found.unwrap(), (0..PIECES).map(|number| number * number).collect::<Vec<_>>());
            assert_eq!(seen.len(), LOOKS);
            for (number, now) in seen.iter().enumerate() {
                assert_eq!(now.evaluations, number + 1);
            }
            assert!(seen.windows(2).all(|pair| pair[0].fraction <= pair[1].fraction) && seen[0].fraction > 0.2);
            assert!((seen[seen.len() - 1].fraction - 0.9).abs() < 1e-12);
        }
    }

    #[test]
    fn work_side_by_side_ends_with_the_report_that_stops_it() {
        for threads in [1, 3] {
            for (at, stop) in [(1, Stop::Discard), (9, Stop::KeepBest), (LOOKS, Stop::Discard)] {
                let (found, seen, keeps_best) = side_by_side(threads, Some((at, stop)));
                assert!(matches!(found, Err(Error::Interrupted)), "{threads} {at}");
                assert_eq!((seen.len(), keeps_best), (at, stop == Stop::KeepBest));
            }
        }
    }

    #[test]
    fn the_first_error_of_work_side_by_side_is_handed_over() {
        for threads in [1, 3] {
            let mut report = |_: &Progress| ControlFlow::Continue(());
            let mut monitor = SearchMonitor::new(&mut report).on_threads(threads);
            let pieces = (0..5).map(|number| (number, WHOLE)).collect();
            let found = monitor.side_by_side(pieces, |number: usize, _, _| match number {
                2 | 3 => Err(Error::TooFewSamples { expected: 9, got: number }),
                _ => Ok(number),
            });
            assert_eq!(found.unwrap_err(), Error::TooFewSamples { expected: 9, got: 2 });
        }
    }
}
