//! The inverse of a strictly increasing polyline.

use super::family::Line;
use super::turning_points::Direction;

/// A place on a polyline with the line there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct At<P> {
    pub(crate) input: f64,
    pub(crate) place: P,
    pub(crate) line: Line,
}

/// Moves from `start` in `direction` until the output is `target`, or, as an error, to `limit` if it is not there yet.
///
/// `look(place, input)` gives the place and the line at an input ahead of `place`. Every step predicts the input from
/// the last line seen and looks there, which is Newton's method; it ends as soon as the line that predicted an input
/// is the line found there, so the answer is exact on that line. Bracketed, with a bisection every fourth step.
#[inline]
pub(crate) fn solve<P: Copy>(
    start: At<P>,
    direction: Direction,
    target: f64,
    limit: f64,
    look: impl Fn(P, f64) -> (P, Line),
) -> Result<At<P>, At<P>> {
    let sign = direction.sign();
    // Always near.output <= target < output at `far`, in the direction of travel, once `far` is known.
    let (mut near, mut far) = (start, None);
    let mut line = start.line;
    for step in 1_u32.. {
        let newton = line.inverted().at(target);
        let ahead = sign * newton >= sign * near.input;
        let (input, predicted) = match far {
            None if !(ahead && sign * newton < sign * limit) => (limit, false),
            Some(far) if step % 4 == 0 || !(ahead && sign * newton < sign * far) => {
                (near.input + 0.5 * (far - near.input), false)
            }
            _ => (newton, true),
        };
        let (place, found) = look(near.place, input);
        let here = At { input, place, line: found };
        let collapsed = !predicted && far.is_some_and(|far| input == near.input || input == far);
        if predicted && found == line || collapsed {
            return Ok(here);
        }
        if sign * found.at(input) <= sign * target {
            if input == limit {
                return if found.at(input) == target { Ok(here) } else { Err(here) };
            }
            near = here;
        } else {
            far = Some(input);
        }
        line = found;
    }
    Ok(near)
}
