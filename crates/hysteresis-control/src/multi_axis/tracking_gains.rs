//! The gains with which a stage of several axes follows references: of its states, of references that come early, of
//! what hysteresis adds, and of measurements.

use std::f64::consts::PI;

use hysteresis_core::{AxisMatrix, Error};
use nalgebra::{Complex, DMatrix, DVector};

use super::model::{MultiAxisStage, spectral_radius};
use super::operator::{ScalarOperator, middle};
use super::sub_steps::Sample;
use crate::as_f64;
use crate::checks::{check_number, check_whole};
use crate::riccati::value_of_several;

/// What changes of drives cost: drives where gains are below this share of the largest one are not worth their while.
const LEAST_GAIN: f64 = 1e-3;

/// Coefficients of references that come later are together at most this share of all.
const LEFT_OUT: f64 = 1e-3;

/// How many samples ahead references are looked for, and may be asked for.
const FARTHEST: usize = 512;

/// By how much of itself every frequency may be off.
const FREQUENCY_DOUBT: f64 = 0.02;

/// What a disturbance of the drives moves from sample to sample, over what of it comes and goes at once: variances.
const WANDERS: f64 = 0.1;

/// The largest noise of the drives beside that of measurements, both in units of the gain: variances. Beyond it faster
/// filters add more noise than they take disturbances away. So many filters are tried in a decade, and in all.
const LARGEST_NOISE: f64 = 100.0;
const PER_DECADE: f64 = 8.0;
const POWERS: u32 = 113;

/// The peak of the sensitivity unless told: in every direction of the positions a disturbance is at most doubled.
const PEAK_SENSITIVITY: f64 = 2.0;

/// Frequencies at which the sensitivity is looked at, beside those of the modes and poles; and so many more in each
/// of six decades below the lowest of them, where slow filters and slow poles act.
const FREQUENCIES: usize = 128;
const SLOW_PER_DECADE: usize = 8;

/// How a stage of several axes follows references.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackingOptions {
    /// How many samples early references come; by default as many as the dynamics use.
    pub ahead: Option<usize>,
    /// By how much the feedback may at most amplify what disturbs a position, at any frequency: 1.05 to 5.
    pub peak_sensitivity: f64,
}

impl Default for TrackingOptions {
    fn default() -> Self {
        Self { ahead: None, peak_sensitivity: PEAK_SENSITIVITY }
    }
}

/// The gains; positions are counted from the output offset.
#[derive(Clone, Debug)]
pub(super) struct TrackingGains {
    /// Of x and the last drives, m x (n + m).
    pub(super) by_held: DMatrix<f64>,
    /// Of the references of now, of the next sample, and so on.
    pub(super) by_reference: Vec<DMatrix<f64>>,
    /// Of what w is beside the middle slope times q, m x h.
    pub(super) by_operator: DMatrix<f64>,
    /// From what a position is beside the expected one to what the states are, and to the disturbance of the drives: (n + m) x p.
    pub(super) correction: DMatrix<f64>,
    /// From the positions to drives that bring them there and keep them, m x p.
    pub(super) static_inverse: DMatrix<f64>,
}

/// The linear dynamics with middle slopes, and each position in the unit of its own gain.
struct Linear {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
    /// One over the gain of each position.
    scale: DMatrix<f64>,
}

