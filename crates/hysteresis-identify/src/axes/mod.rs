//! A stage of several axes with hysteresis in front of or inside its dynamics: from records with several drives and
//! positions to x+ = A x + B u + Bw w, q = Cq x + Dq u, w = H\[q\], y = C x + D u.
//!
//! `data` are records in units of their own size. `subspace` finds the best linear dynamics, `point` is what is
//! searched, `bank` an operator with its derivatives, `pass` the normal equations of a point, `descent` the way to a
//! better one. A `candidate` is a structure, `identify` goes from the linear one to ever
//! more, `uncertainty` says how far the last may be from the truth, and `result` is what comes out.

mod bank;
mod candidate;
mod data;
mod descent;
mod identify;
mod pass;
mod point;
mod result;
mod subspace;
mod uncertainty;

pub use candidate::{AxesHysteresis, AxesPlace};
pub use data::AxesRecord;
pub use identify::{AxesOptions, identify_axes};
pub use result::{AxesIdentification, AxesTrial};
pub use uncertainty::AxesStandardErrors;
