//! What every operator and stream offers, written once, but for `step` and `peek`: those are in `single_argument`.

/// The Python methods of a class around a `Process`, its field `$field`: those that all have, and its own.
macro_rules! process_methods {
    ($class:ident, $field:tt { $($own:tt)* }) => {
        impl $crate::stream::single_argument::Stepper for $class {
            fn process(&self) -> &impl Process {
                &self.$field
            }

            fn process_mut(&mut self) -> &mut impl Process {
                &mut self.$field
            }
        }

        #[pymethods]
        impl $class {
            /// Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array.
            #[pyo3(signature = (input, out=None))]
            fn run<'py>(
                slf: &Bound<'py, Self>,
                input: &Bound<'py, PyAny>,
                out: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<Bound<'py, PyArray1<f64>>> {
                $crate::stream::blocks::run(input, out, |block| {
                    let mut process = $crate::convert::objects::exclusive(slf)?;
                    block.through(slf.py(), &mut $crate::stream::blocks::Single(&mut process.$field))
                })
            }

            /// Back to the start: at rest, or at the initial outputs that were given.
            fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
                $crate::convert::objects::exclusive(slf)?.$field.reset();
                Ok(())
            }

            /// How many samples were not finite, or beyond 1e100.
            #[getter]
            fn rejected(&self) -> u64 {
                self.$field.rejected()
            }

            $($own)*
        }
    };
}

pub(crate) use process_methods;
