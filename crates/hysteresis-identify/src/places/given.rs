//! What is given in the place of a measured position: drives, pairs of instants at the same place, known lengths, and
//! options.

use hysteresis_core::{Ratios, is_admissible};

use crate::error::Error;
use crate::options::Setting;
use crate::places::rows::value_at;
use crate::records::record::{check_finite, check_interval, check_varies};
use crate::records::signal;
use crate::terms::creep::CreepModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::{ModelKind, Thresholds};

/// Two instants of one drive at which the stage was at the same place.
///
/// ```
/// use hysteresis_identify::PlacePair;
/// let pair = PlacePair::new(0, 120.5, 310.25);
/// assert_eq!(pair.std, 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacePair {
    /// The number of the drive.
    pub drive: usize,
    /// The first instant, in samples from the first one of the drive; between samples the position goes straight.
    pub first: f64,
    /// The second instant.
    pub second: f64,
    /// How uncertain the match is, as a standard deviation beside those of the other pairs: only ratios of these
    /// numbers count.
    pub std: f64,
}

impl PlacePair {
    /// A pair as certain as others.
    #[must_use]
    pub fn new(drive: usize, first: f64, second: f64) -> Self {
        Self { drive, first, second, std: 1.0 }
    }

    /// The earlier of its instants, however it is written.
    pub(crate) fn earlier(&self) -> f64 {
        self.first.min(self.second)
    }
}

/// A known distance: y(to) - y(from) = `length` for two instants of one drive.
///
/// ```
/// use hysteresis_identify::KnownLength;
/// let pitch = KnownLength::new(0, 12.0, 200.0, 3.0); // um, towards larger positions
/// assert_eq!(pitch.std, None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownLength {
    /// The number of the drive.
    pub drive: usize,
    /// The instant at the beginning, in samples.
    pub from: f64,
    /// The instant at the end, in samples.
    pub to: f64,
    /// The distance, with its sign, in the unit of the position.
    pub length: f64,
    /// Its standard deviation, in the unit of the position; without one it counts as a thousandth of the longest
    /// length.
    pub std: Option<f64>,
}

impl KnownLength {
    /// A length whose uncertainty is not known.
    #[must_use]
    pub fn new(drive: usize, from: f64, to: f64, length: f64) -> Self {
        Self { drive, from, to, length, std: None }
    }
}

/// The options of [`identify_places`](crate::identify_places).
///
/// ```
/// use hysteresis_identify::{PlacesOptions, Setting};
/// let options = PlacesOptions { dead_time: Setting::Fixed(0.0), ..PlacesOptions::new(1e-3) };
/// assert!(options.model.is_none());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PlacesOptions {
    /// The sampling interval of the drives in seconds.
    pub dt: f64,
    /// Which model; none leaves it to cross-validation over the pairs.
    pub model: Option<ModelKind>,
    /// How many operators, and where; a number that is left open is 20.
    pub thresholds: Thresholds,
    /// The ratios of the modified model: given, or searched.
    pub ratios: Setting<Ratios>,
    /// Where the operators have their zero, in the unit of the drive. For the conventional model that is where the
    /// stage was at rest before the drives: it is searched where an equation sees it, and the middle of the drives
    /// otherwise.
    pub input_offset: Setting<f64>,
    /// What the position lags the drive, in seconds: searched up to a tenth of the shortest drive.
    pub dead_time: Setting<f64>,
    /// Which creep; [`CreepModel::Auto`] takes [`CreepModel::Slow`] if cross-validation over the pairs asks for it.
    pub creep: CreepModel,
    /// How smooth the weights are: as [`Options::smoothness`](crate::Options::smoothness), for the drive differences of
    /// the pairs.
    pub smoothness: Setting<f64>,
    /// Whether what is seen drifts against the stage while a drive goes on; none leaves it to cross-validation over the
    /// pairs. A drive of n samples drifts by a s + b ln(1 + 20 s) / ln 21 with s = k / (n - 1). The drift is no part of
    /// the stage. With lengths alone what is tried is what goes on of before the drive: a decay with each time constant
    /// of creep, and with that of warmth.
    pub drift: Option<bool>,
    /// Whether a Duhem operator stands beside the plays, added or subtracted; none leaves it to cross-validation where
    /// what plays leave is not noise alone. Its f is that of Bouc-Wen of exponent 1, and what it is on the way back.
    pub duhem: Option<bool>,
    /// The map of the drive in front of the hysteresis; [`MapModel::Auto`] has one if cross-validation asks for it, and
    /// there are at least 16 lengths: pairs tell none.
    pub input_map: MapModel,
    /// The temperature at every sample of every drive, or none.
    pub temperatures: Vec<Vec<f64>>,
    /// What the position lags the temperature, in seconds: searched up to the length of the longest drive.
    pub thermal_lag: Setting<f64>,
}

impl PlacesOptions {
    /// Everything left to the pairs.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self {
            dt,
            model: None,
            thresholds: Thresholds::Uniform(20),
            ratios: Setting::Fit,
            input_offset: Setting::Fit,
            dead_time: Setting::Fit,
            creep: CreepModel::Auto,
            smoothness: Setting::Fit,
            drift: None,
            duhem: None,
            input_map: MapModel::Auto,
            temperatures: Vec::new(),
            thermal_lag: Setting::Fit,
        }
    }
}

/// Drives, pairs and lengths that fit together.
#[derive(Clone, Copy)]
pub(crate) struct Given<'a> {
    pub(crate) drives: &'a [&'a [f64]],
    pub(crate) pairs: &'a [PlacePair],
    pub(crate) lengths: &'a [KnownLength],
    pub(crate) dt: f64,
    /// For every drive, or for none.
    pub(crate) temperatures: &'a [Vec<f64>],
}

