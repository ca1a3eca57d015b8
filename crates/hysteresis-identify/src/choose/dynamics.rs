//! Where the search for dynamics starts: a scan over frequency, damping and dead time behind a known hysteresis.

use hysteresis_control::linear::{Block, Dynamics, FirstOrder, SecondOrder};

use crate::algebra::eight::LANES;
use crate::error::Error;
use crate::fit::filter_lanes::{FilterLanes, Lane, Reading};
use crate::fit::joint::{Attempts, JointFit, JointProblem, PASSES};
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::ProjectedFit;
use crate::fit::response::hysteresis;
use crate::fit::space::Space;
use crate::options::{Options, Setting};
use crate::records::course::Course;
use crate::records::record::Record;
use crate::records::signal::as_f64;
use crate::terms::creep;
use crate::terms::dynamics::{DynamicsModel, LinearPart, Order, SampledPart};
use crate::terms::operators::BLOCK;

/// The ratio of neighbouring frequencies.
const RATIO: f64 = 1.1;

/// The frequencies looked at: from so many cycles per longest record to so many per sample.
const CYCLES_PER_RECORD: f64 = 2.0;
const CYCLES_PER_SAMPLE: f64 = 0.4;
const DAMPINGS: [f64; 4] = [0.02, 0.1, 0.4, 1.0];

/// About so many rows are compared, however long the records.
const ROWS: usize = 6000;

/// What is slower than so many cycles per sample is looked for with means of two samples, of four, and so on: then they
/// are as fine for it as at this frequency. What becomes of the mean is off by (pi f dt)^2 / 6, less than a thousandth.
const CYCLES_PER_MEAN: f64 = 0.02;

/// How many starts there are at most.
const STARTS: usize = 4;

impl JointProblem<'_> {
    /// From the fit of the hysteresis with a dead time alone to the best of everything together.
    ///
    /// The weights stay linear: each operator's output goes through creep, dynamics and dead time before it becomes a
    /// column. Frequency, damping, dead time and creep start from the best minima of a scan behind the hysteresis
    /// found, and are then searched together with ratios and input offset.
    pub(crate) fn search(
        &self,
        plain: &ProjectedFit,
        plain_space: &Space,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let space = Space::new(self.records, self.options)?.with_maps_of(plain_space);
        monitor.forget();
        let starts = starts(self.records, plain, plain_space, &space, monitor)?;
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor)
    }

    /// The best fit with a dead time in place of the dynamics, from a point near by.
    pub(crate) fn without_dynamics(&self, near: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        let options = Options { dynamics: DynamicsModel::None, ..self.options.clone() };
        let space = Space::new(self.records, &options)?.with_maps_of(&near.space);
        let lag = near.space.linear_part(&near.fit.point).lag() - space.linear_part(&near.fit.point).amplifier_lag();
        let dead_time = space.nearest(Parameter::DeadTime, lag);
        let point = near.fit.point.with(Parameter::DeadTime, dead_time);
        self.search_from(space, &point, monitor)
    }

    /// The best fit of critically damped dynamics without a dead time, or behind the known one.
    pub(crate) fn critically_damped(
        &self,
        near: &JointFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let known = match self.options.dead_time {
            Setting::Fixed(dead_time) => dead_time,
            Setting::Fit => 0.0,
        };
        let space =
            near.space.with_one_mode().with_known(Parameter::DeadTime, known).with_known(Parameter::LogDamping, 0.0);
        let lag = near.space.linear_part(&near.fit.point).lag() - known;
        let point = space.critically_damped(&near.fit.point, lag).with(Parameter::DeadTime, known);
        self.search_from(space, &point, monitor)
    }

    /// The fit with the hysteresis of another one, and dynamics that are critically damped in place of its dead time.
    pub(crate) fn at_hysteresis(&self, plain: &JointFit) -> Result<JointFit, Error> {
        let space = Space::new(self.records, self.options)?.with_maps_of(&plain.space);
        self.at(&space, &space.start_at_hysteresis(&plain.fit.point))
    }
}

