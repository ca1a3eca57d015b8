//! Searches in one dimension.

/// The highest of a function that rises and then falls, and where.
pub(super) fn golden_section(low: f64, high: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (low, high);
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..60 {
        if fa < fb {
            (low, a, fa) = (a, b, fb);
            b = low + share * (high - low);
            fb = f(b);
        } else {
            (high, b, fb) = (b, a, fa);
            a = high - share * (high - low);
            fa = f(a);
        }
    }
    if fa < fb { (b, fb) } else { (a, fa) }
}

/// Where a function changes its sign between two points at which it has different ones.
pub(super) fn bisection(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rises = f(high) > 0.0;
    let (mut low, mut high) = (low, high);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if (f(middle) > 0.0) == rises { &mut high } else { &mut low }) = middle;
    }
    0.5 * (low + high)
}

/// A gain that moves nothing, in units of what is sought.
pub(super) const TINY: f64 = 1e-9;

/// The greatest number up to which something holds: doubled from almost nothing on, then bisected.
pub(super) fn greatest(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, TINY);
    while high < 1e12 && holds(high) {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}

/// How often the interval is halved about the greatest number that is sought near a guess: to 1e-4 of it.
const HALVINGS: u32 = 14;

/// The greatest number up to which something holds, sought from a guess on; 0 below [`TINY`].
pub(super) fn greatest_near(guess: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let mut low = guess.max(TINY);
    if holds(low) {
        while low < 1e12 && holds(2.0 * low) {
            low *= 2.0;
        }
    } else {
        while !holds(low) {
            if low < TINY {
                return 0.0;
            }
            low *= 0.5;
        }
    }
    let mut high = 2.0 * low;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}
