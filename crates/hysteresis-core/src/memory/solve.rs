//! The inverse of a strictly increasing polyline.

use super::Piece;

/// A place on a polyline, with the line there and how far it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct At<P> {
    pub(crate) input: f64,
    pub(crate) place: P,
    pub(crate) piece: Piece,
}

/// Moves from `start`, in the direction of its piece, until the output is `target`, or, as an error, to `limit` if it
/// is not there yet. `far` is an input and its output known to lie beyond the target.
///
/// `look(place, input)` gives the place and the piece at an input ahead of `place`. Every step predicts the input from
/// the last line seen and looks there, which is Newton's method; the first, if it can, from the parabola through what
/// is known of both ends. It ends as soon as the line that predicted an input is known to hold there, so the answer is
/// exact on that line. Bracketed, with a bisection every fourth step.
#[inline]
pub(crate) fn solve<P: Copy>(
    start: At<P>,
    far: Option<(f64, f64)>,
    target: f64,
    limit: f64,
    look: impl Fn(P, f64) -> (P, Piece),
) -> Result<At<P>, At<P>> {
    let direction = start.piece.direction;
    // The output is at most the target at `near`, and beyond it at `far`, once that is known.
    let mut near = start;
    let mut line = start.piece.line;
    let mut prediction = far.and_then(|far| parabola(&start, far, target));
    let mut far = far.map(|(input, _)| input);
    for step in 1_u32.. {
        let newton = line.inverted().at(target);
        let within =
            |input: f64| direction.has_passed(near.input, input) && !direction.has_passed(far.unwrap_or(limit), input);
        let (input, predicted) = match (prediction.take(), far) {
            (Some(guess), Some(_)) if within(guess) => (guess, false),
            (_, None) if !within(newton) => (limit, false),
            (_, Some(far)) if step % 4 == 0 || !within(newton) => (near.input + 0.5 * (far - near.input), false),
            _ => (newton, true),
        };
        let (place, piece) = look(near.place, input);
        let here = At { input, place, piece };
        let collapsed = !predicted && far.is_some_and(|far| input == near.input || input == far);
        if predicted && piece.line == line || collapsed {
            return Ok(here);
        }
        line = piece.line;
        if direction.has_passed(line.at(input), target) {
            if input == limit {
                return if line.at(input) == target { Ok(here) } else { Err(here) };
            }
            near = here;
            let newton = line.inverted().at(target);
            let end = direction.nearer(piece.end, limit);
            if direction.has_passed(input, newton) && !direction.has_passed(end, newton) {
                return Ok(At { input: newton, ..here });
            }
        } else {
            far = Some(input);
        }
    }
    Ok(near)
}

/// Where the parabola that leaves `near` along its line and goes through `far` has the output `target`.
fn parabola<P>(near: &At<P>, far: (f64, f64), target: f64) -> Option<f64> {
    let (width, rise) = (far.0 - near.input, target - near.piece.line.at(near.input));
    let slope = near.piece.line.slope;
    let bend = ((far.1 - near.piece.line.at(near.input)) / width - slope) / width;
    // Newton's method on the parabola itself, from the chord: no square root without the standard library.
    let mut t = width * rise / (far.1 - near.piece.line.at(near.input));
    for _ in 0..3 {
        t -= ((slope + bend * t) * t - rise) / (slope + 2.0 * bend * t);
    }
    t.is_finite().then_some(near.input + t)
}
