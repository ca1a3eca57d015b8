//! What to identify, and what is known already: every option with its default, and what each must satisfy.
//!
//! The options of a term (creep, loop shift, ...) have their types where the term is: see `terms`.

use hysteresis_core::{Ratios, is_admissible};

use crate::error::Error;
use crate::records::record::{Intervals, Record, check_interval};
use crate::terms::creep::CreepModel;
use crate::terms::duhem::DuhemModel;
use crate::terms::dynamics::{AmplifierModel, DynamicsModel, ModesModel, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::{ModelKind, RatiosModel, Thresholds};
use crate::terms::relaxing_plays::RelaxingPlaysModel;
use crate::terms::side_columns::Sides;
use crate::terms::slow_gain::SlowGainModel;
use crate::terms::weights::{WeightBasis, WeightLaw};

/// The most operators: no record tells more thresholds apart.
const MAX_OPERATORS: usize = 4096;

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

impl From<Setting<Ratios>> for RatiosModel {
    fn from(ratios: Setting<Ratios>) -> Self {
        match ratios {
            Setting::Fit => Self::Fit,
            Setting::Fixed(ratios) => Self::Fixed(ratios),
        }
    }
}

/// The options of [`identify`](crate::identify): by default a modified model of 20 operators, or of more where that
/// predicts better, everything searched.
///
/// ```
/// use hysteresis_core::Ratios;
/// use hysteresis_identify::{Options, RatiosModel, Setting, Thresholds};
/// let options = Options {
///     thresholds: Thresholds::Uniform(16),
///     ratios: RatiosModel::Fixed(Ratios::PAPER),
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
    /// The ratios of the thresholds. Ignored by the conventional model.
    pub ratios: RatiosModel,
    /// Where the operators have their zero, in the unit of the input: searched in the range of the input and a fifth of
    /// that range beyond either end. That of the plays of [`RatiosModel::Auto`] moves their virgin state alone. It is
    /// where the first record begins; or 0, an end of the range of the input or its middle, where this lowers the sum
    /// of squares of the plays alone to less than half. That of the conventional model is the middle of the range.
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
    /// Which plays that relax to fit beside the hysteresis.
    #[cfg_attr(feature = "serde", serde(default))]
    pub relaxing_plays: RelaxingPlaysModel,
    /// Which slow gain to fit behind the hysteresis.
    #[cfg_attr(feature = "serde", serde(default))]
    pub slow_gain: SlowGainModel,
    /// Which Duhem operator to fit beside the hysteresis.
    #[cfg_attr(feature = "serde", serde(default))]
    pub duhem: DuhemModel,
    /// Which amplifier to fit in front of the hysteresis.
    pub amplifier: AmplifierModel,
    /// Which map of the drive to fit in front of the hysteresis.
    pub input_map: MapModel,
    /// Which map of the position to fit behind the hysteresis.
    pub output_map: MapModel,
    /// What the output lags the input besides, in seconds; in samples for records without a sampling interval.
    ///
    /// Searched from 0, and with dynamics from -1.5 samples, to a tenth of the shortest record. With dynamics a dead
    /// time that is not told from 0 by more than the noise is 0. The result never has one below zero, which nothing can
    /// run. Where one of half a sample or more would fit best, everything is searched again: without dynamics for
    /// [`DynamicsModel::Auto`], else with a dead time of 0 and the finding
    /// [`FindingCode::NegativeDeadTime`](crate::FindingCode::NegativeDeadTime).
    pub dead_time: Setting<f64>,
    /// How smooth the weights should be, 0 or more; 0 asks for nothing. [`Setting::Fit`], the default, leaves it to
    /// cross-validation over stretches of the records, with all other terms in the model.
    ///
    /// The sum of squared errors grows by `smoothness` U D: U is the sum of squares of the input about its mean in
    /// every record, D that of the second differences w_(i-1) - 2 w_i + w_(i+1) of the weights i = 1..n-1, of both
    /// families if split. So the number has no unit: at 1 such a difference costs what as large an error of the slope
    /// w_0 would. Where thresholds are uneven, w_i is taken per interval that r_i stands for, and the differences are
    /// divided ones: D is the same for the same density of weights.
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
            ratios: RatiosModel::default(),
            input_offset: Setting::Fit,
            dt: None,
            dynamics: DynamicsModel::default(),
            modes: ModesModel::default(),
            creep: CreepModel::default(),
            loop_shift: LoopShiftModel::default(),
            relaxing_plays: RelaxingPlaysModel::default(),
            slow_gain: SlowGainModel::default(),
            duhem: DuhemModel::default(),
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
    /// The number of operators; while it is left to cross-validation the fewest there may be, or 0 where these may be
    /// any.
    #[must_use]
    pub fn operators(&self) -> usize {
        self.thresholds.operators()
    }

    /// The sampling intervals of records with these options.
    ///
    /// # Errors
    /// As [`Intervals::of`]; [`Error::Core`] for a dead time that is given and longer than a record.
    pub(crate) fn intervals(&self, records: &[Record<'_>]) -> Result<Intervals, Error> {
        let intervals = Intervals::of(records, self.dt, self.needs_seconds())?;
        match self.dead_time {
            Setting::Fixed(dead_time) if !(dead_time >= 0.0 && dead_time < intervals.shortest_record()) => {
                let expected = "a number >= 0 below the length of the shortest record";
                Err(Error::domain("dead_time", None, expected, dead_time))
            }
            _ => Ok(intervals),
        }
    }

    /// What the weights may be, beside so many other columns.
    pub(crate) fn weight_basis(&self, sides: Sides) -> WeightBasis {
        WeightBasis::new(self.weights, &self.thresholds, sides)
    }

    /// The smoothness that was given; none while it is left to cross-validation.
    pub(crate) fn given_smoothness(&self) -> f64 {
        match self.smoothness {
            Setting::Fixed(smoothness) => smoothness,
            Setting::Fit => 0.0,
        }
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

    /// Whether the operators are plays: by their model, or as long as nothing tells that they are coupled.
    pub(crate) fn has_plays(&self) -> bool {
        self.model == ModelKind::Conventional || self.ratios == RatiosModel::Auto
    }

    /// The ratios that the operators have throughout a search, if they are known.
    pub(crate) fn known_ratios(&self) -> Option<Ratios> {
        match self.ratios {
            _ if self.has_plays() => Some(Ratios::PLAY),
            RatiosModel::Fixed(ratios) => Some(ratios),
            RatiosModel::Auto | RatiosModel::Fit => None,
        }
    }

    /// Whether it is open that the operators, which are plays so far, are coupled.
    pub(crate) fn chooses_coupling(&self) -> bool {
        self.model == ModelKind::Modified && self.has_plays()
    }

    /// The same with coupled plays whose ratios are searched, where these were left open.
    pub(crate) fn with_coupled_plays(&self) -> Self {
        let ratios = if self.ratios == RatiosModel::Auto { RatiosModel::Fit } else { self.ratios };
        Self { ratios, ..self.clone() }
    }

    /// Whether something was asked for that counts in seconds.
    pub(crate) fn needs_seconds(&self) -> bool {
        let shifts = !matches!(self.loop_shift, LoopShiftModel::None | LoopShiftModel::Auto);
        matches!(self.amplifier, AmplifierModel::Bandwidth(_))
            || self.order().is_some()
            || self.creep.has_terms()
            || shifts
            || self.relaxing_plays.has_terms()
            || self.has_slow_gain()
    }

    /// Whether a lag in front of the hysteresis may take the place of dynamics.
    pub(crate) fn leaves_lag_open(&self) -> bool {
        self.amplifier == AmplifierModel::Auto && self.dynamics == DynamicsModel::Auto
    }

    fn has_slow_gain(&self) -> bool {
        !matches!(self.slow_gain, SlowGainModel::None | SlowGainModel::Auto)
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
        let shifts = self.loop_shift != LoopShiftModel::None;
        let beside = shifts || self.relaxing_plays.has_terms();
        self.order().is_some() || self.creep.has_terms() || beside || self.has_slow_gain()
    }

    /// The same with second-order dynamics where several modes are asked for and dynamics are left open.
    pub(crate) fn with_asked_modes(&self) -> Self {
        let asks = self.modes.asks_for_dynamics() && self.dynamics == DynamicsModel::Auto;
        let dynamics = if asks { DynamicsModel::Order(Order::Second) } else { self.dynamics };
        Self { dynamics, ..self.clone() }
    }

    /// The same with the hysteresis and a dead time alone: the plays, and the Duhem operator of which it is known where
    /// its search begins.
    pub(crate) fn hysteresis_and_dead_time(&self) -> Self {
        let duhem = match &self.duhem {
            DuhemModel::Near(_) => self.duhem.clone(),
            DuhemModel::Auto | DuhemModel::None | DuhemModel::Fit => DuhemModel::None,
        };
        Self {
            duhem,
            dynamics: DynamicsModel::None,
            creep: CreepModel::None,
            loop_shift: LoopShiftModel::None,
            relaxing_plays: RelaxingPlaysModel::None,
            slow_gain: SlowGainModel::None,
            amplifier: AmplifierModel::None,
            input_map: MapModel::None,
            output_map: MapModel::None,
            ..self.clone()
        }
    }

    /// The same with no map but those that are asked for.
    pub(crate) fn without_open_maps(&self) -> Self {
        let asked = |map: MapModel| if map == MapModel::Auto { MapModel::None } else { map };
        Self { input_map: asked(self.input_map), output_map: asked(self.output_map), ..self.clone() }
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
        if let RatiosModel::Fixed(ratios) = self.ratios {
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
        self.amplifier.check(self.dynamics)?;
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

/// How far the errors of single samples count.
///
/// A glitch is a wrong sample of the position, or a run of a few: a drop-out to zero, a spike. It lies far from the
/// model and from the samples about it, and it begins and ends abruptly. What lasts more than 25 samples is an error of
/// the model, and so is what comes and goes smoothly, or what comes with most jumps of the drive.
///
/// ```
/// use hysteresis_identify::{Loss, Options};
/// assert_eq!(Options::default().loss, Loss::Auto);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Loss {
    /// Squares of the errors of all samples but glitches that lie more than seven standard deviations of the residual
    /// from the samples about them. Records without any give the same bits as [`Squares`](Self::Squares).
    #[default]
    Auto,
    /// Squares of the errors of all samples.
    Squares,
    /// As [`Auto`](Self::Auto) from 4.5 standard deviations on, for records that are known to have glitches. Of good
    /// samples with normal noise one in 150 000 lies that far.
    Robust,
}

impl Loss {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Squares, Self::Robust];

    /// Its name in lower case.
    ///
    /// ```
    /// use hysteresis_identify::Loss;
    /// assert_eq!(Loss::Robust.name(), "robust");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Squares => "squares",
            Self::Robust => "robust",
        }
    }

    /// How many standard deviations of the residual a glitch lies away at least; none where all samples count.
    pub(crate) fn limit(self) -> Option<f64> {
        match self {
            Self::Auto => Some(7.0),
            Self::Squares => None,
            Self::Robust => Some(4.5),
        }
    }
}
