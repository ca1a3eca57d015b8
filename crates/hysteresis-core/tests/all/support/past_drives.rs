//! A stage without hysteresis whose past drives count, and what holds whatever they do.

use hysteresis_core::{
    CompiledModel, CreepTerms, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Process, QuasiStatic,
};

pub(crate) fn identity() -> QuasiStatic {
    let model = ModifiedPrandtlIshlinskii::from(&PrandtlIshlinskii::new(&[1.0], &[0.0], Offsets::default()).unwrap());
    QuasiStatic::new(&CompiledModel::new(&model))
}

/// What is refused is counted, and changes neither what past drives left nor the creep.
pub(crate) fn assert_refusals_move_nothing(stage: QuasiStatic) {
    let stage = stage.with_creep(CreepTerms::new(&[0.01], &[0.9]).unwrap());
    let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((0.0, 150.0))).unwrap());
    for drive in [20.0, 90.0, 60.0] {
        inverse.step(forward.step(drive));
    }
    let (before, inverse_before) = (forward.state(), inverse.state());
    for bad in [f64::NAN, f64::INFINITY, -1e101] {
        forward.step(bad);
        forward.settle(bad);
        inverse.step(bad);
        inverse.follow_drive(bad);
        inverse.settle(bad);
    }
    assert_eq!((forward.rejected(), inverse.rejected()), (6, 9));
    assert_eq!((forward.state().loop_shift, forward.state().creep), (before.loop_shift, before.creep));
    assert_eq!((inverse.state().loop_shift, inverse.state().creep), (inverse_before.loop_shift, inverse_before.creep));
}
