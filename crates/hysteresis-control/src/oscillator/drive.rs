//! What a drive does between its samples.

use std::f64::consts::PI;

use crate::as_f64;

/// What a drive does between its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hold {
    /// A converter holds every sample until the next.
    #[default]
    Zero,
    /// It is smooth: samples of a signal without content near half of the sampling rate, as of an analogue generator,
    /// or of a finer simulation.
    BandLimited,
}

impl Hold {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::BandLimited => "band_limited",
        }
    }
}

/// How many samples on each side enter the smooth drive between two.
const REACH: usize = 24;

/// A drive on the half steps of an integration: `2 sub_steps` values for each sample, and where a smooth one ends.
///
/// Between the samples of a smooth drive stand sums of sinc functions under a Kaiser window over 24 samples on each
/// side: good to 1e-5 up to a fifth of the sampling rate, and to 3e-5 up to two fifths. Beyond the ends a drive stays
/// as it is, or if it is `periodic` comes again.
#[derive(Clone, Debug)]
pub struct FineDrive {
    values: Vec<f64>,
    per_sample: usize,
    hold: Hold,
}

impl FineDrive {
    /// Of samples u.
    #[must_use]
    pub fn new(u: &[f64], hold: Hold, periodic: bool, sub_steps: usize) -> Self {
        let per_sample = 2 * sub_steps;
        let mut values = Vec::with_capacity(u.len() * per_sample + 1);
        match hold {
            Hold::Zero => values.extend(u.iter().flat_map(|u| std::iter::repeat_n(*u, per_sample))),
            Hold::BandLimited => {
                let kernels: Vec<_> = (0..per_sample).map(|part| kernel(as_f64(part) / as_f64(per_sample))).collect();
                let around = |k: usize, i: usize| neighbour(u, k + i, periodic);
                for k in 0..u.len() {
                    let at = |kernel: &Vec<f64>| kernel.iter().enumerate().map(|(i, w)| w * around(k, i)).sum::<f64>();
                    values.extend(kernels.iter().map(at));
                }
                // Where the last step ends.
                values.extend(if periodic { u.first() } else { u.last() });
            }
        }
        Self { values, per_sample, hold }
    }

    /// The drive of every sub-step behind sample k.
    pub fn sub_steps(&self, k: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
        let (from, behind) = (k * self.per_sample, (k + 1) * self.per_sample);
        // A held drive jumps behind the last step; a smooth one goes on to the next sample.
        let last = if self.hold == Hold::Zero { behind - 1 } else { behind };
        (from..behind).step_by(2).map(move |i| [self.values[i], self.values[i + 1], self.values[(i + 2).min(last)]])
    }
}

/// The sample that stands at `place` if the first is at [`REACH`] - 1.
fn neighbour(u: &[f64], place: usize, periodic: bool) -> f64 {
    let n = u.len();
    if periodic {
        return u[(place + n * REACH - (REACH - 1)) % n];
    }
    u[place.saturating_sub(REACH - 1).min(n - 1)]
}

/// The weights of the samples around a place `part` of a sample behind one: of those from [`REACH`] - 1 before it on.
fn kernel(part: f64) -> Vec<f64> {
    const SHAPE: f64 = 9.0;
    let weight = |i: usize| {
        let x = part + as_f64(REACH - 1) - as_f64(i);
        let within = (x / as_f64(REACH)).powi(2);
        let window = bessel(SHAPE * (1.0 - within).max(0.0).sqrt()) / bessel(SHAPE);
        if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) * window }
    };
    let weights: Vec<f64> = (0..2 * REACH).map(weight).collect();
    // A constant stays as it is.
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

/// The modified Bessel function of order 0.
fn bessel(x: f64) -> f64 {
    let terms = (1..60).scan(1.0, |term, n| {
        *term *= (0.5 * x / f64::from(n)).powi(2);
        Some(*term)
    });
    1.0 + terms.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_drive_is_interpolated() {
        let n = 250;
        let signal = |t: f64| (2.0 * PI * 50.0 * t / 250.0).sin() + 0.5 * (2.0 * PI * 90.0 * t / 250.0).cos() + 3.0;
        let u: Vec<f64> = (0..n).map(|k| signal(as_f64(k))).collect();
        let fine = FineDrive::new(&u, Hold::BandLimited, true, 2);
        for k in 0..n {
            for (j, step) in fine.sub_steps(k).enumerate() {
                for (i, got) in step.iter().enumerate() {
                    let want = signal(as_f64(k) + 0.25 * as_f64(2 * j + i));
                    assert!((got - want).abs() < 2e-5, "{k} {j} {i} {got} {want}");
                }
            }
        }
    }

    #[test]
    fn a_smooth_drive_that_does_not_repeat_stays_where_it_ends() {
        let fine = FineDrive::new(&[1.0, 2.0, 4.0], Hold::BandLimited, false, 2);
        assert_eq!(fine.sub_steps(2).last().map(|step| step[2]), Some(4.0));
        assert_eq!(fine.sub_steps(0).last().map(|step| step[2]), fine.sub_steps(1).next().map(|step| step[0]));
        assert!(FineDrive::new(&[], Hold::BandLimited, true, 2).values.is_empty());
    }

    #[test]
    fn a_held_drive_is_held() {
        let fine = FineDrive::new(&[1.0, 2.0], Hold::Zero, false, 2);
        let steps: Vec<_> = (0..2).flat_map(|k| fine.sub_steps(k)).collect();
        assert_eq!(steps, [[1.0; 3], [1.0; 3], [2.0; 3], [2.0; 3]]);
    }
}
