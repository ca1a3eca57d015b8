//! The drive for a reference that is known beforehand.

use hysteresis_core::{Bound, Error as CoreError, QuasiStaticInverse, check_all_finite};

use super::{Error, Stage, rest_drive};
use crate::checks::check_positive;
use crate::feedforward::DynamicsInverse;

/// A reference begins where the stage is if it is no farther from there than this share of the range of positions: what
/// a fitted output offset may be wrong by.
const SAME_POSITION: f64 = 2e-3;

/// What rounding may take a target beyond the limits, relative to it.
const ROUNDING: f64 = 1e-9;

/// How far behind the beginning of a reference in motion the run-up to it begins: this share of the range of positions.
const RUN_UP: f64 = 0.02;

/// How many samples count as the beginning of a drive, at most half of it.
const BEGINNING: usize = 20;

/// A difference that small fades over this time, in seconds, so that even then no drive jumps.
const FADE: f64 = 0.005;

/// How to precompensate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrecompensateOptions<'a> {
    /// The drive never leaves (low, high); by default [`Stage::drive_range`].
    pub limits: Option<(f64, f64)>,
    /// The drive at which the stage has been at rest; by default [`Stage::rest_drive`] within the limits. The
    /// hysteresis is then virgin but for the way there.
    pub start: Option<f64>,
    /// What has been put out since that rest, oldest drive first, one per sampling interval: what hysteresis, loop
    /// shift, slow gain and creep remember. After a full stroke these are its two ends and the drive of now.
    pub history: &'a [f64],
    /// How long a smooth way from there to the beginning of the reference takes, in seconds: it is put in front of the
    /// reference. Without one the reference must begin where the stage is.
    pub lead_in: Option<f64>,
}

/// A drive for a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Precompensated {
    /// One drive for every sample of the lead-in and of the reference.
    pub drive: Vec<f64>,
    /// How many samples in front of the reference the lead-in takes.
    pub lead_in_samples: usize,
    /// The step to the first drive from the one before it: large for a reference that begins in motion without a
    /// lead-in.
    pub first_step: f64,
    /// How many targets lay beyond the limits.
    pub saturated_count: u64,
    /// How many drives the slew rate of the stage held back.
    pub slewing_count: u64,
}

/// A path, and the stage where it begins.
pub(super) struct Wanted {
    inverse: QuasiStaticInverse,
    /// The drive at which it has been at rest.
    pub(super) start: f64,
    /// Lead-in and reference in one.
    pub(super) path: Vec<f64>,
    lead_in_samples: usize,
}

impl Stage {
    /// The drives that move the stage along a reference, sampled at `dt` seconds: the position that is read at t_k is
    /// reference\[k\].
    ///
    /// The reference is led through the inverse of modes and dead time, then sample by sample through the exact inverse
    /// of creep, loop shift, output map, hysteresis and input map, and last through that of the amplifier, which is in
    /// front of all. What the modes are to get is chosen with the lag of the amplifier among them, so that no drive
    /// need jump. The first drive is the last one before it or near it: the stage begins at rest, or where its history
    /// has left it. Every drive is within the limits and keeps the slew rate of the stage. A reference that is in
    /// motion at its end is taken to go on.
    ///
    /// # Errors
    /// [`Error::Start`] for a reference that begins elsewhere than the stage is, without a lead-in; otherwise [`Error`]
    /// that names what is not finite, empty or out of its range.
    pub fn precompensate(
        &self,
        reference: &[f64],
        dt: f64,
        options: &PrecompensateOptions<'_>,
    ) -> Result<Precompensated, Error> {
        let Wanted { mut inverse, path, lead_in_samples, .. } = self.wanted(reference, dt, options)?;
        let before = inverse.output();
        let targets = self.invert_dynamics(path, dt)?;
        let mut found =
            Precompensated { drive: targets, lead_in_samples, first_step: 0.0, saturated_count: 0, slewing_count: 0 };
        let step = self.parts().slew.map_or(f64::INFINITY, |slew| slew * dt);
        found.walk(&mut inverse, step);
        found.first_step = found.drive[0] - before;
        Ok(found)
    }

