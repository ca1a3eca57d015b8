//! Stages that are made once: those with every part, and others that leave parts out.

use std::sync::LazyLock;

use hysteresis_control::linear::SecondOrder;
use hysteresis_control::stage::{Stage, StageParts};
use serde_json::{Value, json};

/// The sampling interval of everything, in seconds.
pub(crate) const DT: f64 = 1e-4;

/// The stage of the C examples: a file with every part but a Duhem operator.
const WITHOUT_DUHEM: &str = include_str!("../../../crates/hysteresis-capi/examples/stage.json");

/// Stage files with every part: without a Duhem operator, with one that is added, and with one that is subtracted.
static FILES: LazyLock<[String; 3]> = LazyLock::new(|| {
    // In um per V, beside 0.11 um/V of the plays.
    let added = with_duhem([0.03, 0.02, 0.01], [0.01, 0.02, 0.03]);
    let subtracted = with_duhem([-0.01, -0.02, -0.03], [-0.03, -0.02, -0.01]);
    [WITHOUT_DUHEM.to_owned(), added, subtracted]
});

/// The file with an operator whose f+ and f- are these.
fn with_duhem(rising: [f64; 3], falling: [f64; 3]) -> String {
    let mut file: Value = serde_json::from_str(WITHOUT_DUHEM).expect("the stage of the C examples is JSON");
    file["duhem"] = json!({"knots": [-1.0, 0.5, 2.0], "rising": rising, "falling": falling});
    file.to_string()
}

/// One of the files with every part.
pub(crate) fn every_part(number: u8) -> &'static str {
    &FILES[usize::from(number) % FILES.len()]
}

static STAGES: LazyLock<[Stage; 5]> = LazyLock::new(stages);

fn stages() -> [Stage; 5] {
    let whole = |number| Stage::from_json(every_part(number)).expect("a file with every part is one of a stage");
    let parts = whole(0).parts().clone();
    let plain = StageParts { limits: parts.limits, noise: parts.noise, ..StageParts::new(parts.hysteresis) };
    let light = SecondOrder::new(400.0, 0.02).expect("a lightly damped mode");
    let light = StageParts { dynamics: light.into(), slew: Some(1e5), ..plain.clone() };
    let plain = Stage::new(plain).expect("a hysteresis alone");
    [whole(0), whole(1), whole(2), plain, Stage::new(light).expect("a hysteresis and a mode")]
}

/// One of the stages.
pub(crate) fn stage(number: u8) -> &'static Stage {
    &STAGES[usize::from(number) % STAGES.len()]
}

/// One of the stages with every part.
pub(crate) fn whole(number: u8) -> &'static Stage {
    stage(number % 3)
}

/// The stage that is a hysteresis alone.
pub(crate) fn plain() -> &'static Stage {
    stage(3)
}
