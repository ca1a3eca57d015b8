//! What the identification of a stage of several axes returns.

use hysteresis_control::multi_axis::{MultiAxisStage, ScalarOperator};
use hysteresis_core::Play;

use super::candidate::{AxesHysteresis, Candidate};
use super::data::Data;
use super::uncertainty::AxesStandardErrors;
use crate::judge::finding::{Finding, Verdict};
use crate::judge::finding_code::FindingCode;
use crate::judge::residual::poor_fit;
use crate::records::signal::bounds;

/// A stage of several axes, and how well it follows its records.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxesIdentification {
    /// The stage.
    pub model: MultiAxisStage,
    /// Its hysteresis: "none", "plays" or "duhem".
    pub hysteresis: String,
    /// Where it stands: "none", `"in_front"` or "inside".
    pub place: String,
    /// The rms error of each position over all fitted samples, noise included.
    pub errors: Vec<f64>,
    /// That of the chosen structure over samples to which it was not fitted.
    pub held_out_errors: Vec<f64>,
    /// That of the best linear model, over the same held-out samples.
    pub linear_errors: Vec<f64>,
    /// The standard deviation of each position.
    pub deviations: Vec<f64>,
    /// Frequency in Hz and damping ratio of each mode, from the lowest frequency up: of A, what rings while operators
    /// stand.
    pub modes: Vec<[f64; 2]>,
    /// Standard errors of what does not depend on the coordinates of the states, for noise with the spectrum of what is
    /// left.
    pub standard_errors: AxesStandardErrors,
    /// All structures that were tried.
    pub tried: Vec<AxesTrial>,
    /// What makes the numbers doubtful.
    pub warnings: Vec<Finding>,
    /// How many passes over the records the search took.
    pub evaluations: usize,
}

/// A structure that was tried.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AxesTrial {
    /// What it is.
    pub name: String,
    /// The number of states, without those of the operators.
    pub states: usize,
    /// How many numbers were searched.
    pub parameters: usize,
    /// The rms error over the samples that it was fitted to, all positions together, in their standard deviations.
    pub fitted: f64,
    /// The mean over the positions of rms error over standard deviation, over those held out.
    pub held_out: f64,
    /// Whether the model is of this structure, fitted to all samples then.
    pub chosen: bool,
}

impl AxesIdentification {
    /// Whether the result deserves trust: the worst of its [`warnings`](Self::warnings).
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.warnings)
    }

    /// The numbers as a text: the model, its errors, and what was tried.
    #[must_use]
    pub fn summary(&self) -> String {
        let (n, m, p) = (self.model.states(), self.model.drives(), self.model.positions());
        let mut lines = vec![format!(
            "Stage of several axes: {m} drives, {p} positions, {n} states, hysteresis: {} ({})",
            self.hysteresis, self.place
        )];
        lines.push("Position:  error rms  held out    linear held out  standard deviation".to_owned());
        for i in 0..p {
            lines.push(format!(
                "  {i:>7}  {:>9.3e}  {:>9.3e}  {:>15.3e}  {:>18.3e}",
                self.errors[i], self.held_out_errors[i], self.linear_errors[i], self.deviations[i]
            ));
        }
        let doubts = self.standard_errors.frequencies.iter().zip(&self.standard_errors.dampings);
        for ([frequency, damping], (of_frequency, of_damping)) in self.modes.iter().zip(doubts) {
            lines.push(format!(
                "Mode: {frequency:.6e} +- {of_frequency:.1e} Hz, damping ratio {damping:.4e} +- {of_damping:.1e}"
            ));
        }
        for (i, (operator, doubts)) in self.model.operators().iter().zip(&self.standard_errors.operators).enumerate() {
            lines.extend(table(i, operator, doubts));
        }
        lines.push("Tried, % of the standard deviation:            states  parameters  fitted  held out".to_owned());
        for AxesTrial { name, states, parameters, fitted, held_out, chosen } in &self.tried {
            let (fitted, held_out, chosen) = (100.0 * fitted, 100.0 * held_out, if *chosen { "  chosen" } else { "" });
            lines.push(format!("  {name:<43}  {states:>6}  {parameters:>10}  {fitted:>6.3}  {held_out:>8.3}{chosen}"));
        }
        lines.extend(self.warnings.iter().map(ToString::to_string));
        lines.join("\n")
    }
}

