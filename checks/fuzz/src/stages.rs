//! Stages that are made once: the one with every part of the C examples, and others that leave parts out of it.

use std::sync::LazyLock;

use hysteresis_control::linear::SecondOrder;
use hysteresis_control::stage::{Stage, StageParts};

/// The sampling interval of everything, in seconds.
pub(crate) const DT: f64 = 1e-4;

/// A stage file with every part.
pub(crate) const EVERY_PART: &str = include_str!("../../../crates/hysteresis-capi/examples/stage.json");

static STAGES: LazyLock<[Stage; 3]> = LazyLock::new(stages);

fn stages() -> [Stage; 3] {
    let whole = Stage::from_json(EVERY_PART).expect("the stage of the C examples is one");
    let parts = whole.parts().clone();
    let model = parts.hysteresis.clone();
    let plain = StageParts { limits: parts.limits, noise: parts.noise, ..StageParts::new(model) };
    let light = SecondOrder::new(400.0, 0.02).expect("a lightly damped mode");
    let light = StageParts { dynamics: light.into(), slew: Some(1e5), ..plain.clone() };
    [whole, Stage::new(plain).expect("a hysteresis alone"), Stage::new(light).expect("a hysteresis and a mode")]
}

/// One of the stages.
pub(crate) fn stage(number: u8) -> &'static Stage {
    &STAGES[usize::from(number) % STAGES.len()]
}
