use super::feedback::{Gains, Slopes, is_admissible, peak};
use super::margins::{Margins, margins};
use super::options::{Tuning, TuningOptions};
use super::response::{FrequencyPoint, response};
use super::search::{TINY, golden_section, greatest};
use crate::linear::{Error, LinearDynamics, PulseTransfer, check_positive};

/// The longest dead time that is tuned for, in samples: each turns the response once more.
const MAX_DEAD_TIME: f64 = 1000.0;

/// How many samples the slowest part may take for a radian: what is slower lies below the frequencies that are looked at.
const MAX_SAMPLES_PER_RADIAN: f64 = 1e5;

/// The least damping ratio of which the peak is found among the frequencies.
const MIN_DAMPING: f64 = 1e-7;

/// How many proportional gains are tried before the best is looked at more closely.
const TRIALS: u32 = 48;

/// A proportional gain that gives the loop less than this does nothing.
const MIN_LOOP_GAIN: f64 = 1e-9;

/// The gains with the greatest ki that keep the peak of the sensitivity within a bound for every slope of the hysteresis.
///
/// The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope P(z), the positional law u = kp e + ki dt sum e before a plant P, the
/// [pulse transfer function](LinearDynamics::pulse_transfer) of the dynamics. The bound is
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
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::tuning::{TuningOptions, tune};
/// let stage = SecondOrder::new(400.0, 0.95)?.into();
/// let slopes = (4.3e-3, 7.9e-3); // um/V
/// let tuning = tune(&stage, &TuningOptions { slopes, dt: 1e-4, peak_sensitivity: 1.7 })?;
/// assert!((tuning.peak_sensitivity - 1.7).abs() < 1e-3);
/// assert!(tuning.at_max_slope.gain_margin > 1.7 / 0.7 && tuning.at_max_slope.phase_margin > 34.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for slopes that are not 0 < least <= greatest, a static gain that is not above 0, a peak outside 1.05 to 5, a dead time beyond 1000 samples,
/// dynamics slower than 1e5 samples a radian, a damping ratio below 1e-7, or as for [`LinearDynamics::block`].
pub fn tune(dynamics: &LinearDynamics, options: &TuningOptions) -> Result<Tuning, Error> {
    let (slopes, limit) = (check_slopes(options.slopes)?, options.peak_sensitivity);
    if !(1.05..=5.0).contains(&limit) {
        return Err(Error::domain("peak_sensitivity", None, "1.05 to 5", limit));
    }
    if dynamics.dead_time() > MAX_DEAD_TIME * check_positive("dt", None, options.dt)? {
        let got = dynamics.dead_time();
        return Err(Error::domain("dead_time", None, "at most 1000 samples", got));
    }
    let (transfer, static_gain) = resolved(dynamics, options.dt)?;
    let points = response(&transfer, static_gain);
    let mut bound = limit;
    // The response is known at its points; between them the peak may be a little higher.
    let (gains, worst) = loop {
        let gains = fastest(slopes, static_gain, &points, bound);
        let (worst, _) = peak(gains, slopes, &transfer, &points);
        if worst <= limit {
            break (gains, worst);
        }
        bound *= limit / worst * (1.0 - 1e-9);
    };
    let at = |slope| margins(gains, slope, &transfer, &points, options.dt);
    let (at_min_slope, at_max_slope) = (at(slopes.min), at(slopes.max));
    // The search ends near zero, not at it.
    let kp = if gains.kp * slopes.max * static_gain.abs() < MIN_LOOP_GAIN { 0.0 } else { gains.kp };
    Ok(Tuning { kp, ki: gains.ki_dt / options.dt, at_min_slope, at_max_slope, peak_sensitivity: worst })
}

/// The margins of a loop with given gains at one slope.
///
/// # Errors
/// [`Error`] unless gains and slope are finite, ki and the slope above 0 and kp not below, or as for [`tune`].
pub fn loop_margins(dynamics: &LinearDynamics, dt: f64, kp: f64, ki: f64, slope: f64) -> Result<Margins, Error> {
    check_positive("ki", None, ki)?;
    check_positive("slope", None, slope)?;
    if !(0.0..=hysteresis_core::MAX_MAGNITUDE).contains(&kp) {
        return Err(Error::domain("kp", None, "a finite number, 0 or more", kp));
    }
    let (transfer, static_gain) = resolved(dynamics, dt)?;
    Ok(margins(Gains { kp, ki_dt: ki * dt }, slope, &transfer, &response(&transfer, static_gain), dt))
}

/// The pulse transfer function, if its response shows at the frequencies that are looked at, and the static gain.
fn resolved(dynamics: &LinearDynamics, dt: f64) -> Result<(PulseTransfer, f64), Error> {
    let static_gain = check_positive("dynamics.static_gain", None, dynamics.static_gain())?;
    let transfer = dynamics.pulse_transfer(dt)?;
    for pole in dynamics.poles() {
        // Radians per second.
        let rate = pole.norm();
        let damping = -pole.re / rate;
        if damping < MIN_DAMPING {
            let expected = "1e-7 or more to tune for";
            return Err(Error::domain("damping", None, expected, damping));
        }
        if rate * dt * MAX_SAMPLES_PER_RADIAN < 1.0 {
            let expected = "at least 1e-5 of 1 / (2 pi f) of the slowest part of dynamics and amplifier";
            return Err(Error::domain("dt", None, expected, dt));
        }
    }
    Ok((transfer, static_gain))
}

fn check_slopes((min, max): (f64, f64)) -> Result<Slopes, Error> {
    check_positive("slopes", Some(0), min)?;
    if check_positive("slopes", Some(1), max)? < min {
        return Err(Error::domain("slopes", Some(1), "at least the first one", max));
    }
    Ok(Slopes { min, max })
}

/// The admissible gains with the greatest ki.
fn fastest(slopes: Slopes, static_gain: f64, points: &[FrequencyPoint], limit: f64) -> Gains {
    // Both gains in units of 1 / (slope times static gain), where 1 is of the order of what is sought.
    let unit = 1.0 / (slopes.max * static_gain);
    let admits =
        |kp: f64, ki_dt: f64| is_admissible(Gains { kp: kp * unit, ki_dt: ki_dt * unit }, slopes, points, limit);
    let integral = |kp: f64| greatest(|ki_dt| admits(kp, ki_dt));
    let highest = greatest(|kp| admits(kp, TINY));
    let trial = |i: u32| highest * (f64::from(i) / f64::from(TRIALS)).powi(2);
    let integrals: Vec<f64> = (0..=TRIALS).map(|i| integral(trial(i))).collect();
    let best = (0..=TRIALS).zip(&integrals).max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
    let between = golden_section(trial(best.saturating_sub(1)), trial((best + 1).min(TRIALS)), integral);
    let on_grid = (trial(best), integrals[best as usize]);
    let (kp, ki_dt) = if between.1 >= on_grid.1 { between } else { on_grid };
    Gains { kp: kp * unit, ki_dt: ki_dt * unit }
}
