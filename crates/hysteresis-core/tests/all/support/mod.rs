//! Random models and histories for the laws.

pub(crate) mod array;
pub(crate) mod control;
pub(crate) mod models;
pub(crate) mod past_drives;

use hysteresis_core::{CompiledModel, Forward, Inverse, ModifiedPrandtlIshlinskii, Offsets, Process};
use proptest::collection::vec;
use proptest::prelude::*;

/// Largest threshold of the random models; histories go up to twice as far.
pub(crate) const REACH: f64 = 100.0;

/// A kind of move that a history may make.
fn sample() -> impl Strategy<Value = Move> {
    prop_oneof![
        4 => (-2.0 * REACH..2.0 * REACH).prop_map(Move::To),
        8 => (-8.0..8.0).prop_map(Move::By),
        4 => (-0.05..0.05).prop_map(Move::By),
        2 => Just(Move::By(0.0)),
        1 => Just(Move::To(0.0)),
        1 => Just(Move::To(-0.0)),
        1 => Just(Move::By(f64::MIN_POSITIVE / 4.0)),
        2 => (0..=20_i32).prop_map(|i| Move::To(f64::from(i - 10) * REACH / 10.0)),
    ]
}

#[derive(Clone, Copy, Debug)]
enum Move {
    To(f64),
    By(f64),
}

/// Inputs with jumps, small moves, plateaus, repeats, denormals, both zeros and values that thresholds also have.
pub(crate) fn history(length: usize) -> impl Strategy<Value = Vec<f64>> {
    vec(sample(), 1..=length).prop_map(|moves| {
        let mut x = 0.0;
        let follow = |m: Move| {
            x = match m {
                Move::To(to) => to,
                Move::By(by) => f64::clamp(x + by, -2.0 * REACH, 2.0 * REACH),
            };
            x
        };
        moves.into_iter().map(follow).collect()
    })
}

/// Swings to and fro that grow or decay by steps from large to denormal: what fills a memory with turning points.
pub(crate) fn oscillations() -> impl Strategy<Value = Vec<f64>> {
    let step = prop_oneof![0.0..20.0, 0.0..1e-6, Just(f64::MIN_POSITIVE / 4.0), Just(0.0), Just(REACH / 20.0)];
    let train =
        (-REACH..REACH, 0.0..REACH, step, 1..60_i32, any::<bool>()).prop_map(|(centre, swing, step, n, grow)| {
            let at = |k: i32| centre + f64::max(swing - f64::from(k) * step, 0.0) * f64::from(1 - 2 * (k % 2));
            let swings: Vec<f64> = (0..n).map(at).collect();
            if grow { swings.into_iter().rev().collect() } else { swings }
        });
    vec(train, 1..4).prop_map(|trains| trains.concat())
}

/// The four thresholds of n operators, nested: everything grows, with many ties and zeros.
#[expect(clippy::cast_precision_loss, reason = "there are few operators")]
pub(crate) fn nested_thresholds(n: usize) -> impl Strategy<Value = Vec<[f64; 4]>> {
    let growth = prop_oneof![2 => Just(0.0), 3 => 0.0..1.0, 2 => Just(0.5)];
    vec([growth.clone(), growth.clone(), growth.clone(), growth], n).prop_map(move |steps| {
        let scale = REACH / steps.len() as f64;
        let (mut r, mut ra, mut rb, mut rc) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        let grow = |[dr, dra, drb, drc]: [f64; 4]| {
            (rb, rc) = (rb + scale * drb, rc + scale * drc);
            (r, ra) = ((r + scale * dr).max(rc), (ra + scale * dra).max(rb));
            [r, ra, rb, rc]
        };
        steps.into_iter().map(grow).collect()
    })
}

fn build(weights: &[f64], thresholds: &[[f64; 4]], offsets: Offsets) -> ModifiedPrandtlIshlinskii {
    let column = |j: usize| thresholds.iter().map(|row| row[j]).collect::<Vec<_>>();
    ModifiedPrandtlIshlinskii::new(weights, &column(0), &column(1), &column(2), &column(3), offsets).unwrap()
}

fn offsets() -> impl Strategy<Value = Offsets> {
    prop_oneof![
        Just(Offsets::default()),
        (-20.0..20.0, -50.0..50.0).prop_map(|(input, output)| Offsets { input, output })
    ]
}

