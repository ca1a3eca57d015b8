//! A stage without its fast dynamics: y = creep(g(phi(H\[x\] + z\[x\]) + s)), x = gamma(u), sample by sample, and its
//! exact inverse.
//!
//! gamma and phi are strictly monotone piecewise-linear maps, H is the hysteresis, z a Duhem operator beside it, s is
//! the loop shift and what plays have relaxed by, g the slow gain, all from past drives, and creep adds slow
//! first-order lags. Each part may be missing.

mod beside;
mod bracket;
mod creep;
mod follower;
mod inverse;
mod loop_shift;
mod map;
mod parts;
mod past_drives;
mod relaxing_plays;
mod slow_gain;
mod stage;

pub use bracket::{Bracket, BracketArray, BracketState};
pub use creep::CreepTerms;
pub use inverse::QuasiStaticInverse;
pub use loop_shift::LoopShiftTerms;
pub use map::PiecewiseLinearMap;
pub use parts::{MAX_KNOTS, QuasiStatic};
pub use relaxing_plays::RelaxingPlayTerms;
pub use slow_gain::SlowGainTerms;
pub use stage::{QuasiStaticForward, QuasiStaticState};
