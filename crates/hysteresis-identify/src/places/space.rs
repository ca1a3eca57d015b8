//! What is searched beside the weights: input offset, ratios, the shape of a Duhem operator, a map, dead time and
//! creep; and the model at such a point.
//!
//! The amplitude of that operator is linear, as weights are: of unit f at 0 it has a column of its own, the last beside
//! the operators.

use hysteresis_control::stage::TemperatureTerm;
use hysteresis_core::Ratios;

use crate::error::Error;
use crate::fit::point::COEFFICIENT_BOUND;
use crate::fit::response::OperatorsAt;
use crate::fit::tangent::{Slope, Tangent};
use crate::options::Setting;
use crate::places::beside::{Beside, Courses, DriftModel, lag_step};
use crate::places::given::{Given, PlacesOptions};
use crate::records::record::Record;
use crate::records::signal::as_f64;
use crate::terms::creep::{CreepBasis, CreepModel};
use crate::terms::duhem::{BACKS, DuhemTable, MOST_KNOTS, RESTS, shapes};
use crate::terms::dynamics::LinearPart;
use crate::terms::maps::{COEFFICIENTS, Curve, DrivePath};
use crate::terms::operators::{ModelKind, OperatorBank, Placement, Thresholds};

/// How many operators there are where that is left open.
const OPERATORS: usize = 20;

/// The longest dead time that is searched, as a share of the shortest drive.
const LONGEST_DEAD_TIME: f64 = 0.1;

/// The largest amplitude of creep that is searched: a share of the motion for each decade of time.
const MOST_CREEP: f64 = 0.3;

/// The ratio rb/ra at which the search begins, too.
const FURTHER_RATIO: f64 = 0.8;

/// Steps of the derivatives: of the input offset as a share of the drive range, of a ratio, and of the shape of a Duhem
/// operator or of a map.
const OFFSET_STEP: f64 = 1e-3;
const RATIO_STEP: f64 = 1e-2;
const SHAPE_STEP: f64 = 1e-2;

/// A parameter that is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    InputOffset,
    Ratio(usize),
    /// The logarithm of where z comes to rest, over half of the range of drives.
    Rest,
    /// f on the way back from there, over that at 0.
    Back,
    /// A coefficient of the map.
    Bend(usize),
    DeadTime,
    Creep(usize),
    /// Always the last.
    ThermalLag,
}

/// The values of all of them, searched or not.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlacePoint {
    pub(crate) input_offset: f64,
    /// ra/r, rb/ra and rc/r: each between fixed bounds.
    pub(crate) ratios: [f64; 3],
    pub(crate) rest: f64,
    pub(crate) back: f64,
    pub(crate) bends: [f64; COEFFICIENTS],
    pub(crate) dead_time: f64,
    pub(crate) creep: Vec<f64>,
    pub(crate) thermal_lag: f64,
}

impl PlacePoint {
    pub(crate) fn get(&self, axis: Axis) -> f64 {
        match axis {
            Axis::InputOffset => self.input_offset,
            Axis::Ratio(number) => self.ratios[number],
            Axis::Rest => self.rest,
            Axis::Back => self.back,
            Axis::Bend(number) => self.bends[number],
            Axis::DeadTime => self.dead_time,
            Axis::Creep(number) => self.creep[number],
            Axis::ThermalLag => self.thermal_lag,
        }
    }

    pub(crate) fn with(&self, axis: Axis, value: f64) -> Self {
        let mut point = self.clone();
        match axis {
            Axis::InputOffset => point.input_offset = value,
            Axis::Ratio(number) => point.ratios[number] = value,
            Axis::Rest => point.rest = value,
            Axis::Back => point.back = value,
            Axis::Bend(number) => point.bends[number] = value,
            Axis::DeadTime => point.dead_time = value,
            Axis::Creep(number) => point.creep[number] = value,
            Axis::ThermalLag => point.thermal_lag = value,
        }
        point
    }

    pub(crate) fn as_ratios(&self) -> Ratios {
        let [ra, rb, rc] = self.ratios;
        Ratios { ra, rb: rb * ra, rc }
    }
}

