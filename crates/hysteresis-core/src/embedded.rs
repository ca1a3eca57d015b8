//! Models and streams of a fixed size, without an allocator: for firmware.
//!
//! [`Model<T, N>`](Model) has room for N operators and works with numbers T, `f64` or `f32`. [`Forward`] and
//! [`Inverse`] are its streams; each owns its model, or borrows one that several share. They run on the same engine as
//! the streams on the heap: with `f64` their outputs are those of [`crate::Forward`](../struct.Forward.html) and
//! [`crate::Inverse`](../struct.Inverse.html) bit for bit.
//!
//! ```
//! use hysteresis_core::embedded::{Inverse, Model};
//! use hysteresis_core::{Offsets, Process, Ratios};
//! let (weights, r) = ([4.3e-3, 1.7e-3, 1.7e-3], [0.0, 150.0, 300.0]); // um/V, V
//! let model = Model::<f32, 3>::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default())?;
//! let mut inverse = Inverse::new(model, Some((-500.0, 500.0)))?; // V
//! let drive: f32 = inverse.step(1.5); // V for 1.5 um: in the interrupt of a timer
//! assert!((drive - 292.5).abs() < 1e-3 && !inverse.saturated());
//! # Ok::<(), hysteresis_core::Error>(())
//! ```
//!
//! **Single precision.** Sums over operators are kept in `f64`, whatever T is, and only the line on which a stream is
//! has numbers T. So the error of `f32` does not grow with operators, turning points or time. With u = 6e-8, half of
//! the distance from 1 to the next `f32`, an output is off by at most u times
//!
//! ```text
//! 4 |slope x| + 2 |offset of the line| + sum_i w_i a_i + |output offset| + |y|
//! ```
//!
//! for rounding of the input x behind its offset, of the line, of the thresholds a_i and of the sum. Over the range of
//! the drive that is about 8 u, 5e-7 of the range of the output. The tests ask for 1e-6 of that range, with up to 100
//! operators and signals of every kind, for the model and for the model behind its inverse.

use crate::engine::{Engine, Evaluates, Families, Point};
use crate::error::{Error, check_length, check_non_negative};
use crate::model::{Offsets, Ratios, check_invertible, check_weights};
use crate::operator::{CoupledPlay, Play};
use crate::process::Process;
use crate::real::{Real, check_limits};
use crate::store::Inline;
use crate::stream::{ForwardCore, InverseCore, Walk};

/// A model of up to N operators, equations (4) and (6), ready to run, without an allocator.
///
/// Constants come in `f64`, whatever T is, so they can be those of a file; weights in output unit per input unit
/// (um/V), thresholds in the unit of the input (V). With `f32` it takes about 128 bytes for each of N, with `f64` 144;
/// see docs/firmware.md. The thresholds must be nested: in the order of r no rb may fall, and in the order of ra no rc.
/// Models of proportional thresholds and conventional models always are.
///
/// ```
/// use hysteresis_core::embedded::{Forward, Model};
/// use hysteresis_core::{Offsets, Process};
/// let model = Model::<f64, 8>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?; // room is left
/// let (mut one, mut other) = (Forward::new(&model), Forward::new(&model)); // two streams of one model
/// assert_eq!((one.step(4.0), one.step(3.0), other.step(3.0)), (5.0, 4.0, 3.5));
/// let error = Model::<f64, 1>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap_err();
/// assert_eq!(error.to_string(), "weights: expected at most as many as the model has room for, got 2");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Model<T: Real, const N: usize> {
    families: Families<T, Inline<N>>,
    pub(super) origin: Point<T>,
    pub(super) invertible: Result<(), Error>,
}

/// A model, or a reference to one: what a stream is made from.
pub trait Holds<T: Real, const N: usize>: Evaluates<Number = T, Store = Inline<N>> {
    /// The model.
    fn model(&self) -> &Model<T, N>;
}

impl<T: Real, const N: usize> Evaluates for Model<T, N> {
    type Number = T;
    type Store = Inline<N>;

    #[inline(always)]
    fn families(&self) -> &Families<T, Inline<N>> {
        &self.families
    }
}

impl<T: Real, const N: usize> Evaluates for &Model<T, N> {
    type Number = T;
    type Store = Inline<N>;

