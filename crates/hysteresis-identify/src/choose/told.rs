//! Which terms the records can tell: what is left open is closed where they cannot.
//!
//! Loops that are all alike tell neither creep nor a loop shift nor a map from the shape of the loops, and they do not
//! tell how their width depends on the rate.

use crate::error::Error;
use crate::judge::loops::tells_speeds;
use crate::options::{Options, Setting};
use crate::records::course::turns;
use crate::records::record::{Intervals, Record};
use crate::records::signal::{SWING, as_f64, bounds_of};
use crate::terms::creep::CreepModel;
use crate::terms::dynamics::{DynamicsModel, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::ModelKind;
use crate::terms::relaxing_plays::RelaxingPlaysModel;
use crate::terms::slow_gain::SlowGainModel;
use crate::terms::weights::WeightLaw;

/// Swings that differ by less than this share of the range are alike.
const ALIKE: f64 = 0.1;

/// How many different swings tell how a loop changes with its amplitude.
const ENOUGH: usize = 3;

/// A drive that stays within this share of the range rests: a monitor of it has noise.
const STILL: f64 = 0.002;

/// A rest lasts so many samples and this share of the record at least. A drive that moves on goes further than
/// [`STILL`] meanwhile.
const SHORTEST_REST: usize = 30;
const SHARE_OF_REST: f64 = 0.005;

/// The share of the record that all rests last together. The tops of sines of any height are at most an eighth.
const RESTS: f64 = 0.2;

/// What the records show beside loops that are all alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Variety {
    /// Loops of several amplitudes.
    pub(crate) amplitudes: bool,
    /// And not in one record in which they only decay or only grow: that does not tell amplitude from time.
    pub(crate) apart_from_time: bool,
    /// The way from rest into the motion, or rests in it: what the position does there is no hysteresis, whatever the
    /// loops are.
    pub(crate) rests: bool,
}

