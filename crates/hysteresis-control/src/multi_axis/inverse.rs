//! The drives for a whole reference: the linear part is inverted at every frequency, with what hysteresis adds known.

use std::f64::consts::PI;

use hysteresis_core::{Error, check_all_finite};
use nalgebra::{Complex, DMatrix, DVector};
use realfft::RealFftPlanner;

use super::forward::MultiAxisForward;
use super::model::MultiAxisStage;
use super::operator::{OperatorStream, ScalarOperator, middle};
use crate::as_f64;

/// Gains below this share of the largest one are not inverted in full: reference and rounding have nothing there that
/// drives should have.
const LEAST_GAIN: f64 = 1e-3;

/// What the dynamics keep of a sample that far away is none of its business.
const FORGOTTEN: f64 = 1e-8;

/// The fewest and the most samples behind the reference.
const BEHIND: (usize, usize) = (512, 1 << 16);

/// Drives that change by a smaller share are found.
const SAME: f64 = 1e-7;
const SWEEPS: usize = 150;

/// By how much what is missing must at least shrink from one pass to the next, at every frequency.
const SHRINKS: f64 = 0.9;

/// The drives for a reference, and how well the model follows it with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Precompensation {
    /// Rows of drives, one for each row of the reference.
    pub drives: Vec<f64>,
    /// The rms difference between reference and positions of the model, from rest, for each position.
    pub missed: Vec<f64>,
    /// How many passes were taken; [`converged`](Self::converged) says whether they came to an end.
    pub sweeps: usize,
    /// Whether another pass would change nothing.
    pub converged: bool,
}

/// For every frequency what drives are of wanted positions and of v, what w is beside slopes times q in each
/// sub-step; and what q is of drives and v.
struct Gains {
    by_position: Vec<DMatrix<Complex<f64>>>,
    by_operator: Vec<DMatrix<Complex<f64>>>,
    query_by_drive: Vec<DMatrix<Complex<f64>>>,
    query_by_operator: Vec<DMatrix<Complex<f64>>>,
}

impl Gains {
    /// With the middle slopes of the operators taken to the linear part: so passes come to an end soonest.
    fn new(stage: &MultiAxisStage, length: usize) -> Option<Self> {
        let matrices = stage.matrices();
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex::from);
        let (n, m) = (stage.states(), stage.drives());
        let slopes: Vec<f64> = stage.operators().iter().map(middle).collect();
        let sample = stage.sample(&slopes);
        let (a, b, bw) = (complex(&sample.a), complex(&sample.b), complex(&sample.bw));
        let (cq, dq, through) = (complex(&sample.cq), complex(&sample.dq), complex(&sample.through));
        let (c, d) = (complex(&matrices.c), complex(&matrices.d));
        let states = |bin: usize| {
            let z = Complex::from_polar(1.0, 2.0 * PI * as_f64(bin) / as_f64(length));
            let resolvent = (DMatrix::from_diagonal_element(n, n, z) - &a).lu();
            Some((resolvent.solve(&b)?, resolvent.solve(&bw)?))
        };
        let states = (0..=length / 2).map(states).collect::<Option<Vec<_>>>()?;
        let gain = |moved: &DMatrix<Complex<f64>>| &c * moved + &d;
        let largest = states.iter().map(|(moved, _)| gain(moved).norm()).fold(0.0, f64::max);
        let floor = DMatrix::from_diagonal_element(m, m, Complex::from((LEAST_GAIN * largest).powi(2)));
        let spreads = stage.operators().iter().map(spread).cycle().take(bw.ncols());
        let spreads = DMatrix::from_diagonal(&DVector::from_iterator(bw.ncols(), spreads.map(Complex::from)));
        let mut all = Self {
            by_position: Vec::new(),
            by_operator: Vec::new(),
            query_by_drive: Vec::new(),
            query_by_operator: Vec::new(),
        };
        for (moved, shaken) in states {
            let adjoint = gain(&moved).adjoint();
            let inverse = (&adjoint * gain(&moved) + &floor).lu().solve(&adjoint)?;
            let by_operator = &inverse * &c * &shaken;
            let (query_by_drive, query_by_operator) = (&cq * moved + &dq, &cq * shaken + &through);
            // From a change of v round to the next: it may not grow. Where positions tell q the two parts cancel.
            let round = &query_by_operator - &query_by_drive * &by_operator;
            let share = if largest_singular_value(&(&spreads * round)) <= SHRINKS {
                1.0
            } else {
                (SHRINKS / largest_singular_value(&(&by_operator * &spreads * &query_by_drive))).min(1.0)
            };
            all.by_operator.push(by_operator * Complex::from(share));
            all.by_position.push(inverse * Complex::from(share));
            all.query_by_drive.push(query_by_drive);
            all.query_by_operator.push(query_by_operator);
        }
        Some(all)
    }
}

