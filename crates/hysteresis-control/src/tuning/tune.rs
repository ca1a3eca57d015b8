//! The search for filters and gains: what may stand before the gains, and the greatest ki that the bound admits.

use core::f64::consts::TAU;

use hysteresis_core::Sections;
use nalgebra::Complex;

use super::family::{family, light_modes};
use super::loop_response::{
    FrequencyPoint, Gains, Margins, OpenLoop, Slopes, is_admissible, margins, noise, peak, rejection, response,
};
use super::result::{Structure, Tuning, TuningOptions};
use super::search::{TINY, golden_section, greatest, greatest_near};
use crate::checks::{check_number, check_positive};
use crate::filters::{self, FeedbackFilter, LowPass, Notch, sections};
use crate::linear::{Error, LinearDynamics, PulseTransfer, SecondOrder};

/// The longest dead time that is tuned for, in samples: each turns the response once more.
const MAX_DEAD_TIME: f64 = 1000.0;

/// How many samples the slowest part may take for a radian: what is slower lies below the frequencies that are looked
/// at.
const MAX_SAMPLES_PER_RADIAN: f64 = 1e5;

/// The least damping ratio of which the peak is found among the frequencies.
const MIN_DAMPING: f64 = 1e-7;

/// The feedback with the greatest ki that keeps the peak of the sensitivity within a bound for every slope of the
/// hysteresis.
///
/// The loop is L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z), the positional law u = kp e + ki dt sum e before a plant
/// P, the [pulse transfer function](LinearDynamics::pulse_transfer) of the dynamics, and behind filters F. The bound is
///
/// |S| = 1 / |1 + L| <= M for all frequencies and all slopes between the two, and the loop stable.
///
/// A constant disturbance is removed with the integrated error 1 / ki, so the greatest ki removes it best, and M bounds
/// how much any disturbance is amplified and both margins: the gain may grow by M / (M - 1), the phase lag by 2
/// arcsin(1 / (2 M)) (Åström, Panagopoulos and Hägglund, Automatica 34(5), 585-601, 1998). For every frequency the
/// worst slope is known in closed form, and stability follows from the winding of (1 + L) (1 - 1/z) along the unit
/// circle.
///
/// **Filters.** Without lightly damped modes (a damping ratio below 0.5) there are none, and gains are not negative.
/// With some, no filter, low-passes and notches are tried, each with the gains that suit it, and the bound holds for
/// all modes that may be ([`ModeUncertainty`](super::ModeUncertainty)). Of those whose ki is within 5 % of the greatest
/// the simplest is taken. Behind a low-pass kp may be negative: then it damps (integral resonant control or positive
/// position feedback). With [`TuningOptions::structure`] only that one counts.
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
/// [`Error`] for slopes that are not 0 < least <= greatest, a static gain that is not above 0, a peak outside 1.05 to
/// 5, a dead time beyond 1000 samples, dynamics slower than 1e5 samples a radian, a damping ratio below 1e-7, a
/// structure that the dynamics give nothing to, or as for [`LinearDynamics::block`].
pub fn tune(dynamics: &LinearDynamics, options: &TuningOptions) -> Result<Tuning, Error> {
    let (slopes, limit) = (check_slopes(options.slopes)?, options.peak_sensitivity);
    check_number("peak_sensitivity", (1.05..=5.0).contains(&limit), "1.05 to 5", limit)?;
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
/// [`Error`] unless gains and slope are finite, ki and the slope above 0 and kp not below without filters, or as for
/// [`tune`] and [`sections`].
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
    let holds = (least..=hysteresis_core::MAX_MAGNITUDE).contains(&kp);
    check_number("kp", holds, "a finite number, 0 or more unless there are filters", kp)?;
    let (transfer, static_gain) = resolved(dynamics, dt)?;
    let open = OpenLoop { filters: sections(filters, dt)?, transfer };
    Ok(margins(Gains { kp, ki_dt: ki * dt }, slope, &open, &response(&open, static_gain), dt))
}

