//! Identification from places: drives, pairs and lengths in, a stage without a sensor out.

use hysteresis_core::{DuhemForward, Ratios};
use hysteresis_identify::{
    self as identification, CreepModel, KnownLength, MapModel, ModelKind, PlacePair, PlacesCandidate, PlacesOptions,
    Setting,
};
use hysteresis_python_macros::{function, methods, py};
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyList, PyTuple};

use super::diagnose::Finding;
use super::options::{Operators, Placing, Smoothness, placed};
use super::watch::Watch;
use crate::argument::{Argument, Words};
use crate::convert::arguments::is_word;
use crate::convert::arrays::{FIT, array, check_room, numbers, read_only};
use crate::convert::errors::{self, one_record, raise};
use crate::linear::creep::Creep;
use crate::model::duhem::Duhem;
use crate::model::models::object;
use crate::stage::stage::{Stage, points};
use crate::stage::temperature::{TemperatureTerm, added};

/// What `identify_places` found: a stage, and how far to trust it.
///
/// Standard errors allow for mismatches that are alike along the time or along the drive; `warnings` tells what makes
/// the numbers doubtful. Among its codes:
///
/// - "one_loop_size": all pairs lie on loops of one size, which cannot tell how the scale of other loops differs.
/// - "wrong_pairs": pairs that contradict the others were left out; `wrong_pairs` names them.
/// - "wrong_lengths": lengths that contradict the others were left out; `wrong_lengths` names them.
/// - "uninformative_pairs": most pairs say nothing; `uninformative_pairs` names them.
/// - "places_differ": the model is not at the same place at both instants of a pair.
/// - "start_up_transient": pairs at the beginning contradict later ones.
/// - "lengths_missed": lengths without pairs are missed; the message names the worst.
/// - "positions_not_told": pairs and lengths leave positions open.
/// - "dead_time_confounded": the pairs do not tell the dead time.
/// - "no_inverse": the Duhem operator falls by more than the plays rise.
/// - "temperature_not_told": the record does not tell how the position follows the temperature.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> actuator = mh.paper.table_1_recovered()
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=1000)  # V
/// >>> y = actuator.forward().run(u)  # um: only to find the pairs
/// >>> levels = np.linspace(y.min(), y.max(), 60)[1:-1]
/// >>> passes = [np.flatnonzero(np.diff(y > level)) for level in levels]
/// >>> at = [k + (level - y[k]) / (y[k + 1] - y[k]) for k, level in zip(passes, levels)]
/// >>> pairs = [(0, t[i], t[i + 1]) for t in at for i in range(len(t) - 1)]
/// >>> lengths = [(0, at[20][0], at[40][0], levels[40] - levels[20])]
/// >>> found = mh.identify_places(u, pairs, lengths, dt=1e-3)
/// >>> error = found.predict(u) - (y - y[0])
/// >>> bool(np.sqrt(np.mean(error**2)) < 0.01 * np.ptp(y))
/// True
#[pyclass(module = "mpi_hyst.results", frozen)]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub(crate) struct PlacesIdentification {
    found: identification::PlacesIdentification,
}

#[methods]
impl PlacesIdentification {
    /// The hysteresis. Pairs do not tell an offset: the position is 0 at the first sample of the first drive.
    #[getter]
    #[py(-> "Model")]
    fn model(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        object(py, self.found.model.clone())
    }

    /// The ratios (ra/r, rb/r, rc/r) of the thresholds; (1, 1, 1) for the conventional model.
    #[getter]
    fn ratios(&self) -> (f64, f64, f64) {
        let Ratios { ra, rb, rc } = self.found.ratios;
        (ra, rb, rc)
    }

    /// All of it as a stage, without limits and slew.
    #[getter]
    fn stage(&self) -> PyResult<Stage> {
        self.found.stage().map(Stage).map_err(raise)
    }

    /// What the position lags the drive, in seconds.
    #[getter]
    fn dead_time(&self) -> f64 {
        self.found.dead_time
    }

    /// The Duhem operator beside the plays, if there is one.
    #[getter]
    fn duhem(&self) -> Option<Duhem> {
        self.found.duhem().map(|duhem| Duhem(DuhemForward::new(duhem)))
    }

