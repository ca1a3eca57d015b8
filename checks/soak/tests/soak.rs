//! A short run, that a drift is seen, and that the reduced history is all that matters.

use hysteresis_core::{CoupledPlay, Forward, Process, Tracked};
use proptest::collection::vec;
use proptest::prelude::*;
use soak::{Mixed, Random, Reduced, Soak, actuator};

#[test]
fn a_million_samples_leave_no_drift() {
    for operators in [1, 20, 300] {
        let mut soak = Soak::new(&actuator(operators, 1).unwrap(), 1).unwrap();
        for _ in 0..10 {
            soak.run(100_000).unwrap();
        }
    }
}

/// A stream whose output creeps by a part of the range with every sample.
struct Drifting(Forward, f64, f64);

impl Process for Drifting {
    fn step(&mut self, input: f64) -> f64 {
        self.2 += self.1;
        self.0.step(input) + self.2
    }

    fn peek(&self, input: f64) -> f64 {
        self.0.peek(input) + self.2
    }

    fn reset(&mut self) {}
}

#[test]
fn a_drift_is_seen() {
    let model = actuator(20, 1).unwrap();
    // 1e-11 of 8 um in a million samples.
    let mut soak = Soak::with_forward(&model, 1, |compiled| Drifting(Forward::new(compiled), 8e-17, 0.0)).unwrap();
    let failure = soak.run(1_000_000).unwrap_err();
    assert!(failure.difference > soak::TOLERANCE && failure.difference < 2.0 * soak::TOLERANCE, "{failure}");
}

/// Inputs with jumps, small moves, repeats, and many that were there before.
fn history() -> impl Strategy<Value = Vec<f64>> {
    let sample = prop_oneof![
        2 => -100.0..100.0,
        2 => (-10..=10_i32).prop_map(|i| f64::from(10 * i)),
        1 => -1.0..1.0,
    ];
    let decaying = |mut x: Vec<f64>| {
        x.sort_by(|one, other| other.abs().total_cmp(&one.abs()));
        x
    };
    let growing = |mut x: Vec<f64>| {
        x.sort_by(|one, other| one.abs().total_cmp(&other.abs()));
        x
    };
    let any = vec(sample, 1..60);
    let part = prop_oneof![any.clone(), any.clone().prop_map(decaying), any.prop_map(growing)];
    vec(part, 1..4).prop_map(|parts| parts.concat())
}

/// Any coupled play with r >= rc and ra >= rb, zeros and ties included.
fn operator() -> impl Strategy<Value = CoupledPlay> {
    let threshold = || prop_oneof![1 => Just(0.0), 2 => (0..=10_i32).prop_map(|i| f64::from(10 * i)), 4 => 0.0..100.0];
    let ratio = || prop_oneof![Just(0.0), Just(1.0), 0.0..1.0];
    (threshold(), threshold(), ratio(), ratio())
        .prop_map(|(r, ra, rb, rc)| CoupledPlay::new(r, ra, rb * ra, rc * r).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn an_operator_remembers_the_reduced_history(operators in vec(operator(), 8), x in history()) {
        // Exactly, and after every sample: the deletions rest on comparisons alone.
        let mut reduced = Reduced::from_rest(0.0);
        let mut whole: Vec<_> = operators.iter().map(|z| Tracked::new(*z)).collect();
        for x in x {
            reduced.push(x);
            for z in &mut whole {
                let expected = z.step(x);
                let mut fresh = Tracked::new(*z.operator());
                let replayed = reduced.inputs().iter().fold(0.0, |_, x| fresh.step(*x));
                prop_assert_eq!(replayed, expected, "at {}, {:?}, from {:?}", x, z.operator(), reduced.inputs());
            }
        }
    }

    #[test]
    fn a_reduced_history_swings_less_and_less(x in history()) {
        let mut reduced = Reduced::from_rest(0.0);
        for x in x {
            reduced.push(x);
            let swings: Vec<f64> = reduced.inputs().windows(2).map(|pair| pair[1] - pair[0]).collect();
            for pair in swings.windows(2) {
                prop_assert!(pair[0] * pair[1] < 0.0 && pair[0].abs() > pair[1].abs(), "{:?}", reduced.inputs());
            }
        }
    }
}

#[test]
fn a_reduced_history_stays_short() {
    // Of n independent samples about the logarithm of n remain; of a decaying triangle one per reversal.
    let mut random = Random::new(1);
    let mut white = Reduced::from_rest(0.0);
    (0..1_000_000).for_each(|_| white.push(random.signed()));
    assert!(white.longest() < 100, "{}", white.longest());
    let mut decaying = Reduced::from_rest(0.0);
    (0..1000_i32).rev().for_each(|k| decaying.push(f64::from(if k % 2 == 0 { k } else { -k })));
    assert_eq!(decaying.inputs().len(), 1000);
    decaying.push(1000.0);
    assert_eq!(decaying.inputs(), [-999.0, 1000.0]);
}

#[test]
fn the_signal_goes_everywhere() {
    let mut signal = Mixed::new(1);
    let samples: Vec<f64> = (0..1_000_000).map(|_| signal.sample()).collect();
    let count = |what: &dyn Fn(f64) -> bool| samples.iter().filter(|x| what(**x)).count();
    assert!(count(&|x| x.is_nan()) > 5 && count(&|x| x == 1e300) > 5);
    assert!(count(&|x| (1.0..1.31).contains(&x.abs())) > 10_000);
    assert!(count(&|x| (0.9..1.0).contains(&x)) > 10_000 && count(&|x| (0.9..1.0).contains(&-x)) > 10_000);
}