impl TrackingGains {
    pub(super) fn new(stage: &MultiAxisStage, options: &TrackingOptions) -> Result<Self, Error> {
        let (m, p) = (stage.drives(), stage.positions());
        check_whole("stage", m == p, "a stage with as many drives as positions", m)?;
        let peak = options.peak_sensitivity;
        check_number("peak_sensitivity", (1.05..=5.0).contains(&peak), "1.05 to 5", peak)?;
        let range = "1 to 512 samples";
        check_whole(
            "ahead",
            options.ahead.is_none_or(|n| (1..=FARTHEST).contains(&n)),
            range,
            options.ahead.unwrap_or(0),
        )?;
        let slopes: Vec<f64> = stage.operators().iter().map(middle).collect();
        let sample = stage.sample(&slopes);
        let pushed = sample.held(slopes.len()).bw;
        let Sample { a, b, .. } = sample;
        let expected = "a static gain with an inverse and a condition number of at most 1e10";
        let singular = || Error::domain("stage", None, expected, f64::INFINITY);
        let matrices = stage.matrices();
        let moved = (DMatrix::identity(a.nrows(), a.nrows()) - &a).lu().solve(&b).ok_or_else(singular)?;
        let gain = &matrices.c * moved + &matrices.d;
        let static_inverse = gain.clone().try_inverse().ok_or_else(singular)?;
        AxisMatrix::new("stage", m, static_inverse.transpose().as_slice()).map_err(|error| match error {
            Error::Domain { got, .. } => Error::domain("stage", None, expected, got),
            other => other,
        })?;
        let scale = DMatrix::from_diagonal(&DVector::from_iterator(p, gain.row_iter().map(|row| 1.0 / row.norm())));
        let linear = Linear { a, b, c: &scale * &matrices.c, d: &scale * &matrices.d, scale };
        let unsettled = || Error::domain("stage", None, "a stage that drives can bring to rest", 0.0);
        let follower = Follower::new(&linear, &pushed).ok_or_else(unsettled)?;
        let (by_reference, by_operator) = follower.coefficients(&linear, options.ahead).ok_or_else(unsettled)?;
        let amplified = || {
            let expected = "a peak that some feedback keeps for all slopes of the operators";
            Error::domain("peak_sensitivity", None, expected, peak)
        };
        let correction = Watched::new(stage, &linear).correction(peak).ok_or_else(amplified)? * &linear.scale;
        Ok(Self { by_held: follower.by_held(m), by_reference, by_operator, correction, static_inverse })
    }
}

/// The least squares of position errors and changes of drives over all time: of the states x and the last drives, the
/// change of the drives is -K times these and what comes of references and operators.
struct Follower {
    k: DMatrix<f64>,
    /// (R + B'P B)^-1 B'.
    last: DMatrix<f64>,
    /// (R + B'P B)^-1 D'.
    now: DMatrix<f64>,
    /// A - B K, transposed.
    closed: DMatrix<f64>,
    /// (C - D K)'.
    seen: DMatrix<f64>,
    /// P times the way of w into the states.
    pushed: DMatrix<f64>,
}

impl Follower {
    fn new(linear: &Linear, bw: &DMatrix<f64>) -> Option<Self> {
        let Linear { a, b, c, d, .. } = linear;
        let (n, m, h) = (a.nrows(), b.ncols(), bw.ncols());
        let whole = stacked(&[&[a, b], &[&DMatrix::zeros(m, n), &DMatrix::identity(m, m)]]);
        let input = stacked(&[&[b], &[&DMatrix::identity(m, m)]]);
        let output = stacked(&[&[c, d]]);
        let floor = (LEAST_GAIN * largest_gain(linear)?).powi(2);
        let r = d.transpose() * d + DMatrix::from_diagonal_element(m, m, floor);
        // Without the product of states and changes in the costs.
        let turned = r.clone().cholesky()?.solve(&(d.transpose() * &output));
        let q = output.transpose() * &output - output.transpose() * d * &turned;
        let p = value_of_several(&(&whole - &input * turned), &input, q, &r)?;
        let weight = (r + input.transpose() * &p * &input).cholesky()?;
        let k = weight.solve(&(input.transpose() * &p * &whole + d.transpose() * &output));
        let closed = (&whole - &input * &k).transpose();
        let pushed = p * stacked(&[&[bw], &[&DMatrix::zeros(m, h)]]);
        let (last, now) = (weight.solve(&input.transpose()), weight.solve(&d.transpose()));
        let seen = (output - d * &k).transpose();
        Some(Self { k, last, now, closed, seen, pushed })
    }

    /// From x and the last drives to drives.
    fn by_held(&self, m: usize) -> DMatrix<f64> {
        let mut gains = -self.k.clone();
        let n = gains.ncols() - m;
        (0..m).for_each(|i| gains[(i, n + i)] += 1.0);
        gains
    }

