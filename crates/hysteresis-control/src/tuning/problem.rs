//! A feedback that is sought: the slopes, the dynamics that may be, and the bound on the sensitivity.

use core::f64::consts::TAU;

use hysteresis_core::Sections;
use nalgebra::Complex;

use super::bandwidth::{noise, rejection};
use super::feedback::{Gains, Slopes, peak};
use super::gains::GainSearch;
use super::margins::margins;
use super::open_loop::OpenLoop;
use super::options::Tuning;
use super::response::{FrequencyPoint, response};
use super::structure::{Structure, candidates};
use crate::filters::{self, FeedbackFilter, sections};
use crate::linear::{Error, PulseTransfer, SecondOrder};

/// A simpler structure is taken if its ki is at least this share of the greatest.
const AS_GOOD: f64 = 0.95;

/// A proportional gain that gives the loop less than this does nothing.
const MIN_LOOP_GAIN: f64 = 1e-9;

pub(super) struct Problem {
    pub(super) slopes: Slopes,
    pub(super) static_gain: f64,
    /// Of the peak of the sensitivity.
    pub(super) limit: f64,
    pub(super) dt: f64,
    /// The dynamics as they are known, and all that may be.
    pub(super) members: Vec<PulseTransfer>,
}

/// Filters that were tried, and roughly the best gains behind them.
struct Trial {
    structure: Structure,
    filters: Vec<FeedbackFilter>,
    gains: Gains,
}

impl Problem {
    /// Gains alone.
    pub(super) fn without_filters(&self) -> Result<Tuning, Error> {
        self.tuned(Structure::ProportionalIntegral, Vec::new(), Vec::new(), None)
    }

    /// Filters for lightly damped modes, and gains: of those whose ki is as great as any, the simplest. With a `wanted` structure only
    /// those of its kind count, but all are tried.
    pub(super) fn with_filters(&self, modes: &[SecondOrder], wanted: Option<Structure>) -> Result<Tuning, Error> {
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

    /// The best gains behind these filters, and what the loop is with them; `sign` is that of the proportional gain behind filters.
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
pub(super) fn without_modes(wanted: Structure) -> Error {
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
