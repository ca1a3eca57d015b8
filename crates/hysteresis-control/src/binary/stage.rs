//! A stage as bytes: the fields of its file, all of them, in this order.

use hysteresis_core::{CoupledPlay, ModifiedPrandtlIshlinskii, Offsets};
use serde::{Deserialize, Serialize};

use super::{Binary, Kind, pack, unpack};
use crate::linear::FirstOrder;
use crate::stage::file::{CreepFile, LoopShiftFile, MapFile, ModeFile, SectionFile, dynamics, sections};
use crate::stage::{Error, Identified, Stage, StageParts, Units};

#[derive(Serialize, Deserialize)]
struct Content {
    units: Units,
    limits: Option<(f64, f64)>,
    slew: Option<f64>,
    dead_time: f64,
    amplifier_bandwidth: Option<f64>,
    input_map: Option<MapFile>,
    hysteresis: Hysteresis,
    output_map: Option<MapFile>,
    loop_shift: Option<LoopShiftFile>,
    creep: Option<CreepFile>,
    dynamics: Vec<Section>,
    noise: Option<f64>,
    identified: Option<Identified>,
}

#[derive(Serialize, Deserialize)]
struct Hysteresis {
    weights: Vec<f64>,
    weights_negative: Option<Vec<f64>>,
    /// r, ra, rb, rc of every operator.
    operators: Vec<[f64; 4]>,
    offsets: [f64; 2],
}

#[derive(Serialize, Deserialize)]
struct Section(#[serde(with = "Numbered")] SectionFile);

/// A file names the kind of a section by a tag beside its fields. Bytes have no names, so its number comes first.
#[derive(Serialize, Deserialize)]
#[serde(remote = "SectionFile")]
enum Numbered {
    FirstOrder { frequency: f64 },
    SecondOrder { frequency: f64, damping: f64 },
    Antiresonance { zero: ModeFile, pole: ModeFile },
    Modes { gains: Vec<f64>, modes: Vec<ModeFile> },
    StateSpace { a: Vec<Vec<f64>>, b: Vec<f64>, c: Vec<f64>, d: f64 },
}

impl From<&ModifiedPrandtlIshlinskii> for Hysteresis {
    fn from(model: &ModifiedPrandtlIshlinskii) -> Self {
        let numbers = |play: &CoupledPlay| [play.r(), play.ra(), play.rb(), play.rc()];
        Self {
            weights: model.weights().to_vec(),
            weights_negative: model.is_split().then(|| model.weights_negative().to_vec()),
            operators: model.operators().iter().map(numbers).collect(),
            offsets: [model.offsets().input, model.offsets().output],
        }
    }
}

impl Hysteresis {
    fn model(self) -> Result<ModifiedPrandtlIshlinskii, Error> {
        let [r, ra, rb, rc] =
            [0, 1, 2, 3].map(|which| self.operators.iter().map(|play| play[which]).collect::<Vec<_>>());
        let [input, output] = self.offsets;
        let model = ModifiedPrandtlIshlinskii::new(&self.weights, &r, &ra, &rb, &rc, Offsets { input, output })?;
        match self.weights_negative {
            Some(below) => Ok(model.with_negative_weights(&below)?),
            None => Ok(model),
        }
    }
}

impl From<&StageParts> for Content {
    fn from(parts: &StageParts) -> Self {
        Self {
            units: parts.units.clone(),
            limits: parts.limits,
            slew: parts.slew,
            dead_time: parts.dead_time,
            amplifier_bandwidth: parts.amplifier.map(|amplifier| amplifier.frequency()),
            input_map: parts.input_map.as_ref().map(MapFile::from),
            hysteresis: (&parts.hysteresis).into(),
            output_map: parts.output_map.as_ref().map(MapFile::from),
            loop_shift: parts.loop_shift.map(LoopShiftFile::from),
            creep: parts.creep.as_ref().map(CreepFile::from),
            dynamics: sections(&parts.dynamics).map(Section).collect(),
            noise: parts.noise,
            identified: parts.identified.clone(),
        }
    }
}

impl Content {
    fn parts(self) -> Result<StageParts, Error> {
        Ok(StageParts {
            hysteresis: self.hysteresis.model()?,
            input_map: self.input_map.map(MapFile::map).transpose()?,
            output_map: self.output_map.map(MapFile::map).transpose()?,
            amplifier: self.amplifier_bandwidth.map(FirstOrder::new).transpose()?,
            loop_shift: self.loop_shift.map(LoopShiftFile::shift).transpose()?,
            creep: self.creep.map(CreepFile::creep).transpose()?,
            dynamics: dynamics(self.dynamics.into_iter().map(|section| section.0))?,
            dead_time: self.dead_time,
            limits: self.limits,
            slew: self.slew,
            noise: self.noise,
            identified: self.identified,
            units: self.units,
        })
    }
}

impl Binary for Stage {
    fn to_bytes(&self) -> Vec<u8> {
        pack(Kind::Stage, &Content::from(self.parts()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        Self::new(unpack::<Content>(Kind::Stage, bytes)?.parts()?)
    }
}
