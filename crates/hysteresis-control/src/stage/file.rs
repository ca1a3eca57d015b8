//! A stage as it is saved: in a file, JSON of one schema, refused unless every field is known and valid; and as bytes.

use std::fs::File as Opened;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use hysteresis_core::{CoupledPlay, Duhem, MAX_KNOTS, Model, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{
    Error, ErrorBand, Identified, LoopShift, RelaxingPlays, SlowGain, Stage, StageParts, TemperatureTerm, Units,
};
use crate::json_file::schema_of;
use crate::linear::{Antiresonance, Creep, FirstOrder, LinearDynamics, Modes, SecondOrder, Section, StateSpace};
use crate::oscillator::tables;

/// The schema of a stage file.
pub const SCHEMA: &str = "mpi_hyst/stage/1";

/// No file of a stage or of an array of actuators is longer: what is, a device for example, has no end.
const MAX_BYTES: u64 = 1 << 30;

/// The bytes of a file that anybody may have written.
///
/// # Errors
/// Those of reading; [`ErrorKind::FileTooLarge`] for more than 1 GiB.
///
/// ```
/// use hysteresis_control::stage::read_file;
/// assert_eq!(read_file("no_such_stage.json".as_ref()).unwrap_err().kind(), std::io::ErrorKind::NotFound);
/// ```
pub fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    Opened::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(io::Error::new(ErrorKind::FileTooLarge, "expected a file of at most 1 GiB"));
    }
    Ok(bytes)
}

/// What is saved of a stage, in the order of both.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    units: Units,
    limits: Option<(f64, f64)>,
    slew: Option<f64>,
    dead_time: f64,
    amplifier_bandwidth: Option<f64>,
    input_map: Option<MapFile>,
    hysteresis: Hysteresis,
    /// Not there in files of stages without one; likewise below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    duhem: Option<DuhemFile>,
    output_map: Option<MapFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    loop_shift: Option<LoopShiftFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    relaxing_plays: Option<RelaxingPlaysFile>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    slow_gain: Option<SlowGainFile>,
    creep: Option<CreepFile>,
    dynamics: Vec<AnySection>,
    noise: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    error_band: Option<ErrorBand>,
    identified: Option<Identified>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    temperature: Option<TemperatureTerm>,
}

/// Bytes have no names, so they leave no field out but the schema, for which their header stands.
#[derive(Serialize, Deserialize)]
#[serde(remote = "File")]
struct Whole {
    #[serde(skip)]
    schema: String,
    units: Units,
    limits: Option<(f64, f64)>,
    slew: Option<f64>,
    dead_time: f64,
    amplifier_bandwidth: Option<f64>,
    input_map: Option<MapFile>,
    hysteresis: Hysteresis,
    duhem: Option<DuhemFile>,
    output_map: Option<MapFile>,
    loop_shift: Option<LoopShiftFile>,
    relaxing_plays: Option<RelaxingPlaysFile>,
    slow_gain: Option<SlowGainFile>,
    creep: Option<CreepFile>,
    dynamics: Vec<AnySection>,
    noise: Option<f64>,
    error_band: Option<ErrorBand>,
    identified: Option<Identified>,
    temperature: Option<TemperatureTerm>,
}

