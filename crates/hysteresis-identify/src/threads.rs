//! Work that is shared out among threads: results come in the order of the work, whichever thread did it.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// More threads than that are never started, whatever is asked for.
const MOST: usize = 256;

/// How many threads may run at once.
pub(crate) fn processors() -> usize {
    thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// What comes of work number 0 to `count` - 1, in this order, that nobody is told of or stops.
pub(crate) fn all<T: Send>(threads: usize, count: usize, work: impl Fn(usize) -> T + Sync) -> Option<Vec<T>> {
    Shared::new(threads, &mut |_| ControlFlow::Continue(())).all(count, false, |number, _| work(number))
}

/// Whether the work is to go on, and how much of it is done.
pub(crate) struct Shared<'a> {
    threads: usize,
    /// Told after every piece of work that the calling thread has done.
    tell: &'a mut dyn FnMut(usize) -> ControlFlow<()>,
    done: usize,
}

/// What a piece of work may ask.
pub(crate) struct Underway<'a>(&'a AtomicBool);

impl Underway<'_> {
    /// Whether nobody wants the result any more.
    pub(crate) fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl<'a> Shared<'a> {
    pub(crate) fn new(threads: usize, tell: &'a mut dyn FnMut(usize) -> ControlFlow<()>) -> Self {
        Self { threads: threads.clamp(1, MOST), tell, done: 0 }
    }

    /// Does work number 0 to `count` - 1 and returns what came of it, in this order; nothing if it was stopped. Only
    /// work that is `counted` is told.
    pub(crate) fn all<T: Send>(
        &mut self,
        count: usize,
        counted: bool,
        work: impl Fn(usize, &Underway<'_>) -> T + Sync,
    ) -> Option<Vec<T>> {
        let (next, done, stopped) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
        let results = Mutex::new((0..count).map(|_| None).collect::<Vec<_>>());
        let one = || {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count || stopped.load(Ordering::Relaxed) {
                return false;
            }
            let result = work(number, &Underway(&stopped));
            results.lock().unwrap_or_else(PoisonError::into_inner)[number] = Some(result);
            done.fetch_add(1, Ordering::Relaxed);
            true
        };
        let before = self.done;
        thread::scope(|scope| {
            for _ in 1..self.threads.min(count) {
                // A thread that the system refuses leaves its work to the others.
                let _ = thread::Builder::new().spawn_scoped(scope, || while one() {});
            }
            while one() {
                let now = if counted { before + done.load(Ordering::Relaxed) } else { before };
                if (self.tell)(now).is_break() {
                    stopped.store(true, Ordering::Relaxed);
                }
            }
        });
        if counted {
            self.done += count;
        }
        let results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
        if stopped.into_inner() { None } else { results.into_iter().collect() }
    }
}