/// A dead time that was asked for, or where the search for one begins.
fn known_dead_time(asked: Setting<f64>, shortest: f64) -> Result<f64, Error> {
    match asked {
        Setting::Fit => Ok(0.0),
        Setting::Fixed(dead_time) if (0.0..shortest).contains(&dead_time) => Ok(dead_time),
        Setting::Fixed(dead_time) => {
            Err(Error::domain("dead_time", None, "a number >= 0 below the length of the shortest drive", dead_time))
        }
    }
}

/// A time constant of the temperature that was asked for, or where the search for one begins.
fn known_thermal_lag(asked: Setting<f64>, has_temperature: bool, dt: f64) -> Result<f64, Error> {
    let Setting::Fixed(lag) = asked else { return Ok(0.0) };
    if !has_temperature {
        return Err(Error::domain("thermal_lag", None, "none without a temperature", lag));
    }
    let is_told = TemperatureTerm::new(1.0, lag, 0.0).and_then(|term| term.lag(dt)).is_ok();
    let expected = "0, or a time constant of at most 1e9 s that samples tell from a constant";
    if is_told { Ok(lag) } else { Err(Error::domain("thermal_lag", None, expected, lag)) }
}

/// The models of one kind, with or without creep, drift, a Duhem operator and a map.
#[derive(Clone)]
pub(crate) struct PlaceSpace {
    pub(crate) model: ModelKind,
    placement: Placement,
    pub(crate) creep: CreepBasis,
    pub(crate) axes: Vec<Axis>,
    start: PlacePoint,
    longest_dead_time: f64,
    longest_lag: f64,
    pub(crate) drift: DriftModel,
    has_temperature: bool,
    /// The first sample of the first drive.
    first_drive: f64,
    /// Whether a Duhem operator stands beside the plays.
    pub(crate) has_duhem: bool,
    /// How many columns there are beside the plays, of either sign.
    pub(crate) beside: usize,
    pub(crate) dt: f64,
}

impl PlaceSpace {
    pub(crate) fn new(
        given: &Given<'_>,
        options: &PlacesOptions,
        model: ModelKind,
        (creep, drift): (&CreepModel, DriftModel),
    ) -> Result<Self, Error> {
        let drives = given.drives.iter().copied().enumerate();
        let records = drives.map(|(number, drive)| Record::new(drive, drive, 0).map_err(|e| e.in_record(number)));
        let records: Vec<Record<'_>> = records.collect::<Result<_, _>>()?;
        let thresholds = match &options.thresholds {
            open if open.are_counted_by_validation() => open.of(OPERATORS),
            Thresholds::Given(thresholds) => Thresholds::Given(thresholds.clone()),
            known => known.of(known.operators()),
        };
        let placement = Placement::new(&records, model == ModelKind::Conventional, &thresholds);
        let (low, high) = placement.bounds();
        let (longest, shortest) = given.longest_and_shortest();
        let creep = creep.basis(longest, given.dt)?;
        let longest_dead_time = LONGEST_DEAD_TIME * shortest;
        let ratios = match (model, options.ratios) {
            (ModelKind::Conventional, _) => Ratios::PLAY,
            (_, Setting::Fixed(ratios)) => ratios,
            _ => Ratios::PAPER,
        };
        let has_temperature = !given.temperatures.is_empty();
        let dead_time = known_dead_time(options.dead_time, shortest)?;
        let thermal_lag = known_thermal_lag(options.thermal_lag, has_temperature, given.dt)?;
        let input_offset = match options.input_offset {
            Setting::Fixed(offset) => offset,
            Setting::Fit => 0.5 * (low + high),
        };
        let mut axes = Vec::new();
        axes.extend((options.input_offset == Setting::Fit).then_some(Axis::InputOffset));
        if model == ModelKind::Modified && options.ratios == Setting::Fit {
            axes.extend((0..3).map(Axis::Ratio));
        }
        axes.extend((options.dead_time == Setting::Fit).then_some(Axis::DeadTime));
        axes.extend((0..creep.directions.len()).map(Axis::Creep));
        axes.extend((options.thermal_lag == Setting::Fit && has_temperature).then_some(Axis::ThermalLag));
        let rb = if ratios.ra > 0.0 { ratios.rb / ratios.ra } else { 0.0 };
        let ratios = [ratios.ra, rb, ratios.rc];
        let start = PlacePoint {
            input_offset,
            ratios,
            rest: 0.0,
            back: BACKS[0],
            bends: [0.0; COEFFICIENTS],
            dead_time,
            creep: vec![0.0; creep.directions.len()],
            thermal_lag,
        };
        let mut space = Self {
            model,
            placement,
            creep,
            axes,
            start,
            longest_dead_time,
            longest_lag: longest,
            drift,
            has_temperature,
            first_drive: given.drives[0][0],
            has_duhem: false,
            beside: 0,
            dt: given.dt,
        };
        space.beside = space.beside(&space.start, None).columns(given.drives.len());
        Ok(space)
    }

