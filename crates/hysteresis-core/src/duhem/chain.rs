//! The branch of one direction: f over z, straight between knots, and what follows for z over x.

use crate::duhem::exponential::{exponential_rise, per_logarithmic_mean};
use crate::error::MAX_MAGNITUDE;

/// By which share a bound of the length of a piece stays below it, so that rounding does not put it above.
const BELOW: f64 = 1e-12;

/// The share of x - `anchor_x` by which the last step of Newton's method moves, and how many steps there are at most.
const LAST_STEP: f64 = 1e-9;
const MOST_STEPS: usize = 50;

/// A stretch of z on which f is a straight line, in the order in which a rising branch passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    start: f64,
    end: f64,
    /// df/dz.
    gradient: f64,
    /// The end at which f is smaller, and f there: seen from it f is a sum of what is not negative.
    reference: (f64, f64),
    /// f at the start as it was given.
    given: f64,
    /// f at the start and at the end, as `slope_at` has it.
    slope: (f64, f64),
    /// By how much x grows from start to end.
    span: f64,
}

impl Segment {
    /// Nowhere: what stands where no segment is.
    const NONE: Self = Self {
        start: f64::INFINITY,
        end: f64::INFINITY,
        gradient: 0.0,
        reference: (0.0, 1.0),
        given: 1.0,
        slope: (1.0, 1.0),
        span: f64::INFINITY,
    };

    /// From a knot (z, f) to the next.
    fn between(from: (f64, f64), to: (f64, f64)) -> Self {
        let gradient = (to.1 - from.1) / (to.0 - from.0);
        let reference = if from.1 <= to.1 { from } else { to };
        let bare = Self { start: from.0, end: to.0, gradient, reference, given: from.1, ..Self::NONE };
        let bare = Self { slope: (bare.slope_at(from.0), bare.slope_at(to.0)), ..bare };
        Self { span: bare.distance(bare.slope.0, to.0 - from.0), ..bare }
    }

    /// Up to the first knot, from far below.
    fn below(first: (f64, f64), gradient: f64) -> Self {
        let start = f64::NEG_INFINITY;
        Self { start, end: first.0, gradient, reference: first, slope: (first.1, first.1), ..Self::NONE }
    }

    /// From the last knot on.
    fn above(last: (f64, f64), gradient: f64) -> Self {
        Self { start: last.0, gradient, reference: last, given: last.1, slope: (last.1, last.1), ..Self::NONE }
    }

    /// f.
    #[inline]
    pub(super) fn slope_at(&self, z: f64) -> f64 {
        self.reference.1 + self.gradient * (z - self.reference.0)
    }

    /// By how much x grows while z grows by `rise` to the end of the segment, f being `slope` at first.
    fn distance(&self, slope: f64, rise: f64) -> f64 {
        if rise == f64::INFINITY {
            return f64::INFINITY;
        }
        per_logarithmic_mean(rise, (slope, self.slope.1), self.gradient * rise)
    }
}

/// A place among the segments of a chain: 0 is below the first knot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place(pub(super) usize);

/// f over all z, for a rising branch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chain<const N: usize> {
    below: Segment,
    /// Those that begin at a knot.
    above: [Segment; N],
    knots: usize,
}

impl<const N: usize> Chain<N> {
    /// Through knots (z, f) whose z increase, at least two and at most N. Where f grows outwards from the outer ones
    /// the line goes on, where it falls f stays: it is positive everywhere.
    pub(super) fn open(knots: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        Self::new(knots, |outwards| outwards.max(0.0))
    }

    /// The same, and f stays beyond the outer knots: it is nowhere larger than at a knot.
    pub(super) fn within(knots: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        Self::new(knots, |_| 0.0)
    }

    /// `beyond` says by how much f grows per unit of |z| beyond an outer knot, from how it grows towards that knot.
    fn new(knots: impl Iterator<Item = (f64, f64)> + Clone, beyond: impl Fn(f64) -> f64) -> Self {
        let mut above = [Segment::NONE; N];
        let mut count = 0;
        let nexts = knots.clone().skip(1).map(Some).chain([None]);
        let (mut below, mut last_gradient) = (None, 0.0);
        for ((slot, knot), next) in above.iter_mut().zip(knots).zip(nexts) {
            let above = || Segment::above(knot, beyond(last_gradient));
            let segment = next.map_or_else(above, |to| Segment::between(knot, to));
            last_gradient = segment.gradient;
            below = below.or_else(|| Some(Segment::below(knot, -beyond(-segment.gradient))));
            *slot = segment;
            count += 1;
        }
        Self { below: below.unwrap_or(Segment::NONE), above, knots: count }
    }

