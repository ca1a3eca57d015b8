//! Gains of the proportional-integral feedback from the dynamics behind a hysteresis.

mod feedback;
mod response;

use feedback::{Gains, Slopes, golden_section, is_admissible, margins, peak};
use response::{Point, response};

use core::f64::consts::TAU;

use crate::linear::{Chain, Dynamics, Error, FirstOrder, PulseTransfer, check_positive};

/// The longest delay that is tuned for, in samples: each turns the response once more.
const MAX_DELAY: f64 = 1000.0;

/// How many samples the slowest part may take for a radian: what is slower lies below the frequencies that are looked at.
const MAX_SAMPLES_PER_RADIAN: f64 = 1e5;

/// The least damping ratio of which the peak is found among the frequencies.
const MIN_DAMPING: f64 = 1e-7;

/// How many proportional gains are tried before the best is looked at more closely.
const TRIALS: u32 = 48;

/// What the gains are to achieve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TuningOptions {
    /// The least and the greatest slope of the hysteresis, in output per input (um/V).
    pub slopes: (f64, f64),
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The greatest peak of the sensitivity, 1.05 to 5; 1.2 is cautious, 2 is bold.
    pub peak_sensitivity: f64,
}

/// Gains of the proportional-integral feedback, and how robust the loop is with them. Made by [`tune`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Proportional gain, in input per output (V/um).
    pub kp: f64,
    /// Integral gain, in input per output and sample (V/um per sample).
    pub ki: f64,
    /// Where the hysteresis has its least slope.
    pub at_min_slope: Margins,
    /// Where it has its greatest slope.
    pub at_max_slope: Margins,
    /// The peak of the sensitivity over all slopes between.
    pub peak_sensitivity: f64,
}

/// How robust a loop is at one slope of the hysteresis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// The slope, in output per input.
    pub slope: f64,
    /// The factor by which the gain may grow until the loop oscillates: 1 / |L| where L is real and negative.
    pub gain_margin: f64,
    /// How many degrees the phase may lag more, the least over all frequencies with |L| = 1; infinite without any.
    pub phase_margin: f64,
    /// The highest frequency in Hz with |L| = 1; 0 without any.
    pub crossover: f64,
    /// The peak of |S|, S = 1 / (1 + L).
    pub peak_sensitivity: f64,
    /// Where that peak is, in Hz.
    pub peak_frequency: f64,
}

/// The gains with the greatest ki that keep the peak of the sensitivity within a bound for every slope of the hysteresis.
///
/// The loop is L(z) = (kp + ki / (1 - 1/z)) slope P(z), the positional law u = kp e + ki sum e before a plant P, the
/// [pulse transfer function](Chain::pulse_transfer) of the chain. The bound is
///
/// |S| = 1 / |1 + L| <= M for all frequencies and all slopes between the two, and the loop stable.
///
/// A constant disturbance is removed with the integrated error 1 / ki, so the greatest ki removes it best, and M bounds
/// how much any disturbance is amplified and both margins: the gain may grow by M / (M - 1), the phase lag by
/// 2 arcsin(1 / (2 M)) (Åström, Panagopoulos and Hägglund, Automatica 34(5), 585-601, 1998). For every frequency the worst
/// slope is known in closed form, and stability follows from the winding of (1 + L) (1 - 1/z) along the unit circle.
/// Gains are not negative.
///
/// ```
/// use hysteresis_control::linear::{Chain, Delay, SecondOrder};
/// use hysteresis_control::tuning::{TuningOptions, tune};
/// let stage = SecondOrder::new(400.0, 0.95)?;
/// let chain = Chain { amplifier: None, dynamics: Some(stage.into()), delay: Delay::new(0.0)? };
/// let slopes = (4.3e-3, 7.9e-3); // um/V
/// let tuning = tune(&chain, &TuningOptions { slopes, dt: 1e-4, peak_sensitivity: 1.7 })?;
/// assert!((tuning.peak_sensitivity - 1.7).abs() < 1e-3);
/// assert!(tuning.at_max_slope.gain_margin > 1.7 / 0.7 && tuning.at_max_slope.phase_margin > 34.0);
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for slopes that are not 0 < least <= greatest, a peak outside 1.05 to 5, a delay beyond 1000 samples,
/// dynamics or an amplifier slower than 1e5 samples a radian, a damping ratio below 1e-7, or as for [`Chain::block`].
pub fn tune(chain: &Chain, options: &TuningOptions) -> Result<Tuning, Error> {
    let (slopes, limit) = (check_slopes(options.slopes)?, options.peak_sensitivity);
    if !(1.05..=5.0).contains(&limit) {
        return Err(Error { parameter: "peak_sensitivity", index: None, expected: "1.05 to 5", got: limit });
    }
    if chain.delay.samples() > MAX_DELAY {
        let got = chain.delay.samples();
        return Err(Error { parameter: "delay", index: None, expected: "at most 1000 samples", got });
    }
    let transfer = resolved(chain, options.dt)?;
    let points = response(&transfer);
    let mut bound = limit;
    // The response is known at its points; between them the peak may be a little higher.
    let (gains, worst) = loop {
        let gains = fastest(slopes, &points, bound);
        let (worst, _) = peak(gains, slopes, &transfer, &points);
        if worst <= limit {
            break (gains, worst);
        }
        bound *= limit / worst * (1.0 - 1e-9);
    };
    let at = |slope| margins(gains, slope, &transfer, &points, options.dt);
    let (at_min_slope, at_max_slope) = (at(slopes.min), at(slopes.max));
    Ok(Tuning { kp: gains.kp, ki: gains.ki, at_min_slope, at_max_slope, peak_sensitivity: worst })
}

