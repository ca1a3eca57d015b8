//! Random controllers of arrays, and what happens to them.

use hysteresis_core::{
    ArrayController, ArrayInverse, ArrayOptions, ArraySample, CompiledModel, CreepTerms, Duhem, Inverse,
    LoopShiftTerms, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, QuasiStatic, QuasiStaticInverse, Ratios,
    RelaxingPlayTerms, SlowGainTerms,
};
use proptest::collection::vec;
use proptest::prelude::*;

pub(crate) const M: usize = 4;
pub(crate) const S: usize = 3;
pub(crate) const DT: f64 = 1e-3;

/// Actuators that differ, and also in the share of their hysteresis.
pub(crate) fn model(i: usize, soft: f64) -> CompiledModel {
    let gain = [4e-3, 6e-3, 5e-3, 8e-3][i % M];
    let weights = [gain, 0.2 * soft * gain, 0.1 * gain, 0.3 * soft * gain];
    let offsets = Offsets { input: 10.0 * [0.0, 1.0, -2.0, 0.5][i % M], output: 0.1 };
    let r = [0.0, 40.0, 120.0, 200.0];
    CompiledModel::new(&ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, offsets).unwrap())
}

/// Stages around them: each has creep, and another one of the other parts.
pub(crate) fn stage(i: usize, soft: f64) -> QuasiStatic {
    let creep = CreepTerms::new(&[0.02, 0.01], &[0.9, 0.99]).unwrap();
    let stage = QuasiStatic::new(&model(i, soft)).with_creep(creep);
    let map = |y: [f64; 3]| PiecewiseLinearMap::new(&[-1.0, 0.0, 2.0], &y).unwrap();
    match i % M {
        0 => stage.with_duhem(Duhem::from_bouc_wen(2e-3, 0.01, 0.9, 0.4).unwrap()),
        1 => stage.with_input_map(map([-1.2, 0.0, 2.0])).with_output_map(map([1.0, 0.0, -1.8])),
        2 => {
            let plays = RelaxingPlayTerms::new(&[0.0, 90.0], 20.0, &[0.8, 0.99], &[vec![1e-4; 2], vec![2e-4; 2]]);
            let shift = LoopShiftTerms::new(0.0, 500.0, [-0.05, 0.02], 0.5, 0.9).unwrap();
            stage.with_loop_shift(shift).with_relaxing_plays(plays.unwrap())
        }
        _ => {
            let gain = SlowGainTerms::new(500.0, -0.03, 0.0, 0.95).unwrap();
            stage.with_slow_gain(gain).with_duhem(Duhem::from_bouc_wen(-1e-3, 0.01, 0.9, 0.4).unwrap())
        }
    }
}

/// What an array may consist of.
pub(crate) trait Actuator: ArrayInverse {
    fn made(i: usize, soft: f64, limits: (f64, f64)) -> Self;
}

impl Actuator for Inverse {
    fn made(i: usize, soft: f64, limits: (f64, f64)) -> Self {
        Self::new(&model(i, soft), Some(limits)).unwrap()
    }
}

impl Actuator for QuasiStaticInverse {
    fn made(i: usize, soft: f64, limits: (f64, f64)) -> Self {
        stage(i, soft).inverse(Some(limits)).unwrap()
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) options: ArrayOptions,
    pub(crate) limits: Vec<(f64, f64)>,
}

impl Setup {
    pub(crate) fn make<P: Actuator>(&self) -> ArrayController<P> {
        let streams = self.limits.iter().enumerate().map(|(i, limits)| P::made(i, 1.0, *limits));
        ArrayController::new(streams.collect(), &self.options).unwrap()
    }
}

#[derive(Clone, Debug)]
pub(crate) enum Event {
    Sample([f64; M], Option<Vec<f64>>, Option<Vec<f64>>),
    Hold,
    Release,
    Stop(f64, f64),
    Model(usize, f64),
    Gains(f64),
    Follow([f64; M]),
    Reset,
    Save,
    Load,
}

pub(crate) fn wild() -> impl Strategy<Value = f64> {
    let bad = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300), Just(-1e99)];
    prop_oneof![30 => -3.0..3.0, 4 => -1e3..1e3, 1 => bad, 1 => Just(0.0)]
}

pub(crate) fn references() -> impl Strategy<Value = [f64; M]> {
    prop_oneof![4 => [-3.0..3.0, -3.0..3.0, -3.0..3.0, -3.0..3.0], 1 => [wild(), wild(), wild(), wild()]]
}

pub(crate) fn sensors(count: usize) -> impl Strategy<Value = Option<Vec<f64>>> {
    prop_oneof![1 => Just(None), 3 => vec(wild(), count).prop_map(Some)]
}

pub(crate) fn sample(sensors_of: usize) -> impl Strategy<Value = Event> {
    let sensor_reference = prop_oneof![3 => Just(None), 1 => vec(-2.0..2.0, sensors_of).prop_map(Some)];
    (references(), sensors(sensors_of), sensor_reference).prop_map(|(r, y, s)| Event::Sample(r, y, s))
}

