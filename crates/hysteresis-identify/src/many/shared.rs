//! Actuators with one drive: what depends on the drive alone is computed once for all of them.

use std::slice;

use super::descent::{Patience, Problem, State};
use super::records::ManyRecords;
use super::result::ActuatorFit;
use super::scan::{Candidate, Drive, Factored, Positions, dead_times, points};
use super::settle::Settled;
use super::share::Shared;
use crate::error::Error;
use crate::fit::course::Course;
use crate::fit::point::{Parameter, Point};
use crate::fit::projection::{ProjectedFit, Projection};
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;
use crate::options::{Options, Setting};
use crate::record::Record;
use crate::turned_sign::turned_positions;

/// The scan looks at about so many samples.
const SCAN_ROWS: usize = 300;

/// The steps of several starts use about this many samples per unknown, however long the record.
const ROWS_PER_UNKNOWN: usize = 40;

/// Between these and all samples, others on about so many: most steps of a long record cost little.
const MORE_ROWS: [usize; 2] = [20_000, 160_000];

/// How many starts are followed at first, and how many passes over the selected samples their steps may take.
const ROUNDS: [(usize, usize); 3] = [(8, 4), (3, 4), (1, 8)];

/// How many passes the steps may take on the first larger selection, and on any later one.
const LONG: usize = 60;
const SHORT: usize = 15;

/// On n samples an estimate is known to a share of 1/n of the sum of squares: so much of that is worth a pass, which is cheap here.
const WORTH: f64 = 5e-4;

/// With how many points the dead time is looked for.
const DEAD_TIME_POINTS: usize = 5;

/// With more weights than that the tables would be too large to gain anything.
pub(super) const MOST_WEIGHTS: usize = 64;

/// What actuators of one drive share.
pub(super) struct SharedDrive<'a> {
    input: &'a [f64],
    options: &'a Options,
    smoothness: f64,
    space: Space,
    basis: WeightBasis,
    scan: Course,
    /// Ever more samples, at last all of them.
    courses: Vec<Course>,
}

impl<'a> SharedDrive<'a> {
    /// What the drive of a record tells.
    pub(super) fn new(record: &Record<'a>, options: &'a Options, smoothness: f64) -> Result<Self, Error> {
        let records = slice::from_ref(record);
        let (space, basis) = (Space::new(records, options)?, WeightBasis::new(options, 0));
        let samples = record.fitted_samples();
        let unknowns = basis.freedom() + 1 + space.axes().len();
        let course = |rows: usize| Course::new(record, (samples / rows).max(1), 0);
        let mut courses = vec![course(ROWS_PER_UNKNOWN * unknowns)];
        courses.extend(MORE_ROWS.into_iter().filter(|rows| samples / rows > 1).map(course));
        courses.push(course(samples));
        Ok(Self { input: record.input(), options, smoothness, scan: course(SCAN_ROWS), courses, space, basis })
    }

