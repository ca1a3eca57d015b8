//! What to identify behind a known hysteresis, and what is known already.

use crate::creep_model::CreepModel;
use crate::loop_shift_model::LoopShiftModel;
use crate::options::{DynamicsModel, ModelKind, Options, Order, Setting, Thresholds, WeightLaw};

/// The options of [`identify_dynamics`](crate::identify_dynamics).
///
/// ```
/// use hysteresis_identify::{DynamicsOptions, Order, Setting};
/// let options = DynamicsOptions { dead_time: Setting::Fixed(1e-4), ..DynamicsOptions::new(1e-4) };
/// assert_eq!(options.order, Order::Second);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DynamicsOptions {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Which dynamics.
    pub order: Order,
    /// What the output lags the input besides, in seconds: as [`Options::dead_time`].
    pub dead_time: Setting<f64>,
    /// Which creep.
    pub creep: CreepModel,
}

impl DynamicsOptions {
    /// Second-order dynamics and a dead time, both searched, without creep.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self { dt, order: Order::default(), dead_time: Setting::Fit, creep: CreepModel::None }
    }

    /// The options of a joint identification in which the output of the known hysteresis is the input: one operator, the
    /// identity, whose weight is the gain.
    pub(super) fn joint(&self) -> Options {
        Options {
            model: ModelKind::Conventional,
            weights: WeightLaw::Free,
            thresholds: Thresholds::Given(vec![0.0]),
            input_offset: Setting::Fixed(0.0),
            dt: Some(self.dt),
            dynamics: DynamicsModel::Order(self.order),
            dead_time: self.dead_time,
            creep: self.creep.clone(),
            loop_shift: LoopShiftModel::None,
            smoothness: Setting::Fixed(0.0),
            ..Options::default()
        }
    }
}