    /// The points (x, y) of the map in front of the hysteresis, if there is one: drive in, drive out.
    #[getter]
    fn input_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.found.input_map().as_ref().map(points)
    }

    /// The creep, if there is any.
    #[getter]
    fn creep(&self) -> Option<Creep> {
        self.found.creep.clone().map(Creep)
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.found.dt
    }

    /// The lowest and the highest drive.
    #[getter]
    fn drive_range(&self) -> (f64, f64) {
        self.found.drive_range
    }

    /// The lowest and the highest position of the model in these drives.
    #[getter]
    fn position_range(&self) -> (f64, f64) {
        self.found.position_range
    }

    /// How far apart the model is at the two instants of every pair, in the unit of the lengths.
    #[getter]
    fn mismatches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.mismatches.iter().copied())
    }

    /// The robust standard deviation of the mismatches, for a pair of middling uncertainty; without pairs the rms of
    /// `length_errors`.
    #[getter]
    fn mismatch(&self) -> f64 {
        self.found.mismatch
    }

    /// Modelled minus known length, for every length.
    #[getter]
    fn length_errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.length_errors.iter().copied())
    }

    /// The rows of the pairs that contradict the others: they were left out of the fit.
    #[getter]
    fn wrong_pairs(&self) -> Vec<usize> {
        self.found.wrong_pairs.clone()
    }

    /// The rows of the lengths that contradict the others: they were left out of the fit, too. Empty with fewer than
    /// ten more lengths than unknowns, of which there is one beside pairs, the scale: none of a few can be told from
    /// the others.
    #[getter]
    fn wrong_lengths(&self) -> Vec<usize> {
        self.found.wrong_lengths.clone()
    }

    /// The rows of the pairs that say nothing: no operator differs between their instants.
    #[getter]
    fn uninformative_pairs(&self) -> Vec<usize> {
        self.found.uninformative_pairs.clone()
    }

    /// Standard errors of the weights.
    #[getter]
    fn weights_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.weights_std.iter().copied())
    }

    /// Standard error of the input offset; 0 if it was given.
    #[getter]
    fn input_offset_std(&self) -> f64 {
        self.found.input_offset_std
    }

    /// Standard error of the dead time in seconds; 0 if it was given.
    #[getter]
    fn dead_time_std(&self) -> f64 {
        self.found.dead_time_std
    }

    /// Standard errors of the searched amplitudes of creep.
    #[getter]
    fn creep_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.creep_std.iter().copied())
    }

    /// How smooth the weights were asked to be.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.found.smoothness
    }

    /// What was tried: first models of plays, the simplest first, then those with ", duhem" and ", input map" in their
    /// name. For each the model, how many amplitudes of creep, whether there is a drift, and the rms distance of pairs,
    /// or error of lengths alone, of stretches that were not fitted. All are judged by the same ones.
    #[getter]
    fn candidates(&self) -> Vec<(String, usize, bool, f64)> {
        let name = |one: &PlacesCandidate| {
            let further = [(one.duhem, ", duhem"), (one.input_map, ", input map")];
            further
                .iter()
                .filter(|(is_there, _)| *is_there)
                .fold(one.model.name().to_owned(), |name, (_, more)| name + more)
        };
        let tried = self.found.candidates.iter();
        tried.map(|one| (name(one), one.validation.creep, one.drift, one.validation.rmse)).collect()
    }

    /// Whether what is seen drifts against the stage, or, with lengths alone, still settles when a drive begins.
    #[getter]
    fn has_drift(&self) -> bool {
        !self.found.drift_amplitudes.is_empty()
    }

    /// By how much what is seen has drifted at every sample of the drive of a number: what is seen at sample k is at
    /// `predict(u, temperature=...)[k] + drift(number)[k]`, but for an offset. Zero without a drift. With lengths alone
    /// it is what goes on of creep and warmth from before the drive, and goes to zero; otherwise it is zero at the
    /// first sample.
    fn drift<'py>(&self, py: Python<'py>, number: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.found.drift(number).map(|drift| PyArray1::from_vec(py, drift)).map_err(raise)
    }

    /// What the temperature adds, if one was given: nothing at the first sample of the first drive.
    #[getter]
    fn temperature(&self) -> Option<TemperatureTerm> {
        self.found.temperature.map(TemperatureTerm)
    }

    /// Standard errors of its sensitivity, and of its time constant in seconds; 0 if it was given.
    #[getter]
    fn temperature_std(&self) -> (f64, f64) {
        self.found.temperature_std
    }

    /// Whether the result deserves trust: "green", "amber" or "red", the worst of `warnings`.
    #[getter]
    #[py(-> "Literal['green', 'amber', 'red']")]
    fn verdict(&self) -> &'static str {
        self.found.verdict().name()
    }

    /// What makes the numbers doubtful; empty if nothing does.
    #[getter]
    fn warnings(&self) -> Vec<Finding> {
        self.found.warnings.iter().cloned().map(Finding::from).collect()
    }

    /// The position for the drive `u`, sampled every `dt`, from the virgin state and at rest at its first value; with a
    /// `temperature` for each sample what that adds, otherwise at the one of the first sample that was identified.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        #[py(*, = None)] temperature: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut predicted = self.found.predict(u.as_slice()?).map_err(|error| one_record(error, None))?;
        if let Some(temperature) = temperature {
            let added = added(self.found.temperature.as_ref(), &temperature, predicted.len(), self.found.dt)?;
            predicted.iter_mut().zip(added).for_each(|(y, added)| *y += added);
        }
        Ok(PyArray1::from_vec(py, predicted))
    }

    /// The standard deviation of every sample of `predict`: what errors of pairs and lengths make of it, and how far
    /// the other `candidates` are from it, root mean square over all of them. Each counts by the square of its trust:
    /// the rms error that the chosen one leaves over the one that it leaves. Those that have all terms of the chosen
    /// one and more count less: the square of their distance by the share of the mismatches that is alike from pair to
    /// pair, and no noise. What all of them lack comes on top.
    ///
    /// Pairs do not tell an offset. So it is that of the position about its mean over `u`; with lengths alone, from the
    /// first sample of the first drive.
    fn predict_std<'py>(&self, py: Python<'py>, u: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let deviation = self.found.predict_std(u.as_slice()?);
        deviation.map(|y| PyArray1::from_vec(py, y)).map_err(|error| one_record(error, None))
    }

    fn __repr__(&self) -> String {
        let warnings: Vec<_> = self.found.warnings.iter().map(|warning| warning.code.name()).collect();
        let (pairs, lengths) = (self.found.mismatches.len(), self.found.length_errors.len());
        let mismatch = self.found.mismatch;
        let of = |count: usize, name: &str| format!("{count} {name}{}", if count == 1 { "" } else { "s" });
        let (pairs, lengths) = (of(pairs, "pair"), of(lengths, "length"));
        format!("<PlacesIdentification: {pairs}, {lengths}, mismatch {mismatch:.3e}, warnings {warnings:?}>")
    }
}

