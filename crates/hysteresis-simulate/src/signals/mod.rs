//! Sampled test signals. All keep within center +- amplitude.
//!
//! | room | signals | starts and ends |
//! |---|---|---|
//! | `waves` | [`sine`], [`triangle`], [`decaying_triangle`] | starts at its offset |
//! | `chirp` | [`Chirp`]: a sine whose frequency sweeps | at its center, with a fade |
//! | `multisine` | [`Multisine`]: chosen lines of the discrete Fourier transform | at its center if it fades |

mod chirp;
mod multisine;
mod waves;

pub use hysteresis_control::sampling::Error;

pub use self::chirp::{Chirp, Sweep};
pub use self::multisine::{Multisine, Phases};
pub use self::waves::{Wave, decaying_triangle, sine, triangle};

/// The half cosine from 0 at `share` = 0 to 1 at `share` = 1 by which a signal fades in, and backwards out.
///
/// Its steepest slope is pi/2.
fn fade(share: f64) -> f64 {
    (core::f64::consts::FRAC_PI_2 * share).sin().powi(2)
}
