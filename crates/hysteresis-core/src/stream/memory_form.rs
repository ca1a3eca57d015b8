//! A memory in a saved state. Text names its form by a tag beside the other fields. Formats without names of fields cannot have
//! such a tag, so they get the number of the form first.

use alloc::borrow::Cow;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::engine::{BankState, Direction, MemoryState, TurningPointState};

/// Numbers in files: a new form comes last.
#[derive(Serialize, Deserialize)]
enum Numbered<'a> {
    TurningPoints(Cow<'a, TurningPointState>),
    Bank { outputs: Cow<'a, [f64]> },
    BankOnLine { outputs: Cow<'a, [f64]>, direction: Direction },
}

impl<'a> From<&'a MemoryState> for Numbered<'a> {
    fn from(memory: &'a MemoryState) -> Self {
        match memory {
            MemoryState::TurningPoints(state) => Self::TurningPoints(Cow::Borrowed(state)),
            MemoryState::Bank(BankState { outputs, line: None }) => Self::Bank { outputs: Cow::Borrowed(outputs) },
            MemoryState::Bank(BankState { outputs, line: Some(direction) }) => {
                Self::BankOnLine { outputs: Cow::Borrowed(outputs), direction: *direction }
            }
        }
    }
}

impl From<Numbered<'_>> for MemoryState {
    fn from(numbered: Numbered<'_>) -> Self {
        let bank = |outputs: Cow<'_, [f64]>, line| Self::Bank(BankState { outputs: outputs.into_owned().into(), line });
        match numbered {
            Numbered::TurningPoints(state) => Self::TurningPoints(state.into_owned()),
            Numbered::Bank { outputs } => bank(outputs, None),
            Numbered::BankOnLine { outputs, direction } => bank(outputs, Some(direction)),
        }
    }
}

pub(super) fn serialize<S: Serializer>(memory: &MemoryState, serializer: S) -> Result<S::Ok, S::Error> {
    if serializer.is_human_readable() {
        memory.serialize(serializer)
    } else {
        Numbered::from(memory).serialize(serializer)
    }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<MemoryState, D::Error> {
    if deserializer.is_human_readable() {
        MemoryState::deserialize(deserializer)
    } else {
        Numbered::deserialize(deserializer).map(MemoryState::from)
    }
}