/// The pulse transfer function, if its response shows at the frequencies that are looked at, and the static gain.
fn resolved(dynamics: &LinearDynamics, dt: f64) -> Result<(PulseTransfer, f64), Error> {
    let static_gain = check_positive("dynamics.static_gain", None, dynamics.static_gain())?;
    let transfer = dynamics.pulse_transfer(dt)?;
    for pole in dynamics.poles() {
        // Radians per second.
        let rate = pole.norm();
        let damping = -pole.re / rate;
        check_number("damping", damping >= MIN_DAMPING, "1e-7 or more to tune for", damping)?;
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

/// A simpler structure is taken if its ki is at least this share of the greatest.
const AS_GOOD: f64 = 0.95;

/// A proportional gain that gives the loop less than this does nothing.
const MIN_LOOP_GAIN: f64 = 1e-9;

struct Problem {
    slopes: Slopes,
    static_gain: f64,
    /// Of the peak of the sensitivity.
    limit: f64,
    dt: f64,
    /// The dynamics as they are known, and all that may be.
    members: Vec<PulseTransfer>,
}

/// Filters that were tried, and roughly the best gains behind them.
struct Trial {
    structure: Structure,
    filters: Vec<FeedbackFilter>,
    gains: Gains,
}

impl Problem {
    /// Gains alone.
    fn without_filters(&self) -> Result<Tuning, Error> {
        self.tuned(Structure::ProportionalIntegral, Vec::new(), Vec::new(), None)
    }

    /// Filters for lightly damped modes, and gains: of those whose ki is as great as any, the simplest. With a `wanted`
    /// structure only those of its kind count, but all are tried.
    fn with_filters(&self, modes: &[SecondOrder], wanted: Option<Structure>) -> Result<Tuning, Error> {
        let plain: Vec<_> =
            self.open(&Sections::default()).iter().map(|open| response(open, self.static_gain)).collect();
        let mut trials = Vec::new();
        for (structure, filters) in candidates(modes, self.dt)? {
            let members = shaped(&plain, &sections(&filters, self.dt)?);
            let search = self.search(&members, self.limit);
            let gains = match wanted {
                _ if filters.is_empty() => search.with_sign(1.0),
                Some(Structure::LowPass) if structure == Structure::LowPass => search.roughly_with_sign(1.0),
                Some(Structure::ActiveDamping) if structure == Structure::LowPass => search.roughly_with_sign(-1.0),
                _ => search.roughly(),
            };
            trials.push(Trial { structure: structure.with_gain(gains.kp), filters, gains });
        }
        let mut tried: Vec<(Structure, f64)> = Vec::new();
        for Trial { structure, gains, .. } in &trials {
            let ki = gains.ki_dt / self.dt;
            match tried.iter_mut().find(|(known, _)| known == structure) {
                Some((_, best)) => *best = best.max(ki),
                None => tried.push((*structure, ki)),
            }
        }
        let admitted = |trial: &Trial| wanted.is_none_or(|wanted| trial.structure == wanted);
        let greatest = trials.iter().filter(|trial| admitted(trial)).map(|trial| trial.gains.ki_dt).fold(0.0, f64::max);
        let is_good = |trial: &Trial| admitted(trial) && trial.gains.ki_dt >= AS_GOOD * greatest;
        // The greatest is good, and without a wanted structure there is always one.
        let Some(chosen) = trials.iter().position(is_good) else {
            let wanted = wanted.unwrap_or(Structure::ProportionalIntegral);
            let damps = wanted == Structure::ActiveDamping && tried.iter().any(|(one, _)| *one == Structure::LowPass);
            return Err(if damps { damps_nothing() } else { without_modes(wanted) });
        };
        let Trial { structure, filters, gains } = trials.swap_remove(chosen);
        let sign = if gains.kp < 0.0 { -1.0 } else { 1.0 };
        self.tuned(structure, filters, tried, Some(sign))
    }

    fn open(&self, filters: &Sections) -> Vec<OpenLoop> {
        self.members.iter().map(|transfer| OpenLoop { filters: *filters, transfer: transfer.clone() }).collect()
    }

    fn search<'a>(&self, members: &'a [Vec<FrequencyPoint>], limit: f64) -> GainSearch<'a> {
        GainSearch { slopes: self.slopes, static_gain: self.static_gain, members, limit }
    }

    /// The best gains behind these filters, and what the loop is with them; `sign` is that of the proportional gain
    /// behind filters.
    fn tuned(
        &self,
        structure: Structure,
        filters: Vec<FeedbackFilter>,
        tried: Vec<(Structure, f64)>,
        sign: Option<f64>,
    ) -> Result<Tuning, Error> {
        let Self { slopes, static_gain, limit, dt, .. } = *self;
        let open = self.open(&sections(&filters, dt)?);
        let members: Vec<_> = open.iter().map(|open| response(open, static_gain)).collect();
        let both = || open.iter().zip(&members);
        let mut bound = limit;
        // The response is known at its points; between them the peak may be a little higher.
        let (gains, worst) = loop {
            let search = self.search(&members, bound);
            let gains = sign.map_or_else(|| search.fastest(), |sign| search.with_sign(sign));
            let worst = both().map(|(open, points)| peak(gains, slopes, open, points).0).fold(0.0, f64::max);
            if worst <= limit {
                break (gains, worst);
            }
            bound *= limit / worst * (1.0 - 1e-9);
        };
        let at = |slope| margins(gains, slope, &open[0], &members[0], dt);
        let rejections = both().map(|(open, points)| rejection(gains, slopes.min, open, points));
        let hertz = |angle: f64| angle / (TAU * dt);
        // The search ends near zero, not at it.
        let kp = if gains.kp.abs() * slopes.max * static_gain.abs() < MIN_LOOP_GAIN { 0.0 } else { gains.kp };
        Ok(Tuning {
            kp,
            ki: gains.ki_dt / dt,
            at_min_slope: at(slopes.min),
            at_max_slope: at(slopes.max),
            peak_sensitivity: worst,
            rejection_bandwidth: hertz(rejections.fold(f64::INFINITY, f64::min)),
            noise_bandwidth: hertz(noise(gains, slopes.max, &members[0])),
            structure,
            filters,
            tried,
        })
    }
}