    fn drive(&self) -> Drive<'_> {
        Drive { input: self.input, course: &self.scan, space: &self.space, basis: &self.basis }
    }

    /// For every dead time worth a look a few points.
    fn dead_time_tables(&self, shared: &mut Shared<'_>) -> Option<Vec<Vec<Factored>>> {
        let (dead_times, starts) = (dead_times(&self.space), self.space.starts());
        let every = starts.len().div_ceil(DEAD_TIME_POINTS);
        shared.all(dead_times.len(), false, |number, _| {
            let at = |start: &Point| Factored::new(start.with(Parameter::DeadTime, dead_times[number]), &self.drive());
            starts.iter().step_by(every).map(at).collect()
        })
    }

    /// All points of the scan at one dead time.
    fn table(&self, dead_time: f64, shared: &mut Shared<'_>) -> Option<Vec<Candidate>> {
        let points = points(&self.space, self.scan.len() * self.basis.columns());
        let at = |number: usize| Candidate::new(points[number].with(Parameter::DeadTime, dead_time), &self.drive());
        shared.all(points.len(), false, |number, _| at(number))
    }

    /// The best fit on all samples, from the points of a table.
    fn search(&self, problem: &Problem<'_>, table: &[Candidate]) -> Result<State, Error> {
        let thinned = problem.on(&self.courses[0]);
        let positions = Positions::new(problem.record.output(), &self.scan);
        let starts = positions.starts(table, &thinned, ROUNDS[0].0);
        let (mut states, mut refused) = (Vec::new(), None);
        for start in starts {
            match thinned.pass(start) {
                Ok(state) => states.push(state),
                Err(error) => refused = Some(error),
            }
        }
        if let Some(error) = refused.filter(|_| states.is_empty()) {
            return Err(error);
        }
        for (entering, passes) in ROUNDS {
            states.sort_by(|p, q| p.objective.total_cmp(&q.objective));
            states.truncate(entering);
            let patience = Patience { gain: 1e-5, passes };
            states = states.into_iter().map(|state| thinned.improve(state, patience)).collect();
        }
        let mut best = states.swap_remove(0);
        for (place, course) in self.courses.iter().enumerate().skip(1) {
            let more = problem.on(course);
            let gain = (WORTH / as_f64(course.len())).max(1e-9);
            let patience = Patience { gain, passes: if place == 1 { LONG } else { SHORT } };
            best = more.improve(more.pass(best.best)?, patience);
        }
        Ok(best)
    }

    /// Fits one actuator.
    fn fit(&self, record: &Record<'_>, table: &[Candidate]) -> Result<ActuatorFit, Error> {
        let projection = Projection::new(slice::from_ref(record), &self.space, &self.basis, self.smoothness, 1);
        let problem = self.problem(record, &projection);
        let state = self.search(&problem, table)?;
        let steeper = self.basis.with_least_slope(&self.basis.weights(&state.best.unknowns));
        let (fit, state) = match &steeper {
            Some(basis) => self.again(record, basis, state)?,
            None => (problem.projected(&state), state),
        };
        let settled = Settled {
            record,
            options: self.options,
            space: &self.space,
            basis: steeper.as_ref().unwrap_or(&self.basis),
            fit: &fit,
            normal: &state.normal,
        };
        settled.report(|| {
            let positions = turned_positions(slice::from_ref(record));
            let turned =
                Record::new(record.input(), &positions[0], record.skip()).map_err(|error| error.in_record(0))?;
            Ok(self.search(&self.problem(&turned, &projection), table)?.objective)
        })
    }

    /// The best fit under another law at the point of one, on all samples.
    fn again(&self, record: &Record<'_>, basis: &WeightBasis, state: State) -> Result<(ProjectedFit, State), Error> {
        let projection = Projection::new(slice::from_ref(record), &self.space, basis, self.smoothness, 1);
        let course = &self.courses[self.courses.len() - 1];
        let problem = Problem { basis, course, ..self.problem(record, &projection) };
        let state = problem.pass(state.best)?;
        Ok((problem.projected(&state), state))
    }

    fn problem<'b>(&'b self, record: &'b Record<'b>, projection: &'b Projection<'b>) -> Problem<'b> {
        let course = &self.courses[0];
        let (space, basis, smoothness) = (&self.space, &self.basis, self.smoothness);
        Problem { record, space, basis, course, smoothness, projection }
    }
}

/// Fits all actuators of one drive; nothing if it was stopped.
pub(super) fn fit_all(
    records: &ManyRecords<'_>,
    options: &Options,
    shared: &mut Shared<'_>,
) -> Result<Vec<Result<ActuatorFit, Error>>, Error> {
    let checked: Vec<Result<Record<'_>, Error>> = (0..records.actuators()).map(|m| records.record(m)).collect();
    let Some(first) = checked.iter().find_map(|record| record.as_ref().ok()) else {
        return Ok(checked.into_iter().map(|record| record.and(Err(Error::NoRecords))).collect());
    };
    let smoothness = match options.smoothness {
        Setting::Fixed(smoothness) => smoothness,
        Setting::Fit => 0.0,
    };
    let drive = SharedDrive::new(first, options, smoothness)?;
    let tables = drive.dead_time_tables(shared).ok_or(Error::Interrupted)?;
    let dead_time = |record: &Record<'_>| Positions::new(record.output(), &drive.scan).dead_time(&tables);
    let chosen = shared.all(checked.len(), false, |m, _| checked[m].as_ref().ok().map(dead_time));
    let chosen = chosen.ok_or(Error::Interrupted)?;
    drop(tables);
    let mut fits: Vec<Result<ActuatorFit, Error>> = checked
        .iter()
        .map(|record| record.as_ref().map_or_else(|error| Err(*error), |_| Err(Error::Interrupted)))
        .collect();
    // One table at a time: they are large.
    for (number, dead_time) in dead_times(&drive.space).into_iter().enumerate() {
        let members: Vec<usize> = (0..chosen.len()).filter(|m| chosen[*m] == Some(number)).collect();
        if members.is_empty() {
            continue;
        }
        let table = drive.table(dead_time, shared).ok_or(Error::Interrupted)?;
        let fit = |member: usize| checked[members[member]].as_ref().map_or_else(|e| Err(*e), |r| drive.fit(r, &table));
        let found = shared.all(members.len(), true, |member, _| fit(member)).ok_or(Error::Interrupted)?;
        for (m, fit) in members.into_iter().zip(found) {
            fits[m] = fit;
        }
    }
    Ok(fits)
}
