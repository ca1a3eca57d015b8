//! What to identify, and what is known already.

use hysteresis_control::linear;
use hysteresis_core::is_admissible;

use crate::error::Error;
use crate::numeric::as_f64;
use crate::options::Setting;
use crate::record::Record;

/// The longest time constant of creep, as a share of the record: a term that is slower is a drift.
const SLOWEST_SHARE: f64 = 1.0 / 3.0;

/// The shortest time constant that creep is given unasked, in samples: what is faster belongs to the dynamics.
const FASTEST_SAMPLES: f64 = 30.0;

/// Which dynamics to fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// A first-order lag.
    First,
    /// Second-order dynamics.
    #[default]
    Second,
}

/// Which terms of creep to fit; their amplitudes are searched.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum CreepTerms {
    /// No creep.
    #[default]
    None,
    /// That many terms, their time constants a decade apart, the longest a third of the record.
    Count(usize),
    /// Terms with these time constants, in seconds.
    TimeConstants(Vec<f64>),
}

/// The options of [`identify_dynamics`](crate::identify_dynamics).
///
/// ```
/// use hysteresis_identify::{DynamicsOptions, Order, Setting};
/// let options = DynamicsOptions { delay: Setting::Fixed(1.0), ..DynamicsOptions::new(1e-4) };
/// assert_eq!(options.order, Order::Second);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicsOptions {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Which dynamics.
    pub order: Order,
    /// By how many samples the output lags the input besides, fractions included: searched from 0 to a tenth of the
    /// record.
    pub delay: Setting<f64>,
    /// Which creep.
    pub creep: CreepTerms,
}

impl DynamicsOptions {
    /// Second-order dynamics and a delay, both searched, without creep.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self { dt, order: Order::default(), delay: Setting::Fit, creep: CreepTerms::None }
    }

    /// Checks everything that was given.
    pub(super) fn check(&self, record: &Record<'_>) -> Result<(), Error> {
        let domain = |parameter, expected, got| Error::Domain { parameter, index: None, expected, got };
        if !(is_admissible(self.dt) && self.dt > 1e-90) {
            return Err(domain("dt", "a finite number above 0", self.dt));
        }
        match self.delay {
            Setting::Fixed(delay) if !(delay >= 0.0 && delay < as_f64(record.input().len())) => {
                Err(domain("delay", "a number >= 0 below the length of the record", delay))
            }
            _ => Ok(()),
        }
    }

    /// The time constants of creep, in seconds.
    pub(super) fn time_constants(&self, record: &Record<'_>) -> Result<Vec<f64>, Error> {
        let length = as_f64(record.fitted_samples());
        match &self.creep {
            CreepTerms::None => Ok(Vec::new()),
            CreepTerms::Count(terms) => {
                let slowest = SLOWEST_SHARE * length;
                let decades = |k: usize| 0.1_f64.powf(as_f64(*terms) - 1.0 - as_f64(k));
                let fits = *terms > 0 && slowest * decades(0) >= FASTEST_SAMPLES;
                let expected = "a number of terms that the record can tell apart: one per decade from 30 samples to a \
                                third of the record";
                let wrong = Error::Domain { parameter: "creep", index: None, expected, got: as_f64(*terms) };
                if fits { Ok((0..*terms).map(|k| slowest * decades(k) * self.dt).collect()) } else { Err(wrong) }
            }
            CreepTerms::TimeConstants(time_constants) => {
                let amplitudes = vec![0.0; time_constants.len()];
                linear::Creep::new(&amplitudes, time_constants).map_err(|error| Error::Domain {
                    parameter: "creep",
                    index: error.index,
                    expected: "time constants in seconds, finite, above 0 and strictly increasing",
                    got: error.got,
                })?;
                Ok(time_constants.clone())
            }
        }
    }
}
