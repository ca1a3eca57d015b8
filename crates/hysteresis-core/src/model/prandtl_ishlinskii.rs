//! The conventional model, the modified one, and a model of either kind.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::validity::{Offsets, Ratios, check_invertible, check_weights, slope_range};
use crate::error::{Error, check_all_finite, check_length, check_non_negative};
use crate::fingerprint::Fingerprint;
use crate::operator::{CoupledPlay, Play};

/// The conventional Prandtl-Ishlinskii model (CPI), equation (4): y = `output_offset` + sum_i w_i z_i.
///
/// z_i is the [`Play`] of threshold r_i at the input x - `input_offset`. Weights in output unit per input unit,
/// thresholds in the unit of the input. Immutable; streams share it.
///
/// ```
/// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut forward = model.forward();
/// assert_eq!(forward.step(4.0), 4.0 + 0.5 * 2.0);
/// assert_eq!(forward.step(3.0), 3.0 + 0.5 * 2.0); // the play holds
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PrandtlIshlinskii {
    weights: Box<[f64]>,
    operators: Box<[Play]>,
    offsets: Offsets,
}

impl PrandtlIshlinskii {
    /// A model of `weights.len()` plays.
    ///
    /// # Errors
    /// [`Error::Empty`] without operators, [`Error::Length`] for unequal lengths, [`Error::Domain`] for a weight
    /// or offset that is not finite or a threshold that is negative or not finite.
    pub fn new(weights: &[f64], thresholds: &[f64], offsets: Offsets) -> Result<Self, Error> {
        check_weights("weights", weights)?;
        check_length("thresholds", weights.len(), thresholds.len())?;
        let play = |(i, r): (usize, &f64)| check_non_negative("thresholds", Some(i), *r).and_then(Play::new);
        let operators: Result<_, Error> = thresholds.iter().enumerate().map(play).collect();
        Ok(Self { weights: weights.into(), operators: operators?, offsets: offsets.check()? })
    }

    /// The weights w_i.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The operators, each with its threshold r_i.
    #[must_use]
    pub fn operators(&self) -> &[Play] {
        &self.operators
    }

    /// The offsets of input and output.
    #[must_use]
    pub fn offsets(&self) -> Offsets {
        self.offsets
    }

    /// Whether the sufficient condition for an inverse holds, and if not, why not.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] unless the weight at threshold zero exceeds the sum of the negative weights.
    pub fn check_invertible(&self) -> Result<(), Error> {
        check_invertible::<f64>(self.members())
    }

    /// The least and the greatest slope dy/dx that the model can have: (w_0, sum of w_i) with no negative weight.
    ///
    /// ```
    /// use hysteresis_core::{Offsets, PrandtlIshlinskii};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5, 0.25], &[0.0, 2.0, 4.0], Offsets::default())?;
    /// assert_eq!(model.slope_range(), (1.0, 1.75));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        slope_range(self.members())
    }

    /// The weight, above and below zero, of every operator and whether it is an identity.
    fn members(&self) -> impl Iterator<Item = (f64, f64, bool)> {
        self.weights.iter().zip(&self.operators).map(|(w, z)| (*w, *w, z.r() == 0.0))
    }
}

/// The modified Prandtl-Ishlinskii model (MPI), equation (6): y = `output_offset` + sum_i w_i z_i.
///
/// z_i is the [`CoupledPlay`] of thresholds r_i, ra_i, rb_i, rc_i at the input x - `input_offset`. Weights in
/// output unit per input unit (um/V), thresholds in the unit of the input (V). Immutable; streams share it.
///
/// A coupled play is the difference of two one-sided plays, z_i = p_i(x; r_i, rb_i) - p_i(-x; ra_i, rc_i), of which
/// one is always zero. A *split* model weighs them apart: y = `output_offset` + sum_i (w_i p_i(x; r_i, rb_i) -
/// v_i p_i(-x; ra_i, rc_i)), which is w_i z_i where z_i > 0 and v_i z_i where z_i < 0. See
/// [`with_negative_weights`](Self::with_negative_weights).
///
/// ```
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let model = ModifiedPrandtlIshlinskii::from_ratios(
///     &[4.0e-3, 3.0e-4, 2.0e-4],
///     &[0.0, 25.0, 50.0],
///     Ratios::PAPER,
///     Offsets::default(),
/// )?;
/// let mut actuator = model.forward();
/// let mut inverse = model.inverse(None)?;
/// let drive = inverse.step(0.2);
/// assert!((actuator.step(drive) - 0.2).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ModifiedPrandtlIshlinskii {
    weights: Box<[f64]>,
    /// v_i, unless they equal w_i: then absent, so that equal models compare equal.
    weights_negative: Option<Box<[f64]>>,
    operators: Box<[CoupledPlay]>,
    offsets: Offsets,
}