    /// Where the search looks first: input offsets across the drive, two ratios, dead times of a few samples.
    pub(crate) fn starts(&self) -> Vec<PlacePoint> {
        let (low, high) = self.placement.bounds();
        let mut starts = vec![self.start.clone()];
        let spread = |starts: Vec<PlacePoint>, axis: Axis, values: &[f64]| -> Vec<PlacePoint> {
            starts.iter().flat_map(|start| values.iter().map(move |value| start.with(axis, *value))).collect()
        };
        if self.axes.contains(&Axis::InputOffset) {
            let offsets: Vec<f64> = (0..7).map(|i| low + (high - low) * as_f64(i) / 6.0).collect();
            starts = spread(starts, Axis::InputOffset, &offsets);
        }
        if self.axes.contains(&Axis::Ratio(1)) {
            starts = spread(starts, Axis::Ratio(1), &[self.start.ratios[1], FURTHER_RATIO]);
        }
        if self.axes.contains(&Axis::DeadTime) {
            let samples = [0.0, 1.0, 3.0].map(|samples| (samples * self.dt).min(self.longest_dead_time));
            starts = spread(starts, Axis::DeadTime, &samples);
        }
        if self.axes.contains(&Axis::ThermalLag) {
            starts = spread(starts, Axis::ThermalLag, &[0.0, 0.01, 0.05, 0.2].map(|share| share * self.longest_lag));
        }
        starts
    }

    /// Whether two starts differ in nothing but the dead time, in a space that has more.
    pub(crate) fn differ_in_dead_time(&self, one: &PlacePoint, other: &PlacePoint) -> bool {
        self.axes.contains(&Axis::InputOffset) && *one == other.with(Axis::DeadTime, one.dead_time)
    }

    /// The same without an axis.
    pub(crate) fn without(mut self, axis: Axis) -> Self {
        self.axes.retain(|other| *other != axis);
        self
    }

    /// The point of a model without creep, with none yet.
    pub(crate) fn beginning_at(&self, plain: &PlacePoint) -> PlacePoint {
        PlacePoint { creep: self.start.creep.clone(), ..plain.clone() }
    }

    /// The same with a Duhem operator beside the plays.
    pub(crate) fn with_duhem(&self) -> Self {
        let axes = self.axes_with([Axis::Rest, Axis::Back]);
        Self { axes, has_duhem: true, beside: self.beside + 1, ..self.clone() }
    }

    /// The same with a map in front of the hysteresis.
    pub(crate) fn with_input_map(&self) -> Self {
        Self { axes: self.axes_with(std::array::from_fn::<_, COEFFICIENTS, _>(Axis::Bend)), ..self.clone() }
    }

    pub(crate) fn has_input_map(&self) -> bool {
        self.axes.contains(&Axis::Bend(0))
    }

    /// The axes and some more; the thermal lag stays the last.
    fn axes_with<const N: usize>(&self, further: [Axis; N]) -> Vec<Axis> {
        let (last, others): (Vec<Axis>, Vec<Axis>) = self.axes.iter().partition(|axis| **axis == Axis::ThermalLag);
        others.into_iter().chain(further).chain(last).collect()
    }

