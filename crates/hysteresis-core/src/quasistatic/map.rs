//! Monotone maps in front of the hysteresis and behind it.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::error::{Bound, Error, check_all_finite, check_length};

/// A slope of a map and its reciprocal: neither may overflow when it meets an admissible number.
const STEEPEST: f64 = 1e50;

/// A strictly monotone piecewise-linear map v = m(x) through given points, and its exact inverse.
///
/// Between two points the map is the straight line through them; before the first and after the last point the end
/// lines go on. It may rise or fall. Two maps serve a stage: gamma in front of the hysteresis (drive in, drive out) and
/// phi behind it (position in, position out). Kuhnen's superposition of one-sided dead zones is such a map.
///
/// ```
/// use hysteresis_core::PiecewiseLinearMap;
/// let map = PiecewiseLinearMap::new(&[0.0, 1.0, 3.0], &[0.0, 2.0, 3.0])?;
/// assert_eq!((map.at(0.5), map.at(2.0), map.at(5.0)), (1.0, 2.5, 4.0));
/// assert_eq!((map.inverse_at(1.0), map.inverse_at(2.5), map.inverse_at(4.0)), (0.5, 2.0, 5.0));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseLinearMap {
    lines: Box<[MapLine]>,
    last: (f64, f64),
    rising: bool,
}

/// The line from one point to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MapLine {
    x: f64,
    y: f64,
    slope: f64,
    reciprocal: f64,
}

impl PiecewiseLinearMap {
    /// The map through the points (x_i, y_i).
    ///
    /// # Errors
    /// [`Error::Length`] unless there are as many y as x, [`Error::Domain`] for fewer than two points, a number that is
    /// not finite, x that do not increase strictly, y that neither increase nor decrease strictly, or a slope
    /// outside 1e-50 to 1e50.
    pub fn new(x: &[f64], y: &[f64]) -> Result<Self, Error> {
        check_length("y", x.len(), y.len())?;
        let (Some((&last_x, _)), [first_y, second_y, ..]) = (x.split_last(), y) else {
            return Err(Error::Length { parameter: "x", expected: 2, got: x.len() });
        };
        for (parameter, values) in [("x", x), ("y", y)] {
            check_all_finite(parameter, values)?;
        }
        let sign = if second_y > first_y { 1.0 } else { -1.0 };
        let lines = (1..x.len()).map(|i| MapLine::through(x, y, i, sign)).collect::<Result<Vec<_>, _>>()?;
        let last_y = y.last().copied().unwrap_or_default();
        Ok(Self { lines: lines.into(), last: (last_x, last_y), rising: sign > 0.0 })
    }

    /// The points (x_i, y_i).
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.lines.iter().map(|line| (line.x, line.y)).chain([self.last])
    }

    /// Whether the map rises.
    #[must_use]
    pub fn is_rising(&self) -> bool {
        self.rising
    }

    /// The smallest and the largest slope, by magnitude.
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        let magnitudes = self.lines.iter().map(|line| line.slope.abs());
        magnitudes.fold((f64::INFINITY, 0.0), |(low, high), slope| (slope.min(low), slope.max(high)))
    }

    /// The value at x.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.piece_at(x).at(x)
    }

    /// The x whose value is y.
    #[must_use]
    pub fn inverse_at(&self, y: f64) -> f64 {
        self.inverse_piece_at(y).at(y)
    }

    /// The line over x that holds x.
    pub(super) fn piece_at(&self, x: f64) -> MapPiece {
        let i = self.lines.partition_point(|line| line.x <= x).saturating_sub(1);
        let begins = |i: usize| self.lines.get(i).map(|line| line.x);
        let (low, high) = (if i == 0 { None } else { begins(i) }, begins(i + 1));
        let line = self.line(i);
        MapPiece::new(low, high, line.slope, line.x, line.y)
    }

    /// The line over y that holds y.
    pub(super) fn inverse_piece_at(&self, y: f64) -> MapPiece {
        let begun = |line: &MapLine| if self.rising { line.y <= y } else { line.y > y };
        let i = self.lines.partition_point(begun).saturating_sub(1);
        let begins = |i: usize| self.lines.get(i).map(|line| line.y);
        let (first, last) = (if i == 0 { None } else { begins(i) }, begins(i + 1));
        let (low, high) = if self.rising { (first, last) } else { (last, first) };
        let line = self.line(i);
        MapPiece::new(low, high, line.reciprocal, line.y, line.x)
    }

    /// A line; there is always the first one.
    fn line(&self, i: usize) -> MapLine {
        self.lines.get(i).copied().unwrap_or(MapLine { x: 0.0, y: 0.0, slope: 1.0, reciprocal: 1.0 })
    }
}

/// The line on which a stream is, and where it holds: from `low` up to but not including `high`.
///
/// Which line holds a point depends on the point alone, so a restored stream continues bit for bit.
#[derive(Clone, Copy, Debug)]
pub(super) struct MapPiece {
    low: f64,
    high: f64,
    slope: f64,
    x: f64,
    y: f64,
}

impl MapPiece {
    fn new(low: Option<f64>, high: Option<f64>, slope: f64, x: f64, y: f64) -> Self {
        Self { low: low.unwrap_or(f64::NEG_INFINITY), high: high.unwrap_or(f64::INFINITY), slope, x, y }
    }

    /// The identity, everywhere: what there is without a map.
    pub(super) fn identity() -> Self {
        Self::new(None, None, 1.0, 0.0, 0.0)
    }

    #[inline]
    pub(super) fn holds(&self, x: f64) -> bool {
        x >= self.low && x < self.high
    }

    /// The value at x: finite for every admissible x, but not always admissible itself.
    #[inline]
    pub(super) fn at(&self, x: f64) -> f64 {
        self.y + self.slope * (x - self.x)
    }
}

impl MapLine {
    /// The line that ends at the point i, in a map that rises (sign 1) or falls (sign -1).
    fn through(x: &[f64], y: &[f64], i: usize, sign: f64) -> Result<Self, Error> {
        let [(x0, y0), (x1, y1)] = [(x[i - 1], y[i - 1]), (x[i], y[i])];
        if x1 <= x0 {
            let expected = Bound::Above { what: "the one before it", limit: x0 };
            return Err(Error::Domain { parameter: "x", index: Some(i), expected, got: x1 });
        }
        let slope = (y1 - y0) / (x1 - x0);
        let expected = if sign > 0.0 {
            Bound::Above { what: "the one before it (a rising map)", limit: y0 }
        } else {
            Bound::Below { what: "the one before it (a falling map)", limit: y0 }
        };
        if sign * (y1 - y0) <= 0.0 || !(1.0 / STEEPEST..=STEEPEST).contains(&slope.abs()) {
            return Err(Error::Domain { parameter: "y", index: Some(i), expected, got: y1 });
        }
        Ok(Self { x: x0, y: y0, slope, reciprocal: (x1 - x0) / (y1 - y0) })
    }
}
