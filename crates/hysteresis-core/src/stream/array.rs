//! Many streams side by side.

use alloc::boxed::Box;
use core::fmt;
use core::hint::black_box;

use super::{Forward, Inverse};
use crate::engine::CompiledModel;
use crate::error::{Error, check_length, check_rows};
use crate::process::Process;

/// Many streams side by side, one for each actuator of a deformable mirror: y_m(k) = H_m\[x_m\](k), m < M.
///
/// Every actuator has its own memory; those of one model share its [`CompiledModel`]. Bit for bit what M independent
/// streams give, and under the same contract: [`step`](Self::step), [`peek`](Self::peek), [`run`](Self::run) and
/// [`reset`](Self::reset) neither allocate, lock nor panic, and a sample that is not finite holds its own actuator
/// only. Samples are in the unit of the model's input, outputs in that of its output (an inverse: the other way round).
///
/// ```
/// use hysteresis_core::{CompiledModel, ModifiedPrandtlIshlinskii, Offsets, Ratios, StreamArray};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let models = vec![CompiledModel::new(&model); 4];
/// let mut mirror = StreamArray::forward(&models);
/// let mut inverse = StreamArray::inverse(&models, Some((-500.0, 500.0)))?;
/// let target = [0.5, 1.0, -2.0, 3.0]; // um
/// let (mut drive, mut reached) = ([0.0; 4], [0.0; 4]); // V, um
/// inverse.step(&target, &mut drive)?;
/// mirror.step(&drive, &mut reached)?;
/// assert!(target.iter().zip(&reached).all(|(y, z)| (y - z).abs() < 1e-14));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
///
/// Streams that differ in more than the model, or for which a [`Method`](crate::Method) is asked, are collected one by
/// one:
///
/// ```
/// use hysteresis_core::{CompiledModel, Error, Forward, Inverse, Method};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios, StreamArray};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let compiled = CompiledModel::new(&model);
/// let limits = [(-500.0, 500.0), (0.0, 100.0)];
/// let inverse: Result<StreamArray<_>, Error> = limits.iter().map(|l| Inverse::new(&compiled, Some(*l))).collect();
/// let mut drive = [0.0; 2];
/// inverse?.step(&[-99.0, 99.0], &mut drive)?;
/// assert_eq!(drive, [-500.0, 100.0]);
/// let models = vec![compiled; 4096];
/// let by_bank: Result<StreamArray<_>, Error> = models.iter().map(|m| Forward::with_method(m, Method::Bank)).collect();
/// assert!(by_bank?.streams().iter().all(|stream| stream.method() == Method::Bank));
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct StreamArray<P> {
    streams: Box<[P]>,
}

/// Which actuator of an array could not be made, and why.
///
/// ```
/// use hysteresis_core::{CompiledModel, Offsets, PrandtlIshlinskii, StreamArray};
/// let model = |w0| PrandtlIshlinskii::new(&[w0, -1.0], &[0.0, 1.0], Offsets::default());
/// let models = [CompiledModel::new(&(&model(2.0)?).into()), CompiledModel::new(&(&model(0.5)?).into())];
/// let error = StreamArray::inverse(&models, None).unwrap_err();
/// assert!(error.to_string().starts_with("actuator 1: the model is not invertible"));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorError<E = Error> {
    /// The index of the actuator.
    pub actuator: usize,
    /// What is wrong with it.
    pub error: E,
}

impl<E: fmt::Display> fmt::Display for ActuatorError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "actuator {}: {}", self.actuator, self.error)
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for ActuatorError<E> {}

impl StreamArray<Forward> {
    /// Forward models at rest, one for each model, each by the method of [`Forward::new`].
    #[must_use]
    pub fn forward(models: &[CompiledModel]) -> Self {
        models.iter().map(Forward::new).collect()
    }
}

impl StreamArray<Inverse> {
    /// Exact inverses at rest, one for each model, every drive kept within `limits` (low, high) in the unit of the
    /// models' input.
    ///
    /// # Errors
    /// As [`Inverse::new`], with the index of the first actuator that cannot be made.
    pub fn inverse(models: &[CompiledModel], limits: Option<(f64, f64)>) -> Result<Self, ActuatorError> {
        let stream = |(actuator, model)| Inverse::new(model, limits).map_err(|error| ActuatorError { actuator, error });
        models.iter().enumerate().map(stream).collect()
    }
}