impl Variety {
    pub(crate) fn of(records: &[Record<'_>]) -> Self {
        let (low, high) = bounds_of(records.iter().map(Record::input_bounds));
        let range = high - low;
        let swings: Vec<Vec<f64>> = records.iter().map(|record| swings(record, SWING * range)).collect();
        let alike = ALIKE * range;
        let told = records.len() > 1 || swings.iter().any(|swings| comes_back(swings, alike) >= ENOUGH);
        let amplitudes = classes(&swings.concat(), alike).len() >= ENOUGH;
        let rests = records.iter().any(|record| record.skip() == 0 || rests(record, STILL * range));
        Self { amplitudes, apart_from_time: amplitudes && told, rests }
    }

    /// By which factor of the mean square error on stretches a candidate must be better than a simpler one, besides
    /// what is chance: where all loops are alike, one predicts the other with any weights.
    pub(crate) fn margin(self) -> f64 {
        /// About a third of the error.
        const ALIKE: f64 = 2.0;
        if self.amplitudes { 1.0 } else { ALIKE }
    }
}

impl Options {
    /// The same with nothing left open that the records cannot tell: without a sampling interval, with few samples, or
    /// with loops that are all alike, there are no terms but those that were asked for. Rests tell creep whatever the
    /// loops are.
    pub(crate) fn resolved(&self, records: &[Record<'_>]) -> Result<Self, Error> {
        let (intervals, tells) = (self.intervals(records)?, self.has_enough(records)?);
        let variety = Variety::of(records);
        let creeps = tells && (variety.apart_from_time || variety.rests);
        let creeps = creeps && CreepModel::Slow.basis(intervals.longest_record(), intervals.smallest()).is_ok();
        let mut resolved = self.clone();
        if !tells && self.dynamics == DynamicsModel::Auto {
            resolved.dynamics = DynamicsModel::None;
        }
        if !creeps && self.creep == CreepModel::Auto {
            resolved.creep = if tells { CreepModel::UnderWay } else { CreepModel::None };
        }
        if !(tells && variety.apart_from_time) && self.loop_shift == LoopShiftModel::Auto {
            resolved.loop_shift = LoopShiftModel::None;
        }
        // Conventional plays are for comparison, as they are.
        let bends = tells && self.model == ModelKind::Modified;
        let tires = bends && variety.apart_from_time && SlowGainModel::usual(intervals.longest_record()).is_some();
        if !tires && self.slow_gain == SlowGainModel::Auto {
            resolved.slow_gain = SlowGainModel::None;
        }
        // At one speed a time is a way.
        let relaxes = bends
            && variety.amplitudes
            && tells_speeds(records)
            && RelaxingPlaysModel::Fit.is_told(intervals.longest_record(), intervals.smallest());
        if !relaxes && self.relaxing_plays == RelaxingPlaysModel::Auto {
            resolved.relaxing_plays = RelaxingPlaysModel::None;
        }
        for map in [&mut resolved.input_map, &mut resolved.output_map] {
            if !bends && *map == MapModel::Auto {
                *map = MapModel::None;
            }
        }
        // Where no term is judged by stretches, no more are coupled plays.
        Ok(if resolved.leaves_structure_open() { resolved } else { resolved.with_coupled_plays() })
    }

    /// Whether there are a sampling interval and enough samples for terms beside the operators.
    pub(crate) fn has_enough(&self, records: &[Record<'_>]) -> Result<bool, Error> {
        /// A term is left to cross-validation from so many samples on for each operator.
        const MIN_SAMPLES_PER_OPERATOR: usize = 20;
        let samples: usize = records.iter().map(Record::fitted_samples).sum();
        let is_enough = samples >= MIN_SAMPLES_PER_OPERATOR * self.operators().max(4);
        Ok(self.intervals(records)?.are_seconds() && is_enough)
    }

    /// The same with dynamics, creep and a loop shift that are left open in the model, the last of the usual time
    /// constant.
    pub(crate) fn with_open_terms(&self, intervals: &Intervals) -> Self {
        let mut all = self.clone();
        if self.dynamics == DynamicsModel::Auto {
            all.dynamics = DynamicsModel::Order(Order::Second);
        }
        if self.creep == CreepModel::Auto {
            all.creep = CreepModel::SlowAndFast;
        }
        if self.loop_shift == LoopShiftModel::Auto {
            all.loop_shift = LoopShiftModel::usual(intervals.longest_record(), intervals.smallest());
        }
        all
    }

    /// Whether anything is left to cross-validation once everything was fitted.
    pub(crate) fn leaves_structure_open(&self) -> bool {
        let laws = self.model == ModelKind::Modified || self.operators() > 4;
        (self.weights == WeightLaw::Auto && laws)
            || self.smoothness == Setting::Fit
            || self.creep == CreepModel::Auto
            || self.loop_shift == LoopShiftModel::Auto
            || self.input_map != MapModel::None
            || self.output_map != MapModel::None
            || self.relaxing_plays == RelaxingPlaysModel::Auto
            || self.slow_gain == SlowGainModel::Auto
            || self.leaves_lag_open()
    }
}

/// The distances between successive reversals of the fitted samples.
fn swings(record: &Record<'_>, dead_band: f64) -> Vec<f64> {
    let input = &record.input()[record.skip()..];
    let ends: Vec<f64> = turns(input, dead_band).into_iter().map(|k| input[k]).collect();
    ends.windows(2).map(|ends| (ends[1] - ends[0]).abs()).collect()
}

/// Whether the drive rests for long in the fitted samples of a record. A rest that these begin with does not count:
/// what it came from is unknown.
fn rests(record: &Record<'_>, still: f64) -> bool {
    let input = &record.input()[record.skip()..];
    let all = as_f64(input.len());
    let mut resting = 0;
    let (mut first, mut low, mut high) = (0, input[0], input[0]);
    for k in 1..=input.len() {
        if let Some(u) = input.get(k).filter(|u| high.max(**u) - low.min(**u) <= still) {
            (low, high) = (low.min(*u), high.max(*u));
            continue;
        }
        if first > 0 && k - first >= SHORTEST_REST && as_f64(k - first) >= SHARE_OF_REST * all {
            resting += k - first;
        }
        if let Some(u) = input.get(k) {
            (first, low, high) = (k, *u, *u);
        }
    }
    as_f64(resting) >= RESTS * all
}

/// Swings that differ, in growing order.
fn classes(swings: &[f64], alike: f64) -> Vec<f64> {
    let mut sorted = swings.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut classes: Vec<f64> = Vec::new();
    for swing in sorted {
        if classes.last().is_none_or(|last| swing - last > alike) {
            classes.push(swing);
        }
    }
    classes
}

/// How many different swings come back after others.
fn comes_back(swings: &[f64], alike: f64) -> usize {
    let classes = classes(swings, alike);
    let mut course: Vec<usize> = swings.iter().map(|swing| classes.partition_point(|class| class <= swing)).collect();
    course.dedup();
    (1..=classes.len()).filter(|class| course.iter().filter(|other| *other == class).count() > 1).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_alike_have_no_variety() {
        let sine: Vec<f64> = (0..900_u32).map(|k| (0.07 * f64::from(k)).sin()).collect();
        let fading: Vec<f64> = (0..900_u32).map(|k| (1.0 - f64::from(k) / 1000.0) * sine[k as usize]).collect();
        let record = |input, skip| Record::new(input, &sine, skip).unwrap();
        let of = |records: &[Record<'_>]| Variety::of(records);
        let alike = Variety { amplitudes: false, apart_from_time: false, rests: false };
        assert_eq!(of(&[record(&sine, 100)]), alike);
        assert_eq!(of(&[record(&sine, 0)]), Variety { rests: true, ..alike });
        // Decaying alone: amplitude or time?
        assert_eq!(of(&[record(&fading, 50)]), Variety { amplitudes: true, ..alike });
        let back: Vec<f64> = fading.iter().rev().chain(&fading).copied().take(900).collect();
        let back: Vec<f64> = fading.iter().chain(&back).copied().step_by(2).collect();
        assert_eq!(
            of(&[Record::new(&back, &back, 50).unwrap()]),
            Variety { amplitudes: true, apart_from_time: true, ..alike }
        );
        assert_eq!(
            of(&[record(&sine, 100), record(&fading, 50)]),
            Variety { amplitudes: true, apart_from_time: true, ..alike }
        );
    }

    #[test]
    fn a_drive_that_stays_rests_and_one_that_turns_does_not() {
        // From sample 0 on the way from rest is fitted.
        let rests = |input: &[f64], skip| Variety::of(&[Record::new(input, input, skip).unwrap()]).rests;
        let sine = |heights: f64| -> Vec<f64> {
            (0..9000_u32).map(|k| (1.0 - heights * f64::from(k) / 9000.0) * (0.01 * f64::from(k)).sin()).collect()
        };
        let triangle: Vec<f64> = (0..9000_u32).map(|k| (f64::from(k % 3000) - 1500.0).abs()).collect();
        for moving in [sine(0.0), sine(0.9), triangle.clone()] {
            assert!(!rests(&moving, 1) && rests(&moving, 0));
            // A rest of a monitor with noise.
            let noisy = |k: usize| moving[8999] + 3.0 + 1e-3 * f64::from(u8::from(k.is_multiple_of(2)));
            let resting: Vec<f64> = moving.iter().copied().chain((0..3000).map(noisy)).collect();
            assert!(rests(&resting, 1));
            // What it came from is not known.
            assert!(!rests(&resting, 9500));
            let short: Vec<f64> = moving.iter().copied().chain((0..1000).map(noisy)).collect();
            assert!(!rests(&short, 1));
        }
    }
}
