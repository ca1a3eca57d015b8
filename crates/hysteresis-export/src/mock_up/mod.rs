//! The contents of a functional mock-up unit, and what runs in it.

mod description;
mod settings;
mod simulation;
mod variables;

use hysteresis_control::stage::Stage;

use crate::digest::digest;
use crate::error::Error;

pub use settings::{Kind, Settings, Source};
pub use simulation::Simulation;

/// What is in the file of a functional mock-up unit besides the shared library.
///
/// ```
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// use hysteresis_export::{Kind, MockUp, Settings};
/// let hysteresis =
///     ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts { limits: Some((0.0, 150.0)), ..StageParts::new(hysteresis) })?;
/// let unit = MockUp::new(&stage, &Settings::new(Kind::Inverse, 1e-4), "x axis")?;
/// assert_eq!(unit.identifier, "x_axis");
/// assert!(unit.description.contains(r#"<Real unit="V" min="0.0" max="150.0"/>"#));
/// # Ok::<(), hysteresis_export::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MockUp {
    /// The name of the shared library in `binaries/<platform>`, without its ending.
    pub identifier: String,
    /// `modelDescription.xml`.
    pub description: String,
    /// `resources/settings.json`.
    pub settings: String,
    /// `resources/stage.json`.
    pub stage: String,
}

impl MockUp {
    /// The unit that runs what `settings` says of a stage. It is made once here, so that it can be made there.
    ///
    /// # Errors
    /// [`Error`] as [`Simulation::new`].
    pub fn new(stage: &Stage, settings: &Settings, name: &str) -> Result<Self, Error> {
        let simulation = Simulation::new(stage, settings)?;
        let text = stage.to_json();
        let plain = Settings { guid: String::new(), ..settings.clone() };
        let guid = guid(&digest(&[env!("CARGO_PKG_VERSION"), "\n", name, "\n", &plain.to_json(), "\n", &text]));
        let settings = Settings { guid, ..plain };
        let identifier = crate::c_name(name);
        let description = description::description(stage, &settings, &simulation, [name, &identifier]);
        Ok(Self { identifier, description, settings: settings.to_json(), stage: text })
    }
}

/// Digits in the shape of a GUID. The same contents have the same.
fn guid(digits: &str) -> String {
    let part = |from, to| digits.get(from..to).unwrap_or_default();
    format!("{{{}-{}-{}-{}-{}}}", part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32))
}
