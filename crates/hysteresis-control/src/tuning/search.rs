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

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVALS: [(f64, f64); 5] = [(0.0, 1.0), (-3.0, 5.0), (2.0, 2.5), (-7.0, -1.0), (0.0, 1e-3)];

    /// Rounding hides where a parabola is highest by less than about 1e-8 of its width.
    #[test]
    fn the_highest_is_found_wherever_it_is() {
        for (low, high) in INTERVALS {
            for share in [0.0, 0.1, 0.4, 0.5, 0.6, 0.9, 1.0] {
                let summit: f64 = low + share * (high - low);
                let (at, highest) = golden_section(low, high, |x| 3.0 - ((x - summit) / (high - low)).powi(2));
                assert!((at - summit).abs() < 1e-7 * (high - low), "{low} {high} {share}: {at}");
                assert!(highest <= 3.0 && highest > 3.0 - 1e-13, "{low} {high} {share}: {highest}");
            }
        }
    }

    #[test]
    fn a_change_of_sign_is_found_whichever_way_it_goes() {
        for (low, high) in INTERVALS {
            for (share, slope) in [(0.1, 1.0), (0.5, -2.0), (0.77, 1e-6), (0.9, -1e6)] {
                let zero: f64 = low + share * (high - low);
                let found = bisection(low, high, |x| slope * (x - zero));
                assert!((found - zero).abs() < 1e-15 * (1.0 + zero.abs()), "{low} {high} {share}: {found}");
            }
        }
    }

    #[test]
    fn the_greatest_that_holds_is_found_from_any_guess() {
        for limit in [3e-8, 0.02, 1.0, 1.5, 7e5] {
            let found = greatest(|x| x <= limit);
            assert!(found <= limit && found > limit * (1.0 - 1e-12), "{limit}: {found}");
            for guess in [0.0, 1e-3, 0.7, 1.0, 2.0, 3e6] {
                let found = greatest_near(guess, |x| x <= limit);
                assert!(found <= limit && found > limit * (1.0 - 2e-4), "{limit} from {guess}: {found}");
            }
        }
        // Nothing holds; and everything, up to where nobody looks.
        assert_eq!((greatest(|x| x <= 0.0), greatest_near(0.5, |_| false)), (0.0, 0.0));
        assert!((1e12..1e13).contains(&greatest(|_| true)) && (1e12..1e13).contains(&greatest_near(0.5, |_| true)));
    }
}
