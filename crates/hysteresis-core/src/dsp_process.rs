//! Streams as stages of the crate dsp-process, to be chained with the filters of idsp.

use dsp_process::{Inplace, Process};

use crate::embedded;
use crate::filter::Filter;
use crate::process::Process as Stream;
#[cfg(feature = "alloc")]
use crate::quasistatic::{QuasiStaticForward, QuasiStaticInverse};
use crate::real::Real;
#[cfg(feature = "alloc")]
use crate::stream::{Forward, Inverse};

/// One sample in, one out, as [`crate::Process::step`] does it. Of blocks of unequal lengths the shorter one counts.
macro_rules! stage {
    ([$($generics:tt)*] $number:ty, $stream:ty) => {
        impl<$($generics)*> Process<$number> for $stream {
            #[inline]
            fn process(&mut self, x: $number) -> $number {
                Stream::step(self, x)
            }

            #[inline]
            fn block(&mut self, x: &[$number], y: &mut [$number]) {
                for (x, y) in x.iter().zip(y) {
                    *y = Stream::step(self, *x);
                }
            }
        }

        impl<$($generics)*> Inplace<$number> for $stream {}
    };
}

stage!([T: Real, const N: usize, M: embedded::Holds<T, N>] T, embedded::Forward<T, N, M>);
stage!([T: Real, const N: usize, M: embedded::Holds<T, N>] T, embedded::Inverse<T, N, M>);
stage!([] f64, Filter);
#[cfg(feature = "alloc")]
stage!([] f64, Forward);
#[cfg(feature = "alloc")]
stage!([] f64, Inverse);
#[cfg(feature = "alloc")]
stage!([] f64, QuasiStaticForward);
#[cfg(feature = "alloc")]
stage!([] f64, QuasiStaticInverse);
