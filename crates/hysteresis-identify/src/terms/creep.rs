//! Creep: p(k) = h(k) + sum_j c_j q_j(k), q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k), a_j = exp(-dt / tau_j).
//!
//! The time constants are known, the amplitudes are searched. The filter is that of the whole linear part: see
//! `SampledPart` in `dynamics`, and `fit::filter_lanes`.

use hysteresis_control::linear::Creep;

use crate::error::Error;
use crate::records::signal::as_f64;

/// The span of log-type creep in seconds, unless the records are shorter or sampled more slowly.
const SPAN: (f64, f64) = (0.01, 100.0);

/// Log-type creep goes on beyond the longest record, to so many times its length: slower terms are all but a drift.
const BEYOND: f64 = 10.0;

/// The shortest time constant, in samples: what is faster belongs to the dynamics.
const FASTEST_SAMPLES: f64 = 30.0;

/// The shortest time constant of log-type creep, in samples: its span may begin earlier than it can be told, as all
/// terms share one amplitude.
const FASTEST_LOGARITHMIC_SAMPLES: f64 = 3.0;

/// Where slow creep of log-type begins, in seconds.
const SLOW: f64 = 0.1;

/// Terms a decade apart: the longest time constant, as a share of the record. A term that is slower is a drift.
const SLOWEST_SHARE: f64 = 1.0 / 3.0;

/// The time constants of creep that has an amplitude for every decade, and how much longer than the longest record they
/// may be.
const DECADES: [f64; 5] = [0.01, 0.1, 1.0, 10.0, 100.0];
const SLOWEST_OF_DECADES: f64 = 3.0;

/// Where the search of an amplitude begins, in units of its parameter.
pub(crate) const START: f64 = 0.01;

/// How many amplitudes are searched at most.
pub(crate) const MAX_AMPLITUDES: usize = 12;

/// Which creep to fit behind the hysteresis: y(k) = h(k) + sum_j c_j q_j(k), q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k),
/// with a_j = exp(-dt / tau_j). The time constants tau_j are known, the amplitudes c_j are searched.
///
/// ```
/// use hysteresis_identify::{CreepModel, Options};
/// let options = Options { dt: Some(1e-4), creep: CreepModel::Logarithmic { terms: None }, ..Options::default() };
/// assert_ne!(options.creep, CreepModel::default());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum CreepModel {
    /// No creep.
    None,
    /// No creep in the model; but a record whose start is not fitted may still creep from what was before it.
    UnderWay,
    /// [`EveryDecade`](Self::EveryDecade), [`SlowAndFast`](Self::SlowAndFast), [`Slow`](Self::Slow) or
    /// [`UnderWay`](Self::UnderWay), as cross-validation over stretches of the records asks for; none without a
    /// sampling interval.
    #[default]
    Auto,
    /// Log-type creep from 0.1 s on: [`Logarithmic`](Self::Logarithmic) without its terms below. Those are hard to tell
    /// from a dead time.
    Slow,
    /// The same with terms from 10 ms to 0.1 s, which share an amplitude of their own.
    SlowAndFast,
    /// Creep of any course from 10 ms to 100 s, as by a power of time: a term at 10 ms, 100 ms, 1 s, ..., each with an
    /// amplitude of its own, as far as the records are long enough for it and sampled often enough.
    EveryDecade,
    /// Log-type creep, y(t) = h (1 + gamma log10(t / t0)) after a step: terms of equal amplitude at time constants
    /// evenly spaced on a logarithmic axis, as [`Creep::logarithmic`] has them. One parameter, gamma, is searched. The
    /// span is 10 ms to 100 s, but not beyond ten times the longest record, and not below three samples.
    Logarithmic {
        /// How many terms; two per decade unless given.
        terms: Option<usize>,
    },
    /// That many terms, their time constants a decade apart, the longest a third of the longest record. Each has an
    /// amplitude of its own.
    Decades(usize),
    /// Terms with these time constants, in seconds, each with an amplitude of its own: at most 12.
    TimeConstants(Vec<f64>),
}

/// Time constants, and what the searched amplitudes mean for each.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct CreepBasis {
    pub(crate) time_constants: Vec<f64>,
    /// For each searched parameter what its unit makes of every c_j.
    pub(crate) directions: Vec<Vec<f64>>,
}

