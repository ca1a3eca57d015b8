//! A position of the wrong sign: told by a fit to the position turned round.

use crate::diagnostics::causes;
use crate::error::Error;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::record::Record;
use crate::signal;

/// The turned fit must leave less than this share of the error.
const MAX_SHARE: f64 = 0.5;

/// The positions of all records, those that fall where their drive rises turned round.
pub(crate) fn turned_positions(records: &[Record<'_>]) -> Vec<Vec<f64>> {
    let turned = |record: &Record<'_>| {
        let [input, output] = [record.input(), record.output()].map(|signal| record.fitted_of(signal));
        let correlation = signal::correlation(&input, &output);
        let sign = if correlation.is_some_and(|correlation| correlation < 0.0) { -1.0 } else { 1.0 };
        record.output().iter().map(|y| sign * y).collect()
    };
    records.iter().map(turned).collect()
}

/// The same records with other positions.
///
/// # Errors
/// None for positions that are those of the records but for their sign.
pub(crate) fn with_positions<'a>(records: &[Record<'a>], positions: &'a [Vec<f64>]) -> Result<Vec<Record<'a>>, Error> {
    let exchange = |(place, (record, position)): (usize, (&Record<'a>, &'a Vec<f64>))| {
        let turned = record.with_output(position).and_then(|turned| turned.leaving_out(record.left_out()));
        turned.map_err(|error| error.in_record(place))
    };
    records.iter().zip(positions).enumerate().map(exchange).collect()
}

/// The findings when the turned fit leaves `turned` of the range rms and the fit as it is `plain`: what follows from a wrong sign is
/// left out, or the sign is not what is wrong.
pub(crate) fn judged(findings: Vec<Finding>, plain: f64, turned: f64) -> Vec<Finding> {
    if turned >= MAX_SHARE * plain {
        return findings.into_iter().filter(|finding| finding.code != FindingCode::WrongSign).collect();
    }
    let mut findings = causes(findings);
    findings.retain(|finding| !finding.code.compares_drive_and_position());
    for finding in findings.iter_mut().filter(|finding| finding.code == FindingCode::WrongSign) {
        finding.message = format!(
            "{}; the fit leaves {:.3} % of the range rms, and one with the sign of the position turned {:.3} %",
            finding.message,
            100.0 * plain,
            100.0 * turned
        );
    }
    findings
}
