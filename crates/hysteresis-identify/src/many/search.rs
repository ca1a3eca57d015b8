//! The fits of all actuators, shared out among threads, and what is reported of each.
//!
//! Of actuators with one drive, what depends on the drive alone is computed once for all of them. What comes out does
//! not depend on how many threads there are.

use std::ops::ControlFlow;
use std::slice;

use crate::choose::found::Found;
use crate::choose::linear_part::untold_dead_time;
use crate::choose::search::{search_hysteresis, with_least_slope};
use crate::error::Error;
use crate::fit::colour::Colour;
use crate::fit::descent::Patience;
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Stop};
use crate::fit::projection::{ProjectedFit, Projection, REFINE_SAMPLES, SCAN_SAMPLES_PER_UNKNOWN};
use crate::fit::response::Chain;
use crate::fit::space::Space;
use crate::identify::model;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::loops::{judged, turned_positions};
use crate::judge::residual::coloured;
use crate::judge::{findings_of_fit, is_poor};
use crate::many::descent::{Problem, Start, State};
use crate::many::normal::Normal;
use crate::many::records::{ActuatorFit, BriefFinding, ManyRecords};
use crate::many::scan::{Candidate, Drive, Factored, Positions, dead_times, points};
use crate::options::Options;
use crate::records::course::Course;
use crate::records::record::Record;
use crate::records::signal::as_f64;
use crate::result::quality::Quality;
use crate::terms::side_columns::Sides;
use crate::terms::weights::WeightBasis;
use crate::threads::{Shared, Underway};
use crate::uncertainty::standard_errors::StandardErrors;

/// The scan looks at about so many samples.
const SCAN_ROWS: usize = 300;

/// How many starts are followed at first, and how many passes over the selected samples their steps may take.
const ROUNDS: [(usize, usize); 3] = [(8, 4), (3, 4), (1, 8)];

/// How many passes the steps may take on the first larger selection, and on any later one.
const LONG: usize = 60;
const SHORT: usize = 15;

/// On n samples an estimate is known to a share of 1/n of the sum of squares: so much of that is worth a pass, which is
/// cheap here.
const WORTH: f64 = 5e-4;

/// With how many points the dead time is looked for.
const DEAD_TIME_POINTS: usize = 5;

/// With more weights than that the tables would be too large to gain anything.
pub(crate) const MOST_WEIGHTS: usize = 64;

