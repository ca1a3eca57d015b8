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
    BankAfterSmallMoves { outputs: Cow<'a, [f64]>, small_moves: u8 },
}

impl<'a> From<&'a MemoryState> for Numbered<'a> {
    fn from(memory: &'a MemoryState) -> Self {
        match memory {
            MemoryState::TurningPoints(state) => Self::TurningPoints(Cow::Borrowed(state)),
            MemoryState::Bank(BankState { outputs, line, small_moves }) => {
                let outputs = Cow::Borrowed(&**outputs);
                match (line, *small_moves) {
                    (Some(direction), _) => Self::BankOnLine { outputs, direction: *direction },
                    (None, 0) => Self::Bank { outputs },
                    (None, small_moves) => Self::BankAfterSmallMoves { outputs, small_moves },
                }
            }
        }
    }
}

impl From<Numbered<'_>> for MemoryState {
    fn from(numbered: Numbered<'_>) -> Self {
        let bank = |outputs: Cow<'_, [f64]>, line, small_moves| {
            Self::Bank(BankState { outputs: outputs.into_owned().into(), line, small_moves })
        };
        match numbered {
            Numbered::TurningPoints(state) => Self::TurningPoints(state.into_owned()),
            Numbered::Bank { outputs } => bank(outputs, None, 0),
            Numbered::BankOnLine { outputs, direction } => bank(outputs, Some(direction), 0),
            Numbered::BankAfterSmallMoves { outputs, small_moves } => bank(outputs, None, small_moves),
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
