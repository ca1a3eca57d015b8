//! What every operator and stream offers, written once.

/// The Python methods of a class around a `Process`: those that all have, and its own.
macro_rules! process_methods {
    ($class:ident { $($own:tt)* }) => {
        #[pymethods]
        impl $class {
            /// Takes one sample and returns the output. A sample that is not finite leaves everything as it is.
            #[pyo3(signature = (sample, /))]
            fn step(&mut self, sample: f64) -> f64 {
                self.0.step(sample)
            }

            /// What `step` would return, without taking the sample.
            #[pyo3(signature = (sample, /))]
            fn peek(&self, sample: f64) -> f64 {
                self.0.peek(sample)
            }

            /// Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array.
            #[pyo3(signature = (input, out=None))]
            fn run<'py>(
                &mut self,
                input: &Bound<'py, PyAny>,
                out: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                $crate::arrays::run(&mut self.0, input, out)
            }

            /// Back to the start: at rest, or at the initial outputs that were given.
            fn reset(&mut self) {
                self.0.reset();
            }

            /// How many samples were not finite, or beyond 1e100.
            #[getter]
            fn rejected(&self) -> u64 {
                self.0.rejected()
            }

            $($own)*
        }
    };
}

pub(crate) use process_methods;