/// Filters were asked for where there is nothing to filter.
fn without_modes(wanted: Structure) -> Error {
    let expected = "\"proportional-integral\" for dynamics without modes for filters, with a damping ratio below 0.5 and below \
                    0.45 of the sampling rate";
    Error::Choice { parameter: "structure", expected, got: wanted.name() }
}

/// Active damping was asked for where the best gains do not damp.
fn damps_nothing() -> Error {
    let expected =
        "\"proportional-integral\", \"low-pass\" or \"notch\" where the best proportional gain is not below 0";
    Error::Choice { parameter: "structure", expected, got: Structure::ActiveDamping.name() }
}

/// The same points behind filters.
fn shaped(members: &[Vec<FrequencyPoint>], filters: &Sections) -> Vec<Vec<FrequencyPoint>> {
    let behind = |point: &FrequencyPoint| {
        let shape = filters::response(filters.as_slice(), Complex::cis(point.angle));
        FrequencyPoint { plant: point.plant * shape, ..*point }
    };
    members.iter().map(|points| points.iter().map(behind).collect()).collect()
}

/// Damping ratios of the poles of a notch.
const WIDTHS: [f64; 6] = [0.35, 0.5, 0.7, 1.0, 1.5, 2.2];

/// Cut-off frequencies of low-passes of first and second order, as shares of the lowest mode.
const FIRST: [f64; 5] = [0.06, 0.1, 0.17, 0.25, 0.4];
const SECOND: [f64; 5] = [0.2, 0.35, 0.5, 0.75, 1.1];

/// The damping ratio of a low-pass of second order.
const LOW_PASS_DAMPING: f64 = 1.0;

/// A notch above this share of the sampling rate would be squeezed against half of it.
const HIGHEST: f64 = 0.45;

