//! Gains of the feedback.

use hysteresis_control::linear::Chain;
use hysteresis_control::tuning::{self, TuningOptions};
use hysteresis_simulate::plant;
use pyo3::prelude::*;

use super::linear_part::LinearPart;
use crate::convert::arguments::numbers;
use crate::convert::errors::{self, raise, wrong_type};
use crate::convert::objects::shared;
use crate::model::object::kernel_of;
use crate::plant::plant::Plant;

/// Gains of the proportional-integral feedback, and how robust the loop is with them: made by `tune`.
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Tuning(tuning::Tuning);

#[pymethods]
impl Tuning {
    /// Proportional gain (V/um).
    #[getter]
    fn kp(&self) -> f64 {
        self.0.kp
    }

    /// Integral gain (V/um per sample).
    #[getter]
    fn ki(&self) -> f64 {
        self.0.ki
    }

    /// The margins where the hysteresis has its least slope.
    #[getter]
    fn at_min_slope(&self) -> Margins {
        Margins(self.0.at_min_slope)
    }

    /// The margins where it has its greatest slope.
    #[getter]
    fn at_max_slope(&self) -> Margins {
        Margins(self.0.at_max_slope)
    }

    /// The peak of the sensitivity over all slopes between.
    #[getter]
    fn peak_sensitivity(&self) -> f64 {
        self.0.peak_sensitivity
    }

    fn __repr__(&self) -> String {
        let tuning::Tuning { kp, ki, at_min_slope, at_max_slope, peak_sensitivity } = self.0;
        let (low, high) = (at_min_slope.crossover, at_max_slope.crossover);
        let (low, high) = (low.min(high), low.max(high));
        let loops = format!("crossover {low:.3} to {high:.3} Hz, peak sensitivity {peak_sensitivity:.3}");
        format!("<Tuning: kp {kp:.6}, ki {ki:.6}, {loops}>")
    }
}

/// How robust a loop is at one slope of the hysteresis.
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Margins(tuning::Margins);

#[pymethods]
impl Margins {
    /// The slope (um/V).
    #[getter]
    fn slope(&self) -> f64 {
        self.0.slope
    }

    /// The factor by which the gain may grow until the loop oscillates; infinite if it never does.
    #[getter]
    fn gain_margin(&self) -> f64 {
        self.0.gain_margin
    }

    /// How many degrees the phase may lag more, the least over all frequencies with abs(L) = 1.
    #[getter]
    fn phase_margin(&self) -> f64 {
        self.0.phase_margin
    }

    /// The highest frequency in Hz with abs(L) = 1.
    #[getter]
    fn crossover(&self) -> f64 {
        self.0.crossover
    }

    /// The peak of the sensitivity abs(1 / (1 + L)).
    #[getter]
    fn peak_sensitivity(&self) -> f64 {
        self.0.peak_sensitivity
    }

    /// Where that peak is, in Hz.
    #[getter]
    fn peak_frequency(&self) -> f64 {
        self.0.peak_frequency
    }

    fn __repr__(&self) -> String {
        let tuning::Margins { slope, gain_margin, phase_margin, crossover, peak_sensitivity, .. } = self.0;
        let margins = format!("gain margin {gain_margin:.3}, phase margin {phase_margin:.1} degrees");
        format!(
            "<Margins at slope {slope:.6}: {margins}, crossover {crossover:.3} Hz, peak sensitivity {peak_sensitivity:.3}>"
        )
    }
}

