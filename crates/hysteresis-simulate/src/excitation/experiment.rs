//! An experiment: all that identification needs to tell a stage, in two records.
//!
//! The small fast signal comes first: at rest it leaves hardly a trace, and what it finds is the stage at rest. Loops
//! and rests are one record, as each record is fitted from rest, without what crept or turned before it.

use core::f64::consts::TAU;
use std::borrow::Cow;

use hysteresis_control::sampling::{Error, check_count, check_finite, check_positive, reserve};

use super::decay::{ExcitationOptions, Moves, Shape};
use crate::signals::{Chirp, Multisine, Phases, Sweep};

/// A stretch of a drive with a purpose of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// What it is, in one or two words.
    pub name: &'static str,
    /// What it tells.
    pub purpose: &'static str,
    /// Its first sample.
    pub start: usize,
    /// The sample behind its last one.
    pub stop: usize,
    /// The lowest and the highest drive.
    pub range: (f64, f64),
    /// The lowest and the highest frequency, in Hz; of loops that of a full stroke at their speed, 0 at rest.
    pub frequencies: (f64, f64),
    /// The fastest step, per second.
    pub max_slew: f64,
}

/// A drive to play and record in one go, at one sampling rate. It starts and ends at the rest drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// `"fast"`, `"loops"`, or `"experiment"` if both are joined.
    pub name: Cow<'static, str>,
    /// Samples per second, in Hz.
    pub rate: f64,
    /// The samples.
    pub drive: Vec<f64>,
    /// What the samples are for: one segment after the other, none left out.
    pub segments: Vec<Segment>,
    /// How many samples come before both limits were reached, for an actuator whose history is unknown: 0 if it never
    /// reaches them.
    pub initialization_samples: usize,
}

/// The drives of an experiment, in the order in which to play them.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// The fast one and the loops.
    pub parts: Vec<Part>,
}

impl Experiment {
    /// One drive: the parts one after the other. All start and end at the same drive.
    ///
    /// # Errors
    /// [`Error`] if their rates differ, or the samples do not fit in memory.
    pub fn joined(self) -> Result<Part, Error> {
        let total: usize = self.parts.iter().map(|part| part.drive.len()).sum();
        let rate = self.parts.last().map_or(0.0, |part| part.rate);
        // Far below 2^53.
        #[expect(clippy::cast_precision_loss, reason = "at most twice 2^27")]
        let drive = reserve("rate", check_count("rate", total as f64)?)?;
        let name = Cow::Borrowed("experiment");
        let mut joined = Part { name, rate, drive, segments: Vec::new(), initialization_samples: 0 };
        for part in self.parts {
            if part.rate.to_bits() != rate.to_bits() {
                let expected = format!("{rate:?} Hz, the rate of the loops, for a drive in one part");
                return Err(Error::domain("fast_rate", expected, part.rate));
            }
            joined.append(part);
        }
        Ok(joined)
    }
}

impl Part {
    fn append(&mut self, part: Self) {
        let before = self.drive.len();
        self.drive.extend(part.drive);
        self.segments.extend(part.segments.into_iter().map(|segment| Segment {
            start: before + segment.start,
            stop: before + segment.stop,
            ..segment
        }));
        if part.initialization_samples > 0 {
            self.initialization_samples = before + part.initialization_samples;
        }
    }
}

/// Cycles of decaying amplitude at the second frequency: five sizes tell rate from amplitude.
const SECOND_CYCLES: u32 = 5;

/// The least ratio of the two frequencies of the loops: less does not tell rate from amplitude.
const APART: f64 = 3.0;