/// The margins of a loop with given gains at one slope.
///
/// # Errors
/// [`Error`] unless gains and slope are finite, ki and the slope above 0 and kp not below, or as for [`tune`].
pub fn loop_margins(chain: &Chain, dt: f64, kp: f64, ki: f64, slope: f64) -> Result<Margins, Error> {
    check_positive("ki", None, ki)?;
    check_positive("slope", None, slope)?;
    if !(0.0..=hysteresis_core::MAX_MAGNITUDE).contains(&kp) {
        return Err(Error { parameter: "kp", index: None, expected: "a finite number, 0 or more", got: kp });
    }
    let transfer = resolved(chain, dt)?;
    Ok(margins(Gains { kp, ki }, slope, &transfer, &response(&transfer), dt))
}

/// The pulse transfer function, if its response shows at the frequencies that are looked at.
fn resolved(chain: &Chain, dt: f64) -> Result<PulseTransfer, Error> {
    let transfer = chain.pulse_transfer(dt)?;
    // Radians per second.
    let lag = |lag: FirstOrder| 1.0 / lag.time_constant();
    let slowest = match chain.dynamics {
        Some(Dynamics::FirstOrder(dynamics)) => lag(dynamics),
        Some(Dynamics::SecondOrder(resonance)) => {
            let (w, zeta) = (TAU * resonance.frequency(), resonance.damping());
            if zeta < MIN_DAMPING {
                return Err(Error {
                    parameter: "damping",
                    index: None,
                    expected: "1e-7 or more to tune for",
                    got: zeta,
                });
            }
            w / (zeta.max(1.0) + (zeta * zeta - 1.0).max(0.0).sqrt())
        }
        None => f64::INFINITY,
    };
    if slowest.min(chain.amplifier.map_or(f64::INFINITY, lag)) * dt * MAX_SAMPLES_PER_RADIAN < 1.0 {
        let expected = "at least 1e-5 of 1 / (2 pi f) of the slowest part of dynamics and amplifier";
        return Err(Error { parameter: "dt", index: None, expected, got: dt });
    }
    Ok(transfer)
}

fn check_slopes((min, max): (f64, f64)) -> Result<Slopes, Error> {
    check_positive("slopes", Some(0), min)?;
    if check_positive("slopes", Some(1), max)? < min {
        return Err(Error { parameter: "slopes", index: Some(1), expected: "at least the first one", got: max });
    }
    Ok(Slopes { min, max })
}

/// The admissible gains with the greatest ki.
fn fastest(slopes: Slopes, points: &[Point], limit: f64) -> Gains {
    // Both gains in units of 1 / slope, where 1 is of the order of what is sought.
    let unit = 1.0 / slopes.max;
    let admits = |kp: f64, ki: f64| is_admissible(Gains { kp: kp * unit, ki: ki * unit }, slopes, points, limit);
    let integral = |kp: f64| greatest(|ki| admits(kp, ki));
    let highest = greatest(|kp| admits(kp, TINY));
    let trial = |i: u32| highest * (f64::from(i) / f64::from(TRIALS)).powi(2);
    let integrals: Vec<f64> = (0..=TRIALS).map(|i| integral(trial(i))).collect();
    let best = (0..=TRIALS).zip(&integrals).max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
    let between = golden_section(trial(best.saturating_sub(1)), trial((best + 1).min(TRIALS)), integral);
    let on_grid = (trial(best), integrals[best as usize]);
    let (kp, ki) = if between.1 >= on_grid.1 { between } else { on_grid };
    Gains { kp: kp * unit, ki: ki * unit }
}

/// A gain that moves nothing.
const TINY: f64 = 1e-9;

/// The greatest number up to which something holds: doubled from almost nothing on, then bisected.
fn greatest(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, TINY);
    while high < 1e12 && holds(high) {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}
