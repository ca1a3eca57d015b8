//! The slow gain: how the size of all loops changes while the drive cycles; a time constant, and one amplitude.
//!
//! It multiplies everything that the operators and the loop shift put out, in front of the creep.

use hysteresis_core::unless_faded;

use crate::error::Error;

/// The largest magnitude of the amplitude that is searched: a gain from 0.8 to 1.2. Actuators show a few parts in a
/// thousand.
pub(crate) const LARGEST: f64 = 0.2;

/// Where a search of the amplitude begins: at 0 there would be no slope over the time constant.
pub(crate) const START: f64 = -0.002;

/// The time constant that is tried where none is given, in seconds, and where a search of it begins unless the records
/// are too short.
const USUAL: f64 = 30.0;

/// The shortest time constant, in samples: its follower, four times as fast, needs one.
const SHORTEST_SAMPLES: f64 = 4.0;

/// The longest time constant that is searched, as a multiple of the longest record: a slower gain is a straight line
/// there.
const LONGEST_RECORDS: f64 = 3.0;

/// The slow gain: how the size of all loops changes while the drive cycles, and comes back at rest. See
/// [`SlowGain`](hysteresis_control::stage::SlowGain) for the equation.
///
/// ```
/// use hysteresis_identify::{Options, SlowGainModel};
/// let options = Options { dt: Some(1e-3), slow_gain: SlowGainModel::TimeConstant(30.0), ..Options::default() };
/// assert_ne!(options.slow_gain, SlowGainModel::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum SlowGainModel {
    /// One of 30 s where it predicts better: if a record lasts as long, and loops of several sizes tell it from other
    /// terms.
    #[default]
    Auto,
    /// None.
    None,
    /// One of this time constant in seconds; its amplitude is searched.
    TimeConstant(f64),
    /// One whose time constant is searched, too.
    Fit,
}

/// What of a slow gain is known before the search: half of the range of drives, and where its time constant is
/// searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GainSpace {
    half_range: f64,
    /// The shortest and the longest time constant, in seconds, and where a search of it begins; all the same if it is
    /// known.
    pub(crate) time_constants: (f64, f64),
    pub(crate) start: f64,
}

/// A slow gain at a point of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct GainAt {
    /// Half of the range of drives.
    pub(crate) half_range: f64,
    /// tau, in seconds.
    pub(crate) time_constant: f64,
    /// kappa.
    pub(crate) amplitude: f64,
}

impl SlowGainModel {
    /// The usual one; none where no record lasts as long as it takes.
    pub(crate) fn usual(longest: f64) -> Option<Self> {
        (longest >= USUAL).then_some(Self::TimeConstant(USUAL))
    }

    /// For records whose inputs lie between `low` and `high`. `longest` is the length of the longest record and `dt`
    /// the smallest sampling interval, both in seconds.
    pub(crate) fn space(self, (low, high): (f64, f64), longest: f64, dt: f64) -> Result<Option<GainSpace>, Error> {
        let (time_constants, start) = match self {
            Self::None | Self::Auto => return Ok(None),
            Self::TimeConstant(tau) if tau.is_finite() && tau > 0.0 => ((tau, tau), tau),
            Self::TimeConstant(tau) => {
                return Err(Error::domain("slow_gain", None, "a time constant in seconds above 0", tau));
            }
            Self::Fit => {
                let (shortest, longest) = (SHORTEST_SAMPLES * dt, LONGEST_RECORDS * longest);
                ((shortest, longest), USUAL.clamp(shortest, longest))
            }
        };
        Ok((low < high).then_some(GainSpace { half_range: 0.5 * (high - low), time_constants, start }))
    }
}

impl GainSpace {
    pub(crate) fn searches_time_constant(&self) -> bool {
        self.time_constants.0 < self.time_constants.1
    }

    pub(crate) fn at(&self, amplitude: f64, time_constant: f64) -> GainAt {
        GainAt { half_range: self.half_range, time_constant, amplitude }
    }
}