/// Limits, rates and sizes of an experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentOptions {
    /// The lowest value of the drive, in its unit (V).
    pub low: f64,
    /// The highest value of the drive.
    pub high: f64,
    /// The largest speed, in the unit of the drive per second.
    pub slew: f64,
    /// Samples per second of loops and rests, in Hz.
    pub rate: f64,
    /// Samples per second of the fast signal, in Hz.
    pub fast_rate: f64,
    /// The two frequencies of a full stroke, in Hz, the lower one first. Where the slew rate is too low for the second
    /// one, it is what the slew rate allows. The first one is at most a third of the second one.
    pub frequencies: (f64, f64),
    /// How many cycles the reversals take to decay, and again to grow.
    pub cycles: u32,
    /// How the drive goes from one reversal to the next.
    pub shape: Shape,
    /// What the reversals decay to, between the limits.
    pub center: f64,
    /// The rest drive: where every part starts and ends, within the limits.
    pub start: f64,
    /// How long each of the four rests lasts, in seconds.
    pub rest: f64,
    /// The small signal that tells modes and dead time.
    pub fast_signal: FastSignal,
    /// Its largest amplitude, in the unit of the drive. At high frequencies the slew rate may ask for less.
    pub fast_amplitude: f64,
    /// Its highest frequency, in Hz, at most half of `fast_rate`.
    pub fast_frequency: f64,
}

/// The fewest cycles of its highest frequency for as long as the fast signal lasts.
const MIN_FAST_CYCLES: f64 = 8.0;

impl ExperimentOptions {
    /// The defaults: frequencies of 1 and 10 Hz, 20 cycles of triangles about the middle of the limits, rests of 10 s,
    /// at 0 or the limit nearest to it before and after; a chirp of 1 % of half the range up to 0.8 of the Nyquist
    /// frequency, at the rate of the loops.
    #[must_use]
    pub fn new(low: f64, high: f64, slew: f64, rate: f64) -> Self {
        let ExcitationOptions { cycles, shape, center, start, .. } = ExcitationOptions::new(low, high, slew, rate);
        Self {
            low,
            high,
            slew,
            rate,
            fast_rate: rate,
            frequencies: (1.0, 10.0),
            cycles,
            shape,
            center,
            start,
            rest: 10.0,
            fast_signal: FastSignal::Chirp,
            fast_amplitude: 0.005 * (high - low),
            fast_frequency: Self::default_fast_frequency(rate),
        }
    }

    /// 0.8 of the Nyquist frequency: a mode that no record tells makes a loop that is tuned without it oscillate.
    #[must_use]
    pub fn default_fast_frequency(fast_rate: f64) -> f64 {
        0.4 * fast_rate
    }

    /// The drives of the experiment: the fast signal, then loops and rests. Each starts and ends at `start`.
    ///
    /// # Errors
    /// [`Error`] that names the parameter outside its domain.
    ///
    /// ```
    /// use hysteresis_simulate::excitation::ExperimentOptions;
    /// let options = ExperimentOptions { fast_rate: 1e4, ..ExperimentOptions::new(0.0, 150.0, 2000.0, 1e3) };
    /// let [fast, loops] = &options.experiment()?.parts[..] else { unreachable!() };
    /// assert_eq!((fast.rate, loops.rate), (1e4, 1e3));
    /// let names: Vec<_> = loops.segments.iter().map(|segment| segment.name).collect();
    /// assert_eq!(names[1..5], ["settle", "major", "decaying", "growing"]);
    /// assert!(loops.drive.len() < 120_000); // 120 s
    /// # Ok::<(), hysteresis_simulate::signals::Error>(())
    /// ```
    pub fn experiment(&self) -> Result<Experiment, Error> {
        self.check()?;
        Ok(Experiment { parts: vec![self.fast()?, self.loops()?] })
    }

    /// The two frequencies of a full stroke that the slew rate allows, in Hz.
    fn allowed_frequencies(&self) -> (f64, f64) {
        let fastest = self.slew / (2.0 * (self.high - self.low) * self.shape.stretch());
        let second = self.frequencies.1.min(fastest);
        (self.frequencies.0.min(second / APART), second)
    }

