//! How serde takes apart what has no way of its own: matrices, models and parts of other crates, checked when they come
//! back.

use faer::Mat;
use hysteresis_control::linear::{Creep, Dynamics, FirstOrder, Modes, SecondOrder};
use hysteresis_control::stage::{LoopShift, RelaxingPlays, SlowGain};
use hysteresis_core::{CompiledModel, Model, ModifiedPrandtlIshlinskii, Offsets};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A matrix as its shape and its rows.
pub(crate) mod matrix {
    use super::{Deserialize, Deserializer, Error, Mat, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(matrix: &Mat<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        let (rows, columns) = (matrix.nrows(), matrix.ncols());
        let values: Vec<f64> = (0..rows).flat_map(|i| (0..columns).map(move |j| matrix[(i, j)])).collect();
        (rows, columns, values).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Mat<f64>, D::Error> {
        let (rows, columns, values): (usize, usize, Vec<f64>) = Deserialize::deserialize(deserializer)?;
        if rows.checked_mul(columns) != Some(values.len()) {
            return Err(D::Error::custom("a matrix of another shape"));
        }
        Ok(Mat::from_fn(rows, columns, |i, j| values[i * columns + j]))
    }
}

/// A model as the text of its file.
pub(crate) mod model {
    use super::{Deserialize, Deserializer, Error, Model, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(model: &Model, serializer: S) -> Result<S::Ok, S::Error> {
        model.to_json().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Model, D::Error> {
        let text: String = Deserialize::deserialize(deserializer)?;
        Model::from_json(&text).map_err(D::Error::custom)
    }
}

/// Dynamics as their parameters: none, a frequency, or a frequency and a damping ratio.
pub(crate) mod dynamics {
    use super::{Deserialize, Deserializer, Dynamics, Error, FirstOrder, SecondOrder, Serialize, Serializer};

    #[expect(clippy::ref_option, reason = "serde hands over the field")]
    pub(crate) fn serialize<S: Serializer>(dynamics: &Option<Dynamics>, serializer: S) -> Result<S::Ok, S::Error> {
        let parameters = match dynamics {
            None => Vec::new(),
            Some(Dynamics::FirstOrder(lag)) => vec![lag.frequency()],
            Some(Dynamics::SecondOrder(resonance)) => vec![resonance.frequency(), resonance.damping()],
        };
        parameters.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Dynamics>, D::Error> {
        let parameters: Vec<f64> = Deserialize::deserialize(deserializer)?;
        match parameters[..] {
            [] => Ok(None),
            [frequency] => FirstOrder::new(frequency).map(|lag| Some(lag.into())).map_err(D::Error::custom),
            [frequency, damping] => {
                SecondOrder::new(frequency, damping).map(|found| Some(found.into())).map_err(D::Error::custom)
            }
            _ => Err(D::Error::custom("dynamics of more than two parameters")),
        }
    }
}

/// Several modes as the gain, frequency and damping ratio of each.
pub(crate) mod modes {
    use super::{Deserialize, Deserializer, Error, Modes, SecondOrder, Serialize, Serializer};

    #[expect(clippy::ref_option, reason = "serde hands over the field")]
    pub(crate) fn serialize<S: Serializer>(modes: &Option<Modes>, serializer: S) -> Result<S::Ok, S::Error> {
        let of_all = |modes: &Modes| -> Vec<[f64; 3]> {
            let both = modes.gains().iter().zip(modes.modes());
            both.map(|(gain, mode)| [*gain, mode.frequency(), mode.damping()]).collect()
        };
        modes.as_ref().map(of_all).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Modes>, D::Error> {
        let Some(all): Option<Vec<[f64; 3]>> = Deserialize::deserialize(deserializer)? else { return Ok(None) };
        let gains: Vec<f64> = all.iter().map(|[gain, ..]| *gain).collect();
        let modes = all.iter().map(|[_, frequency, damping]| SecondOrder::new(*frequency, *damping));
        let modes = modes.collect::<Result<Vec<_>, _>>().map_err(D::Error::custom)?;
        Modes::new(&gains, &modes).map(Some).map_err(D::Error::custom)
    }
}

/// Creep as its amplitudes and time constants.
pub(crate) mod creep {
    use super::{Creep, Deserialize, Deserializer, Error, Serialize, Serializer};

    #[expect(clippy::ref_option, reason = "serde hands over the field")]
    pub(crate) fn serialize<S: Serializer>(creep: &Option<Creep>, serializer: S) -> Result<S::Ok, S::Error> {
        creep.as_ref().map(|creep| (creep.amplitudes(), creep.time_constants())).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Creep>, D::Error> {
        let parts: Option<(Vec<f64>, Vec<f64>)> = Deserialize::deserialize(deserializer)?;
        parts.map(|(amplitudes, times)| Creep::new(&amplitudes, &times)).transpose().map_err(D::Error::custom)
    }
}

/// A loop shift as its numbers.
pub(crate) mod loop_shift {
    use super::{Deserialize, Deserializer, Error, LoopShift, Serialize, Serializer};

    type Parts = (f64, f64, [f64; 2], f64, f64);

    #[expect(clippy::ref_option, reason = "serde hands over the field")]
    pub(crate) fn serialize<S: Serializer>(shift: &Option<LoopShift>, serializer: S) -> Result<S::Ok, S::Error> {
        let parts = |shift: &LoopShift| -> Parts {
            (shift.center(), shift.half_range(), shift.amplitudes(), shift.time_constant(), shift.limit())
        };
        shift.as_ref().map(parts).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<LoopShift>, D::Error> {
        let parts: Option<Parts> = Deserialize::deserialize(deserializer)?;
        let shift = |(center, half_range, amplitudes, time_constant, limit)| {
            LoopShift::new(center, half_range, amplitudes, time_constant, limit)
        };
        parts.map(shift).transpose().map_err(D::Error::custom)
    }
}

/// Plays that relax as their numbers.
pub(crate) mod relaxing_plays {
    use super::{Deserialize, Deserializer, Error, RelaxingPlays, Serialize, Serializer};

    type Parts = (Vec<f64>, f64, Vec<f64>, Vec<Vec<f64>>);

    #[expect(clippy::ref_option, reason = "serde hands over the field")]
    pub(crate) fn serialize<S: Serializer>(plays: &Option<RelaxingPlays>, serializer: S) -> Result<S::Ok, S::Error> {
        let parts = |plays: &RelaxingPlays| -> Parts {
            let (thresholds, time_constants) = (plays.thresholds().to_vec(), plays.time_constants().to_vec());
            (thresholds, plays.origin(), time_constants, plays.weights().to_vec())
        };
        plays.as_ref().map(parts).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<RelaxingPlays>, D::Error> {
        let parts: Option<Parts> = Deserialize::deserialize(deserializer)?;
        let plays =
            |(thresholds, origin, times, weights): Parts| RelaxingPlays::new(&thresholds, origin, &times, &weights);
        parts.map(plays).transpose().map_err(D::Error::custom)
    }
}

/// A slow gain as its numbers.
pub(crate) mod slow_gain {
    use super::{Deserialize, Deserializer, Error, Serialize, Serializer, SlowGain};

    type Parts = (f64, f64, f64, f64);

    #[expect(clippy::ref_option, reason = "serde hands over the field")]
    pub(crate) fn serialize<S: Serializer>(gain: &Option<SlowGain>, serializer: S) -> Result<S::Ok, S::Error> {
        let parts =
            |gain: &SlowGain| -> Parts { (gain.half_range(), gain.amplitude(), gain.zero(), gain.time_constant()) };
        gain.as_ref().map(parts).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<SlowGain>, D::Error> {
        let parts: Option<Parts> = Deserialize::deserialize(deserializer)?;
        let gain =
            |(half_range, amplitude, zero, time_constant)| SlowGain::new(half_range, amplitude, zero, time_constant);
        parts.map(gain).transpose().map_err(D::Error::custom)
    }
}

/// In place of a model that is kept apart.
pub(crate) fn no_model() -> CompiledModel {
    let identity = ModifiedPrandtlIshlinskii::new(&[1.0], &[0.0], &[0.0], &[0.0], &[0.0], Offsets::default());
    CompiledModel::new(&identity.expect("the identity"))
}
