//! `step`, `peek`, `reset` and `run` of linear streams never allocate.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use hysteresis_core::Process;
use hysteresis_simulate::linear::{Cascade, Creep, Delay, FirstOrder, SecondOrder, Stream};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Counts the allocations of each thread.
struct Counting;

// SAFETY: every request goes to the system allocator as it came; counting touches a thread-local number only.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.with(Cell::get);
    work();
    ALLOCATIONS.with(Cell::get) - before
}

#[test]
fn linear_streams_never_allocate() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 1, "the counter counts");
    let creep = Creep::new(&[0.01, 0.02], &[0.1, 1.0]).unwrap().block(1e-4).unwrap();
    let lags = Cascade(FirstOrder::new(279.0).unwrap().block(1e-4).unwrap(), Delay::new(2.4).unwrap().block());
    let stage = Cascade(SecondOrder::new(2000.0, 0.03).unwrap().block(1e-4).unwrap(), creep);
    let mut stream = Stream::new(Cascade(lags, stage), 0.5);
    let input: Vec<f64> = (0..1000_u32).map(|k| if k % 97 == 0 { f64::NAN } else { f64::from(k % 13) }).collect();
    let mut output = vec![0.0; input.len()];
    let count = allocations(|| {
        for u in &input {
            std::hint::black_box((stream.peek(*u), stream.step(*u)));
        }
        stream.reset();
        stream.run(&input, &mut output).unwrap();
    });
    assert_eq!(count, 0);
    assert_eq!(stream.rejected(), 11);
}