    /// The largest speed of full strokes at a frequency.
    fn speed(&self, frequency: f64) -> f64 {
        // The slew rate itself if that is what sets the frequency: the product may be off by a rounding.
        (2.0 * (self.high - self.low) * self.shape.stretch() * frequency).min(self.slew)
    }

    /// Decaying reversals at a frequency.
    pub(super) fn decay(&self, frequency: f64, cycles: u32) -> ExcitationOptions {
        let Self { low, high, rate, shape, center, start, .. } = *self;
        ExcitationOptions { low, high, slew: self.speed(frequency), rate, cycles, shape, center, start }
    }

    fn check(&self) -> Result<(), Error> {
        ExcitationOptions { slew: self.slew, ..self.decay(1.0, self.cycles) }.check_domain()?;
        let (first, second) = self.frequencies;
        if !(0.0 < first && first < second && second.is_finite()) {
            let got = if 0.0 < first && first.is_finite() { second } else { first };
            return Err(Error::domain("frequencies", "two numbers above 0, the lower one first", got));
        }
        let (first, second) = self.allowed_frequencies();
        self.decay(first, self.cycles).check_steps()?;
        self.decay(second, SECOND_CYCLES).check_steps()?;
        if self.rest < 0.0 {
            return Err(Error::domain("rest", "a finite number, 0 or more", self.rest));
        }
        check_finite("rest", self.rest)?;
        check_positive("fast_rate", self.fast_rate)?;
        let least = MIN_FAST_CYCLES / fast_seconds(self.fast_rate);
        if !(least <= self.fast_frequency && self.fast_frequency <= 0.5 * self.fast_rate) {
            let expected = format!("a number from {least:?} to half of `fast_rate`, {:?} Hz", self.fast_rate);
            return Err(Error::domain("fast_frequency", expected, self.fast_frequency));
        }
        let most = 0.5 * (self.high - self.low);
        if !(0.0 < self.fast_amplitude && self.fast_amplitude <= most) {
            let expected = format!("a number above 0, at most half of the range, {most:?}");
            return Err(Error::domain("fast_amplitude", expected, self.fast_amplitude));
        }
        Ok(())
    }
}

/// Full strokes before those that count: the drift of an actuator that begins to cycle slows within a few.
const SETTLING_CYCLES: usize = 3;

/// Full strokes that count. A measured stack was predicted worse from 35 of them than from five: they outweigh the
/// rest.
const MAJOR_CYCLES: usize = 5;

/// Where inner loops and rests lie, as shares of the range.
const LEVELS: [f64; 2] = [0.25, 0.75];

/// The amplitudes of the inner loops about each level, as shares of the range, two cycles of each.
const INNER_AMPLITUDES: [f64; 2] = [0.15, 0.07];

/// Seconds at the rest drive before and after.
const STILL: f64 = 1.0;

