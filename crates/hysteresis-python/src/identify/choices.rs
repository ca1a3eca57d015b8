//! What cross-validation chose and what it said of the rest; modes, amplifier and maps; what is left of a record.

use hysteresis_control::linear::Dynamics;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::identification::Identification;
use super::intervals::Intervals;
use super::options::loop_shift_name;
use super::records::{checked, signals, skips};
use crate::argument::Words;
use crate::convert::arguments::whole;
use crate::convert::errors;
use crate::stage::parts::points;

#[methods]
impl Identification {
    /// The modes of second-order dynamics from the lowest frequency up, each (frequency in Hz, damping ratio, gain); the gains
    /// sum to 1. Empty without such dynamics.
    #[getter]
    fn modes(&self) -> Vec<(f64, f64, f64)> {
        match (&self.found.modes, self.found.dynamics) {
            (Some(modes), _) => {
                let both = modes.modes().iter().zip(modes.gains());
                both.map(|(mode, gain)| (mode.frequency(), mode.damping(), *gain)).collect()
            }
            (None, Some(Dynamics::SecondOrder(mode))) => vec![(mode.frequency(), mode.damping(), 1.0)],
            (None, _) => Vec::new(),
        }
    }

    /// Standard errors of `modes`: of frequency, damping ratio and gain of each; a single mode has its gain of 1 without error.
    #[getter]
    fn modes_std(&self) -> Vec<(f64, f64, f64)> {
        let errors = &self.found.standard_errors;
        match (&self.found.modes, self.found.dynamics) {
            (Some(_), _) => errors.modes.iter().map(|of_mode| (*of_mode).into()).collect(),
            (None, Some(Dynamics::SecondOrder(_))) => vec![(errors.frequency, errors.damping, 0.0)],
            (None, _) => Vec::new(),
        }
    }

    /// The bandwidth of the amplifier in front of the hysteresis in Hz, if one was found.
    #[getter]
    fn amplifier_bandwidth(&self) -> Option<f64> {
        self.found.amplifier().map(|amplifier| amplifier.frequency())
    }

    /// The points (x, y) of the map in front of the hysteresis, if there is one: drive in, drive out.
    #[getter]
    fn input_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.found.input_map().as_ref().map(points)
    }

    /// The points (x, y) of the map behind the hysteresis, if there is one: position in, position out.
    #[getter]
    fn output_map(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.found.output_map().as_ref().map(points)
    }

    /// The samples of each record that were taken for glitches and left out of the fit, counted from 0 with the skipped ones. They
    /// enter none of the errors of the fit.
    #[getter]
    fn left_out_samples(&self) -> Vec<Vec<usize>> {
        self.found.left_out_samples.clone()
    }

    /// Measured minus modelled output of a record, all its samples: (n,) in the unit of y.
    ///
    /// Parameters
    /// ----------
    /// u, y : arrays of n floats
    ///     Input and measured output.
    /// record : int, optional
    ///     The number of the record among those that were fitted, or whose beginning was: then its output offset counts, and the
    ///     creep that was under way when it began. Without it the record has those that suit it best.
    /// skip : int or str
    ///     Leading samples that do not count for what suits it best, or a time.
    /// dt : float, optional
    ///     Sampling interval in seconds; by default that of the record, and of the first one without `record`.
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     That name the argument, what was expected and what came.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    /// >>> y = mh.paper.table_1_recovered().forward().run(u)
    /// >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    /// >>> bool(abs((found.residuals(u, y, record=0) ** 2).mean() ** 0.5 - found.fit.rmse) < 1e-12)
    /// True
    fn residuals<'py>(
        &self,
        py: Python<'py>,
        #[py("ArrayLike")] u: &Bound<'py, PyAny>,
        #[py("ArrayLike")] y: &Bound<'py, PyAny>,
        #[py(*, "int | None" = None)] record: Option<&Bound<'py, PyAny>>,
        #[py("Skip" = 0)] skip: Option<&Bound<'py, PyAny>>,
        #[py("float | None" = None)] dt: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let place = record.map(|record| whole::<usize>("record", record)).transpose()?;
        let records = self.found.output_offsets.len();
        if let Some(place) = place.filter(|place| *place >= records) {
            let expected = format_args!("expected a number below {records}, that of the fitted records, got {place}");
            return Err(errors::value("record", expected));
        }
        let signals = signals(u, Some(y))?;
        let intervals = match dt {
            None => self
                .found
                .dt
                .get(place.unwrap_or(0))
                .or(self.found.dt.first())
                .map_or_else(|| Intervals::from_python(None, 1), |dt| Ok(Intervals::known(&[*dt])))?,
            given => Intervals::from_python(given, 1)?,
        };
        let records = checked(&signals, skips(skip, 1, &intervals)?, &intervals, &[])?;
        Ok(PyArray1::from_vec(py, self.found.residuals(&records[0], place)))
    }

    /// What cross-validation said of the numbers of operators that were tried: pairs (operators, error), the error the geometric
    /// mean of the rms errors on the stretches that were held out; empty where the number was given.
    #[getter]
    fn cross_validation(&self) -> Vec<(usize, f64)> {
        self.found.cross_validation.iter().map(|one| (one.operators, one.typical_error())).collect()
    }

    /// What the weights might be: as given, or as cross-validation chose.
    #[getter]
    #[py(-> "Literal['free', 'quadratic', 'split']")]
    fn weights_law(&self) -> &'static str {
        self.found.weights.word()
    }

    /// What cross-validation said of every weight law: pairs (law, error) as in `cross_validation`; empty unless "auto".
    #[getter]
    #[py(-> "list[tuple[Literal['free', 'quadratic', 'split'], float]]")]
    fn weights_validation(&self) -> Vec<(&'static str, f64)> {
        self.found.weights_validation.iter().map(|one| (one.weights.word(), one.typical_error())).collect()
    }

    /// How smooth the weights were asked to be: as given, or as cross-validation chose.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.found.smoothness
    }

    /// What cross-validation said of the terms that may be left out: (number of amplitudes of creep, loop shift, error as in
    /// `cross_validation`), the best of every kind, the simplest first; empty if there was nothing to choose.
    #[getter]
    fn terms_validation(&self) -> Vec<(usize, String, f64)> {
        self.found
            .terms_validation
            .iter()
            .map(|one| (one.creep, loop_shift_name(one.loop_shift), one.typical_error()))
            .collect()
    }

    /// What cross-validation said of every smoothness: pairs (smoothness, error) as in `cross_validation`; empty unless
    /// "auto".
    #[getter]
    fn smoothness_validation(&self) -> Vec<(f64, f64)> {
        self.found.smoothness_validation.iter().map(|one| (one.smoothness, one.typical_error())).collect()
    }
}