pub(crate) fn event(sensors_of: usize) -> impl Strategy<Value = Event> {
    prop_oneof![
        30 => sample(sensors_of),
        1 => Just(Event::Hold),
        3 => Just(Event::Release),
        1 => (1e2..1e6, 0.0..1.0).prop_map(|(rate, at)| Event::Stop(rate, at)),
        2 => (0..M, 0.2..3.0).prop_map(|(i, soft)| Event::Model(i, soft)),
        1 => (0.0..500.0).prop_map(Event::Gains),
        1 => [0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0].prop_map(Event::Follow),
        1 => Just(Event::Reset),
        1 => Just(Event::Save),
        1 => Just(Event::Load),
    ]
}

pub(crate) fn pairs() -> impl Strategy<Value = (Vec<(usize, usize)>, Vec<f64>)> {
    prop_oneof![
        1 => Just((vec![], vec![])),
        2 => (0.05..2.0).prop_map(|most| (vec![(0, 1), (1, 2), (2, 3)], vec![most])),
        1 => vec(0.05..2.0, 4).prop_map(|each| (vec![(0, 1), (2, 1), (2, 3), (0, 3)], each)),
    ]
}

pub(crate) fn setup() -> impl Strategy<Value = Setup> {
    let limits = prop_oneof![Just((-500.0, 500.0)), Just((-20.0, 150.0)), Just((30.0, 100.0))];
    let slew = prop_oneof![1 => Just(vec![]), 1 => vec(1e2..1e6, 1), 1 => vec(1e2..1e6, M)];
    let matrix = prop_oneof![Just(None), vec(-1.0..1.0, M * S).prop_map(Some)];
    let gains = (prop_oneof![Just(0.0), 0.0..1500.0], prop_oneof![Just(0.0), 0.0..1000.0]);
    let bumpless_time = prop_oneof![Just(0.0), 1e-3..2e-2];
    (vec(limits, M), slew, matrix, gains, pairs(), bumpless_time).prop_map(
        |(limits, slew, reconstruction, (ki, leak), (neighbours, max_difference), bumpless_time)| {
            let set = ArrayOptions::new(DT);
            let options =
                ArrayOptions { ki, leak, reconstruction, slew, neighbours, max_difference, bumpless_time, ..set };
            Setup { options, limits }
        },
    )
}

pub(crate) fn case() -> impl Strategy<Value = (Setup, Vec<Event>)> {
    setup().prop_flat_map(|setup| {
        let sensors = if setup.options.reconstruction.is_some() { S } else { M };
        (Just(setup), vec(event(sensors), 1..60))
    })
}

pub(crate) fn within(at: f64, (low, high): (f64, f64)) -> f64 {
    low + at * (high - low)
}

pub(crate) fn asked(event: &Event) -> Option<ArraySample<'_>> {
    let Event::Sample(reference, measurement, sensor_reference) = event else { return None };
    let (measurement, sensor_reference) = (measurement.as_deref(), sensor_reference.as_deref());
    Some(ArraySample { reference, measurement, sensor_reference })
}

/// Lets something happen; whether the controller was told of other drives.
pub(crate) fn happen<P: ArrayInverse>(
    controller: &mut ArrayController<P>,
    event: &Event,
    saved: &mut Option<ArrayController<P>>,
) -> bool {
    let limits = controller.limits().to_vec();
    match event {
        Event::Sample(..) => controller.step(&asked(event).unwrap(), &mut [0.0; M]).unwrap(),
        Event::Hold => controller.hold(),
        Event::Release => controller.release(),
        Event::Stop(rate, at) => {
            let rest: Vec<f64> = limits.iter().map(|limits| within(*at, *limits)).collect();
            controller.stop(*rate, &rest).unwrap();
        }
        Event::Model(i, soft) => controller.set_model(*i, &model(*i, *soft)).unwrap(),
        Event::Gains(ki) => controller.set_gains(*ki, 0.5 * ki).unwrap(),
        Event::Follow(at) => {
            let drives: Vec<f64> = at.iter().zip(&limits).map(|(at, limits)| within(*at, *limits)).collect();
            controller.follow(&drives).unwrap();
            return true;
        }
        Event::Reset => controller.reset(),
        Event::Save => *saved = Some(controller.clone()),
        Event::Load => {
            if let Some(saved) = saved {
                // Gains and models are no part of a state.
                let mut other = saved.clone();
                other.set_state(&saved.state()).unwrap();
                *controller = other;
                return true;
            }
        }
    }
    false
}

pub(crate) fn positions<P: ArrayInverse>(controller: &ArrayController<P>) -> Vec<f64> {
    controller.positions().collect()
}

/// All that can be seen, with every bit.
pub(crate) fn shown<P: ArrayInverse>(controller: &ArrayController<P>) -> String {
    format!("{:?}", controller.state())
}

pub(crate) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().copied().map(f64::to_bits).collect()
}