    /// Where the stage begins, and the path that it is to follow from there.
    pub(super) fn wanted(
        &self,
        reference: &[f64],
        dt: f64,
        options: &PrecompensateOptions<'_>,
    ) -> Result<Wanted, Error> {
        check_samples(reference)?;
        let limits = self.limits(options.limits)?;
        let start = options.start.unwrap_or_else(|| rest_drive(limits));
        check_start(start, limits)?;
        let mut inverse = self.inverse_behind_amplifier(dt, limits)?;
        inverse.settle(start);
        follow_history(&mut inverse, options.history)?;
        let rest = self.parts().dynamics.static_gain() * inverse.position();
        let (path, lead_in_samples) = self.path(reference, dt, options.lead_in, (rest, inverse.output()))?;
        Ok(Wanted { inverse, start, path, lead_in_samples })
    }

    /// The targets of the quasi-static inverse. With a negative dead time a row holds a position that is read later:
    /// the path then moves down by as many rows as make the dead time causal.
    fn invert_dynamics(&self, mut path: Vec<f64>, dt: f64) -> Result<Vec<f64>, Error> {
        let rows = (-self.parts().dead_time / dt).ceil().max(0.0);
        let dynamics = self.amplifier_and_modes().with_dead_time(self.parts().dead_time + rows * dt)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let rows = (rows as usize).min(path.len());
        let first = path[0];
        path.rotate_right(rows);
        path[..rows].fill(first);
        Ok(DynamicsInverse::new(&dynamics, dt)?.invert(&path, None)?)
    }

    /// Lead-in and reference in one.
    fn path(
        &self,
        reference: &[f64],
        dt: f64,
        lead_in: Option<f64>,
        (position, drive): (f64, f64),
    ) -> Result<(Vec<f64>, usize), Error> {
        let difference = position - reference[0];
        let mut path = Vec::new();
        let mut span = bounds(reference);
        if let Some((low, high)) = self.position_range() {
            // The stage may be, and the reference may begin, where only this history leads.
            span = (span.0.min(low).min(position), span.1.max(high).max(position));
        }
        if let Some(seconds) = lead_in {
            let samples = lead_in_samples(seconds, dt)?;
            reserve(&mut path, reference.len().saturating_add(samples), "lead_in")?;
            path.extend(lead_in_path(reference, difference, samples, span));
            path.extend_from_slice(reference);
            return Ok((path, samples));
        }
        if difference.abs() > SAME_POSITION * (span.1 - span.0).abs() {
            return Err(Error::Start { position, drive, got: reference[0] });
        }
        reserve(&mut path, reference.len(), "reference")?;
        let fade = lead_in_samples(FADE, dt)?;
        path.extend(reference.iter().enumerate().map(|(k, r)| r + difference * (1.0 - smooth(k, fade))));
        Ok((path, 0))
    }
}

impl Precompensated {
    /// Whether the drive begins with a step that stands out: more than three times as large as any later one and more
    /// than 1 % of the span of the drives, or half as much again as any later one and more than a quarter of that span.
    #[must_use]
    pub fn begins_with_a_jump(&self) -> bool {
        /// How many times any later step, and what share of the span.
        const STANDS_OUT: [(f64, f64); 2] = [(3.0, 0.01), (1.5, 0.25)];
        let (low, high) = bounds(&self.drive);
        // The inverse may need a few samples to catch up; what it does then belongs to the beginning.
        let beginning = BEGINNING.min(self.drive.len() / 2);
        let later = self.drive.windows(2).skip(beginning).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        STANDS_OUT.iter().any(|(times, share)| self.first_step.abs() > (share * (high - low)).max(times * later))
    }