/// Identifies a stage without a position sensor: from pairs of instants at the same place, and from known lengths.
///
/// y(t1) = y(t2) says D w = 0, a known length l says D w = l: D is what the operators' outputs, behind creep and dead
/// time, differ by between the two instants. Weights w >= 0 follow by least squares with a robust loss: a few wrong
/// pairs do no harm, nor does a wrong length among many. Input offset, dead time and creep are searched. Model, creep,
/// drift and smoothness are chosen by cross-validation over the pairs. The lengths alone set the scale.
///
/// Pairs do not tell an offset: the position is 0 at the first sample of the first drive. They must come from loops of
/// different size, or a finding says that the scale of other loops is not told. Every drive starts from the input
/// offset, and from there at its first sample.
///
/// Non-negative least squares as Lawson and Hanson, Solving Least Squares Problems, 1974; the losses as Huber, Ann.
/// Math. Stat. 35, 73, 1964, and Beaton and Tukey, Technometrics 16, 147, 1974; standard errors as Liang and Zeger,
/// Biometrika 73, 13, 1986; the Duhem operator as `Duhem`.
///
/// Parameters
/// ----------
/// drives : array of n floats, or list of arrays
///     What drove the stage, in V, from rest.
/// pairs : array of shape (m, 3) or (m, 4)
///     A row for each pair: the number of the drive, then two instants at which the stage was at the same place, in
///     samples; they may lie between samples. A fourth column says how uncertain each match is, as a standard
///     deviation: only ratios count.
/// lengths : array of shape (k, 4) or (k, 5)
///     A row for each known distance: the number of the drive, two instants, and y(second) - y(first) in um, with its
///     sign. A fifth column is its standard deviation; without it a length counts as known to a thousandth of the
///     longest. Also known places or loads: distances from the first one.
/// dt : float
///     Sampling interval of all drives in seconds.
/// model : "auto", "modified" or "conventional"
///     Coupled plays or plays; "auto" leaves it to cross-validation over the pairs.
/// operators : int, optional
///     How many operators; 20 if it is left open.
/// ratios : "fit" or (ra/r, rb/r, rc/r)
///     Of the modified model.
/// input_offset : "fit" or float
///     Where the operators have their zero, in V. For the conventional model that is where the stage was at rest before
///     the drives: it is searched where a pair or a length sees it, and the middle of the drives otherwise. Give the
///     first drive of a stage that begins virgin.
/// dead_time : "fit" or float
///     What the position lags the drive, in seconds: searched up to a tenth of the shortest drive.
/// creep : "auto", None, "log", int or array
///     Creep as in `identify`; "auto" takes log-type creep from 0.1 s on if cross-validation asks for it.
/// thresholds : "uniform", "quantiles", "geometric" or array, optional
///     As in `identify`.
/// smoothness : float or "auto"
///     As in `identify`, beside the sum of squares of the drive differences of the pairs.
/// drift : "auto" or bool
///     Whether what is seen drifts against the stage in the course of each drive: heat, or creep from what was before.
///     A drive of n samples drifts by a s + b ln(1 + 20 s) / ln 21, s = k / (n - 1), with a and b of its own. "auto"
///     leaves it to cross-validation over the pairs. With lengths alone "auto" tries in its place what goes on of
///     before the drive: a decay with each time constant of creep, and with that of warmth.
/// duhem : "auto", None or "fit"
///     A Duhem operator beside the plays, added or subtracted: as of Bouc-Wen of exponent 1, with f on the way back
///     that is searched. "auto" tries one beside the chosen model where plays leave more than noise, and keeps it if
///     cross-validation asks for it and there is an inverse.
/// input_map : "auto", None or "smooth"
///     A map of the drive in front of the hysteresis, for a middle line that bends: as in `identify`. Pairs tell none.
///     "auto" tries one where there are at least 16 lengths, which "smooth" needs, too, and keeps it if
///     cross-validation asks for it.
/// temperature : array of n floats, or list of arrays, optional
///     The temperature at each sample of the drives. The position then has the term kappa (theta - T[0]), theta' = (T -
///     theta) / tau, of either sign: a `plant.TemperatureTerm` of the stage.
/// thermal_lag : "fit" or float
///     tau in seconds: searched up to the length of the longest drive.
///
/// Returns
/// -------
/// PlacesIdentification
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// A gauge under known loads, up and down: lengths alone.
///
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> loads = np.repeat([0.0, 2, 4, 6, 8, 10, 8, 6, 4, 2, 0, 3, 6, 3, 0], 10)
/// >>> gauge = mh.PrandtlIshlinskii([1.0, 0.02, 0.01], [0.0, 1.0, 2.5])
/// >>> reading = gauge.forward().run(loads)
/// >>> held = np.arange(9, loads.size, 10)  # the last sample at each load
/// >>> lengths = [(0, held[0], k, reading[k] - reading[held[0]]) for k in held[1:]]
/// >>> found = mh.identify_places(
/// ...     loads, np.zeros((0, 3)), lengths, dt=1.0, model="conventional", input_offset=0.0, operators=4, dead_time=0.0,
/// ...     creep=None,
/// ... )
/// >>> bool(np.abs(found.predict(loads) - (reading - reading[0])).max() < 0.02)
/// True
#[function]
#[gather(options: PlacesOptions = PlacesOptions::new(dt))]
pub(crate) fn identify_places(
    py: Python<'_>,
    #[py("ArrayLike | Sequence[ArrayLike]")] drives: &Bound<'_, PyAny>,
    #[py("ArrayLike")] pairs: &Bound<'_, PyAny>,
    #[py("ArrayLike")] lengths: &Bound<'_, PyAny>,
    #[py(*)] dt: f64,
    #[py(field = "auto")] model: AnyModel,
    #[py(= None)] operators: Option<Operators>,
    #[py(field = "fit")] ratios: Setting<Ratios>,
    #[py(field = "fit")] input_offset: Setting<f64>,
    #[py(field = "fit")] dead_time: Setting<f64>,
    #[py(field = "auto")] creep: CreepModel,
    #[py(= None)] thresholds: Option<Placing>,
    #[py(field = "auto")] smoothness: Smoothness,
    #[py(field = "auto")] drift: AnyDrift,
    #[py(field = "auto")] duhem: AnyDuhem,
    #[py(field = "auto")] input_map: MapModel,
    #[py("ArrayLike | Sequence[ArrayLike] | None" = None)] temperature: Option<&Bound<'_, PyAny>>,
    #[py(field = "fit")] thermal_lag: Setting<f64>,
) -> PyResult<PlacesIdentification> {
    let temperatures = temperature.map(|given| each("temperature", given)).transpose()?.unwrap_or_default();
    let options = PlacesOptions { thresholds: placed(thresholds, operators)?, temperatures, ..options };
    let drives = each("drives", drives)?;
    let drives: Vec<&[f64]> = drives.iter().map(Vec::as_slice).collect();
    let pair = |row: &[f64]| {
        let std = row.get(3).copied().unwrap_or(1.0);
        Ok(PlacePair { std, ..PlacePair::new(number("pairs", row[0])?, row[1], row[2]) })
    };
    let pairs = rows("pairs", pairs, 3, "drive, first instant, second instant", pair)?;
    let length = |row: &[f64]| {
        let std = row.get(4).copied();
        Ok(KnownLength { std, ..KnownLength::new(number("lengths", row[0])?, row[1], row[2], row[3]) })
    };
    let lengths = rows("lengths", lengths, 4, "drive, first instant, second instant, distance", length)?;
    let mut watch = Watch::new(None);
    let found =
        py.detach(|| identification::identify_places(&drives, &pairs, &lengths, &options, &mut || watch.look(())));
    watch.check()?;
    found.map(|found| PlacesIdentification { found }).map_err(|error| errors::of_records(error, drives.len()))
}

