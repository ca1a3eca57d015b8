//! What a model may have: one file for a term, with its option and what it adds to the model. Most have what computes
//! it, too; creep, lags and modes are one filter, that of `dynamics`.
//!
//! | term | option | searched | enters as | chosen in |
//! |---|---|---|---|---|
//! | operators | `Thresholds`, `ModelKind`, `RatiosModel` | ratios, input offset | columns z_i | `choose::structure`, `choose::table` |
//! | weights | `WeightLaw`, smoothness | none: they are linear | unknowns c, w = B c | `choose::structure` |
//! | loop shift | `LoopShiftModel` | none: its amplitudes are linear | columns m and n | `choose::structure` |
//! | creep | `CreepModel` | amplitudes | a filter behind the operators | `choose::told`, `choose::structure`, `choose::table` |
//! | plays that relax | `RelaxingPlaysModel` | none: their weights are linear | columns of plays behind lags | `choose::table` |
//! | slow gain | `SlowGainModel` | amplitude, time constant | a factor of all columns | `choose::table` |
//! | Duhem operator | `DuhemModel` | amplitude, f+ and f- at its knots | a known output beside the columns | `choose::duhem` |
//! | maps | `MapModel` | three coefficients each | a curve in front, or behind | `choose::table` |
//! | dynamics, modes | `DynamicsModel`, `ModesModel` | frequency, damping, gain | a filter behind the creep | `choose::linear_part`, `choose::modes` |
//! | amplifier | `AmplifierModel` | bandwidth | a lag in front | `choose::linear_part`, `choose::table` |
//!
//! Dynamics are chosen in `choose::table`, too: none, others once there is a map, or a lag in front instead. Which of
//! all terms the records can tell says `choose::told`. What is searched, as the amplitudes of creep, are axes of
//! `fit::point`; `fit::descent` searches them all at once.

pub(crate) mod creep;
pub(crate) mod duhem;
pub(crate) mod dynamics;
pub(crate) mod loop_shift;
pub(crate) mod maps;
pub(crate) mod operators;
pub(crate) mod relaxing_plays;
pub(crate) mod side_columns;
pub(crate) mod slow_gain;
pub(crate) mod weights;