/// The gain along one record, sample by sample; at rest before its first.
///
/// With x the drive over its half range, f a follower of time constant tau / 4 and e = x - f within -1 .. 1, m is the
/// one-pole mean of e^2 of time constant tau. It knows the drives before the sample only.
pub(crate) struct GainLane {
    scale: f64,
    amplitude: f64,
    /// exp(-dt / tau), exp(-4 dt / tau), and what e^2 makes of the mean.
    decay: f64,
    fast: f64,
    square: f64,
    follower: f64,
    mean: f64,
    /// The newest sample, once there is one.
    x: f64,
    is_at_rest: bool,
}

impl GainLane {
    pub(crate) fn new(at: &GainAt, dt: f64) -> Self {
        let decay = (-dt / at.time_constant).exp();
        let fast = decay.powi(4);
        Self {
            scale: at.half_range.recip(),
            amplitude: at.amplitude,
            decay,
            fast,
            square: (decay - fast * fast) / 7.0,
            follower: 0.0,
            mean: 0.0,
            x: 0.0,
            is_at_rest: true,
        }
    }

    /// Goes on to the next sample.
    pub(crate) fn next(&mut self, u: f64) {
        let x = u * self.scale;
        if self.is_at_rest {
            self.follower = x;
        } else {
            let e = (self.x - self.follower).clamp(-1.0, 1.0);
            self.mean = unless_faded(self.decay * self.mean + self.square * (e * e));
            self.follower = self.x - self.fast * e;
        }
        (self.x, self.is_at_rest) = (x, false);
    }

    /// 1 + kappa m of the newest sample.
    #[inline]
    pub(crate) fn gain(&self) -> f64 {
        1.0 + self.amplitude * self.mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stream of a stage whose hysteresis is the identity: its position over the drive.
    fn of_stage(gain: &GainAt, input: &[f64], dt: f64) -> Vec<f64> {
        use hysteresis_control::stage::{SlowGain, Stage, StageParts};
        use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
        let identity =
            ModifiedPrandtlIshlinskii::from_ratios(&[1.0], &[0.0], Ratios::PLAY, Offsets::default()).unwrap();
        let slow_gain = SlowGain::new(gain.half_range, gain.amplitude, 0.0, gain.time_constant).unwrap();
        let stage = Stage::new(StageParts { slow_gain: Some(slow_gain), ..StageParts::new(identity) }).unwrap();
        let mut forward = stage.forward(dt).unwrap();
        forward.settle(input[0]);
        input.iter().map(|u| forward.step(*u) / u).collect()
    }

    #[test]
    fn the_gain_is_that_of_the_stage() {
        let (gain, dt) = (GainAt { half_range: 2.0, time_constant: 0.7, amplitude: -0.1 }, 0.01);
        let input: Vec<f64> = (0..600_u32).map(|k| 5.0 + 2.5 * (0.05 * f64::from(k)).sin()).collect();
        let mut lane = GainLane::new(&gain, dt);
        for (u, want) in input.iter().zip(of_stage(&gain, &input, dt)) {
            lane.next(*u);
            assert!((lane.gain() - want).abs() < 1e-14, "{} {want}", lane.gain());
        }
        assert!(lane.gain() < 0.99);
    }

    #[test]
    fn what_is_given_is_checked() {
        let space = |model: SlowGainModel, longest| model.space((-1.0, 3.0), longest, 1e-3);
        assert_eq!(space(SlowGainModel::None, 100.0).unwrap(), None);
        let known = space(SlowGainModel::TimeConstant(7.0), 1.0).unwrap().unwrap();
        assert!(!known.searches_time_constant() && known.start == 7.0 && known.half_range == 2.0);
        let [long, short] = [100.0, 1.0].map(|longest| space(SlowGainModel::Fit, longest).unwrap().unwrap());
        assert_eq!((long.start, long.time_constants), (USUAL, (SHORTEST_SAMPLES * 1e-3, 300.0)));
        assert_eq!(short.start, 3.0);
        let error = space(SlowGainModel::TimeConstant(0.0), 1.0).unwrap_err().to_string();
        assert!(error.starts_with("slow_gain: expected a time constant"), "{error}");
    }
}
