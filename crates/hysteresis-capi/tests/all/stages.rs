//! The stage of the examples, alone and with a Duhem operator beside its plays.

use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_core::Duhem;

/// The files of three stages: without an operator, with one that adds, and with one that is subtracted.
pub(crate) fn files() -> [String; 3] {
    let example = include_str!("../../examples/stage.json");
    let parts = Stage::from_json(example).unwrap().parts().clone();
    let with = |sign: f64| {
        let duhem = Duhem::from_bouc_wen(sign * 0.03, 0.01, 0.7, sign * 0.3).unwrap();
        Stage::new(StageParts { duhem: Some(Box::new(duhem)), ..parts.clone() }).unwrap().to_json()
    };
    [example.to_owned(), with(1.0), with(-1.0)]
}
