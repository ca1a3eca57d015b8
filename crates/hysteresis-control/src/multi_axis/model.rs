//! The parameters of a stage of several axes, their checks, and its file.

use hysteresis_core::{Error, check_all_finite};
use nalgebra::DMatrix;
use nalgebra::linalg::Schur;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use serde::{Deserialize, Serialize};

use super::operator::ScalarOperator;
use crate::checks::{check_positive, check_whole};
use crate::json_file::{self, FileError};

/// The schema of a saved stage of several axes.
pub const SCHEMA: &str = "mpi_hyst/multi_axis_stage/1";

/// The most states, drives, positions and operators.
const MOST_STATES: usize = 256;

/// The most sub-steps of a sample.
const MOST_SUB_STEPS: usize = 1000;

/// The matrices of x+ = A x + B u + Bw w, q = Cq x + Dq u, y = C x + D u: n states, m drives, p positions and h
/// operators.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrices {
    /// A, n x n.
    pub a: DMatrix<f64>,
    /// B, n x m.
    pub b: DMatrix<f64>,
    /// Bw, n x h.
    pub bw: DMatrix<f64>,
    /// C, p x n.
    pub c: DMatrix<f64>,
    /// D, p x m.
    pub d: DMatrix<f64>,
    /// Cq, h x n: what of the states an operator sees.
    pub cq: DMatrix<f64>,
    /// Dq, h x m: what of the drives it sees.
    pub dq: DMatrix<f64>,
}

impl Matrices {
    /// A and B of the linear dynamics with w = slopes times q.
    pub(super) fn with_slopes(&self, slopes: &[f64]) -> (DMatrix<f64>, DMatrix<f64>) {
        let by_query = DMatrix::from_fn(self.bw.nrows(), slopes.len(), |i, j| self.bw[(i, j)] * slopes[j]);
        (&self.a + &by_query * &self.cq, &self.b + by_query * &self.dq)
    }
}

/// Several axes with hysteresis in front of or inside their dynamics, sampled every `dt` seconds.
///
/// x(k+1) = A x(k) + B u(k) + Bw w(k), w_i = H_i\[q_i\], q = Cq x + Dq u, y = C x + D u + offset. It is causal: w acts
/// from the next sample on, so nothing has to be solved. With Cq = 0 hysteresis stands in front of the dynamics, with
/// another Cq inside them. A sample may have several such steps: see [`with_sub_steps`](Self::with_sub_steps).
///
/// ```
/// use hysteresis_control::multi_axis::{Matrices, MultiAxisForward, MultiAxisStage, ScalarOperator};
/// use nalgebra::DMatrix;
/// let matrices = Matrices {
///     a: DMatrix::from_row_slice(2, 2, &[0.5, 0.1, 0.0, 0.6]),
///     b: DMatrix::from_row_slice(2, 2, &[0.4, 0.0, 0.0, 0.3]),
///     bw: DMatrix::from_row_slice(2, 2, &[0.1, 0.0, 0.0, 0.1]),
///     c: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.0]),
///     d: DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, 0.0]),
///     cq: DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, 0.0]),
///     dq: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.0]),
/// };
/// let plays = ScalarOperator::plays(&[0.2], &[1.0])?;
/// let stage = MultiAxisStage::new(matrices, vec![plays.clone(), plays], vec![0.0, 0.0], 1e-3)?;
/// let mut y = [0.0; 2];
/// let mut forward = MultiAxisForward::new(&stage);
/// forward.step(&[1.0, 0.0], &mut y)?;
/// forward.step(&[1.0, 0.0], &mut y)?;
/// assert_eq!(y, [0.4 + 0.1 * 0.8, 0.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "File", into = "File")]
pub struct MultiAxisStage {
    matrices: Matrices,
    operators: Vec<ScalarOperator>,
    output_offset: Vec<f64>,
    dt: f64,
    sub_steps: usize,
}

impl MultiAxisStage {
    /// From the matrices, an operator for each row of Cq, what is added to each position, and the interval in
    /// seconds.
    ///
    /// Stability is that of the linear dynamics, and of what the largest and the smallest slopes of all operators
    /// make of them: A + Bw diag(dw/dq) Cq. That is necessary, not sufficient, for bounded motion.
    ///
    /// # Errors
    /// [`Error`] that names the matrix: unless shapes fit, all numbers are finite, there are 1 to 256 states, drives
    /// and positions, and all these matrices have their eigenvalues inside the unit circle.
    pub fn new(
        matrices: Matrices,
        operators: Vec<ScalarOperator>,
        output_offset: Vec<f64>,
        dt: f64,
    ) -> Result<Self, Error> {
        check_shapes(&matrices, operators.len(), output_offset.len())?;
        check_all_finite("output_offset", &output_offset)?;
        check_positive("dt", None, dt)?;
        let slopes = operators.iter().map(ScalarOperator::slopes);
        let (least, most): (Vec<f64>, Vec<f64>) = slopes.unzip();
        let feedback = |slopes: &[f64]| matrices.with_slopes(slopes).0;
        check_stable("a", "eigenvalues inside the unit circle", &matrices.a)?;
        // In front of the dynamics operators change no eigenvalue.
        if matrices.cq.iter().any(|entry| *entry != 0.0) {
            let expected = "eigenvalues of a + bw diag(slopes of the operators) cq inside the unit circle";
            check_stable("bw", expected, &feedback(&least))?;
            check_stable("bw", expected, &feedback(&most))?;
        }
        Ok(Self { matrices, operators, output_offset, dt, sub_steps: 1 })
    }