    #[inline(always)]
    fn families(&self) -> &Families<T, Inline<N>> {
        &self.families
    }
}

impl<T: Real, const N: usize> Holds<T, N> for Model<T, N> {
    fn model(&self) -> &Model<T, N> {
        self
    }
}

impl<T: Real, const N: usize> Holds<T, N> for &Model<T, N> {
    fn model(&self) -> &Model<T, N> {
        self
    }
}

impl<T: Real, const N: usize> Model<T, N> {
    /// Coupled plays with the thresholds given one by one.
    ///
    /// # Errors
    /// [`Error::Empty`] without operators, [`Error::Whole`] for more than N, [`Error::Length`] for unequal lengths,
    /// [`Error::Domain`] for a number that is not finite or beyond 1e100 (`f32`: 1e11), thresholds that break r >= rc
    /// >= 0 or ra >= rb >= 0, or that are not nested.
    ///
    /// ```
    /// use hysteresis_core::Offsets;
    /// use hysteresis_core::embedded::Model;
    /// let (w, r, ra) = ([1.0, 0.5, 0.5], [0.0, 2.0, 3.0], [0.0, 2.0, 2.0]);
    /// let model = |rb: [f64; 3]| Model::<f32, 3>::new(&w, &r, &ra, &rb, &[0.0, 1.0, 1.0], Offsets::default());
    /// assert!(model([0.0, 1.0, 1.5]).is_ok());
    /// let error = model([0.0, 1.5, 1.0]).unwrap_err();
    /// assert_eq!(error.parameter(), Some("rb"));
    /// assert!(error.to_string().contains("nested"));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn new(
        weights: &[f64],
        r: &[f64],
        ra: &[f64],
        rb: &[f64],
        rc: &[f64],
        offsets: Offsets,
    ) -> Result<Self, Error> {
        Self::split(weights, weights, [r, ra, rb, rc], offsets)
    }

    /// The same with weights of their own for the family below zero, and the thresholds r, ra, rb and rc side by side:
    /// the split model.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn split(
        weights: &[f64],
        weights_negative: &[f64],
        thresholds: [&[f64]; 4],
        offsets: Offsets,
    ) -> Result<Self, Error> {
        check_room::<N>(weights)?;
        for (name, values) in ["r", "ra", "rb", "rc"].into_iter().zip(thresholds) {
            check_length(name, weights.len(), values.len())?;
        }
        let at = move |i: usize| thresholds.map(|values| values.get(i).copied().unwrap_or_default());
        Self::of(weights, weights_negative, offsets, move |i| {
            let [r, ra, rb, rc] = at(i);
            CoupledPlay::indexed(Some(i), r, ra, rb, rc)
        })
    }

    /// Coupled plays that share the proportions of their thresholds, as in Tables I and II.
    ///
    /// # Errors
    /// As [`new`](Self::new); ratios must satisfy ra >= rb >= 0 and 1 >= rc >= 0.
    pub fn from_ratios(weights: &[f64], r: &[f64], ratios: Ratios, offsets: Offsets) -> Result<Self, Error> {
        check_room::<N>(weights)?;
        check_length("r", weights.len(), r.len())?;
        let ratios = ratios.check()?;
        let at = move |i: usize| ratios.operator(i, r.get(i).copied().unwrap_or_default());
        Self::of(weights, weights, offsets, at)
    }

    /// The conventional model: plays.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn conventional(weights: &[f64], thresholds: &[f64], offsets: Offsets) -> Result<Self, Error> {
        check_room::<N>(weights)?;
        check_length("thresholds", weights.len(), thresholds.len())?;
        let at = move |i: usize| {
            let r = thresholds.get(i).copied().unwrap_or_default();
            check_non_negative("thresholds", Some(i), r).and_then(Play::new).map(CoupledPlay::from)
        };
        Self::of(weights, weights, offsets, at)
    }

    /// From checked lengths; `operator` makes operator i.
    fn of(
        weights: &[f64],
        weights_negative: &[f64],
        offsets: Offsets,
        operator: impl Fn(usize) -> Result<CoupledPlay, Error> + Clone,
    ) -> Result<Self, Error> {
        check_weights("weights", weights)?;
        check_length("weights_negative", weights.len(), weights_negative.len())?;
        check_weights("weights_negative", weights_negative)?;
        for (i, (w, v)) in weights.iter().zip(weights_negative).enumerate() {
            fits::<T>("weights", Some(i), *w)?;
            fits::<T>("weights_negative", Some(i), *v)?;
            let z = operator(i)?;
            fits::<T>("r", Some(i), z.r())?;
            fits::<T>("ra", Some(i), z.ra())?;
        }
        let offsets = offsets.check()?;
        fits::<T>("input_offset", None, offsets.input)?;
        fits::<T>("output_offset", None, offsets.output)?;
        let members = weights.iter().zip(weights_negative).enumerate();
        // All were made once above.
        let members = members.filter_map(|(i, (w, v))| operator(i).ok().map(|z| (*w, *v, z)));
        let families = Families::of(members.clone())?;
        let invertible = check_invertible::<T>(members.map(|(w, v, z)| (w, v, z.is_identity())));
        Ok(Self { families, origin: offsets.into(), invertible })
    }

    /// Whether the sufficient condition for an inverse holds, and if not, why not.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] unless the weight of the identity operators exceeds the sum of the negative weights, by
    /// as much as T can tell.
    pub fn check_invertible(&self) -> Result<(), Error> {
        self.invertible
    }
}

