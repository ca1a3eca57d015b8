//! Findings: what makes records or a result doubtful, each with its number and its limit, and the verdict on them.

use std::fmt;

use crate::judge::finding_code::{FindingCode, Red};

/// How much a finding takes away from a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Severity {
    /// A number is doubtful, or the result would be better with another record.
    Amber,
    /// The result is not that of the stage: do not use it.
    Red,
}

impl Severity {
    /// The name, in lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        Verdict::from(self).name()
    }
}

/// Whether a result deserves trust: the worst of its findings.
///
/// ```
/// use hysteresis_identify::Verdict;
/// assert_eq!(Verdict::of(&[]).name(), "green");
/// assert!(Verdict::Green < Verdict::Amber && Verdict::Amber < Verdict::Red);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// Nothing was found.
    Green,
    /// Some numbers are doubtful.
    Amber,
    /// The result is not that of the stage.
    Red,
}

impl Verdict {
    /// The verdict on what was found.
    #[must_use]
    pub fn of(findings: &[Finding]) -> Self {
        findings.iter().map(|finding| Self::from(finding.severity)).max().unwrap_or(Self::Green)
    }

    /// The name, in lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Amber => "amber",
            Self::Red => "red",
        }
    }
}

impl From<Severity> for Verdict {
    fn from(severity: Severity) -> Self {
        match severity {
            Severity::Amber => Self::Amber,
            Severity::Red => Self::Red,
        }
    }
}

/// Something found: which, what it means here, and how far its number is past its limit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Finding {
    /// Which.
    pub code: FindingCode,
    /// Amber or red, by its code and by how far the value is past the limit.
    pub severity: Severity,
    /// One sentence with the numbers in it.
    pub message: String,
    /// The number that was compared; what it is says [`FindingCode`].
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub value: f64,
    /// What it was compared with.
    #[cfg_attr(feature = "serde", serde(with = "hysteresis_control::stage::number"))]
    pub limit: f64,
    /// What to try next.
    pub hint: String,
    /// The record that shows it most, where records are looked at one by one.
    pub record: Option<usize>,
    /// The sample of that record where it is, or where it ends; skipped samples count.
    pub sample: Option<usize>,
}

impl Finding {
    /// A finding about all records together, with the hint of its code.
    pub(crate) fn new(code: FindingCode, value: f64, limit: f64, message: String) -> Self {
        let hint = code.hint().to_owned();
        Self { code, severity: severity(code, value, limit), message, value, limit, hint, record: None, sample: None }
    }

    /// What reading a file took for granted, in a sentence.
    pub(crate) fn assumed(message: String) -> Self {
        Self::new(FindingCode::Assumed, 1.0, 0.0, message)
    }

    /// The same at a sample.
    pub(crate) fn at(self, sample: usize) -> Self {
        Self { sample: Some(sample), ..self }
    }

    /// The same with what to do spelled out for this record.
    pub(crate) fn try_next(self, hint: String) -> Self {
        Self { hint, ..self }
    }
}

fn severity(code: FindingCode, value: f64, limit: f64) -> Severity {
    let red = match code.red() {
        Red::Never => false,
        Red::Always => true,
        Red::From(bound) => value >= bound,
        Red::Below(bound) => value < bound,
        Red::Factor(factor) => value >= factor * limit,
    };
    if red { Severity::Red } else { Severity::Amber }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}): {}; {}", self.code, self.severity.name(), self.message, self.hint)
    }
}

/// Without what a defect of a record makes of a fit.
pub(crate) fn causes(findings: Vec<Finding>) -> Vec<Finding> {
    findings.into_iter().filter(|finding| !finding.code.is_of_fit()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(code: FindingCode, value: f64) -> Finding {
        Finding::new(code, value, 0.01, "it is so".to_owned())
    }

    #[test]
    fn the_worst_finding_is_the_verdict() {
        let doubtful = finding(FindingCode::PoorFit, 0.02);
        let useless = finding(FindingCode::PoorFit, 0.2);
        assert_eq!((doubtful.severity, useless.severity), (Severity::Amber, Severity::Red));
        assert_eq!(Verdict::of(&[]), Verdict::Green);
        assert_eq!(Verdict::of(std::slice::from_ref(&doubtful)), Verdict::Amber);
        assert_eq!(Verdict::of(&[doubtful.clone(), useless, doubtful]), Verdict::Red);
    }

    #[test]
    fn a_finding_says_what_to_try_next() {
        let found = finding(FindingCode::WrongSign, -0.9).at(3).try_next("turn it".to_owned());
        assert_eq!(found.to_string(), "wrong_sign (red): it is so; turn it");
        assert_eq!(found.sample, Some(3));
    }
}