    /// The matrices are those of a sub-step of `dt / sub_steps` seconds; in a sample of `dt` seconds the drives are
    /// held for so many of them.
    ///
    /// For hysteresis inside the dynamics, as in front of them an operator sees what is held. Matrices come from
    /// continuous equations then, or from a record with the rate of the sub-steps. Those of a slower record have no
    /// part of a step: they were fitted with w that acts a whole sample later.
    ///
    /// ```
    /// use hysteresis_control::multi_axis::{MultiAxisForward, MultiAxisStage};
    /// use hysteresis_control::oscillator::HystereticOscillator;
    /// use hysteresis_core::Duhem;
    /// let hysteresis = Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)?;
    /// let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, hysteresis)?;
    /// let stage = MultiAxisStage::of_oscillator(&oscillator, 1e-3, 4)?;
    /// let fine = MultiAxisStage::of_oscillator(&oscillator, 2.5e-4, 1)?;
    /// assert_eq!((stage.sub_steps(), stage.matrices()), (4, fine.matrices()));
    /// let (mut plant, mut parts, mut y, mut same) =
    ///     (MultiAxisForward::new(&stage), MultiAxisForward::new(&fine), [0.0], [0.0]);
    /// plant.advance(&[100.0], &mut y)?;
    /// (0..4).try_for_each(|_| parts.advance(&[100.0], &mut same))?;
    /// assert_eq!(y, same);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Whole`] unless there are 1 to 1000 sub-steps.
    pub fn with_sub_steps(self, sub_steps: usize) -> Result<Self, Error> {
        Ok(Self { sub_steps: check_sub_steps(sub_steps)?, ..self })
    }

    /// The matrices, of a sub-step.
    #[must_use]
    pub fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// The operators, one for each row of Cq.
    #[must_use]
    pub fn operators(&self) -> &[ScalarOperator] {
        &self.operators
    }

    /// What is added to each position.
    #[must_use]
    pub fn output_offset(&self) -> &[f64] {
        &self.output_offset
    }

    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// How many steps are taken in an interval, 1 unless [`with_sub_steps`](Self::with_sub_steps) said otherwise.
    #[must_use]
    pub fn sub_steps(&self) -> usize {
        self.sub_steps
    }

    /// n.
    #[must_use]
    pub fn states(&self) -> usize {
        self.matrices.a.nrows()
    }

    /// m.
    #[must_use]
    pub fn drives(&self) -> usize {
        self.matrices.b.ncols()
    }

    /// p.
    #[must_use]
    pub fn positions(&self) -> usize {
        self.matrices.c.nrows()
    }

    /// As JSON, every number exactly.
    ///
    /// # Errors
    /// [`FileError::Json`], which no stage gives.
    pub fn to_json(&self) -> Result<String, FileError> {
        Ok(serde_json::to_string_pretty(self)?)
    }

    /// From what [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    /// [`FileError`] for another schema, an unknown or missing field, or numbers that no stage may have.
    pub fn from_json(text: &str) -> Result<Self, FileError> {
        json_file::read::<File, Self>(text, SCHEMA)
    }
}

/// The number itself if a sample may have so many.
pub(super) fn check_sub_steps(sub_steps: usize) -> Result<usize, Error> {
    let is_fine = (1..=MOST_SUB_STEPS).contains(&sub_steps);
    check_whole("sub_steps", is_fine, "1 to 1000 steps in a sample", sub_steps)?;
    Ok(sub_steps)
}

