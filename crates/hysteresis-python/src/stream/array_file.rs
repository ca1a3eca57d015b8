//! Files of arrays of actuators: each model once, and which of them each actuator has.

use hysteresis_core::Model;
use serde::{Deserialize, Serialize};
use serde_json::Value;

pub(crate) const SCHEMA: &str = "mpi_hyst/array/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    models: Vec<Value>,
    /// The place of each actuator's model among the models.
    actuators: Vec<usize>,
}

/// The text of a file.
pub(super) fn text(models: &[Model]) -> String {
    let (mut kept, mut texts, mut actuators) = (Vec::<&Model>::new(), Vec::new(), Vec::new());
    for model in models {
        let place = kept.iter().position(|other| *other == model).unwrap_or_else(|| {
            kept.push(model);
            texts.push(serde_json::from_str(&model.to_json()).expect("a model's own file"));
            kept.len() - 1
        });
        actuators.push(place);
    }
    let file = File { schema: SCHEMA.to_owned(), models: texts, actuators };
    serde_json::to_string(&file).expect("numbers and names") + "\n"
}

/// The models of the actuators in a file, or what is wrong with it.
pub(super) fn models(text: &str) -> Result<Vec<Model>, String> {
    let file: File = serde_json::from_str(text).map_err(|error| format!("not a file of an array: {error}"))?;
    if file.schema != SCHEMA {
        return Err(format!("schema: expected {SCHEMA:?}, got {:?}", file.schema));
    }
    let models = file
        .models
        .iter()
        .enumerate()
        .map(|(m, model)| Model::from_json(&model.to_string()).map_err(|error| format!("models[{m}]: {error}")));
    let models = models.collect::<Result<Vec<_>, _>>()?;
    let of = |(m, place): (usize, &usize)| {
        let model = models.get(*place).cloned();
        model.ok_or_else(|| format!("actuators[{m}]: expected a number below {}, got {place}", models.len()))
    };
    file.actuators.iter().enumerate().map(of).collect()
}