impl ModifiedPrandtlIshlinskii {
    /// A model of `weights.len()` coupled plays with the thresholds given one by one.
    ///
    /// # Errors
    /// [`Error::Empty`] without operators, [`Error::Length`] for unequal lengths, [`Error::Domain`] for a number
    /// that is not finite or thresholds that break r >= rc >= 0 or ra >= rb >= 0.
    pub fn new(
        weights: &[f64],
        r: &[f64],
        ra: &[f64],
        rb: &[f64],
        rc: &[f64],
        offsets: Offsets,
    ) -> Result<Self, Error> {
        check_weights("weights", weights)?;
        for (name, values) in [("r", r), ("ra", ra), ("rb", rb), ("rc", rc)] {
            check_length(name, weights.len(), values.len())?;
        }
        let operators = (0..weights.len())
            .map(|i| CoupledPlay::indexed(Some(i), r[i], ra[i], rb[i], rc[i]))
            .collect::<Result<Vec<_>, _>>()?;
        Self::of_operators(weights, operators, offsets)
    }

    /// A model whose operators share the proportions of their thresholds, as in Tables I and II.
    ///
    /// # Errors
    /// As [`new`](Self::new); ratios must satisfy ra >= rb >= 0 and 1 >= rc >= 0.
    pub fn from_ratios(weights: &[f64], r: &[f64], ratios: Ratios, offsets: Offsets) -> Result<Self, Error> {
        check_weights("weights", weights)?;
        check_length("r", weights.len(), r.len())?;
        let ratios = ratios.check()?;
        let operators = r.iter().enumerate().map(|(i, r)| ratios.operator(i, *r)).collect::<Result<Vec<_>, _>>()?;
        Self::of_operators(weights, operators, offsets)
    }

    fn of_operators(weights: &[f64], operators: Vec<CoupledPlay>, offsets: Offsets) -> Result<Self, Error> {
        let (weights, offsets) = (weights.into(), offsets.check()?);
        Ok(Self { weights, weights_negative: None, operators: operators.into(), offsets })
    }

    /// The same model with other weights v_i for the family below zero; those of the family above stay w_i.
    ///
    /// With v_i = w_i for every i this is the model without a split, and equal to it.
    ///
    /// ```
    /// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
    /// let (r, ratios) = ([0.0, 2.0], Ratios::PLAY);
    /// let model = ModifiedPrandtlIshlinskii::from_ratios(&[1.0, 0.5], &r, ratios, Offsets::default())?
    ///     .with_negative_weights(&[1.0, 0.25])?;
    /// let mut forward = model.forward();
    /// assert_eq!(forward.step(4.0), 4.0 + 0.5 * 2.0);
    /// assert_eq!(forward.step(-4.0), -4.0 - 0.25 * 2.0);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one for each operator, [`Error::Domain`] for one that is not finite.
    pub fn with_negative_weights(mut self, weights_negative: &[f64]) -> Result<Self, Error> {
        check_length("weights_negative", self.weights.len(), weights_negative.len())?;
        check_all_finite("weights_negative", weights_negative)?;
        self.weights_negative = (*weights_negative != *self.weights).then(|| weights_negative.into());
        Ok(self)
    }

    /// The weights w_i; in a split model those of the family above zero.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The weights v_i of the family below zero: those of [`weights`](Self::weights) unless the model is split.
    #[must_use]
    pub fn weights_negative(&self) -> &[f64] {
        self.weights_negative.as_deref().unwrap_or(&self.weights)
    }