/// A stage for memories without files.
#[derive(Serialize, Deserialize)]
pub(crate) struct StageBytes(#[serde(with = "Whole")] File);

/// In a file it is the object of a model file, in bytes its numbers.
#[derive(Serialize)]
#[serde(untagged)]
enum Hysteresis {
    Model(serde_json::Value),
    Operators(Operators),
}

#[derive(Serialize, Deserialize)]
struct Operators {
    weights: Vec<f64>,
    weights_negative: Option<Vec<f64>>,
    /// r, ra, rb, rc of every operator.
    thresholds: Vec<[f64; 4]>,
    offsets: [f64; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    x: Vec<f64>,
    y: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LoopShiftFile {
    center: f64,
    half_range: f64,
    amplitudes: [f64; 2],
    time_constant: f64,
    limit: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DuhemFile {
    knots: Vec<f64>,
    rising: Vec<f64>,
    falling: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RelaxingPlaysFile {
    thresholds: Vec<f64>,
    origin: f64,
    time_constants: Vec<f64>,
    weights: Vec<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SlowGainFile {
    half_range: f64,
    amplitude: f64,
    zero: f64,
    time_constant: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CreepFile {
    amplitudes: Vec<f64>,
    time_constants: Vec<f64>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModeFile {
    frequency: f64,
    damping: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum SectionFile {
    FirstOrder { frequency: f64 },
    SecondOrder { frequency: f64, damping: f64 },
    Antiresonance { zero: ModeFile, pole: ModeFile },
    Modes { gains: Vec<f64>, modes: Vec<ModeFile> },
    StateSpace { a: Vec<Vec<f64>>, b: Vec<f64>, c: Vec<f64>, d: f64 },
}

/// In a file a tag beside the fields of a section names its kind. Bytes have no names, so its number comes first.
struct AnySection(SectionFile);

#[derive(Serialize, Deserialize)]
#[serde(remote = "SectionFile")]
enum Numbered {
    FirstOrder { frequency: f64 },
    SecondOrder { frequency: f64, damping: f64 },
    Antiresonance { zero: ModeFile, pole: ModeFile },
    Modes { gains: Vec<f64>, modes: Vec<ModeFile> },
    StateSpace { a: Vec<Vec<f64>>, b: Vec<f64>, c: Vec<f64>, d: f64 },
}

impl Stage {
    /// The stage as JSON text; every number reads back bit for bit.
    #[must_use]
    pub fn to_json(&self) -> String {
        // What the core writes is JSON.
        let model = serde_json::from_str(&Model::from(self.parts().hysteresis.clone()).to_json()).unwrap_or_default();
        let file = File::new(self.parts(), Hysteresis::Model(model));
        // Serialising plain numbers and strings into memory has no way to fail.
        serde_json::to_string_pretty(&file).unwrap_or_default()
    }

    /// Reads what [`to_json`](Self::to_json) wrote, or a model file: a stage of that hysteresis alone.
    ///
    /// # Errors
    /// [`Error::File`] for a text that is cut off, of another schema, or has a field that is missing or unknown;
    /// otherwise [`Error`] that names the part that no stage may have.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        match schema_of(text).map_err(|error| syntax(&error))?.as_deref() {
            Some(SCHEMA) => serde_json::from_str::<File>(text).map_err(|error| syntax(&error))?.stage(),
            Some(schema) if schema.starts_with("mpi_hyst/model/") => Self::new(StageParts::new(hysteresis(text)?)),
            got => {
                let got = got.map_or("none".to_owned(), |got| format!("{got:?}"));
                Err(Error::File { message: format!("schema: expected {SCHEMA:?}, got {got}") })
            }
        }
    }
}

fn syntax(error: &serde_json::Error) -> Error {
    Error::File { message: error.to_string().replace(['\n', '\r'], " ") }
}

fn hysteresis(text: &str) -> Result<ModifiedPrandtlIshlinskii, Error> {
    match Model::from_json(text) {
        Ok(model) => Ok(model.into()),
        Err(error) => Err(Error::File { message: format!("hysteresis: {error}") }),
    }
}

impl From<&StageParts> for StageBytes {
    fn from(parts: &StageParts) -> Self {
        Self(File::new(parts, Hysteresis::Operators((&parts.hysteresis).into())))
    }
}

impl StageBytes {
    /// The stage, unless a part is one that no stage may have.
    pub(crate) fn stage(self) -> Result<Stage, Error> {
        self.0.stage()
    }
}

impl File {
    fn new(parts: &StageParts, hysteresis: Hysteresis) -> Self {
        Self {
            schema: SCHEMA.into(),
            units: parts.units.clone(),
            limits: parts.limits,
            slew: parts.slew,
            dead_time: parts.dead_time,
            amplifier_bandwidth: parts.amplifier.map(|amplifier| amplifier.frequency()),
            input_map: parts.input_map.as_ref().map(MapFile::from),
            hysteresis,
            duhem: parts.duhem.as_deref().map(DuhemFile::from),
            output_map: parts.output_map.as_ref().map(MapFile::from),
            loop_shift: parts.loop_shift.map(LoopShiftFile::from),
            relaxing_plays: parts.relaxing_plays.as_ref().map(RelaxingPlaysFile::from),
            slow_gain: parts.slow_gain.map(SlowGainFile::from),
            creep: parts.creep.as_ref().map(CreepFile::from),
            dynamics: parts.dynamics.sections().iter().map(|section| AnySection(section.into())).collect(),
            noise: parts.noise,
            error_band: parts.error_band.clone(),
            identified: parts.identified.clone(),
            temperature: parts.temperature,
        }
    }

    fn stage(self) -> Result<Stage, Error> {
        Stage::new(StageParts {
            hysteresis: self.hysteresis.model()?,
            duhem: self.duhem.map(DuhemFile::operator).transpose()?.map(Box::new),
            input_map: self.input_map.map(MapFile::map).transpose()?,
            output_map: self.output_map.map(MapFile::map).transpose()?,
            amplifier: self.amplifier_bandwidth.map(FirstOrder::new).transpose()?,
            loop_shift: self.loop_shift.map(LoopShiftFile::shift).transpose()?,
            relaxing_plays: self.relaxing_plays.map(RelaxingPlaysFile::plays).transpose()?,
            slow_gain: self.slow_gain.map(SlowGainFile::gain).transpose()?,
            creep: self.creep.map(CreepFile::creep).transpose()?,
            dynamics: self.dynamics.into_iter().try_fold(LinearDynamics::none(), |dynamics, section| {
                Ok::<_, Error>(dynamics.then(section.0.section()?))
            })?,
            dead_time: self.dead_time,
            limits: self.limits,
            slew: self.slew,
            noise: self.noise,
            error_band: self.error_band,
            identified: self.identified,
            temperature: self.temperature.map(TemperatureTerm::checked).transpose()?,
            units: self.units,
        })
    }
}

impl<'de> Deserialize<'de> for Hysteresis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            serde_json::Value::deserialize(deserializer).map(Self::Model)
        } else {
            Operators::deserialize(deserializer).map(Self::Operators)
        }
    }
}

impl Hysteresis {
    fn model(self) -> Result<ModifiedPrandtlIshlinskii, Error> {
        match self {
            Self::Model(model) => hysteresis(&model.to_string()),
            Self::Operators(operators) => operators.model(),
        }
    }
}

impl From<&ModifiedPrandtlIshlinskii> for Operators {
    fn from(model: &ModifiedPrandtlIshlinskii) -> Self {
        let numbers = |play: &CoupledPlay| [play.r(), play.ra(), play.rb(), play.rc()];
        Self {
            weights: model.weights().to_vec(),
            weights_negative: model.is_split().then(|| model.weights_negative().to_vec()),
            thresholds: model.operators().iter().map(numbers).collect(),
            offsets: [model.offsets().input, model.offsets().output],
        }
    }
}

impl Operators {
    fn model(self) -> Result<ModifiedPrandtlIshlinskii, Error> {
        let [r, ra, rb, rc] =
            [0, 1, 2, 3].map(|which| self.thresholds.iter().map(|play| play[which]).collect::<Vec<_>>());
        let [input, output] = self.offsets;
        let model = ModifiedPrandtlIshlinskii::new(&self.weights, &r, &ra, &rb, &rc, Offsets { input, output })?;
        match self.weights_negative {
            Some(below) => Ok(model.with_negative_weights(&below)?),
            None => Ok(model),
        }
    }
}

impl Serialize for AnySection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            self.0.serialize(serializer)
        } else {
            Numbered::serialize(&self.0, serializer)
        }
    }
}

impl<'de> Deserialize<'de> for AnySection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let is_file = deserializer.is_human_readable();
        if is_file { SectionFile::deserialize(deserializer) } else { Numbered::deserialize(deserializer) }.map(Self)
    }
}

