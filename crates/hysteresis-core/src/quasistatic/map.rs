use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::error::{Bound, Error, check_finite};

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
        if x.len() != y.len() {
            return Err(Error::Length { parameter: "y", expected: x.len(), got: y.len() });
        }
        let (Some((&last_x, _)), [first_y, second_y, ..]) = (x.split_last(), y) else {
            return Err(Error::Length { parameter: "x", expected: 2, got: x.len() });
        };
        for (parameter, values) in [("x", x), ("y", y)] {
            for (index, value) in values.iter().enumerate() {
                check_finite(parameter, Some(index), *value)?;
            }
        }
        let sign = if second_y > first_y { 1.0 } else { -1.0 };
        let lines = (1..x.len()).map(|i| MapLine::through(x, y, i, sign)).collect::<Result<Vec<_>, _>>()?;
        let last_y = y.last().copied().unwrap_or_default();
        Ok(Self { lines: lines.into(), last: (last_x, last_y) })
    }

    /// The points (x_i, y_i).
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.lines.iter().map(|line| (line.x, line.y)).chain([self.last])
    }

    /// Whether the map rises.
    #[must_use]
    pub fn is_rising(&self) -> bool {
        self.lines.first().is_some_and(|line| line.slope > 0.0)
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
        self.value(x, &mut 0)
    }

    /// The x whose value is y.
    #[must_use]
    pub fn inverse_at(&self, y: f64) -> f64 {
        self.argument(y, &mut 0)
    }

    /// [`at`](Self::at), starting from the line `cursor` and leaving it where x lies.
    #[inline]
    pub(super) fn value(&self, x: f64, cursor: &mut usize) -> f64 {
        let line = self.find(cursor, |line| line.x <= x);
        line.y + line.slope * (x - line.x)
    }

    /// [`inverse_at`](Self::inverse_at), starting from the line `cursor` and leaving it where y lies.
    #[inline]
    pub(super) fn argument(&self, y: f64, cursor: &mut usize) -> f64 {
        let line = if self.is_rising() {
            self.find(cursor, |line| line.y <= y)
        } else {
            self.find(cursor, |line| line.y >= y)
        };
        line.x + line.reciprocal * (y - line.y)
    }

    /// The last line that `begins` before the sought point; the first one if there is none. A smooth signal stays on
    /// its line or goes to the next one; a jump searches.
    #[inline]
    fn find(&self, cursor: &mut usize, begins: impl Fn(&MapLine) -> bool) -> MapLine {
        let starts = |i: usize| self.lines.get(i).is_some_and(&begins);
        let i = *cursor;
        if !((i == 0 || starts(i)) && !starts(i + 1)) {
            *cursor = self.lines.partition_point(&begins).saturating_sub(1);
        }
        self.lines.get(*cursor).copied().unwrap_or(MapLine { x: 0.0, y: 0.0, slope: 1.0, reciprocal: 1.0 })
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