    /// Whether the two families have weights of their own.
    #[must_use]
    pub fn is_split(&self) -> bool {
        self.weights_negative.is_some()
    }

    /// The weights (w_i, v_i) and the operator, one by one.
    pub(crate) fn members(&self) -> impl Iterator<Item = (f64, f64, CoupledPlay)> + Clone {
        let weights = self.weights.iter().zip(self.weights_negative());
        weights.zip(&self.operators).map(|((w, v), operator)| (*w, *v, *operator))
    }

    /// The operators, each with its four thresholds.
    #[must_use]
    pub fn operators(&self) -> &[CoupledPlay] {
        &self.operators
    }

    /// The offsets of input and output.
    #[must_use]
    pub fn offsets(&self) -> Offsets {
        self.offsets
    }

    /// A number that tells this model from others, by the values of its parameters.
    pub(crate) fn fingerprint(&self) -> u64 {
        let mut hash = Fingerprint::new();
        hash.numbers(&self.weights);
        hash.numbers(self.weights_negative());
        for play in &self.operators {
            hash.numbers(&[play.r(), play.ra(), play.rb(), play.rc()]);
        }
        hash.numbers(&[self.offsets.input, self.offsets.output]);
        hash.finish()
    }

    /// Whether the sufficient condition for an inverse holds, and if not, why not.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] unless the weight of the identity operators exceeds the sum of the negative weights;
    /// of a split operator the smaller weight counts.
    pub fn check_invertible(&self) -> Result<(), Error> {
        check_invertible::<f64>(self.members().map(|(w, v, z)| (w, v, z.is_identity())))
    }

    /// The least and the greatest slope dy/dx that the model can have: (w_0, sum of w_i) with no negative weight.
    ///
    /// Of a split operator either weight counts: the smaller for the least, the greater for the greatest slope.
    ///
    /// ```
    /// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
    /// let model = ModifiedPrandtlIshlinskii::from_ratios(&[1.0, 0.5], &[0.0, 2.0], Ratios::PAPER, Offsets::default())?;
    /// assert_eq!(model.slope_range(), (1.0, 1.5));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        slope_range(self.members().map(|(w, v, z)| (w, v, z.is_identity())))
    }
}

/// No hysteresis: the output is the input.
///
/// ```
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Process};
/// let mut forward = ModifiedPrandtlIshlinskii::default().forward();
/// assert_eq!([5.0, -2.0].map(|x| forward.step(x)), [5.0, -2.0]);
/// ```
impl Default for ModifiedPrandtlIshlinskii {
    fn default() -> Self {
        let identity = CoupledPlay::from(Play::default());
        Self {
            weights: [1.0].into(),
            weights_negative: None,
            operators: [identity].into(),
            offsets: Offsets::default(),
        }
    }
}

/// A play is a coupled play with four equal thresholds, so the conventional model is a modified one.
impl From<&PrandtlIshlinskii> for ModifiedPrandtlIshlinskii {
    fn from(model: &PrandtlIshlinskii) -> Self {
        Self {
            weights: model.weights().into(),
            weights_negative: None,
            operators: model.operators().iter().map(|play| CoupledPlay::from(*play)).collect(),
            offsets: model.offsets(),
        }
    }
}

/// A model of either kind, as a file holds it.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Play operators.
    Conventional(PrandtlIshlinskii),
    /// Coupled-play operators.
    Modified(ModifiedPrandtlIshlinskii),
}

impl From<PrandtlIshlinskii> for Model {
    fn from(model: PrandtlIshlinskii) -> Self {
        Self::Conventional(model)
    }
}

impl From<ModifiedPrandtlIshlinskii> for Model {
    fn from(model: ModifiedPrandtlIshlinskii) -> Self {
        Self::Modified(model)
    }
}

impl From<Model> for ModifiedPrandtlIshlinskii {
    fn from(model: Model) -> Self {
        match model {
            Model::Conventional(model) => (&model).into(),
            Model::Modified(model) => model,
        }
    }
}