impl<P: Process> StreamArray<P> {
    /// The number of actuators M.
    #[must_use]
    pub fn len(&self) -> usize {
        self.streams.len()
    }

    /// Whether there is no actuator at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.streams.is_empty()
    }

    /// The stream of every actuator.
    #[must_use]
    pub fn streams(&self) -> &[P] {
        &self.streams
    }

    /// The stream of every actuator, to move one alone, to restore its state, or to give each thread some of them.
    pub fn streams_mut(&mut self) -> &mut [P] {
        &mut self.streams
    }

    /// Takes one sample for each actuator and writes the M outputs.
    ///
    /// # Errors
    /// [`Error::Length`] unless both slices have M elements; nothing is taken then.
    pub fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), Error> {
        self.check_width(input, output)?;
        step_each(&mut self.streams, input, output);
        Ok(())
    }

    /// The outputs that [`step`](Self::step) would write, without taking the samples.
    ///
    /// # Errors
    /// [`Error::Length`] unless both slices have M elements.
    pub fn peek(&self, input: &[f64], output: &mut [f64]) -> Result<(), Error> {
        self.check_width(input, output)?;
        for ((stream, x), y) in self.streams.iter().zip(input).zip(output) {
            *y = stream.peek(*x);
        }
        Ok(())
    }

    /// Takes a block of samples, row by row (sample k of actuator m at k M + m): bit for bit the outputs of repeated
    /// [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Rows`] unless `input` consists of whole rows of M elements, [`Error::Length`] unless `output` is as
    /// long; nothing is taken then.
    pub fn run(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), Error> {
        let (width, got) = (self.len(), input.len());
        check_rows("input", width, got)?;
        check_length("output", got, output.len())?;
        // Without actuators there are no samples either, and a row of no length would have no end.
        let width = width.max(1);
        for (x, y) in input.chunks_exact(width).zip(output.chunks_exact_mut(width)) {
            step_each(&mut self.streams, x, y);
        }
        Ok(())
    }

    /// Every actuator back to the virgin state.
    pub fn reset(&mut self) {
        self.streams.iter_mut().for_each(P::reset);
    }

    fn check_width(&self, input: &[f64], output: &[f64]) -> Result<(), Error> {
        check_length("input", self.len(), input.len())?;
        check_length("output", self.len(), output.len())
    }
}

/// How many streams step together: enough to fetch the memory of several side by side, few enough that it is still near
/// when used.
const TOGETHER: usize = 128;

/// How many pointers deep memory is fetched.
const DEPTH: usize = 3;

/// Steps every stream. Most are on their line; for the others, whose memory may be far, it is fetched side by side.
#[inline]
fn step_each<P: Process>(streams: &mut [P], input: &[f64], output: &mut [f64]) {
    let parts = streams.chunks_mut(TOGETHER).zip(input.chunks(TOGETHER)).zip(output.chunks_mut(TOGETHER));
    for ((streams, input), output) in parts {
        let mut list = [0; TOGETHER];
        let waiting = step_at_hand(streams, input, output, &mut list);
        for depth in 0..DEPTH {
            let fetched = waiting.iter().filter_map(|place| streams.get(usize::from(*place)));
            black_box(fetched.fold(0, |read, stream| read ^ stream.fetch(depth)));
        }
        for place in waiting.iter().copied().map(usize::from) {
            if let (Some(stream), Some(x), Some(y)) = (streams.get_mut(place), input.get(place), output.get_mut(place))
            {
                *y = stream.step(*x);
            }
        }
    }
}

/// Steps the streams that need no memory but their own; the places of the others.
#[inline(always)]
#[expect(clippy::inline_always, reason = "the loop over all streams: a call would cost as much as a step")]
fn step_at_hand<'a, P: Process>(
    streams: &mut [P],
    input: &[f64],
    output: &mut [f64],
    waiting: &'a mut [u8; TOGETHER],
) -> &'a [u8] {
    let mut count = 0;
    for (place, ((stream, x), y)) in (0..).zip(streams.iter_mut().zip(input).zip(output)) {
        if let Some(at_hand) = stream.step_at_hand(*x) {
            *y = at_hand;
        } else if let Some(next) = waiting.get_mut(count) {
            *next = place;
            count += 1;
        }
    }
    waiting.get(..count).unwrap_or_default()
}

impl<P> FromIterator<P> for StreamArray<P> {
    fn from_iter<I: IntoIterator<Item = P>>(streams: I) -> Self {
        Self { streams: streams.into_iter().collect() }
    }
}