/// Gains of the proportional-integral feedback for a hysteresis with dynamics behind it.
///
/// The loop is L(z) = (kp + ki / (1 - 1/z)) slope P(z): the positional law kp e + ki sum(e), the slope of the hysteresis,
/// which lies between those of `model.slope_range`, and P the exact pulse transfer function of amplifier, dynamics and
/// delay for an input that is held from one measurement to the next. Of all gains with
///
/// abs(1 / (1 + L)) <= peak_sensitivity at all frequencies and slopes, and the loop stable,
///
/// those with the greatest ki are taken: a constant disturbance is removed with the integrated error 1 / ki (Åström,
/// Panagopoulos and Hägglund, Automatica 34(5), 1998). Parts slower than 1e5 samples a radian and damping ratios below
/// 1e-7 are refused: their response does not show at the frequencies that are looked at.
///
/// Parameters
/// ----------
/// model : PrandtlIshlinskii, ModifiedPrandtlIshlinskii or Plant
///     Whose range of slopes counts. Of a plant all else is known, but for the sensitivity.
/// dt : float
///     Sampling interval in seconds.
/// dynamics : SecondOrder, FirstOrder or DynamicsIdentification, optional
///     Of an identification its dynamics count, and its delay unless `delay` is given; not its gain and creep.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// delay : float, optional
///     Samples of dead time besides the hold, at most 1000. A record whose output was measured when its input was put out
///     counts one too many: then give the identified delay less 1.
/// peak_sensitivity : float
///     1.05 to 5: 1.2 is cautious, 2 is bold. The gain may grow by M / (M - 1), the phase lag by 2 arcsin(1 / (2 M)).
///
/// Returns
/// -------
/// Tuning
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> tuning = mh.control.tune(mh.paper.table_1_recovered(), dt=1e-4, dynamics=mh.plant.SecondOrder(400.0, 0.95))
/// >>> round(tuning.kp), round(tuning.ki), round(tuning.peak_sensitivity, 3)
/// (185, 36, 1.7)
/// >>> mh.control.tune(mh.paper.plant("A1")).kp == tuning.kp
/// True
/// >>> tuning.at_max_slope
/// <Margins at slope 0.007919: gain margin 6.521, phase margin 47.1 degrees, crossover 408.658 Hz, peak sensitivity 1.700>
#[pyfunction]
#[pyo3(signature = (model, *, dt=None, dynamics=None, amplifier_bandwidth=None, delay=None, peak_sensitivity=None),
    text_signature = "(model, *, dt=None, dynamics=None, amplifier_bandwidth=None, delay=None, peak_sensitivity=1.7)")]
pub(crate) fn tune(
    py: Python<'_>,
    model: &Bound<'_, PyAny>,
    dt: Option<&Bound<'_, PyAny>>,
    dynamics: Option<&Bound<'_, PyAny>>,
    amplifier_bandwidth: Option<&Bound<'_, PyAny>>,
    delay: Option<&Bound<'_, PyAny>>,
    peak_sensitivity: Option<&Bound<'_, PyAny>>,
) -> PyResult<Tuning> {
    numbers!(dt, amplifier_bandwidth, delay, peak_sensitivity = 1.7);
    let given = LinearPart { dynamics, amplifier_bandwidth, delay };
    let (chain, slopes, dt) = match (model.cast::<Plant>(), dt) {
        (Ok(plant), dt) => of_plant(&shared(plant)?.0, &given, dt)?,
        (Err(_), Some(dt)) => (given.chain(dt)?, kernel_of("model", model)?.slope_range(), dt),
        (Err(_), None) => {
            kernel_of("model", model)?;
            return Err(wrong_type("dt", "expected the sampling interval in seconds beside a model, got None"));
        }
    };
    if slopes.0 <= 0.0 {
        let expected = "a slope that is positive everywhere";
        return Err(errors::value("model", format_args!("expected {expected}, got one down to {:?}", slopes.0)));
    }
    let options = TuningOptions { slopes, dt, peak_sensitivity };
    py.detach(|| tuning::tune(&chain, &options)).map(Tuning).map_err(raise)
}

/// What a plant says of itself: nothing else may be given.
fn of_plant(plant: &plant::Plant, given: &LinearPart<'_, '_>, dt: Option<f64>) -> PyResult<(Chain, (f64, f64), f64)> {
    if dt.is_some() || !given.is_absent() {
        let message =
            "expected a model beside dt, dynamics, amplifier_bandwidth or delay, got a Plant, which has its own";
        return Err(wrong_type("model", message));
    }
    Ok((*plant.linear_part(), plant.slope_range(), plant.dt()))
}
