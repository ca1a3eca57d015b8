//! Any bytes as a stage file.

use hysteresis_control::stage::{Error, Stage};
use hysteresis_core::Process;
use serde_json::{Value, json};

use crate::bytes::Bytes;
use crate::stages::{DT, every_part};

/// The stage is refused with a message, or else it writes a file that reads back as the same one, and whatever is made
/// from it gives finite outputs, its inverse within the limits.
///
/// Bytes that begin like JSON are the file. Others say which values of a good file become other ones.
///
/// # Panics
/// If not.
pub fn stage_file(data: &[u8]) {
    match data.first() {
        Some(b'{' | b'[' | b' ' | b'\n' | b'"') => str::from_utf8(data).map(check).unwrap_or_default(),
        Some(_) => check(&spoilt(&mut Bytes::new(data)).to_string()),
        None => {}
    }
}

fn check(text: &str) {
    match Stage::from_json(text) {
        Ok(stage) => {
            let written = stage.to_json();
            let again = Stage::from_json(&written).expect("a stage reads what it wrote");
            assert_eq!(again.to_json(), written, "a stage that was read back is the same one");
            // What cannot run at this sampling interval says so.
            let _: Result<(), Error> = run(&stage);
        }
        Err(error) => assert!(!error.to_string().is_empty(), "an error says what is wrong"),
    }
}

fn run(stage: &Stage) -> Result<(), Error> {
    let (low, high) = stage.limits(None)?.unwrap_or((-100.0, 100.0));
    let mut forward = stage.forward(DT)?;
    let mut inverse = stage.inverse(DT, Some((low, high)))?;
    for share in [0.0, 1.0, 0.3, 0.7, -2.0, 5.0, f64::NAN, 0.5, f64::INFINITY, 0.0] {
        let position = forward.step(low + (high - low) * share);
        assert!(position.is_finite(), "the position is finite, got {position}");
        let drive = inverse.step(position);
        assert!((low..=high).contains(&drive), "the drive is within {low} to {high}, got {drive}");
    }
    Ok(())
}

/// A stage with every part, and up to eight of its values changed.
fn spoilt(bytes: &mut Bytes<'_>) -> Value {
    let first = bytes.byte();
    let mut file: Value = serde_json::from_str(every_part(first / 8)).expect("a file with every part is JSON");
    for _ in 0..=first % 8 {
        let number = bytes.byte();
        if let Some(place) = file.pointer_mut(&path(&file, number)) {
            *place = value(bytes, place);
        }
    }
    file
}

/// The way to one of the values, of whatever kind.
fn path(file: &Value, number: u8) -> String {
    let mut paths = Vec::new();
    collect(file, String::new(), &mut paths);
    let index = usize::from(number) % paths.len();
    paths.swap_remove(index)
}

fn collect(value: &Value, path: String, paths: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(name, inner)| collect(inner, format!("{path}/{name}"), paths));
        }
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(i, inner)| collect(inner, format!("{path}/{i}"), paths));
        }
        _ => {}
    }
    paths.push(path);
}

/// What stands in the place of a value: mostly a number near it.
fn value(bytes: &mut Bytes<'_>, old: &Value) -> Value {
    let near = old.as_f64().unwrap_or(1.0);
    match bytes.below(16) {
        0 => Value::Null,
        1 => json!([]),
        2 => json!({}),
        3 => json!(bytes.numbers(1e3)),
        4 => json!(-near),
        5 => json!(10_f64.powf(bytes.number(310.0))),
        6 => json!("\u{1b}[31m"),
        7 => json!({"kind": "second_order", "frequency": bytes.number(1e4), "damping": bytes.number(1.0)}),
        8 => json!({"x": bytes.numbers(200.0), "y": bytes.numbers(200.0)}),
        9 => json!({"amplitudes": bytes.numbers(1.0), "time_constants": bytes.numbers(10.0)}),
        _ => json!(near * (1.0 + bytes.number(1.0))),
    }
}
