//! What to identify, and what is known already.

use hysteresis_core::{Ratios, is_admissible};

use crate::amplifier_model::AmplifierModel;
use crate::creep_model::CreepModel;
use crate::error::Error;
use crate::fit::intervals::Intervals;
use crate::fit::variety::Variety;
use crate::loop_shift_model::LoopShiftModel;
use crate::loss::Loss;
use crate::map_model::MapModel;
use crate::modes_model::ModesModel;
use crate::record::Record;
pub use crate::thresholds::Thresholds;

/// The most operators: no record tells more thresholds apart.
const MAX_OPERATORS: usize = 4096;

/// Which model to fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ModelKind {
    /// The conventional Prandtl-Ishlinskii model (CPI), equation (4): plays. It has no ratios, and its input offset
    /// moves nothing but the virgin state: [`Setting::Fit`] puts it at the middle of the input range.
    Conventional,
    /// The modified Prandtl-Ishlinskii model (MPI), equation (6): coupled plays.
    #[default]
    Modified,
}

/// What the weights of the operators may be; never negative, and that of the identity at least a thousandth of the sum of all others, so
/// that the model is invertible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum WeightLaw {
    /// One of the other laws, as cross-validation over stretches of the records asks for: of
    /// [`Quadratic`](Self::Quadratic), [`Free`](Self::Free) and [`Split`](Self::Split) the first that predicts stretches
    /// that it was not fitted to as well as the best: the ratio of their mean square errors is 1 within its standard
    /// error. For the conventional model there are the first two.
    #[default]
    Auto,
    /// Any w_i >= 0.
    Free,
    /// w_0 >= 0, and w_i = c_0 + c_1 i + c_2 i^2 >= 0 for i = 1..n-1: the four numbers behind the tables of the paper.
    /// With fewer than five operators that is no condition.
    Quadratic,
    /// Weights of their own for the family of one-sided plays below zero; the identity has one for both. For the
    /// modified model only.
    Split,
}

/// A parameter that is searched, or known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Setting<T> {
    /// To be found.
    #[default]
    Fit,
    /// Known beforehand.
    Fixed(T),
}

/// The order of linear dynamics, of unit static gain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// A first-order lag.
    First,
    /// Second-order dynamics: a resonance, or two lags.
    #[default]
    Second,
}

/// Which linear dynamics to fit behind the hysteresis, of unit static gain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DynamicsModel {
    /// None.
    None,
    /// Of second order, if the records tell them, or of first order where they do not tell overdamped ones from that, or where a lag
    /// beside a map predicts better than a dead time; none without a sampling interval.
    #[default]
    Auto,
    /// These.
    Order(Order),
}

/// The options of [`identify`](crate::identify): by default a modified model of 20 operators, or of more where that predicts better,
/// everything searched.
///
/// ```
/// use hysteresis_core::Ratios;
/// use hysteresis_identify::{Options, Setting, Thresholds};
/// let options = Options {
///     thresholds: Thresholds::Uniform(16),
///     ratios: Setting::Fixed(Ratios::PAPER),
///     ..Options::default()
/// };
/// assert_eq!(options.dead_time, Setting::Fit);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Options {
    /// Which model.
    pub model: ModelKind,
    /// What its weights may be.
    pub weights: WeightLaw,
    /// How many operators, and where.
    pub thresholds: Thresholds,
    /// ra/r, rb/r, rc/r: searched in 2 >= ra >= rb >= 0, 1 >= rc >= 0. Ignored by the conventional model.
    pub ratios: Setting<Ratios>,
    /// Where the operators have their zero, in the unit of the input: searched in the range of the input and a
    /// fifth of that range beyond either end.
    pub input_offset: Setting<f64>,
    /// The sampling interval of the records in seconds, for those that do not have their own
    /// ([`Record::sampled_every`](crate::Record::sampled_every)). Without any, only the hysteresis can be fitted.
    pub dt: Option<f64>,
    /// Which linear dynamics to fit behind the hysteresis.
    pub dynamics: DynamicsModel,
    /// How many modes these dynamics have.
    #[cfg_attr(feature = "serde", serde(default))]
    pub modes: ModesModel,
    /// Which creep to fit behind the hysteresis.
    pub creep: CreepModel,
    /// Which loop shift to fit beside the hysteresis.
    pub loop_shift: LoopShiftModel,
    /// Which amplifier to fit in front of the hysteresis.
    pub amplifier: AmplifierModel,
    /// Which map of the drive to fit in front of the hysteresis.
    pub input_map: MapModel,
    /// Which map of the position to fit behind the hysteresis.
    pub output_map: MapModel,
    /// What the output lags the input besides, in seconds; in samples for records without a sampling interval.
    ///
    /// Searched from 0, and with dynamics from -1.5 samples, to a tenth of the shortest record. With dynamics a dead time
    /// that is not told from 0 by more than the noise is 0, and a negative one gives a finding: see
    /// [`FindingCode::NegativeDeadTime`](crate::FindingCode::NegativeDeadTime).
    pub dead_time: Setting<f64>,
    /// How smooth the weights should be, 0 or more; 0 asks for nothing. [`Setting::Fit`], the default, leaves it to
    /// cross-validation over stretches of the records, with all other terms in the model.
    ///
    /// The sum of squared errors grows by `smoothness` U D: U is the sum of squares of the input about its mean in every
    /// record, D that of the second differences w_(i-1) - 2 w_i + w_(i+1) of the weights i = 1..n-1, of both families if
    /// split. So the number has no unit: at 1 such a difference costs what as large an error of the slope w_0 would.
    /// Where thresholds are uneven, w_i is taken per interval that r_i stands for, and the differences are divided ones:
    /// D is the same for the same density of weights.
    pub smoothness: Setting<f64>,
    /// Whether glitches of the position are left out of the fit.
    pub loss: Loss,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: ModelKind::default(),
            weights: WeightLaw::default(),
            thresholds: Thresholds::Refined,
            ratios: Setting::Fit,
            input_offset: Setting::Fit,
            dt: None,
            dynamics: DynamicsModel::default(),
            modes: ModesModel::default(),
            creep: CreepModel::default(),
            loop_shift: LoopShiftModel::default(),
            amplifier: AmplifierModel::default(),
            input_map: MapModel::default(),
            output_map: MapModel::default(),
            dead_time: Setting::Fit,
            smoothness: Setting::Fit,
            loss: Loss::default(),
        }
    }
}