impl ExperimentOptions {
    /// The part with loops and rests.
    fn loops(&self) -> Result<Part, Error> {
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
fn still(name: &'static str, purpose: &'static str, seconds: f64) -> Course {
    Course { name, purpose, slew: f64::MAX, frequencies: (0.0, 0.0), legs: vec![Leg::Rest(seconds)] }
}

fn to(reversals: impl IntoIterator<Item = f64>) -> Vec<Leg> {
    reversals.into_iter().map(Leg::To).collect()
}

/// What tells modes and dead time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FastSignal {
    /// A linear sweep from a share of 1 / 200 of the highest frequency. Where the slew rate does not allow the
    /// amplitude, it falls as 1 / f.
    #[default]
    Chirp,
    /// Four periods of all lines up to the highest frequency, with Schroeder phases.
    Multisine,
}

/// The lowest frequency of the chirp as a share of the highest.
const LOWEST: f64 = 1.0 / 200.0;

/// Whole periods of the multisine.
const PERIODS: u32 = 4;

/// Fades that fit a period of it.
const FADES: u32 = 10;

/// Seconds at the rest drive before and after: modes ring down.
const FAST_STILL: f64 = 0.1;

/// Samples of the signal, unless they take less than 2 s or more than 10 s.
const SAMPLES: f64 = 20_000.0;

impl ExperimentOptions {
    /// The part with the fast signal.
    fn fast(&self) -> Result<Part, Error> {
        let (unit, lowest) = self.unit_signal()?;
        let unit = self.eased(unit);
        let amplitude = self.fast_amplitude.min(self.slew / fastest(&unit, self.fast_rate));
        // As near to the rest drive as both swings stay within the limits. Not clamp, for roundings of half the range.
        let middle = self.start.max(self.low + amplitude).min(self.high - amplitude);
        let within = |x: f64| (middle + amplitude * x).clamp(self.low, self.high);
        let signal: Vec<f64> = unit.into_iter().map(within).collect();
        let slew = self.speed(self.allowed_frequencies().1);
        let name = match self.fast_signal {
            FastSignal::Chirp => "chirp",
            FastSignal::Multisine => "multisine",
        };
        let course = |name, purpose, legs| Course { name, purpose, slew, frequencies: (0.0, 0.0), legs };
        let mut courses = vec![still("start", "offset and noise of the sensor", FAST_STILL)];
        if (middle - self.start).abs() > 0.0 {
            courses.push(course("approach", "room for both swings within the limits", vec![Leg::To(middle)]));
        }
        let frequencies = (lowest, self.fast_frequency);
        courses.push(Course { frequencies, ..course(name, "modes and dead time", vec![Leg::Samples(signal)]) });
        courses.push(course("end", "the modes ring down", vec![Leg::To(self.start), Leg::Rest(FAST_STILL)]));
        let sampling = Sampling { parameter: "fast_rate", rate: self.fast_rate, shape: self.shape, start: self.start };
        sampling.part("fast", courses)
    }

    /// A chirp whose frequencies all have the amplitude that the slew rate allows; lines of a multisine all have the
    /// same.
    fn eased(&self, mut unit: Vec<f64>) -> Vec<f64> {
        if self.fast_signal == FastSignal::Chirp {
            let (lowest, seconds) = (LOWEST * self.fast_frequency, fast_seconds(self.fast_rate));
            let step = (self.fast_frequency - lowest) / (seconds * self.fast_rate);
            let mut frequency = lowest;
            for x in &mut unit {
                *x *= (self.slew / (self.fast_amplitude * TAU * frequency)).min(1.0);
                frequency += step;
            }
        }
        unit
    }

    /// The signal about 0 with an amplitude of 1, and its lowest frequency.
    fn unit_signal(&self) -> Result<(Vec<f64>, f64), Error> {
        let rate = self.fast_rate;
        let seconds = fast_seconds(rate);
        check_count("fast_rate", (seconds * rate).round())?;
        match self.fast_signal {
            FastSignal::Chirp => {
                let (start_frequency, stop_frequency) = (LOWEST * self.fast_frequency, self.fast_frequency);
                let (amplitude, center, sweep, taper) = (1.0, 0.0, Sweep::Linear, Chirp::TAPER);
                let chirp = Chirp { amplitude, center, start_frequency, stop_frequency, seconds, rate, sweep, taper };
                Ok((chirp.sample()?, start_frequency))
            }
            FastSignal::Multisine => {
                let period = seconds / f64::from(PERIODS);
                let samples = check_count("fast_rate", (period * rate).round())?;
                // Half of an even number of samples is no line.
                let highest = (self.fast_frequency * period).min(0.5 * f64::from(samples - 1));
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below 2^26")]
                let lines = (1..=highest as u32).collect();
                let (amplitude, center, phases, fade) = (1.0, 0.0, Phases::Schroeder, samples / FADES);
                let multisine = Multisine { amplitude, center, lines, phases, samples, periods: PERIODS, fade };
                Ok((multisine.sample()?, 1.0 / period))
            }
        }
    }
}

/// How long the signal lasts, without the fades of a multisine.
fn fast_seconds(rate: f64) -> f64 {
    (SAMPLES / rate).clamp(2.0, 10.0)
}

/// The fastest change of a signal, per second.
fn fastest(signal: &[f64], rate: f64) -> f64 {
    signal.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max) * rate
}