/// Up to how many modes every choice of notches is tried.
const MOST_CHOSEN: usize = 3;

/// What is tried for dynamics with these lightly damped modes, the simplest first.
fn candidates(modes: &[SecondOrder], dt: f64) -> Result<Vec<(Structure, Vec<FeedbackFilter>)>, Error> {
    let mut candidates = vec![(Structure::ProportionalIntegral, Vec::new())];
    let lowest = modes.iter().map(SecondOrder::frequency).fold(f64::INFINITY, f64::min);
    let is_seen = |frequency: f64| frequency * dt < HIGHEST;
    let low_passes =
        FIRST.map(|share| (share, None)).into_iter().chain(SECOND.map(|share| (share, Some(LOW_PASS_DAMPING))));
    for (share, damping) in low_passes.filter(|(share, _)| is_seen(share * lowest)) {
        candidates.push((Structure::LowPass, vec![LowPass::new(share * lowest, damping)?.into()]));
    }
    let seen: Vec<_> = modes.iter().filter(|mode| is_seen(mode.frequency())).collect();
    for notched in choices(&seen) {
        for width in WIDTHS {
            let notch =
                |mode: &&SecondOrder| Notch::new(mode.frequency(), mode.damping(), width).map(FeedbackFilter::from);
            candidates.push((Structure::Notch, notched.iter().map(notch).collect::<Result<Vec<_>, _>>()?));
        }
    }
    Ok(candidates)
}

/// Which modes may have a notch: a weak one may need none, and each notch costs phase. The fewest first; of more than
/// [`MOST_CHOSEN`] modes all have one.
fn choices<'a>(modes: &[&'a SecondOrder]) -> Vec<Vec<&'a SecondOrder>> {
    if modes.len() > MOST_CHOSEN {
        return vec![modes.to_vec()];
    }
    let chosen =
        |mask: u32| (modes.iter().enumerate()).filter(move |(place, _)| mask >> place & 1 == 1).map(|(_, mode)| *mode);
    let mut choices: Vec<Vec<_>> = (1..1_u32 << modes.len()).map(|mask| chosen(mask).collect()).collect();
    choices.sort_by_key(Vec::len);
    choices
}

/// How many proportional gains are tried before the best is looked at more closely.
const TRIALS: u32 = 48;

/// The same behind filters, for each sign: roughly, to compare filters, and for those that are chosen.
const ROUGH_TRIALS: u32 = 8;
const FINE_TRIALS: u32 = 24;

/// A loop at the frequencies that are looked at, for all dynamics that may be.
struct GainSearch<'a> {
    slopes: Slopes,
    static_gain: f64,
    members: &'a [Vec<FrequencyPoint>],
    /// Of the peak of the sensitivity.
    limit: f64,
}

