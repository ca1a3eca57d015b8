//! The contents of a functional mock-up unit, with its `modelDescription.xml` of FMI 2.0.

use std::fmt::Write as _;

use hysteresis_control::stage::Stage;

use crate::c_header::{c_name, digest};
use crate::error::Error;
use crate::simulation::{Kind, Quantity, Role, Settings, Simulation, Type, Variable, variables};

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
        let identifier = c_name(name);
        let description = description(stage, &settings, &simulation, [name, &identifier]);
        Ok(Self { identifier, description, settings: settings.to_json(), stage: text })
    }
}

/// Digits in the shape of a GUID. The same contents have the same.
fn guid(digits: &str) -> String {
    let part = |from, to| digits.get(from..to).unwrap_or_default();
    format!("{{{}-{}-{}-{}-{}}}", part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32))
}

/// The description of a unit of this name and identifier.
pub(crate) fn description(
    stage: &Stage,
    settings: &Settings,
    simulation: &Simulation,
    [name, identifier]: [&str; 2],
) -> String {
    let (guid, version) = (&settings.guid, env!("CARGO_PKG_VERSION"));
    let what = match settings.kind {
        Kind::Forward => "The stage: the position that follows a drive",
        Kind::Inverse => "The exact inverse of the hysteresis of the stage: the drive for a target",
        Kind::Controller => "The controller of the stage: the drive for a reference and a measurement",
    };
    let dt = settings.dt;
    let variables = variables(settings.kind);
    let units = units(stage, variables);
    let rows: String =
        (0_u32..).zip(variables).map(|(reference, variable)| scalar(stage, simulation, reference, variable)).collect();
    let outputs = unknowns(variables, |role| role == Role::Output);
    let initial = unknowns(variables, |role| role != Role::Input);
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{guid}" description="{what}, at {dt:?} s" version="{version}" generationTool="mpi_hyst {version}" variableNamingConvention="flat">
  <CoSimulation modelIdentifier="{identifier}" canHandleVariableCommunicationStepSize="false" canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>
  <UnitDefinitions>
{units}  </UnitDefinitions>
  <LogCategories>
    <Category name="logStatusError" description="Why a call failed"/>
  </LogCategories>
  <DefaultExperiment startTime="0.0" stopTime="1.0" stepSize="{dt:?}"/>
  <ModelVariables>
{rows}  </ModelVariables>
  <ModelStructure>
    <Outputs>
{outputs}    </Outputs>
    <InitialUnknowns>
{initial}    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#,
        name = escaped(name),
    )
}

fn scalar(stage: &Stage, simulation: &Simulation, reference: u32, variable: &Variable) -> String {
    let (causality, variability) = match (variable.role, variable.kind()) {
        (Role::Input, _) => ("input", "continuous"),
        (Role::Parameter, _) => ("calculatedParameter", "fixed"),
        (Role::Output, Type::Real) => ("output", "continuous"),
        (Role::Output, _) => ("output", "discrete"),
    };
    let mut attributes = String::new();
    if let Some(unit) = unit(stage, variable.quantity) {
        let _ = write!(attributes, r#" unit="{}""#, escaped(&unit));
    }
    if let (Quantity::Drive, Some((low, high))) = (variable.quantity, stage.parts().limits) {
        let _ = write!(attributes, r#" min="{low:?}" max="{high:?}""#);
    }
    if let (Role::Input, Ok(start)) = (variable.role, simulation.real(reference)) {
        let _ = write!(attributes, r#" start="{start:?}""#);
    }
    let Variable { name, description, .. } = variable;
    let kind = variable.kind();
    format!(
        "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\" \
         variability=\"{variability}\" description=\"{description}\"><{kind:?}{attributes}/></ScalarVariable>\n"
    )
}

/// Those with a role, by their places counted from 1.
fn unknowns(variables: &[Variable], has: impl Fn(Role) -> bool) -> String {
    let mut lines = String::new();
    for (index, _) in (1..).zip(variables).filter(|(_, variable)| has(variable.role)) {
        // Writing to a text has no way to fail.
        let _ = writeln!(lines, "      <Unknown index=\"{index}\"/>");
    }
    lines
}

fn unit(stage: &Stage, quantity: Quantity) -> Option<String> {
    let units = &stage.parts().units;
    Some(match quantity {
        Quantity::Drive => units.drive.clone(),
        Quantity::Position | Quantity::Target | Quantity::Reference | Quantity::Measurement => units.position.clone(),
        Quantity::Kp => format!("{}/{}", units.drive, units.position),
        Quantity::Ki => format!("{}/({}.s)", units.drive, units.position),
        _ => return None,
    })
}

/// The definitions of all units, each once. One that is known says what it is in those of the SI.
fn units(stage: &Stage, variables: &[Variable]) -> String {
    let mut names: Vec<String> = variables.iter().filter_map(|variable| unit(stage, variable.quantity)).collect();
    names.sort();
    names.dedup();
    let definition = |name: String| {
        let shown = escaped(&name);
        match base(&name) {
            Some(base) => format!("    <Unit name=\"{shown}\"><BaseUnit {base}/></Unit>\n"),
            None => format!("    <Unit name=\"{shown}\"/>\n"),
        }
    };
    names.into_iter().map(definition).collect()
}

fn base(name: &str) -> Option<String> {
    const VOLT: &str = r#"kg="1" m="2" s="-3" A="-1""#;
    const METRE: &str = r#"m="1""#;
    let (base, factor) = match name {
        "V" => (VOLT, ""),
        "mV" => (VOLT, "1e-3"),
        "kV" => (VOLT, "1e3"),
        "m" => (METRE, ""),
        "mm" => (METRE, "1e-3"),
        // The micro sign and the Greek letter.
        "um" | "\u{b5}m" | "\u{3bc}m" => (METRE, "1e-6"),
        "nm" => (METRE, "1e-9"),
        "rad" => (r#"rad="1""#, ""),
        "mrad" => (r#"rad="1""#, "1e-3"),
        _ => return None,
    };
    Some(if factor.is_empty() { base.into() } else { format!(r#"{base} factor="{factor}""#) })
}

/// A text in an attribute. Control characters are not allowed there at all.
fn escaped(text: &str) -> String {
    let mut made = String::new();
    for c in text.chars() {
        match c {
            '&' => made.push_str("&amp;"),
            '<' => made.push_str("&lt;"),
            '>' => made.push_str("&gt;"),
            '"' => made.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => made.push(' '),
            c => made.push(c),
        }
    }
    made
}