impl Options {
    /// The number of operators; while it is left to cross-validation the fewest there may be, or 0 where these may be any.
    #[must_use]
    pub fn operators(&self) -> usize {
        self.thresholds.operators()
    }

    /// Whether the weight law exists for this model and is not the same as another one.
    pub(crate) fn is_law_of_its_own(&self) -> bool {
        match self.weights {
            WeightLaw::Auto => false,
            WeightLaw::Free => true,
            WeightLaw::Quadratic => self.operators() > 4,
            WeightLaw::Split => self.model == ModelKind::Modified && self.operators() > 1,
        }
    }

    /// Whether something was asked for that counts in seconds.
    pub(crate) fn needs_seconds(&self) -> bool {
        let shifts = !matches!(self.loop_shift, LoopShiftModel::None | LoopShiftModel::Auto);
        self.order().is_some() || self.creep.has_terms() || shifts
    }

    /// The order of the dynamics, if there are any; none while they are left open.
    pub(crate) fn order(&self) -> Option<Order> {
        match self.dynamics {
            DynamicsModel::Order(order) => Some(order),
            DynamicsModel::None | DynamicsModel::Auto => None,
        }
    }

    /// Whether something is fitted besides the hysteresis and a dead time.
    pub(crate) fn is_joint(&self) -> bool {
        self.order().is_some() || self.creep.has_terms() || self.loop_shift != LoopShiftModel::None
    }

    /// The same with second-order dynamics where several modes are asked for and dynamics are left open.
    pub(crate) fn with_asked_modes(&self) -> Self {
        let asks = self.modes.asks_for_dynamics() && self.dynamics == DynamicsModel::Auto;
        let dynamics = if asks { DynamicsModel::Order(Order::Second) } else { self.dynamics };
        Self { dynamics, ..self.clone() }
    }