    /// From references of now and later, the last of which stands for all that come after it, and from w that stays.
    fn coefficients(&self, linear: &Linear, ahead: Option<usize>) -> Option<(Vec<DMatrix<f64>>, DMatrix<f64>)> {
        let size = self.closed.nrows();
        let forever = (DMatrix::identity(size, size) - &self.closed).lu();
        let mut seen = self.seen.clone();
        let mut of_samples = vec![(self.now.clone(), seen.clone())];
        for _ in 1..=FARTHEST {
            let next = &self.closed * &seen;
            of_samples.push((&self.last * &seen, seen));
            seen = next;
        }
        let all: f64 = of_samples.iter().skip(1).map(|(one, _)| one.norm()).sum();
        let mut left = all;
        let enough = of_samples.iter().skip(1).position(|(one, _)| {
            left -= one.norm();
            left <= LEFT_OUT * all
        });
        let ahead = ahead.unwrap_or(enough.map_or(FARTHEST, |place| place + 1));
        let tail = &self.last * forever.solve(&of_samples[ahead].1)?;
        let mut gains: Vec<_> = of_samples.into_iter().take(ahead).map(|(one, _)| one * &linear.scale).collect();
        gains.push(tail * &linear.scale);
        Some((gains, -&self.last * forever.solve(&self.pushed)?))
    }
}

/// A Kalman filter of what the stage is beside its model: states that start at rest, moved by a disturbance that
/// comes in with the drives, and wanders. The feedback takes it away from them.
struct Watched<'a> {
    /// A and B of a sample with the flattest, the middle and the steepest slopes.
    members: [(DMatrix<f64>, DMatrix<f64>); 3],
    linear: &'a Linear,
    /// A, and the disturbance.
    whole: DMatrix<f64>,
    /// C, of the states alone: the disturbance is taken away at once.
    output: DMatrix<f64>,
    /// z, and the stage there, with the flattest, the middle and the steepest slopes, slower and faster.
    frequencies: Vec<(Complex<f64>, Responses)>,
}

/// Of the stages that may be, at one frequency.
type Responses = Vec<DMatrix<Complex<f64>>>;

impl<'a> Watched<'a> {
    fn new(stage: &MultiAxisStage, linear: &'a Linear) -> Self {
        let Linear { a, b, c, .. } = linear;
        let (n, m, p) = (a.nrows(), b.ncols(), c.nrows());
        let whole = stacked(&[&[a, b], &[&DMatrix::zeros(m, n), &DMatrix::identity(m, m)]]);
        let output = stacked(&[&[c, &DMatrix::zeros(p, m)]]);
        let mut angles: Vec<f64> = (1..=FREQUENCIES).map(|i| PI * as_f64(i) / as_f64(FREQUENCIES)).collect();
        let slow = |i| PI / as_f64(FREQUENCIES) * 10.0_f64.powf(-as_f64(i) / as_f64(SLOW_PER_DECADE));
        angles.extend((1..=6 * SLOW_PER_DECADE).map(slow));
        for eigenvalue in a.complex_eigenvalues().iter().filter(|one| one.im >= 0.0) {
            let (angle, half) = (eigenvalue.arg(), -eigenvalue.norm().ln());
            angles.extend([angle - half, angle, angle + half].into_iter().filter(|angle| (1e-6..=PI).contains(angle)));
        }
        let members = slopes_of(stage).map(|slopes| {
            let Sample { a, b, .. } = stage.sample(&slopes);
            (a, b)
        });
        let at = |angle: f64| {
            let offs = [1.0 - FREQUENCY_DOUBT, 1.0, 1.0 + FREQUENCY_DOUBT];
            let all = members.iter().flat_map(|member| offs.map(|off| response(member, linear, (angle * off).min(PI))));
            Some((Complex::cis(angle), all.collect::<Option<Responses>>()?))
        };
        let frequencies = angles.into_iter().filter_map(at).collect();
        Self { members, linear, whole, output, frequencies }
    }