    /// The knots (z, f).
    pub(super) fn knots(&self) -> impl Iterator<Item = (f64, f64)> + Clone + '_ {
        self.above.iter().take(self.knots).map(|segment| (segment.start, segment.given))
    }

    #[inline]
    fn segment(&self, place: Place) -> Option<&Segment> {
        match place.0.checked_sub(1) {
            None => Some(&self.below),
            Some(above) => self.above.get(above),
        }
    }

    /// The place as the chain of the other direction counts it.
    #[inline]
    pub(super) fn mirrored(&self, place: Place) -> Place {
        Place(self.knots.saturating_sub(place.0))
    }

    /// The segment that begins at or below z and ends above it, looked for from a place on.
    #[inline]
    pub(super) fn find(&self, z: f64, mut near: Place) -> (Place, &Segment) {
        loop {
            let Some(segment) = self.segment(near) else { return (Place(0), &self.below) };
            if z < segment.start {
                near.0 -= 1;
            } else if z >= segment.end {
                near.0 += 1;
            } else {
                return (near, segment);
            }
        }
    }

    /// The piece of a branch that begins at (x, z).
    #[inline]
    pub(super) fn piece(&self, x: f64, z: f64, near: Place) -> Piece {
        let (place, segment) = self.find(z, near);
        let slope = segment.slope_at(z);
        let least = (1.0 - BELOW) * (segment.end - z) / slope.max(segment.slope.1);
        let gradient = segment.gradient;
        Piece { place, x, z, slope, gradient, end: x + least, end_z: segment.end, end_is_exact: least == f64::INFINITY }
    }

    /// The same piece with its exact end.
    #[inline]
    pub(super) fn exact(&self, piece: &Piece) -> Piece {
        let distance = |segment: &Segment| segment.distance(piece.slope, segment.end - piece.z);
        let end = piece.x + self.segment(piece.place).map_or(f64::INFINITY, distance);
        Piece { end, end_is_exact: true, ..*piece }
    }

    /// The first piece behind this one that has not `ended`, by the (x, z) of its end. There is one: the last has no
    /// end.
    #[inline]
    pub(super) fn behind(&self, piece: &Piece, ended: impl Fn(f64, f64) -> bool) -> Piece {
        let mut x = piece.end;
        for (segment, place) in self.above.iter().zip(1..).skip(piece.place.0) {
            let end = x + segment.span;
            if !ended(end, segment.end) {
                let (z, slope, gradient, end_z) = (segment.start, segment.slope.0, segment.gradient, segment.end);
                return Piece { place: Place(place), x, z, slope, gradient, end, end_z, end_is_exact: true };
            }
            x = end;
        }
        *piece
    }
}

/// What lies of a rising branch on one segment: z over x from an anchor on, one exponential.
///
/// z = `anchor_z` + f h (e^(g h) - 1) / (g h) with h = x - `anchor_x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) place: Place,
    /// The anchor.
    pub(super) x: f64,
    pub(super) z: f64,
    /// f at the anchor.
    slope: f64,
    gradient: f64,
    /// Where the segment ends, or an x before that: a logarithm is taken only where a move may lead beyond.
    pub(super) end: f64,
    pub(super) end_z: f64,
    pub(super) end_is_exact: bool,
}

impl Piece {
    /// By how much z grows within h.
    #[inline]
    fn rise(&self, h: f64) -> f64 {
        exponential_rise(self.slope, self.gradient, h)
    }

    /// z.
    #[inline]
    pub(super) fn at(&self, x: f64) -> f64 {
        (self.z + self.rise(x - self.x)).min(self.end_z).min(MAX_MAGNITUDE)
    }

    /// The x at which `gain` x + `sign` z has grown by `growth` since the anchor; it is not before `last`.
    ///
    /// The sum rises with x, convex or concave. So Newton's method comes from one side after its first step, and that
    /// step is kept below a bound.
    #[inline]
    pub(super) fn solve(&self, gain: f64, sign: f64, growth: f64, last: f64) -> f64 {
        let tangent = growth / (gain + sign * self.slope);
        // Convex: the tangent leads too far. Concave: not far enough.
        let convex = sign * self.gradient > 0.0;
        let (low, high) = if convex && sign < 0.0 {
            // A rise that comes to rest: far along, the sum is a line, and one step comes back from there.
            (last - self.x, tangent)
        } else if convex {
            (last - self.x, self.upper_bound(gain, growth, tangent))
        } else {
            (tangent.max(last - self.x), f64::INFINITY)
        };
        let mut h = low;
        for _ in 0..MOST_STEPS {
            let rise = sign * self.rise(h);
            // f at h is f + g times the rise.
            let slope = gain + sign * self.slope + self.gradient * rise;
            let next = (h + (growth - (gain * h + rise)) / slope).max(low).min(high);
            let moved = (next - h).abs();
            h = next;
            // Squared, what is left is rounding.
            if moved <= LAST_STEP * h {
                break;
            }
        }
        (self.x + h).min(MAX_MAGNITUDE)
    }

    /// Not far behind the solution of a convex piece: from far along an exponential, Newton's method would come back
    /// by 1 / g a step.
    fn upper_bound(&self, gain: f64, growth: f64, tangent: f64) -> f64 {
        if self.gradient * tangent < 1.0 {
            return tangent;
        }
        // Its rise is at least f h, so the sum is at least that share of the rise.
        let straight = growth / (self.slope + gain.min(0.0));
        let q = self.gradient * straight;
        tangent.min(per_logarithmic_mean(straight, (1.0, 1.0 + q), q))
    }
}