    /// Operators of all shapes at a point; and with the input offset of a stage that begins virgin, as plays that fail
    /// may have moved it.
    pub(crate) fn shapes_at(&self, point: &PlacePoint) -> Vec<PlacePoint> {
        let is_open = self.axes.contains(&Axis::InputOffset) && point.input_offset != self.first_drive;
        let virgin = is_open.then(|| point.with(Axis::InputOffset, self.first_drive));
        let of =
            |point: &PlacePoint, (rest, back): (f64, f64)| point.with(Axis::Rest, rest.ln()).with(Axis::Back, back);
        std::iter::once(point).chain(&virgin).flat_map(|point| shapes().map(|shape| of(point, shape))).collect()
    }

    /// How many columns beside the plays are no part of the stage: what drifts, and a temperature.
    pub(crate) fn not_of_stage(&self) -> usize {
        self.beside - usize::from(self.has_duhem)
    }

    /// The amplitude of the Duhem operator among all that is linear, weights first; 0 without one.
    pub(crate) fn amplitude(&self, linear: &[f64]) -> f64 {
        linear.last().copied().filter(|_| self.has_duhem).unwrap_or(0.0)
    }

    pub(crate) fn bounds(&self, axis: Axis) -> (f64, f64) {
        let (low, high) = self.placement.bounds();
        match axis {
            Axis::InputOffset => (low - 0.2 * (high - low), high + 0.2 * (high - low)),
            Axis::Ratio(0) => (0.2, 2.0),
            Axis::Ratio(_) => (0.0, 1.0),
            Axis::Rest => (RESTS[0].ln(), RESTS[RESTS.len() - 1].ln()),
            Axis::Back => (BACKS[0], BACKS[BACKS.len() - 1]),
            Axis::Bend(_) => (-COEFFICIENT_BOUND, COEFFICIENT_BOUND),
            Axis::DeadTime => (0.0, self.longest_dead_time),
            Axis::Creep(_) => (0.0, MOST_CREEP),
            Axis::ThermalLag => (0.0, self.longest_lag),
        }
    }

    /// How far one step of the search may go.
    pub(crate) fn stride(&self, axis: Axis) -> f64 {
        let (low, high) = self.bounds(axis);
        match axis {
            Axis::DeadTime => 3.0 * self.dt,
            _ => 0.2 * (high - low),
        }
    }

    pub(crate) fn thresholds(&self, point: &PlacePoint) -> Vec<f64> {
        self.placement.thresholds(point.input_offset)
    }

    /// The operators at a point, a Duhem operator of this amplitude among them.
    pub(crate) fn operators(&self, point: &PlacePoint, amplitude: f64) -> OperatorsAt {
        let ratios = if self.model == ModelKind::Modified { point.as_ratios() } else { Ratios::PLAY };
        let plays = OperatorsAt::alone(OperatorBank::from_ratios(&self.thresholds(point), ratios), point.input_offset);
        // Of no amplitude, or one beyond all numbers that an operator may have, there is none.
        let is_one = |table: &DuhemTable| table.operator::<MOST_KNOTS>().is_ok();
        let duhem = self.has_duhem.then(|| self.shape(point).scaled(amplitude)).filter(is_one);
        let map = self.has_input_map().then(|| Curve::new(self.placement.bounds(), point.bends));
        OperatorsAt { duhem, path: DrivePath { map, ..DrivePath::default() }, ..plays }
    }

    /// The Duhem operator of unit f at 0.
    fn shape(&self, point: &PlacePoint) -> DuhemTable {
        let (low, high) = self.placement.bounds();
        DuhemTable::bouc_wen(0.5 * (high - low) * point.rest.exp(), point.back)
    }

    pub(crate) fn linear(&self, point: &PlacePoint) -> LinearPart {
        LinearPart {
            amplitudes: self.creep.amplitudes(|number| point.creep[number]),
            time_constants: self.creep.time_constants.clone(),
            ..LinearPart::delay(point.dead_time)
        }
    }

