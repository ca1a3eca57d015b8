//! What a comparison of models found.

use crate::fit::chain::Chain;
use crate::options::WeightLaw;
use crate::result::quality::Quality;

/// What a model may have besides coupled plays and a dead time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Extension {
    /// Creep.
    Creep,
    /// The centre of a loop moves with its amplitude.
    LoopShift,
    /// Linear dynamics, and the amplifier beside them.
    Dynamics,
    /// A map in front of the hysteresis, or behind it.
    Maps,
}

impl Extension {
    /// In the order in which they are tried.
    pub(super) const ALL: [Self; 4] = [Self::Creep, Self::LoopShift, Self::Dynamics, Self::Maps];

    /// Its name in lower case: "creep", "loop shift", "dynamics" or "maps".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Creep => "creep",
            Self::LoopShift => "loop shift",
            Self::Dynamics => "dynamics",
            Self::Maps => "maps",
        }
    }
}

/// Why an extension was not tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Omission {
    /// The options leave it out.
    NotAsked,
    /// It counts in seconds, and the records have no sampling interval.
    NoSamplingInterval,
    /// The records cannot tell it: they are too short, or their loops are all alike.
    NotTold,
}

impl Omission {
    /// The reason in words.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Self::NotAsked => "not asked for",
            Self::NoSamplingInterval => "needs a sampling interval",
            Self::NotTold => "the records cannot tell it: too few samples, or loops that are all alike",
        }
    }
}

/// One model of a [`Comparison`]. Errors are in the unit of the output.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ComparedModel {
    /// Its name; see [`compare`](crate::compare).
    pub name: String,
    /// What its weights might be: as given, or as cross-validation chose.
    pub weights: WeightLaw,
    /// How many numbers were fitted: those of the weight law, the polynomial or loop shift, what every record has of its own, and
    /// everything that was searched.
    pub unknowns: usize,
    /// The extensions that it has, or those of the ones left open that cross-validation kept.
    pub kept: Vec<Extension>,
    /// The errors over the fitted samples.
    pub fit: Quality,
    /// The root mean square error on the stretches held out: the mean of the squares over the stretches.
    pub held_out: f64,
    /// The root mean square error on every stretch.
    pub stretches: Vec<f64>,
    pub(crate) fitted: Fitted,
}

/// What predicts the records that were fitted.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Fitted {
    pub(crate) chain: Chain,
    /// One for each record.
    pub(crate) output_offsets: Vec<f64>,
    /// The sampling interval of every record; 1 where it is not known.
    pub(crate) intervals: Vec<f64>,
}

impl Fitted {
    pub(crate) fn residuals(&self, place: usize, input: &[f64], output: &[f64]) -> Vec<f64> {
        let predicted = self.chain.response_in(place, input, self.intervals[place]);
        output.iter().zip(predicted).map(|(y, p)| y - p - self.output_offsets[place]).collect()
    }
}

impl ComparedModel {
    /// The largest root mean square error on a stretch.
    #[must_use]
    pub fn worst_stretch(&self) -> f64 {
        self.stretches.iter().copied().fold(0.0, f64::max)
    }

    /// An error in % of the range, which is that of [`fit`](Self::fit).
    #[must_use]
    pub fn percent(&self, error: f64) -> f64 {
        100.0 * error / self.fit.range
    }

    /// How many records were fitted.
    #[must_use]
    pub fn records(&self) -> usize {
        self.fitted.output_offsets.len()
    }

    /// Measured minus modelled output of the fitted record number `place`, all its samples, with what the record has of its own.
    ///
    /// # Panics
    /// If there is no such record.
    #[must_use]
    pub fn residuals(&self, place: usize, input: &[f64], output: &[f64]) -> Vec<f64> {
        self.fitted.residuals(place, input, output)
    }
}

/// What [`compare`](crate::compare) found.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Comparison {
    /// The models, the simplest first.
    pub models: Vec<ComparedModel>,
    /// The extensions that were not tried, and why.
    pub omitted: Vec<(Extension, Omission)>,
    /// Into how many stretches every record was cut.
    pub stretches: usize,
    /// The samples of every record that were taken for glitches: no model was fitted to them or judged by them.
    pub left_out_samples: Vec<Vec<usize>>,
    /// The place of the simplest model that predicts as well as the best.
    pub(crate) simplest: usize,
}

impl Comparison {
    /// The first model that predicts held-out stretches as well as the best one: the factor between their mean square errors, over
    /// the stretches, is 1 within its standard error.
    #[must_use]
    pub fn simplest(&self) -> &ComparedModel {
        &self.models[self.simplest]
    }

    /// Whether the models have the creep that was under way when a record began, in a record whose start is skipped.
    #[must_use]
    pub fn has_creep_under_way(&self) -> bool {
        self.models.iter().any(|model| model.fitted.chain.underway.iter().any(|amplitude| *amplitude != 0.0))
    }
}