/// One array, or one for each drive: a list of what is no number.
fn each(name: &'static str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<f64>>> {
    let is_list = given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>();
    let first = if is_list && !given.is_empty()? { Some(given.get_item(0)?) } else { None };
    let is_several = first.is_some_and(|first| !(first.is_instance_of::<PyFloat>() || first.is_instance_of::<PyInt>()));
    let all: Vec<Vec<f64>> = if is_several {
        given.try_iter()?.map(|one| numbers(name, &one?)).collect::<PyResult<_>>()?
    } else {
        vec![numbers(name, given)?]
    };
    all.iter().try_for_each(|one| check_room(name, one.len(), FIT))?;
    Ok(all)
}

/// The rows of a table of so many columns, or of one more.
fn rows<T>(
    name: &'static str,
    value: &Bound<'_, PyAny>,
    columns: usize,
    what: &str,
    row: impl Fn(&[f64]) -> PyResult<T>,
) -> PyResult<Vec<T>> {
    if value.len().is_ok_and(|rows| rows == 0) {
        return Ok(Vec::new());
    }
    let expected = format!("rows of {columns} numbers ({what}), or of {} with a standard deviation", columns + 1);
    let table = array::<Ix2>(name, value, format_args!("{expected}"))?;
    let table = table.as_array();
    if table.ncols() != columns && table.ncols() != columns + 1 {
        return Err(errors::value(name, format_args!("expected {expected}, got {} columns", table.ncols())));
    }
    table.rows().into_iter().map(|values| row(&values.to_vec())).collect()
}

