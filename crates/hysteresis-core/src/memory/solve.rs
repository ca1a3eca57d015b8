//! The inverse of a strictly increasing polyline.

use super::family::Line;

/// The input between `near` and `far` at which the polyline `line_at` has the output `target`.
///
/// Newton steps inside a bracket, with a bisection every fourth step; finished exactly on a line as soon as the
/// line that predicted an input is the line found there. Needs `target` between the outputs at both ends.
#[inline]
pub(crate) fn solve(line_at: impl Fn(f64) -> Line, target: f64, near: f64, far: f64) -> f64 {
    let (mut low, mut high) = if near <= far { (near, far) } else { (far, near) };
    let mut input = near;
    let mut line = line_at(input);
    for step in 1_u32.. {
        if line.at(input) <= target {
            low = input;
        } else {
            high = input;
        }
        let newton = (target - line.offset) / line.slope;
        let middle = low + 0.5 * (high - low);
        let halve = step % 4 == 0 || !(low <= newton && newton <= high);
        let next = if halve { middle } else { newton };
        let found = line_at(next);
        if !halve && found == line || halve && (middle <= low || middle >= high) {
            return next;
        }
        (input, line) = (next, found);
    }
    input
}
