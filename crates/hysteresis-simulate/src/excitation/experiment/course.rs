//! The plan of a part, segment by segment, before there are samples, and the samples made from it.

use std::borrow::Cow;

use hysteresis_control::sampling::{Error, check_count, reserve};

use super::super::moves::{Moves, Shape};
use super::{Part, Segment};

/// One thing to do.
#[derive(Clone, Debug)]
pub(super) enum Leg {
    /// Go there.
    To(f64),
    /// Stay, for so many seconds.
    Rest(f64),
    /// These samples, of which the first is where the drive is.
    Samples(Vec<f64>),
}

/// The plan of a segment.
#[derive(Clone, Debug)]
pub(super) struct Course {
    pub(super) name: &'static str,
    pub(super) purpose: &'static str,
    pub(super) slew: f64,
    pub(super) frequencies: (f64, f64),
    pub(super) legs: Vec<Leg>,
}

/// What is the same for all segments of a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampling {
    /// The argument that sets the rate.
    pub(super) parameter: &'static str,
    pub(super) rate: f64,
    pub(super) shape: Shape,
    pub(super) start: f64,
}

impl Sampling {
    /// Samples the segments one after the other, from the rest drive on.
    pub(super) fn part(&self, name: &'static str, courses: Vec<Course>) -> Result<Part, Error> {
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
