//! Spaces made from others: with more in them, or with less.

use super::{Space, at_duhem, side_columns};
use crate::error::Error;
use crate::fit::point::{
    Axis, Parameter, Point, bandwidth_axis, creep_axes, duhem_axes, gain_axes, map_axes, mode_axes, operator_axes,
};
use crate::options::Options;
use crate::records::record::Record;
use crate::terms::creep::CreepModel;
use crate::terms::duhem::{DuhemSpace, DuhemTable};
use crate::terms::dynamics::LinearPart;
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::OutputMap;
use crate::terms::operators::{Placement, spread};
use crate::terms::relaxing_plays::RelaxingPlaysModel;
use crate::terms::side_columns::SideColumns;
use crate::terms::slow_gain::{START, SlowGainModel};

impl Space {
    /// The same with a parameter that is known.
    pub(crate) fn with_known(&self, parameter: Parameter, value: f64) -> Self {
        Self { axes: self.axes_but(|one| one == parameter), origin: self.origin.with(parameter, value), ..self.clone() }
    }

    /// The axes, without those of some parameters.
    fn axes_but(&self, is_left_out: impl Fn(Parameter) -> bool) -> Vec<Axis> {
        self.axes.iter().filter(|axis| !is_left_out(axis.parameter)).copied().collect()
    }

    /// The same with a dead time that is searched from 0 on.
    pub(crate) fn without_lead(&self) -> Self {
        let from_zero = |axis: &Axis| match axis.parameter {
            Parameter::DeadTime => Axis { lower: axis.lower.max(0.0), ..*axis },
            _ => *axis,
        };
        Self { axes: self.axes.iter().map(from_zero).collect(), ..self.clone() }
    }

    /// The same with the dynamics of a point, and the dead time and the amplifier beside them.
    pub(crate) fn knowing_dynamics(&self, point: &Point) -> Self {
        let dynamics = self.axes.iter().filter(|axis| axis.parameter.is_of_dynamics());
        dynamics.fold(self.clone(), |space, axis| space.with_known(axis.parameter, point.get(axis.parameter)))
    }

    /// The same with nothing searched but the dynamics, and the dead time and the amplifier beside them. A dead time
    /// that is not negative at `point` stays so.
    pub(crate) fn searching_dynamics_alone(&self, point: &Point) -> Self {
        let leads = point.get(Parameter::DeadTime) < 0.0;
        let space = if leads { self.clone() } else { self.without_lead() };
        Self { axes: space.axes_but(|one| !one.is_of_dynamics()), ..space }
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
        if self.side.as_ref().is_some_and(|columns| columns.powers > 0) {
            return Ok(self.clone());
        }
        let relaxing = self.relaxing().cloned();
        let side = side_columns(records, loop_shift, relaxing, &self.intervals, self.placement.bounds())?;
        Ok(Self { side, ..self.clone() })
    }

    /// The same with other thresholds, about weights at those of this space.
    pub(crate) fn with_thresholds(
        &self,
        records: &[Record<'_>],
        options: &Options,
        point: &Point,
        weights: &[f64],
    ) -> Self {
        let there =
            Self { placement: Placement::new(records, options.has_plays(), &options.thresholds), ..self.clone() };
        let output_map = self.output_map.as_ref().map(|map| {
            let [from, to] = [self, &there].map(|space| space.thresholds(point));
            let families = self.weights_of_operators(weights).chunks(from.len());
            OutputMap { reference: families.flat_map(|one| spread(one, &from, &to)).collect(), ..map.clone() }
        });
        Self { output_map, ..there }
    }

    /// The same with coupled plays in place of plays, about weights of these: ratios and input offset are searched.
    pub(crate) fn with_coupled_plays(
        &self,
        records: &[Record<'_>],
        options: &Options,
        point: &Point,
        weights: &[f64],
    ) -> Self {
        let there = self.with_thresholds(records, options, point, weights);
        let axes = operator_axes(options, self.placement.bounds()).into_iter().chain(self.axes.iter().copied());
        Self { axes: axes.collect(), fixed_ratios: options.known_ratios(), ..there }
    }

    /// The same with another Duhem operator, which is searched from there on.
    pub(crate) fn with_duhem(&self, table: &DuhemTable) -> Self {
        let mut axes = self.axes_but(Parameter::is_of_duhem);
        axes.extend(duhem_axes(table.knots.len()));
        let duhem = Some(DuhemSpace { knots: table.knots.clone(), scale: table.scale() });
        Self { axes, origin: at_duhem(&self.origin, table), duhem, ..self.clone() }
    }

    /// The same with a mode more, which is searched.
    pub(crate) fn with_mode(&self) -> Self {
        let number = self.further_modes;
        Self { further_modes: number + 1, ..self.with_axes(mode_axes(&self.intervals, number)) }
    }

    /// The same with the first mode alone.
    pub(crate) fn with_one_mode(&self) -> Self {
        Self { axes: self.axes_but(Parameter::is_of_further_mode), further_modes: 0, ..self.clone() }
    }

    /// The same without an amplifier.
    pub(crate) fn without_amplifier(&self) -> Self {
        Self { axes: self.axes_but(|one| one == Parameter::LogBandwidth), has_amplifier: false, ..self.clone() }
    }

    /// The same with an amplifier whose bandwidth is searched.
    pub(crate) fn with_amplifier(&self) -> Self {
        Self { has_amplifier: true, ..self.with_axes([bandwidth_axis(&self.intervals)]) }
    }

    /// The same with an input map that is searched.
    pub(crate) fn with_input_map(&self) -> Self {
        Self { has_input_map: true, ..self.with_axes(map_axes(Parameter::InputMap)) }
    }

    /// The same with an output map that is searched.
    pub(crate) fn with_output_map(&self, map: OutputMap) -> Self {
        Self { output_map: Some(map), ..self.with_axes(map_axes(Parameter::OutputMap)) }
    }

    /// The same without an input map.
    pub(crate) fn without_input_map(&self) -> Self {
        let axes = self.axes_but(|one| matches!(one, Parameter::InputMap(_)));
        Self { axes, has_input_map: false, ..self.clone() }
    }

    /// The same without an output map.
    pub(crate) fn without_output_map(&self) -> Self {
        let axes = self.axes_but(|one| matches!(one, Parameter::OutputMap(_)));
        Self { axes, output_map: None, ..self.clone() }
    }

    /// The same with its output map linear about weights, if it has one.
    pub(crate) fn about(self, weights: &[f64]) -> Self {
        let reference = self.weights_of_operators(weights).into();
        Self { output_map: self.output_map.map(|map| OutputMap { reference, ..map }), ..self }
    }

    /// All weights but those of what stands beside the operators, which come last.
    pub(crate) fn weights_of_operators<'w>(&self, weights: &'w [f64]) -> &'w [f64] {
        &weights[..weights.len() - self.sides().len()]
    }

