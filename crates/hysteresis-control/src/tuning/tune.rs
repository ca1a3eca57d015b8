use super::family::{family, light_modes};
use super::feedback::{Gains, Slopes};
use super::margins::{Margins, margins};
use super::open_loop::OpenLoop;
use super::options::{Tuning, TuningOptions};
use super::problem::{Problem, without_modes};
use super::response::response;
use super::structure::Structure;
use crate::filters::{FeedbackFilter, sections};
use crate::linear::{Error, LinearDynamics, PulseTransfer, check_positive};

/// The longest dead time that is tuned for, in samples: each turns the response once more.
const MAX_DEAD_TIME: f64 = 1000.0;

/// How many samples the slowest part may take for a radian: what is slower lies below the frequencies that are looked at.
const MAX_SAMPLES_PER_RADIAN: f64 = 1e5;

/// The least damping ratio of which the peak is found among the frequencies.
const MIN_DAMPING: f64 = 1e-7;

/// The feedback with the greatest ki that keeps the peak of the sensitivity within a bound for every slope of the hysteresis.
///
/// The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z), the positional law u = kp e + ki dt sum e before a plant P, the
/// [pulse transfer function](LinearDynamics::pulse_transfer) of the dynamics, and behind filters F. The bound is
///
/// |S| = 1 / |1 + L| <= M for all frequencies and all slopes between the two, and the loop stable.
///
/// A constant disturbance is removed with the integrated error 1 / ki, so the greatest ki removes it best, and M bounds
/// how much any disturbance is amplified and both margins: the gain may grow by M / (M - 1), the phase lag by
/// 2 arcsin(1 / (2 M)) (Åström, Panagopoulos and Hägglund, Automatica 34(5), 585-601, 1998). For every frequency the worst
/// slope is known in closed form, and stability follows from the winding of (1 + L) (1 - 1/z) along the unit circle.
///
/// **Filters.** Without lightly damped modes (a damping ratio below 0.5) there are none, and gains are not negative. With some, no
/// filter, low-passes and notches are tried, each with the gains that suit it, and the bound holds for all modes that may be
/// ([`ModeUncertainty`](super::ModeUncertainty)). Of those whose ki is within 5 % of the greatest the simplest is taken. Behind a
/// low-pass kp may be negative: then it damps (integral resonant control or positive position feedback). With
/// [`TuningOptions::structure`] only that one counts.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::tuning::{TuningOptions, tune};
/// let stage = SecondOrder::new(400.0, 0.95)?.into();
/// let slopes = (4.3e-3, 7.9e-3); // um/V
/// let tuning = tune(&stage, &TuningOptions::new(slopes, 1e-4, 1.7))?;
/// assert!((tuning.peak_sensitivity - 1.7).abs() < 1e-3);
/// assert!(tuning.at_max_slope.gain_margin > 1.7 / 0.7 && tuning.at_max_slope.phase_margin > 34.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for slopes that are not 0 < least <= greatest, a static gain that is not above 0, a peak outside 1.05 to 5, a dead time beyond 1000 samples,
/// dynamics slower than 1e5 samples a radian, a damping ratio below 1e-7, a structure that the dynamics
/// give nothing to, or as for [`LinearDynamics::block`].
pub fn tune(dynamics: &LinearDynamics, options: &TuningOptions) -> Result<Tuning, Error> {
    let (slopes, limit) = (check_slopes(options.slopes)?, options.peak_sensitivity);
    if !(1.05..=5.0).contains(&limit) {
        return Err(Error::domain("peak_sensitivity", None, "1.05 to 5", limit));
    }
    if dynamics.dead_time() > MAX_DEAD_TIME * check_positive("dt", None, options.dt)? {
        let got = dynamics.dead_time();
        return Err(Error::domain("dead_time", None, "at most 1000 samples", got));
    }
    let members = family(dynamics, options.uncertainty)?;
    let members = members.iter().map(|member| resolved(member, options.dt)).collect::<Result<Vec<_>, _>>()?;
    let static_gain = members[0].1;
    let problem =
        Problem { slopes, static_gain, limit, dt: options.dt, members: members.into_iter().map(|one| one.0).collect() };
    let modes = light_modes(dynamics);
    match options.structure {
        Some(wanted) if modes.is_empty() && wanted != Structure::ProportionalIntegral => Err(without_modes(wanted)),
        _ if modes.is_empty() => problem.without_filters(),
        wanted => problem.with_filters(&modes, wanted),
    }
}

/// The margins of a loop with given gains at one slope.
///
/// # Errors
/// [`Error`] unless gains and slope are finite, ki and the slope above 0 and kp not below without filters, or as for [`tune`] and
/// [`sections`].
pub fn loop_margins(
    dynamics: &LinearDynamics,
    dt: f64,
    filters: &[FeedbackFilter],
    (kp, ki): (f64, f64),
    slope: f64,
) -> Result<Margins, Error> {
    check_positive("ki", None, ki)?;
    check_positive("slope", None, slope)?;
    let least = if filters.is_empty() { 0.0 } else { -hysteresis_core::MAX_MAGNITUDE };
    if !(least..=hysteresis_core::MAX_MAGNITUDE).contains(&kp) {
        return Err(Error::domain("kp", None, "a finite number, 0 or more unless there are filters", kp));
    }
    let (transfer, static_gain) = resolved(dynamics, dt)?;
    let open = OpenLoop { filters: sections(filters, dt)?, transfer };
    Ok(margins(Gains { kp, ki_dt: ki * dt }, slope, &open, &response(&open, static_gain), dt))
}

/// The pulse transfer function, if its response shows at the frequencies that are looked at, and the static gain.
pub(super) fn resolved(dynamics: &LinearDynamics, dt: f64) -> Result<(PulseTransfer, f64), Error> {
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