/// The share of the longest length that a length without an uncertainty is uncertain by.
const UNKNOWN_LENGTH: f64 = 1e-3;

impl<'a> Given<'a> {
    pub(crate) fn new(
        drives: &'a [&'a [f64]],
        pairs: &'a [PlacePair],
        lengths: &'a [KnownLength],
        dt: f64,
    ) -> Result<Self, Error> {
        check_interval(dt)?;
        if drives.is_empty() {
            return Err(Error::whole("drives", "at least one", 0));
        }
        for (number, drive) in drives.iter().enumerate() {
            let alone = |error: crate::error::RecordError| error.in_record(number);
            check_finite("drives", drive).map_err(alone)?;
            if drive.len() < 2 {
                return Err(Error::whole("drives", "at least two samples in each", drive.len()));
            }
            check_varies("drives", signal::bounds(drive)).map_err(alone)?;
        }
        let given = Self { drives, pairs, lengths, dt, temperatures: &[] };
        given.check_pairs()?;
        given.check_lengths()?;
        Ok(given)
    }

    /// The same with temperatures, if there are any.
    pub(crate) fn with_temperatures(self, temperatures: &'a [Vec<f64>]) -> Result<Self, Error> {
        if temperatures.is_empty() {
            return Ok(self);
        }
        if temperatures.len() != self.drives.len() {
            return Err(Error::whole("temperature", "one for each drive", temperatures.len()));
        }
        for (number, (temperature, drive)) in temperatures.iter().zip(self.drives).enumerate() {
            check_finite("temperature", temperature).map_err(|error| error.in_record(number))?;
            if temperature.len() != drive.len() {
                return Err(Error::whole("temperature", "as many samples as the drive has", temperature.len()));
            }
        }
        check_varies("temperature", signal::bounds_of(temperatures.iter().map(|one| signal::bounds(one))))
            .map_err(|error| error.in_record(0))?;
        Ok(Self { temperatures, ..self })
    }

    fn check_pairs(&self) -> Result<(), Error> {
        for (place, pair) in self.pairs.iter().enumerate() {
            self.check_instants("pairs", place, pair.drive, [pair.first, pair.second])?;
            if !(is_admissible(pair.std) && pair.std > 1e-100) {
                return Err(Error::domain("pairs", Some(place), "a standard deviation above 0", pair.std));
            }
        }
        Ok(())
    }

    fn check_lengths(&self) -> Result<(), Error> {
        if self.lengths.is_empty() {
            return Err(Error::whole("lengths", "at least one, as pairs do not tell the scale", 0));
        }
        for (place, known) in self.lengths.iter().enumerate() {
            self.check_instants("lengths", place, known.drive, [known.from, known.to])?;
            if known.from == known.to {
                return Err(Error::domain("lengths", Some(place), "two different instants", known.from));
            }
            if !is_admissible(known.length) {
                return Err(Error::domain("lengths", Some(place), "a finite length", known.length));
            }
            if let Some(std) = known.std.filter(|std| !(is_admissible(*std) && *std > 1e-100)) {
                return Err(Error::domain("lengths", Some(place), "a standard deviation above 0", std));
            }
        }
        let longest = self.longest();
        if longest > 1e-100 { Ok(()) } else { Err(Error::domain("lengths", None, "a length that is not 0", longest)) }
    }

    fn check_instants(&self, name: &'static str, place: usize, drive: usize, at: [f64; 2]) -> Result<(), Error> {
        let Some(input) = self.drives.get(drive) else {
            return Err(Error::domain(name, Some(place), "the number of a drive", signal::as_f64(drive)));
        };
        let last = signal::as_f64(input.len() - 1);
        match at.into_iter().find(|at| !(0.0..=last).contains(at)) {
            Some(at) => Err(Error::domain(name, Some(place), "instants from 0 to the last sample of the drive", at)),
            None => Ok(()),
        }
    }

    /// The longest known length.
    pub(crate) fn longest(&self) -> f64 {
        self.lengths.iter().fold(0.0, |longest, known| known.length.abs().max(longest))
    }

    /// How uncertain every length is.
    pub(crate) fn length_deviations(&self) -> Vec<f64> {
        let longest = self.longest();
        self.lengths.iter().map(|known| known.std.unwrap_or(UNKNOWN_LENGTH * longest)).collect()
    }

    /// The pairs and the lengths: the drive and the two instants of each.
    pub(crate) fn equations(&self) -> impl Iterator<Item = (usize, [f64; 2])> {
        let pairs = self.pairs.iter().map(|pair| (pair.drive, [pair.first, pair.second]));
        pairs.chain(self.lengths.iter().map(|known| (known.drive, [known.from, known.to])))
    }

    /// By how much the drive differs between the two instants of each equation.
    pub(crate) fn drive_steps(&self) -> impl Iterator<Item = f64> {
        let at = |drive: usize, instant: f64| value_at(self.drives[drive], instant);
        self.equations().map(move |(drive, [first, second])| at(drive, second) - at(drive, first))
    }

    /// The least and the largest sample of all drives.
    pub(crate) fn drive_bounds(&self) -> (f64, f64) {
        signal::bounds_of(self.drives.iter().map(|drive| signal::bounds(drive)))
    }

    /// How long the longest drive lasts, and the shortest, in seconds.
    pub(crate) fn longest_and_shortest(&self) -> (f64, f64) {
        let seconds = |drive: &&[f64]| self.dt * signal::as_f64(drive.len() - 1);
        let all = self.drives.iter().map(seconds);
        all.fold((0.0, f64::INFINITY), |(longest, shortest), one| (one.max(longest), one.min(shortest)))
    }
}
