//! A memory in a saved state. Text names its form by a tag beside the other fields. Formats without names of fields cannot have
//! such a tag, so they get the number of the form first.

use alloc::boxed::Box;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::engine::{MemoryState, TurningPointState};

#[derive(Serialize, Deserialize)]
#[serde(remote = "MemoryState")]
enum Numbered {
    TurningPoints(TurningPointState),
    Bank { outputs: Box<[f64]> },
}

pub(super) fn serialize<S: Serializer>(memory: &MemoryState, serializer: S) -> Result<S::Ok, S::Error> {
    if serializer.is_human_readable() { memory.serialize(serializer) } else { Numbered::serialize(memory, serializer) }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<MemoryState, D::Error> {
    if deserializer.is_human_readable() {
        MemoryState::deserialize(deserializer)
    } else {
        Numbered::deserialize(deserializer)
    }
}
