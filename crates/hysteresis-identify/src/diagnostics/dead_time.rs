//! Whether a dead time may be one.

use super::loops::turns_late;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::chain::Chain;
use crate::numeric::as_f64;
use crate::record::Record;
use crate::signal;

/// A dead time that is long beside the slowest motion.
pub(super) fn implausible(records: &[Record<'_>], chain: &Chain) -> Option<Finding> {
    const LIMIT: f64 = 0.1;
    const SWING: f64 = 0.05;
    let slowest = |record: &Record<'_>| {
        let input = &record.input()[record.skip()..];
        let (low, high) = signal::bounds(input);
        let turns = signal::turns(input, SWING * (high - low));
        let longest = turns.windows(2).map(|pair| pair[1] - pair[0]).max()?;
        Some(2.0 * as_f64(longest) * record.dt().unwrap_or(chain.dt))
    };
    let period = records.iter().filter_map(slowest).reduce(f64::max)?;
    let value = chain.linear.dead_time / period;
    let message = format!(
        "the dead time is {:.0} % of the period of the drive: creep, loop width or shifted columns may look like it",
        100.0 * value
    );
    let late =
        records.iter().filter_map(turns_late).map(|(late, _)| late).reduce(f64::max).filter(|samples| *samples > 1.0);
    let finding = Finding::new(FindingCode::ImplausibleDeadTime, value, LIMIT, message);
    let finding = match late {
        Some(samples) => finding.try_next(format!(
            "if the two were not recorded from the same moment on, shift the position column up by {samples:.0} rows; else add \
             minor loops or a faster record"
        )),
        None => finding,
    };
    (value > LIMIT).then_some(finding)
}