/// 0 of a matrix without an entry, as of a stage without operators.
fn largest_singular_value(matrix: &DMatrix<Complex<f64>>) -> f64 {
    if matrix.is_empty() {
        return 0.0;
    }
    matrix.singular_values().iter().copied().fold(0.0, f64::max)
}

/// What a pass finds, columns of samples: the drives, and q of each operator in each sub-step.
struct Pass {
    drives: Vec<Vec<f64>>,
    queries: Vec<Vec<f64>>,
}

/// Spectra of columns.
fn spectra(planner: &mut RealFftPlanner<f64>, columns: &[Vec<f64>], length: usize) -> Vec<Vec<Complex<f64>>> {
    let transform = planner.plan_fft_forward(length);
    let spectrum = |column: &Vec<f64>| {
        let (mut input, mut output) = (column.clone(), transform.make_output_vec());
        // Lengths are those of the plan.
        let _ = transform.process(&mut input, &mut output);
        output
    };
    columns.iter().map(spectrum).collect()
}

/// The drives for wanted positions with v known, and what the operators see of both.
fn linear(
    planner: &mut RealFftPlanner<f64>,
    gains: &Gains,
    wanted: &[Vec<Complex<f64>>],
    v: &[Vec<f64>],
    length: usize,
) -> Pass {
    let v = spectra(planner, v, length);
    let (mut drives, mut queries) = (vec![Vec::new(); wanted.len()], vec![Vec::new(); v.len()]);
    let at = |columns: &[Vec<Complex<f64>>], bin: usize| {
        DVector::from_iterator(columns.len(), columns.iter().map(|column| column[bin] / as_f64(length)))
    };
    for bin in 0..=length / 2 {
        let added = at(&v, bin);
        let drive = &gains.by_position[bin] * at(wanted, bin) - &gains.by_operator[bin] * &added;
        let query = &gains.query_by_drive[bin] * &drive + &gains.query_by_operator[bin] * added;
        drives.iter_mut().zip(&drive).for_each(|(column, number)| column.push(*number));
        queries.iter_mut().zip(&query).for_each(|(column, number)| column.push(*number));
    }
    let transform = planner.plan_fft_inverse(length);
    let signals = |spectra: Vec<Vec<Complex<f64>>>| {
        let signal = |mut spectrum: Vec<Complex<f64>>| {
            // Real signals have real ends.
            spectrum[0].im = 0.0;
            spectrum[length / 2].im = 0.0;
            let mut column = transform.make_output_vec();
            let _ = transform.process(&mut spectrum, &mut column);
            column
        };
        spectra.into_iter().map(signal).collect()
    };
    Pass { drives: signals(drives), queries: signals(queries) }
}

impl MultiAxisStage {
    /// The drives that make the positions follow a whole reference, rows of p positions, from rest.
    ///
    /// With w known, beside its mean slope, the linear part is inverted at every frequency: zeros outside the unit
    /// circle need no other treatment, their drives begin before the reference moves. What the operators see then
    /// gives the next w, until nothing changes. Gains of less than a thousandth of the largest are not inverted in
    /// full, nor are frequencies at which passes would make drives grow, as hysteresis does more there than drives
    /// can: `missed` shows what that costs. The reference begins where the stage rests (the output offset) and should
    /// rest there for as long as its dynamics ring, as nothing can be driven before its first sample. Limits of the
    /// drives are not known: check them.
    ///
    /// # Errors
    /// [`Error`] unless there are as many drives as positions, and whole rows of finite numbers; and if a frequency
    /// moves no position.
    pub fn precompensate(&self, reference: &[f64]) -> Result<Precompensation, Error> {
        let (m, samples) = (self.drives(), reference.len() / self.positions());
        if m != self.positions() {
            return Err(Error::whole("reference", None, "a stage with as many drives as positions", m));
        }
        hysteresis_core::check_length("reference", samples * m, reference.len())?;
        check_all_finite("reference", reference)?;
        let behind = self.forgets_within().min(BEHIND.1).max(BEHIND.0);
        let length = (samples + 2 * behind).next_multiple_of(256);
        let singular = || Error::domain("reference", None, "a stage whose drives move all positions", 0.0);
        let gains = Gains::new(self, length).ok_or_else(singular)?;
        let mut planner = RealFftPlanner::new();
        let wanted: Vec<Vec<f64>> = (0..m).map(|i| self.continued(reference, i, samples, length)).collect();
        let wanted = spectra(&mut planner, &wanted, length);
        let (mut v, mut before) = (vec![vec![0.0; length]; self.operators().len() * self.sub_steps()], Vec::new());
        for sweep in 1..=SWEEPS {
            let Pass { drives, queries } = linear(&mut planner, &gains, &wanted, &v, length);
            let converged = v.is_empty() || distance(&drives, &before) <= SAME;
            if converged || sweep == SWEEPS {
                let drives: Vec<f64> = (0..samples).flat_map(|k| drives.iter().map(move |u| u[k])).collect();
                let missed = self.missed(&drives, reference)?;
                return Ok(Precompensation { drives, missed, sweeps: sweep, converged });
            }
            v = self.beside(&queries, samples, length);
            before = drives;
        }
        Err(singular())
    }