impl From<&PiecewiseLinearMap> for MapFile {
    fn from(map: &PiecewiseLinearMap) -> Self {
        let (x, y) = map.points().unzip();
        Self { x, y }
    }
}

impl MapFile {
    fn map(self) -> Result<PiecewiseLinearMap, Error> {
        Ok(PiecewiseLinearMap::new(&self.x, &self.y)?)
    }
}

impl From<&Creep> for CreepFile {
    fn from(creep: &Creep) -> Self {
        Self { amplitudes: creep.amplitudes().to_vec(), time_constants: creep.time_constants().to_vec() }
    }
}

impl CreepFile {
    fn creep(self) -> Result<Creep, Error> {
        Ok(Creep::new(&self.amplitudes, &self.time_constants)?)
    }
}

impl From<LoopShift> for LoopShiftFile {
    fn from(shift: LoopShift) -> Self {
        Self {
            center: shift.center(),
            half_range: shift.half_range(),
            amplitudes: shift.amplitudes(),
            time_constant: shift.time_constant(),
            limit: shift.limit(),
        }
    }
}

impl LoopShiftFile {
    fn shift(self) -> Result<LoopShift, Error> {
        Ok(LoopShift::new(self.center, self.half_range, self.amplitudes, self.time_constant, self.limit)?)
    }
}

