//! The controller that a stage of several axes leads.

use hysteresis_control::multi_axis::{MultiAxisStageController, TrackingOptions};
use hysteresis_core::ControllerOptions;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::multi_axis_stage::{MultiAxisStage, each_limits};
use crate::argument::SampleCount;
use crate::control::controller::HybridController;
use crate::control::inverse_dynamics::Preview;
use crate::control::multi_axis::MultiAxisController;
use crate::convert::errors::raise;

#[methods]
impl MultiAxisStage {
    /// A controller that leads the drives of this stage along references, for a stage with as many drives as positions,
    /// 16 at most.
    ///
    /// Feed-forward: the drives with which the model, with all that its hysteresis remembers, follows the references
    /// that are known best, in the sense of least squares. References come `controller.ahead` samples early. Feedback:
    /// a Kalman filter tells a disturbance that comes in with the drives from what measurements are beside the model,
    /// and the drives take it away. It is as fast as the peak of the sensitivity admits, for the flattest and the
    /// steepest slopes of the operators and for frequencies that are off by 2 %. Measurements must be taken before the
    /// drives of their sample go out.
    ///
    /// Each drive has a controller of its own, with kp = 1 and ki = 0: `set_gains(axis, kp=0.5, ki=0.0)` takes half of
    /// the disturbance away. Limits, slew, holds, stops and counters are theirs. A motion begins with the drives of
    /// now, and is led to its references over `bumpless_time`. The drives of `precompensate` may come instead, as
    /// `feedforward` of `step`.
    ///
    /// Parameters
    /// ----------
    /// limits : (low, high), or an array of shape (m, 2)
    ///     Of every drive, or of each.
    /// slew : float, optional
    ///     How fast each drive may move, in its unit per second.
    /// ahead : int, optional
    ///     How many samples early references come, 1 to 512; by default as many as the dynamics use.
    /// peak_sensitivity : float
    ///     By how much the feedback may at most amplify what disturbs a position, at any frequency: 1.05 to 5.
    /// bumpless_time : float
    ///     How long, in seconds, a motion takes from where it starts to its references, and a change to vanish.
    /// max_missing : int
    ///     For how many measurements in a row that are missing the estimate stands in; then feed-forward goes on alone.
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> import numpy as np
    /// >>> one = np.eye(2)
    /// >>> parts = dict(bw=0.1 * one, cq=0 * one, dq=one, operators=[([0.2], [1.0]), ([0.2], [1.0])], dt=1e-3)
    /// >>> stage = mh.MultiAxisStage(0.5 * one, 0.4 * one, [[1.0, 0.03], [-0.03, 1.0]], 0 * one, **parts)
    /// >>> true = mh.MultiAxisStage(0.5 * one, 0.42 * one, [[1.0, 0.03], [-0.03, 1.0]], 0 * one, **parts)
    /// >>> controller, plant = stage.controller((-5.0, 5.0)), true.forward()
    /// >>> time = 1e-3 * np.arange(500)[:, None]
    /// >>> wanted = np.sin(2.0 * np.pi * 5.0 * time) * [1.0, 0.5]
    /// >>> early = np.vstack([wanted[controller.ahead :], np.repeat(wanted[-1:], controller.ahead, axis=0)])
    /// >>> y, worst = np.zeros(2), 0.0
    /// >>> for k in range(500):
    /// ...     worst = max(worst, abs(y - wanted[k]).max()) if k > 100 else 0.0
    /// ...     y = plant.advance(controller.step(early[k], y))
    /// >>> bool(worst < 0.01)
    /// True
    #[gather(tracking: TrackingOptions)]
    fn controller<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] limits: &Bound<'py, PyAny>,
        #[py(*, = None)] slew: Option<f64>,
        #[py(= None)] ahead: Option<SampleCount>,
        #[py(field = 2.0)] peak_sensitivity: f64,
        #[py(= 0.005)] bumpless_time: f64,
        #[py(= 10)] max_missing: u32,
    ) -> PyResult<MultiAxisController> {
        let stage = &slf.get().0;
        let options: Vec<_> = each_limits(limits, stage.drives())?
            .into_iter()
            .map(|limits| {
                let usual = ControllerOptions::new(1.0, 0.0, stage.dt(), limits);
                ControllerOptions { slew, bumpless_time, max_missing, ..usual }
            })
            .collect();
        let tracking = TrackingOptions { ahead: ahead.map(|ahead| ahead.0), ..tracking };
        let made: MultiAxisStageController = stage.controller(&options, &tracking).map_err(raise)?;
        let given = PyString::new(slf.py(), "given").into_any();
        let copies = made.controller().controllers().iter().zip(&options).map(|(one, options)| {
            let preview = one.preview().cloned().map(|preview| Py::new(slf.py(), Preview::of(preview, options.dt)));
            HybridController::of(Some(&given), preview.transpose()?, options)
        });
        let copies = copies.collect::<PyResult<_>>()?;
        MultiAxisController::with_stage(slf, made, copies, tracking.peak_sensitivity)
    }
}