    /// The same with nothing left open that the records cannot tell: without a sampling interval, with few samples, or with loops
    /// that are all alike, there are no terms but those that were asked for. Rests tell creep whatever the loops are.
    pub(crate) fn resolved(&self, records: &[Record<'_>]) -> Result<Self, Error> {
        /// A term is left to cross-validation from so many samples on for each operator.
        const MIN_SAMPLES_PER_OPERATOR: usize = 20;
        let intervals = Intervals::of(records, self)?;
        let samples: usize = records.iter().map(Record::fitted_samples).sum();
        let tells = intervals.are_seconds() && samples >= MIN_SAMPLES_PER_OPERATOR * self.operators().max(4);
        let variety = Variety::of(records);
        let creeps = tells && (variety.apart_from_time || variety.rests);
        let creeps = creeps && CreepModel::Slow.basis(intervals.longest_record(), intervals.smallest()).is_ok();
        let mut resolved = self.clone();
        if !tells && self.dynamics == DynamicsModel::Auto {
            resolved.dynamics = DynamicsModel::None;
        }
        if !creeps && self.creep == CreepModel::Auto {
            resolved.creep = if tells { CreepModel::UnderWay } else { CreepModel::None };
        }
        if !(tells && variety.apart_from_time) && self.loop_shift == LoopShiftModel::Auto {
            resolved.loop_shift = LoopShiftModel::None;
        }
        // Loops that are all alike tell a map from weights as little. Conventional plays are for comparison, as they are.
        let bends = tells && variety.amplitudes && self.model == ModelKind::Modified;
        for map in [&mut resolved.input_map, &mut resolved.output_map] {
            if !bends && *map == MapModel::Auto {
                *map = MapModel::None;
            }
        }
        Ok(resolved)
    }

    /// The same with dynamics, creep and a loop shift that are left open in the model, the last of the usual time constant.
    pub(crate) fn with_open_terms(&self, intervals: &Intervals) -> Self {
        let mut all = self.clone();
        if self.dynamics == DynamicsModel::Auto {
            all.dynamics = DynamicsModel::Order(Order::Second);
        }
        if self.creep == CreepModel::Auto {
            all.creep = CreepModel::SlowAndFast;
        }
        if self.loop_shift == LoopShiftModel::Auto {
            all.loop_shift = LoopShiftModel::usual(intervals.longest_record(), intervals.smallest());
        }
        all
    }

    /// The same with the hysteresis and a dead time alone.
    pub(crate) fn hysteresis_and_dead_time(&self) -> Self {
        Self {
            dynamics: DynamicsModel::None,
            creep: CreepModel::None,
            loop_shift: LoopShiftModel::None,
            amplifier: AmplifierModel::None,
            input_map: MapModel::None,
            output_map: MapModel::None,
            ..self.clone()
        }
    }

    /// The same with a dead time that is searched: it takes the place of their lag.
    pub(crate) fn hysteresis_alone(&self) -> Self {
        Self { dead_time: Setting::Fit, ..self.hysteresis_and_dead_time() }
    }

    /// Checks everything that was given but what depends on the records.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.operators() == 0 && !self.thresholds.are_counted_by_validation() {
            return Err(Error::NoOperators);
        }
        if self.operators() > MAX_OPERATORS {
            return Err(Error::whole("operators", "at most 4096", self.operators()));
        }
        if self.weights == WeightLaw::Split && self.model == ModelKind::Conventional {
            return Err(Error::SplitConventional);
        }
        if let Thresholds::Given(thresholds) = &self.thresholds {
            check_thresholds(thresholds)?;
        }
        if let Setting::Fixed(ratios) = self.ratios {
            let offsets = hysteresis_core::Offsets::default();
            hysteresis_core::ModifiedPrandtlIshlinskii::from_ratios(&[1.0], &[0.0], ratios, offsets)?;
        }
        let domain = |parameter, expected, got| Err(Error::domain(parameter, None, expected, got));
        match self.input_offset {
            Setting::Fixed(offset) if !is_admissible(offset) => {
                return domain("input_offset", "a finite number (at most 1e100 in magnitude)", offset);
            }
            _ => {}
        }
        match self.smoothness {
            Setting::Fixed(smoothness) if !(is_admissible(smoothness) && smoothness >= 0.0) => {
                return domain("smoothness", "a finite number >= 0 (at most 1e100)", smoothness);
            }
            _ => {}
        }
        self.modes.check(!matches!(self.dynamics, DynamicsModel::None | DynamicsModel::Order(Order::First)))?;
        self.amplifier.check(self.order() == Some(Order::Second))?;
        self.dt.map_or(Ok(()), check_interval)
    }
}

fn check_thresholds(thresholds: &[f64]) -> Result<(), Error> {
    let mut last = f64::NEG_INFINITY;
    for (i, r) in thresholds.iter().enumerate() {
        if !(is_admissible(*r) && *r >= 0.0 && *r > last) {
            let expected = "finite thresholds >= 0 that strictly increase";
            return Err(Error::domain("thresholds", Some(i), expected, *r));
        }
        last = *r;
    }
    Ok(())
}

/// Checks a sampling interval in seconds.
pub(crate) fn check_interval(dt: f64) -> Result<(), Error> {
    if is_admissible(dt) && dt > 1e-90 {
        return Ok(());
    }
    Err(Error::domain("dt", None, "a finite number of seconds above 0", dt))
}
