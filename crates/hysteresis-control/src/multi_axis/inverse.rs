//! The drives for a whole reference: the linear part is inverted at every frequency, with what hysteresis adds known.

use std::f64::consts::PI;

use hysteresis_core::{Error, check_all_finite, check_length};
use nalgebra::{Complex, DMatrix, DVector};
use realfft::RealFftPlanner;

use super::forward::{MultiAxisForward, MultiAxisForwardState};
use super::model::MultiAxisStage;
use super::operator::{OperatorStream, ScalarOperator, middle};
use super::sub_steps::Sample;
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

/// Where the drives of a reference begin, and where they end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PrecompensationOptions {
    /// What the stage remembers before the first sample; at rest by default.
    pub start: Option<MultiAxisForwardState>,
    /// The limits of each drive; without them drives are what the reference asks for.
    pub limits: Option<Vec<(f64, f64)>>,
}

/// The drives for a reference, and how well the model follows it with them.
#[derive(Clone, Debug, PartialEq)]
pub struct Precompensation {
    /// Rows of drives, one for each row of the reference.
    pub drives: Vec<f64>,
    /// The rms difference between reference and positions of the model, from where it begins, for each position.
    pub missed: Vec<f64>,
    /// By how much the reference begins elsewhere than the stage is, for each position: nothing can be driven before
    /// its first sample, so that much is missed there.
    pub begins_off: Vec<f64>,
    /// How many drives the limits held back.
    pub held_back: u64,
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
    fn new(stage: &MultiAxisStage, sample: &Sample, length: usize) -> Option<Self> {
        let matrices = stage.matrices();
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex::from);
        let (n, m) = (stage.states(), stage.drives());
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

/// Where a reference begins, as a point at which the stage could rest and how far it is from there.
///
/// The point has the drives and the w of the beginning. Around it the linear part is at rest, so that the spectra of a
/// reference that begins there have no step; what it is away from there rings out whatever the drives do.
struct Start {
    forward: MultiAxisForward,
    /// q, v and the positions at the point of rest.
    queries: DVector<f64>,
    v: DVector<f64>,
    positions: DVector<f64>,
    /// What the states are away from it.
    away: DVector<f64>,
}

impl Start {
    /// None if the linear part has no point of rest.
    fn new(stage: &MultiAxisStage, forward: MultiAxisForward) -> Option<Self> {
        let (matrices, n) = (stage.matrices(), stage.states());
        let (states, drives) = forward.held().split_at(n);
        let (states, drives) = (DVector::from_row_slice(states), DVector::from_row_slice(drives));
        let w = DVector::from_iterator(stage.operators().len(), forward.operators().iter().map(OperatorStream::output));
        // In every sub-step w is the same at rest.
        let moved = &matrices.b * &drives + &matrices.bw * &w;
        let rest = (DMatrix::identity(n, n) - &matrices.a).lu().solve(&moved)?;
        let queries = &matrices.cq * &rest + &matrices.dq * &drives;
        let slopes = DVector::from_iterator(w.len(), stage.operators().iter().map(middle));
        let positions = &matrices.c * &rest + &matrices.d * &drives + DVector::from_row_slice(stage.output_offset());
        Some(Self { v: w - slopes.component_mul(&queries), queries, positions, away: states - rest, forward })
    }

    /// The last drives.
    fn drives(&self) -> &[f64] {
        &self.forward.held()[self.away.len()..]
    }

    /// Positions and q of all sub-steps, columns of samples, if drives and v stay as they are.
    fn ringing_out(&self, stage: &MultiAxisStage, sample: &Sample, length: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let c = &stage.matrices().c;
        let (mut positions, mut queries) = (vec![Vec::new(); c.nrows()], vec![Vec::new(); sample.cq.nrows()]);
        let mut away = self.away.clone();
        for _ in 0..length {
            let (y, q) = (c * &away + &self.positions, &sample.cq * &away);
            positions.iter_mut().zip(&y).for_each(|(column, number)| column.push(*number));
            let rest = self.queries.iter().cycle();
            queries.iter_mut().zip(q.iter().zip(rest)).for_each(|(column, (number, rest))| column.push(number + rest));
            away = &sample.a * away;
        }
        (positions, queries)
    }
}

impl MultiAxisStage {
    /// The drives that make the positions follow a whole reference, rows of p positions.
    ///
    /// With w known, beside its mean slope, the linear part is inverted at every frequency: zeros outside the unit
    /// circle need no other treatment, their drives begin before the reference moves. What the operators see then
    /// gives the next w, until nothing changes. Gains of less than a thousandth of the largest are not inverted in
    /// full, nor are frequencies at which passes would make drives grow, as hysteresis does more there than drives
    /// can: `missed` shows what that costs. The reference begins where the stage is (at rest at the output offset) and
    /// should stay there for as long as its dynamics ring, as nothing can be driven before its first sample. Drives
    /// are found without limits, and are held at them then.
    ///
    /// # Errors
    /// [`Error`] unless there are as many drives as positions, and whole rows of finite numbers; if a frequency moves
    /// no position; for the memory of another stage, and limits that are not pairs of finite numbers that rise.
    pub fn precompensate(&self, reference: &[f64], options: &PrecompensationOptions) -> Result<Precompensation, Error> {
        let (m, samples) = (self.drives(), reference.len() / self.positions());
        if m != self.positions() {
            return Err(Error::whole("reference", None, "a stage with as many drives as positions", m));
        }
        check_length("reference", samples * m, reference.len())?;
        check_all_finite("reference", reference)?;
        options.limits.as_ref().map_or(Ok(()), |limits| check_limits(limits, m))?;
        let mut forward = MultiAxisForward::new(self);
        options.start.as_ref().map_or(Ok(()), |state| forward.set_state(state))?;
        let behind = self.forgets_within().min(BEHIND.1).max(BEHIND.0);
        let length = (samples + 2 * behind).next_multiple_of(256);
        let sample = self.sample(&self.operators().iter().map(middle).collect::<Vec<_>>());
        let singular = || Error::domain("reference", None, "a stage whose drives move all positions", 0.0);
        let gains = Gains::new(self, &sample, length).ok_or_else(singular)?;
        let start = Start::new(self, forward).ok_or_else(singular)?;
        let (positions, queries) = start.ringing_out(self, &sample, length);
        let begins_off: Vec<f64> = reference.iter().zip(&positions).map(|(wanted, free)| wanted - free[0]).collect();
        let mut planner = RealFftPlanner::new();
        let wanted: Vec<Vec<f64>> =
            positions.iter().enumerate().map(|(i, free)| continued(reference, m, i, free)).collect();
        let wanted = spectra(&mut planner, &wanted, length);
        let (mut v, mut before) = (vec![vec![0.0; length]; queries.len()], Vec::new());
        for sweep in 1..=SWEEPS {
            let pass = linear(&mut planner, &gains, &wanted, &v, length);
            let converged = v.is_empty() || distance(&pass.drives, &before) <= SAME;
            if converged || sweep == SWEEPS {
                let mut drives: Vec<f64> = (0..samples)
                    .flat_map(|k| pass.drives.iter().zip(start.drives()).map(move |(u, start)| start + u[k]))
                    .collect();
                let held_back = options.limits.as_ref().map_or(0, |limits| hold(&mut drives, limits));
                let missed = missed(start.forward, &drives, reference)?;
                return Ok(Precompensation { drives, missed, begins_off, held_back, sweeps: sweep, converged });
            }
            v = self.beside(&start, &pass.queries, &queries, samples);
            before = pass.drives;
        }
        Err(singular())
    }