    /// What moves a place in the time of each drive, at a point.
    fn courses(&self, point: &PlacePoint) -> Courses {
        let samples = self.creep.time_constants.iter().map(|tau| tau / self.dt);
        let of_creep = self.creep.directions.iter().map(|unit| unit.iter().copied().zip(samples.clone()).collect());
        let of_warmth = self.has_temperature.then(|| vec![(1.0, point.thermal_lag / self.dt)]);
        match self.drift {
            DriftModel::None => Courses::none(),
            DriftModel::Steady => Courses::Steady,
            DriftModel::Settling => Courses::Settling(of_creep.chain(of_warmth).collect()),
        }
    }

    /// The columns beside the operators at a point; with the derivative by the lag if all amplitudes are given, weights
    /// first.
    pub(crate) fn beside(&self, point: &PlacePoint, amplitudes: Option<&[f64]>) -> Beside {
        let is_searched = self.axes.contains(&Axis::ThermalLag);
        let ahead = amplitudes.filter(|_| is_searched).map(|amplitudes| {
            let further = point.thermal_lag + lag_step(point.thermal_lag, self.dt);
            let own = &amplitudes[amplitudes.len() - self.beside..][..self.not_of_stage()];
            (Box::new(self.beside(&point.with(Axis::ThermalLag, further), None)), own.to_vec())
        });
        Beside { courses: self.courses(point), lag: self.has_temperature.then_some(point.thermal_lag), ahead }
    }