/// One thing to do.
#[derive(Clone, Debug)]
enum Leg {
    /// Go there.
    To(f64),
    /// Stay, for so many seconds.
    Rest(f64),
    /// These samples, of which the first is where the drive is.
    Samples(Vec<f64>),
}

/// The plan of a segment.
#[derive(Clone, Debug)]
struct Course {
    name: &'static str,
    purpose: &'static str,
    pub(super) slew: f64,
    frequencies: (f64, f64),
    legs: Vec<Leg>,
}

/// What is the same for all segments of a part.
#[derive(Clone, Copy, Debug)]
struct Sampling {
    /// The argument that sets the rate.
    parameter: &'static str,
    pub(super) rate: f64,
    pub(super) shape: Shape,
    start: f64,
}

impl Sampling {
    /// Samples the segments one after the other, from the rest drive on.
    fn part(&self, name: &'static str, courses: Vec<Course>) -> Result<Part, Error> {
        let mut drive = reserve(self.parameter, check_count(self.parameter, self.count(&courses))?)?;
        drive.push(self.start);
        let mut segments = Vec::with_capacity(courses.len());
        let mut begin = 0;
        for course in courses {
            for leg in &course.legs {
                self.extend(&mut drive, course.slew, leg);
            }
            // The way back to the rest drive may be none.
            if drive.len() > begin {
                segments.push(self.segment(&drive, begin, &course));
                begin = drive.len();
            }
        }
        Ok(Part { name: Cow::Borrowed(name), rate: self.rate, drive, segments, initialization_samples: 0 })
    }

    fn moves(&self, slew: f64) -> Moves {
        Moves { slew, rate: self.rate, shape: self.shape }
    }

    /// How many samples the segments take: a whole number, or infinity.
    fn count(&self, courses: &[Course]) -> f64 {
        let (mut samples, mut place) = (1.0, self.start);
        for course in courses {
            for leg in &course.legs {
                match leg {
                    Leg::To(to) => {
                        samples += self.moves(course.slew).steps(place, *to);
                        place = *to;
                    }
                    Leg::Rest(seconds) => samples += (seconds * self.rate).round(),
                    #[expect(clippy::cast_precision_loss, reason = "at most 2^27")]
                    Leg::Samples(signal) => samples += signal.len() as f64,
                }
            }
        }
        samples
    }

    fn extend(&self, drive: &mut Vec<f64>, slew: f64, leg: &Leg) {
        match leg {
            Leg::To(to) => self.moves(slew).extend(drive, *to),
            Leg::Samples(signal) => drive.extend(signal),
            Leg::Rest(seconds) => {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counted before")]
                let count = (seconds * self.rate).round() as usize;
                let here = drive.last().copied().unwrap_or(self.start);
                drive.resize(drive.len() + count, here);
            }
        }
    }

    /// What became of a segment: its samples from `start` to the end of the drive.
    fn segment(&self, drive: &[f64], start: usize, course: &Course) -> Segment {
        let own = &drive[start..];
        let range = own.iter().fold((f64::MAX, f64::MIN), |(low, high), u| (low.min(*u), high.max(*u)));
        // With the step that leads into it.
        let steps = drive[start.saturating_sub(1)..].windows(2);
        let longest = steps.map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let Course { name, purpose, frequencies, .. } = *course;
        Segment { name, purpose, start, stop: drive.len(), range, frequencies, max_slew: longest * self.rate }
    }
}