impl GainSearch<'_> {
    /// Both gains are sought in units of 1 / (slope times static gain), where 1 is of the order of what is sought.
    fn gains(&self, kp: f64, ki_dt: f64) -> Gains {
        let unit = 1.0 / (self.slopes.max * self.static_gain);
        Gains { kp: kp * unit, ki_dt: ki_dt * unit }
    }

    fn admits(&self, kp: f64, ki_dt: f64) -> bool {
        let gains = self.gains(kp, ki_dt);
        self.members.iter().all(|points| is_admissible(gains, self.slopes, points, self.limit))
    }

    /// The best gains that are not negative.
    fn fastest(&self) -> Gains {
        let integral = |kp: f64| greatest(|ki_dt| self.admits(kp, ki_dt));
        let highest = greatest(|kp| self.admits(kp, TINY));
        let trial = |i: u32| highest * (f64::from(i) / f64::from(TRIALS)).powi(2);
        let integrals: Vec<f64> = (0..=TRIALS).map(|i| integral(trial(i))).collect();
        let best = (0..=TRIALS).zip(&integrals).max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        let between = golden_section(trial(best.saturating_sub(1)), trial((best + 1).min(TRIALS)), integral);
        let on_grid = (trial(best), integrals[best as usize]);
        let (kp, ki_dt) = if between.1 >= on_grid.1 { between } else { on_grid };
        self.gains(kp, ki_dt)
    }

    /// Roughly the best gains, the proportional one of either sign.
    fn roughly(&self) -> Gains {
        let (above, below) = (self.on_grid(1.0, ROUGH_TRIALS), self.on_grid(-1.0, ROUGH_TRIALS));
        let (kp, ki_dt, _) = if below.1 > above.1 { below } else { above };
        self.gains(kp, ki_dt)
    }

    /// Roughly the best gains whose proportional one has this sign.
    fn roughly_with_sign(&self, sign: f64) -> Gains {
        let (kp, ki_dt, _) = self.on_grid(sign, ROUGH_TRIALS);
        self.gains(kp, ki_dt)
    }

    /// The best gains whose proportional one has this sign.
    fn with_sign(&self, sign: f64) -> Gains {
        let (kp, ki_dt, step) = self.on_grid(sign, FINE_TRIALS);
        let integral = |kp: f64| greatest_near(ki_dt, |ki_dt| self.admits(sign * kp, ki_dt));
        let found = golden_section((kp.abs() - step).max(0.0), kp.abs() + step, integral);
        if found.1 > ki_dt { self.gains(sign * found.0, found.1) } else { self.gains(kp, ki_dt) }
    }

    /// The best of some gains kp of a sign, ki dt there, and how far kp is from the next one.
    fn on_grid(&self, sign: f64, trials: u32) -> (f64, f64, f64) {
        let highest = greatest_near(0.1, |kp| self.admits(sign * kp, TINY));
        let trial = |i: u32| highest * (f64::from(i) / f64::from(trials)).powi(2);
        let (mut best, mut last) = ((0.0, 0.0, 0.0), 0.1);
        for i in 0..=trials {
            let integral = greatest_near(last, |ki_dt| self.admits(sign * trial(i), ki_dt));
            if integral > best.1 {
                best = (sign * trial(i), integral, trial(i + 1) - trial(i));
            }
            last = integral;
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Sections;

    use super::*;
    use crate::filters::{FeedbackFilter, LowPass, sections};
    use crate::linear::{LinearDynamics, SecondOrder};
    use crate::tuning::loop_response::{OpenLoop, response};

    const DT: f64 = 1e-4;

    fn members(mode: (f64, f64), filters: &[FeedbackFilter]) -> Vec<Vec<FrequencyPoint>> {
        let dynamics = LinearDynamics::from(SecondOrder::new(mode.0, mode.1).unwrap());
        let filters = if filters.is_empty() { Sections::default() } else { sections(filters, DT).unwrap() };
        vec![response(&OpenLoop { filters, transfer: dynamics.pulse_transfer(DT).unwrap() }, 1.0)]
    }

    /// Of 200 proportional gains, evenly, none admits a greater integral gain than the one that is found.
    #[test]
    fn the_gains_of_a_sign_are_those_with_the_greatest_integral_gain() {
        let low_pass = FeedbackFilter::from(LowPass::new(320.0, None).unwrap());
        let slopes = Slopes { min: 0.7, max: 1.0 };
        for (members, sign) in [(members((400.0, 0.95), &[]), 1.0), (members((800.0, 0.02), &[low_pass]), -1.0)] {
            let search = GainSearch { slopes, static_gain: 1.0, members: &members, limit: 1.7 };
            let highest = greatest_near(0.1, |kp| search.admits(sign * kp, TINY));
            let integral = |i: u32| greatest(|ki_dt| search.admits(sign * highest * f64::from(i) / 200.0, ki_dt));
            let best = (0..=200).map(integral).fold(0.0, f64::max);
            let found = search.with_sign(sign);
            assert!(found.ki_dt > best * (1.0 - 1e-3), "{sign}: {} {best}", found.ki_dt);
            assert!(search.admits(found.kp, found.ki_dt * (1.0 - 1e-9)));
            assert!(found.kp * sign > 0.0);
        }
    }
}