    /// So many samples later hardly anything is left of a sample.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    fn forgets_within(&self) -> usize {
        let slowest = self.matrices().a.complex_eigenvalues().iter().map(|one| one.norm()).fold(0.0, f64::max);
        (FORGOTTEN.ln() / slowest.min(1.0 - 1e-9).ln()).ceil() as usize
    }

    /// A column of the reference from the rest position on, led back to it.
    fn continued(&self, reference: &[f64], axis: usize, samples: usize, length: usize) -> Vec<f64> {
        let (m, offset) = (self.drives(), self.output_offset()[axis]);
        let mut column: Vec<f64> =
            reference[axis.min(reference.len())..].iter().step_by(m).map(|y| y - offset).collect();
        let last = column.last().copied().unwrap_or_default();
        let back = (length - samples) / 2;
        column.extend((1..=back).map(|k| 0.5 * last * (1.0 + (PI * as_f64(k) / as_f64(back)).cos())));
        column.resize(length, 0.0);
        column
    }

    /// What w is beside slopes times q in each sub-step, from rest, led back to 0 behind the reference: there the end
    /// joins the beginning.
    fn beside(&self, queries: &[Vec<f64>], samples: usize, length: usize) -> Vec<Vec<f64>> {
        let mut operators: Vec<_> =
            self.operators().iter().map(|one| (OperatorStream::new(one), middle(one))).collect();
        let mut all = vec![Vec::with_capacity(length); queries.len()];
        let back = (length - samples) / 2;
        for k in 0..length {
            let share = (as_f64(k.saturating_sub(samples)) / as_f64(back)).min(1.0);
            let fade = 0.5 * (1.0 + (PI * share).cos());
            for (all, queries) in all.chunks_mut(operators.len()).zip(queries.chunks(operators.len())) {
                for ((all, q), (operator, slope)) in all.iter_mut().zip(queries).zip(&mut operators) {
                    all.push(fade * (operator.step(q[k]) - *slope * q[k]));
                }
            }
        }
        all
    }

    fn missed(&self, drives: &[f64], reference: &[f64]) -> Result<Vec<f64>, Error> {
        let (mut positions, p) = (vec![0.0; reference.len()], self.positions());
        MultiAxisForward::new(self).run(drives, &mut positions)?;
        let rms = |i: usize| {
            let pairs = positions.iter().zip(reference).skip(i).step_by(p);
            let squares: f64 = pairs.clone().map(|(y, wanted)| (y - wanted).powi(2)).sum();
            (squares / as_f64(pairs.count().max(1))).sqrt()
        };
        Ok((0..p).map(rms).collect())
    }
}

/// By how much its slopes differ from that.
fn spread(operator: &ScalarOperator) -> f64 {
    let (least, most) = operator.slopes();
    0.5 * (most - least)
}

/// The largest difference over the largest number; infinite if there was nothing before.
fn distance(now: &[Vec<f64>], before: &[Vec<f64>]) -> f64 {
    if before.is_empty() {
        return f64::INFINITY;
    }
    let pairs = || now.iter().flatten().zip(before.iter().flatten());
    let largest = pairs().fold(f64::MIN_POSITIVE, |largest, (now, _)| largest.max(now.abs()));
    pairs().map(|(now, before)| (now - before).abs()).fold(0.0, f64::max) / largest
}
