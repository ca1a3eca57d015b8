use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use crate::error::{Error, check_all_finite, check_length, is_admissible};

/// A matrix is refused above this condition number: six of sixteen digits would be left.
const LARGEST_CONDITION: f64 = 1e10;

/// An invertible matrix between axes and actuators: y = M x.
///
/// Row i is `M_i1 x_1 + M_i2 x_2 + ...`, summed from the first column on. Entries that are zero are left out. So with the
/// identity y has the bits of x, and a number that is not finite (or beyond 1e100) makes NaN of those y alone that depend
/// on it.
///
/// ```
/// use hysteresis_core::AxisMatrix;
/// let coupling = AxisMatrix::new("coupling", 2, &[1.0, 0.25, 0.0, 1.0])?;
/// let mut y = [0.0; 2];
/// coupling.apply(&[2.0, 4.0], &mut y)?;
/// assert_eq!(y, [3.0, 4.0]);
/// coupling.apply(&[f64::INFINITY, 4.0], &mut y)?;
/// assert!(y[0].is_nan() && y[1] == 4.0);
/// let error = AxisMatrix::new("coupling", 2, &[1.0, 2.0, 2.0, 4.0]).unwrap_err();
/// assert!(error.to_string().starts_with("coupling: expected an invertible matrix with a condition number of at most 1e10"));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AxisMatrix {
    entries: Box<[f64]>,
    axes: usize,
}

impl AxisMatrix {
    /// The matrix for so many axes, row by row. The parameter is what errors call it.
    ///
    /// # Errors
    /// [`Error::Empty`] without an axis, [`Error::Length`] unless there are N x N entries, [`Error::Domain`] for an entry
    /// that is not finite, and for a matrix whose condition number (of the largest column sum) is above 1e10: the number
    /// that came is the condition number.
    pub fn new(parameter: &'static str, axes: usize, entries: &[f64]) -> Result<Self, Error> {
        if axes == 0 {
            return Err(Error::Empty { parameter });
        }
        check_length(parameter, axes.saturating_mul(axes), entries.len())?;
        check_all_finite(parameter, entries)?;
        let condition = condition(axes, entries);
        if condition <= LARGEST_CONDITION {
            return Ok(Self { entries: entries.into(), axes });
        }
        let expected = "an invertible matrix with a condition number of at most 1e10";
        Err(Error::domain(parameter, None, expected, condition))
    }

    /// The matrix that leaves everything as it is, for at least one axis.
    #[must_use]
    pub fn identity(axes: usize) -> Self {
        let axes = axes.max(1);
        let entry = |index: usize| f64::from(u8::from(index / axes == index % axes));
        Self { entries: (0..axes * axes).map(entry).collect(), axes }
    }

    /// How many axes there are.
    #[must_use]
    pub fn axes(&self) -> usize {
        self.axes
    }

    /// The entries, row by row.
    #[must_use]
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// y = M x.
    ///
    /// # Errors
    /// [`Error::Length`] unless both have as many elements as there are axes; nothing is written then.
    pub fn apply(&self, x: &[f64], y: &mut [f64]) -> Result<(), Error> {
        check_length("x", self.axes, x.len())?;
        check_length("y", self.axes, y.len())?;
        for (y, row) in y.iter_mut().zip(self.rows()) {
            *y = product(row, x);
        }
        Ok(())
    }

    #[inline]
    pub(super) fn rows(&self) -> impl Iterator<Item = &[f64]> {
        // There is at least one axis; a row of no length would have no end.
        self.entries.chunks_exact(self.axes.max(1))
    }
}

/// A row times x.
#[inline]
pub(super) fn product(row: &[f64], x: &[f64]) -> f64 {
    let mut sum = None;
    for (entry, x) in row.iter().zip(x) {
        if *entry != 0.0 {
            if !is_admissible(*x) {
                return f64::NAN;
            }
            let term = entry * x;
            sum = Some(sum.map_or(term, |sum| sum + term));
        }
    }
    sum.unwrap_or(0.0)
}

/// The condition number for the largest column sum of magnitudes; infinite or NaN for a matrix without an inverse.
fn condition(axes: usize, entries: &[f64]) -> f64 {
    let norm = |rows: &[Vec<f64>], first: usize| {
        let sum = |column: usize| rows.iter().map(|row| row[column].abs()).sum::<f64>();
        (first..first + axes).map(sum).fold(0.0, f64::max)
    };
    // [M I], which Gauss and Jordan turn into [I M^-1].
    let mut rows: Vec<Vec<f64>> = vec![vec![0.0; 2 * axes]; axes];
    for (i, (row, given)) in rows.iter_mut().zip(entries.chunks_exact(axes)).enumerate() {
        row[..axes].copy_from_slice(given);
        row[axes + i] = 1.0;
    }
    let own = norm(&rows, 0);
    for i in 0..axes {
        let pivot = (i..axes).fold(i, |best, k| if rows[k][i].abs() > rows[best][i].abs() { k } else { best });
        if rows[pivot][i] == 0.0 {
            return f64::INFINITY;
        }
        rows.swap(i, pivot);
        let scale = rows[i][i];
        rows[i].iter_mut().for_each(|entry| *entry /= scale);
        let pivot_row = rows[i].clone();
        for (k, row) in rows.iter_mut().enumerate() {
            let factor = row[i];
            if k != i && factor != 0.0 {
                row.iter_mut().zip(&pivot_row).for_each(|(entry, pivot)| *entry -= factor * pivot);
            }
        }
    }
    own * norm(&rows, axes)
}