fn check_shapes(matrices: &Matrices, operators: usize, offsets: usize) -> Result<(), Error> {
    let Matrices { a, b, bw, c, d, cq, dq } = matrices;
    let (n, m, p) = (a.nrows(), b.ncols(), c.nrows());
    for (parameter, got) in [("a", n), ("b", m), ("c", p)] {
        if !(1..=MOST_STATES).contains(&got) {
            let expected = "a matrix for 1 to 256 states, drives and positions";
            return Err(Error::whole(parameter, None, expected, got));
        }
    }
    for (parameter, fits, expected, got) in [
        ("a", a.is_square(), "a square matrix", a.ncols()),
        ("b", b.nrows() == n, "as many rows as a", b.nrows()),
        ("c", c.ncols() == n, "as many columns as a", c.ncols()),
        ("d", d.nrows() == p, "as many rows as c", d.nrows()),
        ("d", d.ncols() == m, "as many columns as b", d.ncols()),
        ("cq", cq.nrows() == operators, "as many rows as there are operators", cq.nrows()),
        ("cq", cq.ncols() == n, "as many columns as a", cq.ncols()),
        ("dq", dq.nrows() == operators, "as many rows as there are operators", dq.nrows()),
        ("dq", dq.ncols() == m, "as many columns as b", dq.ncols()),
        ("bw", bw.nrows() == n, "as many rows as a", bw.nrows()),
        ("bw", bw.ncols() == operators, "as many columns as there are operators", bw.ncols()),
        ("operators", operators <= MOST_STATES, "at most 256 operators", operators),
        ("output_offset", offsets == p, "a number for each row of c", offsets),
    ] {
        if !fits {
            return Err(Error::whole(parameter, None, expected, got));
        }
    }
    for (parameter, matrix) in [("a", a), ("b", b), ("bw", bw), ("c", c), ("d", d), ("cq", cq), ("dq", dq)] {
        check_all_finite(parameter, matrix.as_slice())?;
    }
    Ok(())
}

fn check_stable(parameter: &'static str, expected: &'static str, matrix: &DMatrix<f64>) -> Result<(), Error> {
    let largest = spectral_radius(matrix);
    if largest < 1.0 { Ok(()) } else { Err(Error::domain(parameter, None, expected, largest)) }
}

/// The largest magnitude of an eigenvalue; infinite if none are found.
pub(super) fn spectral_radius(matrix: &DMatrix<f64>) -> f64 {
    const ITERATIONS: usize = 10_000;
    let mut balanced = matrix.clone();
    balance_parlett_reinsch(&mut balanced);
    let schur = if balanced.iter().all(|entry| entry.is_finite()) {
        Schur::try_new(balanced, f64::EPSILON, ITERATIONS)
    } else {
        None
    };
    let eigenvalues = schur.map(|schur| schur.complex_eigenvalues());
    eigenvalues.map_or(f64::INFINITY, |all| all.iter().map(|one| one.norm()).fold(0.0, f64::max))
}

/// Matrices are lists of rows.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    dt: f64,
    /// Left out where there is one.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    sub_steps: usize,
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    bw: Vec<Vec<f64>>,
    c: Vec<Vec<f64>>,
    d: Vec<Vec<f64>>,
    cq: Vec<Vec<f64>>,
    dq: Vec<Vec<f64>>,
    operators: Vec<ScalarOperator>,
    output_offset: Vec<f64>,
}

fn one() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_one(sub_steps: &usize) -> bool {
    *sub_steps == 1
}

impl From<MultiAxisStage> for File {
    fn from(stage: MultiAxisStage) -> Self {
        let rows = |matrix: &DMatrix<f64>| matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        let MultiAxisStage { matrices, operators, output_offset, dt, sub_steps } = stage;
        let Matrices { a, b, bw, c, d, cq, dq } = &matrices;
        let [a, b, bw, c, d, cq, dq] = [a, b, bw, c, d, cq, dq].map(rows);
        Self { schema: SCHEMA.to_owned(), dt, sub_steps, a, b, bw, c, d, cq, dq, operators, output_offset }
    }
}

impl TryFrom<File> for MultiAxisStage {
    type Error = Error;

    fn try_from(file: File) -> Result<Self, Error> {
        let (n, m) = (file.a.len(), file.b.first().map_or(0, Vec::len));
        let operators = file.operators.len();
        let matrix = |parameter: &'static str, rows: &[Vec<f64>], columns: usize| {
            if let Some(row) = rows.iter().find(|row| row.len() != columns) {
                return Err(Error::Length { parameter, expected: columns, got: row.len() });
            }
            Ok(DMatrix::from_row_iterator(rows.len(), columns, rows.iter().flatten().copied()))
        };
        let matrices = Matrices {
            a: matrix("a", &file.a, n)?,
            b: matrix("b", &file.b, m)?,
            bw: matrix("bw", &file.bw, operators)?,
            c: matrix("c", &file.c, n)?,
            d: matrix("d", &file.d, m)?,
            cq: matrix("cq", &file.cq, n)?,
            dq: matrix("dq", &file.dq, m)?,
        };
        Self::new(matrices, file.operators, file.output_offset, file.dt)?.with_sub_steps(file.sub_steps)
    }
}