    /// The gain of the filter for so much noise of the drives beside that of the measurements.
    fn gain(&self, drives: f64) -> Option<DMatrix<f64>> {
        let Linear { b, c, .. } = self.linear;
        let (m, p) = (b.ncols(), c.nrows());
        let wander = DMatrix::from_diagonal_element(m, m, WANDERS * drives);
        let moved = b * b.transpose() * drives;
        let none = DMatrix::zeros(b.nrows(), m);
        let q = stacked(&[&[&moved, &none], &[&none.transpose(), &wander]]);
        let r = DMatrix::identity(p, p);
        let covariance = value_of_several(&self.whole.transpose(), &self.output.transpose(), q, &r)?;
        let seen = &self.output * &covariance;
        Some((&seen * self.output.transpose() + r).cholesky()?.solve(&seen).transpose())
    }

    /// The fastest filter that keeps the sensitivity within a bound, or nothing.
    ///
    /// Not the fastest below the first that does not: between slow and fast ones a mode that hardly shows may be
    /// amplified more than by either.
    fn correction(&self, peak: f64) -> Option<DMatrix<f64>> {
        let gains = (0..POWERS).map(|i| self.gain(LARGEST_NOISE * 10.0_f64.powf(-f64::from(i) / PER_DECADE)));
        gains.flatten().find(|gain| self.is_within(gain, peak))
    }

    /// Whether the loop is stable with all slopes, and its sensitivity bounded for all of them and for frequencies that
    /// are off. On the way to those a loop becomes unstable only where its sensitivity has no bound.
    fn is_within(&self, gain: &DMatrix<f64>, peak: f64) -> bool {
        let (n, size) = (self.linear.a.nrows(), self.whole.nrows());
        let mut held = DMatrix::identity(size, size);
        held.view_mut((0, 0), (n, n)).copy_from(&self.linear.a);
        let kept = DMatrix::identity(size, size) - gain * &self.output;
        let stable = self.members.iter().all(|member| self.closed(member, gain, &held, &kept) < 1.0);
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex::from);
        let (free, fed, kept, gain) =
            (complex(&(&held * &kept)), complex(&(&held * gain)), complex(&kept), complex(gain));
        stable
            && self.frequencies.iter().all(|(z, stages)| {
                let remembered = (DMatrix::from_diagonal_element(size, size, *z) - &free).lu().solve(&fed);
                let Some(remembered) = remembered else { return false };
                let disturbance = (&kept * remembered + &gain).rows(n, size - n).clone_owned();
                stages.iter().all(|stage| {
                    let loop_gain = stage * &disturbance;
                    let difference = DMatrix::identity(loop_gain.nrows(), loop_gain.nrows()) + loop_gain;
                    // The least singular value of 1 + G C is one over the largest of the sensitivity.
                    difference.singular_values().iter().all(|value| value * peak >= 1.0)
                })
            })
    }

    /// The largest eigenvalue of the loop around the stage with these slopes: of its states, the last drives, which D
    /// shows a sample later, and the filter.
    fn closed(
        &self,
        (a, b): &(DMatrix<f64>, DMatrix<f64>),
        gain: &DMatrix<f64>,
        held: &DMatrix<f64>,
        kept: &DMatrix<f64>,
    ) -> f64 {
        let (n, size) = (self.linear.a.nrows(), self.whole.nrows());
        let m = size - n;
        let from_stage = gain * stacked(&[&[&self.linear.c, &self.linear.d]]);
        let driven = stacked(&[&[b], &[&DMatrix::identity(m, m)]]);
        let fed = |matrix: &DMatrix<f64>| -(&driven * matrix.rows(n, m));
        let own = a.clone().resize(size, size, 0.0) + fed(&from_stage);
        spectral_radius(&stacked(&[&[&own, &fed(kept)], &[&(held * from_stage), &(held * kept)]]))
    }
}

