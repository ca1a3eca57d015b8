//! What is said of records that do not tell how fast they were taken.

use crate::finding::Finding;
use crate::finding_code::FindingCode;

/// The findings about records without a sampling interval, for a dead time in samples: whatever has a time cannot be fitted, so
/// where something has one the interval is what to try first.
pub(crate) fn without_interval(mut findings: Vec<Finding>, dead_time: f64) -> Vec<Finding> {
    const LIMIT: f64 = 0.5;
    let hint = FindingCode::NoInterval.hint();
    for finding in &mut findings {
        if matches!(finding.code, FindingCode::Drift | FindingCode::RateEffects | FindingCode::DeadTimeConfounded) {
            finding.hint = format!("{hint}; or {}", finding.hint);
        }
    }
    let message = format!(
        "the position is {dead_time:.2} samples late, and how long a sample is is not known: the stage has no dead time, and \
         neither dynamics nor creep can be fitted"
    );
    if dead_time > LIMIT {
        findings.push(Finding::new(FindingCode::NoInterval, dead_time, LIMIT, message));
    }
    findings
}
