//! Dual numbers: a value with its derivatives by all parameters.

use std::ops::{Add, Mul, Sub};

use hysteresis_control::oscillator::equation::Scalar;

/// A number with its derivatives by P parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dual<const P: usize> {
    value: f64,
    tangent: [f64; P],
}

impl<const P: usize> Dual<P> {
    /// Parameter `i`.
    pub(super) fn parameter(value: f64, i: usize) -> Self {
        Self { value, tangent: std::array::from_fn(|j| f64::from(u8::from(i == j))) }
    }

    pub(super) fn tangent(&self) -> &[f64; P] {
        &self.tangent
    }

    #[inline(always)]
    fn with(self, value: f64, other: &Self, join: impl Fn(f64, f64) -> f64) -> Self {
        let mut tangent = self.tangent;
        for (own, other) in tangent.iter_mut().zip(&other.tangent) {
            *own = join(*own, *other);
        }
        Self { value, tangent }
    }
}

impl<const P: usize> Add for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(self.value + other.value, &other, |p, q| p + q)
    }
}

impl<const P: usize> Sub for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(self.value - other.value, &other, |p, q| p - q)
    }
}

impl<const P: usize> Mul for Dual<P> {
    type Output = Self;

    #[inline(always)]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule")]
    fn mul(self, other: Self) -> Self {
        let (u, v) = (self.value, other.value);
        self.with(u * v, &other, |p, q| p * v + u * q)
    }
}

impl<const P: usize> Scalar for Dual<P> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, tangent: [0.0; P] }
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn scaled(self, by: f64) -> Self {
        self.with(self.value * by, &self, |p, _| p * by)
    }
}
