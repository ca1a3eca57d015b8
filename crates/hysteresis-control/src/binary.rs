//! Stages and saved states as bytes: for memories without files, and for programs that read no JSON.
//!
//! ```text
//! "mpi_hyst"  8 bytes
//! kind        1 byte   what it is: a `Kind`
//! version     1 byte   of the content, 1
//! length      4 bytes  of the content, little-endian
//! content     postcard, every number bit for bit
//! checksum    4 bytes  CRC-32 of all bytes before, as in zip files, little-endian
//! ```
//!
//! Whatever the bytes are, reading them ends with a value or an [`Error::Bytes`]. It never takes more memory than a
//! multiple of their length.

use crc::{CRC_32_ISO_HDLC, Crc};
use hysteresis_core::{
    Biquad, ControllerState, DriveLimits, FeedForwardState, LoopState, PreviewState, QuasiStaticState,
};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::learning::RepetitiveState;
use crate::observer::ObserverState;
use crate::stage::{Error, Stage, StageBytes, StageState};
use crate::stage_controller::StageControllerState;

const MAGIC: [u8; 8] = *b"mpi_hyst";
const VERSION: u8 = 2;
const HEADER: usize = 14;
const CHECKSUM: usize = 4;
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// What bytes hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A stage.
    Stage = 1,
    /// The state of a forward model of a stage.
    Forward = 2,
    /// The state of an exact inverse of a stage.
    Inverse = 3,
    /// The state of a controller.
    Controller = 4,
    /// The state of an observer.
    Observer = 5,
    /// The state of a controller with observer and learning.
    StageController = 6,
    /// The state of a functional mock-up unit.
    MockUp = 7,
}

impl Kind {
    const ALL: [Self; 7] = [
        Self::Stage,
        Self::Forward,
        Self::Inverse,
        Self::Controller,
        Self::Observer,
        Self::StageController,
        Self::MockUp,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Stage => "a stage",
            Self::Forward => "the state of a forward model",
            Self::Inverse => "the state of an inverse",
            Self::Controller => "the state of a controller",
            Self::Observer => "the state of an observer",
            Self::StageController => "the state of a controller with observer and learning",
            Self::MockUp => "the state of an FMU",
        }
    }
}

/// What can be kept as bytes, and comes back bit for bit.
///
/// ```
/// use hysteresis_control::binary::Binary;
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let hysteresis =
///     ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts { limits: Some((0.0, 150.0)), ..StageParts::new(hysteresis) })?;
/// let bytes = stage.to_bytes();
/// assert_eq!(Stage::from_bytes(&bytes)?, stage);
/// let error = Stage::from_bytes(&bytes[1..]).unwrap_err();
/// assert_eq!(error.to_string(), "bytes: expected a stage as bytes, got bytes that do not begin with \"mpi_hyst\"");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub trait Binary: Sized {
    /// The bytes; the same value always gives the same.
    fn to_bytes(&self) -> Vec<u8>;

    /// What [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// [`Error::Bytes`] for bytes that are cut off, changed, longer, of another kind or of a later version.
    fn from_bytes(bytes: &[u8]) -> Result<Self, Error>;
}

/// A state, and the sampling interval that it belongs to: the `state` of a stream in every language.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampled<T> {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// What the stream remembers.
    pub stream: T,
}

impl<T> Sampled<T> {
    /// The state, if it belongs to this sampling interval.
    ///
    /// # Errors
    /// The interval that it belongs to.
    pub fn at(self, dt: f64) -> Result<T, f64> {
        if self.dt.to_bits() == dt.to_bits() { Ok(self.stream) } else { Err(self.dt) }
    }
}

/// A value as bytes of a kind.
pub fn pack(kind: Kind, content: &impl Serialize) -> Vec<u8> {
    // Serialising plain numbers and strings into memory has no way to fail.
    let content = postcard::to_allocvec(content).unwrap_or_default();
    let mut bytes = Vec::with_capacity(HEADER + content.len() + CHECKSUM);
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&[kind as u8, VERSION]);
    bytes.extend_from_slice(&u32::try_from(content.len()).unwrap_or(u32::MAX).to_le_bytes());
    bytes.extend_from_slice(&content);
    bytes.extend_from_slice(&CRC.checksum(&bytes).to_le_bytes());
    bytes
}

