//! Loops of all sizes, rests, and loops again at a second frequency.

use hysteresis_control::sampling::Error;

use super::Part;
use super::course::{Course, Leg, Sampling};
use super::options::{ExperimentOptions, SECOND_CYCLES};

/// Full strokes before those that count: the drift of an actuator that begins to cycle slows within a few.
const SETTLING_CYCLES: usize = 3;

/// Full strokes that count. A measured stack was predicted worse from 35 of them than from five: they outweigh the rest.
const MAJOR_CYCLES: usize = 5;

/// Where inner loops and rests lie, as shares of the range.
const LEVELS: [f64; 2] = [0.25, 0.75];

/// The amplitudes of the inner loops about each level, as shares of the range, two cycles of each.
const INNER_AMPLITUDES: [f64; 2] = [0.15, 0.07];

/// Seconds at the rest drive before and after.
const STILL: f64 = 1.0;

impl ExperimentOptions {
    /// The part with loops and rests.
    pub(super) fn loops(&self) -> Result<Part, Error> {
        let (first, second) = self.allowed_frequencies();
        let sampling = Sampling { parameter: "rate", rate: self.rate, shape: self.shape, start: self.start };
        let courses = self.first_loops(first).into_iter().chain([self.rests(second)]).chain(self.second_loops(second));
        let mut part = sampling.part("loops", courses.collect())?;
        // The first full stroke: up, then down.
        let up = part.drive.iter().position(|u| *u >= self.high).unwrap_or(0);
        part.initialization_samples = up + part.drive[up..].iter().position(|u| *u <= self.low).unwrap_or(0);
        Ok(part)
    }

    fn course(&self, name: &'static str, purpose: &'static str, frequency: f64, legs: Vec<Leg>) -> Course {
        Course { name, purpose, slew: self.speed(frequency), frequencies: (frequency, frequency), legs }
    }

    fn first_loops(&self, frequency: f64) -> Vec<Course> {
        let course = |name, purpose, legs| self.course(name, purpose, frequency, legs);
        let mut growing: Vec<f64> = self.decay(frequency, self.cycles).decay().skip(2).collect();
        growing.reverse();
        vec![
            still("start", "offset and noise of the sensor", STILL),
            course("settle", "first stroke from rest; the drift slows", self.strokes(SETTLING_CYCLES)),
            course("major", "full loops: range and outer operators", self.strokes(MAJOR_CYCLES)),
            course("decaying", "loops of all sizes: the weights", self.decaying(frequency, self.cycles)),
            course("growing", "the same sizes on the way back", to(growing.into_iter().chain([self.low, self.high]))),
            course("inner", "small loops about other drives", self.inner()),
        ]
    }

    /// To levels on the way up and on the way down, moving fast, and a rest at each.
    fn rests(&self, frequency: f64) -> Course {
        let levels = LEVELS.map(|share| self.at(share));
        let rest = |level: f64| [Leg::To(level), Leg::Rest(self.rest)];
        let mut legs = to([self.low]);
        legs.extend(levels.into_iter().flat_map(rest));
        legs.push(Leg::To(self.high));
        legs.extend(levels.into_iter().rev().flat_map(rest));
        legs.push(Leg::To(self.low));
        let purpose = "creep, after moves up and after moves down";
        Course { frequencies: (0.0, 0.0), ..self.course("rests", purpose, frequency, legs) }
    }

    fn second_loops(&self, frequency: f64) -> Vec<Course> {
        let course = |name, purpose, legs| self.course(name, purpose, frequency, legs);
        let decaying = self.decaying(frequency, SECOND_CYCLES);
        let home = Course { legs: to([self.start]), ..course("return", "back to the rest drive", Vec::new()) };
        vec![
            course("fast major", "what depends on the rate", self.strokes(MAJOR_CYCLES)),
            course("fast decaying", "tells rate from amplitude", decaying),
            home,
            still("end", "creep back", STILL),
        ]
    }

    fn strokes(&self, cycles: usize) -> Vec<Leg> {
        to((0..cycles).flat_map(|_| [self.high, self.low]))
    }

    fn decaying(&self, frequency: f64, cycles: u32) -> Vec<Leg> {
        to(self.decay(frequency, cycles).decay().chain([self.center]))
    }

    fn inner(&self) -> Vec<Leg> {
        to(LEVELS.into_iter().flat_map(|level| {
            INNER_AMPLITUDES.into_iter().flat_map(move |amplitude| {
                let (up, down) = (self.at(level + amplitude), self.at(level - amplitude));
                [up, down, up, down]
            })
        }))
    }

    /// The drive at a share of the range.
    fn at(&self, share: f64) -> f64 {
        self.low + (self.high - self.low) * share
    }
}

/// A rest at the rest drive.
pub(super) fn still(name: &'static str, purpose: &'static str, seconds: f64) -> Course {
    Course { name, purpose, slew: f64::MAX, frequencies: (0.0, 0.0), legs: vec![Leg::Rest(seconds)] }
}

fn to(reversals: impl IntoIterator<Item = f64>) -> Vec<Leg> {
    reversals.into_iter().map(Leg::To).collect()
}