/// The same model, if it has no more than N operators.
#[cfg(feature = "alloc")]
impl<T: Real, const N: usize> TryFrom<&crate::ModifiedPrandtlIshlinskii> for Model<T, N> {
    type Error = Error;

    fn try_from(model: &crate::ModifiedPrandtlIshlinskii) -> Result<Self, Error> {
        check_room::<N>(model.weights())?;
        let operators = model.operators();
        let at = move |i: usize| operators.get(i).copied().ok_or(Error::Empty { parameter: "weights" });
        Self::of(model.weights(), model.weights_negative(), model.offsets(), at)
    }
}

fn check_room<const N: usize>(weights: &[f64]) -> Result<(), Error> {
    if weights.len() <= N {
        return Ok(());
    }
    Err(Error::whole("weights", None, "at most as many as the model has room for", weights.len()))
}

/// Checks that a number is admissible among numbers T.
fn fits<T: Real>(parameter: &'static str, index: Option<usize>, got: f64) -> Result<(), Error> {
    if T::narrow(got).is_admissible() {
        return Ok(());
    }
    Err(Error::Domain { parameter, index, expected: T::FINITE, got })
}

/// The output of a model, sample by sample, without an allocator; it owns its model or borrows one.
///
/// What [`crate::Forward`](../struct.Forward.html) is on the heap, and with `f64` bit for bit the same. Starts at rest.
/// An input that is not finite, or beyond [`Real::MAX_MAGNITUDE`], leaves output and memory as they are and is counted.
///
/// ```
/// use hysteresis_core::embedded::{Forward, Model};
/// use hysteresis_core::{Offsets, Process};
/// let model = Model::<f32, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut forward = Forward::new(model);
/// let mut y = [0.0; 3];
/// forward.run(&[4.0, 3.0, f32::NAN], &mut y)?;
/// assert_eq!(y, [5.0, 4.0, 4.0]);
/// assert_eq!((forward.peek(-4.0), forward.output(), forward.rejected()), (-5.0, 4.0, 1));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Forward<T: Real, const N: usize, M: Holds<T, N> = Model<T, N>> {
    core: ForwardCore<T, Engine<M>>,
}

impl<T: Real, const N: usize, M: Holds<T, N>> Forward<T, N, M> {
    /// A stream at rest.
    #[must_use]
    pub fn new(model: M) -> Self {
        let origin = model.model().origin;
        Self { core: ForwardCore::new(Engine::new(model), origin) }
    }

    /// The last output; at rest, the output at rest.
    #[must_use]
    pub fn output(&self) -> T {
        self.core.output()
    }

    /// How many inputs were not admissible and left output and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.core.rejected()
    }

    /// Its model.
    #[must_use]
    pub fn model(&self) -> &Model<T, N> {
        self.core.memory().model().model()
    }
}

