//! Streams as stages of dsp-process give what they give by themselves.

use dsp_process::{Inplace, Process as Stage, Split};
use hysteresis_core::embedded::{Inverse, Model};
use hysteresis_core::{
    Biquad, CompiledModel, Filter, ModifiedPrandtlIshlinskii, Offsets, Process, QuasiStatic, Ratios,
};

/// 20 operators over 0..475 V: um.
fn actuator() -> ModifiedPrandtlIshlinskii {
    let thresholds: Vec<f64> = (0..20).map(|i| 25.0 * f64::from(i)).collect();
    let weights: Vec<f64> = (0..20).map(|i| 4e-3 / f64::from(1 + i)).collect(); // um/V
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default()).unwrap()
}

/// Sample by sample, in blocks and in place.
fn assert_alike<P: Process + Inplace<f64> + Clone>(stream: &P, samples: &[f64]) {
    let (mut plain, mut stage, mut block, mut inplace) =
        (stream.clone(), stream.clone(), stream.clone(), stream.clone());
    let expected: Vec<u64> = samples.iter().map(|x| plain.step(*x).to_bits()).collect();
    let processed: Vec<u64> = samples.iter().map(|x| stage.process(*x).to_bits()).collect();
    let (mut output, mut changed) = (vec![0.0; samples.len()], samples.to_vec());
    block.block(samples, &mut output);
    inplace.inplace(&mut changed);
    assert_eq!(processed, expected);
    assert_eq!(output.iter().map(|y| y.to_bits()).collect::<Vec<_>>(), expected);
    assert_eq!(changed.iter().map(|y| y.to_bits()).collect::<Vec<_>>(), expected);
}

#[test]
fn a_stage_is_the_stream() {
    let model = actuator();
    let samples = [0.5, 1.5, -2.0, f64::NAN, 0.25, 99.0, 1.0];
    let limits = Some((-500.0, 500.0));
    let stage = QuasiStatic::new(&CompiledModel::new(&model));
    assert_alike(&model.forward(), &samples);
    assert_alike(&model.inverse(limits).unwrap(), &samples);
    assert_alike(&stage.forward(), &samples);
    assert_alike(&stage.inverse(limits).unwrap(), &samples);
    assert_alike(&Inverse::new(Model::<f64, 20>::try_from(&model).unwrap(), limits).unwrap(), &samples);
    assert_alike(&Filter::new(&[Biquad::new([0.1, 0.0, 0.0], [-0.9, 0.0]).unwrap()]).unwrap(), &samples);
}

#[test]
fn stages_are_chained() {
    let model = actuator();
    let limits = Some((-500.0, 500.0));
    let (inverse, forward) = (model.inverse(limits).unwrap(), model.forward());
    let mut chain = (Split::stateful(inverse) * Split::stateful(forward)).minor::<f64>();
    for target in [0.5, 1.5, -2.0, 0.25] {
        assert!((chain.process(target) - target).abs() < 1e-12);
    }
}