    /// The model at a point, the column of a Duhem operator first of the slopes; with derivatives along its axes if all
    /// amplitudes are given, weights first.
    pub(crate) fn tangent(&self, point: &PlacePoint, amplitudes: Option<&[f64]>) -> Tangent {
        let amplitude = amplitudes.map_or(0.0, |all| self.amplitude(all));
        let slope = |axis: &Axis| {
            let step = match axis {
                Axis::ThermalLag => return None,
                Axis::DeadTime => return Some(Slope::DeadTime),
                Axis::Creep(number) => return Some(Slope::Creep(self.creep.directions[*number].clone())),
                Axis::InputOffset => OFFSET_STEP * (self.placement.bounds().1 - self.placement.bounds().0),
                Axis::Ratio(_) => RATIO_STEP,
                Axis::Rest | Axis::Back | Axis::Bend(_) => SHAPE_STEP,
            };
            let value = point.get(*axis);
            let inward = if value + step > self.bounds(*axis).1 { -step } else { step };
            Some(Slope::Operators(self.operators(&point.with(*axis, value + inward), amplitude), inward))
        };
        let operators = self.operators(point, amplitude);
        let columns = operators.bank.len();
        // It is as large again as it is, or there is one of unit f at 0.
        let further = if operators.duhem.is_some() { amplitude } else { 1.0 };
        let own = self.has_duhem.then(|| Slope::Operators(self.operators(point, amplitude + further), further));
        let along_axes = self.axes.iter().filter(|_| amplitudes.is_some()).filter_map(slope);
        Tangent {
            columns,
            linear: self.linear(point),
            operators,
            weights: amplitudes.map_or_else(|| vec![0.0; columns], |all| all[..columns].to_vec()),
            slopes: own.into_iter().chain(along_axes).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::places::equations::Equations;
    use crate::places::given::KnownLength;

    /// What the column of the thermal lag says is what all columns beside the operators change by: those of what
    /// settles, too.
    #[test]
    fn the_derivative_by_the_thermal_lag_is_that_of_all_columns() {
        let drives: Vec<Vec<f64>> =
            [17.0, 23.0].map(|slow| (0..300_u32).map(|k| (f64::from(k) / slow).sin()).collect()).into();
        let drives: Vec<&[f64]> = drives.iter().map(Vec::as_slice).collect();
        let temperatures: Vec<Vec<f64>> =
            [90.0, 60.0].map(|slow| (0..300_u32).map(|k| 20.0 + (f64::from(k) / slow).sin()).collect()).into();
        let lengths: Vec<KnownLength> =
            (0..40_u32).map(|k| KnownLength::new((k % 2) as usize, 0.0, 7.0 * f64::from(k) + 2.5, 1.0)).collect();
        let dt = 0.1;
        let given = Given::new(&drives, &[], &lengths, dt).unwrap().with_temperatures(&temperatures).unwrap();
        let options = PlacesOptions { thermal_lag: Setting::Fit, ..PlacesOptions::new(dt) };
        for drift in [DriftModel::None, DriftModel::Steady, DriftModel::Settling] {
            let terms = (&CreepModel::Slow, drift);
            let space = PlaceSpace::new(&given, &options, ModelKind::Conventional, terms).unwrap();
            let lag = 4.0;
            let point = space.start.with(Axis::ThermalLag, lag);
            // Weights of zero, then amplitudes that all differ: what is beside the operators alone.
            let columns = space.tangent(&point, None).columns;
            let amplitudes: Vec<f64> = (0..space.beside).map(|k| 0.5 + as_f64(k)).collect();
            let unknowns = [vec![0.0; columns], amplitudes].concat();
            let rows_at = |point: &PlacePoint, unknowns: Option<&[f64]>| {
                Equations::new(&given).rows(&space.tangent(point, unknowns), &space.beside(point, unknowns))
            };
            let said = rows_at(&point, Some(&unknowns));
            let [ahead, behind] = [0.001, -0.001]
                .map(|step| rows_at(&space.start.with(Axis::ThermalLag, lag + step), None).times(&unknowns));
            let changes: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / 0.002).collect();
            let largest = changes.iter().fold(0.0_f64, |most, change| most.max(change.abs()));
            for (row, change) in said.iter().zip(&changes) {
                let slope = row[said.width - 1];
                assert!((slope - change).abs() < 0.03 * largest, "{drift:?}: {slope} for {change}");
            }
        }
    }

    /// The column of a Duhem operator is that of unit f, and what it puts out goes into the derivatives: by its shape,
    /// and by the input offset.
    #[test]
    fn the_derivatives_by_the_shape_of_a_duhem_operator_are_those_of_its_column() {
        let drive: Vec<f64> =
            (0..400_u32).map(|k| 2.0 * (f64::from(k) / 23.0).sin() * (1.0 - f64::from(k) / 500.0)).collect();
        let drives = [&drive[..]];
        let lengths: Vec<KnownLength> =
            (0..50_u32).map(|k| KnownLength::new(0, 0.0, 7.0 * f64::from(k) + 2.5, 1.0)).collect();
        let given = Given::new(&drives, &[], &lengths, 0.1).unwrap();
        let options = PlacesOptions { dead_time: Setting::Fixed(0.0), ..PlacesOptions::new(0.1) };
        let terms = (&CreepModel::None, DriftModel::None);
        let space = PlaceSpace::new(&given, &options, ModelKind::Conventional, terms).unwrap().with_duhem();
        assert_eq!(space.axes, [Axis::InputOffset, Axis::Rest, Axis::Back]);
        let point = space.start.with(Axis::InputOffset, 0.1).with(Axis::Rest, -0.5).with(Axis::Back, 1.4);
        let columns = space.tangent(&point, None).columns;
        let rows_at = |point: &PlacePoint, unknowns: Option<&[f64]>| {
            Equations::new(&given).rows(&space.tangent(point, unknowns), &space.beside(point, unknowns))
        };
        for amplitude in [-0.4, 0.0, 0.3] {
            let unknowns: Vec<f64> = std::iter::repeat_n(0.0, columns).chain([amplitude]).collect();
            let said = rows_at(&point, Some(&unknowns));
            let column = rows_at(&point, None);
            assert!(said.iter().zip(column.iter()).all(|(a, b)| (a[columns] - b[columns]).abs() < 1e-12));
            for (number, axis) in space.axes.iter().enumerate() {
                let [ahead, behind] = [1e-5, -1e-5]
                    .map(|step| rows_at(&point.with(*axis, point.get(*axis) + step), None).times(&unknowns));
                let changes: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / 2e-5).collect();
                let largest = changes.iter().fold(0.0_f64, |most, change| most.max(change.abs()));
                for (row, change) in said.iter().zip(&changes) {
                    let slope = row[columns + 1 + number];
                    assert!((slope - change).abs() <= 0.05 * largest, "{axis:?}: {slope} for {change}");
                }
            }
        }
    }
}