/// The value that [`pack`] made bytes of.
///
/// # Errors
/// [`Error::Bytes`] that says what the bytes are not.
pub fn unpack<T: DeserializeOwned>(kind: Kind, bytes: &[u8]) -> Result<T, Error> {
    let content = content_of(kind, bytes).map_err(|got| refused(kind, got))?;
    match postcard::take_from_bytes(content) {
        Ok((value, [])) => Ok(value),
        Ok((_, rest)) => Err(refused(kind, format!("{} bytes too many", rest.len()))),
        Err(error) => Err(refused(kind, format!("a content that cannot be read: {error}"))),
    }
}

fn refused(kind: Kind, got: String) -> Error {
    Error::Bytes { expected: kind.name(), got }
}

/// The content between header and checksum, or what came instead.
fn content_of(kind: Kind, bytes: &[u8]) -> Result<&[u8], String> {
    let Some(rest) = bytes.strip_prefix(&MAGIC) else {
        return Err("bytes that do not begin with \"mpi_hyst\"".into());
    };
    let cut_off = || format!("{} bytes, which end too early", bytes.len());
    let (&[found, version, a, b, c, d], rest) = rest.split_first_chunk().ok_or_else(cut_off)?;
    if found != kind as u8 {
        let known = Kind::ALL.into_iter().find(|known| *known as u8 == found);
        return Err(known.map_or_else(|| format!("bytes of the unknown kind {found}"), |known| known.name().into()));
    }
    if version != VERSION {
        return Err(format!("version {version} instead of {VERSION}: another release wrote it"));
    }
    let length = usize::try_from(u32::from_le_bytes([a, b, c, d])).unwrap_or(usize::MAX);
    let (content, checksum) = rest.split_at_checked(length).ok_or_else(cut_off)?;
    let checksum: [u8; CHECKSUM] = checksum.try_into().map_err(|_| {
        if checksum.len() < CHECKSUM { cut_off() } else { format!("{} bytes too many", checksum.len() - CHECKSUM) }
    })?;
    let guarded = bytes.get(..HEADER + length).unwrap_or_default();
    if CRC.checksum(guarded) != u32::from_le_bytes(checksum) {
        return Err("bytes that were changed: their checksum differs".into());
    }
    Ok(content)
}

impl Binary for Stage {
    fn to_bytes(&self) -> Vec<u8> {
        pack(Kind::Stage, &StageBytes::from(self.parts()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        unpack::<StageBytes>(Kind::Stage, bytes)?.stage()
    }
}

/// Where the text of a state leaves fields out, its bytes have them all.
#[derive(Serialize, Deserialize)]
#[serde(remote = "ControllerState")]
struct WholeController {
    kp: f64,
    ki: f64,
    dt: f64,
    filters: Vec<Biquad>,
    limits: DriveLimits,
    feedback_loop: LoopState,
    feedforward: Option<FeedForwardState>,
    preview: Option<PreviewState>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "StageControllerState")]
struct WholeStageController {
    #[serde(with = "WholeController")]
    controller: ControllerState,
    observer: Option<ObserverState>,
    repetitive: Option<RepetitiveState>,
    rest_samples: u32,
}

#[derive(Serialize, Deserialize)]
struct OfController(#[serde(with = "WholeController")] ControllerState);

#[derive(Serialize, Deserialize)]
struct OfStageController(#[serde(with = "WholeStageController")] StageControllerState);

impl Binary for ControllerState {
    fn to_bytes(&self) -> Vec<u8> {
        pack(Kind::Controller, &OfController(self.clone()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        unpack(Kind::Controller, bytes).map(|OfController(state)| state)
    }
}

impl Binary for StageControllerState {
    fn to_bytes(&self) -> Vec<u8> {
        pack(Kind::StageController, &OfStageController(self.clone()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        unpack(Kind::StageController, bytes).map(|OfStageController(state)| state)
    }
}

/// States whose bytes have the fields of their text.
macro_rules! plain {
    ($($state:ty: $kind:ident),*) => {$(
        impl Binary for $state {
            fn to_bytes(&self) -> Vec<u8> {
                pack(Kind::$kind, self)
            }

            fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
                unpack(Kind::$kind, bytes)
            }
        }
    )*};
}

plain!(Sampled<StageState>: Forward, Sampled<QuasiStaticState>: Inverse, ObserverState: Observer);