/// An operator as a table: thresholds with weights, or knots with f+ and f-, and their standard errors.
fn table(number: usize, operator: &ScalarOperator, doubts: &[f64]) -> Vec<String> {
    let with_doubt = |value: f64, place: usize| match doubts.get(place) {
        Some(doubt) if doubt.is_finite() => format!("{value:>10.3e} +- {doubt:.0e}"),
        _ => format!("{value:>10.3e} not told"),
    };
    match operator {
        ScalarOperator::Plays { plays, weights } => {
            let row = |(j, (play, w)): (usize, (&Play, &f64))| format!("  {:>10.3e}  {}", play.r(), with_doubt(*w, j));
            let rows = plays.iter().zip(weights).enumerate().map(row);
            std::iter::once(format!("Operator {number}: threshold  weight")).chain(rows).collect()
        }
        ScalarOperator::Duhem(duhem) => {
            let (rows, count) =
                (duhem.knots().zip(duhem.rising().zip(duhem.falling())).enumerate(), duhem.knots().count());
            let row = |(j, (z, (rising, falling)))| {
                format!("  {z:>10.3e}  {}  {}", with_doubt(rising, j), with_doubt(falling, count + j))
            };
            std::iter::once(format!("Operator {number}: z of knot  f+  f-")).chain(rows.map(row)).collect()
        }
    }
}

/// The held-out error of a model with hysteresis is at most this share of that of another one.
const LESS: f64 = 0.9;

/// What makes a result doubtful: what the model leaves, and whether a linear one, or curves without memory, predict
/// as well.
pub(super) fn findings(
    tried: &[AxesTrial],
    linear: &Candidate,
    chosen: &Candidate,
    residuals: &[Vec<f64>],
    data: &Data,
) -> Vec<Finding> {
    let p = data.positions;
    let poor = (0..p).map(|i| {
        let column =
            |signals: &[f64], skip: usize| signals[skip * p + i..].iter().step_by(p).copied().collect::<Vec<_>>();
        let residual: Vec<f64> = residuals.iter().flat_map(|part| column(part, 0)).collect();
        let (low, high) = bounds(&data.records.iter().flat_map(|(_, y)| column(y, data.skip)).collect::<Vec<_>>());
        poor_fit(&residual, high - low)
            .try_next("more records, or what moves the stage is not among the drives".to_owned())
    });
    let mut all: Vec<Finding> = poor.max_by(|p, q| p.value.total_cmp(&q.value)).into_iter().collect();
    let percent = |value: f64| format!("{:.2} %", 100.0 * value);
    let rival = |name: &str| {
        let rivals = tried.iter().filter(|trial| trial.name.starts_with(name)).map(|trial| trial.held_out);
        rivals.fold(f64::INFINITY, f64::min)
    };
    let coarse = f64::min(rival("plays"), rival("Duhem"));
    if coarse.is_finite() {
        let with_hysteresis = coarse.min(chosen.held_out);
        let message = format!(
            "over samples that were not fitted it is {} off, a linear model {}",
            percent(with_hysteresis),
            percent(linear.held_out)
        );
        let code = FindingCode::HysteresisInsideNotTold;
        all.push(Finding::new(code, with_hysteresis / linear.held_out, LESS, message));
    }
    let curve = rival("curves");
    if chosen.hysteresis != AxesHysteresis::None && curve.is_finite() {
        let message = format!(
            "over samples that were not fitted it is {} off, curves without memory in its place {}",
            percent(chosen.held_out),
            percent(curve)
        );
        all.push(Finding::new(FindingCode::MemoryNotTold, chosen.held_out / curve, LESS, message));
    }
    all.into_iter().filter(|finding| finding.value > finding.limit).collect()
}
