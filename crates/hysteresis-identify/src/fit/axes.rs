//! The axes of the search beside those of the hysteresis: their bounds and the size of a bold step.

use super::curve::COEFFICIENTS;
use super::intervals::Intervals;
use super::point::{Axis, Parameter};
use crate::creep_model::CreepBasis;
use crate::options::Order;

/// The damping ratios that are searched.
const DAMPINGS: (f64, f64) = (1e-4, 10.0);

/// The highest frequency that is searched, in cycles per sample of the fastest record.
const MAX_CYCLES_PER_SAMPLE: f64 = 0.5;

/// The lowest frequency that is searched, in cycles per longest record.
const MIN_CYCLES_PER_RECORD: f64 = 1.0;

/// Between what the coefficients of a map are searched: slopes from e^-4 to e^4 of the mean one at the ends.
const COEFFICIENT_BOUND: f64 = 2.0;

/// The highest bandwidth of an amplifier that is searched, in cycles per sample of the fastest record: its lag is a twelfth of a
/// sample.
const MAX_BANDWIDTH_CYCLES: f64 = 2.0;

/// The highest frequency of a mode beside the first, in cycles per sample of the fastest record: a faster one is not told from
/// its alias.
pub(super) const MAX_MODE_CYCLES: f64 = 0.45;

/// The lowest, in cycles per longest record: what is slower may be creep.
pub(super) const MIN_MODE_CYCLES: f64 = 10.0;

/// The damping ratios of a mode beside the first: it resonates, else it may stand for any lag.
const MODE_DAMPINGS: (f64, f64) = (1e-4, 0.5);

/// The largest share of a mode in the static gain; neighbours of opposite signs may both exceed 1.
pub(super) const MAX_MODE_GAIN: f64 = 2.0;

/// A mode beside the first, by its number.
pub(super) fn mode(intervals: &Intervals, number: usize) -> [Axis; 3] {
    let axis = |parameter, lower, upper, scale| Axis { parameter, lower, upper, scale };
    let (lowest, highest) = (MIN_MODE_CYCLES / intervals.longest_record(), MAX_MODE_CYCLES / intervals.smallest());
    [
        axis(Parameter::ModeLogFrequency(number), lowest.ln(), highest.ln(), 1.0),
        axis(Parameter::ModeLogDamping(number), MODE_DAMPINGS.0.ln(), MODE_DAMPINGS.1.ln(), 4.0),
        axis(Parameter::ModeGain(number), -MAX_MODE_GAIN, MAX_MODE_GAIN, 1.0),
    ]
}

/// The bandwidth of an amplifier.
pub(super) fn bandwidth(intervals: &Intervals) -> Axis {
    let lower = MIN_CYCLES_PER_RECORD / intervals.longest_record();
    let upper = MAX_BANDWIDTH_CYCLES / intervals.smallest();
    Axis { parameter: Parameter::LogBandwidth, lower: lower.ln(), upper: upper.ln(), scale: 1.0 }
}

/// The coefficients of a map.
pub(super) fn coefficients(parameter: fn(usize) -> Parameter) -> impl Iterator<Item = Axis> {
    let (lower, upper) = (-COEFFICIENT_BOUND, COEFFICIENT_BOUND);
    (0..COEFFICIENTS).map(move |number| Axis { parameter: parameter(number), lower, upper, scale: 1.0 })
}

/// Frequency, damping and amplitudes of creep.
pub(super) fn linear(
    intervals: &Intervals,
    dynamics: Option<Order>,
    creep: &CreepBasis,
    largest_creep: f64,
) -> Vec<Axis> {
    let mut axes = Vec::new();
    if dynamics.is_some() {
        let (lower, upper) =
            (MIN_CYCLES_PER_RECORD / intervals.longest_record(), MAX_CYCLES_PER_SAMPLE / intervals.smallest());
        axes.push(Axis { parameter: Parameter::LogFrequency, lower: lower.ln(), upper: upper.ln(), scale: 1.0 });
    }
    if dynamics == Some(Order::Second) {
        let (lower, upper) = (DAMPINGS.0.ln(), DAMPINGS.1.ln());
        axes.push(Axis { parameter: Parameter::LogDamping, lower, upper, scale: 4.0 });
    }
    let amplitude = |number| Axis { parameter: Parameter::Creep(number), lower: 0.0, upper: largest_creep, scale: 0.1 };
    axes.extend((0..creep.directions.len()).map(amplitude));
    axes
}
