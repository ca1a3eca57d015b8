//! The variables of a unit: one table for its description and for what runs. The reference of a variable is its place.

use super::settings::Kind;

/// What a variable tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Drive,
    Position,
    Target,
    Reference,
    Measurement,
    Kp,
    Ki,
    Saturated,
    Slewing,
    Rejected,
    Clamped,
    Missing,
    Implausible,
    SaturatedSamples,
    SlewingSamples,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Input,
    Output,
    Parameter,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Real,
    Integer,
    Boolean,
}

pub(crate) struct Variable {
    pub(crate) quantity: Quantity,
    pub(crate) role: Role,
    pub(crate) name: &'static str,
    pub(crate) description: &'static str,
}

impl Variable {
    pub(crate) fn kind(&self) -> Type {
        use Quantity::{Clamped, Implausible, Missing, Rejected, Saturated, SaturatedSamples, Slewing, SlewingSamples};
        match self.quantity {
            Saturated | Slewing => Type::Boolean,
            Rejected | Clamped | Missing | Implausible | SaturatedSamples | SlewingSamples => Type::Integer,
            _ => Type::Real,
        }
    }
}

const fn variable(quantity: Quantity, role: Role, name: &'static str, description: &'static str) -> Variable {
    Variable { quantity, role, name, description }
}

const REJECTED: &str = "How many inputs were not finite (or beyond 1e100): they change nothing";

const FORWARD: &[Variable] = &[
    variable(
        Quantity::Drive,
        Role::Input,
        "drive",
        "The drive, held over the step; kept within the limits of the stage",
    ),
    variable(Quantity::Position, Role::Output, "position", "The position at the end of the step"),
    variable(Quantity::Rejected, Role::Output, "rejected", REJECTED),
    variable(Quantity::Clamped, Role::Output, "clamped", "How many drives lay beyond the limits of the stage"),
];

const INVERSE: &[Variable] = &[
    variable(Quantity::Target, Role::Input, "target", "Where the position is to be"),
    variable(Quantity::Drive, Role::Output, "drive", "The drive for the target, to be held over the same step"),
    variable(Quantity::Position, Role::Output, "position", "Where the position is then, as the model says"),
    variable(
        Quantity::Saturated,
        Role::Output,
        "saturated",
        "Whether the target is out of reach and the drive at a limit",
    ),
    variable(Quantity::Rejected, Role::Output, "rejected", REJECTED),
];

const CONTROLLER: &[Variable] = &[
    variable(Quantity::Reference, Role::Input, "reference", "Where the position is to be"),
    variable(Quantity::Measurement, Role::Input, "measurement", "The position read at the beginning of the step"),
    variable(Quantity::Drive, Role::Output, "drive", "The drive, to be held over the same step"),
    variable(Quantity::Saturated, Role::Output, "saturated", "Whether the law asked for a drive beyond the limits"),
    variable(Quantity::Slewing, Role::Output, "slewing", "Whether the slew rate held the drive back"),
    variable(Quantity::Rejected, Role::Output, "rejected", "How many references were not finite: they hold the drive"),
    variable(Quantity::Missing, Role::Output, "missing", "How many measurements were not finite"),
    variable(Quantity::Implausible, Role::Output, "implausible", "How many measurements cannot be"),
    variable(Quantity::SaturatedSamples, Role::Output, "saturated_samples", "How many samples were saturated"),
    variable(Quantity::SlewingSamples, Role::Output, "slewing_samples", "How many samples the slew rate held back"),
    variable(Quantity::Kp, Role::Parameter, "kp", "The proportional gain"),
    variable(Quantity::Ki, Role::Parameter, "ki", "The integral gain"),
];

/// The variables of a unit, in the order of their references.
pub(crate) fn variables(kind: Kind) -> &'static [Variable] {
    match kind {
        Kind::Forward => FORWARD,
        Kind::Inverse => INVERSE,
        Kind::Controller => CONTROLLER,
    }
}

/// The variable of a reference.
pub(crate) fn variable_at(kind: Kind, reference: u32) -> Option<&'static Variable> {
    variables(kind).get(usize::try_from(reference).ok()?)
}