    pub(crate) fn has_output_map(&self) -> bool {
        self.output_map.is_some()
    }

    pub(crate) fn has_input_map(&self) -> bool {
        self.has_input_map
    }

    /// The same with the maps of another space.
    pub(crate) fn with_maps_of(&self, other: &Self) -> Self {
        let space = if other.has_input_map { self.with_input_map() } else { self.clone() };
        other.output_map.iter().fold(space, |space, map| space.with_output_map(map.clone()))
    }

    fn with_axes(&self, more: impl IntoIterator<Item = Axis>) -> Self {
        let mut space = self.clone();
        space.axes.extend(more);
        space
    }

    /// The same with square and cube of the drive, centred and scaled, beside the operators in place of a loop shift.
    pub(crate) fn with_powers(&self) -> Self {
        let (low, high) = self.placement.bounds();
        let (center, half_range) = (0.5 * (low + high), 0.5 * (high - low));
        let side =
            (low < high).then_some(SideColumns { center, half_range, powers: 2, filters: Vec::new(), relaxing: None });
        Self { side, ..self.clone() }
    }

    /// The same with a slow gain, if the model is one, and a point in it where the search of that begins.
    pub(crate) fn with_slow_gain(&self, model: SlowGainModel, point: &Point) -> Result<(Self, Point), Error> {
        let (longest, dt) = (self.intervals.longest_record(), self.intervals.smallest());
        let Some(gain) = model.space(self.placement.bounds(), longest, dt)? else { return Ok((self.clone(), *point)) };
        let point = point.with(Parameter::SlowGain, START).with(Parameter::SlowGainLogTime, gain.start.ln());
        let space = self.with_axes(gain_axes(&gain));
        Ok((Self { gain: Some(gain), ..space }, point))
    }

    /// The same with other plays that relax.
    pub(crate) fn with_relaxing_plays(&self, model: &RelaxingPlaysModel) -> Result<Self, Error> {
        let (longest, dt) = (self.intervals.longest_record(), self.intervals.smallest());
        let (bounds, origin) = (self.placement.bounds(), self.origin.get(Parameter::InputOffset));
        let relaxing = model.columns(bounds, origin, longest, dt)?;
        let side = match &self.side {
            Some(side) => Some(SideColumns { relaxing, ..side.clone() }).filter(|side| side.len() > 0),
            None => SideColumns::of(Vec::new(), relaxing, bounds),
        };
        Ok(Self { side, ..self.clone() })
    }

    pub(crate) fn has_amplifier(&self) -> bool {
        self.has_amplifier
    }

    /// Whether there is a slow gain.
    pub(crate) fn has_slow_gain(&self) -> bool {
        self.gain.is_some()
    }

    /// The same with other creep, and a point in it that creeps alike.
    pub(crate) fn with_creep(&self, creep: &CreepModel, point: &Point) -> Result<(Self, Point), Error> {
        let basis = creep.basis(self.intervals.longest_record(), self.intervals.smallest())?;
        let LinearPart { time_constants, amplitudes, .. } = self.linear_part(point);
        let mut axes = self.axes_but(|one| matches!(one, Parameter::Creep(_)));
        axes.extend(creep_axes(&basis, creep.largest()));
        let gathered = basis.gathered(&time_constants, &amplitudes).into_iter().enumerate();
        let point = gathered.fold(*point, |point, (number, amplitude)| {
            point.with(Parameter::Creep(number), amplitude.clamp(0.0, creep.largest()))
        });
        Ok((Self { axes, creep: basis, ..self.clone() }, point))
    }

    /// The same with the first amplitudes of creep alone.
    pub(crate) fn with_creep_amplitudes(&self, amplitudes: usize) -> Self {
        let axes = self.axes_but(|one| matches!(one, Parameter::Creep(number) if number >= amplitudes));
        Self { axes, creep: self.creep.first(amplitudes), ..self.clone() }
    }
}