impl CreepBasis {
    /// Terms that each have an amplitude of their own.
    fn apart(time_constants: Vec<f64>) -> Self {
        let terms = time_constants.len();
        let unit = |i: usize| (0..terms).map(|j| f64::from(u8::from(i == j))).collect();
        Self { directions: (0..terms).map(unit).collect(), time_constants }
    }

    /// The amplitudes of terms that are apart, each the sum of those of another basis that are nearest to it.
    pub(crate) fn gathered(&self, time_constants: &[f64], amplitudes: &[f64]) -> Vec<f64> {
        let distance = |own: f64, tau: f64| (own / tau).ln().abs();
        let mut gathered = vec![0.0; self.time_constants.len()];
        for (tau, amplitude) in time_constants.iter().zip(amplitudes) {
            let nearest = (0..gathered.len()).min_by(|i, j| {
                distance(self.time_constants[*i], *tau).total_cmp(&distance(self.time_constants[*j], *tau))
            });
            if let Some(nearest) = nearest {
                gathered[nearest] += amplitude;
            }
        }
        gathered
    }

    /// Log-type creep from `start` on, and not below three samples, to 100 s, but not beyond ten times the longest
    /// record.
    fn logarithmic(start: f64, terms: Option<usize>, seconds: f64, dt: f64) -> Result<Self, Error> {
        let domain = |expected, got| Error::domain("creep", None, expected, got);
        let (start, end) = (start.max(FASTEST_LOGARITHMIC_SAMPLES * dt), SPAN.1.min(BEYOND * seconds));
        if start.is_nan() || end < 2.0 * start {
            return Err(domain("records longer than a fifth of the shortest time constant of log-type creep", seconds));
        }
        let terms = terms.unwrap_or_else(|| terms_of(start, end));
        let count = u16::try_from(terms).ok().filter(|terms| (1..=200).contains(terms));
        let count = count.ok_or_else(|| Error::whole("creep", "1 to 200 terms", terms))?;
        let unit = Creep::logarithmic(1.0, start, end, count)?;
        Ok(Self { time_constants: unit.time_constants().to_vec(), directions: vec![unit.amplitudes().to_vec()] })
    }

    /// The same with faster terms, which have an amplitude of their own.
    fn with_faster(self, fast: &Creep) -> Self {
        let before = vec![0.0; fast.time_constants().len()];
        let after = vec![0.0; self.time_constants.len()];
        let time_constants = [fast.time_constants(), &self.time_constants].concat();
        let slow = self.directions.into_iter().map(|one| [before.as_slice(), &one].concat());
        let directions = slow.chain([[fast.amplitudes(), &after].concat()]).collect();
        Self { time_constants, directions }
    }

    /// The first amplitudes alone, with the terms that they have.
    pub(crate) fn first(&self, amplitudes: usize) -> Self {
        let directions = &self.directions[..amplitudes];
        let is_used = |j: &usize| directions.iter().any(|one| one[*j] != 0.0);
        let used: Vec<usize> = (0..self.time_constants.len()).filter(is_used).collect();
        Self {
            time_constants: used.iter().map(|j| self.time_constants[*j]).collect(),
            directions: directions.iter().map(|one| used.iter().map(|j| one[*j]).collect()).collect(),
        }
    }

    /// What people call the terms that share an amplitude: by their time constants where there are several amplitudes.
    pub(crate) fn name_of(&self, amplitude: usize) -> String {
        let terms = self.time_constants.iter().zip(&self.directions[amplitude]);
        let own: Vec<f64> = terms.filter(|(_, unit)| **unit != 0.0).map(|(tau, _)| *tau).collect();
        match own[..] {
            _ if self.directions.len() == 1 => "creep".to_owned(),
            [tau] => format!("creep with a time constant of {tau:.3} s"),
            [first, .., last] => format!("creep with time constants from {first:.3} s to {last:.3} s"),
            [] => "creep".to_owned(),
        }
    }

    /// c_j for parameters.
    pub(crate) fn amplitudes(&self, parameters: impl Fn(usize) -> f64) -> Vec<f64> {
        let amplitude = |j: usize| self.directions.iter().enumerate().map(|(i, one)| parameters(i) * one[j]).sum();
        (0..self.time_constants.len()).map(amplitude).collect()
    }
}

