//! Any bytes as a stage or a saved state in the binary form.

use hysteresis_control::binary::{Binary, Kind, Sampled, pack};
use hysteresis_control::stage::{FeedForwardKind, Stage};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{ControllerOptions, Process, QuasiStaticState};
use serde::ser::{Serialize, SerializeTuple, Serializer};

use crate::stages::{DT, whole};

/// What is read is refused with a message, or else it is written as bytes that read back as the same. A state that an
/// object takes over leaves it with outputs that are finite, and within the limits where there are any.
///
/// The first byte says what it is and of which stage, the others are the content: header and checksum are put around
/// it, as a checksum is what no mutation guesses. With an odd first byte they are not.
///
/// # Panics
/// If not.
pub fn saved_bytes(data: &[u8]) {
    let Some((first, content)) = data.split_first() else {
        return;
    };
    let kinds = [Kind::Stage, Kind::Forward, Kind::Inverse, Kind::Observer, Kind::StageController];
    let (number, kind) = (first / 10, kinds[usize::from(first >> 1) % kinds.len()]);
    let bytes = if first & 1 == 1 { content.to_vec() } else { pack(kind, &Raw(content)) };
    match kind {
        Kind::Forward => forward(whole(number), &bytes),
        Kind::Inverse => inverse(whole(number), &bytes),
        Kind::Observer => observer(whole(number), &bytes),
        Kind::StageController => controller(whole(number), &bytes),
        _ => drop(read::<Stage>(&bytes)),
    }
}

/// Bytes as they are, without their number in front.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

fn read<T: Binary>(bytes: &[u8]) -> Option<T> {
    match T::from_bytes(bytes) {
        Ok(value) => {
            let written = value.to_bytes();
            let again = T::from_bytes(&written).expect("what was written is read");
            assert_eq!(again.to_bytes(), written, "what was read back is the same");
            Some(value)
        }
        Err(error) => {
            assert!(!error.to_string().is_empty(), "an error says what is wrong");
            None
        }
    }
}

fn forward(stage: &Stage, bytes: &[u8]) {
    let Some(Sampled { stream, .. }) = read::<Sampled<_>>(bytes) else {
        return;
    };
    let mut forward = stage.forward(DT).expect("the stage has a forward model");
    if forward.set_state(&stream).is_ok() {
        for drive in [10.0, -20.0, 140.0, 0.0] {
            let position = forward.advance(drive);
            assert!(position.is_finite(), "a position is finite, got {position}");
        }
    }
}

fn inverse(stage: &Stage, bytes: &[u8]) {
    let Some(Sampled { stream, .. }) = read::<Sampled<QuasiStaticState>>(bytes) else {
        return;
    };
    let limits = (-30.0, 150.0);
    let mut inverse = stage.inverse(DT, Some(limits)).expect("the stage has an inverse");
    if inverse.set_state(&stream).is_ok() {
        for target in [1.0, 15.0, -40.0, 40.0, 3.0] {
            let drive = inverse.step(target);
            assert!((limits.0..=limits.1).contains(&drive), "the drive is within the limits, got {drive}");
        }
    }
}

fn observer(stage: &Stage, bytes: &[u8]) {
    let Some(state) = read(bytes) else {
        return;
    };
    let options = ObserverOptions { noise: 0.01, drift: 1.0 };
    let mut observer = Observer::new(stage, DT, &options).expect("the stage has an observer");
    if observer.set_state(&state).is_ok() {
        let position = observer.step(10.0, 1.0);
        assert!(position.is_finite(), "a position is finite, got {position}");
    }
}

fn controller(stage: &Stage, bytes: &[u8]) {
    let Some(state) = read(bytes) else {
        return;
    };
    let limits = (-30.0, 150.0);
    let options = ControllerOptions { slew: Some(1e5), ..ControllerOptions::new(1.0, 1e3, DT, limits) };
    let made = stage.controller(FeedForwardKind::Inverse, &options).expect("the stage has a controller");
    let mut controller = StageController::from(made);
    if controller.set_state(&state).is_ok() {
        for reference in [1.0, 15.0, -40.0, 40.0, 3.0] {
            let drive = controller.step(f64::into(reference), 0.5 * reference);
            assert!((limits.0..=limits.1).contains(&drive), "the drive is within the limits, got {drive}");
        }
    }
}