    /// Turns targets into drives.
    fn walk(&mut self, inverse: &mut QuasiStaticInverse, step: f64) {
        for sample in &mut self.drive {
            let (target, last) = (*sample, inverse.output());
            let is_free = inverse.step_between(target, (last - step, last + step));
            *sample = inverse.output();
            if is_free {
                // A target at the very limit is within reach but for rounding.
                let missed = inverse.saturated() && inverse.missed(target).abs() > ROUNDING * (1.0 + target.abs());
                self.saturated_count += u64::from(missed);
            } else {
                self.slewing_count += 1;
            }
        }
    }
}

/// The way to the beginning of a reference, from rest at `difference` from there: it arrives with the velocity of the
/// reference, so that nothing is left to catch up with.
///
/// First a smooth step to the beginning less half the run-up, then the run-up, a polynomial of degree five: at rest
/// where it begins, at the velocity v and without acceleration where it ends, v T / 2 farther.
#[expect(clippy::cast_precision_loss, reason = "no array has 2^53 samples")]
fn lead_in_path(reference: &[f64], difference: f64, samples: usize, span: (f64, f64)) -> impl Iterator<Item = f64> {
    let velocity = match reference {
        // Through the first three samples; a corner there has no velocity of its own.
        [a, b, c, ..] if (c - 2.0 * b + a).abs() <= 0.5 * (b - a).abs() => 1.5 * (b - a) - 0.5 * (c - b),
        _ => 0.0,
    };
    let first = reference[0];
    let samples_behind = 2.0 * RUN_UP * (span.1 - span.0) / velocity.abs();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let run_up = (samples_behind as usize).min(samples / 2);
    let behind = 0.5 * velocity * run_up as f64;
    // At the end of the range there is no room behind.
    let has_room = span.0 <= first - behind && first - behind <= span.1;
    let (run_up, behind) = if has_room { (run_up, behind) } else { (0, 0.0) };
    let step = samples - run_up;
    (0..samples).map(move |k| {
        let way = first + difference - (difference + behind) * smooth(k, step);
        let t = k.saturating_sub(step) as f64 / run_up.max(1) as f64;
        way + velocity * run_up as f64 * t * t * t * (1.0 - 0.5 * t)
    })
}

/// The polynomial of least jerk from 0 at sample 0 to 1 at `samples`, at rest at both ends.
#[expect(clippy::cast_precision_loss, reason = "no array has 2^53 samples")]
fn smooth(k: usize, samples: usize) -> f64 {
    let t = if k < samples { k as f64 / samples as f64 } else { 1.0 };
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
fn lead_in_samples(seconds: f64, dt: f64) -> Result<usize, Error> {
    check_positive("lead_in", None, seconds)?;
    check_positive("dt", None, dt)?;
    // A sampling interval out of a time column is rounded: a hundredth of a sample is none.
    Ok((seconds / dt - 0.01).ceil() as usize)
}

fn reserve(path: &mut Vec<f64>, samples: usize, parameter: &'static str) -> Result<(), Error> {
    path.try_reserve_exact(samples).map_err(|_| {
        let expected = "as many samples as there is memory for";
        CoreError::whole(parameter, None, expected, samples).into()
    })
}

fn bounds(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (y.min(low), y.max(high)))
}

/// Takes over what has been put out before.
fn follow_history(inverse: &mut QuasiStaticInverse, history: &[f64]) -> Result<(), Error> {
    inverse.follow(history).map_err(|error| match error {
        CoreError::Domain { index, expected, got, .. } => {
            CoreError::Domain { parameter: "history", index, expected, got }.into()
        }
        other => other.into(),
    })
}

fn check_samples(reference: &[f64]) -> Result<(), Error> {
    if reference.is_empty() {
        return Err(CoreError::Empty { parameter: "reference" }.into());
    }
    Ok(check_all_finite("reference", reference)?)
}

fn check_start(start: f64, limits: Option<(f64, f64)>) -> Result<(), Error> {
    let (low, high) = limits.unwrap_or((-1e100, 1e100));
    if low <= start && start <= high {
        Ok(())
    } else {
        let expected = Bound::Between { low, high };
        Err(CoreError::Domain { parameter: "start", index: None, expected, got: start }.into())
    }
}
