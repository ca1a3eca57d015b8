//! A fit without glitches: they are looked for in what a fit leaves, left out, and the fit goes on from where it was.

use crate::error::Error;
use crate::fit::monitor::SearchMonitor;
use crate::glitches::glitches;
use crate::options::Options;
use crate::record::Record;
use crate::search::{Found, search_again, search_all};

/// So many fits go on from where they were: the fewer glitches are left, the smaller ones are seen.
const ROUNDS: usize = 5;

/// What is left out of every record.
pub(crate) type LeftOut = Vec<Vec<usize>>;

/// The best of everything that was asked for, and what was left out of every record for it: what the records leave out already,
/// and glitches if the loss of `asked` leaves them out and there are any.
///
/// What was chosen while there were glitches is chosen anew without them. A search that was stopped is left as it is.
pub(crate) fn search_without_glitches(
    records: &[Record<'_>],
    asked: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Found, LeftOut), Error> {
    let plain = search_all(records, asked, monitor)?;
    let given: LeftOut = records.iter().map(|record| record.left_out().to_vec()).collect();
    let Some(limit) = asked.loss.limit() else { return Ok((plain, given)) };
    if plain.partial || seen(records, records, &plain, limit) == given {
        return Ok((plain, given));
    }
    // The part of the work before is done: progress does not go back.
    monitor.hold();
    let (mut found, mut left_out) = settled(records, plain.clone(), given.clone(), limit, monitor)?;
    if !found.partial && left_out != given {
        found = search_all(&leaving_out(records, &left_out)?, asked, monitor)?;
        (found, left_out) = settled(records, found, left_out, limit, monitor)?;
    }
    // What is no glitch for a better fit was none.
    Ok(if left_out == given { (Found { partial: found.partial, ..plain }, given) } else { (found, left_out) })
}

/// Goes on until what is left out stays the same.
fn settled(
    records: &[Record<'_>],
    mut found: Found,
    mut left_out: LeftOut,
    limit: f64,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Found, LeftOut), Error> {
    for _ in 0..ROUNDS {
        if found.partial {
            break;
        }
        let seen = seen(records, &leaving_out(records, &left_out)?, &found, limit);
        if seen == left_out {
            break;
        }
        left_out = seen;
        found = search_again(&leaving_out(records, &left_out)?, found, monitor)?;
    }
    Ok((found, left_out))
}

/// What these records leave out, and the glitches of every record in what a fit to the `fitted` ones leaves.
fn seen(records: &[Record<'_>], fitted: &[Record<'_>], found: &Found, limit: f64) -> LeftOut {
    let chain = found.fit.chain(found.interval(records));
    let offsets = &found.fit.fit.output_offsets;
    let of_record = |(place, (record, given)): (usize, (&Record<'_>, &Record<'_>))| {
        let mut samples = glitches(record, &chain, place, offsets[place], limit);
        samples.extend(given.left_out());
        samples.sort_unstable();
        samples.dedup();
        samples
    };
    fitted.iter().zip(records).enumerate().map(of_record).collect()
}

/// The same records without these samples.
///
/// # Errors
/// [`Error::Record`] if nothing of a record is left that varies.
pub(crate) fn leaving_out<'b>(records: &[Record<'b>], samples: &'b [Vec<usize>]) -> Result<Vec<Record<'b>>, Error> {
    let leave_out = |(place, (record, samples)): (usize, (&Record<'b>, &'b Vec<usize>))| {
        record.leaving_out(samples).map_err(|error| error.in_record(place))
    };
    records.iter().zip(samples).enumerate().map(leave_out).collect()
}