/// Points with dynamics and creep for a fit of the hysteresis with a dead time alone, the most promising first, and one
/// at least.
///
/// The dead time of that fit is the lag of everything, 2 zeta / w and what is dead time in truth: each frequency and
/// damping is tried with the rest of it, and a few others.
pub(crate) fn starts(
    records: &[Record<'_>],
    plain: &ProjectedFit,
    plain_space: &Space,
    space: &Space,
    monitor: &mut SearchMonitor<'_>,
) -> Result<Vec<Point>, Error> {
    let point = |dead_time: f64| {
        let start = space.start_at_hysteresis(&plain.point).with(Parameter::DeadTime, dead_time);
        (0..space.creep_amplitudes()).fold(start, |point, number| point.with(Parameter::Creep(number), creep::START))
    };
    let lag = plain.point.get(Parameter::DeadTime);
    let known = space.axis(Parameter::DeadTime).is_none().then(|| space.origin().get(Parameter::DeadTime));
    let Some(order) = space.order() else {
        let left = lag - space.linear_part(space.origin()).amplifier_lag();
        return Ok(vec![point(space.nearest(Parameter::DeadTime, left))]);
    };
    let scans = Scans::new(Scan::new(records, plain, plain_space, space), frequencies(space).last());
    let best_of = |frequency: f64| {
        let scan = scans.fine_for(frequency);
        let mut best = (f64::INFINITY, point(0.0));
        let dampings = if order == Order::First { &DAMPINGS[..1] } else { &DAMPINGS[..] };
        let part = |damping: &f64| {
            let dynamics = Some(dynamics(order, frequency, *damping)?);
            Some((*damping, LinearPart { dynamics, ..LinearPart::default() }))
        };
        let (dampings, parts): (Vec<_>, Vec<_>) = dampings.iter().filter_map(part).unzip();
        for (damping, (part, responses)) in dampings.iter().zip(parts.iter().zip(scan.responses(&parts))) {
            for dead_time in dead_times(space, known, lag - part.lag()) {
                let squares = scan.squares(&responses, dead_time);
                if squares < best.0 {
                    let here = point(dead_time)
                        .with(Parameter::LogFrequency, frequency.ln())
                        .with(Parameter::LogDamping, damping.ln());
                    best = (squares, here);
                }
            }
        }
        best
    };
    let pieces = Span { from: 0.0, to: 0.0 }.shared_by(frequencies(space).collect());
    let along = monitor.side_by_side(pieces, |frequency, _, _| Ok(best_of(frequency)))?;
    // A record of a few samples has none of these frequencies.
    Ok(if along.is_empty() { vec![point(known.unwrap_or(lag))] } else { minima(&along) })
}

/// Those that fit better than their neighbours, the best first.
fn minima(along: &[(f64, Point)]) -> Vec<Point> {
    let squares = |place: Option<usize>| place.and_then(|i| along.get(i)).map_or(f64::INFINITY, |one| one.0);
    let is_minimum = |i: &usize| {
        let here = squares(Some(*i));
        here <= squares(i.checked_sub(1)) && here <= squares(Some(i + 1))
    };
    let mut minima: Vec<_> = (0..along.len()).filter(is_minimum).map(|i| along[i]).collect();
    minima.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    minima.truncate(STARTS);
    minima.into_iter().map(|(_, point)| point).collect()
}

fn frequencies(space: &Space) -> impl Iterator<Item = f64> {
    let lowest = CYCLES_PER_RECORD / space.intervals().longest_record();
    let highest = CYCLES_PER_SAMPLE / space.intervals().smallest();
    std::iter::successors(Some(highest), |frequency| Some(frequency / RATIO)).take_while(move |f| *f > lowest)
}

fn dynamics(order: Order, frequency: f64, damping: f64) -> Option<Dynamics> {
    match order {
        Order::First => FirstOrder::new(frequency).map(Dynamics::from).ok(),
        Order::Second => SecondOrder::new(frequency, damping).map(Dynamics::from).ok(),
    }
}

/// The one that is known, or those that may be left of the lag: to half a sample, and a sample either way.
fn dead_times(space: &Space, known: Option<f64>, left: f64) -> Vec<f64> {
    if let Some(known) = known {
        return vec![known];
    }
    let (dt, bounds) = (space.intervals().smallest(), space.axis(Parameter::DeadTime));
    let within = |d: f64| bounds.map_or(d, |axis| d.clamp(axis.lower, axis.upper));
    let mut samples: Vec<f64> =
        [left - dt, left, left + dt, -dt, 0.0, dt].map(|d| (2.0 * within(d) / dt).round() / 2.0).to_vec();
    samples.sort_by(f64::total_cmp);
    samples.dedup();
    samples.into_iter().map(|samples| samples * dt).collect()
}

/// The same scan with the samples themselves, with means of two, of four, and so on.
struct Scans(Vec<Scan>);

impl Scans {
    /// As coarse as this frequency allows.
    fn new(finest: Scan, lowest: Option<f64>) -> Self {
        let mut scans = vec![finest];
        while let Some(coarser) = scans.last().map(Scan::halved).filter(|scan| lowest.is_some_and(|f| scan.shows(f))) {
            scans.push(coarser);
        }
        Self(scans)
    }

    /// The coarsest that is fine enough for a frequency.
    fn fine_for(&self, frequency: f64) -> &Scan {
        let last = self.0.iter().rposition(|scan| scan.shows(frequency));
        &self.0[last.unwrap_or(0)]
    }
}

/// The outputs of the hysteresis, and the rows at which candidates are compared.
struct Scan {
    signals: Vec<Signals>,
}

struct Signals {
    /// The interval of the inputs.
    dt: f64,
    /// The output of the hysteresis, and what it creeps for the unit of all amplitudes; one after the other.
    inputs: Vec<[f64; 2]>,
    /// The times that are compared, counted in inputs, and the output there about its mean.
    rows: Vec<(f64, f64)>,
}

impl Scan {
    fn new(records: &[Record<'_>], plain: &ProjectedFit, plain_space: &Space, space: &Space) -> Self {
        let samples: usize = records.iter().map(Record::fitted_samples).sum();
        let stride = samples.div_ceil(ROWS);
        let operators = plain_space.operators(&plain.point);
        let unit = (0..space.creep_amplitudes()).fold(*space.origin(), |p, i| p.with(Parameter::Creep(i), 1.0));
        let creep = LinearPart { dynamics: None, dead_time: 0.0, ..space.linear_part(&unit) };
        let signals = |(place, record): (usize, &Record<'_>)| {
            let dt = space.intervals().of_record(place);
            let output = hysteresis(&operators, &plain.weights, record.input(), 0.0, dt);
            let mut creep = SampledPart::new(&creep, dt).creep_at(output.first().copied());
            let inputs = output.iter().map(|h| [*h, creep.step(*h) - h]).collect();
            let course = Course::new(record, stride, space.unread_samples());
            let outputs = course.of(record.output());
            let mean = outputs.clone().sum::<f64>() / as_f64(course.len());
            let rows = outputs.enumerate().map(|(row, y)| (as_f64(course.sample(row)), y - mean)).collect();
            Signals { dt, inputs, rows }
        };
        Self { signals: records.iter().enumerate().map(signals).collect() }
    }

    /// The same with the means of each two inputs; what is left of an odd number is held.
    fn halved(&self) -> Self {
        let mean = |pair: &[[f64; 2]]| {
            let ([a, b], [c, d]) = (pair[0], pair[pair.len() - 1]);
            [0.5 * (a + c), 0.5 * (b + d)]
        };
        let halved = |Signals { dt, inputs, rows }: &Signals| Signals {
            dt: 2.0 * dt,
            inputs: inputs.chunks(2).map(mean).collect(),
            rows: rows.iter().map(|(at, y)| (0.5 * at, *y)).collect(),
        };
        Self { signals: self.signals.iter().map(halved).collect() }
    }

    /// Whether the inputs are fine enough for a frequency.
    fn shows(&self, frequency: f64) -> bool {
        self.signals.iter().all(|signals| frequency * signals.dt <= CYCLES_PER_MEAN)
    }

    /// The answers of each of a few dynamics to both signals of every record, without dead time.
    fn responses(&self, parts: &[LinearPart]) -> Vec<Vec<Vec<[f64; 2]>>> {
        let mut responses: Vec<_> = parts.iter().map(|_| Vec::with_capacity(self.signals.len())).collect();
        for signals in &self.signals {
            let sampled: Vec<_> = parts.iter().map(|part| SampledPart::new(part, signals.dt)).collect();
            let lane = |part| Lane { direct: 1.0, amplitudes: &[], part, reading: Reading::Position };
            let lanes: Vec<_> = sampled.iter().flat_map(|part| [lane(part), lane(part)]).collect();
            let mut filters = FilterLanes::new(&[], &lanes);
            let mut inputs = vec![[0.0; LANES]; BLOCK * lanes.len().div_ceil(LANES)];
            let mut answers = inputs.clone();
            let mut of_record: Vec<_> = parts.iter().map(|_| Vec::with_capacity(signals.inputs.len())).collect();
            for block in signals.inputs.chunks(BLOCK) {
                for inputs in inputs.chunks_exact_mut(BLOCK) {
                    for (lanes, [a, b]) in inputs.iter_mut().zip(block) {
                        *lanes = [*a, *b, *a, *b, *a, *b, *a, *b];
                    }
                }
                filters.put_out(block.len(), &inputs, &mut answers);
                for (number, response) in of_record.iter_mut().enumerate() {
                    let (eight, lane) = (2 * number / LANES, 2 * number % LANES);
                    let answers = &answers[eight * BLOCK..][..block.len()];
                    response.extend(answers.iter().map(|lanes| [lanes[lane], lanes[lane + 1]]));
                }
            }
            responses.iter_mut().zip(of_record).for_each(|(all, response)| all.push(response));
        }
        responses
    }

    /// The sum of squares that a gain, an amplitude of creep and an offset for every record leave, neither of the first
    /// two negative.
    fn squares(&self, responses: &[Vec<[f64; 2]>], dead_time: f64) -> f64 {
        let (mut aa, mut ab, mut bb, mut ay, mut by, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (signals, response) in self.signals.iter().zip(responses) {
            let (mut a1, mut b1, mut y1) = (0.0, 0.0, 0.0);
            let [a0, b0] = response[0];
            let earlier = Earlier::new(response, dead_time / signals.dt);
            for (at, y) in &signals.rows {
                let [a, b] = earlier.at(*at);
                let (a, b, y) = (a - a0, b - b0, *y);
                (a1, b1, y1) = (a1 + a, b1 + b, y1 + y);
                (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
                (ay, by, yy) = (ay + a * y, by + b * y, yy + y * y);
            }
            let n = as_f64(signals.rows.len());
            (aa, ab, bb) = (aa - a1 * a1 / n, ab - a1 * b1 / n, bb - b1 * b1 / n);
            (ay, by, yy) = (ay - a1 * y1 / n, by - b1 * y1 / n, yy - y1 * y1 / n);
        }
        let gain_alone = if ay > 0.0 { yy - ay * ay / aa } else { yy };
        let determinant = aa * bb - ab * ab;
        if determinant <= 1e-12 * aa * bb {
            return gain_alone;
        }
        let (gain, creep) = ((ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant);
        if gain > 0.0 && creep > 0.0 { yy - gain * ay - creep * by } else { gain_alone }
    }
}

/// A response so many samples earlier: between its samples straight, held beyond its ends.
struct Earlier<'a> {
    response: &'a [[f64; 2]],
    samples: f64,
}

impl<'a> Earlier<'a> {
    fn new(response: &'a [[f64; 2]], samples: f64) -> Self {
        Self { response, samples }
    }

    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between both ends")]
    fn at(&self, sample: f64) -> [f64; 2] {
        let last = self.response.len() - 1;
        let place = (sample - self.samples).clamp(0.0, as_f64(last));
        let (before, share) = (place.floor() as usize, place.fract());
        let ([a, b], [c, d]) = (self.response[before], self.response[(before + 1).min(last)]);
        [a + share * (c - a), b + share * (d - b)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slow mode answers the means of eight samples as it answers the samples, and a fast one is not asked.
    #[test]
    fn means_tell_what_is_slow() {
        let (dt, dead_time) = (1e-3, 3.3e-3);
        let wave = |period: f64, k: usize| (std::f64::consts::TAU * as_f64(k) / period).sin();
        let inputs: Vec<_> = (0..20_001).map(|k| [wave(5000.0, k) + 0.3 * wave(700.0, k), wave(3000.0, k)]).collect();
        let rows = (0..20_000).step_by(7).map(|k| (as_f64(k), 0.0)).collect();
        let mut scan = Scan { signals: vec![Signals { dt, inputs, rows }] };
        let slow = LinearPart { dynamics: dynamics(Order::Second, 2.0, 0.1), ..LinearPart::default() };
        let mut answers = scan.responses(std::slice::from_ref(&slow)).remove(0);
        let earlier = Earlier::new(&answers[0], dead_time / dt);
        for (at, y) in &mut scan.signals[0].rows {
            let [a, b] = earlier.at(*at);
            *y = a + 0.1 * b;
        }
        let mean = scan.signals[0].rows.iter().map(|(_, y)| y).sum::<f64>() / as_f64(scan.signals[0].rows.len());
        scan.signals[0].rows.iter_mut().for_each(|(_, y)| *y -= mean);
        let all: f64 = scan.signals[0].rows.iter().map(|(_, y)| y * y).sum();
        assert!(scan.squares(&answers, dead_time) < 1e-12 * all);
        let scans = Scans::new(scan, Some(0.1));
        let means = scans.fine_for(2.0);
        assert_eq!((means.signals[0].dt, means.signals[0].inputs.len()), (8.0 * dt, 2501));
        answers = means.responses(std::slice::from_ref(&slow)).remove(0);
        assert!(means.squares(&answers, dead_time) < 1e-5 * all);
        assert_eq!(scans.fine_for(0.4 / dt).signals[0].dt, dt);
    }

    #[test]
    fn earlier_is_straight_between_samples_and_held_beyond_the_ends() {
        let response = [[0.0, 5.0], [1.0, 5.0], [3.0, 7.0]];
        let at = |samples, k| Earlier::new(&response, samples).at(k);
        assert_eq!([at(0.0, 1.0), at(1.0, 2.0), at(-1.0, 1.0)], [response[1], response[1], response[2]]);
        assert_eq!([at(0.25, 2.0), at(-0.75, 1.0), at(1.5, 2.0)], [[2.5, 6.5], [2.5, 6.5], [0.5, 5.0]]);
        assert_eq!([at(2.5, 1.0), at(5.0, 0.0), at(-2.0, 2.0)], [response[0], response[0], response[2]]);
    }
}
