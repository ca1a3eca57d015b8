//! Actuators with a drive each: single searches, shared out.

use std::ops::ControlFlow;
use std::slice;

use super::descent::{Problem, Start};
use super::records::ManyRecords;
use super::result::ActuatorFit;
use super::settle::Settled;
use super::share::{Shared, Underway};
use crate::error::Error;
use crate::fit::course::Course;
use crate::fit::monitor::{SearchMonitor, Stop};
use crate::fit::projection::{ProjectedFit, Projection};
use crate::options::Options;
use crate::record::Record;
use crate::search::{Found, search_hysteresis, with_least_slope};
use crate::turned_sign::turned_positions;

/// Fits all actuators, each like a single one.
pub(super) fn fit_all(
    records: &ManyRecords<'_>,
    options: &Options,
    shared: &mut Shared<'_>,
) -> Result<Vec<Result<ActuatorFit, Error>>, Error> {
    let fit = |m: usize, underway: &Underway<'_>| fit(&records.record(m)?, options, underway);
    shared.all(records.actuators(), true, fit).ok_or(Error::Interrupted)
}

fn search(record: &Record<'_>, options: &Options, underway: &Underway<'_>) -> Result<Found, Error> {
    let mut report =
        |_: &_| if underway.is_stopped() { ControlFlow::Break(Stop::Discard) } else { ControlFlow::Continue(()) };
    search_hysteresis(slice::from_ref(record), options, &mut SearchMonitor::new(&mut report))
}

fn fit(record: &Record<'_>, options: &Options, underway: &Underway<'_>) -> Result<ActuatorFit, Error> {
    let found = with_least_slope(slice::from_ref(record), search(record, options, underway)?)?;
    let Found { fit: found, options, smoothness, basis, .. } = found;
    let (space, fit) = (&found.space, &found.fit);
    let projection = Projection::new(slice::from_ref(record), space, &basis, smoothness, 1);
    let course = &Course::new(record, 1, 0);
    let problem = Problem { record, space, basis: &basis, course, smoothness, projection: &projection };
    let normal = problem.pass(start(fit))?.normal;
    let settled = Settled { record, options: &options, space, basis: &basis, fit, normal: &normal };
    settled.report(|| {
        let positions = turned_positions(slice::from_ref(record));
        let turned = Record::new(record.input(), &positions[0], record.skip()).map_err(|error| error.in_record(0))?;
        Ok(search(&turned, &options, underway)?.fit.fit.squares)
    })
}

fn start(fit: &ProjectedFit) -> Start {
    Start { point: fit.point, unknowns: fit.unknowns.clone(), output_offset: fit.output_offsets[0] }
}