impl CreepModel {
    /// Whether there is creep in the model.
    pub(crate) fn has_terms(&self) -> bool {
        !matches!(self, Self::None | Self::UnderWay | Self::Auto)
    }

    /// The largest amplitude that is searched, per unit of its parameter: as a share of the position, per decade for
    /// log-type creep.
    ///
    /// Piezoelectric ceramics creep by 1 to 2 % a decade, soft polymers by several. What nobody asked for must not
    /// stand in, with more than that, for operators that the model lacks.
    pub(crate) fn largest(&self) -> f64 {
        match self {
            Self::Auto | Self::Slow | Self::SlowAndFast | Self::EveryDecade => 0.2,
            _ => 1.0,
        }
    }

    /// The creep that may be under way when a record begins whose start is not fitted: log-type, where creep of that
    /// kind is searched or left open and the records are long enough; else none.
    pub(crate) fn underway(&self, seconds: f64, dt: f64) -> CreepBasis {
        let of = |model: &Self| model.basis(seconds, dt).unwrap_or_default();
        match self {
            Self::Auto | Self::UnderWay | Self::Slow | Self::SlowAndFast | Self::EveryDecade => of(&Self::Slow),
            Self::Logarithmic { .. } => of(self),
            Self::None | Self::Decades(_) | Self::TimeConstants(_) => CreepBasis::default(),
        }
    }

    /// The terms for a longest record of so many seconds and the shortest sampling interval.
    pub(crate) fn basis(&self, seconds: f64, dt: f64) -> Result<CreepBasis, Error> {
        match self {
            Self::None | Self::UnderWay | Self::Auto => Ok(CreepBasis::default()),
            Self::Logarithmic { terms } => CreepBasis::logarithmic(SPAN.0, *terms, seconds, dt),
            Self::EveryDecade => {
                let is_told = |tau: &f64| (FASTEST_SAMPLES * dt..=SLOWEST_OF_DECADES * seconds).contains(tau);
                let decades: Vec<f64> = DECADES.into_iter().filter(is_told).collect();
                let expected = "records, and samples often enough, that tell a time constant of 10 ms to 100 s: thirty samples of it, \
                                and a third of it";
                if decades.is_empty() {
                    Err(Error::domain("creep", None, expected, seconds))
                } else {
                    Ok(CreepBasis::apart(decades))
                }
            }
            Self::Slow => CreepBasis::logarithmic(SLOW, None, seconds, dt),
            Self::SlowAndFast => {
                let slow = CreepBasis::logarithmic(SLOW, None, seconds, dt)?;
                let start = SPAN.0.max(FASTEST_LOGARITHMIC_SAMPLES * dt);
                // Slow sampling leaves no room for faster ones.
                if SLOW < 2.0 * start || slow.time_constants[0] < 2.0 * start {
                    return Ok(slow);
                }
                let terms = terms_of(start, SLOW);
                let fast = Creep::logarithmic(1.0, start, SLOW, u16::try_from(terms).unwrap_or(1))?;
                Ok(slow.with_faster(&fast))
            }
            Self::Decades(terms) => {
                let slowest = SLOWEST_SHARE * seconds;
                let decades = |k: usize| 0.1_f64.powf(as_f64(*terms) - 1.0 - as_f64(k));
                let fits = (1..=MAX_AMPLITUDES).contains(terms) && slowest * decades(0) >= FASTEST_SAMPLES * dt;
                let expected = "a number of terms that the record can tell apart: one per decade from 30 samples to a \
                                third of the record";
                if fits {
                    Ok(CreepBasis::apart((0..*terms).map(|k| slowest * decades(k)).collect()))
                } else {
                    Err(Error::whole("creep", expected, *terms))
                }
            }
            Self::TimeConstants(time_constants) => {
                let terms = time_constants.len();
                if terms > MAX_AMPLITUDES {
                    return Err(Error::whole("creep", "at most 12 time constants", terms));
                }
                Creep::new(&vec![0.0; terms], time_constants).map_err(as_creep)?;
                Ok(CreepBasis::apart(time_constants.clone()))
            }
        }
    }
}

/// Two per decade, rounded up.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few decades")]
fn terms_of(start: f64, end: f64) -> usize {
    (2.0 * (end / start).log10()).ceil().max(1.0) as usize
}