impl<T: Real, const N: usize, M: Holds<T, N>> Process<T> for Forward<T, N, M> {
    #[inline]
    fn step(&mut self, input: T) -> T {
        self.core.step(input)
    }

    #[inline]
    fn peek(&self, input: T) -> T {
        self.core.peek(input)
    }

    fn reset(&mut self) {
        self.core.reset();
    }

    fn run(&mut self, input: &[T], output: &mut [T]) -> Result<(), Error> {
        self.core.run(input, output)
    }
}

/// The exact inverse of a model, sample by sample, without an allocator: the drive that brings the model's output to
/// the target.
///
/// What [`crate::Inverse`](../struct.Inverse.html) is on the heap, and with `f64` bit for bit the same. The drive is
/// always finite and within the limits. A target out of reach puts it at the limit, which is what the memory then
/// knows, and sets [`saturated`](Self::saturated); a target that is not finite, or beyond [`Real::MAX_MAGNITUDE`],
/// leaves it as it is and is counted.
///
/// ```
/// use hysteresis_core::embedded::{Inverse, Model};
/// use hysteresis_core::{Offsets, Process};
/// let model = Model::<f64, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut inverse = Inverse::new(model, Some((-10.0, 10.0)))?;
/// assert!((inverse.step(5.0) - 4.0).abs() < 1e-15);
/// assert_eq!((inverse.step(99.0), inverse.saturated()), (10.0, true));
/// assert_eq!((inverse.step(f64::NAN), inverse.rejected()), (10.0, 1));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Inverse<T: Real, const N: usize, M: Holds<T, N> = Model<T, N>> {
    core: InverseCore<T, Engine<M>>,
}

impl<T: Real, const N: usize, M: Holds<T, N>> Inverse<T, N, M> {
    /// An inverse at rest, the drive kept within `limits` (low, high) in the unit of the model's input. If the rest
    /// position, the input offset, lies outside the limits, the memory starts at the nearer one.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the model may not be, [`Error::Domain`] unless the limits are finite and low < high.
    pub fn new(model: M, limits: Option<(T, T)>) -> Result<Self, Error> {
        model.model().invertible?;
        let (origin, limits) = (model.model().origin, check_limits(limits)?);
        Ok(Self { core: InverseCore::new(Engine::new(model), origin, limits) })
    }

    /// The present drive: the last one, or that at rest.
    #[must_use]
    pub fn output(&self) -> T {
        self.core.output()
    }

    /// The output of the model at the present drive: the last target, or what a limit allows.
    #[must_use]
    pub fn reached(&self) -> T {
        self.core.reached()
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.core.saturated()
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(T, T)> {
        self.core.limits()
    }

    /// How many targets were not admissible and left drive and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.core.rejected()
    }

    /// Its model.
    #[must_use]
    pub fn model(&self) -> &Model<T, N> {
        self.core.memory().model().model()
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds
    /// feedback or limits a slew. The drive is kept within the limits; one that is not admissible is counted and
    /// changes nothing else. Returns the output of the model there.
    ///
    /// ```
    /// use hysteresis_core::embedded::{Inverse, Model};
    /// use hysteresis_core::{Offsets, Process};
    /// let model = Model::<f32, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let mut inverse = Inverse::new(model, Some((-10.0, 10.0)))?;
    /// assert_eq!(inverse.follow_drive(4.0), 5.0);
    /// assert_eq!(inverse.step(4.5), 3.5); // the play holds
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[inline]
    pub fn follow_drive(&mut self, drive: T) -> T {
        self.core.follow_drive(drive)
    }

    /// Takes over what was driven before, oldest drive first.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits; nothing is taken then.
    pub fn follow(&mut self, drives: &[T]) -> Result<(), Error> {
        self.core.follow(drives)
    }
}

impl<T: Real, const N: usize, M: Holds<T, N>> Process<T> for Inverse<T, N, M> {
    #[inline]
    fn step(&mut self, target: T) -> T {
        self.core.step(target)
    }

    #[inline]
    fn peek(&self, target: T) -> T {
        self.core.look(target).drive
    }

    fn reset(&mut self) {
        self.core.reset();
    }

    fn run(&mut self, input: &[T], output: &mut [T]) -> Result<(), Error> {
        self.core.run(input, output)
    }
}
