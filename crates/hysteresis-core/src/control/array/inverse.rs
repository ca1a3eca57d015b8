//! What the controller of an array asks of the inverse of an actuator.

use core::fmt::Debug;

use crate::engine::CompiledModel;
use crate::error::Error;
use crate::process::Process;
use crate::quasistatic::{QuasiStaticInverse, QuasiStaticState};
use crate::stream::{Inverse, Look, StreamState};

/// The inverse of an actuator in an [`ArrayController`](super::ArrayController): [`Inverse`], or [`QuasiStaticInverse`]
/// where there are a Duhem operator, maps, loop shift, relaxing plays, slow gain or creep beside the plays.
///
/// Only what the library has implements it: what is not shown is how the controller looks for a drive.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayInverse, ArrayOptions, ArraySample, CompiledModel, CreepTerms, Offsets};
/// use hysteresis_core::{PrandtlIshlinskii, QuasiStatic, QuasiStaticInverse, StreamArray};
/// fn first_drive<P: ArrayInverse>(inverse: StreamArray<P>, target: f64) -> Result<f64, hysteresis_core::Error> {
///     let options = ArrayOptions { bumpless_time: 0.0, ..ArrayOptions::new(1e-3) }; // s
///     let mut controller = ArrayController::new(inverse, &options)?;
///     let mut drives = [0.0];
///     controller.step(&ArraySample::of(&[0.0]), &mut drives)?; // a motion starts from the drives that are there
///     controller.step(&ArraySample::of(&[target]), &mut drives)?;
///     Ok(drives[0])
/// }
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let model = CompiledModel::new(&(&model).into());
/// let limits = Some((-10.0, 10.0));
/// let stage = QuasiStatic::new(&model).with_creep(CreepTerms::new(&[0.1], &[0.5])?);
/// let of_plays = first_drive(StreamArray::inverse(&[model], limits).unwrap(), 5.0)?;
/// let of_stages = first_drive([stage.inverse(limits)?].into_iter().collect(), 5.0)?;
/// assert!((of_plays - 4.0).abs() < 1e-14 && (of_stages - 4.0).abs() < 1e-14);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
pub trait ArrayInverse: Process + Clone + Debug {
    /// What the inverse remembers.
    type State: Clone + Debug + PartialEq;

    /// Whether the position goes on by itself from sample to sample, as by creep, so that samples in which the drive
    /// stays count.
    #[doc(hidden)]
    const DRIFTS: bool;

    /// Where a step to a target would come to at this sample.
    #[doc(hidden)]
    fn look(&self, target: f64) -> Look;

    /// The position at this sample if the drive went there.
    #[doc(hidden)]
    fn look_at_drive(&self, drive: f64) -> f64;

    /// The position at this sample if the drive stays.
    #[doc(hidden)]
    fn reached(&self) -> f64;

    /// The present drive.
    #[doc(hidden)]
    fn output(&self) -> f64;

    /// The limits of the drive, if there are any.
    #[doc(hidden)]
    fn limits(&self) -> Option<(f64, f64)>;

    /// Whether the position at a sample is that of an earlier drive too.
    #[doc(hidden)]
    fn lags(&self) -> bool;

    /// Puts out another drive than the one that a target asks for.
    #[doc(hidden)]
    fn follow_drive(&mut self, drive: f64);

    /// A sample passes in which the drive stays.
    #[doc(hidden)]
    fn wait(&mut self);

    /// Goes on with the weights and the output offset of another hysteresis of the same operators.
    #[doc(hidden)]
    fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error>;

    /// Everything that is remembered. Allocates.
    #[doc(hidden)]
    fn state(&self) -> Self::State;

    /// Continues from a state, or stays as it is.
    #[doc(hidden)]
    fn set_state(&mut self, state: &Self::State) -> Result<(), Error>;
}

/// Both have methods of these names.
macro_rules! array_inverse {
    ($inverse:ty, $state:ty, $drifts:literal, $reached:ident, $lags:expr, $wait:expr) => {
        impl ArrayInverse for $inverse {
            type State = $state;

            const DRIFTS: bool = $drifts;

            #[inline]
            fn look(&self, target: f64) -> Look {
                self.look(target)
            }

            #[inline]
            fn look_at_drive(&self, drive: f64) -> f64 {
                self.look_at_drive(drive)
            }

            #[inline]
            fn reached(&self) -> f64 {
                self.$reached()
            }

            #[inline]
            fn output(&self) -> f64 {
                self.output()
            }

            fn limits(&self) -> Option<(f64, f64)> {
                self.limits()
            }

            fn lags(&self) -> bool {
                ($lags)(self)
            }

            #[inline]
            fn follow_drive(&mut self, drive: f64) {
                self.follow_drive(drive);
            }

            #[inline]
            fn wait(&mut self) {
                ($wait)(self);
            }

            fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
                self.set_model(model)
            }

            fn state(&self) -> $state {
                self.state()
            }

            fn set_state(&mut self, state: &$state) -> Result<(), Error> {
                self.set_state(state)
            }
        }
    };
}

array_inverse!(Inverse, StreamState, false, reached, |_: &Self| false, |_: &mut Self| ());
array_inverse!(QuasiStaticInverse, QuasiStaticState, true, position, Self::is_behind_amplifier, |stream: &mut Self| {
    stream.follow_drive(stream.output())
});