impl From<&Duhem<MAX_KNOTS>> for DuhemFile {
    fn from(duhem: &Duhem<MAX_KNOTS>) -> Self {
        let [knots, rising, falling] = tables(duhem);
        Self { knots, rising, falling }
    }
}

impl DuhemFile {
    fn operator(self) -> Result<Duhem<MAX_KNOTS>, Error> {
        Ok(Duhem::new(&self.knots, &self.rising, &self.falling)?)
    }
}

impl From<&RelaxingPlays> for RelaxingPlaysFile {
    fn from(plays: &RelaxingPlays) -> Self {
        Self {
            thresholds: plays.thresholds().to_vec(),
            origin: plays.origin(),
            time_constants: plays.time_constants().to_vec(),
            weights: plays.weights().to_vec(),
        }
    }
}

impl RelaxingPlaysFile {
    fn plays(self) -> Result<RelaxingPlays, Error> {
        Ok(RelaxingPlays::new(&self.thresholds, self.origin, &self.time_constants, &self.weights)?)
    }
}

impl From<SlowGain> for SlowGainFile {
    fn from(gain: SlowGain) -> Self {
        Self {
            half_range: gain.half_range(),
            amplitude: gain.amplitude(),
            zero: gain.zero(),
            time_constant: gain.time_constant(),
        }
    }
}

impl SlowGainFile {
    fn gain(self) -> Result<SlowGain, Error> {
        Ok(SlowGain::new(self.half_range, self.amplitude, self.zero, self.time_constant)?)
    }
}

impl From<SecondOrder> for ModeFile {
    fn from(mode: SecondOrder) -> Self {
        Self { frequency: mode.frequency(), damping: mode.damping() }
    }
}

impl ModeFile {
    fn mode(self) -> Result<SecondOrder, Error> {
        Ok(SecondOrder::new(self.frequency, self.damping)?)
    }
}

impl From<&Section> for SectionFile {
    fn from(section: &Section) -> Self {
        match section {
            Section::FirstOrder(lag) => Self::FirstOrder { frequency: lag.frequency() },
            Section::SecondOrder(mode) => Self::SecondOrder { frequency: mode.frequency(), damping: mode.damping() },
            Section::Antiresonance(pair) => Self::Antiresonance { zero: pair.zero().into(), pole: pair.pole().into() },
            Section::Modes(modes) => Self::Modes {
                gains: modes.gains().to_vec(),
                modes: modes.modes().iter().map(|mode| (*mode).into()).collect(),
            },
            Section::StateSpace(matrices) => Self::StateSpace {
                a: matrices.a().row_iter().map(|row| row.iter().copied().collect()).collect(),
                b: matrices.b().as_slice().to_vec(),
                c: matrices.c().as_slice().to_vec(),
                d: matrices.d(),
            },
        }
    }
}

impl SectionFile {
    fn section(self) -> Result<Section, Error> {
        Ok(match self {
            Self::FirstOrder { frequency } => Section::FirstOrder(FirstOrder::new(frequency)?),
            Self::SecondOrder { frequency, damping } => Section::SecondOrder(SecondOrder::new(frequency, damping)?),
            Self::Antiresonance { zero, pole } => {
                Section::Antiresonance(Antiresonance::new(zero.mode()?, pole.mode()?))
            }
            Self::Modes { gains, modes } => {
                let modes = modes.into_iter().map(ModeFile::mode).collect::<Result<Vec<_>, _>>()?;
                Section::Modes(Modes::new(&gains, &modes)?)
            }
            Self::StateSpace { a, b, c, d } => {
                let n = a.len();
                if a.iter().any(|row| row.len() != n) {
                    return Err(Error::File { message: "dynamics: expected a square matrix a".into() });
                }
                let a = DMatrix::from_row_iterator(n, n, a.into_iter().flatten());
                Section::StateSpace(StateSpace::new(a, DVector::from_vec(b), DVector::from_vec(c), d)?)
            }
        })
    }
}