/// An error of time constants that came as the option `creep`.
fn as_creep(error: hysteresis_core::Error) -> Error {
    match error {
        hysteresis_core::Error::Domain { index, got, .. } => {
            Error::domain("creep", index, "time constants in seconds, finite, above 0 and strictly increasing", got)
        }
        hysteresis_core::Error::Whole { got: 0, .. } => Error::whole("creep", "at least one time constant", 0),
        other => other.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(creep: &CreepModel) -> String {
        creep.basis(2.0, 1e-4).unwrap_err().to_string()
    }

    #[test]
    fn log_type_creep_spans_what_the_records_can_tell() {
        let basis = |seconds, dt| CreepModel::Logarithmic { terms: None }.basis(seconds, dt).unwrap();
        // four decades from 10 ms to 100 s, however long the record
        let long = basis(1e4, 1e-4);
        assert_eq!((long.time_constants.len(), long.directions.len()), (8, 1));
        assert!(long.time_constants[0] > 0.01 && long.time_constants[7] < 200.0);
        assert!(long.directions[0].iter().all(|c| (c - 0.5).abs() < 1e-12)); // gamma per half a decade
        let short = basis(1.0, 1e-4);
        assert_eq!(short.time_constants.len(), 6); // 10 ms to 10 s
        assert!(basis(1000.0, 0.1).time_constants[0] > 0.3);
        assert!(error(&CreepModel::Logarithmic { terms: Some(0) }).starts_with("creep: expected 1 to 200 terms"));
        let tiny = CreepModel::Logarithmic { terms: None }.basis(0.0015, 1e-4).unwrap_err();
        assert!(tiny.to_string().starts_with("creep: expected records longer"), "{tiny}");
    }

    #[test]
    fn amplitudes_are_told_apart_by_name() {
        let names = |model: CreepModel| {
            let basis = model.basis(100.0, 1e-3).unwrap();
            (0..basis.directions.len()).map(|number| basis.name_of(number)).collect::<Vec<_>>()
        };
        assert_eq!(names(CreepModel::Slow), ["creep"]);
        let both = names(CreepModel::SlowAndFast);
        assert!(both.len() == 2 && both[0] != both[1], "{both:?}");
        let apart = ["creep with a time constant of 0.200 s", "creep with a time constant of 3.000 s"];
        assert_eq!(names(CreepModel::TimeConstants(vec![0.2, 3.0])), apart);
    }

    #[test]
    fn every_decade_has_an_amplitude_as_far_as_records_tell_it() {
        let basis = |seconds, dt| CreepModel::EveryDecade.basis(seconds, dt);
        assert_eq!(basis(100.0, 1e-4).unwrap().time_constants, DECADES);
        let few = basis(5.0, 2e-2).unwrap();
        assert_eq!((few.time_constants.as_slice(), few.directions.len()), (&[1.0, 10.0][..], 2));
        for (seconds, dt) in [(100.0, 4.0), (1e-3, 1e-5)] {
            let refused = basis(seconds, dt).unwrap_err().to_string();
            assert!(refused.starts_with("creep: expected records, and samples often enough"), "{refused}");
        }
        // What is nearest in proportion goes together.
        assert_eq!(few.gathered(&[0.2, 2.0, 4.0, 90.0], &[1.0, 2.0, 4.0, 8.0]), [3.0, 12.0]);
    }

    #[test]
    fn decades_end_at_a_third_of_the_record() {
        let basis = CreepModel::Decades(2).basis(3.0, 1e-3).unwrap();
        assert!((basis.time_constants[0] - 0.1).abs() < 1e-12 && (basis.time_constants[1] - 1.0).abs() < 1e-12);
        assert_eq!(basis.amplitudes(|i| [3.0, 5.0][i]), [3.0, 5.0]);
        for terms in [0, 4, 13] {
            assert!(error(&CreepModel::Decades(terms)).starts_with("creep: expected a number of terms"), "{terms}");
        }
    }

    #[test]
    fn time_constants_are_checked() {
        let message = |tau: &[f64]| error(&CreepModel::TimeConstants(tau.to_vec()));
        assert!(message(&[1.0, 0.5]).starts_with("creep[1]: expected time constants in seconds"));
        assert!(message(&[1.0; 13]).starts_with("creep: expected at most 12"));
        assert!(message(&[-1.0]).starts_with("creep[0]"));
    }
}
