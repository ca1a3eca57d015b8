//! Spaces made from others: with more in them, or with less.

use super::Space;
use crate::error::Error;
use crate::fit::axes;
use crate::fit::curve::OutputMap;
use crate::fit::placement::{Placement, spread};
use crate::fit::point::{Axis, Parameter, Point};
use crate::fit::projection::ProjectedFit;
use crate::fit::shift::ShiftColumns;
use crate::loop_shift_model::LoopShiftModel;
use crate::options::Options;
use crate::record::Record;

impl Space {
    /// The same with a parameter that is known.
    pub(crate) fn with_known(&self, parameter: Parameter, value: f64) -> Self {
        let axes = self.axes.iter().filter(|axis| axis.parameter != parameter).copied().collect();
        Self { axes, origin: self.origin.with(parameter, value), ..self.clone() }
    }

    /// The same with the dynamics of a point, and the dead time and the amplifier beside them.
    pub(crate) fn knowing_dynamics(&self, point: &Point) -> Self {
        let dynamics = self.axes.iter().filter(|axis| axis.parameter.is_of_dynamics());
        dynamics.fold(self.clone(), |space, axis| space.with_known(axis.parameter, point.get(axis.parameter)))
    }

    /// The same with nothing searched but the dynamics, and the dead time and the amplifier beside them. A dead time that is not
    /// negative at `point` stays so.
    pub(crate) fn searching_dynamics_alone(&self, point: &Point) -> Self {
        let bounded = |axis: &Axis| {
            let stays = axis.parameter == Parameter::DeadTime && point.get(Parameter::DeadTime) >= 0.0;
            Axis { lower: if stays { axis.lower.max(0.0) } else { axis.lower }, ..*axis }
        };
        let axes = self.axes.iter().filter(|axis| axis.parameter.is_of_dynamics()).map(bounded).collect();
        Self { axes, ..self.clone() }
    }

    /// The same with the dynamics of another space, known where they are known there.
    pub(crate) fn with_dynamics_of(&self, other: &Self) -> Self {
        let rest = self.axes.iter().filter(|axis| !axis.parameter.is_of_dynamics());
        let of_dynamics = other.axes.iter().filter(|axis| axis.parameter.is_of_dynamics());
        Self {
            axes: rest.chain(of_dynamics).copied().collect(),
            origin: self.origin.with_dynamics_of(&other.origin),
            dynamics: other.dynamics,
            further_modes: other.further_modes,
            has_amplifier: other.has_amplifier,
            unread: other.unread,
            ..self.clone()
        }
    }

    /// The same with the loop shift of other options; a space with powers has none.
    pub(crate) fn with_loop_shift(&self, records: &[Record<'_>], loop_shift: LoopShiftModel) -> Result<Self, Error> {
        if self.shift.as_ref().is_some_and(|columns| columns.powers > 0) {
            return Ok(self.clone());
        }
        let shift = super::shift_columns(records, loop_shift, &self.intervals, self.placement.bounds())?;
        Ok(Self { shift, ..self.clone() })
    }

    /// The same with other thresholds, about the weights of a fit at those of this space.
    pub(crate) fn with_thresholds(&self, records: &[Record<'_>], options: &Options, fit: &ProjectedFit) -> Self {
        let there = Self { placement: Placement::new(records, options), ..self.clone() };
        let output_map = self.output_map.as_ref().map(|map| {
            let [from, to] = [self, &there].map(|space| space.thresholds(&fit.point));
            OutputMap { bounds: map.bounds, reference: spread(&fit.weights[..from.len()], &from, &to).into() }
        });
        Self { output_map, ..there }
    }

    /// The same with a mode more, which is searched.
    pub(crate) fn with_mode(&self) -> Self {
        let number = self.further_modes;
        Self { further_modes: number + 1, ..self.with_axes(axes::mode(&self.intervals, number)) }
    }

    /// The same with the first mode alone.
    pub(crate) fn with_one_mode(&self) -> Self {
        let axes = self.axes.iter().filter(|axis| !axis.parameter.is_of_further_mode()).copied().collect();
        Self { axes, further_modes: 0, ..self.clone() }
    }

    /// The same without an amplifier.
    pub(crate) fn without_amplifier(&self) -> Self {
        let axes = self.axes.iter().filter(|axis| axis.parameter != Parameter::LogBandwidth).copied().collect();
        Self { axes, has_amplifier: false, ..self.clone() }
    }

    /// The same with an amplifier whose bandwidth is searched.
    pub(crate) fn with_amplifier(&self) -> Self {
        Self { has_amplifier: true, ..self.with_axes([axes::bandwidth(&self.intervals)]) }
    }

    /// The same with an input map that is searched.
    pub(crate) fn with_input_map(&self) -> Self {
        Self { has_input_map: true, ..self.with_axes(axes::coefficients(Parameter::InputMap)) }
    }

    /// The same with an output map that is searched.
    pub(crate) fn with_output_map(&self, map: OutputMap) -> Self {
        Self { output_map: Some(map), ..self.with_axes(axes::coefficients(Parameter::OutputMap)) }
    }

    /// The same with its output map linear about the weights of a fit, if it has one.
    pub(crate) fn about(&self, fit: &ProjectedFit) -> Self {
        let weights = &fit.weights[..self.thresholds(&fit.point).len()];
        let linear = |map: &OutputMap| OutputMap { bounds: map.bounds, reference: weights.into() };
        Self { output_map: self.output_map.as_ref().map(linear), ..self.clone() }
    }

    pub(crate) fn has_output_map(&self) -> bool {
        self.output_map.is_some()
    }

    fn with_axes(&self, more: impl IntoIterator<Item = Axis>) -> Self {
        let mut space = self.clone();
        space.axes.extend(more);
        space
    }

    /// The same with the square and the cube of the drive, centred and scaled, beside the operators in place of a loop shift.
    pub(crate) fn with_powers(&self) -> Self {
        let (low, high) = self.placement.bounds();
        let (center, half_range) = (0.5 * (low + high), 0.5 * (high - low));
        let shift = (low < high).then_some(ShiftColumns { center, half_range, powers: 2, filters: Vec::new() });
        Self { shift, ..self.clone() }
    }

    /// The same with the first amplitudes of creep alone.
    pub(crate) fn with_creep_amplitudes(&self, amplitudes: usize) -> Self {
        let is_kept = |axis: &&Axis| !matches!(axis.parameter, Parameter::Creep(number) if number >= amplitudes);
        let axes = self.axes.iter().filter(is_kept).copied().collect();
        Self { axes, creep: self.creep.first(amplitudes), ..self.clone() }
    }
}