/// A model as it is, or with weights of their own for the family below zero, as `weight` draws them.
fn split_or_not<S: Strategy<Value = f64>>(
    model: ModifiedPrandtlIshlinskii,
    identity: S,
    other: S,
) -> impl Strategy<Value = ModifiedPrandtlIshlinskii> {
    let n = model.weights().len();
    (any::<bool>(), any::<bool>(), identity, vec(other, n - 1)).prop_map(move |(split, identity_too, first, rest)| {
        if !split {
            return model.clone();
        }
        let first = if identity_too { first } else { model.weights()[0] };
        let below: Vec<f64> = core::iter::once(first).chain(rest).collect();
        model.clone().with_negative_weights(&below).unwrap()
    })
}

/// The least and the most that the slope of an invertible model can be, all weights but none negative.
pub(crate) fn slopes(model: &ModifiedPrandtlIshlinskii) -> (f64, f64) {
    let (above, below) = (model.weights(), model.weights_negative());
    (above[0].min(below[0]), above.iter().zip(below).map(|(w, v)| w.max(*v)).sum())
}

/// An invertible model of 1 to `operators` operators; the first is the identity.
pub(crate) fn invertible_model(operators: usize) -> impl Strategy<Value = ModifiedPrandtlIshlinskii> {
    (1..=operators, offsets())
        .prop_flat_map(|(n, offsets)| {
            let weights = (0.2..2.0, vec(prop_oneof![Just(0.0), 0.0..1.0], n - 1));
            (weights, nested_thresholds(n - 1)).prop_map(move |((identity, rest), rows)| {
                let weights: Vec<f64> = core::iter::once(identity).chain(rest).collect();
                let rows: Vec<[f64; 4]> = core::iter::once([0.0; 4]).chain(rows).collect();
                build(&weights, &rows, offsets)
            })
        })
        .prop_flat_map(|model| split_or_not(model, (0.2..2.0).boxed(), prop_oneof![Just(0.0), 0.0..1.0].boxed()))
}

/// A model with weights of either sign and no need of an identity, its operators in any order.
pub(crate) fn any_nested_model(operators: usize) -> impl Strategy<Value = ModifiedPrandtlIshlinskii> {
    (1..=operators, offsets())
        .prop_flat_map(|(n, offsets)| {
            let rows = nested_thresholds(n).prop_shuffle();
            (vec(-1.0..1.0, n), rows).prop_map(move |(weights, rows)| build(&weights, &rows, offsets))
        })
        .prop_flat_map(|model| split_or_not(model, -1.0..1.0, -1.0..1.0))
}

/// An invertible model whose thresholds are not nested.
pub(crate) fn unnested_model() -> impl Strategy<Value = ModifiedPrandtlIshlinskii> {
    (0.2..2.0, 0.1..1.0, 0.1..1.0, 1.0..50.0_f64)
        .prop_map(|(w0, w1, w2, r)| {
            // The larger r has the smaller rb: no order nests both.
            build(&[w0, w1, w2], &[[0.0; 4], [r, r, r, 0.0], [2.0 * r, r, 0.5 * r, 0.0]], Offsets::default())
        })
        .prop_flat_map(|model| split_or_not(model, 0.2..2.0, 0.1..1.0))
}

/// Outputs of all operators, at rest.
fn at_rest(model: &ModifiedPrandtlIshlinskii) -> Vec<f64> {
    vec![0.0; model.weights().len()]
}

/// The plain loop over all operators of the model, at rest.
pub(crate) fn bank(model: &ModifiedPrandtlIshlinskii) -> Forward {
    Forward::with_initial(&CompiledModel::new(model), &at_rest(model)).unwrap()
}

/// The inverse of [`bank`].
pub(crate) fn bank_inverse(model: &ModifiedPrandtlIshlinskii, limits: Option<(f64, f64)>) -> Inverse {
    Inverse::with_initial(&CompiledModel::new(model), limits, &at_rest(model)).unwrap()
}

/// Streams by the engine (or as the thresholds want it) and by the bank.
pub(crate) fn forwards(model: &ModifiedPrandtlIshlinskii) -> [Forward; 2] {
    [model.forward(), bank(model)]
}

/// Inverses of [`forwards`].
pub(crate) fn inverses(model: &ModifiedPrandtlIshlinskii, limits: Option<(f64, f64)>) -> [Inverse; 2] {
    [model.inverse(limits).unwrap(), bank_inverse(model, limits)]
}

/// The scale of the model's output over the histories: tolerances are relative to it.
pub(crate) fn output_range(model: &ModifiedPrandtlIshlinskii) -> f64 {
    let sum: f64 = model.weights().iter().zip(model.weights_negative()).map(|(w, v)| w.abs().max(v.abs())).sum();
    sum * 4.0 * REACH + model.offsets().output.abs()
}

/// The output at every input.
pub(crate) fn run(process: &mut impl Process, input: &[f64]) -> Vec<f64> {
    input.iter().map(|x| process.step(*x)).collect()
}
