//! Numbers that an algorithm may compute with: doubles, and the sum of two where those lose too many digits.

use std::ops::Neg;

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, SVector, Scalar};

use crate::linalg::double_double::DoubleDouble;

/// A real number of some precision.
pub(crate) trait Real:
    Scalar
    + Copy
    + PartialOrd
    + From<f64>
    + Neg<Output = Self>
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
{
    /// The rounding of these numbers beside that of doubles.
    const ROUNDING: f64;

    /// The nearest double.
    fn value(self) -> f64;

    /// The product with a double.
    fn times(self, factor: f64) -> Self;

    fn square_root(self) -> Self;

    /// `sqrt(self^2 + other^2)`.
    fn hypotenuse(self, other: Self) -> Self;

    fn zero() -> Self {
        Self::from(0.0)
    }

    fn magnitude(self) -> Self {
        if self < Self::zero() { -self } else { self }
    }
}

impl Real for f64 {
    const ROUNDING: f64 = 1.0;

    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn times(self, factor: f64) -> f64 {
        self * factor
    }

    #[inline]
    fn square_root(self) -> f64 {
        self.sqrt()
    }

    #[inline]
    fn hypotenuse(self, other: f64) -> f64 {
        self.hypot(other)
    }
}

impl Real for DoubleDouble {
    /// Three digits are left to the operations that round more than once.
    const ROUNDING: f64 = 1e-13;

    fn value(self) -> f64 {
        Self::value(self)
    }

    fn times(self, factor: f64) -> Self {
        Self::times(self, factor)
    }

    fn square_root(self) -> Self {
        self.sqrt()
    }

    fn hypotenuse(self, other: Self) -> Self {
        (self * self + other * other).sqrt()
    }
}

#[inline]
pub(crate) fn dot<R: Real, const N: usize>(a: &SVector<R, N>, b: &SVector<R, N>) -> R {
    let mut sum = a[0] * b[0];
    for k in 1..N {
        sum += a[k] * b[k];
    }
    sum
}

#[inline]
pub(crate) fn norm<R: Real, const N: usize>(a: &SVector<R, N>) -> R {
    dot(a, a).square_root()
}

/// Each component as a double.
#[inline]
pub(crate) fn values<R: Real, const N: usize>(a: &SVector<R, N>) -> SVector<f64, N> {
    a.map(Real::value)
}