    /// So many samples later hardly anything is left of a sample.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    fn forgets_within(&self) -> usize {
        let slowest = self.matrices().a.complex_eigenvalues().iter().map(|one| one.norm()).fold(0.0, f64::max);
        (FORGOTTEN.ln() / slowest.min(1.0 - 1e-9).ln()).ceil() as usize
    }

    /// What v is beside that of the start in each sub-step, led back to 0 behind the reference: there the end joins the
    /// beginning.
    fn beside(&self, start: &Start, moved: &[Vec<f64>], free: &[Vec<f64>], samples: usize) -> Vec<Vec<f64>> {
        let slopes: Vec<f64> = self.operators().iter().map(middle).collect();
        let (mut operators, h) = (start.forward.operators().to_vec(), slopes.len());
        let length = moved.first().map_or(0, Vec::len);
        let mut all = vec![Vec::with_capacity(length); moved.len()];
        let back = (length - samples) / 2;
        for k in 0..length {
            let share = (as_f64(k.saturating_sub(samples)) / as_f64(back)).min(1.0);
            let fade = 0.5 * (1.0 + (PI * share).cos());
            for (i, all) in all.iter_mut().enumerate() {
                let q = moved[i][k] + free[i][k];
                all.push(fade * (operators[i % h].step(q) - slopes[i % h] * q - start.v[i % h]));
            }
        }
        all
    }
}

/// What a column of the reference asks of the drives beside the positions without them, led back to 0 behind it.
fn continued(reference: &[f64], axes: usize, axis: usize, free: &[f64]) -> Vec<f64> {
    let mut column: Vec<f64> = reference.chunks_exact(axes).zip(free).map(|(row, free)| row[axis] - free).collect();
    let last = column.last().copied().unwrap_or_default();
    let back = (free.len() - column.len()) / 2;
    column.extend((1..=back).map(|k| 0.5 * last * (1.0 + (PI * as_f64(k) / as_f64(back)).cos())));
    column.resize(free.len(), 0.0);
    column
}

fn check_limits(limits: &[(f64, f64)], drives: usize) -> Result<(), Error> {
    check_length("limits", drives, limits.len())?;
    let wrong = limits.iter().position(|(low, high)| !(low.is_finite() && high.is_finite() && low < high));
    wrong.map_or(Ok(()), |i| {
        let expected = "a low limit below a high one, both finite";
        Err(Error::domain("limits", Some(i), expected, limits[i].1))
    })
}

/// Holds drives at their limits; how many of them.
fn hold(drives: &mut [f64], limits: &[(f64, f64)]) -> u64 {
    let mut held_back = 0;
    for (drive, (low, high)) in drives.iter_mut().zip(limits.iter().cycle()) {
        let held = drive.clamp(*low, *high);
        held_back += u64::from(held != *drive);
        *drive = held;
    }
    held_back
}

/// The rms difference of each position, from where the stream stands.
fn missed(mut forward: MultiAxisForward, drives: &[f64], reference: &[f64]) -> Result<Vec<f64>, Error> {
    let (mut positions, p) = (vec![0.0; reference.len()], forward.positions());
    forward.run(drives, &mut positions)?;
    let rms = |i: usize| {
        let pairs = positions.iter().zip(reference).skip(i).step_by(p);
        let squares: f64 = pairs.clone().map(|(y, wanted)| (y - wanted).powi(2)).sum();
        (squares / as_f64(pairs.count().max(1))).sqrt()
    };
    Ok((0..p).map(rms).collect())
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