/// What actuators of one drive share.
struct SharedDrive<'a> {
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
    fn new(record: &Record<'a>, options: &'a Options) -> Result<Self, Error> {
        let records = slice::from_ref(record);
        let (space, basis) = (Space::new(records, options)?, options.weight_basis(Sides::default()));
        let samples = record.fitted_samples();
        let unknowns = basis.freedom() + 1 + space.axes().len();
        let course = |rows: usize| Course::new(record, (samples / rows).max(1), 0);
        let mut courses = vec![course(SCAN_SAMPLES_PER_UNKNOWN * unknowns)];
        courses.extend(REFINE_SAMPLES.into_iter().filter(|rows| samples / rows > 1).map(course));
        courses.push(course(samples));
        let (input, smoothness, scan) = (record.input(), options.given_smoothness(), course(SCAN_ROWS));
        Ok(Self { input, options, smoothness, space, basis, scan, courses })
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
        settled.report(|turned| Ok(self.search(&self.problem(turned, &projection), table)?.objective))
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
pub(crate) fn fit_sharing(
    records: &ManyRecords<'_>,
    options: &Options,
    shared: &mut Shared<'_>,
) -> Result<Vec<Result<ActuatorFit, Error>>, Error> {
    let checked: Vec<Result<Record<'_>, Error>> = (0..records.actuators()).map(|m| records.record(m)).collect();
    let Some(first) = checked.iter().find_map(|record| record.as_ref().ok()) else {
        return Ok(checked.into_iter().map(|record| record.and(Err(Error::NoRecords))).collect());
    };
    let drive = SharedDrive::new(first, options)?;
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

/// Fits all actuators, each like a single one.
pub(crate) fn fit_each(
    records: &ManyRecords<'_>,
    options: &Options,
    shared: &mut Shared<'_>,
) -> Result<Vec<Result<ActuatorFit, Error>>, Error> {
    let fit = |m: usize, underway: &Underway<'_>| fit_one(&records.record(m)?, options, underway);
    shared.all(records.actuators(), true, fit).ok_or(Error::Interrupted)
}

fn search_one(record: &Record<'_>, options: &Options, underway: &Underway<'_>) -> Result<Found, Error> {
    let mut report =
        |_: &_| if underway.is_stopped() { ControlFlow::Break(Stop::Discard) } else { ControlFlow::Continue(()) };
    search_hysteresis(slice::from_ref(record), options, &mut SearchMonitor::new(&mut report))
}

fn fit_one(record: &Record<'_>, options: &Options, underway: &Underway<'_>) -> Result<ActuatorFit, Error> {
    let found = with_least_slope(slice::from_ref(record), search_one(record, options, underway)?)?;
    let Found { fit: found, options, smoothness, basis, .. } = found;
    let (space, fit) = (&found.space, &found.fit);
    let projection = Projection::new(slice::from_ref(record), space, &basis, smoothness, 1);
    let course = &Course::new(record, 1, 0);
    let problem = Problem { record, space, basis: &basis, course, smoothness, projection: &projection };
    let normal = problem.pass(start(fit))?.normal;
    let settled = Settled { record, options: &options, space, basis: &basis, fit, normal: &normal };
    settled.report(|turned| Ok(search_one(turned, &options, underway)?.fit.fit.squares))
}

fn start(fit: &ProjectedFit) -> Start {
    Start { point: fit.point, unknowns: fit.unknowns.clone(), output_offset: fit.output_offsets[0] }
}

/// A fit, and what it is a fit of.
struct Settled<'a> {
    record: &'a Record<'a>,
    options: &'a Options,
    space: &'a Space,
    basis: &'a WeightBasis,
    fit: &'a ProjectedFit,
    /// The problem about the fit.
    normal: &'a Normal,
}

impl Settled<'_> {
    /// What is reported; `fit_turned` fits the record with the sign of its position turned and says what sum of squares
    /// that leaves.
    fn report(&self, fit_turned: impl FnOnce(&Record<'_>) -> Result<f64, Error>) -> Result<ActuatorFit, Error> {
        let Self { options, space, basis, fit, .. } = *self;
        let (operators, linear) = (space.operators(&fit.point), space.linear_part(&fit.point));
        let chain = Chain::from_rest(operators, fit.weights.clone(), linear, space.intervals().of_record(0));
        let (estimated, deviation) = self.deviation();
        let predicted = self.predicted(&chain);
        let quality = self.quality(&predicted);
        let mut found = self.findings(&chain, &predicted, &estimated, deviation);
        if found.iter().any(|finding| finding.code == FindingCode::WrongSign) {
            let (record, positions) = (self.record, turned_positions(slice::from_ref(self.record)));
            let turned =
                Record::new(record.input(), &positions[0], record.skip()).map_err(|error| error.in_record(0))?;
            let left = (fit_turned(&turned)? / as_f64(quality.samples)).sqrt() / quality.range;
            found = judged(found, quality.nrmse, left);
        }
        Ok(ActuatorFit {
            model: model(options, space, basis, fit, &chain)?,
            ratios: space.ratios(&fit.point),
            dead_time: fit.point.get(Parameter::DeadTime),
            rmse: quality.rmse,
            max_error: quality.max_error,
            range: quality.range,
            noise: deviation,
            findings: found.iter().map(BriefFinding::from).collect(),
        })
    }

    /// The columns that are estimated, the dead time left out, and the standard deviation of a sample.
    fn deviation(&self) -> (Vec<usize>, f64) {
        let unknowns = self.fit.unknowns.len();
        let mut free: Vec<usize> = (0..unknowns).filter(|j| self.fit.unknowns[*j] > 0.0).collect();
        let mut count = free.len() + 1;
        for (k, axis) in self.space.axes().iter().enumerate() {
            if axis.is_inside(&self.fit.point) {
                count += 1;
                if axis.parameter != Parameter::DeadTime {
                    free.push(unknowns + k);
                }
            }
        }
        let rows = self.normal.rows;
        (free, (self.fit.squares / as_f64(rows.saturating_sub(count).max(1))).sqrt())
    }

    fn predicted(&self, chain: &Chain) -> Vec<f64> {
        let offset = self.fit.output_offsets[0];
        chain.response(self.record.input(), chain.dt).iter().map(|y| offset + y).collect()
    }

    fn quality(&self, predicted: &[f64]) -> Quality {
        let (record, fitted) = (self.record, self.record.skip()..);
        Quality::of(&record.output()[fitted.clone()], &predicted[fitted], record.output_range())
    }

    fn findings(&self, chain: &Chain, predicted: &[f64], estimated: &[usize], deviation: f64) -> Vec<Finding> {
        let mut found = findings_of_fit(slice::from_ref(self.record), chain, &self.options.thresholds);
        let place = self.space.axes().iter().position(|axis| axis.parameter == Parameter::DeadTime);
        if let Some(place) = place {
            let dead_time = deviation * self.normal.error_of(self.fit.unknowns.len() + place, estimated);
            let errors = StandardErrors { dead_time, ..StandardErrors::default() };
            found.extend(untold_dead_time(self.space, self.fit, &errors));
        }
        if !is_poor(&found) {
            let left: Vec<f64> = self.record.fitted().map(|k| self.record.output()[k] - predicted[k]).collect();
            let range = self.record.output_range();
            found.extend(coloured(Colour::new(&left, range), range));
        }
        found
    }
}