/// The flattest, the middle and the steepest slopes of all operators.
fn slopes_of(stage: &MultiAxisStage) -> [Vec<f64>; 3] {
    let of = |slope: fn(&ScalarOperator) -> f64| stage.operators().iter().map(slope).collect();
    [of(|one| one.slopes().0), of(middle), of(|one| one.slopes().1)]
}

/// The positions in units of their gains, over the drives, at an angle of z. What D adds is seen a sample later.
fn response((a, b): &(DMatrix<f64>, DMatrix<f64>), linear: &Linear, angle: f64) -> Option<DMatrix<Complex<f64>>> {
    let z = Complex::cis(angle);
    let complex = |matrix: &DMatrix<f64>| matrix.map(Complex::from);
    let moved = (DMatrix::from_diagonal_element(a.nrows(), a.nrows(), z) - complex(a)).lu().solve(&complex(b))?;
    Some(complex(&linear.c) * moved + complex(&linear.d) / z)
}

/// The largest gain at any frequency.
fn largest_gain(linear: &Linear) -> Option<f64> {
    let member = (linear.a.clone(), linear.b.clone());
    let modes = linear.a.complex_eigenvalues();
    let angles =
        modes.iter().map(|one| one.arg().abs()).chain((0..=FREQUENCIES).map(|i| PI * as_f64(i) / as_f64(FREQUENCIES)));
    let gains = angles.map(|angle| Some(response(&member, linear, angle)?.norm()));
    gains.collect::<Option<Vec<_>>>().map(|all| all.into_iter().fold(0.0, f64::max))
}

/// A matrix of rows of blocks.
fn stacked(blocks: &[&[&DMatrix<f64>]]) -> DMatrix<f64> {
    let rows: usize = blocks.iter().map(|row| row.first().map_or(0, |one| one.nrows())).sum();
    let columns: usize = blocks.first().map_or(0, |row| row.iter().map(|one| one.ncols()).sum());
    let (mut whole, mut top) = (DMatrix::zeros(rows, columns), 0);
    for row in blocks {
        let mut left = 0;
        for block in *row {
            whole.view_mut((top, left), block.shape()).copy_from(block);
            left += block.ncols();
        }
        top += row.first().map_or(0, |one| one.nrows());
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multi_axis::Matrices;

    /// The loop, written out: the stage, its last drive, and the filter that takes the drive for none.
    #[test]
    fn the_loop_has_what_follows_drives_at_once() {
        let one = |number: f64| DMatrix::from_element(1, 1, number);
        let (none, row) = (DMatrix::zeros(1, 0), DMatrix::zeros(0, 1));
        let matrices =
            Matrices { a: one(0.6), b: one(0.2), bw: none, c: one(1.0), d: one(1.5), cq: row.clone(), dq: row };
        let stage = MultiAxisStage::new(matrices, vec![], vec![0.0], 1e-3).unwrap();
        let linear = Linear { a: one(0.6), b: one(0.2), c: one(1.0), d: one(1.5), scale: one(1.0) };
        let watched = Watched::new(&stage, &linear);
        let gain = watched.gain(LARGEST_NOISE).unwrap();
        let (kept, held) = (
            DMatrix::identity(2, 2) - &gain * &watched.output,
            stacked(&[&[&one(0.6), &one(0.0)], &[&one(0.0), &one(1.0)]]),
        );
        let radius = watched.closed(&watched.members[1], &gain, &held, &kept);
        let (mut x, mut state, mut last, mut disturbance, mut grown) = (1.0, 0.0, 0.0, 0.0, 0.0);
        for _ in 0..4000 {
            let missed = x + 1.5 * last - state;
            disturbance += gain[(1, 0)] * missed;
            (state, last) = (0.6 * (state + gain[(0, 0)] * missed), -disturbance);
            x = 0.6 * x + 0.2 * last;
            let norm = f64::abs(x) + f64::abs(state) + f64::abs(disturbance);
            grown += norm.ln() / 4000.0;
            (x, state, last, disturbance) = (x / norm, state / norm, last / norm, disturbance / norm);
        }
        assert!((grown - radius.ln()).abs() < 2e-3, "{} {radius}", grown.exp());
    }
}