/// The number of a drive.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
fn number(name: &'static str, drive: f64) -> PyResult<usize> {
    if drive >= 0.0 && drive.fract() == 0.0 && drive < 1e9 {
        return Ok(drive as usize);
    }
    Err(errors::value(
        name,
        format_args!("expected the number of a drive (0, 1, ...) in the first column, got {drive}"),
    ))
}

/// `model`: one of the two, or "auto".
pub(crate) struct AnyModel(Option<ModelKind>);

impl From<AnyModel> for Option<ModelKind> {
    fn from(AnyModel(model): AnyModel) -> Self {
        model
    }
}

#[py("Literal['auto', 'modified', 'conventional']")]
impl Argument<'_> for AnyModel {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_word(value, "auto") {
            return Ok(Self(None));
        }
        let known = ModelKind::WORDS.iter().find(|(word, _)| is_word(value, word));
        let expected = "\"auto\", \"modified\" or \"conventional\"";
        known.map(|(_, model)| Self(Some(*model))).ok_or_else(|| errors::unexpected(name, expected, value))
    }
}

/// `drift`: whether there is one, or "auto".
pub(crate) struct AnyDrift(Option<bool>);

impl From<AnyDrift> for Option<bool> {
    fn from(AnyDrift(drift): AnyDrift) -> Self {
        drift
    }
}

#[py("Literal['auto'] | bool")]
impl Argument<'_> for AnyDrift {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_word(value, "auto") {
            return Ok(Self(None));
        }
        value
            .extract()
            .map(|drift| Self(Some(drift)))
            .map_err(|_| errors::unexpected(name, "\"auto\", True or False", value))
    }
}

/// Whether there is a Duhem operator; none leaves it open.
pub(crate) struct AnyDuhem(Option<bool>);

impl From<AnyDuhem> for Option<bool> {
    fn from(AnyDuhem(duhem): AnyDuhem) -> Self {
        duhem
    }
}

#[py("Literal['auto', 'fit'] | None")]
impl Argument<'_> for AnyDuhem {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            Ok(Self(Some(false)))
        } else if is_word(value, "auto") {
            Ok(Self(None))
        } else if is_word(value, "fit") {
            Ok(Self(Some(true)))
        } else {
            Err(errors::unexpected(name, "\"auto\", None or \"fit\"", value))
        }
    }
}
