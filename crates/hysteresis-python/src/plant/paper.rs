//! `mpi_hyst.paper`.

use hysteresis_python_macros::function;
use hysteresis_simulate::paper::{self, Benchmark};
use pyo3::prelude::*;

use super::plant::Plant;
use crate::argument::Words;
use crate::model::models::ModifiedPrandtlIshlinskii;

/// Table I as printed: the forward model, input V, output um, for a drive of -500..500 V.
///
/// The printed weights keep one or two digits and are up to 31 % off; `table_1_recovered` is the actuator.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.paper.table_1().operators
/// 20
#[function]
pub(crate) fn table_1() -> ModifiedPrandtlIshlinskii {
    paper::table_1().into()
}

/// The forward model with the weights that Table II implies: w_i = 1/S'_i - 1/S'_(i-1).
///
/// S'_i is the sum of the first i + 1 weights of Table II. All 20 weights round to those of Table I.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> print(f"{mh.paper.table_1_recovered().forward().step(500.0):+.4f} um")
/// +3.0624 um
#[function]
pub(crate) fn table_1_recovered() -> ModifiedPrandtlIshlinskii {
    paper::table_1_recovered().into()
}

/// Table II as printed: the parametric inverse, input um, output V.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> float(mh.paper.table_2().weights[0])
/// 234.9005
#[function]
pub(crate) fn table_2() -> ModifiedPrandtlIshlinskii {
    paper::table_2().into()
}

impl Words for Benchmark {
    const WORDS: &'static [(&'static str, Self)] = &[("A1", Self::A1), ("P3", Self::P3)];
}

/// A plant that reproduces the published errors: the recovered weights, +-560 V, 10 kHz, noise, and linear dynamics.
///
/// With the positional law u = H^-1[r] + kp e + ki dt sum e, e = r - measured, the gains of `gains(name)`, the bank of
/// `table_2()` as H^-1 and a reference of 3.3 um over three periods, the maxima of |e| come out as published: 0.07 um
/// for the triangle of 1 Hz, and 0.098, 0.159, 0.224, 0.293 um for sines of 5, 10, 15, 20 Hz within 10 %. With the
/// closed-form inverse of the conventional model of the same weights and thresholds as H^-1 the triangle gives 0.10 um,
/// as published. Both plants do, so they are a benchmark, not proof of what the paper's stage was.
///
/// Parameters
/// ----------
/// name : "A1" or "P3"
///     "A1": second order, 400 Hz, damping 0.95; noise 16.0 nm rms. "P3": second order, 2 kHz, damping 0.03, after an
///     amplifier pole of 279 Hz; noise 16.4 nm rms.
/// seed : int
///     Seed of the noise: the same seed gives the same numbers.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> class PaperLaw:
/// ...     def __init__(self, kp, ki):
/// ...         self.kp, self.ki, self.sum = kp, ki, 0.0
/// ...         self.feed_forward = mh.paper.table_2().forward()
/// ...     def step(self, reference, measurement):
/// ...         error = reference - measurement
/// ...         self.sum += error * 1e-4  # s
/// ...         return self.feed_forward.step(reference) + self.kp * error + self.ki * self.sum
/// >>> reference = mh.signals.sine(3.3, 20.0, seconds=0.15)  # um
/// >>> run = mh.plant.simulate(PaperLaw(*mh.paper.gains("A1")), mh.paper.plant("A1"), reference)
/// >>> bool(abs(run.metrics.max_error / 0.293 - 1.0) < 0.1)
/// True
#[function]
pub(crate) fn plant(name: Benchmark, #[py(= 0)] seed: u64) -> PyResult<Plant> {
    Plant::of_seed(&name.stage(), seed)
}

/// The gains (kp, ki) in V/um and V/um/s, with which the plant of that name gives the published errors.
///
/// Parameters
/// ----------
/// name : "A1" or "P3"
///     The plant.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.paper.gains("A1")
/// (60.0, 6000.0)
#[function]
pub(crate) fn gains(name: Benchmark) -> PyResult<(f64, f64)> {
    let gains = name.gains();
    Ok((gains.kp, gains.ki))
}
