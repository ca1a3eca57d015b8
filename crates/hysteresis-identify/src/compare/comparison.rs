//! What a comparison of models found, also as lines of a terminal.

use crate::fit::response::Chain;
use crate::result::quality::Quality;
use crate::terms::weights::WeightLaw;

/// What a model may have besides coupled plays and a dead time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Extension {
    /// Creep.
    Creep,
    /// The centre of a loop moves with its amplitude.
    LoopShift,
    /// Plays that relax: the width of a loop changes with its rate.
    RelaxingPlays,
    /// The size of all loops changes while the drive cycles.
    SlowGain,
    /// Linear dynamics, and the amplifier beside them.
    Dynamics,
    /// A map in front of the hysteresis, or behind it.
    Maps,
    /// A Duhem operator beside the plays.
    Duhem,
}

impl Extension {
    /// In the order in which they are tried.
    pub(crate) const ALL: [Self; 7] =
        [Self::Creep, Self::LoopShift, Self::RelaxingPlays, Self::SlowGain, Self::Dynamics, Self::Maps, Self::Duhem];

    /// Its name in lower case: "creep", "loop shift", "relaxing plays", "slow gain", "dynamics", "maps" or "duhem".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Creep => "creep",
            Self::LoopShift => "loop shift",
            Self::RelaxingPlays => "relaxing plays",
            Self::SlowGain => "slow gain",
            Self::Dynamics => "dynamics",
            Self::Maps => "maps",
            Self::Duhem => "duhem",
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
            Self::NotTold => "the records cannot tell it: too short, or loops that are all alike",
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
    /// How many numbers were fitted: those of the weight law, the polynomial or loop shift, what every record has of
    /// its own, and everything that was searched.
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

    /// Measured minus modelled output of the fitted record number `place`, all its samples, with what the record has of
    /// its own.
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
    /// The first model that predicts held-out stretches as well as the best one: the factor between their mean square
    /// errors, over the stretches, is 1 within its standard error.
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

/// Digits of an error that mean something.
const DIGITS: usize = 4;

impl Comparison {
    /// All of it as lines for a terminal: one for each model, and what the numbers are. `unit` is that of the output.
    #[must_use]
    pub fn table(&self, unit: &str) -> String {
        let of_unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        let errors = ["fitted", "held out", "worst"];
        let header = ["model", "weights", "unknowns"].map(str::to_owned).into_iter();
        let header = header.chain(errors.map(|name| format!("{name}{of_unit}")));
        let header = header.chain(errors.map(|name| format!("{name} (%)"))).chain(["kept".to_owned()]);
        let mut rows = vec![header.collect::<Vec<_>>()];
        rows.extend(self.models.iter().enumerate().map(|(place, model)| self.cells(place, model)));
        let widths: Vec<usize> = (0..rows[0].len())
            .map(|column| rows.iter().map(|cells| cells[column].chars().count()).max().unwrap_or(0))
            .collect();
        let lines = rows.iter().map(|cells| line(cells, &widths));
        lines.chain(self.notes(unit)).collect::<Vec<_>>().join("\n")
    }

    /// What the numbers of a table are, and what is not in it.
    #[must_use]
    pub fn notes(&self, unit: &str) -> Vec<String> {
        let range = digits(self.models[0].fit.range);
        let mut notes = vec![
            format!(
                "rms errors. held out: every record in {} stretches, each predicted from a fit to the others; worst: the \
                 worst of them",
                self.stretches
            ),
            format!("%: of the range, {} peak-to-peak of the measured output", format!("{range} {unit}").trim_end()),
            "*: the simplest model that predicts held-out stretches as well as the best".to_owned(),
        ];
        if self.has_creep_under_way() {
            notes.push("all models: with the creep under way where the start of a record is skipped".to_owned());
        }
        notes.extend(
            self.omitted.iter().map(|(extension, why)| format!("not tried: {}: {}", extension.name(), why.reason())),
        );
        notes
    }

    fn cells(&self, place: usize, model: &ComparedModel) -> Vec<String> {
        let mark = if place == self.simplest { " *" } else { "" };
        let errors = [model.fit.rmse, model.held_out, model.worst_stretch()];
        let kept: Vec<_> = model.kept.iter().map(|extension| extension.name()).collect();
        let kept =
            if kept.is_empty() && model.name.starts_with("modified +") { "none".to_owned() } else { kept.join(", ") };
        let weights = model.weights.name().to_owned();
        let cells = [format!("{}{mark}", model.name), weights, model.unknowns.to_string()].into_iter();
        let cells = cells.chain(errors.map(digits)).chain(errors.map(|error| format!("{:.3}", model.percent(error))));
        cells.chain([kept]).collect()
    }
}

/// The first and the last cell to the left, numbers to the right.
fn line(cells: &[String], widths: &[usize]) -> String {
    let last = cells.len() - 1;
    let padded = cells.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
        0 => format!("{cell:<width$}"),
        _ if column == last => cell.clone(),
        _ => format!("{cell:>width$}"),
    });
    padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
}

/// A number with significant digits, without an exponent for usual magnitudes.
fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    #[expect(clippy::cast_possible_truncation, reason = "a decimal exponent")]
    let exponent = value.abs().log10().floor() as i32;
    if !(-5..7).contains(&exponent) {
        return format!("{value:.*e}", DIGITS - 1);
    }
    let places = i32::try_from(DIGITS).map_or(0, |count| count - 1 - exponent);
    format!("{value:.*}", usize::try_from(places).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        let shown = [0.123_456, 12.345_67, 0.0, 98_765.4, 1.5e-9].map(digits);
        assert_eq!(shown, ["0.1235", "12.35", "0", "98765", "1.500e-9"]);
    }

    #[test]
    fn columns_are_aligned() {
        let cells = |text: &str| text.split('|').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(line(&cells("a|1|b"), &[3, 4, 5]), "a       1  b");
        assert_eq!(line(&cells("a|1|"), &[3, 4, 5]), "a       1");
    }
}
