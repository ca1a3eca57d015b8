//! A comparison as lines of a terminal.

use super::result::{ComparedModel, Comparison};
use crate::options::WeightLaw;

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
        let weights = match model.weights {
            WeightLaw::Auto | WeightLaw::Free => "free",
            WeightLaw::Quadratic => "quadratic",
            WeightLaw::Split => "split",
        };
        let cells = [format!("{}{mark}", model.name), weights.to_owned(), model.unknowns.to_string()].into_iter();
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
