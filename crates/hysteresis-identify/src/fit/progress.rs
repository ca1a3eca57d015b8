//! How far a search is, and whether it is to stop.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::error::Error;
use crate::fit::point::Point;
use crate::fit::projection::{ProjectedFit, Projection};
use crate::records::record::Record;
use crate::records::signal::as_f64;
use crate::threads;

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

/// How far the search is, reported after evaluations of the model.
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

/// With fewer samples threads gain little.
const WORTH_A_THREAD: usize = 10_000;

const WHOLE: Span = Span { from: 0.0, to: 1.0 };

/// What is told of every evaluation, with where the smallest error of this stage was found.
type Report<'a> = dyn FnMut(&Progress, Option<&Point>) -> ControlFlow<Stop> + 'a;

/// Counts evaluations and reports them.
pub(crate) struct SearchMonitor<'a> {
    report: Box<Report<'a>>,
    /// Searches that need no result of each other are shared out among so many threads.
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
    pub(crate) fn on_all_processors(self, records: &[Record<'_>]) -> Self {
        let samples: usize = records.iter().map(|record| record.input().len()).sum();
        Self { threads: if samples < WORTH_A_THREAD { 1 } else { threads::processors() }, ..self }
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

    /// What comes of a search; none if it was stopped and the best so far is to be kept.
    pub(crate) fn unless_stopped<T>(
        &mut self,
        search: impl FnOnce(&mut Self) -> Result<T, Error>,
    ) -> Result<Option<T>, Error> {
        match search(self) {
            Err(Error::Interrupted) if self.keeps_best => Ok(None),
            found => found.map(Some),
        }
    }

    /// What comes of a search, or where it began if it was stopped and the best so far is to be kept; and whether it was.
    pub(crate) fn or_where_it_began<T>(
        &mut self,
        search: impl FnOnce(&mut Self) -> Result<T, Error>,
        began: impl FnOnce() -> Result<T, Error>,
    ) -> Result<(T, bool), Error> {
        let searched = self.unless_stopped(search)?;
        let was_stopped = searched.is_none();
        Ok((searched.map_or_else(began, Ok)?, was_stopped))
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

    /// The same of a fit that is only judged: it is none of the search.
    pub(crate) fn counted(&mut self, fraction: f64) -> Result<(), Error> {
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

/// An evaluation on another thread: of which piece of work, how far that is, and the best so far.
struct Message {
    piece: usize,
    fraction: f64,
    best_rmse: f64,
    best: Option<Point>,
}

impl SearchMonitor<'_> {
    /// What comes of pieces of work that need no result of each other, each with its part of the work, one after the
    /// other: the same for any number of threads. This thread reports what the others do. A piece may evaluate, and
    /// share out work of its own.
    pub(crate) fn side_by_side<T: Send, U: Send>(
        &mut self,
        pieces: Vec<(T, Span)>,
        work: impl Fn(T, Span, &mut SearchMonitor<'_>) -> Result<U, Error> + Sync,
    ) -> Result<Vec<U>, Error> {
        let (count, at_once) = (pieces.len(), self.threads.min(pieces.len()));
        if at_once < 2 {
            return pieces.into_iter().map(|(piece, span)| work(piece, span, self)).collect();
        }
        let spans: Vec<_> = pieces.iter().map(|(_, span)| *span).collect();
        let pieces: Vec<_> = pieces.into_iter().map(|piece| Mutex::new(Some(piece))).collect();
        let taken = |number: usize| pieces[number].lock().unwrap_or_else(PoisonError::into_inner).take();
        let threads_of_each = self.threads / at_once;
        let work_on = |number: usize, sender: &SyncSender<Message>| {
            let (piece, span) = taken(number).ok_or(Error::Interrupted)?;
            let report = |now: &Progress, best: Option<&Point>| {
                let Progress { fraction, best_rmse, .. } = *now;
                let told = sender.send(Message { piece: number, fraction, best_rmse, best: best.copied() });
                // Whoever does not listen any more has stopped this.
                if told.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(Stop::Discard) }
            };
            let mut monitor = SearchMonitor::reporting(Box::new(report), threads_of_each);
            monitor.now.fraction = span.from;
            work(piece, span, &mut monitor)
        };
        let (sender, messages) = sync_channel(at_once);
        let done = thread::scope(|scope| {
            let all = || {
                // Messages end with this thread.
                let sender = sender;
                threads::all(at_once, count, |number| work_on(number, &sender))
            };
            let others = thread::Builder::new().spawn_scoped(scope, all).ok()?;
            let reported = self.report_pieces(&spans, messages);
            Some((reported, others.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))))
        });
        let Some((reported, results)) = done else {
            // The system refuses threads.
            let pieces = (0..count).filter_map(taken);
            return pieces.map(|(piece, span)| work(piece, span, self)).collect();
        };
        reported?;
        results.ok_or(Error::Interrupted)?.into_iter().collect()
    }

    /// Reports what other threads do until all of it is done, or it is to stop: then nobody listens to them any more.
    fn report_pieces(&mut self, spans: &[Span], messages: Receiver<Message>) -> Result<(), Error> {
        let (begin, end) = (spans[0].from, spans[spans.len() - 1].to);
        let mut reached: Vec<f64> = spans.iter().map(|span| span.from).collect();
        for Message { piece, fraction, best_rmse, best } in messages {
            if best_rmse < self.now.best_rmse {
                (self.now.best_rmse, self.best) = (best_rmse, best);
            }
            reached[piece] = fraction;
            let done: f64 = reached.iter().zip(spans).map(|(reached, span)| reached - span.from).sum();
            // A sum may be a rounding beyond where what follows begins.
            self.counted((begin + done).min(end))?;
        }
        Ok(())
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

    /// Pieces of work with equal parts of it.
    pub(crate) fn shared_by<T>(self, pieces: Vec<T>) -> Vec<(T, Self)> {
        let count = pieces.len();
        pieces.into_iter().enumerate().map(|(number, piece)| (piece, self.part(number, count))).collect()
    }

    pub(crate) fn at(self, done: usize, of: usize) -> f64 {
        self.from + (self.to - self.from) * as_f64(done) / as_f64(of)
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::atomic::{AtomicUsize, Ordering};

    use crate::fit::point::Parameter;

    use super::*;

    /// So many pieces of work side by side, then so many.
    const ROUNDS: [usize; 2] = [31, 11];

    /// A piece of work looks so many times.
    fn looks(number: usize) -> usize {
        number % 4 + 2
    }

    fn all_looks() -> usize {
        ROUNDS.into_iter().map(|pieces| (0..pieces).map(looks).sum::<usize>()).sum()
    }

    /// What comes of them, the square of each number, what is reported, and whether the best is kept, if it is stopped
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
        let (whole, all) = (Span { from: 0.2, to: 0.9 }, ROUNDS.iter().sum());
        let mut round = |first: usize, pieces: usize| {
            let pieces = (0..pieces).map(|number| (number, whole.part(first + number, all))).collect();
            monitor.side_by_side(pieces, |number, span, monitor| {
                (0..looks(number)).try_for_each(|look| monitor.counted(span.at(look, looks(number) - 1)))?;
                Ok(number * number)
            })
        };
        let found = round(0, ROUNDS[0]).and_then(|first| Ok([first, round(ROUNDS[0], ROUNDS[1])?].concat()));
        let keeps_best = monitor.keeps_best;
        drop(monitor);
        (found, seen, keeps_best)
    }

    #[test]
    fn work_side_by_side_is_the_same_for_any_number_of_threads_and_every_look_is_reported() {
        let squares: Vec<usize> =
            ROUNDS.into_iter().flat_map(|pieces| 0..pieces).map(|number| number * number).collect();
        for threads in [1, 2, 3, 40] {
            let (found, seen, _) = side_by_side(threads, None);
            assert_eq!(found.unwrap(), squares);
            assert_eq!(seen.len(), all_looks());
            for (number, now) in seen.iter().enumerate() {
                assert_eq!(now.evaluations, number + 1);
            }
            assert!(seen.windows(2).all(|pair| pair[0].fraction <= pair[1].fraction));
            assert!((seen[seen.len() - 1].fraction - 0.9).abs() < 1e-12);
        }
    }

    #[test]
    fn work_side_by_side_ends_with_the_report_that_stops_it() {
        for threads in [1, 3] {
            for (at, stop) in [(1, Stop::Discard), (9, Stop::KeepBest), (all_looks(), Stop::Discard)] {
                let (found, seen, keeps_best) = side_by_side(threads, Some((at, stop)));
                assert!(matches!(found, Err(Error::Interrupted)), "{threads} {at}");
                assert_eq!((seen.len(), keeps_best), (at, stop == Stop::KeepBest));
            }
        }
    }

    /// The best of all pieces is kept, wherever it was found: also one that shared out its own work.
    #[test]
    fn the_best_of_work_side_by_side_is_kept() {
        for threads in [1, 2, 6] {
            let mut report = |now: &Progress| {
                if now.evaluations == 12 { ControlFlow::Break(Stop::KeepBest) } else { ControlFlow::Continue(()) }
            };
            let mut monitor = SearchMonitor::new(&mut report).on_threads(threads);
            let at = |number: i32| Point::zero().with(Parameter::Ra, f64::from(number));
            let found = monitor.side_by_side(WHOLE.shared_by((0..3).collect()), |piece: i32, span, monitor| {
                monitor.side_by_side(span.shared_by((0..4).collect()), |number: i32, span, monitor| {
                    let error = f64::from((4 * piece + number - 7).abs());
                    if error < monitor.now.best_rmse {
                        (monitor.now.best_rmse, monitor.best) = (error, Some(at(4 * piece + number)));
                    }
                    monitor.counted(span.to)
                })
            });
            assert!(matches!(found, Err(Error::Interrupted)));
            assert_eq!(monitor.kept(), Some(at(7)));
        }
    }

    /// A report that panics stops what the other threads do.
    #[test]
    fn a_report_that_panics_ends_work_side_by_side() {
        let begun = AtomicUsize::new(0);
        let mut report = |_: &Progress| -> ControlFlow<Stop> { panic!("of the report") };
        let mut monitor = SearchMonitor::new(&mut report).on_threads(2);
        let pieces = WHOLE.shared_by((0..4).collect());
        let work = |_: usize, span: Span, monitor: &mut SearchMonitor<'_>| {
            (0..1000).try_for_each(|_| {
                begun.fetch_add(1, Ordering::Relaxed);
                monitor.counted(span.from)
            })
        };
        let panic = catch_unwind(AssertUnwindSafe(|| monitor.side_by_side(pieces, work))).unwrap_err();
        assert_eq!(panic.downcast_ref(), Some(&"of the report"));
        assert!(begun.into_inner() < 100);
    }

    #[test]
    fn the_first_error_of_work_side_by_side_is_handed_over() {
        for threads in [1, 3] {
            let mut report = |_: &Progress| ControlFlow::Continue(());
            let mut monitor = SearchMonitor::new(&mut report).on_threads(threads);
            let pieces = WHOLE.shared_by((0..5).collect());
            let found = monitor.side_by_side(pieces, |number: usize, _, _| match number {
                2 | 3 => Err(Error::TooFewSamples { expected: 9, got: number }),
                _ => Ok(number),
            });
            assert_eq!(found.unwrap_err(), Error::TooFewSamples { expected: 9, got: 2 });
        }
    }
}
